//! Exudyn `FEMinterface.SaveToFile` in HDF5: full stiffness and mass, three components per node.
//!
//! The default `.npz` contains pickled Python objects, which other programs cannot read.

use std::cell::Cell;
use std::collections::BTreeMap;

use hdf5_pure::File;
use nalgebra::Vector3;

use super::error::{ErrorPosition, ExchangeError, ExchangeErrorKind};
use super::matrix::{DofLabel, LabelledMatrix, Storage, Triplets};
use super::text::LARGEST_UNPACKED;
use crate::unpack::allowed_unpacked;

/// Contents of an Exudyn file; nodes are numbered from 0, as in Exudyn.
pub(super) struct Exudyn {
    pub(super) stiffness: LabelledMatrix,
    pub(super) mass: LabelledMatrix,
    pub(super) positions: BTreeMap<i64, Vector3<f64>>,
    pub(super) node_sets: BTreeMap<String, Vec<i64>>,
}

/// Open file; errors name the data set.
struct Reader<'a> {
    file: File,
    size: usize,
    /// Remaining number of bytes that may be read; several names may refer to the same data.
    left: Cell<u64>,
    place: ErrorPosition<'a>,
}

/// Reads the matrices, positions and node sets.
pub(super) fn parse(bytes: &[u8], origin: &str) -> Result<Exudyn, ExchangeError> {
    let place = ErrorPosition::file(origin);
    let syntax = |error: hdf5_pure::Error| {
        place.fail(ExchangeErrorKind::Syntax, "file", error.to_string(), "HDF5", "is the file cut off?")
    };
    let file = File::from_bytes(bytes.to_vec()).map_err(syntax)?;
    let reader =
        Reader { file, size: bytes.len(), left: Cell::new(allowed_unpacked(bytes.len(), LARGEST_UNPACKED)), place };
    let points = reader.reals("nodes/Position")?;
    if points.is_empty() || !points.len().is_multiple_of(3) {
        let found = format!("{} numbers", points.len());
        return Err(reader.fail("nodes/Position", found, "three per node"));
    }
    let positions: BTreeMap<i64, _> =
        points.chunks_exact(3).enumerate().map(|(i, p)| (i as i64, Vector3::new(p[0], p[1], p[2]))).collect();
    let rows: Vec<_> = (0..points.len()).map(|i| DofLabel::new((i / 3) as i64, (i % 3) as u8 + 1)).collect();
    Ok(Exudyn {
        stiffness: reader.matrix("stiffnessMatrix", &rows)?,
        mass: reader.matrix("massMatrix", &rows)?,
        node_sets: reader.node_sets(positions.len()),
        positions,
    })
}

impl Reader<'_> {
    fn fail(&self, what: &str, found: impl Into<Box<str>>, expected: &str) -> ExchangeError {
        let help = "write it with Exudyn's FEMinterface.SaveToFile and the ending .hdf5";
        self.place.fail(ExchangeErrorKind::Syntax, what, found, expected, help)
    }

    /// Opens a data set, with an error if its size is impossible for the file: packed data expands
    /// at most a thousandfold, and the total read stays below [`LARGEST_UNPACKED`].
    fn dataset(&self, name: &str) -> Result<hdf5_pure::Dataset, ExchangeError> {
        let wrong = |error: hdf5_pure::Error| self.fail(name, error.to_string(), "this data set");
        let dataset = self.file.dataset(name).map_err(wrong)?;
        let (shape, width) = (dataset.shape().map_err(wrong)?, dataset.element_size().map_err(wrong)?);
        let count = shape.iter().try_fold(1_u64, |product, n| product.checked_mul(*n));
        let bytes = |width| count.and_then(|count| count.checked_mul(width));
        if bytes(width).is_none_or(|bytes| bytes > 1100 * self.size as u64) {
            return Err(self.fail(name, "more numbers than the file can hold", "its own size"));
        }
        // Each number becomes 8 bytes, even if it is shorter in the file.
        match bytes(width.max(8)).and_then(|bytes| self.left.get().checked_sub(bytes)) {
            Some(left) => self.left.set(left),
            None => {
                let expected = "no more bytes in all data sets together than a file of this size may hold".to_owned();
                return Err(self.fail(name, format!("{shape:?} numbers"), &expected));
            }
        }
        Ok(dataset)
    }

    fn reals(&self, name: &str) -> Result<Vec<f64>, ExchangeError> {
        let wrong = |error: hdf5_pure::Error| self.fail(name, error.to_string(), "real numbers");
        let values = self.dataset(name)?.read_f64().map_err(wrong)?;
        if let Some(value) = values.iter().find(|value| !value.is_finite()) {
            let kind = ExchangeErrorKind::NotFinite;
            return Err(self.place.fail(kind, name, value.to_string(), "finite numbers", ""));
        }
        Ok(values)
    }

    fn integers(&self, name: &str) -> Result<Vec<i64>, ExchangeError> {
        let wrong = |error: hdf5_pure::Error| self.fail(name, error.to_string(), "whole numbers");
        let dataset = self.dataset(name)?;
        let short = || Some(dataset.read_i32().ok()?.into_iter().map(i64::from).collect());
        dataset.read_i64().or_else(|error| short().ok_or(error)).map_err(wrong)
    }

    /// Reads a matrix in compressed row format: `data`, `indices`, `indptr`.
    fn matrix(&self, name: &str, rows: &[DofLabel]) -> Result<LabelledMatrix, ExchangeError> {
        let n = rows.len();
        let values = self.reals(&format!("{name}/data"))?;
        let columns = self.integers(&format!("{name}/indices"))?;
        let starts = self.integers(&format!("{name}/indptr"))?;
        if starts.len() != n + 1 || columns.len() != values.len() {
            let found = format!("{} rows, {} columns, {} values", starts.len(), columns.len(), values.len());
            return Err(self.fail(
                name,
                found,
                &format!("{} row starts, as there are nodes; a column per value", n + 1),
            ));
        }
        let mut triplets = Triplets::default();
        for (row, ends) in starts.windows(2).enumerate() {
            let range = usize::try_from(ends[0]).ok().zip(usize::try_from(ends[1]).ok());
            let Some(range) = range.filter(|(start, end)| start <= end && *end <= values.len()) else {
                return Err(self.fail(name, format!("row {row} from {} to {}", ends[0], ends[1]), "rising row starts"));
            };
            for i in range.0..range.1 {
                let column = usize::try_from(columns[i]).ok().filter(|column| *column < n);
                let Some(column) = column else {
                    return Err(self.fail(name, format!("column {}", columns[i]), &format!("0 to {}", n - 1)));
                };
                triplets.push(row, column, values[i], &self.place);
            }
        }
        triplets.symmetric(name, self.place.origin, rows.to_vec(), Storage::Sparse)
    }

    /// Reads the node sets by name; unreadable ones are skipped, because nothing depends on them.
    fn node_sets(&self, nodes: usize) -> BTreeMap<String, Vec<i64>> {
        const MOST_SETS: usize = 1000;
        let set = |i: usize| {
            let folder = format!("nodeSets/item_{i}");
            let numbers = self.integers(&format!("{folder}/NodeNumbers")).ok()?;
            let name = self.dataset(&format!("{folder}/Name")).ok()?.read_string().ok()?.into_iter().next();
            let inside = numbers.iter().all(|node| (0..nodes as i64).contains(node));
            inside.then(|| (name.unwrap_or_else(|| format!("set {i}")), numbers))
        };
        (0..MOST_SETS).map_while(set).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_is_read_than_the_limit_in_all_data_sets_together() {
        let mut builder = hdf5_pure::FileBuilder::new();
        builder.create_dataset("numbers").with_f64_data(&[1.0; 100]);
        builder.create_dataset("short").with_i32_data(&[1; 100]);
        let bytes = builder.finish().unwrap();
        let reader = |left| Reader {
            file: File::from_bytes(bytes.clone()).unwrap(),
            size: bytes.len(),
            left: Cell::new(left),
            place: ErrorPosition::file("t.hdf5"),
        };
        let read = reader(1600);
        assert_eq!((read.reals("numbers").unwrap().len(), read.integers("short").unwrap().len()), (100, 100));
        let error = read.reals("numbers").unwrap_err();
        assert!(error.to_string().contains("than a file of this size may hold"), "{error}");
        assert!(reader(799).integers("short").is_err());
    }

    #[test]
    fn a_size_that_the_file_cannot_hold_is_refused() {
        let mut builder = hdf5_pure::FileBuilder::new();
        builder.create_dataset("numbers").with_f64_data(&[1.0; 100]);
        let bytes = builder.finish().unwrap();
        let file = File::from_bytes(bytes).unwrap();
        // A valid file of 800 bytes of numbers, with a wrong file size.
        let small = Reader { file, size: 0, left: Cell::new(LARGEST_UNPACKED), place: ErrorPosition::file("t.hdf5") };
        assert!(small.reals("numbers").unwrap_err().to_string().contains("than the file can hold"));
    }
}
