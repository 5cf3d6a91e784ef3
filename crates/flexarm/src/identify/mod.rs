//! Parameters of a robot file from measurements at the robot, and poses that are worth measuring.
//!
//! [`identify_robot`] reads a file of measurements (`docs/identify.md`), finds what they tell of the robot file's numbers and says
//! how well; [`plan_measurements`] chooses poses. What they are made of takes and gives values and is passed on here:
//! [`identify`], [`plan`], [`MeasuredArm`].

mod encoders;
mod file;
mod page;
pub(crate) mod parameters;
mod plan_file;
mod response_file;
pub(crate) mod rewrite;
mod uff;

use std::path::{Path, PathBuf};

use flexarm_files::{check_free, write_all};
pub use flexarm_identify::{
    Answer, Candidate, Component, Effect, Form, Found, GearEstimate, GearRun, HeldOut, Identified, IdentifyError,
    IdentifyOptions, Instrument, LoadCase, Loss, MeasuredArm, MeasuredResponse, MeasuredShape, Measurements, NoAnswer,
    Parameter, Place, Plan, PlanOptions, Plant, Probe, Reading, ReadingKind, ResponseSlopes, Row, Search, Structure,
    StructureSlopes, Target, compliance_slopes, frequency_slopes, gear_stiffness, identify, plan, structure_slopes,
    tool_slopes,
};
use flexarm_kinematics::Pose;
use nalgebra::{DVector, Vector3};
use serde::Serialize;

use self::file::{Cell, MeasurementInput};
use self::parameters::Written;
use crate::arm::Arm;
use crate::caveat::Caveat;
use crate::error::Error;
use crate::options::Modelling;
use crate::robot::Robot;
use crate::robot_file::RobotFileError;

pub use self::encoders::EncoderFigures;
pub use self::plan_file::{MeasurementPlan, PlanRequest, PlannedReading, plan_measurements};

/// Beyond this ratio of measured to expected size the units are wrong, not the robot.
const UNIT_RATIO: f64 = 100.0;
/// Readings that are named as arguing against the model.
const MOST_SUSPICIOUS: usize = 10;
/// Scatter of places about the rigid robot, over their spread, beyond which frames or joints do not fit.
const FRAME_RATIO: f64 = 0.05;

impl Arm {
    /// The arm as the identification takes it: tree, springs, tool.
    pub fn plant(&self) -> Plant {
        parameters::plant(self.flexible())
    }

    /// What of the robot file can be identified on this arm, by the names that files and `--fit` use.
    pub fn parameters(&self) -> Vec<Parameter> {
        self.candidates_that(|name| !parameters::is_direction(name))
    }

    /// The six directions of each lumped link's springs, `link.LINK.stiffness_factors[k]`: together they are the link's stiffness, which
    /// [`Arm::parameters`] has as a whole.
    pub fn link_directions(&self) -> Vec<Parameter> {
        self.candidates_that(parameters::is_direction)
    }

    fn candidates_that(&self, wanted: impl Fn(&str) -> bool) -> Vec<Parameter> {
        let all = parameters::candidates(self.robot(), self.flexible()).into_iter();
        all.map(|c| c.parameter).filter(|parameter| wanted(&parameter.name)).collect()
    }
}

/// What is asked of [`identify_robot`].
#[derive(Clone, Debug, Default)]
pub struct IdentifyRequest {
    /// How links and drives are modelled.
    pub modelling: Modelling,
    /// Names of what is unknown, * for anything, in the place of those in the file.
    pub fit: Vec<String>,
    /// Folder of the new robot file and the page; nothing is written without it.
    pub output: Option<PathBuf>,
    /// Overwrite what is there.
    pub overwrite: bool,
}

/// Answer of `flexarm identify`.
#[derive(Clone, Debug, Serialize)]
pub struct Identification {
    /// The robot.
    pub robot: String,
    /// The file of measurements.
    pub measurements: String,
    /// How many readings, and numbers in them.
    pub readings: usize,
    /// Numbers that were measured.
    pub numbers: usize,
    /// What was fitted.
    pub parameters: Vec<FittedParameter>,
    /// Correlation of the parameters, row after row.
    pub correlation: Vec<Vec<f64>>,
    /// Combinations that the readings do not tell.
    pub untold: Vec<Vec<Weight>>,
    /// RMS of the residuals.
    pub residual: Residual,
    /// RMS over readings that the fit had not seen; null with fewer than two readings.
    pub held_out: Option<HeldOutFigures>,
    /// How many times larger than its declared deviation the scatter is, where chance does not explain it; else null.
    pub misfit: Option<f64>,
    /// Whether the deviations of the readings were given; if not, the scatter tells them.
    pub deviations_known: bool,
    /// Gears of which motor and link were recorded.
    pub encoders: Vec<EncoderFigures>,
    /// Readings that argue against the rest, the worst first.
    pub suspicious: Vec<Suspicious>,
    /// Measured shapes of modes against those of the arm.
    pub shapes: Vec<ShapeFigures>,
    /// Unknown instruments as found, in the world.
    pub instruments: Vec<FoundFrame>,
    /// Unknown targets as found, tool axes (m).
    pub targets: Vec<FoundPoint>,
    /// Iterations.
    pub iterations: usize,
    /// Whether the search ended by itself.
    pub converged: bool,
    /// The new robot file.
    pub file: Option<String>,
    /// The page.
    pub page: Option<String>,
    /// What is doubtful.
    pub caveats: Vec<Caveat>,
    /// Each number: measured, expected before and after.
    #[serde(skip)]
    pub compared: Vec<Compared>,
}

/// A number of the robot file as it was found.
#[derive(Clone, Debug, Serialize)]
pub struct FittedParameter {
    /// By the names of the robot file.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Before.
    pub initial: f64,
    /// Now; the initial value where the readings say nothing.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
    /// Where it lies in 95 of 100 cases.
    pub interval: [f64; 2],
    /// Whether the readings tell it.
    pub identifiable: bool,
}

/// A parameter in a combination.
#[derive(Clone, Debug, Serialize)]
pub struct Weight {
    /// Its name.
    pub name: String,
    /// Its weight, over the prior deviation.
    pub weight: f64,
}

/// RMS before and after.
#[derive(Clone, Debug, Serialize)]
pub struct Residual {
    /// With the robot file as it is.
    pub before: f64,
    /// With what was found.
    pub after: f64,
    /// `m`, `Hz`, or `std` where readings of several units are mixed.
    pub unit: &'static str,
}

/// RMS over readings that the fit had not seen.
#[derive(Clone, Debug, Serialize)]
pub struct HeldOutFigures {
    /// Parts that were held out in turn.
    pub folds: usize,
    /// With the parameters fitted to the others.
    pub rms: f64,
    /// With the robot file as it is.
    pub rms_before: f64,
    /// As of the residual.
    pub unit: &'static str,
}

/// A reading that argues against the rest.
#[derive(Clone, Debug, Serialize)]
pub struct Suspicious {
    /// Which reading and number of it.
    pub reading: String,
    /// Measured (SI).
    pub measured: f64,
    /// Expected with what was found.
    pub expected: f64,
    /// Difference over what its scatter would be.
    pub normalised: f64,
}

/// A measured shape against the arm's mode that is most like it.
#[derive(Clone, Debug, Serialize)]
pub struct ShapeFigures {
    /// Which reading.
    pub reading: String,
    /// The mode, from 1, with what was found.
    pub mode: usize,
    /// Modal assurance criterion with the robot file as it is, from 0 to 1.
    pub assurance_before: f64,
    /// The same with what was found.
    pub assurance: f64,
}

/// Where an instrument stands.
#[derive(Clone, Debug, Serialize)]
pub struct FoundFrame {
    /// Its name.
    pub name: String,
    /// In the world (m).
    pub xyz: [f64; 3],
    /// Roll, pitch, yaw (rad).
    pub rpy: [f64; 3],
}

/// Where a target is.
#[derive(Clone, Debug, Serialize)]
pub struct FoundPoint {
    /// Its name.
    pub name: String,
    /// In tool axes (m).
    pub xyz: [f64; 3],
}

/// One measured number.
#[derive(Clone, Debug, Serialize)]
pub struct Compared {
    /// Which.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Measured.
    pub measured: f64,
    /// Expected of the robot file as it is.
    pub before: f64,
    /// Expected with what was found.
    pub after: f64,
    /// Its deviation.
    pub std: f64,
}

/// Finds what measurements tell of a robot's numbers, and writes a robot file with them.
///
/// # Errors
/// [`Error::RobotFile`] with line and column for what is wrong in the file, [`Error::File`] for its tables; [`Error::Identify`]
/// where the measurements cannot be met: units, frames, rank; [`Error::Taken`], [`Error::Write`].
pub fn identify_robot(robot: &Robot, measurements: &Path, request: &IdentifyRequest) -> Result<Identification, Error> {
    let arm = robot.flexible(request.modelling)?;
    if parameters::candidates(robot, arm.flexible()).is_empty() {
        return Err(IdentifyFileError::NothingGives.into());
    }
    let joints = joints_of(&arm);
    let mut input = file::read(measurements, &Cell { joints: &joints, arm: &arm })?;
    let chosen = chosen(&arm, &input, &request.fit)?;
    let encoders = encoders::told(&arm, &input, &chosen)?;
    input.measurements.readings.extend(encoders.iter().filter_map(EncoderFigures::reading));
    if input.measurements.readings.is_empty() {
        return Err(
            IdentifyFileError::NoGear { joints: encoders.iter().map(|gear| gear.joint.clone()).collect() }.into()
        );
    }
    let targets = match &request.output {
        Some(folder) => Some(Targets::in_folder(folder, request.overwrite)?),
        None => None,
    };
    let plant = arm.plant();
    check_modes(&plant, &input)?;
    check_units(&plant, &input)?;
    let parameters: Vec<Parameter> = chosen.iter().map(|c| c.parameter.clone()).collect();
    let options = IdentifyOptions {
        search: Search { loss: input.loss, ..Search::default() },
        deviations_known: input.deviations_known,
        ..IdentifyOptions::default()
    };
    let found = identify(&plant, &parameters, &input.measurements, &options).map_err(of_names(&input))?;
    let mut answer = answer(robot, measurements, &plant, &parameters, &input, &found)?;
    answer.caveats.extend(frame_caveat(&input, &answer));
    answer.caveats.extend(gear_caveat(robot));
    answer.encoders = encoders;
    if let Some(targets) = targets {
        targets.write(robot, &chosen, &found, &mut answer)?;
    }
    Ok(answer)
}

/// Actuated joints in coordinate order, and whether they slide.
fn joints_of(arm: &Arm) -> Vec<(String, bool)> {
    let model = &arm.flexible().model;
    let actuated = &model.coordinates()[..model.n_actuated()];
    actuated.iter().map(|c| (c.joint.clone(), c.kind == "prismatic")).collect()
}

/// Whether any drive has a spring in this modelling.
fn gives_way(arm: &Arm) -> bool {
    arm.flexible().owners.iter().any(|owner| matches!(owner, crate::flexible::Owner::Drive(_)))
}

/// What the file or the request asks for, in the robot's order.
fn chosen(arm: &Arm, input: &MeasurementInput, fit: &[String]) -> Result<Vec<parameters::Candidate>, Error> {
    let coupled = arm.robot().coupling.as_ref().filter(|_| gives_way(arm) && !input.recordings.is_empty());
    if let Some(coupling) = coupled {
        return Err(IdentifyFileError::Coupled { joints: coupling.joints.clone() }.into());
    }
    let all = parameters::candidates(arm.robot(), arm.flexible());
    let names = || all.iter().map(|c| c.parameter.name.clone()).collect::<Vec<_>>();
    if all.is_empty() {
        return Err(IdentifyFileError::NothingGives.into());
    }
    let unknown = |pattern: &str| format!("no parameter of this robot is called {pattern:?}; they are {:?}", names());
    let placed = |place: &RobotFileError, text: String| Error::from(RobotFileError { message: text, ..place.clone() });
    for (pattern, place) in input.fit.iter().chain(&input.keep) {
        if !all.iter().any(|c| parameters::fits(pattern, &c.parameter.name)) {
            return Err(placed(place, unknown(pattern)));
        }
    }
    if let Some(pattern) = fit.iter().find(|p| !all.iter().any(|c| parameters::fits(p, &c.parameter.name))) {
        return Err(IdentifyFileError::UnknownParameter { text: unknown(pattern) }.into());
    }
    let wanted = |name: &str| match (fit.is_empty(), input.fit.is_empty()) {
        (false, _) => fit.iter().any(|p| parameters::asks_for(p, name)),
        (true, false) => input.fit.iter().any(|(p, _)| parameters::asks_for(p, name)),
        // Masses, dampings and single directions of links are asked for by name.
        (true, true) => name != "payload.mass" && !name.ends_with(".damping") && !parameters::is_direction(name),
    };
    let kept = |name: &str| input.keep.iter().any(|(p, _)| parameters::fits(p, name));
    let mut chosen: Vec<_> = all.clone();
    chosen.retain(|c| wanted(&c.parameter.name) && !kept(&c.parameter.name));
    if chosen.is_empty() {
        return Err(IdentifyFileError::NothingFitted { known: names() }.into());
    }
    for candidate in &mut chosen {
        let logarithmic = candidate.parameter.is_logarithmic();
        if let Some(factor) = input.uncertainty.filter(|_| logarithmic) {
            candidate.parameter.prior = factor.ln();
        }
    }
    for (name, uncertainty, place) in &input.known {
        let Some(candidate) = chosen.iter_mut().find(|c| c.parameter.name == *name) else {
            return Err(placed(place, format!("{name:?} is not fitted; fitted are {:?}", names())));
        };
        let logarithmic = candidate.parameter.is_logarithmic();
        if logarithmic && *uncertainty <= 1.0 {
            let text = "of a stiffness or a damping the uncertainty is a factor above 1: 1.5 for half as much again either way";
            return Err(placed(place, text.into()));
        }
        candidate.parameter.prior = if logarithmic { uncertainty.ln() } else { *uncertainty };
    }
    Ok(chosen)
}

/// What keeps measurements from telling anything.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyFileError {
    /// A rigid robot.
    #[error(
        "the robot has no flexible link and no elastic drive: there is no stiffness to find; add [[flexible_link]] or [[drive]] \
         entries with a first guess"
    )]
    NothingGives,
    /// Gears that move several joints.
    #[error(
        "the gears of {joints:?} are coupled: motor less link of one joint is not the deflection of one spring; leave [[encoders]] out and \
         measure displacements, places, frequencies or responses, which know the coupling"
    )]
    Coupled {
        /// Joints.
        joints: Vec<String>,
    },
    /// A name that is not there.
    #[error("{text}")]
    UnknownParameter {
        /// All of it.
        text: String,
    },
    /// Everything is kept.
    #[error("nothing is left to fit: of {known:?} all are kept")]
    NothingFitted {
        /// Names.
        known: Vec<String>,
    },
    /// Numbers out of all proportion.
    #[error(
        "the measured {what} are {ratio:.3e} times as large as those of the robot as it is: no robot is that far from its description. \
         The file says length = {length:?}; {help}"
    )]
    Units {
        /// Displacements, or distances between places.
        what: &'static str,
        /// Measured over expected.
        ratio: f64,
        /// Unit of the file.
        length: &'static str,
        /// What to try.
        help: String,
    },
    /// A point that does not move.
    #[error(
        "{reading}: the arm as it is does not move there along that direction, or cannot be hit so: look at nodes, their links and directions"
    )]
    Still {
        /// Which.
        reading: String,
    },
    /// A response out of all proportion.
    #[error(
        "{reading}: the measured response is {ratio:.3e} times as large as that of the robot as it is: no robot is that far from its \
         description; look at unit, at what was measured (displacement, velocity, acceleration), at nodes and directions"
    )]
    ResponseUnits {
        /// Which.
        reading: String,
        /// Measured over expected.
        ratio: f64,
    },
    /// A mode that the model does not have.
    #[error("{reading}: mode {mode} is asked for, the model has {modes} modes")]
    NoMode {
        /// Which reading.
        reading: String,
        /// From 1.
        mode: usize,
        /// How many there are.
        modes: usize,
    },
    /// Recordings that tell no gear.
    #[error("the recordings of {joints:?} tell no stiffness: deflection and torque do not go together")]
    NoGear {
        /// Joints.
        joints: Vec<String>,
    },
    /// No fit.
    #[error("{0}")]
    Fit(String),
}

/// The fit's error with the names of instruments.
fn of_names(input: &MeasurementInput) -> impl Fn(IdentifyError) -> Error + '_ {
    |error| {
        let text = error.to_string();
        let named = input.instruments.iter().enumerate().fold(text, |text, (k, name)| {
            text.replace(&format!("instrument {k}:"), &format!("instrument {name:?}:"))
                .replace(&format!("where instrument {k} stands"), &format!("where instrument {name:?} stands"))
        });
        IdentifyFileError::Fit(named).into()
    }
}

/// Modes beyond those that the model has.
fn check_modes(plant: &Plant, input: &MeasurementInput) -> Result<(), Error> {
    let modes = plant.model.n_elastic();
    for reading in &input.measurements.readings {
        let ReadingKind::Frequencies { rows, .. } = &reading.kind else { continue };
        if let Some(row) = rows.iter().find(|row| row.of >= modes) {
            let reading = reading.name.clone();
            return Err(IdentifyFileError::NoMode { reading, mode: row.of + 1, modes }.into());
        }
    }
    Ok(())
}

/// Displacements and distances against those of the robot as it is: a thousandfold is a unit.
fn check_units(plant: &Plant, input: &MeasurementInput) -> Result<(), Error> {
    let of = |kind: fn(&ReadingKind) -> bool| {
        let mut some = input.measurements.of_readings(|k| kind(&input.measurements.readings[k].kind));
        some.instruments.iter_mut().for_each(|i| *i = Instrument::Known(Pose::identity()));
        some.targets.iter_mut().for_each(|t| {
            if let Target::Unknown(guess) = t {
                *t = Target::Known(*guess);
            }
        });
        some
    };
    let both = |some: &Measurements| -> Result<(Vec<f64>, Vec<f64>), Error> {
        let arm = MeasuredArm { plant, parameters: &[], measurements: some };
        let expected = arm.predicted(&DVector::zeros(0)).map_err(|e| IdentifyFileError::Fit(e.to_string()))?;
        Ok((arm.observed(), expected))
    };
    let norm = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>().sqrt();
    let moved = of(|kind| matches!(kind, ReadingKind::Displacement { .. }));
    let (measured, expected) = both(&moved)?;
    told_ratio("displacements", norm(&measured), norm(&expected), input)?;
    let (measured, expected) = both(&of(|kind| matches!(kind, ReadingKind::Place { .. })))?;
    let spread = |values: &[f64]| {
        let points: Vec<Vector3<f64>> = values.chunks_exact(3).map(Vector3::from_column_slice).collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        points.iter().map(|p| (p - middle).norm_squared()).sum::<f64>().sqrt()
    };
    told_ratio("distances between places", spread(&measured), spread(&expected), input)?;
    for reading in &input.measurements.readings {
        let ReadingKind::Response(response) = &reading.kind else { continue };
        let plain = MeasuredResponse { form: Form::Logarithmic, ..response.clone() };
        let reading = Reading { kind: ReadingKind::Response(plain), ..reading.clone() };
        let one = Measurements { readings: vec![reading.clone()], ..Measurements::default() };
        let (measured, expected) = both(&one)?;
        let off: f64 = measured.iter().zip(&expected).step_by(2).map(|(a, b)| a - b).sum();
        let ratio = (off / response.points.len() as f64).exp();
        if expected.iter().any(|x| !x.is_finite()) {
            return Err(IdentifyFileError::Still { reading: reading.name }.into());
        }
        if !(1.0 / UNIT_RATIO..=UNIT_RATIO).contains(&ratio) {
            return Err(IdentifyFileError::ResponseUnits { reading: reading.name, ratio }.into());
        }
    }
    Ok(())
}

fn told_ratio(what: &'static str, measured: f64, expected: f64, input: &MeasurementInput) -> Result<(), Error> {
    if measured == 0.0 || expected == 0.0 {
        return Ok(());
    }
    let ratio = measured / expected;
    if (1.0 / UNIT_RATIO..=UNIT_RATIO).contains(&ratio) {
        return Ok(());
    }
    let units = [("m", 1.0), ("mm", 1e-3), ("um", 1e-6)];
    let better = units.iter().find(|(_, size)| {
        let other = ratio * size / input.length_m;
        *size != input.length_m && (0.1..=10.0).contains(&other)
    });
    let help = match better {
        Some((name, _)) => format!("with length = {name:?} they would be of the same size"),
        None => "look at units, loads and the first guess of the stiffness".into(),
    };
    Err(IdentifyFileError::Units { what, ratio, length: input.length, help }.into())
}

/// Unit of each number, and its name within the reading.
fn numbers(measurements: &Measurements) -> Vec<(String, &'static str)> {
    let axis = |v: &Vector3<f64>| match v.iter().position(|x| *x == 1.0) {
        Some(k) => ["x", "y", "z"][k].to_owned(),
        None => "along its direction".to_owned(),
    };
    let mut all = Vec::new();
    for reading in &measurements.readings {
        match &reading.kind {
            ReadingKind::Displacement { rows, .. } => all.extend(rows.iter().map(|row| match &row.of {
                Component::Along(d) => (format!("{}, {}", reading.name, axis(d)), "m"),
                Component::About(d) => (format!("{}, about {}", reading.name, axis(d)), "rad"),
            })),
            ReadingKind::Place { .. } => {
                all.extend(["x", "y", "z"].map(|axis| (format!("{}, {axis}", reading.name), "m")));
            }
            ReadingKind::Known { .. } => all.push((reading.name.clone(), "ln")),
            ReadingKind::Frequencies { rows, .. } => {
                all.extend(rows.iter().map(|row| (format!("{}, mode {}", reading.name, row.of + 1), "Hz")));
            }
            ReadingKind::Response(response) => {
                let (words, units) = match response.form {
                    Form::Logarithmic => (["magnitude (ln)", "phase"], ["ln", "rad"]),
                    Form::Complex => (["real part", "imaginary part"], [response.answer.unit(); 2]),
                };
                for (omega, ..) in &response.points {
                    let hz = omega / std::f64::consts::TAU;
                    all.extend([0, 1].map(|k| (format!("{}, {hz:.4} Hz, {}", reading.name, words[k]), units[k])));
                }
            }
            ReadingKind::Shape(shape) => {
                all.extend((0..shape.probes.len()).map(|k| (format!("{}, point {}", reading.name, k + 1), "1")));
            }
        }
    }
    all
}

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len() as f64;
    (values.map(|x| x * x).sum::<f64>() / n).sqrt()
}

fn answer(
    robot: &Robot,
    path: &Path,
    plant: &Plant,
    fitted: &[Parameter],
    input: &MeasurementInput,
    found: &Identified,
) -> Result<Identification, Error> {
    let measurements = &input.measurements;
    let names = numbers(measurements);
    let deviations: Vec<f64> = measurements.readings.iter().flat_map(Reading::deviations).collect();
    let observed = MeasuredArm { plant, parameters: &[], measurements }.observed();
    let one_unit = names.windows(2).all(|pair| pair[0].1 == pair[1].1);
    let unit = if one_unit { names[0].1 } else { "std" };
    let in_unit = |r: f64, k: usize| if one_unit { r * deviations[k] } else { r };
    let of = |residuals: &[f64]| rms(residuals.iter().enumerate().map(|(k, r)| in_unit(*r, k)));
    let residuals = found.solution.residuals.as_slice();
    let compared: Vec<Compared> = (0..names.len())
        .map(|k| Compared {
            name: names[k].0.clone(),
            unit: names[k].1,
            measured: observed[k],
            before: observed[k] + found.before[k] * deviations[k],
            after: observed[k] + residuals[k] * deviations[k],
            std: deviations[k],
        })
        .collect();
    let held_out = found.held_out.as_ref().map(|held| {
        let seen: Vec<usize> = (0..held.residuals.len()).filter(|k| held.residuals[*k].is_finite()).collect();
        let of = |values: &[f64]| rms(seen.iter().map(|k| in_unit(values[*k], *k)));
        HeldOutFigures { folds: held.folds, rms: of(&held.residuals), rms_before: of(&found.before), unit }
    });
    let suspicious = found.suspicious.iter().take(MOST_SUSPICIOUS).map(|k| Suspicious {
        reading: compared[*k].name.clone(),
        measured: compared[*k].measured,
        expected: compared[*k].after,
        normalised: found.normalised[*k],
    });
    let weights = |combination: &Vec<(usize, f64)>| {
        combination.iter().map(|(k, weight)| Weight { name: fitted[*k].name.clone(), weight: *weight }).collect()
    };
    let parameters = found.parameters.iter().map(|p| FittedParameter {
        name: p.name.clone(),
        unit: p.unit.clone(),
        initial: p.initial,
        value: p.value,
        std: p.std,
        interval: p.interval,
        identifiable: p.identifiable,
    });
    let p = fitted.len();
    Ok(Identification {
        robot: robot.name.clone(),
        measurements: path.display().to_string(),
        readings: measurements.readings.len(),
        numbers: names.len(),
        parameters: parameters.collect(),
        correlation: (0..p).map(|i| (0..p).map(|j| found.correlation[(i, j)]).collect()).collect(),
        untold: found.untold.iter().map(weights).collect(),
        residual: Residual { before: of(&found.before), after: of(residuals), unit },
        held_out,
        misfit: found.misfit,
        deviations_known: input.deviations_known,
        encoders: Vec::new(),
        suspicious: suspicious.collect(),
        shapes: shapes(plant, fitted, measurements, &found.solution.unknowns)?,
        instruments: frames(input, found),
        targets: points(input, found),
        iterations: found.solution.iterations,
        converged: found.solution.converged,
        file: None,
        page: None,
        caveats: caveats(found),
        compared,
    })
}

fn shapes(
    plant: &Plant,
    fitted: &[Parameter],
    measurements: &Measurements,
    unknowns: &DVector<f64>,
) -> Result<Vec<ShapeFigures>, Error> {
    let arm = MeasuredArm { plant, parameters: fitted, measurements };
    let of = |unknowns: &DVector<f64>| {
        arm.assurances(unknowns).map_err(|error| Error::from(IdentifyFileError::Fit(error.to_string())))
    };
    let (before, after) = (of(&DVector::zeros(unknowns.len()))?, of(unknowns)?);
    let figures = before.iter().zip(after).map(|((_, _, before), (number, mode, assurance))| ShapeFigures {
        reading: measurements.readings[number].name.clone(),
        mode: mode + 1,
        assurance_before: *before,
        assurance,
    });
    Ok(figures.collect())
}

fn frames(input: &MeasurementInput, found: &Identified) -> Vec<FoundFrame> {
    let all = input.instruments.iter().zip(&found.instruments).zip(&input.measurements.instruments);
    let unknown = all.filter(|(_, given)| matches!(given, Instrument::Unknown(_)));
    let frame = |((name, X_IW), _): ((&String, &Pose), _)| {
        let X_WI = X_IW.inverse();
        let (roll, pitch, yaw) = X_WI.rotation.euler_angles();
        FoundFrame { name: name.clone(), xyz: X_WI.translation.vector.into(), rpy: [roll, pitch, yaw] }
    };
    unknown.map(frame).collect()
}

fn points(input: &MeasurementInput, found: &Identified) -> Vec<FoundPoint> {
    let all = input.targets.iter().zip(&found.targets).zip(&input.measurements.targets);
    let unknown = all.filter(|(_, given)| matches!(given, Target::Unknown(_)));
    unknown.map(|((name, p), _)| FoundPoint { name: name.clone(), xyz: (*p).into() }).collect()
}

fn caveats(found: &Identified) -> Vec<Caveat> {
    let mut caveats = Vec::new();
    if let Some(factor) = found.misfit {
        let text = format!(
            "the readings scatter {factor:.1} times as much as their deviations say: the model lacks something that gives way, \
             loads or frames are wrong, or the deviations are too small; the deviations of the results are enlarged by that"
        );
        caveats.push(Caveat::said(
            "misfit",
            "measurements",
            text,
            "free more parameters, look at the largest residuals",
        ));
    }
    for parameter in found.parameters.iter().filter(|p| !p.identifiable) {
        let text = format!("{} does not follow from these readings: it stays where it was", parameter.name);
        caveats.push(Caveat::said(
            "not-identifiable",
            "measurements",
            text,
            "measure where it counts: a plan says where",
        ));
    }
    if let Some(held) = found.held_out.as_ref().filter(|held| held.rms > held.rms_initial) {
        let text = format!(
            "readings that the fit had not seen are met worse than with the robot file as it is ({:.2} against {:.2} deviations): \
             there are too many parameters for these readings",
            held.rms, held.rms_initial
        );
        caveats.push(Caveat::said("over-fitted", "measurements", text, "fit fewer parameters or measure more poses"));
    }
    if !found.solution.converged {
        let text = "the search did not settle: take the values with care";
        caveats.push(Caveat::said("not-converged", "measurements", text, "a better first guess helps"));
    }
    caveats
}

/// Laws of gears that the readings are met without.
fn gear_caveat(robot: &Robot) -> Option<Caveat> {
    let has = |drive: &&crate::Drive| {
        drive.gearbox.as_ref().is_some_and(|(_, gear)| gear.hysteresis.is_some() || !gear.transmission.is_empty())
    };
    let joints: Vec<&str> = robot.drives.iter().filter(has).map(|drive| drive.joint.as_str()).collect();
    (!joints.is_empty()).then(|| {
        let text = format!(
            "hysteresis and transmission errors of {} are not in the fit: gears are springs there",
            joints.join(", ")
        );
        Caveat::said("gear-laws", "measurements", text, "load from the same side every time").as_note()
    })
}

/// Places that no placement of the instrument brings near those of the robot.
fn frame_caveat(input: &MeasurementInput, answer: &Identification) -> Option<Caveat> {
    let places = |k: &usize| answer.compared[*k].unit == "m";
    let has_places = input.measurements.readings.iter().any(|r| matches!(r.kind, ReadingKind::Place { .. }));
    let metres: Vec<usize> = (0..answer.compared.len()).filter(places).collect();
    if !has_places || metres.is_empty() {
        return None;
    }
    let measured: Vec<f64> = metres.iter().map(|k| answer.compared[*k].measured).collect();
    let mean = measured.iter().sum::<f64>() / measured.len() as f64;
    let spread = rms(measured.iter().map(|x| x - mean));
    let left = rms(metres.iter().map(|k| answer.compared[*k].after - answer.compared[*k].measured));
    (left > FRAME_RATIO * spread).then(|| {
        let text = format!(
            "the places are {:.1} mm (RMS) from those of the robot wherever the instrument stands: joint values, their order, senses or \
             units, or the targets are not those of this robot",
            1e3 * left
        );
        Caveat::said("frames", "measurements", text, "compare one pose by hand with what the robot model says (inspect)")
    })
}

/// Files of an answer.
struct Targets {
    robot: PathBuf,
    page: PathBuf,
}

impl Targets {
    fn in_folder(folder: &Path, overwrite: bool) -> Result<Self, Error> {
        let targets = Self { robot: folder.join("robot.toml"), page: folder.join("identification.html") };
        check_free(&[targets.robot.clone(), targets.page.clone()], overwrite)?;
        Ok(targets)
    }

    fn write(
        self,
        robot: &Robot,
        chosen: &[parameters::Candidate],
        found: &Identified,
        answer: &mut Identification,
    ) -> Result<(), Error> {
        let told = found.parameters.iter().zip(chosen).filter(|(p, _)| p.identifiable);
        let told: Vec<(Found, Written)> = told.map(|(p, c)| (p.clone(), c.written.clone())).collect();
        let text = flexarm_files::read_text(&robot.path)?;
        let home = robot.path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = self.robot.parent().unwrap_or(Path::new("."));
        // The place of the new file must be there for paths as seen from it.
        std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.to_owned(), source })?;
        let new = rewrite::rewritten(&text, &told, home, folder)
            .map_err(|what| Error::File { path: robot.path.clone(), what })?;
        (answer.file, answer.page) = (Some(self.robot.display().to_string()), Some(self.page.display().to_string()));
        let page = page::html(answer);
        write_all(&[(self.robot, new), (self.page, page)])?;
        Ok(())
    }
}
