//! Triangles without finite elements: prisms, smooth normals on curved faces, lines at edges.
//!
//! Positions in m, normals of unit length, both in the axes of the caller. Not here: the skin of a
//! mesh ([`super::surface`]), drawing ([`super::scene`]).

use nalgebra::Vector3;

/// Angle below which adjacent faces are drawn as one smooth surface, degrees.
const SMOOTH_DEG: f64 = 32.0;

/// Positions of corners, and triangles of their numbers with outward normals.
type Triangles = (Vec<Vector3<f64>>, Vec<[u32; 3]>);

/// Corners and triangles of a prism around the line between two points, first the corners around
/// `from`, then those around `to`; `None` if the points are closer than `least` (m).
pub fn prism([from, to]: [&Vector3<f64>; 2], radius: f64, sides: u32, least: f64) -> Option<Triangles> {
    let along = (to - from).try_normalize(least)?;
    let y = along.cross(&Vector3::ith(along.iamin(), 1.0)).normalize();
    let z = along.cross(&y);
    let corner = |end: &Vector3<f64>, k: u32| {
        let (sin, cos) = (f64::from(k) / f64::from(sides) * std::f64::consts::TAU).sin_cos();
        end + (y * cos + z * sin) * radius
    };
    let positions = [from, to].into_iter().flat_map(|end| (0..sides).map(move |k| corner(end, k))).collect();
    let walls = (0..sides).flat_map(|k| {
        let next = (k + 1) % sides;
        [[k, next, sides + next], [k, sides + next, sides + k]]
    });
    let caps = (2..sides).flat_map(|k| [[0, k, k - 1], [sides, sides + k - 1, sides + k]]);
    Some((positions, walls.chain(caps).collect()))
}

/// Unit outward normal and area of each triangle; zero normal for a triangle without area.
pub(super) fn triangle_normals(positions: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Vec<(Vector3<f64>, f64)> {
    let normal = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        let n = (b - a).cross(&(c - a));
        let length = n.norm();
        if length > 0.0 { (n / length, length / 2.0) } else { (Vector3::zeros(), 0.0) }
    };
    triangles.iter().map(normal).collect()
}

/// Normals at the corners of triangles: mean over the surrounding triangles of the same smooth
/// surface.
pub(super) fn corner_normals(positions: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Vec<[Vector3<f64>; 3]> {
    // Triangles around each vertex: lists in one array, with their starts.
    let normals = triangle_normals(positions, triangles);
    let mut starts = vec![0_u32; positions.len() + 1];
    for vertex in triangles.as_flattened() {
        starts[*vertex as usize + 1] += 1;
    }
    for k in 1..starts.len() {
        starts[k] += starts[k - 1];
    }
    let mut next = starts.clone();
    let mut around = vec![0_u32; 3 * triangles.len()];
    for (number, triangle) in (0..).zip(triangles) {
        for vertex in triangle {
            let slot = &mut next[*vertex as usize];
            around[*slot as usize] = number;
            *slot += 1;
        }
    }
    // Mean of those that are part of the same smooth surface, weighted by area.
    let same_wall = SMOOTH_DEG.to_radians().cos();
    let corner = |vertex: u32, own: Vector3<f64>| {
        let range = starts[vertex as usize] as usize..starts[vertex as usize + 1] as usize;
        let near = around[range].iter().map(|t| normals[*t as usize]).filter(|(n, _)| n.dot(&own) > same_wall);
        let sum: Vector3<f64> = near.map(|(n, area)| n * area).sum();
        sum.try_normalize(0.0).unwrap_or(own)
    };
    triangles.iter().zip(&normals).map(|(t, (own, _))| t.map(|vertex| corner(vertex, *own))).collect()
}

/// Edges at which two triangles meet at more than 30 degrees, or where a surface ends.
pub(super) fn feature_edges(positions: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let normals = triangle_normals(positions, triangles);
    let mut sides: Vec<([u32; 2], u32)> = (0..)
        .zip(triangles)
        .flat_map(|(number, [a, b, c])| [[*a, *b], [*b, *c], [*c, *a]].map(|[p, q]| ([p.min(q), p.max(q)], number)))
        .collect();
    sides.sort_unstable();
    let flat = 30_f64.to_radians().cos();
    let is_edge = |side: &&[([u32; 2], u32)]| match side {
        [(_, a), (_, b)] => normals[*a as usize].0.dot(&normals[*b as usize].0) < flat,
        _ => true,
    };
    sides.chunk_by(|a, b| a.0 == b.0).filter(is_edge).map(|side| side[0].0).collect()
}
