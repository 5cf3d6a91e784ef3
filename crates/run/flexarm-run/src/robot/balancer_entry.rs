//! Balancer entries of a robot file: from the text to checked values.
//!
//! An entry names its two ends or one joint, and one force: spring, gas, gas spring, sine or curve.
//! Forces between points are tensions over a length (N, m), over a joint torques on it (N m, rad);
//! the law takes the tension, so the sign changes. Start at [`add_balancers`]. Not here: the robot's
//! balancers ([`crate::robot::balancer`]), the laws themselves (`flexarm_kinematics::BalancerLaw`).

use std::f64::consts::PI;
use std::ops::{Range, RangeInclusive};

use flexarm_files::{Source, TextFileError as RobotFileError};
use flexarm_kinematics::{BalancerCurve, BalancerLaw, GasLaw};
use serde::Deserialize;
use toml::Spanned;

use crate::error::Error;
use crate::robot::Robot;
use crate::robot::balancer::{BalancerEnds, RobotBalancer};

/// Polytropic exponents of gases: from isothermal to beyond the adiabatic exponent of a monatomic
/// gas at high pressure.
const EXPONENT: RangeInclusive<f64> = 1.0..=2.0;

/// A spring, gas spring or counterbalance, between two points or over one joint.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct BalancerEntry {
    /// Name for messages; `balancer_1` and so on by default.
    pub name: Option<Spanned<String>>,
    /// First end.
    pub from: Option<Spanned<EndEntry>>,
    /// Second end.
    pub to: Option<Spanned<EndEntry>>,
    /// Joint over which the balancer acts, instead of two ends.
    pub joint: Option<Spanned<String>>,
    /// Linear spring.
    pub spring: Option<Spanned<SpringEntry>>,
    /// Gas cylinder with piston.
    pub gas: Option<Spanned<GasEntry>>,
    /// Gas spring, by the values of its data sheet.
    pub gas_spring: Option<Spanned<GasSpringEntry>>,
    /// Torque that is a sine of the joint angle.
    pub sine: Option<Spanned<SineEntry>>,
    /// Points of a force curve: (m, N), positive in tension, or (rad, N m) on the joint.
    pub curve: Option<Spanned<Vec<[f64; 2]>>>,
}

/// A point on a link.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EndEntry {
    /// Name of the URDF link.
    pub link: Spanned<String>,
    /// Point in link axes (m).
    #[serde(default)]
    pub xyz: [f64; 3],
}

/// Linear spring.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SpringEntry {
    /// Spring rate (N/m; N m/rad over a joint).
    pub rate: f64,
    /// Length at which the force is the preload (m).
    pub free_length: Option<f64>,
    /// Angle, or position of a prismatic joint, at which the force is the preload (rad or m).
    pub free_angle: Option<f64>,
    /// Tension (N) or joint torque (N m) at that length or angle.
    #[serde(default)]
    pub preload: f64,
}

/// Gas cylinder with piston.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct GasEntry {
    /// `pull` or `push`.
    pub acts: Spanned<String>,
    /// Absolute pressure at `length` (Pa).
    pub pressure: f64,
    /// Volume of the gas at `length` (m³).
    pub volume: f64,
    /// Effective piston area (m²).
    pub area: Option<f64>,
    /// Diameter of the piston, instead of the area (m).
    pub piston_diameter: Option<f64>,
    /// Diameter of the rod on the pressure side (m).
    pub rod_diameter: Option<f64>,
    /// Length to which pressure and volume refer (m).
    pub length: f64,
    /// Polytropic exponent n in `p V^n`.
    #[serde(default = "isothermal")]
    pub exponent: f64,
    /// Pressure on the other side of the piston (Pa).
    #[serde(default)]
    pub ambient_pressure: f64,
}

fn isothermal() -> f64 {
    1.0
}

/// Gas spring, by the values of its data sheet.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct GasSpringEntry {
    /// Force when extended, pushing (N).
    pub force: f64,
    /// Extended length (m).
    pub length: f64,
    /// Stroke (m).
    pub stroke: f64,
    /// Ratio of the force when compressed to the force when extended.
    pub progression: f64,
    /// Polytropic exponent n in `p V^n`.
    #[serde(default = "isothermal")]
    pub exponent: f64,
}

/// Torque `torque sin(q - zero)` on a joint.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SineEntry {
    /// Amplitude (N m).
    pub torque: f64,
    /// Angle of zero torque (rad).
    pub zero: f64,
}

/// Adds the balancers of a file to a robot; collects the errors so that all are found.
pub(crate) fn add_balancers(
    robot: &mut Robot,
    entries: &[Spanned<BalancerEntry>],
    source: &Source,
    faults: &mut Vec<Error>,
) {
    for (number, entry) in entries.iter().enumerate() {
        let place = place_of(entry);
        match balancer(entry.get_ref(), number + 1, &place, source) {
            Err(fault) => faults.push(fault.into()),
            Ok(value) => {
                if let Err(fault) = robot.add_balancer(value) {
                    faults.push(source.error(place, fault.to_string()).into());
                }
            }
        }
    }
}

/// Location for errors about the entry as a whole.
fn place_of(entry: &Spanned<BalancerEntry>) -> Range<usize> {
    let inner = entry.get_ref();
    let joint = inner.joint.as_ref().map(Spanned::span);
    let ends = inner.from.as_ref().or(inner.to.as_ref()).map(Spanned::span);
    joint.or(ends).or(inner.name.as_ref().map(Spanned::span)).unwrap_or(entry.span())
}

fn balancer(
    entry: &BalancerEntry,
    number: usize,
    place: &Range<usize>,
    source: &Source,
) -> Result<RobotBalancer, RobotFileError> {
    // Two points or one joint.
    let name = entry.name.as_ref().map_or_else(|| format!("balancer_{number}"), |name| name.get_ref().clone());
    let fail = |span: Range<usize>, what: String| source.error(span, format!("balancer {name:?}: {what}"));
    let ends = match (&entry.from, &entry.to, &entry.joint) {
        (Some(from), Some(to), None) => {
            let end = |end: &Spanned<EndEntry>| (end.get_ref().link.get_ref().clone(), end.get_ref().xyz);
            BalancerEnds::Points([end(from), end(to)])
        }
        (None, None, Some(joint)) => BalancerEnds::Joint(joint.get_ref().clone()),
        _ => {
            let what = "it acts between two points, from = { link, xyz } and to = { link, xyz }, or over one joint = \"...\": \
                        give one of these";
            return Err(fail(place.clone(), what.into()));
        }
    };
    // Exactly one force law.
    let law = Law { over_joint: matches!(ends, BalancerEnds::Joint(_)), fail: &fail };
    let given = [
        entry.spring.as_ref().map(|spring| law.spring(spring)),
        entry.gas.as_ref().map(|gas| law.gas(gas)),
        entry.gas_spring.as_ref().map(|gas| law.gas_spring(gas)),
        entry.sine.as_ref().map(|sine| law.sine(sine)),
        entry.curve.as_ref().map(|curve| law.curve(curve)),
    ];
    let mut given = given.into_iter().flatten();
    match (given.next(), given.next()) {
        (Some(law), None) => Ok(RobotBalancer { name: name.clone(), ends, law: law? }),
        (None, _) => {
            let what = if law.over_joint { "spring, sine or curve" } else { "spring, gas, gas_spring or curve" };
            Err(fail(place.clone(), format!("its force is missing: give one of {what}")))
        }
        (Some(_), Some(_)) => {
            let what = "spring, gas, gas_spring, sine and curve are several forces: keep one, or write two [[balancer]] entries";
            Err(fail(place.clone(), what.into()))
        }
    }
}

/// Converts entries to force laws.
struct Law<'a, F> {
    over_joint: bool,
    fail: &'a F,
}

impl<F: Fn(Range<usize>, String) -> RobotFileError> Law<'_, F> {
    /// Checks a number against a condition.
    fn number(
        &self,
        at: &Range<usize>,
        key: &str,
        value: f64,
        sound: bool,
        expected: &str,
    ) -> Result<f64, RobotFileError> {
        match value.is_finite() && sound {
            true => Ok(value),
            false => Err((self.fail)(at.clone(), format!("{key} is {value}, expected {expected}"))),
        }
    }

    fn positive(&self, at: &Range<usize>, key: &str, value: f64, unit: &str) -> Result<f64, RobotFileError> {
        self.number(at, key, value, value > 0.0, &format!("a positive number in {unit}"))
    }

    /// Rejects a law that only acts along a line if the balancer acts over a joint.
    fn along_line(&self, at: &Range<usize>, what: &str) -> Result<(), RobotFileError> {
        match self.over_joint {
            true => Err((self.fail)(
                at.clone(),
                format!("{what} acts between two points: give from and to instead of joint"),
            )),
            false => Ok(()),
        }
    }

    fn spring(&self, entry: &Spanned<SpringEntry>) -> Result<BalancerLaw, RobotFileError> {
        let (at, spring) = (entry.span(), entry.get_ref());
        let unit = if self.over_joint { "N m/rad (N/m where the joint slides)" } else { "N/m" };
        let expected = format!("0 or a positive number in {unit}");
        let rate = self.number(&at, "rate", spring.rate, spring.rate >= 0.0, &expected)?;
        let preload = self.number(&at, "preload", spring.preload, true, "a number in N (N m over a joint)")?;
        let (free, sign) = match (spring.free_length, spring.free_angle, self.over_joint) {
            (Some(length), None, false) => {
                (self.number(&at, "free_length", length, length >= 0.0, "0 or a positive length in m")?, 1.0)
            }
            // The preload acts on the joint; the law gives the tension, which has the opposite
            // sign.
            (None, Some(angle), true) => {
                (self.number(&at, "free_angle", angle, true, "an angle in rad (m where the joint slides)")?, -1.0)
            }
            (.., false) => {
                let what = "a spring between two points needs free_length, the length in m at which it has its preload";
                return Err((self.fail)(at, what.into()));
            }
            (.., true) => {
                let what = "a spring over a joint needs free_angle, the joint value in rad at which it has its preload";
                return Err((self.fail)(at, what.into()));
            }
        };
        Ok(BalancerLaw::Linear { rate, free, preload: sign * preload })
    }

    fn gas(&self, entry: &Spanned<GasEntry>) -> Result<BalancerLaw, RobotFileError> {
        let (at, gas) = (entry.span(), entry.get_ref());
        self.along_line(&at, "gas")?;
        let pulls = match gas.acts.get_ref().as_str() {
            "pull" => true,
            "push" => false,
            other => {
                let what = format!("acts is {other:?}, expected \"pull\" (draws its ends together) or \"push\"");
                return Err((self.fail)(gas.acts.span(), what));
            }
        };
        // State of the gas at the given length.
        let pressure = self.positive(&at, "pressure", gas.pressure, "Pa")?;
        let volume = self.positive(&at, "volume", gas.volume, "m³")?;
        let length = self.positive(&at, "length", gas.length, "m")?;
        let exponent = self.exponent(&at, gas.exponent)?;
        let ambient = gas.ambient_pressure;
        let expected = "0 or a positive number in Pa, below the pressure";
        self.number(&at, "ambient_pressure", ambient, (0.0..pressure).contains(&ambient), expected)?;
        // Area on which the pressure acts: given, or a piston less its rod.
        let area = match (gas.area, gas.piston_diameter, gas.rod_diameter) {
            (Some(area), None, None) => self.positive(&at, "area", area, "m²")?,
            (None, Some(piston), rod) => {
                let rod = rod.unwrap_or(0.0);
                self.positive(&at, "piston_diameter", piston, "m")?;
                let expected = "0 or a positive number in m, below the diameter of the piston";
                self.number(&at, "rod_diameter", rod, (0.0..piston).contains(&rod), expected)?;
                PI / 4.0 * (piston * piston - rod * rod)
            }
            _ => {
                let what = "gas needs area (m²), or piston_diameter and rod_diameter (m) instead";
                return Err((self.fail)(at, what.into()));
            }
        };
        // F = A p (V0/V)^n with V = V0 ± A (l - l0): relative to the state at l0 only A/V0 counts.
        Ok(BalancerLaw::Gas(GasLaw {
            force: pressure * area,
            opposing: ambient * area,
            at: length,
            slope: area / volume,
            exponent,
            pulls,
        }))
    }

    fn exponent(&self, at: &Range<usize>, exponent: f64) -> Result<f64, RobotFileError> {
        let expected = format!(
            "{} to {}: 1 where the gas keeps its temperature, 1.4 for nitrogen without time to cool",
            EXPONENT.start(),
            EXPONENT.end()
        );
        self.number(at, "exponent", exponent, EXPONENT.contains(&exponent), &expected)
    }

    /// Converts data-sheet values using `progression = (1 - slope stroke)^-n`.
    fn gas_spring(&self, entry: &Spanned<GasSpringEntry>) -> Result<BalancerLaw, RobotFileError> {
        let (at, gas) = (entry.span(), entry.get_ref());
        self.along_line(&at, "gas_spring")?;
        let force = self.positive(&at, "force", gas.force, "N")?;
        let length = self.positive(&at, "length", gas.length, "m")?;
        let expected = "a positive number in m, below the extended length";
        let stroke = self.number(&at, "stroke", gas.stroke, gas.stroke > 0.0 && gas.stroke < length, expected)?;
        let exponent = self.exponent(&at, gas.exponent)?;
        let expected = "1 or more: force pressed together over force extended";
        let progression = self.number(&at, "progression", gas.progression, gas.progression >= 1.0, expected)?;
        let slope = (1.0 - progression.powf(-1.0 / exponent)) / stroke;
        Ok(BalancerLaw::Gas(GasLaw { force, opposing: 0.0, at: length, slope, exponent, pulls: false }))
    }

    fn sine(&self, entry: &Spanned<SineEntry>) -> Result<BalancerLaw, RobotFileError> {
        let (at, sine) = (entry.span(), entry.get_ref());
        if !self.over_joint {
            let what = "sine acts over a joint: give joint = \"...\" instead of from and to";
            return Err((self.fail)(at, what.into()));
        }
        let amplitude = self.number(&at, "torque", sine.torque, true, "a number in N m")?;
        let zero = self.number(&at, "zero", sine.zero, true, "an angle in rad")?;
        Ok(BalancerLaw::Sine { amplitude, zero })
    }

    fn curve(&self, entry: &Spanned<Vec<[f64; 2]>>) -> Result<BalancerLaw, RobotFileError> {
        let sign = if self.over_joint { -1.0 } else { 1.0 };
        let points: Vec<[f64; 2]> = entry.get_ref().iter().map(|[x, force]| [*x, sign * force]).collect();
        if let Some([x, _]) = points.iter().find(|[x, _]| !self.over_joint && *x < 0.0) {
            let what = format!("its curve begins at a length of {x} m, expected [[length in m, pull in N], ...]");
            return Err((self.fail)(entry.span(), what));
        }
        let curve = BalancerCurve::new(&points).map_err(|e| (self.fail)(entry.span(), e.to_string()))?;
        Ok(BalancerLaw::Curve(curve))
    }
}
