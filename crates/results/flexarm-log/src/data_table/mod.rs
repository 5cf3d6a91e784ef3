//! Result tables other than recordings of a run: named columns of integers, numbers and texts.
//!
//! They are written and read as Parquet (`data_table/file.rs`) in builds with that feature.

#[cfg(feature = "parquet")]
mod file;

/// Values of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum DataValues {
    /// Integers, none missing.
    Whole(Vec<i64>),
    /// Numbers; NaN marks a missing value.
    Number(Vec<f64>),
    /// Texts; `None` marks a missing value.
    Text(Vec<Option<String>>),
}

/// A named column.
#[derive(Clone, Debug, PartialEq)]
pub struct DataColumn {
    /// Name of the column.
    pub name: String,
    /// Values of the column.
    pub values: DataValues,
}

/// A table: columns of equal length, and texts that describe the whole table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DataTable {
    /// The columns.
    pub columns: Vec<DataColumn>,
    /// Texts as pairs of key and value.
    pub texts: Vec<(String, String)>,
}

impl DataColumn {
    /// Creates a column.
    pub fn new(name: impl Into<String>, values: DataValues) -> Self {
        Self { name: name.into(), values }
    }
}

impl DataValues {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::Whole(values) => values.len(),
            Self::Number(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    /// Whether there are no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl DataTable {
    /// Number of rows, the length of every column.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// Returns the values of the column with this name.
    pub fn column(&self, name: &str) -> Option<&DataValues> {
        self.columns.iter().find(|column| column.name == name).map(|column| &column.values)
    }
}
