//! How bytes become rows and cells.

use schemars::JsonSchema;
use serde::Deserialize;

/// Encoding of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[schemars(inline)]
pub enum Encoding {
    /// UTF-8.
    #[default]
    #[serde(rename = "utf-8")]
    Utf8,
    /// UTF-16, the lower byte first.
    #[serde(rename = "utf-16le")]
    Utf16Le,
    /// UTF-16, the higher byte first.
    #[serde(rename = "utf-16be")]
    Utf16Be,
    /// ISO 8859-1, or Windows-1252, which has characters in the place of its control characters.
    #[serde(rename = "latin-1")]
    Latin1,
}

impl Encoding {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Utf8, Self::Utf16Le, Self::Utf16Be, Self::Latin1];

    /// As the mapping spells it.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Utf8 => "utf-8",
            Self::Utf16Le => "utf-16le",
            Self::Utf16Be => "utf-16be",
            Self::Latin1 => "latin-1",
        }
    }
}

/// What stands between two cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum Delimiter {
    /// `,`; as with the other characters, cells may be quoted with `"`.
    Comma,
    /// `;`.
    Semicolon,
    /// A tab.
    Tab,
    /// `|`.
    Pipe,
    /// Any run of spaces and tabs; leading ones do not count.
    Whitespace,
}

impl Delimiter {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Comma, Self::Semicolon, Self::Tab, Self::Pipe, Self::Whitespace];

    const fn spelled(self) -> (&'static str, Option<u8>) {
        match self {
            Self::Comma => ("comma", Some(b',')),
            Self::Semicolon => ("semicolon", Some(b';')),
            Self::Tab => ("tab", Some(b'\t')),
            Self::Pipe => ("pipe", Some(b'|')),
            Self::Whitespace => ("whitespace", None),
        }
    }

    /// As the mapping spells it.
    #[must_use]
    pub const fn word(self) -> &'static str {
        self.spelled().0
    }

    /// The character, where it is one.
    pub(crate) const fn byte(self) -> Option<u8> {
        self.spelled().1
    }
}

/// What happens to a row that cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum OnBadRow {
    /// Reading ends with an error.
    #[default]
    Refuse,
    /// The row is passed over and counted; its tick becomes a gap.
    Skip,
}

/// How bytes become rows and cells.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
pub struct Layout {
    /// Encoding of the text.
    #[serde(default)]
    pub encoding: Encoding,
    /// What stands between two cells.
    pub delimiter: Delimiter,
    /// Lines that begin with this are passed over.
    #[schemars(
        regex(pattern = r"^[^0-9\s+\-.]"),
        extend("x-must-be" = "a prefix that no row of numbers begins with, and not empty")
    )]
    pub comment: Option<String>,
    /// Lines in front, neither blank nor comments, that are passed over.
    #[serde(default)]
    #[schemars(range(max = 1_000_000))]
    pub skip_lines: u64,
    /// Whether the next line names the columns.
    #[serde(default)]
    pub header: bool,
    /// Rows of data in front that are passed over.
    #[serde(default)]
    #[schemars(range(max = 1_000_000))]
    pub drop_rows: u64,
    /// Decimal mark.
    #[serde(default)]
    pub decimal_mark: DecimalMark,
    /// What happens to a row that cannot be read.
    #[serde(default)]
    pub on_bad_row: OnBadRow,
}

/// Decimal mark of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[schemars(inline)]
#[repr(u8)]
pub enum DecimalMark {
    /// A point.
    #[default]
    #[serde(rename = ".")]
    Point = b'.',
    /// A comma.
    #[serde(rename = ",")]
    Comma = b',',
}
