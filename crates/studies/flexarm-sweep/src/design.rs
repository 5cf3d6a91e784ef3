//! Design of a study: the values of the parameters in each run, given its number.
//!
//! Parameters with listed values form a full grid, in which the last one changes fastest;
//! parameters of the same `linked` group vary together. Parameters with a distribution are sampled
//! jointly, and every point of the grid uses the same samples. Not here: distributions and sampling
//! methods ([`crate::statistics`]), what a value changes ([`super::workshop`]).

use flexarm_run::RobotFileError;

use super::file::{ParameterEntry, Role, StudyFile, Values};
use super::metric::{Formula, Vocabulary};
use super::value::ParameterValue;
use crate::statistics::{Sample, grid_levels};

/// Column of the caveats of each run.
pub(super) const CAVEATS: &str = "caveats";

/// Parameter with a column in the table of runs.
#[derive(Clone, Debug)]
pub(super) struct Column {
    pub(super) name: String,
    pub(super) paths: Vec<String>,
    pub(super) role: Role,
    pub(super) values: Values,
    pub(super) place: RobotFileError,
    /// Group of linked parameters.
    linked: Option<String>,
}

/// Values of the columns in each run.
#[derive(Clone, Debug)]
pub(super) struct Design {
    pub(super) columns: Vec<Column>,
    /// Sizes of the grid, and the columns of each of its directions.
    sizes: Vec<usize>,
    directions: Vec<Vec<usize>>,
    /// Columns of random parameters.
    drawn: Vec<usize>,
    /// Columns computed from others.
    derived: Vec<(usize, Formula)>,
    sample: Sample,
    runs: usize,
}

/// Maximum number of runs of a study.
const MAX_RUNS: u64 = 5_000_000;

impl Column {
    /// Returns a column of a parameter entry.
    pub(super) fn of(entry: &ParameterEntry, name: String, paths: Vec<String>) -> Self {
        let ParameterEntry { role, values, place, linked, .. } = entry.clone();
        Self { name, paths, role, values, place, linked }
    }

    /// Whether the column belongs to a linked group.
    pub(super) fn is_linked_by(&self, word: &str) -> bool {
        self.linked.as_deref() == Some(word)
    }

    /// Whether all values are numbers.
    pub(super) fn is_numeric(&self) -> bool {
        match &self.values {
            Values::Levels(list) | Values::Choice(list) => list.iter().all(|value| value.number().is_some()),
            Values::Spread(_) | Values::Derived(_) => true,
        }
    }
}

/// Returns an error with the place of an entry.
fn fail(place: &RobotFileError, message: String) -> RobotFileError {
    RobotFileError { message, ..place.clone() }
}

/// Checks that the names are different, and free in the table of runs.
fn check_names(columns: &[Column]) -> Result<(), RobotFileError> {
    for (k, column) in columns.iter().enumerate() {
        let taken = columns[..k].iter().any(|other| other.name == column.name);
        if taken || ["run", "status", "reason", CAVEATS].contains(&column.name.as_str()) {
            let message =
                format!("the name {:?} is taken: give the parameter another one with name = \"...\"", column.name);
            return Err(fail(&column.place, message));
        }
    }
    Ok(())
}

impl Design {
    /// Builds the design from the columns of a study.
    ///
    /// # Errors
    /// With the place in the study: linked parameters with different numbers of values, too many
    /// runs or random parameters, duplicate names.
    pub(super) fn new(columns: Vec<Column>, file: &StudyFile) -> Result<Self, RobotFileError> {
        check_names(&columns)?;
        // Directions of the grid: one per listed parameter or linked group, all of one size.
        let (mut sizes, mut directions, mut drawn) = (Vec::new(), Vec::<Vec<usize>>::new(), Vec::new());
        for (k, column) in columns.iter().enumerate() {
            let levels = match &column.values {
                Values::Levels(levels) => levels,
                Values::Derived(_) => continue,
                Values::Spread(_) | Values::Choice(_) => {
                    drawn.push(k);
                    continue;
                }
            };
            let is_its =
                |direction: &Vec<usize>| column.linked.is_some() && columns[direction[0]].linked == column.linked;
            match directions.iter().position(is_its) {
                None => {
                    sizes.push(levels.len());
                    directions.push(vec![k]);
                }
                Some(known) if sizes[known] == levels.len() => directions[known].push(k),
                Some(known) => {
                    let (first, n) = (&columns[directions[known][0]].name, sizes[known]);
                    let message = format!(
                        "{:?} has {} values and is linked to {first:?}, which has {n}",
                        column.name,
                        levels.len()
                    );
                    return Err(fail(&column.place, message));
                }
            }
        }
        // Expressions, the sample, and the number of runs: grid points times samples.
        let derived = derived(&columns)?;
        let sample = Sample::new(file.method, drawn.len(), file.count, file.seed).ok_or_else(|| {
            let most = file.method.most_dimensions();
            let message = format!(
                "{} random parameters, the maximum of this method is {most}: use latin-hypercube or random",
                drawn.len()
            );
            fail(&file.sample_place, message)
        })?;
        let points = if drawn.is_empty() { 1 } else { sample.points() };
        let runs = sizes.iter().try_fold(points as u64, |all, n| all.checked_mul(*n as u64)).filter(|n| *n <= MAX_RUNS);
        let Some(runs) = runs else {
            let place = columns.first().map_or(&file.sample_place, |column| &column.place);
            return Err(fail(
                place,
                format!("the study has more than {MAX_RUNS} runs: use fewer values, or a sample instead of a grid"),
            ));
        };
        Ok(Self { columns, sizes, directions, drawn, derived, sample, runs: runs as usize })
    }

    /// Returns the number of runs.
    pub(super) fn runs(&self) -> usize {
        self.runs
    }

    /// Returns the number of points of the grid; run number divided by samples per point gives the
    /// point of a run.
    pub(super) fn grid_points(&self) -> usize {
        self.sizes.iter().product()
    }

    /// Directions of the grid: the columns and the number of values of each.
    pub(super) fn directions(&self) -> impl DoubleEndedIterator<Item = (&[usize], usize)> {
        self.directions.iter().map(Vec::as_slice).zip(self.sizes.iter().copied())
    }

    /// Columns of random parameters.
    pub(super) fn drawn(&self) -> &[usize] {
        &self.drawn
    }

    /// Returns the coordinates of the first, the middle and the last sampled point, which are
    /// bitwise equal on every machine but differ between versions that sample differently. Empty if
    /// there are no random parameters.
    pub(super) fn drawn_coordinates(&self) -> Vec<f64> {
        let points = self.sample.points();
        let places = [0, points / 2, points.saturating_sub(1)];
        let dimensions = 0..self.drawn.len();
        places.iter().flat_map(|point| dimensions.clone().map(|d| self.sample.coordinate(*point, d))).collect()
    }

    /// Returns the values of a run, in the order of the columns.
    pub(super) fn values(&self, run: usize) -> Vec<ParameterValue> {
        let points = self.runs / self.grid_points().max(1);
        let (grid, point) = (run / points.max(1), run % points.max(1));
        let levels = grid_levels(grid, &self.sizes);
        let mut values = vec![ParameterValue::Whole(0); self.columns.len()];
        for (direction, level) in self.directions.iter().zip(levels) {
            for column in direction {
                if let Values::Levels(list) = &self.columns[*column].values {
                    values[*column] = list[level].clone();
                }
            }
        }
        for (dimension, column) in self.drawn.iter().enumerate() {
            let u = self.sample.coordinate(point, dimension);
            values[*column] = match &self.columns[*column].values {
                Values::Spread(distribution) => ParameterValue::Number(distribution.quantile(u)),
                Values::Choice(list) => list[((u * list.len() as f64) as usize).min(list.len() - 1)].clone(),
                Values::Levels(_) | Values::Derived(_) => continue,
            };
        }
        self.derive(&mut values);
        values
    }

    /// Computes the values that depend on others.
    pub(super) fn derive(&self, values: &mut [ParameterValue]) {
        for (column, formula) in &self.derived {
            values[*column] = ParameterValue::Number(formula.of_parameters(values));
        }
    }
}

/// Parses the expressions of the columns computed from others.
fn derived(columns: &[Column]) -> Result<Vec<(usize, Formula)>, RobotFileError> {
    let mut found = Vec::new();
    for (k, column) in columns.iter().enumerate() {
        let Values::Derived(text) = &column.values else { continue };
        let fail = |message: String| RobotFileError {
            message: format!("parameter {:?}: {message}", column.name),
            ..column.place.clone()
        };
        let known = |(other, column): (usize, &Column)| {
            let is_known = column.is_numeric() && (other < k || !matches!(column.values, Values::Derived(_)));
            (is_known && other != k).then(|| column.name.clone())
        };
        let parameters: Vec<Option<String>> = columns.iter().enumerate().map(known).collect();
        let vocabulary = Vocabulary { parameters: &parameters, metrics: &[], summary: &serde_json::Value::Null };
        let formula = Formula::parse(text, &vocabulary).map_err(|error| fail(error.to_string()))?;
        if !formula.is_of_parameters() {
            return Err(fail(format!("expression {text:?}: only parameters defined before it are allowed")));
        }
        found.push((k, formula));
    }
    Ok(found)
}
