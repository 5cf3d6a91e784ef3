//! The table of a run: mapping between the numbers of a sample and columns. CSV and Parquet files
//! share it, for writing and reading.
//!
//! Start at [`columns`] and [`fill_row`]; [`TableLayout`] reads a row back. The order of the
//! columns is in these three places. SI units; TCP in world axes. Not here: files
//! ([`crate::csv_file`], `parquet_file`), whole columns ([`crate::flat`]).

use std::collections::{BTreeSet, HashMap, HashSet};

use flexarm_kinematics::Pose;
use nalgebra::{Translation3, Vector3};

use crate::shape::Shape;
use crate::{ElasticSample, GAUGE_ENDS, RunHeader, Sample, TwinSample};

const DISPLACEMENT: [&str; 6] = ["x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad"];
const WRENCH: [&str; 6] = ["fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm"];
const POSITION: [&str; 3] = ["x_m", "y_m", "z_m"];

/// Names of all columns, in the order of [`fill_row`].
pub(crate) fn columns(header: &RunHeader) -> Vec<String> {
    let position = |who: &str| POSITION.map(|axis| format!("{who}_{axis}"));
    // TCP of both robots, and its error.
    let mut names = vec!["time".to_owned()];
    if header.has_rigid {
        names.extend(position("rigid"));
    }
    names.extend(position("flexible"));
    if header.has_rigid {
        names.extend(DISPLACEMENT.map(|part| format!("error_{part}")));
        names.extend(["tangential", "normal", "binormal"].map(|axis| format!("error_{axis}_m")));
    }
    if header.has_rigid && header.has_static {
        names.extend(position("static_error"));
    }
    // Causes of the error, joints, elastic elements, gauges, energies.
    for contributor in &header.contributors {
        names.extend(POSITION.map(|axis| format!("{contributor}_contribution_{axis}")));
    }
    for (k, joint) in header.joints.iter().enumerate() {
        let unit = if header.prismatic.get(k).copied().unwrap_or(false) { "m" } else { "rad" };
        names.push(format!("{joint}_position_{unit}"));
        names.push(format!("{joint}_effort"));
        if header.has_rigid {
            names.push(format!("rigid_{joint}_effort"));
        }
    }
    for element in &header.elements {
        names.extend(DISPLACEMENT.iter().chain(&WRENCH).map(|part| format!("{element}_{part}")));
    }
    names.extend(header.gauges.iter().cloned());
    names.extend(["kinetic", "potential", "elastic"].map(|kind| format!("{kind}_energy_j")));
    // A link may be named `flexible`: of two equal names the later column gets a suffix.
    let mut taken = BTreeSet::new();
    names.into_iter().map(|name| distinct(name, &mut taken)).collect()
}

/// Returns the name, or if it is taken, the name with the first free number (`name_2`).
pub(crate) fn distinct(name: String, taken: &mut BTreeSet<String>) -> String {
    let numbered = (2..).map(|n| format!("{name}_{n}"));
    let free = std::iter::once(name.clone()).chain(numbered).find(|name| taken.insert(name.clone()));
    free.unwrap_or(name)
}

/// Replaces `row` by the numbers of a sample, in the order of [`columns`].
pub(crate) fn fill_row(sample: &Sample, shape: &Shape, row: &mut Vec<f64>) {
    let has_rigid = shape.has_rigid;
    row.clear();
    // TCP of both robots, and its error with its causes.
    row.push(sample.time_s);
    if has_rigid {
        row.extend(sample.rigid.X_WT.translation.vector.iter());
    }
    row.extend(sample.flexible.X_WT.translation.vector.iter());
    if has_rigid {
        row.extend(sample.error_world);
        row.extend(&sample.error_path[..3]);
    }
    if shape.has_static {
        row.extend(sample.static_m);
    }
    row.extend(sample.contributions.iter().flatten());
    // Joints, elastic elements, gauges, energies.
    for (joint, q) in sample.flexible.q.iter().enumerate() {
        row.push(*q);
        row.push(sample.flexible.effort[joint]);
        if has_rigid {
            row.push(sample.rigid.effort[joint]);
        }
    }
    for element in &sample.elastic {
        row.extend(element.deflection);
        row.extend(element.load);
    }
    row.extend_from_slice(&sample.gauges);
    row.extend([sample.energy.kinetic, sample.energy.potential, sample.energy.elastic]);
}

/// Lists, as sentences, what a table made of a run with this header leaves out.
pub(crate) fn left_out(header: &RunHeader) -> Vec<String> {
    let mut left = vec!["the table has no velocities of joints and no orientations of the tool".to_owned()];
    if !header.links.is_empty() {
        left.push("the table has no poses of links: no picture of the arm can be made of it".into());
    }
    left
}

/// Lists, as sentences, what a recording with pictures lacks if it is made of a table.
pub(crate) fn unknown(header: &RunHeader) -> Vec<String> {
    let mut unknown = vec![
        "the table has no velocities of joints and no work of the solver: not a number (NaN) in the new file"
            .to_owned(),
        "the table has no poses of links: there is no picture of the arm, and the tool does not turn".into(),
    ];
    if header.has_rigid {
        unknown
            .push("the table has no joint positions of the rigid twin and no error angles along the path: NaN".into());
    }
    unknown
}

/// Mapping from the columns of a file to the numbers of a sample.
#[derive(Clone, Debug)]
pub(crate) struct TableLayout {
    /// Header as far as column names determine it; no links.
    pub(crate) header: RunHeader,
    /// Index in the file of each column of [`columns`].
    pub(crate) places: Vec<usize>,
}

impl TableLayout {
    /// Finds the columns of a run among `names`; order is irrelevant, other columns are ignored.
    ///
    /// # Errors
    /// Descriptions of what was found and what was expected.
    pub(crate) fn of_names(names: &[String]) -> Result<Self, (String, String)> {
        let has = |name: &str| names.iter().any(|n| n == name);
        let (has_rigid, has_static) = (has("error_tangential_m"), has("static_error_x_m"));
        let mut header = RunHeader { has_rigid, has_static, ..RunHeader::default() };
        for name in names {
            for (end, prismatic) in [("_position_rad", false), ("_position_m", true)] {
                if let Some(joint) = name.strip_suffix(end) {
                    header.joints.push(joint.to_owned());
                    header.prismatic.push(prismatic);
                }
            }
            header.elements.extend(name.strip_suffix("_fx_n").map(str::to_owned));
            header.contributors.extend(name.strip_suffix("_contribution_x_m").map(str::to_owned));
            header.gauges.extend(GAUGE_ENDS.iter().any(|(end, _)| name.ends_with(end)).then(|| name.clone()));
        }
        Self::of_header(header, names)
    }

    /// Finds the columns of a run with this header.
    ///
    /// # Errors
    /// Descriptions of what was found and what was expected.
    pub(crate) fn of_header(mut header: RunHeader, names: &[String]) -> Result<Self, (String, String)> {
        // Samples must not be expected to hold what the columns lack.
        (header.links, header.meshes) = (Vec::new(), Vec::new());
        header.bends = Vec::new();
        (header.magnification, header.urdf) = (0.0, String::new());
        // A column of the run must not occur twice.
        let wanted = columns(&header);
        let needed: HashSet<&String> = wanted.iter().collect();
        let mut first_of: HashMap<&String, usize> = HashMap::new();
        for (second, name) in names.iter().enumerate() {
            let first = *first_of.entry(name).or_insert(second);
            if first != second && needed.contains(name) {
                let found = format!("columns {} and {} that are both called {name:?}", first + 1, second + 1);
                return Err((found, "each column once".into()));
            }
        }
        let place = |name: &String| first_of.get(name).copied();
        let missing: Vec<&str> = wanted.iter().filter(|name| place(name).is_none()).map(String::as_str).collect();
        if !missing.is_empty() {
            let found = match names.iter().all(|name| name.trim().is_empty()) {
                true => "a table without column names".to_owned(),
                false => format!("a table with the columns {}", shortened(names)),
            };
            let expected = format!(
                "the columns of a recording: time, flexible_x_m, flexible_y_m, flexible_z_m, kinetic_energy_j, \
                 potential_energy_j, elastic_energy_j, and for each joint <joint>_position_rad and <joint>_effort; \
                 missing here: {}",
                shortened(&missing)
            );
            return Err((found, expected));
        }
        let places = wanted.iter().filter_map(place).collect();
        Ok(Self { header, places })
    }

    /// Fills a sample from the numbers of a row in the order of [`columns`]. Missing quantities are
    /// NaN; the TCP orientation is that of the world.
    pub(crate) fn sample(&self, row: &[f64], sample: &mut Sample) {
        // The next number of the row, and three of them as a place.
        let mut next = row.iter().copied();
        let mut number = || next.next().unwrap_or(f64::NAN);
        let joints = self.header.joints.len();
        let unknown = vec![f64::NAN; joints];
        let twin = || TwinSample {
            q: unknown.clone(),
            qdot: unknown.clone(),
            effort: unknown.clone(),
            ..TwinSample::default()
        };
        let place = |number: &mut dyn FnMut() -> f64| -> Pose {
            let vector: Vector3<f64> = Vector3::from_fn(|_, _| number());
            Translation3::from(vector).into()
        };

        // TCP of both robots, and its error.
        *sample = Sample {
            time_s: number(),
            flexible: twin(),
            error_world: [f64::NAN; 6],
            error_path: [f64::NAN; 6],
            static_m: [f64::NAN; 3],
            solver: [f64::NAN; 2],
            ..Sample::default()
        };
        if self.header.has_rigid {
            sample.rigid = twin();
            sample.rigid.X_WT = place(&mut number);
        }
        sample.flexible.X_WT = place(&mut number);
        if self.header.has_rigid {
            sample.error_world = std::array::from_fn(|_| number());
            sample.error_path[..3].fill_with(&mut number);
        }
        if self.header.has_rigid && self.header.has_static {
            sample.static_m = std::array::from_fn(|_| number());
        }
        // Causes of the error, joints, elastic elements, gauges, energies.
        let contribution = |_: &String| std::array::from_fn(|_| number());
        sample.contributions = self.header.contributors.iter().map(contribution).collect();
        for joint in 0..joints {
            sample.flexible.q[joint] = number();
            sample.flexible.effort[joint] = number();
            if self.header.has_rigid {
                sample.rigid.effort[joint] = number();
            }
        }
        let element = |_| ElasticSample {
            deflection: std::array::from_fn(|_| number()),
            load: std::array::from_fn(|_| number()),
        };
        sample.elastic = (0..self.header.elements.len()).map(element).collect();
        sample.gauges = self.header.gauges.iter().map(|_| number()).collect();
        [sample.energy.kinetic, sample.energy.potential, sample.energy.elastic] = std::array::from_fn(|_| number());
        if self.header.step_s > 0.0 && sample.time_s.is_finite() {
            sample.step = (sample.time_s / self.header.step_s).round() as u64;
        }
    }
}

/// Returns the sampling rate (Hz) of two consecutive times, rounded to 9 digits to remove the
/// rounding error of their difference.
pub(crate) fn rate_hz(first_s: f64, second_s: f64) -> f64 {
    let rate = 1.0 / (second_s - first_s);
    let digits = format!("{rate:.8e}").parse().unwrap_or(rate);
    if rate.is_finite() && rate > 0.0 { digits } else { 0.0 }
}

/// Returns the first few of many names.
fn shortened<T: AsRef<str>>(names: &[T]) -> String {
    const SHOWN: usize = 8;
    let mut text: Vec<String> =
        names.iter().take(SHOWN).map(|name| name.as_ref().chars().take(40).collect::<String>()).collect();
    if names.len() > SHOWN {
        text.push(format!("... ({} in all)", names.len()));
    }
    text.join(", ")
}
