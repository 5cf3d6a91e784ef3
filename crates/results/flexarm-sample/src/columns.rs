//! A run as columns: each signal is one contiguous array with a name, a unit and a width. Every
//! sample is kept.
//!
//! Start at [`Columns::push`]. Not here: curves thinned for pictures (`flexarm_log::Trace`), files.

use crate::{RunHeader, Sample};

/// One signal of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name, such as `error_world`.
    pub name: String,
    /// Unit of its numbers, such as `m`; empty if revolute and prismatic joints are mixed.
    pub unit: &'static str,
    /// Numbers per row.
    pub width: usize,
    /// Row-major values: row `i` is `values[i * width..][..width]`.
    pub values: Vec<f64>,
}

/// Function that appends the values of a sample to a column.
type Fill = fn(&Sample, &mut Vec<f64>);

/// Description of a signal before a run.
struct Signal {
    name: &'static str,
    unit: &'static str,
    width: Width,
    fill: Fill,
}

/// Numbers per row.
#[derive(Clone, Copy)]
enum Width {
    Numbers(usize),
    PerJoint,
    PerContributor(usize),
    PerElement(usize),
    PerGauge,
}

const fn signal(name: &'static str, unit: &'static str, width: Width, fill: Fill) -> Signal {
    Signal { name, unit, width, fill }
}

use Width::{Numbers, PerContributor, PerElement, PerGauge, PerJoint};

/// All signals; those that need the rigid twin start with the error.
const SIGNALS: [Signal; 19] = [
    signal("time", "s", Numbers(1), |s, to| to.push(s.time_s)),
    signal("position", "", PerJoint, |s, to| to.extend_from_slice(&s.flexible.q)),
    signal("velocity", "", PerJoint, |s, to| to.extend_from_slice(&s.flexible.qdot)),
    signal("effort", "", PerJoint, |s, to| to.extend_from_slice(&s.flexible.effort)),
    signal("tcp_position", "m", Numbers(3), |s, to| to.extend(s.flexible.X_WT.translation.vector.iter())),
    signal("tcp_quaternion_wxyz", "", Numbers(4), |s, to| to.extend(wxyz(&s.flexible))),
    signal("deflection", "m, rad", PerElement(6), |s, to| s.elastic.iter().for_each(|e| to.extend(e.deflection))),
    signal("load", "N, N m", PerElement(6), |s, to| s.elastic.iter().for_each(|e| to.extend(e.load))),
    signal("energy", "J", Numbers(3), |s, to| to.extend([s.energy.kinetic, s.energy.potential, s.energy.elastic])),
    signal("gauge", "m/m, Pa", PerGauge, |s, to| to.extend_from_slice(&s.gauges)),
    signal("error_world", "m", Numbers(3), |s, to| to.extend_from_slice(&s.error_world[..3])),
    signal("error_rotation", "rad", Numbers(3), |s, to| to.extend_from_slice(&s.error_world[3..])),
    signal("error_path", "m", Numbers(3), |s, to| to.extend_from_slice(&s.error_path[..3])),
    signal("error_static", "m", Numbers(3), |s, to| to.extend_from_slice(&s.static_m)),
    signal("contribution", "m", PerContributor(3), |s, to| s.contributions.iter().for_each(|c| to.extend(c))),
    signal("rigid_position", "", PerJoint, |s, to| to.extend_from_slice(&s.rigid.q)),
    signal("rigid_effort", "", PerJoint, |s, to| to.extend_from_slice(&s.rigid.effort)),
    signal("rigid_tcp_position", "m", Numbers(3), |s, to| to.extend(s.rigid.X_WT.translation.vector.iter())),
    signal("rigid_tcp_quaternion_wxyz", "", Numbers(4), |s, to| to.extend(wxyz(&s.rigid))),
];
/// Index of the first signal that needs the rigid twin.
const OF_TWIN: usize = 10;

fn wxyz(twin: &crate::TwinSample) -> [f64; 4] {
    let q = nalgebra::UnitQuaternion::from_rotation_matrix(&twin.X_WT.rotation);
    [q.w, q.i, q.j, q.k]
}

/// The signals of a run, with the names of their joints, elements, contributors and gauges.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    /// Joints, in the order of `position`, `velocity` and `effort`.
    pub joints: Vec<String>,
    /// Whether each joint is prismatic.
    pub prismatic: Vec<bool>,
    /// Elastic elements, in the order of `deflection` and `load`: six numbers each.
    pub elements: Vec<String>,
    /// Contributors to the TCP displacement, in the order of `contribution`: three numbers each.
    pub contributors: Vec<String>,
    /// Channels of strain gauges and stress points, in the order of `gauge`.
    pub gauges: Vec<String>,
    columns: Vec<Column>,
    rows: usize,
}

impl Columns {
    /// Creates empty columns for a run.
    #[must_use]
    pub fn new(header: &RunHeader) -> Self {
        let signals = if header.has_rigid { &SIGNALS[..] } else { &SIGNALS[..OF_TWIN] };
        let width = |width: Width| match width {
            Numbers(n) => n,
            PerJoint => header.joints.len(),
            PerContributor(n) => n * header.contributors.len(),
            PerElement(n) => n * header.elements.len(),
            PerGauge => header.gauges.len(),
        };
        let column =
            |s: &Signal| Column { name: s.name.into(), unit: s.unit, width: width(s.width), values: Vec::new() };
        Self {
            joints: header.joints.clone(),
            prismatic: header.prismatic.clone(),
            elements: header.elements.clone(),
            contributors: header.contributors.clone(),
            gauges: header.gauges.clone(),
            columns: signals.iter().map(column).collect(),
            rows: 0,
        }
    }

    /// Creates columns of the same joints, elements and contributors from stored numbers, each
    /// signal by its name.
    ///
    /// * `signals`: names in the order of [`Columns::columns`], each with its row-major values.
    ///
    /// `None` if they are not all signals of a run, with or without the rigid twin, in order and of
    /// equal length.
    #[must_use]
    pub fn filled(&self, signals: impl IntoIterator<Item = (String, Vec<f64>)>) -> Option<Self> {
        let signals: Vec<(String, Vec<f64>)> = signals.into_iter().collect();
        let header = RunHeader {
            joints: self.joints.clone(),
            prismatic: self.prismatic.clone(),
            elements: self.elements.clone(),
            contributors: self.contributors.clone(),
            gauges: self.gauges.clone(),
            has_rigid: signals.len() > OF_TWIN,
            ..RunHeader::default()
        };
        let mut columns = Self::new(&header);
        if columns.columns.len() != signals.len() {
            return None;
        }
        columns.rows = signals.first().map_or(0, |(_, times)| times.len());
        for (column, (name, values)) in columns.columns.iter_mut().zip(signals) {
            if column.name != name || values.len() != column.width * columns.rows {
                return None;
            }
            column.values = values;
        }
        Some(columns)
    }

    /// Adds one instant.
    pub fn push(&mut self, sample: &Sample) {
        for (column, signal) in self.columns.iter_mut().zip(&SIGNALS) {
            (signal.fill)(sample, &mut column.values);
        }
        self.rows += 1;
    }

    /// Returns the number of instants.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns all signals.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Returns the signal of this name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }
}
