//! Shape functions of the six solids and their derivatives in reference coordinates.
//!
//! Tetrahedra: `r, s, t >= 0`, `r + s + t <= 1`. Bricks: `[-1, 1]³`. Wedges: triangle in `r, s`
//! times `t` in `[-1, 1]`.

use crate::mesh::ElementKind;

/// Maximum number of nodes of an element.
pub(crate) const MAX_NODES: usize = 20;

const TET: [[f64; 3]; 10] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.5, 0.0, 0.0],
    [0.5, 0.5, 0.0],
    [0.0, 0.5, 0.0],
    [0.0, 0.0, 0.5],
    [0.5, 0.0, 0.5],
    [0.0, 0.5, 0.5],
];

const HEX: [[f64; 3]; 20] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
    [0.0, -1.0, -1.0],
    [1.0, 0.0, -1.0],
    [0.0, 1.0, -1.0],
    [-1.0, 0.0, -1.0],
    [0.0, -1.0, 1.0],
    [1.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [-1.0, 0.0, 1.0],
    [-1.0, -1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
];

const WEDGE: [[f64; 3]; 15] = [
    [0.0, 0.0, -1.0],
    [1.0, 0.0, -1.0],
    [0.0, 1.0, -1.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [0.5, 0.0, -1.0],
    [0.5, 0.5, -1.0],
    [0.0, 0.5, -1.0],
    [0.5, 0.0, 1.0],
    [0.5, 0.5, 1.0],
    [0.0, 0.5, 1.0],
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
];

const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
const HEX_EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
const WEDGE_EDGES: [[usize; 2]; 9] = [[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]];

/// Reference coordinates of the nodes.
///
/// # Panics
/// For a beam.
pub(crate) fn reference_nodes(kind: ElementKind) -> &'static [[f64; 3]] {
    match kind {
        ElementKind::Tet4 | ElementKind::Tet10 => &TET[..kind.nodes()],
        ElementKind::Hex8 | ElementKind::Hex20 => &HEX[..kind.nodes()],
        ElementKind::Wedge6 | ElementKind::Wedge15 => &WEDGE[..kind.nodes()],
        ElementKind::Beam2 => no_beam(),
    }
}

/// Corner numbers of each edge, in the order of the mid-edge nodes, which follow the corners.
///
/// # Panics
/// For a beam.
pub fn edges(kind: ElementKind) -> &'static [[usize; 2]] {
    match kind {
        ElementKind::Tet4 | ElementKind::Tet10 => &TET_EDGES,
        ElementKind::Hex8 | ElementKind::Hex20 => &HEX_EDGES,
        ElementKind::Wedge6 | ElementKind::Wedge15 => &WEDGE_EDGES,
        ElementKind::Beam2 => no_beam(),
    }
}

/// Volume of the reference element: 1/6, 8 or 1.
///
/// # Panics
/// For a beam.
pub(crate) fn reference_volume(kind: ElementKind) -> f64 {
    match kind {
        ElementKind::Tet4 | ElementKind::Tet10 => 1.0 / 6.0,
        ElementKind::Hex8 | ElementKind::Hex20 => 8.0,
        ElementKind::Wedge6 | ElementKind::Wedge15 => 1.0,
        ElementKind::Beam2 => no_beam(),
    }
}

/// Computes `N_i` and `dN_i/d(r, s, t)` at `xi`, one entry per node of `kind`.
///
/// # Panics
/// For a beam, and for slices shorter than the number of nodes.
pub(crate) fn shape_functions(kind: ElementKind, xi: [f64; 3], N: &mut [f64], dN: &mut [[f64; 3]]) {
    match kind {
        ElementKind::Tet4 => tet4(xi, N, dN),
        ElementKind::Tet10 => tet10(xi, N, dN),
        ElementKind::Hex8 => hex8(xi, N, dN),
        ElementKind::Hex20 => hex20(xi, N, dN),
        ElementKind::Wedge6 => wedge6(xi, N, dN),
        ElementKind::Wedge15 => wedge15(xi, N, dN),
        ElementKind::Beam2 => no_beam(),
    }
}

pub(crate) fn no_beam() -> ! {
    panic!("a beam is not a solid element: its matrices are in `flexarm_fem::beam`")
}

/// Barycentric coordinates of the tetrahedron and their constant derivatives.
fn barycentric([r, s, t]: [f64; 3]) -> ([f64; 4], [[f64; 3]; 4]) {
    let dL = [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    ([1.0 - r - s - t, r, s, t], dL)
}

fn tet4(xi: [f64; 3], N: &mut [f64], dN: &mut [[f64; 3]]) {
    let (L, dL) = barycentric(xi);
    N[..4].copy_from_slice(&L);
    dN[..4].copy_from_slice(&dL);
}

/// Corners `L (2L - 1)`, edges `4 L_a L_b`.
fn tet10(xi: [f64; 3], N: &mut [f64], dN: &mut [[f64; 3]]) {
    let (L, dL) = barycentric(xi);
    for i in 0..4 {
        N[i] = L[i] * (2.0 * L[i] - 1.0);
        dN[i] = dL[i].map(|d| (4.0 * L[i] - 1.0) * d);
    }
    for (i, [a, b]) in TET_EDGES.into_iter().enumerate() {
        N[4 + i] = 4.0 * L[a] * L[b];
        dN[4 + i] = [0, 1, 2].map(|c| 4.0 * (L[a] * dL[b][c] + L[b] * dL[a][c]));
    }
}

/// `(1 + r r_i)(1 + s s_i)(1 + t t_i) / 8`.
fn hex8(xi: [f64; 3], N: &mut [f64], dN: &mut [[f64; 3]]) {
    for (i, node) in HEX[..8].iter().enumerate() {
        let f = [0, 1, 2].map(|c| 1.0 + xi[c] * node[c]);
        N[i] = f[0] * f[1] * f[2] / 8.0;
        dN[i] = [node[0] * f[1] * f[2] / 8.0, f[0] * node[1] * f[2] / 8.0, f[0] * f[1] * node[2] / 8.0];
    }
}

/// Serendipity: corners `f_r f_s f_t (r r_i + s s_i + t t_i - 2) / 8` with `f_r = 1 + r r_i`, edges
/// along r `(1 - r²) f_s f_t / 4`.
fn hex20(xi: [f64; 3], N: &mut [f64], dN: &mut [[f64; 3]]) {
    for (i, node) in HEX.iter().enumerate() {
        if i < 8 {
            let f = [0, 1, 2].map(|c| 1.0 + xi[c] * node[c]);
            let g = f[0] + f[1] + f[2] - 5.0;
            N[i] = f[0] * f[1] * f[2] * g / 8.0;
            dN[i] = [0, 1, 2].map(|c| node[c] * f[(c + 1) % 3] * f[(c + 2) % 3] * (g + f[c]) / 8.0);
            continue;
        }
        // Bubble 1 - r² along the edge, two linear factors across it.
        let f = [0, 1, 2].map(|c| if node[c] == 0.0 { 1.0 - xi[c] * xi[c] } else { 1.0 + xi[c] * node[c] });
        let df = [0, 1, 2].map(|c| if node[c] == 0.0 { -2.0 * xi[c] } else { node[c] });
        N[i] = f[0] * f[1] * f[2] / 4.0;
        dN[i] = [df[0] * f[1] * f[2] / 4.0, f[0] * df[1] * f[2] / 4.0, f[0] * f[1] * df[2] / 4.0];
    }
}

/// Area coordinates of the triangle and their constant derivatives by r and s.
fn area([r, s, _]: [f64; 3]) -> ([f64; 3], [[f64; 2]; 3]) {
    ([1.0 - r - s, r, s], [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
}

/// `L (1 + t t_i) / 2`.
fn wedge6(xi: [f64; 3], N: &mut [f64], dN: &mut [[f64; 3]]) {
    let (L, dL) = area(xi);
    for i in 0..6 {
        let (k, t_i) = (i % 3, WEDGE[i][2]);
        let f = 0.5 * (1.0 + xi[2] * t_i);
        N[i] = L[k] * f;
        dN[i] = [dL[k][0] * f, dL[k][1] * f, 0.5 * L[k] * t_i];
    }
}

/// Corners `L [(2L - 1)(1 + t t_i) - (1 - t²)] / 2`, edges of the triangles
/// `2 L_a L_b (1 + t t_i)`, upright edges `L (1 - t²)`.
fn wedge15(xi: [f64; 3], N: &mut [f64], dN: &mut [[f64; 3]]) {
    let (L, dL) = area(xi);
    let t = xi[2];
    let bubble = 1.0 - t * t;
    for i in 0..6 {
        let (k, t_i) = (i % 3, WEDGE[i][2]);
        let f = 1.0 + t * t_i;
        let slope = 0.5 * ((4.0 * L[k] - 1.0) * f - bubble);
        N[i] = 0.5 * L[k] * ((2.0 * L[k] - 1.0) * f - bubble);
        dN[i] = [slope * dL[k][0], slope * dL[k][1], 0.5 * L[k] * ((2.0 * L[k] - 1.0) * t_i + 2.0 * t)];
    }
    for i in 6..12 {
        let ([a, b], t_i) = (WEDGE_EDGES[(i - 6) % 3], WEDGE[i][2]);
        let f = 2.0 * (1.0 + t * t_i);
        let slope = |c: usize| f * (L[a] * dL[b][c] + L[b] * dL[a][c]);
        N[i] = f * L[a] * L[b];
        dN[i] = [slope(0), slope(1), 2.0 * t_i * L[a] * L[b]];
    }
    for k in 0..3 {
        N[12 + k] = L[k] * bubble;
        dN[12 + k] = [dL[k][0] * bubble, dL[k][1] * bubble, -2.0 * t * L[k]];
    }
}
