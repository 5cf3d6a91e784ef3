//! Exudyn `FEMinterface.SaveToFile` in HDF5: the full stiffness and mass, three components per node.
//!
//! The default `.npz` holds pickled Python objects, which no other program reads.

use std::collections::BTreeMap;

use hdf5_pure::File;
use nalgebra::Vector3;

use super::error::{ExchangeError, ExchangeErrorKind, Place};
use super::matrix::{DofLabel, LabelledMatrix, Storage, Triplets};

/// What a file of Exudyn holds; nodes are counted from 0, as Exudyn does.
pub(super) struct Exudyn {
    pub(super) stiffness: LabelledMatrix,
    pub(super) mass: LabelledMatrix,
    pub(super) positions: BTreeMap<i64, Vector3<f64>>,
    pub(super) node_sets: BTreeMap<String, Vec<i64>>,
}

/// An open file; errors name the data set.
struct Reader<'a> {
    file: File,
    size: usize,
    place: Place<'a>,
}

/// Reads the matrices, the positions and the node sets.
pub(super) fn parse(bytes: &[u8], origin: &str) -> Result<Exudyn, ExchangeError> {
    let place = Place::file(origin);
    let syntax = |error: hdf5_pure::Error| {
        place.fail(ExchangeErrorKind::Syntax, "file", error.to_string(), "HDF5", "is the file cut off?")
    };
    let reader = Reader { file: File::from_bytes(bytes.to_vec()).map_err(syntax)?, size: bytes.len(), place };
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

    /// A data set whose size the file can have: packed data grow at most a thousandfold.
    fn dataset(&self, name: &str) -> Result<hdf5_pure::Dataset, ExchangeError> {
        let wrong = |error: hdf5_pure::Error| self.fail(name, error.to_string(), "this data set");
        let dataset = self.file.dataset(name).map_err(wrong)?;
        let count = dataset.shape().map_err(wrong)?.iter().try_fold(1_u64, |product, n| product.checked_mul(*n));
        if count.is_none_or(|count| count > 1000 * self.size as u64) {
            return Err(self.fail(name, "more numbers than the file can hold", "its own size"));
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

    /// A matrix in compressed rows: `data`, `indices`, `indptr`.
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

    /// Node sets by name; what cannot be read is left out, for nothing depends on it.
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
