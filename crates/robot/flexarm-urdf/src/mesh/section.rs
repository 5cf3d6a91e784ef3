//! Cross sections of triangle meshes: the outline in a plane, its area and second moments.
//!
//! Only the outside counts: of nested loops the outermost, so that a hollow body and its outer hull
//! have the same section. Where a mesh is not closed, the convex hull of its cut is used.
//!
//! Notation: S is the frame of the section, x the normal of its plane, y and z in the plane.

use std::collections::HashMap;

use flexarm_kinematics::Pose;
use nalgebra::{Matrix2, Point3, Vector2, Vector3};

use super::TriangleMesh;

/// Outline of a mesh in a plane; lengths in m, axes y and z of the section's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossSection {
    /// Area within the outline (m²).
    pub area: f64,
    /// Centroid (m).
    pub centroid: Vector2<f64>,
    /// `∫ (r - c)(r - c)ᵀ dA` (m⁴): entry (0, 0) is `∫ y² dA`, relevant for bending about z.
    pub second_moments: Matrix2<f64>,
    /// Length of the outline (m).
    pub perimeter: f64,
    /// Whether the mesh was closed there; otherwise the values are those of the convex hull of the
    /// cut.
    pub is_closed: bool,
}

/// Maximum number of loops; outlines with more, such as screens and threads, are replaced by their
/// convex hull.
const MAX_LOOPS: usize = 400;
/// Maximum fraction of the cut's length in open outlines.
const OPEN: f64 = 0.02;
/// Loops overlap if their total area exceeds that of their hull by this factor.
const OVERLAP: f64 = 1.001;

/// Returns the section of meshes with the plane y-z of S.
///
/// * `meshes`: surfaces in the axes of one link L, in m.
/// * `X_LS`: pose of S in L, with the translation in m.
///
/// Loops within others are ignored. Loops that overlap, and open ones, give their convex hull.
/// `None` if the plane does not intersect any mesh, or only touches one.
pub fn cross_section(meshes: &[TriangleMesh], X_LS: &Pose) -> Option<CrossSection> {
    // Outlines of all meshes in the plane.
    let X_SL = X_LS.inverse();
    let (mut loops, mut points) = (Vec::new(), Vec::new());
    let (mut open, mut whole) = (0.0, 0.0);
    for mesh in meshes {
        let cut = cut(mesh, &X_SL);
        whole += cut.length;
        open += cut.open_length;
        points.extend(cut.loops.iter().flatten().chain(cut.open.iter()).copied());
        loops.extend(cut.loops);
    }
    if whole == 0.0 {
        return None;
    }
    // The hull replaces outlines whose inside is not known.
    let hull = convex_hull(points);
    let of_hull = || polygon(&hull).map(|section| CrossSection { is_closed: false, ..section });
    if open > OPEN * whole || loops.len() > MAX_LOOPS {
        return of_hull();
    }
    // Loops that are not nested are parts of one section.
    let outer = outermost(&loops);
    let sum = outer.iter().filter_map(|points| polygon(points)).reduce(joined)?;
    let largest = polygon(&hull)?;
    if sum.area > OVERLAP * largest.area { of_hull() } else { Some(sum) }
}

/// Intersection of a mesh and a plane.
struct Cut {
    /// Closed outlines.
    loops: Vec<Vec<Vector2<f64>>>,
    /// Points of outlines that are not closed.
    open: Vec<Vector2<f64>>,
    /// Total length of all outlines, and of the open ones (m).
    length: f64,
    open_length: f64,
}

/// Intersects all triangles with the plane x = 0 of S, and joins the segments at shared edges.
///
/// A vertex on the plane counts as in front of it, so every edge is either crossed or not,
/// identically for both its triangles.
fn cut(mesh: &TriangleMesh, X_SL: &Pose) -> Cut {
    let points: Vec<Vector3<f64>> =
        mesh.positions.iter().map(|p| (X_SL * Point3::from(p.map(f64::from))).coords).collect();
    let welded = mesh.welded();
    let mut nodes: HashMap<(u32, u32), usize> = HashMap::new();
    let mut places: Vec<Vector2<f64>> = Vec::new();
    let mut segments: Vec<[usize; 2]> = Vec::new();
    for triangle in &mesh.triangles {
        let mut ends = [0usize; 3];
        let mut found = 0;
        for side in 0..3 {
            let (i, j) = (triangle[side] as usize, triangle[(side + 1) % 3] as usize);
            let (Some(a), Some(b)) = (points.get(i), points.get(j)) else { continue };
            if (a.x >= 0.0) == (b.x >= 0.0) {
                continue;
            }
            let (m, n) = (welded[i], welded[j]);
            ends[found] = *nodes.entry((m.min(n), m.max(n))).or_insert_with(|| {
                let s = a.x / (a.x - b.x);
                places.push(Vector2::new(a.y + s * (b.y - a.y), a.z + s * (b.z - a.z)));
                places.len() - 1
            });
            found += 1;
        }
        // Triangles that are thin after welding may have the same edge twice.
        if found == 2 && ends[0] != ends[1] {
            segments.push([ends[0], ends[1]]);
        }
    }
    join(&places, &segments)
}

/// Joins segments to loops; each has the indices of its two ends in `places`.
fn join(places: &[Vector2<f64>], segments: &[[usize; 2]]) -> Cut {
    // Segments at each node.
    let mut at: Vec<Vec<usize>> = vec![Vec::new(); places.len()];
    for (k, segment) in segments.iter().enumerate() {
        segment.iter().for_each(|&node| at[node].push(k));
    }
    // Follows unused segments from each first one until it returns to its start or ends.
    let mut used = vec![false; segments.len()];
    let mut cut = Cut { loops: Vec::new(), open: Vec::new(), length: 0.0, open_length: 0.0 };
    for first in 0..segments.len() {
        if used[first] {
            continue;
        }
        used[first] = true;
        let [start, mut node] = segments[first];
        let mut chain = vec![places[start]];
        let mut length = (places[node] - places[start]).norm();
        while node != start {
            chain.push(places[node]);
            let Some(&next) = at[node].iter().find(|&&k| !used[k]) else { break };
            used[next] = true;
            let [a, b] = segments[next];
            let other = if a == node { b } else { a };
            length += (places[other] - places[node]).norm();
            node = other;
        }
        cut.length += length;
        if node == start {
            cut.loops.push(chain);
        } else {
            cut.open_length += length;
            cut.open.extend(chain);
        }
    }
    cut
}

/// Loops that are not within another one.
fn outermost(loops: &[Vec<Vector2<f64>>]) -> Vec<&Vec<Vector2<f64>>> {
    let areas: Vec<f64> = loops.iter().map(|points| doubled_area(points).abs()).collect();
    let within = |inner: usize, outer: usize| {
        areas[outer] > areas[inner] && loops[inner].first().is_some_and(|point| contains(&loops[outer], point))
    };
    let is_outer = |k: &usize| areas[*k] > 0.0 && (0..loops.len()).all(|other| other == *k || !within(*k, other));
    (0..loops.len()).filter(is_outer).map(|k| &loops[k]).collect()
}

/// Twice the area, positive if the points are counter-clockwise.
fn doubled_area(points: &[Vector2<f64>]) -> f64 {
    sides(points).map(|(a, b)| a.perp(&b)).sum()
}

fn sides(points: &[Vector2<f64>]) -> impl Iterator<Item = (Vector2<f64>, Vector2<f64>)> + '_ {
    points.iter().zip(points.iter().cycle().skip(1)).map(|(a, b)| (*a, *b))
}

/// Whether a ray from the point crosses the outline an odd number of times.
fn contains(points: &[Vector2<f64>], p: &Vector2<f64>) -> bool {
    let passes = |(a, b): &(Vector2<f64>, Vector2<f64>)| {
        (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
    };
    sides(points).filter(passes).count() % 2 == 1
}

/// Area, centroid and second moments of a polygon, by the divergence theorem over its sides (a, b),
/// with d = a × b:
///
/// ```text
/// A = Σ d/2,   A c = Σ d/6 (a + b),   ∫ r rᵀ = Σ d/24 (aaᵀ + bbᵀ + (a + b)(a + b)ᵀ)
/// ```
/// `None` if the area is zero.
fn polygon(points: &[Vector2<f64>]) -> Option<CrossSection> {
    let reference = points.first().copied()?;
    let (mut area, mut first, mut second, mut perimeter) = (0.0, Vector2::zeros(), Matrix2::zeros(), 0.0);
    for (a, b) in sides(points) {
        let (a, b) = (a - reference, b - reference);
        let d = a.perp(&b);
        let sum = a + b;
        area += d / 2.0;
        first += sum * (d / 6.0);
        second += (a * a.transpose() + b * b.transpose() + sum * sum.transpose()) * (d / 24.0);
        perimeter += (b - a).norm();
    }
    if area < 0.0 {
        (area, first, second) = (-area, -first, -second);
    }
    if !(area.is_normal() && area > 1e-9 * perimeter * perimeter) {
        return None;
    }
    let c = first / area;
    let second_moments = second - c * c.transpose() * area;
    Some(CrossSection { area, centroid: c + reference, second_moments, perimeter, is_closed: true })
}

/// Combines two adjacent outlines to one section.
fn joined(a: CrossSection, b: CrossSection) -> CrossSection {
    let area = a.area + b.area;
    let centroid = (a.centroid * a.area + b.centroid * b.area) / area;
    let about = |s: &CrossSection| {
        let lever = s.centroid - centroid;
        s.second_moments + lever * lever.transpose() * s.area
    };
    let second_moments = about(&a) + about(&b);
    CrossSection { area, centroid, second_moments, perimeter: a.perimeter + b.perimeter, is_closed: true }
}

/// The convex hull, counter-clockwise (Andrew's monotone chain).
fn convex_hull(mut points: Vec<Vector2<f64>>) -> Vec<Vector2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = Vector2<f64>>| {
        let mut chain: Vec<Vector2<f64>> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp(&(point - b)) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}
