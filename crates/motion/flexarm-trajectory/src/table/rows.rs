//! Values of the columns in use, row by row.
//!
//! Start at [`Table::rows`]. All wrong rows are found, not only the first. Values are in SI units
//! by the factors of the layout; times stay as written, and their differences are exact. Not here:
//! interpolation between the rows (`spline`).

use flexarm_settings::Finding;

use super::dialect::{Decimal, Separator, clock_time, exact, number};
use super::layout::{Layout, Used};
use super::lines::Table;
use crate::findings::fault;
use crate::spline::JointSamples;

/// Maximum number of values kept.
const MAX_NUMBERS: usize = 30_000_000;

/// A time as written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Time {
    pub(super) exact: Option<i128>,
    pub(super) value: f64,
}

impl Default for Time {
    fn default() -> Self {
        Self { exact: Some(0), value: 0.0 }
    }
}

impl Time {
    /// Time elapsed since another one, without rounding either of them first.
    pub(super) fn since(self, other: Self) -> f64 {
        match (self.exact, other.exact) {
            (_, Some(0)) => self.value,
            (Some(this), Some(other)) => (this - other) as f64 / 1e12,
            _ => self.value - other.value,
        }
    }
}

/// Values of the columns in use, in the order of the layout.
#[derive(Default)]
pub(super) struct Rows {
    pub(super) lines: Vec<usize>,
    pub(super) times: Vec<Time>,
    pub(super) values: Vec<Vec<f64>>,
    /// Lines that repeat the row before, with its time.
    pub(super) repeated: Vec<usize>,
    /// Whether the last line is cut off.
    pub(super) cut: bool,
    /// Whether numbers have decimal commas.
    pub(super) comma: bool,
    /// Whether times are times of day.
    pub(super) clock: bool,
}

/// Line and field of the first number with a decimal point, and of the first with a decimal comma.
#[derive(Default)]
struct Decimals {
    point: Option<(usize, usize)>,
    comma: Option<(usize, usize)>,
}

impl Table<'_> {
    /// Reads all rows.
    ///
    /// # Errors
    /// A finding at the first wrong row that names the others; one for numbers with both decimal
    /// points and decimal commas; one for more numbers than fit into memory.
    pub(super) fn rows(&self, layout: &Layout) -> Result<Rows, Box<Finding>> {
        let mut rows = Rows { values: vec![Vec::new(); layout.used.len()], ..Rows::default() };
        let mut decimals = Decimals::default();
        let mut wrong: Option<(Box<Finding>, Vec<usize>)> = None;
        let last = self.lines.last().map_or(0, |(line, _)| *line);
        let mut row = vec![0.0; layout.used.len()];
        for &(line, text) in &self.lines {
            // An incomplete last row without a line end is the end of a recording that was cut off.
            let fields = self.fields(text);
            if line == last && !self.ends_whole && fields.len() < self.names.len() {
                rows.cut = true;
                break;
            }
            let time = match (self.row(line, &fields, layout, &mut row, &mut decimals), &mut wrong) {
                (Ok((time, clock)), _) => {
                    rows.clock |= clock;
                    time
                }
                (Err(_), Some((_, more))) => {
                    more.push(line);
                    continue;
                }
                (Err(error), None) => {
                    wrong = Some((error, Vec::new()));
                    continue;
                }
            };
            // A row that repeats the one before, with its time, is left out.
            let is_same = |(values, value): (&Vec<f64>, &f64)| values.last() == Some(value);
            if rows.times.last().is_some_and(|last| time.since(*last) == 0.0)
                && rows.values.iter().zip(&row).all(is_same)
            {
                rows.repeated.push(line);
                continue;
            }
            if rows.times.len() >= MAX_NUMBERS / (layout.used.len() + 1) {
                let message = format!(
                    "more than {most} numbers, the limit (an hour of six joints at 1 kHz has 25 million); leave out \
                     rows: splines pass between them",
                    most = MAX_NUMBERS
                );
                return Err(self.at(line, fault("too-many-numbers", message)));
            }
            rows.lines.push(line);
            rows.times.push(time);
            rows.values.iter_mut().zip(&row).for_each(|(values, value)| values.push(*value));
        }
        if let Some((first, more)) = wrong {
            return Err(self.with_further(first, &more));
        }
        self.check_decimals(&decimals)?;
        rows.comma = decimals.comma.is_some();
        Ok(rows)
    }

    /// Checks that numbers have decimal points or decimal commas, but not both.
    fn check_decimals(&self, decimals: &Decimals) -> Result<(), Box<Finding>> {
        if let (Some(point), Some(comma)) = (decimals.point, decimals.comma) {
            let message = format!(
                "numbers have decimal points ({}) and decimal commas ({}); write all in one way, without separators of \
                 thousands",
                self.place(point.0, point.1),
                self.place(comma.0, comma.1)
            );
            let (line, field) = point.max(comma);
            return Err(self.at_field(line, field, fault("mixed-decimals", message)));
        }
        Ok(())
    }

    /// Splits a line of numbers.
    fn fields(&self, text: &str) -> Vec<String> {
        let mut fields = self.separator.split(text);
        // A trailing separator adds an empty field.
        if fields.len() == self.names.len() + 1 && fields.last().is_some_and(String::is_empty) {
            fields.pop();
        }
        fields
    }

    /// Reads the values of a line in the order of the layout. Returns its time and whether it is a
    /// time of day.
    fn row(
        &self,
        line: usize,
        fields: &[String],
        layout: &Layout,
        row: &mut [f64],
        decimals: &mut Decimals,
    ) -> Result<(Time, bool), Box<Finding>> {
        // One field for each column.
        let (found, expected) = (fields.len(), self.names.len());
        if found != expected {
            let ragged = match self.separator {
                Separator::Comma if found == 2 * expected => fault(
                    "decimal-commas",
                    format!(
                        "the row has {found} fields, the header {expected}: twice as many, as if numbers had decimal \
                         commas between commas, which is ambiguous; export the table with semicolons, or with points \
                         in numbers"
                    ),
                ),
                _ => fault(
                    "ragged",
                    format!(
                        "the row has {found} fields, the header {expected}; was the file cut off? complete or remove \
                         the row"
                    ),
                ),
            };
            return Err(self.at(line, ragged));
        }
        // A number, of which the way decimals are written is remembered.
        let mut value = |place: usize| -> Result<f64, Box<Finding>> {
            let field = &fields[place];
            let (value, decimal) = number(field).ok_or_else(|| {
                let (column, found) = (self.shown(place), field.chars().take(40).collect::<String>());
                let message = format!("{column}: {found:?} is not a number; expected one such as 0.25 or -1e-3");
                self.at_field(line, place, fault("not-a-number", message))
            })?;
            match decimal {
                Decimal::None => {}
                Decimal::Point => decimals.point = decimals.point.or(Some((line, place))),
                Decimal::Comma => decimals.comma = decimals.comma.or(Some((line, place))),
            }
            Ok(value)
        };
        // The time, as a time of day or as a number, then the joints.
        let clock = clock_time(&fields[layout.time]);
        let time = match clock {
            Some(clock) => Time { value: clock as f64 / 1e12, exact: Some(clock) },
            None => Time { value: value(layout.time)?, exact: exact(&fields[layout.time]) },
        };
        for (slot, used) in row.iter_mut().zip(&layout.used) {
            *slot = used.scale * value(used.place)?;
        }
        Ok((time, clock.is_some()))
    }
}

/// Groups the values by joint.
pub(super) fn joints(layout: &Layout, rows: &Rows) -> Vec<JointSamples> {
    let find = |joint: &str, order: usize| {
        let place = layout.used.iter().position(|used| used.joint == joint && used.order == order)?;
        Some(rows.values[place].clone())
    };
    let positions = layout.used.iter().filter(|used| used.order == 0);
    let joint = |used: &Used| {
        let velocity = find(&used.joint, 1);
        JointSamples {
            name: used.joint.clone(),
            position: find(&used.joint, 0).unwrap_or_default(),
            acceleration: find(&used.joint, 2),
            velocity,
        }
    };
    positions.map(joint).collect()
}
