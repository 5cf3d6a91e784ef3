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
const MOST_LOOPS: usize = 400;
/// Maximum fraction of the cut's length in open outlines.
const OPEN: f64 = 0.02;
/// Loops overlap if their total area exceeds that of their hull by this factor.
const OVERLAP: f64 = 1.001;

/// Returns the section of meshes, all in the axes of one link L, with the plane y-z of S.
///
/// Loops within others are ignored. `None` if the plane does not intersect any mesh, or only
/// touches one.
pub fn cross_section(meshes: &[TriangleMesh], X_LS: &Pose) -> Option<CrossSection> {
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
    let hull = convex_hull(points);
    let of_hull = || polygon(&hull).map(|section| CrossSection { is_closed: false, ..section });
    if open > OPEN * whole || loops.len() > MOST_LOOPS {
        return of_hull();
    }
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

/// Joins segments to loops.
fn join(places: &[Vector2<f64>], segments: &[[usize; 2]]) -> Cut {
    let mut at: Vec<Vec<usize>> = vec![Vec::new(); places.len()];
    for (k, segment) in segments.iter().enumerate() {
        segment.iter().for_each(|&node| at[node].push(k));
    }
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

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Translation3};

    use super::*;
    use crate::Geometry;

    fn section_of(meshes: &[TriangleMesh], at: f64, X_LM: &Pose) -> CrossSection {
        // Plane normal to x at that place, in the frame M of the meshes.
        let X_MS = Pose::from_parts(Translation3::new(at, 0.0, 0.0), Rotation3::identity());
        let placed: Vec<_> = meshes.iter().map(|mesh| mesh.clone().transformed(X_LM)).collect();
        cross_section(&placed, &(X_LM * X_MS)).unwrap()
    }

    fn tilted() -> Pose {
        Pose::from_parts(Translation3::new(0.3, -0.2, 0.5), Rotation3::from_euler_angles(0.4, -0.7, 1.1))
    }

    /// Truth: b h, b h³/12. Bounds: mesh positions have seven digits.
    #[test]
    fn the_section_of_a_box_has_the_area_and_the_moments_of_a_rectangle() {
        let (b, h) = (0.24, 0.1);
        let mesh = Geometry::Box { size: Vector3::new(0.8, b, h) }.triangles().unwrap();
        let section = section_of(&[mesh], 0.13, &tilted());
        let errors = [
            section.area / (b * h) - 1.0,
            section.second_moments[(0, 0)] / (h * b.powi(3) / 12.0) - 1.0,
            section.second_moments[(1, 1)] / (b * h.powi(3) / 12.0) - 1.0,
            section.second_moments[(0, 1)] / (b * h.powi(3) / 12.0),
            section.perimeter / (2.0 * (b + h)) - 1.0,
            section.centroid.norm(),
        ];
        assert!(errors.iter().all(|e| e.abs() < 3e-6), "{errors:?}");
        assert!(section.is_closed);
    }

    /// Truth: the outer polygon of 48 corners, closed form n/2 r² sin(2π/n).
    #[test]
    fn a_hole_does_not_count_and_an_open_mesh_counts_as_its_hull() {
        let turn = Pose::from_parts(
            Translation3::identity(),
            Rotation3::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2),
        );
        let along_x = |radius: f64| Geometry::Cylinder { radius, length: 1.0 }.triangles().unwrap().transformed(&turn);
        let area = 24.0 * 0.1f64.powi(2) * (std::f64::consts::TAU / 48.0).sin();
        let hollow = section_of(&[along_x(0.1), along_x(0.08)], 0.2, &tilted());
        assert!((hollow.area / area - 1.0).abs() < 3e-6, "{} {area}", hollow.area);
        assert!(hollow.is_closed);
        let mut open = along_x(0.1);
        // A tenth of the mantle's triangles is missing.
        open.triangles.retain(|t| t.iter().all(|&i| open.positions[i as usize][1] < 0.09));
        let open = section_of(&[open], 0.2, &tilted());
        assert!(!open.is_closed);
        assert!(open.area < area && open.area > 0.9 * area, "{} {area}", open.area);
    }

    /// Truth: Steiner's rule by hand for two squares side by side.
    #[test]
    fn parts_beside_each_other_add_up_and_parts_in_each_other_count_once() {
        let cube = Geometry::Box { size: Vector3::new(1.0, 0.1, 0.1) }.triangles().unwrap();
        let moved =
            |y: f64| cube.clone().transformed(&Pose::from_parts(Translation3::new(0.0, y, 0.0), Rotation3::identity()));
        let apart = section_of(&[moved(-0.2), moved(0.2)], 0.0, &Pose::identity());
        let expected = 2.0 * (0.1f64.powi(4) / 12.0 + 0.01 * 0.04);
        assert!((apart.second_moments[(0, 0)] / expected - 1.0).abs() < 1e-6);
        assert!((apart.area / 0.02 - 1.0).abs() < 1e-6);
        let overlapping = section_of(&[moved(-0.03), moved(0.03)], 0.0, &Pose::identity());
        assert!((overlapping.area / 0.016 - 1.0).abs() < 1e-6, "{}", overlapping.area);
        let beyond = Pose::from_parts(Translation3::new(0.7, 0.0, 0.0), Rotation3::identity());
        assert_eq!(cross_section(std::slice::from_ref(&cube), &beyond), None);
    }
}
