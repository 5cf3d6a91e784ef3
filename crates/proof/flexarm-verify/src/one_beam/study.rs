//! Loads, gravity and frequencies of the bar by every method, compared with closed forms.
//!
//! The bar lies along x, clamped at x = 0; world axes, SI units. [`Stations`] loads sections along
//! it, [`Splits`] moves the joint of two parts, [`Weight`] counts parts and modes. Not here: closed
//! forms (`bar.rs`, `textbook`).

use flexarm::Robot;
use nalgebra::{Matrix6, Vector3, Vector6};

use super::bar::{BALL_KG, bar, bar_with_shear, bending_hz};
use super::{G, nth, without_ball};
use crate::Error;
use crate::bench::{Rig, Worst, compliance_error, in_modes, in_parts, larger, parts, small_loads, weightless};
use crate::compliance::{Method, by_every_method};
use crate::textbook::Stiffness;

/// Step size of the runs until rest (s).
pub(super) const SETTLING_STEP_S: f64 = 2e-3;

/// Six end loads, each method compared with the closed form.
pub(super) struct EndLoads {
    /// Compliance of the end in closed form (m/N, rad/(N m)).
    pub(super) truth: Matrix6<f64>,
    /// The same with shear.
    pub(super) with_shear: Matrix6<f64>,
    pub(super) methods: Vec<Method>,
}

impl EndLoads {
    pub(super) fn new(robot: &Robot) -> Result<Self, Error> {
        let truth = bar().tip_compliance();
        let others = [in_parts(5), in_modes(6)];
        let methods = by_every_method(robot, None, &small_loads(&truth), SETTLING_STEP_S, &others)?;
        Ok(Self { truth, with_shear: bar_with_shear().tip_compliance(), methods })
    }
}

/// Numbers of parts of the links that are loaded at stations.
pub(super) const COUNTS: [usize; 5] = [2, 3, 5, 9, 17];
/// Numbers of parts that are drawn.
const DRAWN_COUNTS: [usize; 3] = [2, 3, 5];
/// Positions of the loads, as fractions of the length.
const FRACTIONS: [f64; 4] = [0.3, 0.5, 0.75, 1.0];
/// Force (N) or moment (N m) at a station; its magnitude is irrelevant as long as deflections are
/// small.
pub(super) const STATION_LOAD: f64 = 0.1;
/// Number of intervals along the bar in the drawn curves.
const PIECES: u32 = 400;

/// A load at a station.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum StationLoad {
    /// Along z.
    Force,
    /// About -y.
    Moment,
}

impl StationLoad {
    fn wrench(self) -> Vector6<f64> {
        match self {
            Self::Force => Vector6::new(0.0, 0.0, STATION_LOAD, 0.0, 0.0, 0.0),
            Self::Moment => Vector6::new(0.0, 0.0, 0.0, 0.0, -STATION_LOAD, 0.0),
        }
    }

    /// Deflection (m) and slope at `x` under the load at `a`, in closed form.
    fn closed(self, bar: &Stiffness, a: f64, x: f64) -> [f64; 2] {
        match self {
            Self::Force => bar.under_force(STATION_LOAD, a, x),
            Self::Moment => bar.under_moment(STATION_LOAD, a, x),
        }
    }
}

/// Deflection (m) and slope at one position under one load.
pub(super) struct Deflection {
    pub(super) closed: [f64; 2],
    /// Relative differences, one pair for each of the [`COUNTS`].
    pub(super) errors: Vec<[f64; 2]>,
}

/// One load at one station.
pub(super) struct Station {
    /// Position, as a fraction of the length.
    pub(super) fraction: f64,
    pub(super) load: StationLoad,
    pub(super) at_load: Deflection,
    pub(super) at_end: Deflection,
}

/// Deflection (m) or slope along the bar under a force.
pub(super) struct Along {
    pub(super) closed: Vec<f64>,
    /// Number of parts, and the curve.
    pub(super) parts: Vec<(usize, Vec<f64>)>,
}

/// Loads at stations along the bar.
pub(super) struct Stations {
    pub(super) stations: Vec<Station>,
    /// Positions at which the curves are sampled (m).
    pub(super) places_m: Vec<f64>,
    /// Deflection and slope under a force at the end, then at half the length.
    pub(super) along: [Along; 4],
}

impl Stations {
    pub(super) fn new(robot: &Robot) -> Result<Self, Error> {
        let (bar, robot) = (bar(), weightless(robot.clone()));
        let chains: Vec<Chain> = COUNTS.iter().map(|&n| Chain::new(&robot, n)).collect::<Result<_, Error>>()?;
        let mut stations = Vec::new();
        for fraction in FRACTIONS {
            for load in [StationLoad::Force, StationLoad::Moment] {
                let a = fraction * bar.l;
                let [at_load, at_end] = [a, bar.l].map(|x| deflection(&bar, &chains, load, a, x));
                stations.push(Station { fraction, load, at_load: at_load?, at_end: at_end? });
            }
        }
        let places_m: Vec<f64> = (0..=PIECES).map(|k| bar.l * f64::from(k) / f64::from(PIECES)).collect();
        let curve = |a: f64, k: usize| along(&bar, &chains, &places_m, a, k);
        let (end, middle) = (bar.l, 0.5 * bar.l);
        let along = [curve(end, 0)?, curve(end, 1)?, curve(middle, 0)?, curve(middle, 1)?];
        Ok(Self { stations, places_m, along })
    }

    /// Maximum error of the end under loads at the end.
    pub(super) fn worst_at_the_end(&self) -> f64 {
        let loaded_there = self.stations.iter().filter(|station| station.fraction == 1.0);
        loaded_there.flat_map(|station| &station.at_end.errors).flatten().map(|e| e.abs()).fold(0.0, larger)
    }
}

fn deflection(bar: &Stiffness, chains: &[Chain], load: StationLoad, a: f64, x: f64) -> Result<Deflection, Error> {
    let closed = load.closed(bar, a, x);
    let errors = chains.iter().map(|chain| {
        // Deflection along z, and slope as a rotation about -y.
        let u = chain.at(a).statics_at(&load.wrench(), &chain.at(x))?;
        Ok([u[2] / closed[0] - 1.0, -u[4] / closed[1] - 1.0])
    });
    Ok(Deflection { closed, errors: errors.collect::<Result<_, Error>>()? })
}

/// Deflection (`k` = 0) or slope (1) along the bar under a force at `a`.
fn along(bar: &Stiffness, chains: &[Chain], places_m: &[f64], a: f64, k: usize) -> Result<Along, Error> {
    let closed = places_m.iter().map(|x| StationLoad::Force.closed(bar, a, *x)[k]).collect();
    let drawn = chains.iter().filter(|chain| DRAWN_COUNTS.contains(&chain.parts));
    let parts = drawn.map(|chain| {
        let loaded = chain.at(a);
        let offsets = places_m.iter().map(|x| {
            let u = loaded.statics_at(&StationLoad::Force.wrench(), &chain.at(*x))?;
            Ok(if k == 0 { u[2] } else { -u[4] })
        });
        Ok((chain.parts, offsets.collect::<Result<_, Error>>()?))
    });
    Ok(Along { closed, parts: parts.collect::<Result<_, Error>>()? })
}

/// The bar as a chain of rigid parts.
struct Chain {
    parts: usize,
    rig: Rig,
    /// Body of each part, with the position at which it begins (m).
    bodies: Vec<(usize, f64)>,
}

impl Chain {
    fn new(robot: &Robot, n: usize) -> Result<Self, Error> {
        let rig = Rig::new(robot, &parts(n), None)?;
        let base = rig.plant.model.frame("beam_1").map_or(0, |frame| frame.body);
        let joints = rig.plant.elements.iter().map(|element| {
            let at = rig.at_point(element.body, Vector3::zeros());
            (element.body, -at.frame.X_BF.translation.vector.x)
        });
        let bodies = std::iter::once((base, 0.0)).chain(joints).collect();
        Ok(Self { parts: n, rig, bodies })
    }

    /// Returns a rig that observes the point of the bar at `x`.
    fn at(&self, x: f64) -> Rig {
        let last = self.bodies.iter().rev().find(|(_, from)| *from <= x + 1e-12);
        self.rig.at_point(last.unwrap_or(&self.bodies[0]).0, Vector3::new(x, 0.0, 0.0))
    }
}

/// Positions of the joint, as fractions of the length.
const SPLITS: [f64; 9] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];

/// Two parts with the joint at one position; relative errors.
pub(super) struct Split {
    pub(super) fraction: f64,
    /// Compliance of the end with the full 6x6 stiffness.
    pub(super) coupled: f64,
    /// Compliance of the end with only the diagonal of the stiffness.
    pub(super) uncoupled: f64,
    /// Sag of the end under the weight of bar and ball.
    pub(super) sag: f64,
    /// First frequency of sideways and of upward bending.
    pub(super) hz: [f64; 2],
}

/// Position of the joint, and the error without the coupling terms.
pub(super) struct Splits(pub(super) Vec<Split>);

impl Splits {
    pub(super) fn new(robot: &Robot) -> Result<Self, Error> {
        let bar = bar();
        let truth = bar.tip_compliance();
        let sag_m = bar.own_weight(G) + BALL_KG * G * truth[(2, 2)];
        let hz = bending_hz(BALL_KG, 1);
        let split = |fraction: &f64| Split::new(robot, *fraction, &truth, sag_m, &hz);
        Ok(Self(SPLITS.iter().map(split).collect::<Result<_, Error>>()?))
    }

    /// Maximum error with the full 6x6 stiffness.
    pub(super) fn worst_coupled(&self) -> f64 {
        self.0.iter().map(|split| split.coupled).fold(0.0, larger)
    }

    /// Maximum error with uncoupled springs.
    pub(super) fn worst_uncoupled(&self) -> f64 {
        self.0.iter().map(|split| split.uncoupled).worst()
    }
}

impl Split {
    fn new(robot: &Robot, fraction: f64, truth: &Matrix6<f64>, sag_m: f64, hz: &[Vec<f64>; 2]) -> Result<Self, Error> {
        let mut robot = robot.clone();
        let link = &mut robot.flexible_links[0];
        if let Some(beam) = &mut link.beam {
            beam.split_fraction = fraction;
            link.flexible.reduced = beam.reduce()?;
        }
        let light = weightless(robot.clone());
        let mut uncoupled = light.clone();
        uncoupled.flexible_links[0].flexible.coupling = false;
        let [C, D] = [&light, &uncoupled]
            .map(|robot| Rig::new(robot, &parts(2), None)?.compliance(&small_loads(truth), Rig::statics));
        let heavy = Rig::new(&robot, &parts(2), None)?;
        let [side, up] = heavy.bending_hz();
        Ok(Self {
            fraction,
            coupled: compliance_error(&C?, truth),
            uncoupled: compliance_error(&D?, truth),
            sag: -heavy.statics(&Vector6::zeros())?[2] / sag_m - 1.0,
            hz: [nth(&side, 0) / hz[0][0] - 1.0, nth(&up, 0) / hz[1][0] - 1.0],
        })
    }
}

/// A link model of the bar without the ball, with relative differences.
pub(super) struct WeightModel {
    pub(super) name: String,
    pub(super) modal: bool,
    pub(super) elastic_coordinates: usize,
    pub(super) sag: f64,
    /// First sideways, first upward, second sideways, second upward bending mode.
    pub(super) hz: [f64; 4],
}

/// Sag under the bar's own weight and frequencies as functions of the number of parts and modes.
pub(super) struct Weight {
    /// Closed form (m).
    pub(super) sag_m: f64,
    /// First two of sideways and of upward bending.
    pub(super) side_hz: Vec<f64>,
    pub(super) up_hz: Vec<f64>,
    pub(super) models: Vec<WeightModel>,
}

/// Numbers of modes of the modal links under gravity.
const MODES: [usize; 4] = [0, 2, 6, 12];
/// Name of modal links without modes.
pub(super) const GUYAN: &str = "modal, no modes (Guyan)";

impl Weight {
    pub(super) fn new(robot: &Robot) -> Result<Self, Error> {
        let bare = without_ball(robot);
        let sag_m = bar().own_weight(G);
        let [side_hz, up_hz] = bending_hz(0.0, 2);
        let lumped = COUNTS.map(|n| (in_parts(n), false));
        let modal = MODES.map(|m| (if m == 0 { (GUYAN.into(), in_modes(0).1) } else { in_modes(m) }, true));
        let models = lumped.into_iter().chain(modal).map(|((name, modelling), modal)| {
            let rig = Rig::new(&bare, &modelling, None)?;
            let [side, up] = rig.bending_hz();
            let hz = [0, 1].map(|k| [nth(&side, k) / side_hz[k] - 1.0, nth(&up, k) / up_hz[k] - 1.0]);
            let sag = -rig.statics(&Vector6::zeros())?[2] / sag_m - 1.0;
            let hz = [hz[0][0], hz[0][1], hz[1][0], hz[1][1]];
            Ok(WeightModel { name, modal, elastic_coordinates: rig.plant.model.n_elastic(), sag, hz })
        });
        let models = models.collect::<Result<_, Error>>()?;
        Ok(Self { sag_m, side_hz, up_hz, models })
    }

    /// Absolute sag error with `n` parts; NaN if there is no such model.
    pub(super) fn sag_error(&self, n: usize) -> f64 {
        self.model(&in_parts(n).0).map_or(f64::NAN, |model| model.sag.abs())
    }

    /// Maximum error of the first `count` frequencies of the named model.
    pub(super) fn worst_hz(&self, name: &str, count: usize) -> f64 {
        self.model(name).map_or(f64::NAN, |model| model.hz[..count].iter().copied().worst())
    }

    /// Maximum sag error of modal links.
    pub(super) fn modal_sag_error(&self) -> f64 {
        self.models.iter().filter(|model| model.modal).map(|model| model.sag.abs()).fold(0.0, larger)
    }

    fn model(&self, name: &str) -> Option<&WeightModel> {
        self.models.iter().find(|model| model.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth by hand: a moment bends the bar with constant curvature, so the slope beyond the load
    /// is M a/EI at every position.
    #[test]
    fn loads_at_stations_are_those_of_the_closed_form() {
        let bar = bar();
        let [_, slope] = StationLoad::Moment.closed(&bar, 0.4, 0.8);
        assert!((slope - 0.1 * 0.4 / bar.EI_y).abs() < 1e-18);
        assert_eq!(StationLoad::Moment.wrench()[4], -0.1);
        assert_eq!(StationLoad::Force.wrench()[2], 0.1);
    }

    #[test]
    fn plain_springs_are_worst_where_they_are() {
        let split = |uncoupled: f64| Split { fraction: 0.5, coupled: uncoupled, uncoupled, sag: 0.0, hz: [0.0; 2] };
        let splits = Splits([0.3, 1e-12, 0.8].map(split).into());
        assert_eq!(splits.worst_uncoupled(), 0.8);
        assert_eq!(splits.worst_coupled(), 0.8);
    }
}
