//! A Parquet file that is written row by row, in constant memory.

use std::fs::File;
use std::io::{self, BufWriter, IntoInnerError};
use std::mem;
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{ColumnPath, Type, TypePtr};

use isotherm_log::error::Error;
use isotherm_log::file::Partial;

/// Rows that are written together, where the file does not need larger groups.
const GROUP_ROWS: u64 = 1 << 14;
/// Most groups of a file: the format numbers them with 15 bits.
const MOST_GROUPS: u64 = 30_000;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Whole numbers of so many bits, signed or not.
    Integer(i8, bool),
    /// Doubles.
    Double,
    /// Yes or no.
    Boolean,
    /// Text.
    Text,
    /// JSON as text.
    Json,
}

/// Signed 64 bits.
pub(super) const I64: Kind = Kind::Integer(64, true);
/// Unsigned 64 bits.
pub(super) const U64: Kind = Kind::Integer(64, false);
/// Signed 32 bits.
pub(super) const I32: Kind = Kind::Integer(32, true);

/// A column, and the values of it that wait for their group.
#[derive(Debug)]
pub(super) struct Column {
    /// Its name, with the unit of measure.
    name: String,
    kind: Kind,
    /// Cells may be empty.
    optional: bool,
    values: Values,
    /// 1 where there is a value, 0 where there is none; for optional columns.
    present: Vec<i16>,
}

#[derive(Debug)]
enum Values {
    Int32(Vec<i32>),
    Int64(Vec<i64>),
    Double(Vec<f64>),
    Boolean(Vec<bool>),
    Text(Vec<ByteArray>),
}

/// A column that has a value in every row.
pub(super) fn full(name: impl Into<String>, kind: Kind) -> Column {
    let values = match kind {
        Kind::Integer(64, _) => Values::Int64(Vec::new()),
        Kind::Integer(..) => Values::Int32(Vec::new()),
        Kind::Double => Values::Double(Vec::new()),
        Kind::Boolean => Values::Boolean(Vec::new()),
        Kind::Text | Kind::Json => Values::Text(Vec::new()),
    };
    Column { name: name.into(), kind, optional: false, values, present: Vec::new() }
}

/// A column that may be empty.
pub(super) fn sparse(name: impl Into<String>, kind: Kind) -> Column {
    Column { optional: true, ..full(name, kind) }
}

/// One cell of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cell<'a> {
    /// Nothing.
    Empty,
    /// A whole number; unsigned ones of 64 bits by their bits.
    Integer(i64),
    /// A double.
    Double(f64),
    /// Yes or no.
    Boolean(bool),
    /// Text.
    Text(&'a str),
}

impl From<u64> for Cell<'_> {
    fn from(number: u64) -> Self {
        Self::Integer(number.cast_signed())
    }
}

impl From<i64> for Cell<'_> {
    fn from(number: i64) -> Self {
        Self::Integer(number)
    }
}

impl From<f64> for Cell<'_> {
    fn from(number: f64) -> Self {
        Self::Double(number)
    }
}

impl From<bool> for Cell<'_> {
    fn from(boolean: bool) -> Self {
        Self::Boolean(boolean)
    }
}

impl<'a> From<&'a str> for Cell<'a> {
    fn from(text: &'a str) -> Self {
        Self::Text(text)
    }
}

impl<'a, T: Into<Cell<'a>>> From<Option<T>> for Cell<'a> {
    fn from(cell: Option<T>) -> Self {
        cell.map_or(Self::Empty, Into::into)
    }
}

/// A row that is being given cell by cell; each cell names its column, so that the first row gives a table its columns.
pub(super) struct Row<'t> {
    columns: &'t mut Vec<Column>,
    /// Place of the next cell's column.
    next: usize,
    /// The first cell that did not fit.
    misfit: Option<String>,
}

impl Row<'_> {
    /// A cell of a column that has a value in every row.
    pub(super) fn full<'a>(&mut self, name: &str, kind: Kind, cell: impl Into<Cell<'a>>) {
        self.each(1, |_| full(name, kind), [cell]);
    }

    /// A cell of a column that may be empty.
    pub(super) fn sparse<'a>(&mut self, name: &str, kind: Kind, cell: impl Into<Cell<'a>>) {
        self.each(1, |_| sparse(name, kind), [cell]);
    }

    /// The cells of so many columns; where there are fewer, the last are empty.
    pub(super) fn each<'a, T: Into<Cell<'a>>>(
        &mut self,
        count: usize,
        column: impl Fn(usize) -> Column,
        cells: impl IntoIterator<Item = T>,
    ) {
        let mut cells = cells.into_iter().map(Into::into);
        for n in 0..count {
            if self.next == self.columns.len() {
                self.columns.push(column(n));
            }
            let cell = cells.next().unwrap_or(Cell::Empty);
            if let Some(column) = self.columns.get_mut(self.next)
                && !column.push(cell)
            {
                let misfit = || format!("{cell:?} does not fit the column {:?}", column.name);
                self.misfit.get_or_insert_with(misfit);
            }
            self.next += 1;
        }
    }
}

/// A Parquet file that is being written.
pub(super) struct Table {
    file: File,
    /// From the first group on: the first row gives the columns.
    writer: Option<SerializedFileWriter<BufWriter<File>>>,
    partial: Partial,
    columns: Vec<Column>,
    provenance: Vec<KeyValue>,
    group_rows: u64,
    /// Rows that wait.
    waiting: u64,
    rows: u64,
}

impl std::fmt::Debug for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Table")
            .field("partial", &self.partial)
            .field("rows", &self.rows)
            .finish_non_exhaustive()
    }
}

impl Table {
    /// Creates the file for about so many rows. `provenance`: names and values for the file's metadata.
    pub(super) fn create(
        mut partial: Partial,
        expected_rows: u64,
        provenance: Vec<(String, String)>,
    ) -> Result<Self, Error> {
        Ok(Self {
            file: partial.create()?,
            writer: None,
            partial,
            columns: Vec::new(),
            provenance: provenance.into_iter().map(|(name, value)| KeyValue::new(name, value)).collect(),
            group_rows: GROUP_ROWS.max(expected_rows / MOST_GROUPS + 1),
            waiting: 0,
            rows: 0,
        })
    }

    /// Writes one row, which gives a cell for each column.
    pub(super) fn push(&mut self, row: impl FnOnce(&mut Row<'_>)) -> Result<(), Error> {
        let mut cells = Row { columns: &mut self.columns, next: 0, misfit: None };
        row(&mut cells);
        if let Some(words) = cells.misfit {
            return Err(self.failed(words));
        }
        self.rows += 1;
        self.waiting += 1;
        if self.waiting < self.group_rows {
            return Ok(());
        }
        self.write_group().map_err(|error| self.failed(error))
    }

    /// Ends the file, on the disk: it is to be given its name; and its rows.
    pub(super) fn finish(mut self) -> Result<(Partial, u64), Error> {
        let written = self.write_group().and_then(|()| self.writer.take().map_or(Ok(()), on_disk));
        written.map_err(|error| self.failed(error))?;
        Ok((self.partial, self.rows))
    }

    fn failed(&self, error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Error {
        Error::file(self.partial.path(), "write", io::Error::other(error))
    }

    /// Writes the rows that wait.
    fn write_group(&mut self) -> Result<(), ParquetError> {
        let mut writer = match self.writer.take() {
            Some(writer) => writer,
            None => open(BufWriter::new(self.file.try_clone()?), &self.columns, &self.provenance)?,
        };
        if self.waiting > 0 {
            let mut group = writer.next_row_group()?;
            self.columns.iter_mut().try_for_each(|column| column.write(&mut group))?;
            group.close()?;
        }
        (self.writer, self.waiting) = (Some(writer), 0);
        Ok(())
    }
}

impl Column {
    /// Takes a cell; false where it does not fit.
    fn push(&mut self, cell: Cell<'_>) -> bool {
        if cell == Cell::Empty && self.optional {
            self.present.push(0);
            return true;
        }
        let fits = match (&mut self.values, cell) {
            (Values::Int64(values), Cell::Integer(number)) => push(values, number),
            (Values::Int32(values), Cell::Integer(number)) => match i32::try_from(number) {
                Ok(number) => push(values, number),
                Err(_) => false,
            },
            (Values::Double(values), Cell::Double(number)) => push(values, number),
            (Values::Boolean(values), Cell::Boolean(boolean)) => push(values, boolean),
            (Values::Text(values), Cell::Text(text)) => push(values, ByteArray::from(text)),
            _ => false,
        };
        if self.optional && fits {
            self.present.push(1);
        }
        fits
    }

    /// Writes what waits as the group's next column.
    fn write(
        &mut self,
        group: &mut SerializedRowGroupWriter<'_, BufWriter<File>>,
    ) -> Result<(), ParquetError> {
        let present = mem::take(&mut self.present);
        let present = self.optional.then_some(present.as_slice());
        match &mut self.values {
            Values::Int32(values) => write::<Int32Type>(group, values, present),
            Values::Int64(values) => write::<Int64Type>(group, values, present),
            Values::Double(values) => write::<DoubleType>(group, values, present),
            Values::Boolean(values) => write::<BoolType>(group, values, present),
            Values::Text(values) => write::<ByteArrayType>(group, values, present),
        }
    }
}

fn push<T>(values: &mut Vec<T>, value: T) -> bool {
    values.push(value);
    true
}

/// Writes the values of one column and forgets them.
fn write<D: DataType>(
    group: &mut SerializedRowGroupWriter<'_, BufWriter<File>>,
    values: &mut Vec<D::T>,
    present: Option<&[i16]>,
) -> Result<(), ParquetError> {
    let column = group.next_column()?;
    let mut column = column.ok_or_else(|| ParquetError::General("a column too many".to_owned()))?;
    column.typed::<D>().write_batch(values, present, None)?;
    values.clear();
    column.close()
}

/// The writer of a file with these columns.
fn open(
    file: BufWriter<File>,
    columns: &[Column],
    provenance: &[KeyValue],
) -> Result<SerializedFileWriter<BufWriter<File>>, ParquetError> {
    let fields = columns.iter().map(field).collect::<Result<Vec<TypePtr>, _>>()?;
    let schema = Type::group_type_builder("schema").with_fields(fields).build()?;
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by(concat!("isotherm ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_key_value_metadata(Some(provenance.to_vec()));
    for column in columns {
        let path = ColumnPath::new(vec![column.name.clone()]);
        match column.kind {
            // Sequences and times go on evenly: their differences are short.
            Kind::Integer(64, _) => {
                properties = properties
                    .set_column_dictionary_enabled(path.clone(), false)
                    .set_column_encoding(path, Encoding::DELTA_BINARY_PACKED);
            }
            Kind::Double | Kind::Boolean => {
                properties = properties.set_column_dictionary_enabled(path, false);
            }
            _ => {}
        }
    }
    SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties.build()))
}

/// Ends a file.
fn on_disk(writer: SerializedFileWriter<BufWriter<File>>) -> Result<(), ParquetError> {
    let file = writer.into_inner()?.into_inner().map_err(IntoInnerError::into_error)?;
    Ok(file.sync_all()?)
}

/// A column as the format has it.
fn field(column: &Column) -> Result<TypePtr, ParquetError> {
    let (physical, logical) = match column.kind {
        Kind::Integer(64, signed) => (Physical::INT64, Some(LogicalType::integer(64, signed))),
        Kind::Integer(bits, signed) => (Physical::INT32, Some(LogicalType::integer(bits, signed))),
        Kind::Double => (Physical::DOUBLE, None),
        Kind::Boolean => (Physical::BOOLEAN, None),
        Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        Kind::Json => (Physical::BYTE_ARRAY, Some(LogicalType::Json)),
    };
    let repetition = if column.optional { Repetition::OPTIONAL } else { Repetition::REQUIRED };
    let field = Type::primitive_type_builder(&column.name, physical)
        .with_repetition(repetition)
        .with_logical_type(logical);
    field.build().map(Arc::new)
}
