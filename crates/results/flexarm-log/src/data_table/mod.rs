//! Tables of results that are no recording of a run: whole numbers, numbers and texts in columns
//! with names.
//!
//! Written and read as Parquet (`data_table/file.rs`), in builds that have it.

#[cfg(feature = "parquet")]
mod file;

/// Values of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum DataValues {
    /// Whole numbers, none missing.
    Whole(Vec<i64>),
    /// Numbers; NaN are missing.
    Number(Vec<f64>),
    /// Texts.
    Text(Vec<Option<String>>),
}

/// A column with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct DataColumn {
    /// Its name.
    pub name: String,
    /// Its values.
    pub values: DataValues,
}

/// A table: columns of equal length, and texts about it all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DataTable {
    /// The columns.
    pub columns: Vec<DataColumn>,
    /// Texts by key.
    pub texts: Vec<(String, String)>,
}

impl DataColumn {
    /// A column.
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

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl DataTable {
    /// Number of rows: the columns are equally long.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// The column of a name.
    pub fn column(&self, name: &str) -> Option<&DataValues> {
        self.columns.iter().find(|column| column.name == name).map(|column| &column.values)
    }
}
