//! Minimum depth of cut at which a Floquet multiplier leaves the unit circle, at one spindle speed.
//!
//! The depth is searched upwards with elements of half a period of the fastest relevant mode. The
//! limit found is then refined with elements of half the length until it converges.
//!
//! Start at [`limit_of_depth`]. Speeds in rad/s, depths in m. Not here: the map over a period
//! ([`super::period`]), its leading eigenvalue ([`super::leading`]).

use std::f64::consts::{PI, TAU};

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use crate::milling::cutter::Cutter;
use crate::milling::error::ChatterError;
use crate::milling::leading::leading;
use crate::milling::period::Period;
use crate::milling::structure::Structure;

/// Minimum depth of the search over the maximum depth.
const SHALLOWEST: f64 = 1e-3;
/// Factor on the bound by the mean force; the search starts there if that is deeper.
const BOUND: f64 = 0.5;
/// Depth over the maximum depth at which a downward search ends.
const NOTHING: f64 = 1e-9;
/// Relative tolerance of a limit on given elements.
const EXACT: f64 = 1e-7;
/// Maximum number of refinements of the elements.
const MAX_HALVINGS: usize = 6;
/// Minimum product of maximum depth, compliance at resonance and cutting coefficients for a mode to
/// be relevant (at about 1 it chatters by itself).
const MATTERS: f64 = 0.2;
/// Maximum size of a map for computing eigenvalues.
const MAX_UNKNOWNS: usize = 2500;
/// Angle (rad) from the negative real axis within which a multiplier counts as on it.
const ON_AXIS: f64 = 1e-6;

/// Options for the search of a limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitOptions {
    /// Maximum depth of cut (m).
    pub deepest: f64,
    /// Number of depths tried, at equal ratios over three decades.
    pub depths: usize,
    /// Relative change of the limit at which the refinement of the elements ends.
    pub tolerance: f64,
}

impl LimitOptions {
    /// Returns options for limits up to a depth (m), to 0.1 % or better.
    pub fn to(deepest: f64) -> Self {
        Self { deepest, depths: 120, tolerance: 1e-3 }
    }
}

/// Type of bifurcation at a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Complex multipliers: chatter at a frequency independent of the tooth frequency.
    Hopf,
    /// Multiplier -1: period doubling, that is, every second tooth cuts the same.
    Flip,
}

/// Stability limit of the depth of cut.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// Depth (m).
    pub depth: f64,
    /// Type of bifurcation.
    pub kind: Kind,
    /// Frequency of the largest component of the tip's motion (Hz).
    pub chatter_hz: f64,
    /// Angle of the multiplier over the tooth period (Hz), from 0 to half the tooth frequency: the
    /// chatter frequency up to multiples of the tooth frequency.
    pub multiplier_hz: f64,
    /// Relative change of the depth in the last refinement.
    pub change: f64,
    /// Number of states and chips of the finest map.
    pub unknowns: usize,
}

/// Computes the minimum depth at which the cut chatters at a spindle speed (rad/s); `None` if it is
/// stable up to the maximum depth.
///
/// A first unstable range that is narrower than a step of the search (6 %) is found if the largest
/// multiplier has a visible peak there.
///
/// # Errors
/// [`ChatterError::Invalid`] for an invalid cutter, speed or option, or if a
/// tooth period contains too many oscillations.
pub fn limit_of_depth(
    structure: &Structure,
    cutter: &Cutter,
    spindle: f64,
    options: &LimitOptions,
) -> Result<Option<Limit>, ChatterError> {
    // First crossing on coarse elements, then near it on finer ones until it stays.
    check(cutter, spindle, options)?;
    let mut longest = first_length(structure, cutter, spindle, options);
    let mut period = Period::new(structure, cutter, spindle, longest);
    check_size(&period, options.deepest, spindle)?;
    let Some(mut depth) = first_limit(&period, options) else { return Ok(None) };
    let mut change = f64::INFINITY;
    for _ in 0..MAX_HALVINGS {
        longest /= 2.0;
        period = Period::new(structure, cutter, spindle, longest);
        check_size(&period, depth, spindle)?;
        let near = nearby_limit(&period, depth, options).or_else(|| first_limit(&period, options));
        let Some(finer) = near else { return Ok(None) };
        change = (finer - depth).abs() / finer;
        depth = finer;
        if change <= options.tolerance {
            break;
        }
    }
    Ok(Some(described(structure, cutter, spindle, &period, depth, change)))
}

/// Computes all ranges of depth (m) up to the maximum in which the cut chatters. The first limit
/// has the given tolerance; the other ends are those of elements refined once. The last range may
/// end at the maximum depth.
///
/// Cost: that of a limit, plus an eigenvalue problem per further depth of the search. Ranges
/// narrower than a step may be missed.
///
/// # Errors
/// As [`limit_of_depth`].
pub fn unstable_ranges(
    structure: &Structure,
    cutter: &Cutter,
    spindle: f64,
    options: &LimitOptions,
) -> Result<Vec<(f64, f64)>, ChatterError> {
    // The cut chatters from the first limit on.
    let Some(first) = limit_of_depth(structure, cutter, spindle, options)? else { return Ok(Vec::new()) };
    let longest = first_length(structure, cutter, spindle, options) / 2.0;
    let period = Period::new(structure, cutter, spindle, longest);
    check_size(&period, options.deepest, spindle)?;
    let mut ranges = Vec::new();
    let mut start = Some(first.depth);
    let (mut depth, mut size) = (first.depth * (1.0 + 1e-6), f64::NAN);
    // Increase the depth by a constant ratio: a change of sign of the growth is the end of a range.
    while depth < options.deepest {
        let next = (depth * step_ratio(options)).min(options.deepest);
        let next_size = growth(&period, next);
        if (next_size > 0.0) != start.is_some() {
            let low = if size.is_nan() { growth(&period, depth) } else { size };
            let edge = crossing(&period, (depth, low), (next, next_size));
            match start.take() {
                Some(from) => ranges.push((from, edge)),
                None => start = Some(edge),
            }
        }
        (depth, size) = (next, next_size);
    }
    ranges.extend(start.map(|from| (from, options.deepest)));
    Ok(ranges)
}

/// Computes the largest Floquet multiplier over one tooth period at a depth (m). The elements are
/// refined until its magnitude converges to `1e-6`.
///
/// # Errors
/// As [`limit_of_depth`].
pub fn leading_multiplier(
    structure: &Structure,
    cutter: &Cutter,
    spindle: f64,
    depth: f64,
) -> Result<Complex<f64>, ChatterError> {
    let options = LimitOptions::to(depth.max(f64::MIN_POSITIVE));
    check(cutter, spindle, &options)?;
    let mut longest = first_length(structure, cutter, spindle, &options);
    let mut last = f64::INFINITY;
    loop {
        let period = Period::new(structure, cutter, spindle, longest);
        check_size(&period, depth, spindle)?;
        let multiplier = leading(&period.at(depth));
        if (multiplier.norm() - last).abs() < 1e-6 {
            return Ok(multiplier);
        }
        (last, longest) = (multiplier.norm(), longest / 2.0);
    }
}

/// Checks cutter, speed and options.
fn check(cutter: &Cutter, spindle: f64, options: &LimitOptions) -> Result<(), ChatterError> {
    cutter.check()?;
    let positive = |x: f64| x.is_finite() && x > 0.0;
    let rules = [
        ("the spindle speed (rad/s)", spindle, positive(spindle), "above 0"),
        ("the deepest cut (m)", options.deepest, positive(options.deepest), "above 0"),
        ("the number of depths", options.depths as f64, options.depths >= 2, "2 or more"),
        ("the tolerance", options.tolerance, positive(options.tolerance), "above 0"),
    ];
    match rules.into_iter().find(|rule| !rule.2) {
        Some((what, found, _, expected)) => Err(ChatterError::value(what, found, expected)),
        None => Ok(()),
    }
}

/// Refuses maps whose eigenvalues would take too long.
fn check_size(period: &Period, depth: f64, spindle: f64) -> Result<(), ChatterError> {
    let unknowns = period.unknowns(depth);
    if unknowns > MAX_UNKNOWNS {
        return Err(ChatterError::Invalid(format!(
            "at {:.0} rpm a tooth period contains too many oscillations: {unknowns} unknowns, the maximum is \
             {MAX_UNKNOWNS}; use a higher spindle speed, or remove modes with no influence",
            spindle * 60.0 / TAU
        )));
    }
    Ok(())
}

/// Returns the initial element length (s): half a period of the fastest relevant mode, with six
/// nodes, at most a tooth period.
fn first_length(structure: &Structure, cutter: &Cutter, spindle: f64, options: &LimitOptions) -> f64 {
    let stiffness =
        options.deepest * (0..64).map(|k| cutter.push(TAU * f64::from(k) / 64.0).norm()).fold(0.0, f64::max);
    let highest = structure.poles().iter().map(|p| p.peak()).fold(0.0, f64::max);
    let bound = (MATTERS / stiffness).min(0.5 * highest);
    let fastest = structure.poles().iter().filter(|p| p.peak() >= bound).map(|p| p.value.im).fold(0.0, f64::max);
    let tooth = cutter.tooth_period(spindle);
    if fastest > 0.0 { (PI / fastest).min(tooth) } else { tooth }
}

/// Returns the logarithm of the magnitude of the largest multiplier: above 0 beyond the limit.
fn growth(period: &Period, depth: f64) -> f64 {
    leading(&period.at(depth)).norm().ln()
}

/// Returns the ratio of neighbouring depths of the search.
fn step_ratio(options: &LimitOptions) -> f64 {
    (1.0 / SHALLOWEST).powf(1.0 / (options.depths - 1) as f64)
}

/// Finds the first crossing from shallow to deep.
fn first_limit(period: &Period, options: &LimitOptions) -> Option<f64> {
    let ratio = step_ratio(options);
    let bound = BOUND * period.mean_force_bound();
    let skipped = ((bound / (options.deepest * SHALLOWEST)).ln() / ratio.ln()).floor();
    let start = if skipped > 0.0 { (skipped as usize).min(options.depths - 2) } else { 0 };
    let at = |k: usize| options.deepest * SHALLOWEST.powf(1.0 - k as f64 / (options.depths - 1) as f64);
    let mut below = (at(start), 0.0);
    below.1 = growth(period, below.0);
    // Searches downwards if the first depth is unstable already.
    while below.1 > 0.0 {
        let above = below;
        below.0 /= ratio;
        below.1 = growth(period, below.0);
        if below.1 <= 0.0 {
            return Some(crossing(period, below, above));
        }
        if below.0 < NOTHING * options.deepest {
            return Some(below.0);
        }
    }
    let mut before = below;
    for depth in (start + 1..options.depths).map(at) {
        let above = (depth, growth(period, depth));
        if let Some(peak) = hidden_peak(period, before, below, above) {
            return Some(crossing(period, before, peak));
        }
        if above.1 > 0.0 {
            return Some(crossing(period, below, above));
        }
        (before, below) = (below, above);
    }
    None
}

/// Searches for an unstable depth between stable ones if the growth has a peak at the middle of
/// three depths.
fn hidden_peak(period: &Period, a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> Option<(f64, f64)> {
    let drop = (b.1 - a.1).max(b.1 - c.1);
    if !(b.1 > a.1 && b.1 > c.1 && c.1 <= 0.0 && b.1 + 2.0 * drop > 0.0) {
        return None;
    }
    let (mut low, mut top, mut high) = (a.0, b, c.0);
    for k in 0..16 {
        let x = if k % 2 == 0 { 0.62 * top.0 + 0.38 * low } else { 0.62 * top.0 + 0.38 * high };
        let at = (x, growth(period, x));
        if at.1 > 0.0 {
            return Some(at);
        }
        match (at.1 > top.1, x < top.0) {
            (true, true) => (high, top) = (top.0, at),
            (true, false) => (low, top) = (top.0, at),
            (false, true) => low = x,
            (false, false) => high = x,
        }
    }
    None
}

/// Finds the crossing on refined elements, near a known one.
fn nearby_limit(period: &Period, depth: f64, options: &LimitOptions) -> Option<f64> {
    let mut reach = 0.1 * options.tolerance;
    while reach < 0.1 {
        let (low, high) = (depth * (1.0 - reach), depth * (1.0 + reach));
        let (below, above) = ((low, growth(period, low)), (high, growth(period, high)));
        if below.1 <= 0.0 && above.1 > 0.0 {
            return Some(crossing(period, below, above));
        }
        reach *= 4.0;
    }
    None
}

/// Finds the zero of the growth between two depths with opposite signs: regula falsi with the
/// Illinois modification.
fn crossing(period: &Period, mut a: (f64, f64), mut b: (f64, f64)) -> f64 {
    for k in 0..100 {
        if (b.0 - a.0).abs() <= EXACT * b.0.abs() {
            break;
        }
        // Bisects in every fourth step, because the growth has kinks where branches cross.
        let part = if k % 4 == 3 { 0.5 } else { (a.1 / (a.1 - b.1)).clamp(0.01, 0.99) };
        let x = a.0 + part * (b.0 - a.0);
        let at = (x, growth(period, x));
        if at.1.abs() < 1e-13 {
            return x;
        }
        if (at.1 > 0.0) == (b.1 > 0.0) {
            (a.1, b) = (0.5 * a.1, at);
        } else {
            (b.1, a) = (0.5 * b.1, at);
        }
    }
    0.5 * (a.0 + b.0)
}

/// Returns the limit with its kind and frequencies, from the multiplier there.
fn described(structure: &Structure, cutter: &Cutter, spindle: f64, period: &Period, depth: f64, change: f64) -> Limit {
    let map = period.at(depth);
    let multiplier = leading(&map);
    let map = map.matrix();
    let multiplier = if multiplier.im < 0.0 { multiplier.conj() } else { multiplier };
    let tooth = cutter.tooth_period(spindle);
    let angle = multiplier.arg();
    let kind = if PI - angle < ON_AXIS { Kind::Flip } else { Kind::Hopf };
    let chatter = strongest_harmonic(structure, period, &map, multiplier, depth, tooth);
    Limit { depth, kind, chatter_hz: chatter / TAU, multiplier_hz: angle / TAU / tooth, change, unknowns: map.nrows() }
}

/// Returns the frequency `|arg μ / T + 2π k / T|` (rad/s) of the largest harmonic of the tip's
/// motion for the eigenvector of μ.
fn strongest_harmonic(
    structure: &Structure,
    period: &Period,
    map: &DMatrix<f64>,
    multiplier: Complex<f64>,
    depth: f64,
    tooth: f64,
) -> f64 {
    let base = multiplier.arg() / tooth;
    let Some(vector) = eigenvector(map, multiplier) else { return base };
    // Forces at the nodes, without the exponential factor. The vector contains the chips of the
    // last tooth, which grow by μ.
    let nodes = period.cut_nodes(depth);
    let force = |first: usize, pairs: &[(Vector3<f64>, Vector3<f64>)]| {
        pairs.iter().enumerate().fold(Vector3::<Complex<f64>>::zeros(), |sum, (k, (push, _))| {
            sum - push.map(|x| Complex::new(x, 0.0)) * vector[first + k]
        })
    };
    let forces: Vec<_> =
        nodes.iter().map(|n| (n.time, force(n.first, &n.regeneration.pairs) * Complex::new(n.weight, 0.0))).collect();
    let fastest = structure.poles().iter().map(|p| p.value.im).fold(0.0, f64::max);
    let turns = (fastest * tooth / TAU).ceil().min(nodes.len() as f64) as i64 + 1;
    let size = |k: i64| {
        let omega = base + TAU * k as f64 / tooth;
        let harmonic: Vector3<Complex<f64>> = forces.iter().map(|(t, f)| f * Complex::cis(-omega * t)).sum();
        (omega.abs(), (structure.frequency_response(omega) * harmonic).norm())
    };
    let all = (-turns..=turns).map(size);
    all.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(base, |(omega, _)| omega)
}

/// Computes an eigenvector by inverse iteration.
fn eigenvector(map: &DMatrix<f64>, multiplier: Complex<f64>) -> Option<DVector<Complex<f64>>> {
    let n = map.nrows();
    let shift = multiplier * (1.0 + 1e-9);
    let lu = (map.map(|x| Complex::new(x, 0.0)) - DMatrix::identity(n, n) * shift).lu();
    let mut vector = DVector::from_fn(n, |i, _| Complex::new(1.0, (i % 7) as f64 * 0.1));
    for _ in 0..3 {
        vector = lu.solve(&vector)?;
        let size = vector.norm();
        if !size.is_finite() {
            return None;
        }
        vector /= Complex::new(size, 0.0);
    }
    Some(vector)
}
