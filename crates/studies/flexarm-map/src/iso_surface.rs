//! Iso-surfaces of a value on a grid: marching tetrahedra.
//!
//! Start at [`iso_surface`]. Six tetrahedra per cube have no ambiguous case, unlike the cube itself.
//! Not here: the grid (`region.rs`), colours and the recording (`recording.rs`).

use std::collections::HashMap;

use super::region::Grid;

/// Vertices and triangles of a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Vertices (m, world).
    pub places: Vec<[f32; 3]>,
    /// Vertex indices.
    pub triangles: Vec<[u32; 3]>,
}

/// Six tetrahedra of a cube around the diagonal from 0 to 7; corners numbered by bits (x lowest).
/// The faces of neighbouring cubes match.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

/// Returns the surface on which the values of a grid equal a level, in cubes with finite values at
/// all corners. Vertices are shared between triangles.
///
/// * `values`: one per place of the grid, x varying fastest.
///
/// # Panics
/// Panics with another number of values.
pub fn iso_surface(grid: &Grid, values: &[f64], level: f64) -> Surface {
    assert_eq!(values.len(), grid.places(), "an iso-surface needs a value per place of its grid");
    let mut surface = Surface::default();
    let mut known: HashMap<(usize, usize), u32> = HashMap::new();
    let [nx, ny, nz] = grid.count;
    let number = |x: usize, y: usize, z: usize| x + nx * (y + ny * z);
    for z in 0..nz.saturating_sub(1) {
        for y in 0..ny.saturating_sub(1) {
            for x in 0..nx.saturating_sub(1) {
                // Places at the corners of a cube; without a value at one of them there is no surface.
                let corner = |bits: usize| number(x + (bits & 1), y + (bits >> 1 & 1), z + (bits >> 2));
                let cube: [usize; 8] = std::array::from_fn(corner);
                if !cube.iter().all(|&k| values[k].is_finite()) {
                    continue;
                }
                // A cube on one side of the level is not cut.
                let above = cube.iter().filter(|&&k| values[k] > level).count();
                if above == 0 || above == 8 {
                    continue;
                }
                // Neighbours share the vertex on an edge, found by the places at its two ends.
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
