//! Readings, and the instruments and targets they refer to: plain data in SI units.
//!
//! Start at [`Measurements`]. Unknowns of the measurements stand behind those of the parameters: six or
//! three per instrument, then three per target. Not here: predictions ([`super::measurement`]).

use flexarm_kinematics::{Frame, Pose, SpatialInertia, Wrench};
use nalgebra::{Complex, DVector, Rotation3, Translation3, Vector3};

use crate::estimation::least_squares::Noise;
use crate::estimation::response::{Answer, Probe, StructureSlopes};

/// Additional mass at the tool and force on it.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadCase {
    /// Force and moment at the point of application, world axes (N, N m).
    pub wrench: Wrench,
    /// Point of application, tool axes (m).
    pub at: Vector3<f64>,
    /// Inertia fixed to the tool in addition to the robot's own payload: about the tool's origin,
    /// tool axes.
    pub carried: SpatialInertia,
}

impl LoadCase {
    /// Returns a load without additional mass and force.
    pub fn none() -> Self {
        Self { wrench: Wrench::zeros(), at: Vector3::zeros(), carried: SpatialInertia::zeros() }
    }
}

/// One measured number.
#[derive(Clone, Debug, PartialEq)]
pub struct Row<T> {
    /// Quantity within the reading.
    pub of: T,
    /// Measured value (m, rad or Hz).
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
}

/// Component of a displacement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Component {
    /// Unit vector: direction of a translation, or axis of a rotation.
    pub direction: Vector3<f64>,
    /// Number of the instrument in whose axes the direction is; world axes if `None`.
    pub instrument: Option<usize>,
    /// Whether it is a component of the rotation vector.
    pub rotation: bool,
}

impl Component {
    /// Returns the translation along a unit vector in world axes.
    pub fn along(direction: Vector3<f64>) -> Self {
        Self { direction, instrument: None, rotation: false }
    }

    /// Returns the rotation about a unit vector in world axes.
    pub fn about(direction: Vector3<f64>) -> Self {
        Self { direction, instrument: None, rotation: true }
    }
}

/// One measurement at a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// Name for output: file and row.
    pub name: String,
    /// Actuated joints (rad or m).
    pub q: Vec<f64>,
    /// Kind and values.
    pub kind: ReadingKind,
}

/// Form in which a measured response is compared with the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// Logarithm of the magnitude, and phase (rad): equal relative errors have equal weight.
    #[default]
    Logarithmic,
    /// Real and imaginary part: large values dominate.
    Complex,
}

/// Measured frequency response.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredResponse {
    /// Additional mass at the tool; the wrench is ignored.
    pub load: LoadCase,
    /// Measured point and direction.
    pub watched: Probe,
    /// Excited point and direction.
    pub hit: Probe,
    /// Quantity measured per newton.
    pub answer: Answer,
    /// Form of the comparison.
    pub form: Form,
    /// Frequencies (rad/s), values in SI units, and the standard deviations of the two numbers that
    /// each value gives.
    pub points: Vec<(f64, Complex<f64>, [f64; 2])>,
}

impl MeasuredResponse {
    /// Returns the two numbers of a value at a point. The phase is unwrapped to within π of the
    /// measured one.
    pub(crate) fn numbers(&self, k: usize, value: Complex<f64>) -> [f64; 2] {
        let measured = self.points[k].1;
        match self.form {
            Form::Complex => [value.re, value.im],
            Form::Logarithmic => [value.norm().ln(), measured.arg() + (value / measured).arg()],
        }
    }

    /// Returns the derivatives of the same two numbers, given that of the value.
    pub(crate) fn number_slopes(&self, value: Complex<f64>, slope: Complex<f64>) -> [f64; 2] {
        match self.form {
            Form::Complex => [slope.re, slope.im],
            Form::Logarithmic => {
                let part = slope / value;
                [part.re, part.im]
            }
        }
    }
}

/// Mode shape measured at some points.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredShape {
    /// Additional mass at the tool; the wrench is ignored.
    pub load: LoadCase,
    /// Measured points and directions.
    pub probes: Vec<Probe>,
    /// Amplitudes, up to a common factor of any sign.
    pub amplitudes: DVector<f64>,
    /// Standard deviation of each amplitude over the norm of all amplitudes.
    pub std: f64,
}

impl MeasuredShape {
    /// Returns the amplitudes normalised to length 1.
    pub(crate) fn unit(&self) -> DVector<f64> {
        self.amplitudes.normalize()
    }

    /// Returns the most similar mode of the arm: its number, its modal assurance criterion `(aᵀb)²`
    /// of unit vectors a and b, and its amplitudes at the probes, normalised to length 1 and with
    /// the sign of the measured ones.
    pub(crate) fn likeliest(&self, found: &StructureSlopes) -> Option<(usize, f64, DVector<f64>)> {
        let measured = self.unit();
        let unit_shape = |j: usize| {
            let phi = found.shapes.column(j);
            let a = DVector::from_iterator(self.probes.len(), found.structure.rows.iter().map(|row| (row * phi)[0]));
            let unit = a.try_normalize(0.0)?;
            let along = unit.dot(&measured);
            Some((j, along * along, if along < 0.0 { -unit } else { unit }))
        };
        let all = (0..found.omega2.len()).filter_map(unit_shape);
        all.max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// Kinds of readings.
#[derive(Clone, Debug, PartialEq)]
pub enum ReadingKind {
    /// Displacement of a point of the tool from one load to another.
    Displacement {
        /// First load.
        before: LoadCase,
        /// Second load.
        after: LoadCase,
        /// Measured point, tool axes (m).
        point: Vector3<f64>,
        /// Measured components.
        rows: Vec<Row<Component>>,
    },
    /// Position of a target, in the axes of an instrument.
    Place {
        /// Load during the measurement.
        load: LoadCase,
        /// Number of the target.
        target: usize,
        /// Number of the instrument.
        instrument: usize,
        /// Measured components (m) along the axes 0 to 2.
        rows: Vec<Row<usize>>,
    },
    /// Direct measurement of a parameter by another method ([`crate::estimation::gear_stiffness`]).
    Known {
        /// Name of the parameter.
        parameter: String,
        /// Coordinate of the parameter: logarithm of value over initial value for stiffnesses,
        /// otherwise their difference.
        value: f64,
        /// Standard deviation of the coordinate.
        std: f64,
    },
    /// Prior position of a target.
    TargetAt {
        /// Number of the target.
        target: usize,
        /// Position, tool axes (m).
        value: Vector3<f64>,
        /// Standard deviation of each component (m).
        std: f64,
    },
    /// Prior pose of an instrument, which is also the initial guess. The instrument must be
    /// unknown.
    InstrumentAt {
        /// Number of the instrument.
        instrument: usize,
        /// Pose of the world in the instrument's axes.
        value: Pose,
        /// Standard deviation of each component of its position (m); none if only its axes matter.
        std: Option<f64>,
        /// Standard deviation of the rotation about each axis (rad).
        std_rotation: f64,
    },
    /// Natural frequencies with locked drives.
    Frequencies {
        /// Additional mass at the tool; the wrench is ignored.
        load: LoadCase,
        /// Number of the mode, from 0 for the lowest; frequency in Hz.
        rows: Vec<Row<usize>>,
    },
    /// Frequency response with locked drives.
    Response(MeasuredResponse),
    /// Mode shape with locked drives, compared with the most similar mode of the arm.
    Shape(MeasuredShape),
}

impl Reading {
    /// Returns the number of measured numbers.
    pub fn rows(&self) -> usize {
        match &self.kind {
            ReadingKind::Displacement { rows, .. } => rows.len(),
            ReadingKind::Place { rows, .. } | ReadingKind::Frequencies { rows, .. } => rows.len(),
            ReadingKind::Known { .. } => 1,
            ReadingKind::TargetAt { .. } => 3,
            ReadingKind::InstrumentAt { std, .. } => 3 + 3 * usize::from(std.is_some()),
            ReadingKind::Response(response) => 2 * response.points.len(),
            ReadingKind::Shape(shape) => shape.probes.len(),
        }
    }

    /// Returns the position of a target if it is measured along all axes.
    pub fn position(&self) -> Option<Vector3<f64>> {
        match &self.kind {
            ReadingKind::Place { rows, .. } => match &rows[..] {
                [x, y, z] => Some(Vector3::new(x.value, y.value, z.value)),
                _ => None,
            },
            _ => None,
        }
    }

    /// Returns the standard deviation of each number.
    pub fn deviations(&self) -> Vec<f64> {
        match &self.kind {
            ReadingKind::Displacement { rows, .. } => rows.iter().map(|row| row.std).collect(),
            ReadingKind::Place { rows, .. } | ReadingKind::Frequencies { rows, .. } => {
                rows.iter().map(|row| row.std).collect()
            }
            ReadingKind::Known { std, .. } => vec![*std],
            ReadingKind::TargetAt { std, .. } => vec![*std; 3],
            ReadingKind::InstrumentAt { std, std_rotation, .. } => {
                std.map_or(Vec::new(), |std| vec![std; 3]).into_iter().chain([*std_rotation; 3]).collect()
            }
            ReadingKind::Response(response) => response.points.iter().flat_map(|(.., std)| *std).collect(),
            ReadingKind::Shape(shape) => vec![shape.std; shape.probes.len()],
        }
    }
}

/// Names of the kinds of numbers that have an error of the model each.
pub(crate) const KINDS: [&str; 7] =
    ["displacements", "rotations", "places", "frequencies", "responses", "complex responses", "mode shapes"];

impl ReadingKind {
    /// Whether it depends on masses and vibrations.
    pub(crate) fn vibrates(&self) -> bool {
        matches!(self, Self::Frequencies { .. } | Self::Response(_) | Self::Shape(_))
    }
}

impl Reading {
    /// Returns the error of each number.
    fn noise(&self) -> Vec<Noise> {
        let kind = |row: usize| match &self.kind {
            ReadingKind::Displacement { rows, .. } => Some(usize::from(rows[row].of.rotation)),
            ReadingKind::Place { .. } => Some(2),
            ReadingKind::Known { .. } | ReadingKind::TargetAt { .. } | ReadingKind::InstrumentAt { .. } => None,
            ReadingKind::Frequencies { .. } => Some(3),
            ReadingKind::Response(response) if response.form == Form::Logarithmic => Some(4),
            ReadingKind::Response(_) => Some(5),
            ReadingKind::Shape(_) => Some(6),
        };
        // The error of a model in frequencies is relative.
        let size = |row: usize| match &self.kind {
            ReadingKind::Frequencies { rows, .. } => rows[row].value,
            _ => 1.0,
        };
        // Both numbers of a frequency, then those of the next.
        let along = if matches!(self.kind, ReadingKind::Response(_)) { 2 } else { 0 };
        let all = self.deviations().into_iter().enumerate();
        all.map(|(row, std)| Noise { std, kind: kind(row), size: size(row), along }).collect()
    }
}

/// Measured point on the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Known position, tool axes (m).
    Known(Vector3<f64>),
    /// Unknown position; initial guess, tool axes (m).
    Unknown(Vector3<f64>),
}

/// Pose of an instrument, as the pose of the world in its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Instrument {
    /// Known pose.
    Known(Pose),
    /// Unknown pose; initial guess.
    Unknown(Pose),
    /// Unknown axes, irrelevant position; initial guess.
    Axes(Rotation3<f64>),
}

impl Instrument {
    /// Returns the number of unknowns.
    pub fn unknowns(&self) -> usize {
        match self {
            Self::Known(_) => 0,
            Self::Unknown(_) => 6,
            Self::Axes(_) => 3,
        }
    }
}

/// Readings with their targets and instruments.
#[derive(Clone, Debug, Default)]
pub struct Measurements {
    /// Readings.
    pub readings: Vec<Reading>,
    /// Targets.
    pub targets: Vec<Target>,
    /// Link frame of each target that is not on the tool; shorter if the others are on the tool.
    pub links: Vec<Option<Frame>>,
    /// Instruments.
    pub instruments: Vec<Instrument>,
    /// Names of the instruments for messages; may be empty.
    pub instrument_names: Vec<String>,
}

impl Measurements {
    /// Returns the number of unknowns of the measurements: those of the instruments, then three per
    /// unknown target.
    pub fn own_unknowns(&self) -> usize {
        let targets = self.targets.iter().filter(|t| matches!(t, Target::Unknown(_))).count();
        self.of_instruments() + 3 * targets
    }

    /// Returns the error of each measured number.
    pub(crate) fn noise(&self) -> Vec<Noise> {
        self.readings.iter().flat_map(Reading::noise).collect()
    }

    /// Returns the name of an instrument for messages; its number without a name.
    pub(crate) fn instrument_name(&self, number: usize) -> String {
        self.instrument_names.get(number).map_or_else(|| number.to_string(), |name| format!("{name:?}"))
    }

    /// Returns the number of unknowns of the instruments.
    fn of_instruments(&self) -> usize {
        self.instruments.iter().map(Instrument::unknowns).sum()
    }

    /// Returns the number of measured numbers.
    pub fn rows(&self) -> usize {
        self.readings.iter().map(Reading::rows).sum()
    }

    /// Returns a copy with some of the readings.
    #[must_use]
    pub fn of_readings(&self, keep: impl Fn(usize) -> bool) -> Self {
        let readings = self.readings.iter().enumerate().filter(|(k, _)| keep(*k)).map(|(_, r)| r.clone()).collect();
        Self { readings, ..self.clone() }
    }

    /// Returns a copy with some of the readings, instruments at the world's origin and targets at their
    /// initial guess.
    pub(crate) fn in_world(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut some = self.of_readings(keep);
        some.instruments.iter_mut().for_each(|i| *i = Instrument::Known(Pose::identity()));
        some.targets.iter_mut().for_each(|t| {
            if let Target::Unknown(guess) = t {
                *t = Target::Known(*guess);
            }
        });
        some
    }

    /// Returns a copy that compares all responses by their logarithm; `None` if all of them are
    /// already compared so.
    pub(crate) fn logarithmic(&self) -> Option<Self> {
        let mut all = self.clone();
        let mut some = false;
        for reading in &mut all.readings {
            let ReadingKind::Response(response) = &mut reading.kind else { continue };
            if response.form == Form::Complex {
                (some, response.form) = (true, Form::Logarithmic);
                // Relative deviation, at most 10: values below the noise carry hardly any
                // information.
                let part = |value: &Complex<f64>, std: &[f64; 2]| std.map(|std| (std / value.norm()).min(10.0));
                response.points.retain(|(_, value, _)| value.norm() > 0.0);
                response.points.iter_mut().for_each(|(_, value, std)| *std = part(value, std));
            }
        }
        some.then_some(all)
    }

    /// Returns the pose of the world in the axes of an instrument, and the indices in `own` of the
    /// first unknown of its position and of its rotation.
    pub(crate) fn instrument(&self, number: usize, own: &[f64]) -> (Pose, Option<usize>, Option<usize>) {
        let first = self.instruments[..number].iter().map(Instrument::unknowns).sum();
        let v = |at: usize| Vector3::from_column_slice(&own[at..at + 3]);
        match self.instruments[number] {
            Instrument::Known(X) => (X, None, None),
            Instrument::Unknown(X) => {
                let moved = Pose {
                    rotation: Rotation3::new(v(first + 3)) * X.rotation,
                    translation: Translation3::from(X.translation.vector + v(first)),
                };
                (moved, Some(first), Some(first + 3))
            }
            Instrument::Axes(R) => {
                (Pose::from_parts(Translation3::identity(), Rotation3::new(v(first)) * R), None, Some(first))
            }
        }
    }

    /// Returns a target on the tool, and the index in `own` of the first of its three unknowns.
    pub(crate) fn target(&self, number: usize, own: &[f64]) -> (Vector3<f64>, Option<usize>) {
        let before = self.targets[..number].iter().filter(|t| matches!(t, Target::Unknown(_))).count();
        match self.targets[number] {
            Target::Known(p) => (p, None),
            Target::Unknown(p) => {
                let at = self.of_instruments() + 3 * before;
                (p + Vector3::new(own[at], own[at + 1], own[at + 2]), Some(at))
            }
        }
    }
}
