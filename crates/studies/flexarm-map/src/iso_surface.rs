//! Iso-surfaces of a value on a grid: marching tetrahedra.

use std::collections::HashMap;

use super::region::Grid;

/// Vertices and triangles of a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Surface {
    /// Vertices (m, world).
    pub(super) places: Vec<[f32; 3]>,
    /// Vertex indices.
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Six tetrahedra of a cube around the diagonal from 0 to 7; corners numbered by bits (x lowest).
/// The faces of neighbouring cubes match.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

/// Returns the surface on which the values of a grid equal a level, in cubes with finite values at
/// all corners.
pub(super) fn iso_surface(grid: &Grid, values: &[f64], level: f64) -> Surface {
    let mut surface = Surface::default();
    let mut known: HashMap<(usize, usize), u32> = HashMap::new();
    let [nx, ny, nz] = grid.count;
    let number = |x: usize, y: usize, z: usize| x + nx * (y + ny * z);
    for z in 0..nz.saturating_sub(1) {
        for y in 0..ny.saturating_sub(1) {
            for x in 0..nx.saturating_sub(1) {
                let corner = |bits: usize| number(x + (bits & 1), y + (bits >> 1 & 1), z + (bits >> 2));
                let cube: [usize; 8] = std::array::from_fn(corner);
                if !cube.iter().all(|&k| values[k].is_finite()) {
                    continue;
                }
                let above = cube.iter().filter(|&&k| values[k] > level).count();
                if above == 0 || above == 8 {
                    continue;
                }
                for tetrahedron in TETRAHEDRA {
                    cut(tetrahedron.map(|bits| cube[bits]), values, level, &mut |a, b| {
                        let key = (a.min(b), a.max(b));
                        *known.entry(key).or_insert_with(|| {
                            surface.places.push(crossing(grid, values, level, key));
                            surface.places.len() as u32 - 1
                        })
                    })
                    .into_iter()
                    .for_each(|triangle| surface.triangles.push(triangle));
                }
            }
        }
    }
    surface
}

/// Returns the triangles of a cut tetrahedron; `edge` returns the vertex on an edge.
fn cut(corners: [usize; 4], values: &[f64], level: f64, edge: &mut dyn FnMut(usize, usize) -> u32) -> Vec<[u32; 3]> {
    let (above, below): (Vec<usize>, Vec<usize>) = corners.iter().partition(|&&k| values[k] > level);
    match (above.as_slice(), below.as_slice()) {
        (&[a], &[b, c, d]) | (&[b, c, d], &[a]) => vec![[edge(a, b), edge(a, c), edge(a, d)]],
        (&[a, b], &[c, d]) => {
            let [ac, ad, bc, bd] = [edge(a, c), edge(a, d), edge(b, c), edge(b, d)];
            vec![[ac, ad, bd], [ac, bd, bc]]
        }
        _ => Vec::new(),
    }
}

/// Returns the point on an edge at which the linearly interpolated value equals the level.
fn crossing(grid: &Grid, values: &[f64], level: f64, (a, b): (usize, usize)) -> [f32; 3] {
    let (p, q) = (grid.place(a), grid.place(b));
    let share = (level - values[a]) / (values[b] - values[a]);
    [0, 1, 2].map(|c| (p[c] + share * (q[c] - p[c])) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: a sphere of radius r has the area 4 π r²; each edge of a closed surface belongs to
    /// two triangles, and vertices minus edges plus triangles are two (Euler).
    #[test]
    fn the_surface_of_equal_distance_is_a_closed_sphere_of_the_right_area() {
        let grid = Grid { lower: [-1.0; 3], spacing_m: 0.05, count: [41; 3] };
        let radius = |k: usize| grid.place(k).iter().map(|x| x * x).sum::<f64>().sqrt();
        let values: Vec<f64> = (0..grid.places()).map(radius).collect();
        let surface = iso_surface(&grid, &values, 0.8003);
        let p = |k: u32| nalgebra::Vector3::from(surface.places[k as usize].map(f64::from));
        let area: f64 =
            surface.triangles.iter().map(|&[a, b, c]| 0.5 * (p(b) - p(a)).cross(&(p(c) - p(a))).norm()).sum();
        let whole = 4.0 * std::f64::consts::PI * 0.8003_f64.powi(2);
        assert!((area / whole - 1.0).abs() < 2e-3, "{}", area / whole);
        let mut edges: HashMap<(u32, u32), usize> = HashMap::new();
        for [a, b, c] in &surface.triangles {
            for (i, j) in [(a, b), (b, c), (c, a)] {
                *edges.entry((*i.min(j), *i.max(j))).or_default() += 1;
            }
        }
        assert!(edges.values().all(|n| *n == 2));
        assert_eq!(surface.places.len() + surface.triangles.len() - edges.len(), 2);
    }

    #[test]
    fn places_that_are_not_reached_have_no_surface() {
        let grid = Grid { lower: [0.0; 3], spacing_m: 1.0, count: [2; 3] };
        let mut values = vec![0.0; 8];
        values[7] = 1.0;
        assert_eq!(iso_surface(&grid, &values, 0.5).triangles.len(), 6);
        values[0] = f64::NAN;
        assert!(iso_surface(&grid, &values, 0.5).triangles.is_empty());
    }
}
