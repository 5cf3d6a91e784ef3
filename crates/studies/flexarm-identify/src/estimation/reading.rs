//! What was measured: readings, and what belongs to them.

use flexarm_kinematics::{Pose, SpatialInertia, Wrench};
use nalgebra::{Complex, DVector, Rotation3, Translation3, Vector3};

use crate::estimation::response::{Answer, Probe, StructureSlopes};

/// What the tool carries and what pulls at it.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadCase {
    /// Force and moment at the point, world axes (N, N m).
    pub wrench: Wrench,
    /// Where they act, in tool axes (m).
    pub at: Vector3<f64>,
    /// What is fixed to the tool besides what the robot carries: inertia about the tool's origin,
    /// tool axes.
    pub carried: SpatialInertia,
}

impl LoadCase {
    /// Nothing besides what the robot carries anyway.
    pub fn none() -> Self {
        Self { wrench: Wrench::zeros(), at: Vector3::zeros(), carried: SpatialInertia::zeros() }
    }
}

impl Default for LoadCase {
    fn default() -> Self {
        Self::none()
    }
}

/// One number: what it is of, what was read, how sure it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Row<T> {
    /// What of the reading.
    pub of: T,
    /// The number (m, rad or Hz).
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
}

/// A component of a displacement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Component {
    /// Along a direction, world axes, of unit length.
    Along(Vector3<f64>),
    /// Rotation about a direction, world axes.
    About(Vector3<f64>),
    /// Along a direction in the axes of an instrument, by its number.
    AlongSeen(usize, Vector3<f64>),
    /// Rotation about a direction in the axes of an instrument.
    AboutSeen(usize, Vector3<f64>),
}

impl Component {
    /// Its direction, the instrument in whose axes it is (else those of the world), and whether it
    /// is a rotation.
    pub fn parts(&self) -> (Vector3<f64>, Option<usize>, bool) {
        match *self {
            Self::Along(d) => (d, None, false),
            Self::About(d) => (d, None, true),
            Self::AlongSeen(instrument, d) => (d, Some(instrument), false),
            Self::AboutSeen(instrument, d) => (d, Some(instrument), true),
        }
    }
}

/// One thing measured at a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// Name for people: file and row.
    pub name: String,
    /// Actuated joints (rad or m).
    pub q: Vec<f64>,
    /// What.
    pub kind: ReadingKind,
}

/// How a measured response is compared with the arm's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// Logarithm of the magnitude, and phase (rad): what is off by a part of itself counts alike
    /// everywhere.
    #[default]
    Logarithmic,
    /// Real and imaginary part: what is large counts.
    Complex,
}

/// The curve of a hammer test.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredResponse {
    /// What the tool carries; a wrench does not count.
    pub load: LoadCase,
    /// What is watched.
    pub watched: Probe,
    /// What is hit.
    pub hit: Probe,
    /// What is measured per newton.
    pub answer: Answer,
    /// How it is compared.
    pub form: Form,
    /// Frequencies (rad/s), values in SI units, and the deviations of the two numbers that each
    /// becomes.
    pub points: Vec<(f64, Complex<f64>, [f64; 2])>,
}

impl MeasuredResponse {
    /// The two numbers of a value at a point: of a phase that one within half a turn of the
    /// measured.
    pub(crate) fn numbers(&self, k: usize, value: Complex<f64>) -> [f64; 2] {
        let measured = self.points[k].1;
        match self.form {
            Form::Complex => [value.re, value.im],
            Form::Logarithmic => [value.norm().ln(), measured.arg() + (value / measured).arg()],
        }
    }

    /// Change of the same two numbers with that of the value.
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

/// The shape of a mode as it was seen at some points.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredShape {
    /// What the tool carries; a wrench does not count.
    pub load: LoadCase,
    /// Where and along which directions it was seen.
    pub probes: Vec<Probe>,
    /// Amplitudes there, in any unit and with any sign in common.
    pub amplitudes: DVector<f64>,
    /// Deviation of each amplitude, as a part of the length of all of them.
    pub std: f64,
}

impl MeasuredShape {
    /// The measured amplitudes with length 1.
    pub(crate) fn unit(&self) -> DVector<f64> {
        self.amplitudes.normalize()
    }

    /// The mode of the arm that is most like it: its number, its modal assurance criterion `(aᵀb)²`
    /// of unit vectors a and b, and its amplitudes at the probes, with length 1 and the sign of the
    /// measured.
    pub(crate) fn likeliest(&self, found: &StructureSlopes) -> Option<(usize, f64, DVector<f64>)> {
        let measured = self.unit();
        let of = |j: usize| {
            let phi = found.shapes.column(j);
            let seen = DVector::from_iterator(self.probes.len(), found.structure.rows.iter().map(|row| (row * phi)[0]));
            let seen = seen.try_normalize(0.0)?;
            let along = seen.dot(&measured);
            Some((j, along * along, if along < 0.0 { -seen } else { seen }))
        };
        let all = (0..found.omega2.len()).filter_map(of);
        all.max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// Kinds of readings.
#[derive(Clone, Debug, PartialEq)]
pub enum ReadingKind {
    /// How far a point of the tool moves from one load to another.
    Displacement {
        /// Before.
        before: LoadCase,
        /// After.
        after: LoadCase,
        /// The point, tool axes (m).
        point: Vector3<f64>,
        /// What was read.
        rows: Vec<Row<Component>>,
    },
    /// Where a target on the tool is, in the axes of an instrument.
    Place {
        /// Load at that time.
        load: LoadCase,
        /// Number of the target.
        target: usize,
        /// Number of the instrument.
        instrument: usize,
        /// Place (m).
        value: Vector3<f64>,
        /// Standard deviation of each component (m).
        std: Vector3<f64>,
    },
    /// A parameter by itself, told by a measurement of another kind
    /// ([`crate::estimation::gear_stiffness`]).
    Known {
        /// Name of the parameter.
        parameter: String,
        /// Its coordinate: of stiffnesses the logarithm of the value over the initial one, else the
        /// difference.
        value: f64,
        /// Standard deviation of that.
        std: f64,
    },
    /// Where a target is known to be, with a deviation.
    TargetAt {
        /// Number of the target.
        target: usize,
        /// Place, tool axes (m).
        value: Vector3<f64>,
        /// Standard deviation of each component (m).
        std: f64,
    },
    /// How an instrument is known to stand, with deviations: the first guess of it, which must be
    /// unknown.
    InstrumentAt {
        /// Number of the instrument.
        instrument: usize,
        /// The world in its axes.
        value: Pose,
        /// Standard deviation of each component of its place, none where only its axes count (m).
        std: Option<f64>,
        /// Standard deviation of the rotation about each axis (rad).
        std_rotation: f64,
    },
    /// Natural frequencies, drives locked.
    Frequencies {
        /// What the tool carries; a wrench does not count.
        load: LoadCase,
        /// Number of the mode, from 0 with the lowest; Hz.
        rows: Vec<Row<usize>>,
    },
    /// A frequency response, drives locked.
    Response(MeasuredResponse),
    /// A mode's shape, drives locked. The arm's own is that which is most like it.
    Shape(MeasuredShape),
}

impl Reading {
    /// How many numbers.
    pub fn rows(&self) -> usize {
        match &self.kind {
            ReadingKind::Displacement { rows, .. } => rows.len(),
            ReadingKind::Place { .. } => 3,
            ReadingKind::Known { .. } => 1,
            ReadingKind::TargetAt { .. } => 3,
            ReadingKind::InstrumentAt { std, .. } => 3 + 3 * usize::from(std.is_some()),
            ReadingKind::Frequencies { rows, .. } => rows.len(),
            ReadingKind::Response(response) => 2 * response.points.len(),
            ReadingKind::Shape(shape) => shape.probes.len(),
        }
    }

    /// All standard deviations so many times as large.
    pub(crate) fn scale_deviations(&mut self, factor: f64) {
        match &mut self.kind {
            ReadingKind::Displacement { rows, .. } => rows.iter_mut().for_each(|row| row.std *= factor),
            ReadingKind::Place { std, .. } => *std *= factor,
            ReadingKind::Known { std, .. } | ReadingKind::TargetAt { std, .. } => *std *= factor,
            ReadingKind::InstrumentAt { std, std_rotation, .. } => {
                *std = std.map(|std| std * factor);
                *std_rotation *= factor;
            }
            ReadingKind::Frequencies { rows, .. } => rows.iter_mut().for_each(|row| row.std *= factor),
            ReadingKind::Response(response) => {
                response.points.iter_mut().for_each(|(.., std)| *std = std.map(|std| std * factor));
            }
            ReadingKind::Shape(shape) => shape.std *= factor,
        }
    }

    /// Standard deviation of each number.
    pub fn deviations(&self) -> Vec<f64> {
        match &self.kind {
            ReadingKind::Displacement { rows, .. } => rows.iter().map(|row| row.std).collect(),
            ReadingKind::Place { std, .. } => std.iter().copied().collect(),
            ReadingKind::Known { std, .. } => vec![*std],
            ReadingKind::TargetAt { std, .. } => vec![*std; 3],
            ReadingKind::InstrumentAt { std, std_rotation, .. } => {
                std.map_or(Vec::new(), |std| vec![std; 3]).into_iter().chain([*std_rotation; 3]).collect()
            }
            ReadingKind::Frequencies { rows, .. } => rows.iter().map(|row| row.std).collect(),
            ReadingKind::Response(response) => response.points.iter().flat_map(|(.., std)| *std).collect(),
            ReadingKind::Shape(shape) => vec![shape.std; shape.probes.len()],
        }
    }
}

/// A point on the tool whose place is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Known, tool axes (m).
    Known(Vector3<f64>),
    /// Unknown; a guess.
    Unknown(Vector3<f64>),
}

/// Where an instrument stands: the world in its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Instrument {
    /// Known.
    Known(Pose),
    /// Unknown; a guess.
    Unknown(Pose),
    /// Only its axes count, and are unknown; a guess.
    Axes(Rotation3<f64>),
}

impl Instrument {
    /// How many unknowns it has.
    pub fn unknowns(&self) -> usize {
        match self {
            Self::Known(_) => 0,
            Self::Unknown(_) => 6,
            Self::Axes(_) => 3,
        }
    }
}

/// Readings, and what belongs to them.
#[derive(Clone, Debug, Default)]
pub struct Measurements {
    /// What was read.
    pub readings: Vec<Reading>,
    /// Points that places are of.
    pub targets: Vec<Target>,
    /// Instruments that places are seen from.
    pub instruments: Vec<Instrument>,
}

impl Measurements {
    /// How many unknowns belong to the measurements: those of the instruments, then three per
    /// unknown target.
    pub fn own_unknowns(&self) -> usize {
        let targets = self.targets.iter().filter(|t| matches!(t, Target::Unknown(_))).count();
        self.of_instruments() + 3 * targets
    }

    fn of_instruments(&self) -> usize {
        self.instruments.iter().map(Instrument::unknowns).sum()
    }

    /// How many numbers were read.
    pub fn rows(&self) -> usize {
        self.readings.iter().map(Reading::rows).sum()
    }

    /// The same with some of the readings.
    #[must_use]
    pub fn of_readings(&self, keep: impl Fn(usize) -> bool) -> Self {
        let readings = self.readings.iter().enumerate().filter(|(k, _)| keep(*k)).map(|(_, r)| r.clone()).collect();
        Self { readings, ..self.clone() }
    }

    /// The same with the logarithm of responses in the place of their real and imaginary parts;
    /// none if there are no such.
    pub(crate) fn logarithmic(&self) -> Option<Self> {
        let mut all = self.clone();
        let mut some = false;
        for reading in &mut all.readings {
            let ReadingKind::Response(response) = &mut reading.kind else { continue };
            if response.form == Form::Complex {
                (some, response.form) = (true, Form::Logarithmic);
                // A deviation as a part of the value; of a value in the noise next to nothing is
                // known.
                let part = |value: &Complex<f64>, std: &[f64; 2]| std.map(|std| (std / value.norm()).min(10.0));
                response.points.retain(|(_, value, _)| value.norm() > 0.0);
                response.points.iter_mut().for_each(|(_, value, std)| *std = part(value, std));
            }
        }
        some.then_some(all)
    }

    /// The world in the axes of an instrument, and where in `own` the unknowns of its place and of
    /// its rotation begin.
    pub(crate) fn instrument(&self, number: usize, own: &[f64]) -> (Pose, Option<usize>, Option<usize>) {
        let first = self.instruments[..number].iter().map(Instrument::unknowns).sum();
        let v = |at: usize| Vector3::new(own[at], own[at + 1], own[at + 2]);
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

    /// A target on the tool, and where in `own` its three unknowns begin.
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
