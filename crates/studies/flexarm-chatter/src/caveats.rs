//! Cutting tools: sizes of diameter, frequency, stiffness and damping that tools have.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use flexarm_run::Caveat;
use flexarm_run::caveat::slip::{self, Factor};
use flexarm_run::caveat::{CaveatKind, kinds};

use crate::CuttingTool;

const DIAMETER: RangeInclusive<f64> = 1e-4..=0.5;
const FREQUENCY: RangeInclusive<f64> = 20.0..=1e5;
const STIFFNESS: RangeInclusive<f64> = 1e4..=1e10;
const DAMPING: RangeInclusive<f64> = 1e-4..=0.3;

const TOO_FAST: &[Factor] = &[(1e-3, "kHz"), (TAU, "rad/s"), (60.0, "1/min")];
const TOO_SOFT: &[Factor] = &[(1e-6, "N/um"), (1e-3, "N/mm")];
const TOO_DAMPED: &[Factor] = &[(100.0, "per cent")];

/// What of a tool is beyond what tools have.
pub fn tool_caveats(tool: &CuttingTool) -> Vec<Caveat> {
    let name = format!("the tool {:?}", tool.name);
    let mut found = Vec::new();
    let mut check = |kind: &CaveatKind, whose: &str, value: f64, usual: &RangeInclusive<f64>, factors: &[Factor]| {
        if !usual.contains(&value) {
            let yardstick = if value < *usual.start() { *usual.start() } else { *usual.end() };
            found.push(kind.found(whose, value, yardstick).likely(slip::slip(value, usual, factors, 1.0)));
        }
    };
    check(&kinds::TOOL_DIAMETER, &name, tool.cutter.diameter, &DIAMETER, slip::LENGTH);
    for (k, mode) in tool.modes.iter().enumerate() {
        let whose = format!("mode {} of {name}", k + 1);
        check(&kinds::TOOL_FREQUENCY, &whose, mode.omega / TAU, &FREQUENCY, TOO_FAST);
        check(&kinds::TOOL_STIFFNESS, &whose, mode.mass * mode.omega * mode.omega, &STIFFNESS, TOO_SOFT);
        check(&kinds::TOOL_DAMPING, &whose, mode.damping_ratio, &DAMPING, TOO_DAMPED);
    }
    found
}
