//! G2 and G3: arcs in the three planes, given by centres or radii, full circles and helices.
//!
//! Start at [`Gcode::arc`]. A helix becomes flat arcs through three of its points each, as many as
//! the allowed error asks for; a flat arc is divided where it is nearly a full circle. Lengths are
//! in m, in the work frame B. Not here: lines and rapids (`moves`).

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use flexarm_path::program::{Blend, MoveKind, Speed};
use nalgebra::Vector3;

use super::{Gcode, Motion};
use crate::common::{Result, Span, fail};

/// Plane of an arc; the sense from the first to the second axis is counterclockwise viewed from the
/// third.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Plane {
    XY,
    ZX,
    YZ,
}

impl Plane {
    /// First, second and third axis.
    fn axes(self) -> [usize; 3] {
        match self {
            Self::XY => [0, 1, 2],
            Self::ZX => [2, 0, 1],
            Self::YZ => [1, 2, 0],
        }
    }
}

/// Maximum distance of the arcs that replace a helix from it, m.
const HELIX_ERROR: f64 = 1e-6;

/// Arc of a circle, optionally with a rise along its axis; lengths in m, angles in rad.
#[derive(Debug, Clone, Copy)]
struct Helix {
    plane: Plane,
    /// In the plane.
    centre: [f64; 2],
    radius: f64,
    /// Angle of the start, from the first axis.
    from: f64,
    /// Positive counterclockwise.
    angle: f64,
    /// Coordinate of the start along the third axis, and its change over the arc.
    start: f64,
    rise: f64,
}

impl Helix {
    /// Point at a fraction of the arc, 0 to 1.
    fn at(&self, part: f64) -> Vector3<f64> {
        let [u, v, w] = self.plane.axes();
        let (sin, cos) = (self.from + self.angle * part).sin_cos();
        let mut p = Vector3::zeros();
        p[u] = self.centre[0] + self.radius * cos;
        p[v] = self.centre[1] + self.radius * sin;
        p[w] = self.start + self.rise * part;
        p
    }

    /// Maximum distance between a piece of the helix and the circle through three of its points
    /// (m).
    fn distance_of_piece(&self, from: f64, to: f64) -> f64 {
        let at = |part: f64| self.at(from + (to - from) * part);
        let Some(circle) = crate::common::frames::Circle::through(at(0.0), at(0.5), at(1.0)) else {
            return f64::INFINITY;
        };
        let start = at(0.0) - circle.centre;
        // Distance from the circle: across its plane, and in it.
        let distance = |k: u32| {
            let p = at(f64::from(k) / 16.0) - circle.centre;
            let axis_part = circle.normal().dot(&p);
            let in_plane = (p - circle.normal() * axis_part).norm() - start.norm();
            axis_part.hypot(in_plane)
        };
        (1..16).map(distance).fold(0.0, f64::max)
    }
}

type Values = HashMap<char, (f64, Span)>;

impl Gcode<'_> {
    /// Adds an arc from the current position.
    pub(super) fn arc(
        &mut self,
        motion: Motion,
        goal: [Option<f64>; 3],
        values: &Values,
        speed: Speed,
        span: Span,
    ) -> Result<()> {
        let [Some(x), Some(y), Some(z)] = self.at else {
            return fail(span, "an arc needs a position before it: move to X, Y and Z first");
        };
        let start = Vector3::new(x, y, z);
        let goal = self.settled(goal, span);
        let turns = match values.get(&'P') {
            Some((turns, _)) if *turns >= 1.0 && *turns <= 1000.0 => turns.round(),
            Some((_, at)) => return fail(*at, "P of an arc is its number of turns: 1 or more"),
            None => 1.0,
        };
        let centre = if values.contains_key(&'R') {
            self.centre_of_radius(motion, start, goal, values, span)?
        } else {
            self.centre_of_offsets(start, values, span)?
        };
        let mut helix = self.helix(motion, start, goal, centre, span)?;
        helix.angle += helix.angle.signum() * TAU * (turns - 1.0);
        self.pieces(&helix, goal, speed, span)
    }

    /// Centre in the plane from I, J, K.
    fn centre_of_offsets(&self, start: Vector3<f64>, values: &Values, span: Span) -> Result<[f64; 2]> {
        let [u, v, _] = self.plane.axes();
        let letters = ['I', 'J', 'K'];
        let given = |axis: usize| values.get(&letters[axis]).map(|(value, _)| value * self.unit);
        if given(u).is_none() && given(v).is_none() {
            return fail(span, format!("an arc needs its centre ({} or {}) or its radius (R)", letters[u], letters[v]));
        }
        if self.absolute_centres {
            let (Some(a), Some(b)) = (given(u), given(v)) else {
                return fail(span, "absolute centres (G90.1) need both coordinates of the plane");
            };
            return Ok([a, b]);
        }
        Ok([start[u] + given(u).unwrap_or(0.0), start[v] + given(v).unwrap_or(0.0)])
    }

    /// Centre in the plane from R: the shorter arc, or the longer one for a negative R.
    fn centre_of_radius(
        &self,
        motion: Motion,
        start: Vector3<f64>,
        goal: Vector3<f64>,
        values: &Values,
        span: Span,
    ) -> Result<[f64; 2]> {
        let [u, v, _] = self.plane.axes();
        let (radius, at) = values.get(&'R').copied().unwrap_or((0.0, span));
        let radius = radius * self.unit;
        let (du, dv) = (goal[u] - start[u], goal[v] - start[v]);
        let chord = du.hypot(dv);
        if chord < 1e-9 {
            return fail(at, "an arc with a radius ends where it begins, so its centre is anywhere: write I, J or K");
        }
        let half = chord / 2.0;
        if radius.abs() < half * (1.0 - 1e-3) {
            return fail(
                at,
                format!(
                    "the radius {:.4} mm is less than half of the way of {:.4} mm",
                    radius.abs() * 1e3,
                    chord * 1e3
                ),
            );
        }
        let height = (radius * radius - half * half).max(0.0).sqrt();
        // Left of the chord for a short counterclockwise arc.
        let side = if (motion == Motion::Counterclockwise) == (radius > 0.0) { height } else { -height };
        Ok([start[u] + du / 2.0 - dv / chord * side, start[v] + dv / 2.0 + du / chord * side])
    }

    /// Returns the arc from start to goal about the centre, at the radius of the start; a rise
    /// makes it a helix.
    fn helix(
        &self,
        motion: Motion,
        start: Vector3<f64>,
        goal: Vector3<f64>,
        centre: [f64; 2],
        span: Span,
    ) -> Result<Helix> {
        // In the plane (u, v): start a and end b from the centre, at equal distances.
        let [u, v, w] = self.plane.axes();
        let (a, b) = ([start[u] - centre[0], start[v] - centre[1]], [goal[u] - centre[0], goal[v] - centre[1]]);
        let (radius, end_radius) = (a[0].hypot(a[1]), b[0].hypot(b[1]));
        // Start and end must be equally far from the centre: 0.5 mm, or 0.1 % of the radius.
        if radius < 1e-9 {
            return fail(span, "the arc has its centre where it begins");
        }
        let difference = (radius - end_radius).abs();
        if difference > 5e-4_f64.max(1e-3 * radius) {
            return fail(
                span,
                format!(
                    "the arc begins {:.4} mm and ends {:.4} mm away from its centre: these must be equal; are the centres absolute (G90.1)?",
                    radius * 1e3,
                    end_radius * 1e3
                ),
            );
        }
        // Angle from a to b in the direction of the motion; a whole turn if they are the same.
        let (from, to) = (a[1].atan2(a[0]), b[1].atan2(b[0]));
        let is_whole = (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9;
        let turn = if is_whole { 0.0 } else { (to - from).rem_euclid(TAU) };
        let angle = match motion {
            Motion::Clockwise => turn - TAU,
            _ if turn == 0.0 => TAU,
            _ => turn,
        };
        Ok(Helix { plane: self.plane, centre, radius, from, angle, start: start[w], rise: goal[w] - start[w] })
    }

    /// Adds the moves of an arc: one if it is flat and less than a full circle, otherwise several
    /// without a stop.
    fn pieces(&mut self, helix: &Helix, goal: Vector3<f64>, speed: Speed, span: Span) -> Result<()> {
        // A flat arc may be 315° long: beyond that its start and end are too close together to define
        // the circle. Pieces of a helix begin with 90° and are halved until the error is allowed.
        let mut count = (helix.angle.abs() / if helix.rise == 0.0 { 1.75 * PI } else { PI / 2.0 }).ceil().max(1.0);
        while helix.rise != 0.0 && helix.distance_of_piece(0.0, 1.0 / count) > HELIX_ERROR {
            count *= 2.0;
            if count > 1e6 {
                return fail(span, "this helix cannot be made of arcs within 1e-6 m: is its rise right?");
            }
        }
        let end_blend = self.blend;
        let speed = Speed { duration_s: speed.duration_s.map(|duration| duration / count), ..speed };
        for k in 0..count as u64 {
            let (from, to) = (k as f64 / count, (k + 1) as f64 / count);
            let is_last = k + 1 == count as u64;
            // The last piece ends at the coordinates of the line, since the centre is rounded.
            let end = if is_last { goal } else { helix.at(to) };
            let via = helix.at((from + to) / 2.0) + self.offset;
            let kind = MoveKind::Arc { via, via_rotation: None, angle: None, turns_with_path: false };
            let blend = if is_last { end_blend } else { Blend::Pass };
            self.add(kind, end, speed, blend, span)?;
        }
        Ok(())
    }
}
