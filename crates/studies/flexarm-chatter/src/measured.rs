//! Measured frequency response of a tool: a table of real and imaginary parts, interpolated
//! linearly over frequency.

use std::f64::consts::TAU;
use std::path::Path;

use flexarm_files::NumberTable;
use nalgebra::{Complex, Matrix3};

use flexarm_run::Error;

/// Entries that a table may contain, with row and column; the others follow by symmetry or are
/// zero.
const ENTRIES: [(&str, usize, usize); 6] =
    [("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2)];

/// Displacement of the tip per force on it, in the axes of the TCP, measured on a rigidly held
/// spindle.
#[derive(Clone, Debug)]
pub(crate) struct MeasuredResponse {
    /// Angular frequencies, ascending (rad/s).
    pub(crate) omega: Vec<f64>,
    /// Frequency response (m/N).
    pub(crate) values: Vec<Matrix3<Complex<f64>>>,
}

impl MeasuredResponse {
    /// Reads a table with `frequency_hz`, and `xx_re`, `xx_im` and so on in m/N.
    ///
    /// # Errors
    /// [`Error::File`] for missing, unknown or incomplete columns, and for frequencies that are not
    /// ascending.
    pub(crate) fn new(table: &NumberTable, path: &Path) -> Result<Self, Error> {
        let fail = |what: String| Error::File { path: path.to_owned(), what };
        let names: Vec<String> = ENTRIES.iter().flat_map(|(e, ..)| [format!("{e}_re"), format!("{e}_im")]).collect();
        if let Some(stray) = table.names.iter().find(|n| *n != "frequency_hz" && !names.contains(n)) {
            return Err(fail(format!(
                "column {stray:?} is not known; expected frequency_hz and some of {names:?} (m/N)"
            )));
        }
        let hz = table.column("frequency_hz").ok_or_else(|| fail("there is no column frequency_hz".into()))?;
        if table.column("xx_re").is_none() && table.column("yy_re").is_none() {
            return Err(fail(
                "there is neither a column xx_re nor yy_re (m/N): a response across the tool axis is needed".into(),
            ));
        }
        for (k, row) in table.rows.iter().enumerate() {
            if let Some(column) = row.iter().position(|x| !x.is_finite()) {
                let line = table.lines[k];
                return Err(fail(format!("line {line}: column {:?} is not a finite number", table.names[column])));
            }
        }
        let omega: Vec<f64> = table.rows.iter().map(|row| TAU * row[hz]).collect();
        let ascending = omega.windows(2).all(|pair| pair[0] < pair[1]);
        if omega.len() < 3 || !ascending || omega[0] <= 0.0 {
            return Err(fail("expected at least three frequencies, positive and ascending".into()));
        }
        let mut values = vec![Matrix3::zeros(); omega.len()];
        for (entry, i, j) in ENTRIES {
            let (re, im) = (table.column(&format!("{entry}_re")), table.column(&format!("{entry}_im")));
            let (re, im) = match (re, im) {
                (Some(re), Some(im)) => (re, im),
                (None, None) => continue,
                _ => return Err(fail(format!("{entry}_re and {entry}_im belong together: one of them is missing"))),
            };
            for (value, row) in values.iter_mut().zip(&table.rows) {
                value[(i, j)] = Complex::new(row[re], row[im]);
                value[(j, i)] = value[(i, j)];
            }
        }
        Ok(Self { omega, values })
    }

    /// Interpolates linearly between the measured frequencies; constant beyond them.
    pub(crate) fn at(&self, omega: f64) -> Matrix3<Complex<f64>> {
        let k = self.omega.partition_point(|w| *w <= omega).clamp(1, self.omega.len() - 1);
        let s = ((omega - self.omega[k - 1]) / (self.omega[k] - self.omega[k - 1])).clamp(0.0, 1.0);
        self.values[k - 1] * Complex::new(1.0 - s, 0.0) + self.values[k] * Complex::new(s, 0.0)
    }
}
