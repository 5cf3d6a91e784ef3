//! Selection of the inverse kinematics solution of a target.
//!
//! Solutions are in closed form if the arm has one ([`AnalyticArm`]), otherwise found numerically
//! from many starts. The solution nearest to the current joint values is chosen if the target does
//! not specify more.
//!
//! Not here: the solutions along a path (`follow.rs`).

use flexarm_kinematics::{
    AnalyticArm, ControllerAxes, Data, Frame, IkOptions, Model, Selection, Solutions, forward_kinematics,
    inverse_kinematics_from_many_starts, kuka_turn,
};
use flexarm_spatial::Pose;
use nalgebra::DVector;

use crate::arm::ProgramArm;
use crate::program::Configuration;

/// Number of starts of the numerical search.
const STARTS: usize = 64;

/// Reason for the lack of a solution, as a sentence.
pub(crate) struct NoBranch(pub(crate) String);

/// The arm and its workspaces.
pub(crate) struct Branches<'m> {
    model: &'m Model,
    data: Data,
    solutions: Solutions,
    /// Tool poses with their analytic arms, if any.
    arms: Vec<(Pose, Option<AnalyticArm>)>,
}

impl<'m> Branches<'m> {
    pub(crate) fn new(model: &'m Model) -> Self {
        Self { model, data: Data::new(model), solutions: Solutions::default(), arms: Vec::new() }
    }

    /// Pose of a frame at joint values, in the model's world.
    pub(crate) fn pose(&mut self, frame: &Frame, q: &DVector<f64>) -> Pose {
        forward_kinematics(self.model, &mut self.data, q);
        self.data.X_WF(frame)
    }

    /// Returns the joint values of the specified branch; `X_MF`: pose of the frame in the model's
    /// world.
    pub(crate) fn choose(
        &mut self,
        frame: &Frame,
        X_MF: &Pose,
        configuration: &Configuration,
        q: &DVector<f64>,
        program_arm: &ProgramArm<'_>,
    ) -> Result<DVector<f64>, NoBranch> {
        let mut near = q.clone();
        if let Configuration::Near(values) = configuration {
            program_arm.set_axes(values, &mut near);
        }
        // Closed form if the frame has one, else a search. The arm is taken out while `self` is
        // borrowed.
        let slot = self.arm_of(frame);
        match self.arms[slot].1.take() {
            Some(arm) => {
                let chosen = {
                    let counted = program_arm.controller_axes(*arm.joints());
                    self.in_closed_form(&arm, &counted, X_MF, configuration, &near)
                };
                self.arms[slot].1 = Some(arm);
                chosen
            }
            None => self.search(frame, X_MF, configuration, &near),
        }
    }

    fn arm_of(&mut self, frame: &Frame) -> usize {
        let found = self.arms.iter().position(|(X, _)| *X == frame.X_BF);
        found.unwrap_or_else(|| {
            self.arms.push((frame.X_BF, AnalyticArm::new(self.model, frame).ok()));
            self.arms.len() - 1
        })
    }

    /// Chooses among all solutions in closed form.
    fn in_closed_form(
        &mut self,
        arm: &AnalyticArm,
        counted: &ControllerAxes,
        X: &Pose,
        configuration: &Configuration,
        near: &DVector<f64>,
    ) -> Result<DVector<f64>, NoBranch> {
        let joints = arm.joints();
        let six: [f64; 6] = joints.map(|k| near[k]);
        let mut solutions = std::mem::take(&mut self.solutions);
        arm.solve_near(X, &six, &mut solutions);
        let selection = selection(configuration);
        let chosen = arm.choose(&solutions, &selection, counted, &six);
        let answer = chosen.map(|chosen| {
            let mut q = near.clone();
            for (value, &k) in chosen.iter().zip(joints) {
                q[k] = *value;
            }
            q
        });
        let answer = answer.ok_or_else(|| NoBranch(why_none(arm, counted, &solutions, &selection)));
        self.solutions = solutions;
        answer
    }

    /// Searches the nearest solution numerically; it cannot name a branch.
    fn search(
        &mut self,
        frame: &Frame,
        X: &Pose,
        configuration: &Configuration,
        near: &DVector<f64>,
    ) -> Result<DVector<f64>, NoBranch> {
        if selection(configuration) != Selection::Nearest {
            let why = "the target names a branch of the inverse kinematics, and this arm is not of six revolute joints with a \
                       solution in closed form: name joint values in its place";
            return Err(NoBranch(why.to_owned()));
        }
        let options = IkOptions::default();
        let found = inverse_kinematics_from_many_starts(self.model, &mut self.data, frame, X, near, &options, STARTS)
            .map_err(|error| NoBranch(error.to_string()))?;
        let distance = |q: &DVector<f64>| (q - near).norm_squared();
        let nearest = found.into_iter().map(|found| found.q).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.ok_or_else(|| NoBranch("the search found nothing".to_owned()))
    }
}

fn selection(configuration: &Configuration) -> Selection {
    match configuration {
        Configuration::Near(_) => Selection::Nearest,
        Configuration::Selected(selection) => *selection,
    }
}

/// Reason why no solution was chosen: out of reach, beyond the limits, or on another branch.
fn why_none(arm: &AnalyticArm, counted: &ControllerAxes, solutions: &Solutions, selection: &Selection) -> String {
    if solutions.is_empty() {
        return match solutions.miss() {
            Some(miss) => format!(
                "it is out of reach by about {:.1} mm and {:.2} mrad",
                1e3 * miss.position_m,
                1e3 * miss.rotation_rad
            ),
            None => "it is out of reach".to_owned(),
        };
    }
    // Solutions, with whole turns of their joints, within the limits.
    let mut within: Vec<[f64; 6]> = Vec::new();
    for solution in solutions.iter() {
        arm.copies_within_limits(&solution.q, |q| within.push(*q));
    }
    if within.is_empty() {
        let joints = joints_beyond(arm, solutions);
        return format!("all {} solutions pass the limits of joints ({joints})", solutions.len());
    }
    // Branches that these are on, in the words of the controller.
    let said = |q: &[f64; 6]| match selection {
        Selection::Kuka { .. } => {
            let status = arm.kuka_status(q, counted)?;
            Some(format!("S {status}, T {}", kuka_turn(q, counted)))
        }
        Selection::Abb { .. } => {
            let ([a, b, c], cfx) = arm.abb_configuration(q, counted)?;
            Some(format!("[{a}, {b}, {c}, {cfx}]"))
        }
        _ => None,
    };
    let mut others: Vec<String> = within.iter().filter_map(said).collect();
    others.sort_unstable();
    others.dedup();
    match others.is_empty() {
        true => {
            "its branch is not defined for this arm: it has no spherical wrist behind parallel axes 2 and 3".to_owned()
        }
        false => format!(
            "the branch that it names ({}) has no solution within the joint limits; there are {}",
            named(selection),
            others.join("; ")
        ),
    }
}

fn named(selection: &Selection) -> String {
    let text = |bits: Option<u8>| bits.map_or_else(|| "any".to_owned(), |bits| bits.to_string());
    match selection {
        Selection::Kuka { status, turn } => format!("S {}, T {}", text(*status), text(*turn)),
        Selection::Abb { quadrants: [a, b, c], cfx } => format!("[{a}, {b}, {c}, {cfx}]"),
        _ => "in words".to_owned(),
    }
}

/// Joints, counted from 1, whose values exceed the limits in some solution.
fn joints_beyond(arm: &AnalyticArm, solutions: &Solutions) -> String {
    let beyond = |k: usize| {
        let (lower, upper) = arm.limits()[k];
        solutions.iter().any(|s| {
            let turns = [-1.0, 0.0, 1.0].map(|turn| s.q[k] + turn * std::f64::consts::TAU);
            turns.iter().all(|q| *q < lower || *q > upper)
        })
    };
    let joints: Vec<String> = (0..6).filter(|&k| beyond(k)).map(|k| (k + 1).to_string()).collect();
    if joints.is_empty() { "each in another joint".to_owned() } else { format!("of axes {}", joints.join(", ")) }
}
