//! Helpers shared by the cases: shipped files, arms held at a pose, loads, and a stepper that runs
//! until the arm is at rest.
//!
//! Start at `Rig`: an arm with its joints at zero and the frame that is loaded and watched.
//! Six-vectors are displacement and rotation, or force and moment, of that frame in world axes (m,
//! rad; N, N m), linear first. `Worst` keeps NaN. Not here: closed forms (`textbook.rs`), meshes
//! (`meshed.rs`).

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexarm::errors::StepError;
use flexarm::robots::TCP_FRAME;
use flexarm::steppers::{ConstraintForm, SpookPreset, SpookSettings, Start};
use flexarm::{LinkModel, Modelling, Motion, Robot, StepperKind};
use flexarm_analysis::tcp_error;
use flexarm_files::NumberTable;
use flexarm_kinematics::{Data, Frame, Pose, State, Wrench, forward_kinematics};
use flexarm_stepping::{
    AlphaSettings, Damping, Held, Load, Observation, Plant, PrescribedMotion, TimedWrench, new_stepper,
    static_equilibrium,
};
use nalgebra::{DVector, Matrix6, Vector3, Vector6};
use serde_json::Value;

use crate::Error;

/// Test bench: root folder of a checkout (with `robots`, `trajectories` and `tests`) and extent of
/// the run.
#[derive(Clone, Debug)]
pub struct Bench {
    /// Root folder.
    pub root: PathBuf,
    /// Folder for files that are removed at the end.
    pub scratch: PathBuf,
    /// Whether slow parts are left out.
    pub quick: bool,
}

impl Bench {
    /// Loads a shipped robot, by its path relative to the root.
    pub(crate) fn robot(&self, file: &str) -> Result<Robot, Error> {
        let path = self.root.join(file);
        if !path.is_file() {
            let what = "there is no such file; the case studies need robots, trajectories and tests of a checkout of the \
                        project: give its folder as data";
            return Err(flexarm::Error::File { path, what: what.to_owned() }.into());
        }
        Ok(Robot::load(&path)?)
    }

    /// Path of a shipped file.
    pub(crate) fn file(&self, file: &str) -> PathBuf {
        self.root.join(file)
    }

    /// Loads a shipped motion.
    pub(crate) fn motion(&self, robot: &Robot, file: &str) -> Result<Motion, Error> {
        Ok(Motion::load_for(&self.root.join(file), &*robot.rigid_model()?)?)
    }

    /// Reads stored results of another program from `tests/verification/<name>`.
    pub(crate) fn stored(&self, name: &str) -> Result<Stored, Error> {
        Stored::read(&self.root.join("tests/verification").join(name))
    }
}

/// Reads columns of a table.
pub(crate) fn columns<const N: usize>(path: &Path, names: [&str; N]) -> Result<Vec<[f64; N]>, Error> {
    let table = NumberTable::read(path)?;
    let missing = |name: &str| flexarm::Error::File { path: path.to_owned(), what: format!("has no column {name:?}") };
    let mut columns = [0; N];
    for (column, name) in columns.iter_mut().zip(names) {
        *column = table.column(name).ok_or_else(|| missing(name))?;
    }
    Ok(table.rows.iter().map(|row| columns.map(|column| row[column])).collect())
}

/// Results of another program, with their provenance.
#[derive(Clone, Debug)]
pub(crate) struct Stored {
    path: PathBuf,
    value: Value,
}

impl Stored {
    fn read(path: &Path) -> Result<Self, Error> {
        let fail = |what: String| flexarm::Error::File { path: path.to_owned(), what };
        let text = std::fs::read_to_string(path)
            .map_err(|e| fail(format!("stored results cannot be read: {e}; they are in a checkout of the project")))?;
        let value = serde_json::from_str(&text).map_err(|e| fail(format!("is no JSON: {e}")))?;
        Ok(Self { path: path.to_owned(), value })
    }

    /// Returns program, script and date in one line.
    pub(crate) fn provenance(&self) -> String {
        let word = |key: &str| self.value[key].as_str().unwrap_or("?").to_owned();
        format!("{} ({}, {})", word("program"), word("script"), word("date"))
    }

    /// Returns the value at a path of keys and indices, such as `a/0/b`.
    pub(crate) fn at(&self, pointer: &str) -> Result<&Value, Error> {
        self.value.pointer(&format!("/{pointer}")).ok_or_else(|| self.fault(pointer, "is missing"))
    }

    /// Returns a number.
    pub(crate) fn number(&self, pointer: &str) -> Result<f64, Error> {
        self.at(pointer)?.as_f64().ok_or_else(|| self.fault(pointer, "is no number"))
    }

    /// Returns a list of numbers.
    pub(crate) fn numbers(&self, pointer: &str) -> Result<Vec<f64>, Error> {
        let list = self.at(pointer)?.as_array().ok_or_else(|| self.fault(pointer, "is no list"))?;
        let numbers = list.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>();
        numbers.ok_or_else(|| self.fault(pointer, "has something that is no number"))
    }

    /// Returns a six-vector.
    pub(crate) fn vector6(&self, pointer: &str) -> Result<Vector6<f64>, Error> {
        let numbers = self.numbers(pointer)?;
        if numbers.len() == 6 {
            Ok(Vector6::from_column_slice(&numbers))
        } else {
            Err(self.fault(pointer, "is no list of six"))
        }
    }

    /// Returns a 6x6 matrix, stored by rows.
    pub(crate) fn matrix6(&self, pointer: &str) -> Result<Matrix6<f64>, Error> {
        let mut matrix = Matrix6::zeros();
        for row in 0..6 {
            matrix.set_row(row, &self.vector6(&format!("{pointer}/{row}"))?.transpose());
        }
        Ok(matrix)
    }

    fn fault(&self, pointer: &str, what: &str) -> Error {
        let what = format!("{pointer:?} {what}; the script named in it writes the file again");
        flexarm::Error::File { path: self.path.clone(), what }.into()
    }
}

/// Generalised-alpha with the settings of an ordinary run.
pub(crate) const ALPHA: StepperKind =
    StepperKind::GeneralizedAlpha(AlphaSettings { rho: 0.9, dispersion_correction: true });

/// SPOOK with compliant constraints in their exact form.
pub(crate) const fn spook(form: ConstraintForm) -> StepperKind {
    StepperKind::Spook(SpookSettings { form, preset: SpookPreset::Exact })
}

/// The three steppers for lumped links.
pub(crate) const LUMPED: [(&str, StepperKind); 3] = [
    ("compliant constraints, local", spook(ConstraintForm::Local)),
    ("compliant constraints, global", spook(ConstraintForm::Global)),
    ("spring-damper", ALPHA),
];

/// Modelling with lumped links of `n` rigid parts.
pub(crate) fn parts(n: usize) -> Modelling {
    Modelling { links: LinkModel::Lumped, segments: Some(n), ..Modelling::default() }
}

/// Modelling with modal links.
pub(crate) fn modal(modes: usize) -> Modelling {
    Modelling { links: LinkModel::Modal, modes: Some(modes), ..Modelling::default() }
}

/// Lumped links of `n` rigid parts, with their name on the page.
pub(crate) fn in_parts(n: usize) -> (String, Modelling) {
    (format!("{n} parts"), parts(n))
}

/// Modal links, with their name on the page.
pub(crate) fn in_modes(modes: usize) -> (String, Modelling) {
    (format!("modal, {modes} modes"), modal(modes))
}

/// Returns the robot without gravity.
pub(crate) fn weightless(mut robot: Robot) -> Robot {
    robot.rigid.gravity = Vector3::zeros();
    robot
}

/// Returns the robot with its first mode critically damped, so that it comes to rest quickly.
pub(crate) fn damped(mut robot: Robot) -> Robot {
    for link in &mut robot.flexible_links {
        link.damping = Damping::Modal(1.0);
    }
    robot
}

/// An arm with its joints held at zero, and the frame at which it is loaded and observed.
pub(crate) struct Rig {
    /// The arm.
    pub(crate) plant: Plant,
    /// The frame.
    pub(crate) frame: Frame,
    /// Pose of the frame in the undeformed arm.
    pub(crate) X_WF: Pose,
}

impl Rig {
    /// Creates a rig at a named frame of the robot, or at its TCP if `frame` is `None`.
    pub(crate) fn new(robot: &Robot, modelling: &Modelling, frame: Option<&str>) -> Result<Self, Error> {
        let arm = robot.model(modelling)?;
        let joints = vec![0.0; arm.model.n_actuated()];
        let plant = arm.plant(Arc::new(Held(joints))).map_err(step_error)?;
        let name = frame.unwrap_or(TCP_FRAME);
        let known = || Error::Case(format!("there is no frame {name:?}"));
        let frame = plant.model.frame(name).ok_or_else(known)?.clone();
        let X_WF = place(&plant, &frame, &DVector::zeros(plant.model.n_elastic()));
        Ok(Self { plant, frame, X_WF })
    }

    /// Returns the same arm, observed at the point of a body that is at `p_W` (world axes) when
    /// undeformed.
    pub(crate) fn at_point(&self, body: usize, p_W: Vector3<f64>) -> Self {
        let e = DVector::zeros(self.plant.model.n_elastic());
        let body_only = Frame { body, X_BF: Pose::identity(), ..self.frame.clone() };
        let X_WB = place(&self.plant, &body_only, &e);
        let X_WF = Pose::from(nalgebra::Translation3::from(p_W));
        let frame = Frame { X_BF: X_WB.inverse() * X_WF, ..body_only };
        Self { plant: self.plant.clone(), frame, X_WF }
    }

    /// Returns the frequencies (Hz), ascending, of the modes in which the frame moves mainly along
    /// y and mainly along z (world axes). Modes that mainly rotate it or move it along x are left
    /// out.
    pub(crate) fn bending_hz(&self) -> [Vec<f64>; 2] {
        let modes = &self.plant.modes;
        let mut found = [Vec::new(), Vec::new()];
        for (shape, hz) in modes.shapes.column_iter().zip(modes.frequencies_hz()) {
            let step = shape * (1e-6 / shape.amax());
            let at = |e: DVector<f64>| place(&self.plant, &self.frame, &e);
            let moved = tcp_error(&at(&modes.equilibrium - &step), &at(&modes.equilibrium + &step));
            let [x, y, z] = [moved[0].abs(), moved[1].abs(), moved[2].abs()];
            let turned = moved[3..].iter().copied().worst();
            // Skip modes that mainly rotate the frame: translation below 1 mm per rad.
            if y.max(z) > x && y.max(z) > 1e-3 * turned {
                found[usize::from(z > y)].push(hz);
            }
        }
        found
    }

    /// Returns the arm under a wrench at the frame, world axes.
    pub(crate) fn loaded(&self, wrench: &Vector6<f64>) -> Result<Plant, Error> {
        let F = Wrench::new(wrench.fixed_rows::<3>(0).into(), wrench.fixed_rows::<3>(3).into());
        let load = Load { body: self.frame.body, X_BF: self.frame.X_BF, wrench: TimedWrench::new(move |_| F) };
        self.plant.clone().with_timed_loads(vec![load]).map_err(step_error)
    }

    /// Computes the displacement and rotation of the frame in equilibrium under a wrench at the
    /// frame, by Newton's method.
    pub(crate) fn statics(&self, wrench: &Vector6<f64>) -> Result<Vector6<f64>, Error> {
        self.statics_at(wrench, self)
    }

    /// Like [`Rig::statics`], but observes the frame of another rig of the same arm.
    pub(crate) fn statics_at(&self, wrench: &Vector6<f64>, observed: &Self) -> Result<Vector6<f64>, Error> {
        let plant = self.loaded(wrench)?;
        let e = static_equilibrium(&plant, 0.0).map_err(step_error)?;
        Ok(Vector6::from(tcp_error(&observed.X_WF, &place(&plant, &observed.frame, &e))))
    }

    /// Like [`Rig::statics`], but steps in time from the undeformed arm until it is at rest.
    pub(crate) fn settled(&self, wrench: &Vector6<f64>, kind: StepperKind, h: f64) -> Result<Vector6<f64>, Error> {
        const AT_MOST: usize = 100_000;
        const BETWEEN: usize = 50;
        let plant = self.loaded(wrench)?;
        let mut stepper = new_stepper(kind, plant.clone(), h, Start::Undeformed).map_err(step_error)?;
        let mut observed = Observation::new(&plant);
        let (mut before, mut calm) = (Vector6::repeat(f64::INFINITY), 0);
        for step in 1..=AT_MOST {
            stepper.step().map_err(step_error)?;
            if step % BETWEEN != 0 {
                continue;
            }
            stepper.observe(&mut observed);
            let X = observed.X_WB[self.frame.body] * self.frame.X_BF;
            let now = Vector6::from(tcp_error(&self.X_WF, &X));
            // At rest: the pose changes only by rounding.
            calm = if (now - before).amax() < 1e-15 + 1e-12 * now.amax() { calm + 1 } else { 0 };
            before = now;
            if calm == 3 {
                return Ok(before);
            }
        }
        let stepper = kind.name();
        Err(Error::Case(format!("the arm does not come to rest within {AT_MOST} steps of {h} s ({stepper})")))
    }

    /// Returns the displacement of the frame from its undeformed position after the arm is released
    /// there, sampled at the start and every `every` seconds.
    ///
    /// * `h`: step size (s); `every` is a multiple of it.
    pub(crate) fn path(
        &self,
        kind: StepperKind,
        h: f64,
        every: f64,
        duration: f64,
    ) -> Result<Vec<Vector3<f64>>, Error> {
        let mut stepper = new_stepper(kind, self.plant.clone(), h, Start::Undeformed).map_err(step_error)?;
        let mut observed = Observation::new(&self.plant);
        let (stride, steps) = ((every / h).round() as usize, (duration / h).round() as usize);
        let mut path = vec![Vector3::zeros()];
        for step in 1..=steps {
            stepper.step().map_err(step_error)?;
            if step % stride == 0 {
                stepper.observe(&mut observed);
                let X = observed.X_WB[self.frame.body] * self.frame.X_BF;
                path.push(X.translation.vector - self.X_WF.translation.vector);
            }
        }
        Ok(path)
    }

    /// Computes the compliance at the frame from pairs of opposite loads, which cancels
    /// second-order effects.
    ///
    /// `loads`: magnitude of each load; `response`: displacement under a wrench.
    pub(crate) fn compliance(
        &self,
        loads: &Vector6<f64>,
        mut response: impl FnMut(&Self, &Vector6<f64>) -> Result<Vector6<f64>, Error>,
    ) -> Result<Matrix6<f64>, Error> {
        let mut C = Matrix6::zeros();
        for j in 0..6 {
            let mut wrench = Vector6::zeros();
            wrench[j] = loads[j];
            let difference = response(self, &wrench)? - response(self, &-wrench)?;
            C.set_column(j, &(difference / (2.0 * loads[j])));
        }
        Ok(C)
    }
}

/// Ratio of damping to stiffness in [`tool_path`] (s).
pub(crate) const PATH_DAMPING_S: f64 = 5e-4;

/// Computes the TCP positions after each step of generalised-alpha, world axes.
///
/// `stiffening`: whether loads change the stiffness of modal links. Damping is [`PATH_DAMPING_S`]
/// times stiffness in every model.
pub(crate) fn tool_path(
    robot: &Robot,
    modelling: &Modelling,
    stiffening: bool,
    motion: Arc<dyn PrescribedMotion>,
    start: Start,
    (h, steps): (f64, usize),
) -> Result<Vec<Vector3<f64>>, Error> {
    let mut robot = robot.clone();
    for link in &mut robot.flexible_links {
        link.choices.geometric = stiffening;
        link.damping = Damping::StiffnessProportional(PATH_DAMPING_S);
    }
    let plant = robot.model(modelling)?.plant(motion).map_err(step_error)?;
    let frame = plant.model.frame(TCP_FRAME).ok_or_else(|| Error::Case("the robot has no tool".into()))?.clone();
    let mut stepper = new_stepper(ALPHA, plant.clone(), h, start).map_err(step_error)?;
    let mut observed = Observation::new(&plant);
    let mut path = Vec::new();
    for _ in 0..steps {
        stepper.step().map_err(step_error)?;
        stepper.observe(&mut observed);
        path.push((observed.X_WB[frame.body] * frame.X_BF).translation.vector);
    }
    Ok(path)
}

/// Computes the pose of a frame for given elastic coordinates, with the joints at their prescribed
/// start.
pub(crate) fn place(plant: &Plant, frame: &Frame, e: &DVector<f64>) -> Pose {
    let model = &plant.model;
    let (mut data, mut state) = (Data::new(model), State::zeros(model));
    plant.prescribed_state(0.0, &mut state, &mut DVector::zeros(model.nv()));
    state.q.rows_mut(model.n_actuated(), e.len()).copy_from(e);
    forward_kinematics(model, &mut data, &state.q);
    data.X_WF(frame)
}

/// A motion well above rounding and well below geometric nonlinearity (m, rad).
pub(crate) const SMALL_MOTION: f64 = 1e-5;

/// Computes loads that each move a point with compliance `C` by [`SMALL_MOTION`].
pub(crate) fn small_loads(C: &Matrix6<f64>) -> Vector6<f64> {
    Vector6::from_fn(|j, _| SMALL_MOTION / C[(j, j)])
}

/// Maximum error of the response to load `j`, each entry relative to `sqrt(C_ii C_jj)`.
pub(crate) fn column_error(C: &Matrix6<f64>, truth: &Matrix6<f64>, j: usize) -> f64 {
    let scale = |i: usize| (truth[(i, i)] * truth[(j, j)]).sqrt();
    (0..6).map(|i| (C[(i, j)] - truth[(i, j)]).abs() / scale(i)).worst()
}

/// Maximum of [`column_error`] over all loads.
pub(crate) fn compliance_error(C: &Matrix6<f64>, truth: &Matrix6<f64>) -> f64 {
    (0..6).map(|j| column_error(C, truth, j)).worst()
}

/// Relative errors of the translation and of the rotation of a six-vector, each as a vector norm.
pub(crate) fn shift_and_turn_errors(u: &Vector6<f64>, truth: &Vector6<f64>) -> [f64; 2] {
    [0, 3].map(|from| {
        let truth = truth.fixed_rows::<3>(from);
        (u.fixed_rows::<3>(from) - truth).norm() / truth.norm()
    })
}

/// Maximum distance between two paths sampled at the same instants (m).
pub(crate) fn farthest(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).worst()
}

/// Returns the larger of two errors; NaN wins, whereas `f64::max` would drop it.
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Maximum absolute value of a sequence of errors.
pub(crate) trait Worst: Iterator<Item = f64> + Sized {
    /// Returns NaN if one of them is NaN or if there are none: then nothing was compared.
    fn worst(self) -> f64 {
        self.map(f64::abs).reduce(larger).unwrap_or(f64::NAN)
    }
}

impl<I: Iterator<Item = f64>> Worst for I {}

/// Names of the six loads.
pub(crate) const LOADS: [&str; 6] = ["F_x", "F_y", "F_z", "M_x", "M_y", "M_z"];

/// Wraps a step error.
pub(crate) fn step_error(source: StepError) -> Error {
    flexarm::Error::Step { source, partial: false }.into()
}

/// Computes the displacement and rotation of a frame under gravity `g` (m/s², world axes),
/// linearised: the difference of the responses to plus and minus a hundredth of `g`, scaled up.
pub(crate) fn weight_response(
    robot: &Robot,
    modelling: &Modelling,
    frame: Option<&str>,
    g: &Vector3<f64>,
) -> Result<Vector6<f64>, Error> {
    const PART: f64 = 1e-2;
    let under = |factor: f64| -> Result<Vector6<f64>, Error> {
        let mut robot = robot.clone();
        robot.rigid.gravity = factor * g;
        Rig::new(&robot, modelling, frame)?.statics(&Vector6::zeros())
    };
    Ok((under(PART)? - under(-PART)?) / (2.0 * PART))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth by hand: (3, 4, 0) differs from (3, 0, 0) by 4, relative to 3; a rotation of 1.1
    /// differs from 1 by a tenth.
    #[test]
    fn shift_and_turn_are_judged_by_their_own_sizes() {
        let truth = Vector6::new(3.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let [shift, turn] = shift_and_turn_errors(&Vector6::new(3.0, 4.0, 0.0, 0.0, 0.0, 1.1), &truth);
        assert!((shift - 4.0 / 3.0).abs() < 1e-15 && (turn - 0.1).abs() < 1e-15, "{shift} {turn}");
    }

    /// Truth by hand: C = diag(2, 8, ...), an entry (0, 1) of 4 over sqrt(2 * 8) is 1.
    #[test]
    fn an_entry_is_judged_by_the_root_of_its_diagonal_and_loads_by_what_they_move() {
        let truth = Matrix6::from_diagonal(&Vector6::new(2.0, 8.0, 1.0, 1.0, 1.0, 1.0));
        let mut C = truth;
        C[(0, 1)] = 4.0;
        assert!((column_error(&C, &truth, 1) - 1.0).abs() < 1e-15 && column_error(&C, &truth, 0) == 0.0);
        assert!((small_loads(&truth)[1] * truth[(1, 1)] - SMALL_MOTION).abs() < 1e-20);
    }

    #[test]
    fn paths_are_as_far_apart_as_at_their_worst_instant() {
        let at = |x: f64, y: f64| Vector3::new(x, y, 0.0);
        assert_eq!(farthest(&[at(0.0, 0.0), at(3.0, 0.0)], &[at(1.0, 0.0), at(0.0, 4.0)]), 5.0);
        assert!(farthest(&[at(f64::NAN, 0.0)], &[at(0.0, 0.0)]).is_nan() && farthest(&[], &[]).is_nan());
    }

    /// NaN must not be dropped, as `f64::max` does, and an empty comparison must not pass.
    #[test]
    fn the_worst_error_is_what_is_no_number() {
        assert_eq!([1.0, -3.0, 2.0].into_iter().worst(), 3.0);
        assert!([1.0, f64::NAN, 2.0].into_iter().worst().is_nan());
        assert!(std::iter::empty().worst().is_nan());
        assert!(larger(f64::NAN, 1.0).is_nan() && larger(1.0, f64::NAN).is_nan());
        let mut C = Matrix6::identity();
        assert_eq!(compliance_error(&C, &Matrix6::identity()), 0.0);
        C[(2, 3)] = f64::NAN;
        assert!(compliance_error(&C, &Matrix6::identity()).is_nan());
    }
}
