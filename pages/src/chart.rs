//! What a chart is made of.

use std::sync::Arc;

use serde::Serialize;

/// The horizontal axis of a chart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Axis {
    /// What it shows.
    pub label: String,
    /// Symbol of its unit of measure; empty for a count, which has marks at whole numbers only. Seconds (`s`) are told as
    /// minutes and hours where they are many.
    pub unit: String,
    /// Whether it is logarithmic.
    pub logarithmic: bool,
    /// Between which places the data lie, where bins at its ends reach further.
    pub within: Option<[f64; 2]>,
}

impl Axis {
    /// A linear axis.
    #[must_use]
    pub fn of(label: &str, unit: &str) -> Self {
        Self { label: label.to_owned(), unit: unit.to_owned(), logarithmic: false, within: None }
    }

    /// The same, logarithmic.
    #[must_use]
    pub fn logarithmic(self) -> Self {
        Self { logarithmic: true, ..self }
    }
}

/// Colours, by what they stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Ink {
    /// Raw readings.
    Raw,
    /// Corrected values; of two logs, those of the first.
    Corrected,
    /// What the second of two logs has.
    Other,
    /// What is known to be so.
    Truth,
    /// The first of several of a kind.
    First,
    /// The second of several of a kind.
    Second,
    /// The third of several of a kind.
    Third,
    /// The fourth of several of a kind.
    Fourth,
    /// The fifth of several of a kind.
    Fifth,
    /// The sixth of several of a kind.
    Sixth,
    /// What is to be seen at once.
    Alert,
    /// What stays in the background.
    Faint,
}

impl Ink {
    /// Colours for several of a kind.
    pub const SEVERAL: [Self; 6] =
        [Self::First, Self::Second, Self::Third, Self::Fourth, Self::Fifth, Self::Sixth];

    /// Colours for several of a kind, over and over again.
    pub fn several() -> impl Iterator<Item = Self> {
        Self::SEVERAL.into_iter().cycle()
    }
}

/// How the points of a series are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Form {
    /// Joined by lines; a value that is no number leaves a gap.
    Line,
    /// One by one.
    Dots,
}

/// The values of a series, in the order of their places.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// Each at its own place.
    Points {
        /// Places, not decreasing unless the series is drawn as dots. Series that share the list share it in the file too.
        x: Arc<[f64]>,
        /// Values; one that is not finite is a gap.
        y: Vec<f64>,
    },
    /// Many to each of a row of bins of equal width.
    Bins {
        /// Where the first bin begins.
        first: f64,
        /// Width of a bin (> 0).
        width: f64,
        /// The smallest value in each bin; one that is not finite is a gap.
        min: Vec<f64>,
        /// The largest.
        max: Vec<f64>,
        /// Their mean.
        mean: Vec<f64>,
    },
}

impl Samples {
    /// Points with places of their own.
    #[must_use]
    pub fn points(points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (x, y): (Vec<_>, Vec<_>) = points.into_iter().unzip();
        Self::Points { x: x.into(), y }
    }
}

/// A curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its name in the legend; those of the same name are shown and hidden together. What has one colour in several panels is
    /// named above all of them, the rest beside its panel.
    pub name: String,
    /// Its colour.
    pub ink: Ink,
    /// How it is drawn.
    pub form: Form,
    /// Which dashes its line has: 0 for none, 1, 2 and 3 tell it from others of its colour; 4 is as 0, and so on.
    pub dashes: usize,
    /// Its values.
    pub samples: Samples,
}

impl Series {
    /// Points that are joined by lines.
    #[must_use]
    pub fn line(name: impl Into<String>, ink: Ink, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { name: name.into(), ink, form: Form::Line, dashes: 0, samples: Samples::points(points) }
    }

    /// Points one by one.
    #[must_use]
    pub fn dots(name: impl Into<String>, ink: Ink, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self { form: Form::Dots, ..Self::line(name, ink, points) }
    }
}

/// Flags of many ticks, one bit each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bits(pub Vec<u32>);

/// From when to when something was the case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stretch {
    /// Where it begins.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
    /// What was the case.
    pub label: String,
    /// Its colour.
    pub ink: Ink,
}

/// A row that shows what is the case from when to when.
#[derive(Debug, Clone, PartialEq)]
pub enum Lane {
    /// Stretches with a beginning and an end.
    Stretches {
        /// Its name.
        name: String,
        /// They, in their order.
        stretches: Vec<Stretch>,
    },
    /// One bit of each tick.
    Bit {
        /// Its name.
        name: String,
        /// Its colour.
        ink: Ink,
        /// Which bit (0…31).
        bit: u32,
        /// The flags; lanes that share the list share it in the file too.
        bits: Arc<Bits>,
        /// Places of the ticks, or first place and width of the bins, as of a series with as many values.
        places: Places,
    },
}

/// Where the ticks of a lane are.
#[derive(Debug, Clone, PartialEq)]
pub enum Places {
    /// Each at its own place.
    Points(Arc<[f64]>),
    /// In bins of equal width.
    Bins {
        /// Where the first bin begins.
        first: f64,
        /// Width of a bin (> 0).
        width: f64,
    },
}

/// What a panel shows.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Curves over a vertical axis.
    Series(Vec<Series>),
    /// Rows, one below the other.
    Lanes(Vec<Lane>),
}

/// A diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What it shows; may be empty where the unit of measure says it.
    pub title: String,
    /// Symbol of the unit of measure of its vertical axis; empty for lanes.
    pub unit: String,
    /// Height of the diagram (CSS pixels); of lanes each row has its own, and this is not used.
    pub height: u32,
    /// Whether its vertical axis is logarithmic.
    pub logarithmic: bool,
    /// What is in it.
    pub content: Content,
}

impl Panel {
    /// Curves over a linear axis, so high (CSS pixels).
    #[must_use]
    pub fn of(title: impl Into<String>, unit: impl Into<String>, height: u32, curves: Vec<Series>) -> Self {
        let content = Content::Series(curves);
        Self { title: title.into(), unit: unit.into(), height, logarithmic: false, content }
    }

    /// The same over a logarithmic axis.
    #[must_use]
    pub fn logarithmic(self) -> Self {
        Self { logarithmic: true, ..self }
    }
}

/// Something that happened at one place of the axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mark {
    /// Where.
    pub x: f64,
    /// What kind of thing: its name in the legend. Those of a kind are shown and hidden together.
    pub kind: String,
    /// What happened, in words.
    pub words: String,
    /// Its colour.
    pub ink: Ink,
}

/// Panels over a common horizontal axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// What is to be seen, in words.
    pub caption: String,
    /// The axis.
    pub x: Axis,
    /// From top to bottom.
    pub panels: Vec<Panel>,
    /// What happened on the way.
    pub marks: Vec<Mark>,
}

impl Chart {
    /// Panels with nothing that happened on the way.
    #[must_use]
    pub fn of(caption: impl Into<String>, x: Axis, panels: Vec<Panel>) -> Self {
        Self { caption: caption.into(), x, panels, marks: Vec::new() }
    }
}
