//! Factorised model with its boundary: static shapes, and modes under three kinds of support.
//!
//! ```text
//! K_ii = L Lᵀ,   T = [-K_ii⁻¹ K_ib; 1],   K_g = Tᵀ K T,   M_g = Tᵀ M T
//! K u + Gᵀ λ = F,  G u = g     distributing ties: λ from the Schur complement G K_ii⁻¹ Gᵀ
//! ```
//! Start at [`Condensation::new`]. Mesh axes; six boundary columns per interface, the first
//! interface first; tall matrices have one row per DoF of the model.
//!
//! Not here: ties ([`super::Boundary`]), the factor and the eigensolver ([`crate::sparse`]).

mod modes;

use flexarm_spatial::symmetric_part;
use nalgebra::{DMatrix, DVector, SymmetricEigen, Vector3};

use super::boundary::{Boundary, Interface, TieError};
use super::grounding::statically_determinate;
use super::superelement::{InterfaceFrame, Superelement};
use crate::error::Direction;
use crate::model::FeModel;
use crate::sparse::{
    Block, Cholesky, FactorFigures, Modes, ModesError, NotPositiveDefinite, Ordering, Row, WIDTH, add_product, gram,
    grams, orthonormalising, subtract_products,
};

/// Relative pivot below which the model is singular: a pivot this far below its diagonal entry is
/// rounding. Links with a length of a thousand times their thickness stay above 1e-10.
const SINGULAR: f64 = 1e-12;

/// Eigenvalue of the interface stiffness, scaled to a unit diagonal, below which an interface moves
/// freely; the limit of the gate.
const FREE: f64 = 1e-10;

/// Options of the solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CondensationOptions {
    /// Fill-reducing order.
    pub ordering: Ordering,
}

/// Errors of reducing a model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReductionError {
    /// The interfaces could not be tied.
    #[error(transparent)]
    Tie(#[from] TieError),
    /// `K_ii` has no Cholesky factor.
    #[error(
        "the stiffness of the free nodes is not positive definite: node index {node} can move without \
         force ({component}); a part of the mesh is loose, an element is inverted, or a mechanism is left"
    )]
    Loose {
        /// Index of the node of the failing pivot.
        node: usize,
        /// Component at that node.
        component: &'static str,
    },
    /// The factor does not fit into memory.
    #[error("the factor{} does not fit into memory; coarsen the mesh", match entries {
        0 => String::new(),
        entries => format!(" of {entries} numbers"),
    })]
    OutOfMemory {
        /// Number of entries of the factor; 0 if they cannot be counted.
        entries: usize,
    },
    /// An interface after the first can move without force.
    #[error(
        "interface number {} can move without force while the first one is held ({direction}): are the two on the same part of the model, and is that part connected in more than a point or a line?", interface + 1
    )]
    FreeInterface {
        /// Number of the interface, from 0.
        interface: usize,
        /// Free motion; components in the axes of the model.
        direction: Direction,
    },
    /// The model is unsupported, and no six DoF can support it.
    #[error("the mesh lies on a line or in a point: nothing holds its rotations")]
    NoGrounding,
    /// The modes could not be computed.
    #[error(transparent)]
    Modes(#[from] ModesError),
}

/// Figures of the linear algebra, for reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverFigures {
    /// Number of DoF of the whole mesh.
    pub dofs: usize,
    /// Figures of the factor.
    pub factor: FactorFigures,
    /// Number of right-hand sides solved for the static shapes.
    pub static_solves: usize,
    /// Minimum pivot of the factor relative to its diagonal entry.
    pub smallest_pivot: f64,
}

/// Data for the saddle point problem of distributing ties.
#[derive(Debug)]
struct Saddle {
    /// G over the solved DoF, by rows.
    rows: Vec<Vec<(u32, f64)>>,
    /// `K_ii⁻¹ Gᵀ`, by blocks.
    Z: Vec<Block>,
    /// LU factors of the small matrix for the forces λ and, if the mesh is unsupported, its rigid
    /// motion.
    small: nalgebra::LU<f64, nalgebra::Dyn, nalgebra::Dyn>,
    /// Scale of the compliances in the small matrix.
    scale: f64,
    /// Rigid motions of the whole mesh, if it is unsupported.
    rigid: Option<Block>,
}

/// A model, its boundary, the factor of `K_ii` and the static shapes.
#[derive(Debug)]
pub struct Condensation<'m> {
    model: &'m FeModel,
    boundary: Boundary,
    /// DoF in the factor: the free ones without those fixed by grounding.
    solved: Vec<u32>,
    factor: Cholesky,
    saddle: Option<Saddle>,
    /// Static shapes, one column per boundary DoF, over all DoF.
    T: DMatrix<f64>,
    /// Static shapes without the first six columns, by blocks.
    T_B: Vec<Block>,
    K_g: DMatrix<f64>,
    M_g: DMatrix<f64>,
    /// Maximum relative asymmetry of `K_g` before symmetrisation.
    asymmetry: f64,
    /// Inverse of `K_g` without its first six rows: compliance with the first interface clamped.
    tip: DMatrix<f64>,
}

impl<'m> Condensation<'m> {
    /// Ties the interfaces, factorises `K_ii` and computes the static shapes.
    ///
    /// * `interfaces`: proximal first, two or more; poses in mesh axes, m.
    ///
    /// Cost: one sparse Cholesky factorisation, and six solves per interface (twelve if its tie is
    /// distributing).
    ///
    /// # Errors
    /// [`ReductionError`]: a tie that is impossible, a part that moves freely, a factor that does
    /// not fit into memory.
    ///
    /// # Source
    /// [Guyan 1965].
    pub fn new(
        model: &'m FeModel,
        interfaces: &[Interface],
        options: CondensationOptions,
    ) -> Result<Self, ReductionError> {
        Self::with_boundary(model, Boundary::tie(model, interfaces)?, options)
    }

    /// As [`Self::new`], with a given boundary of the same model.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_boundary(
        model: &'m FeModel,
        boundary: Boundary,
        options: CondensationOptions,
    ) -> Result<Self, ReductionError> {
        // Free DoF, less six of an unsupported mesh (grounding), and their Cholesky factor.
        let mut solved = boundary.free().to_vec();
        let rigid = if boundary.supports() {
            None
        } else {
            let R = model.rigid_modes(&Vector3::zeros());
            let grounded = statically_determinate(model, &solved, &R).ok_or(ReductionError::NoGrounding)?;
            for position in grounded.into_iter().rev() {
                solved.remove(position);
            }
            Some(R)
        };
        // K_ii = L Lᵀ; a pivot near zero is a mechanism.
        let factor = Cholesky::new(&model.K.submatrix(&solved), options.ordering).map_err(|error| match error {
            NotPositiveDefinite::Pivot { unknown } => {
                let (node, component) = model.dofs.node_of(solved[unknown] as usize);
                ReductionError::Loose { node, component: crate::error::COMPONENTS[component] }
            }
            NotPositiveDefinite::OutOfMemory { entries } => ReductionError::OutOfMemory { entries },
        })?;
        let (pivot, unknown) = factor.smallest_pivot();
        if !(pivot > SINGULAR) {
            let (node, component) = model.dofs.node_of(solved[unknown] as usize);
            return Err(ReductionError::Loose { node, component: crate::error::COMPONENTS[component] });
        }
        let empty = DMatrix::zeros(0, 0);
        let mut this = Self {
            model,
            boundary,
            solved,
            factor,
            saddle: None,
            T: empty.clone(),
            T_B: Vec::new(),
            K_g: empty.clone(),
            M_g: empty.clone(),
            asymmetry: 0.0,
            tip: empty,
        };
        this.saddle = this.saddle_of(rigid);
        this.condense();
        this.tip = this.tip_compliance()?;
        Ok(this)
    }

    /// Computes the static shapes T, `K_g = Tᵀ K T`, `M_g = Tᵀ M T` and the asymmetry of the
    /// forces.
    fn condense(&mut self) {
        let columns = self.boundary.columns();
        // Static shapes T, then K_g = Tᵀ K T and M_g = Tᵀ M T.
        let (T, lambda) = self.static_shapes(columns);
        self.T_B = blocks(&T.columns(6.min(columns), columns.saturating_sub(6)).into_owned());
        self.T = T;
        let KT = self.model.K.product(&self.T);
        // The energy Tᵀ K T is symmetric for any T, but the forces on the interfaces are symmetric
        // only if T solves the equations, so the asymmetry is measured on the forces.
        let mut forces = gram(&self.boundary.rigid_part(), &KT);
        for ((column, _), row) in self.boundary.means().iter().zip(lambda.row_iter()) {
            let mut force = forces.row_mut(*column);
            force -= row;
        }
        self.K_g = symmetric_part(&gram(&self.T, &KT));
        let d = self.K_g.diagonal();
        let place = |(i, j): (usize, usize)| (forces[(i, j)] - forces[(j, i)]).abs() / (d[i] * d[j]).sqrt();
        let pairs = (0..columns).flat_map(|i| (0..i).map(move |j| (i, j)));
        self.asymmetry = worst(pairs.map(place));
        self.M_g = symmetric_part(&gram(&self.T, &self.model.M.product(&self.T)));
    }

    /// Factorises the small system of the distributing ties; `None` without such ties.
    ///
    /// * `rigid`: six rigid motions of the whole mesh as columns, if it is unsupported.
    fn saddle_of(&self, rigid: Option<DMatrix<f64>>) -> Option<Saddle> {
        let means = self.boundary.means();
        if means.is_empty() {
            return None;
        }
        // Rows of G over the solved DoF.
        let m = means.len();
        let mut position = vec![u32::MAX; self.model.size()];
        for (k, dof) in self.solved.iter().enumerate() {
            position[*dof as usize] = k as u32;
        }
        let rows: Vec<Vec<(u32, f64)>> = means
            .iter()
            .map(|(_, row)| {
                let inside = |(dof, weight): &(u32, f64)| {
                    let at = position[*dof as usize];
                    (at != u32::MAX).then_some((at, *weight))
                };
                row.iter().filter_map(inside).collect()
            })
            .collect();
        // Z = K_ii⁻¹ Gᵀ and the Schur complement S = G Z.
        let mut Z = DMatrix::zeros(self.solved.len(), m);
        for (k, row) in rows.iter().enumerate() {
            for (at, weight) in row {
                Z[(*at as usize, k)] = *weight;
            }
        }
        self.factor.solve_in_place(&mut Z);
        let S = apply_rows(&rows, m, |at, j| Z[(at, j)]);
        let scale = S.amax();
        // [S/s, -GR; -(GR)ᵀ, 0] [λ; a/s] = [(G y - g)/s; -Rᵀ f]
        let extra = if rigid.is_some() { 6 } else { 0 };
        let mut small = DMatrix::zeros(m + extra, m + extra);
        small.view_mut((0, 0), (m, m)).copy_from(&(S / scale));
        if let Some(R) = &rigid {
            for (k, (_, row)) in means.iter().enumerate() {
                for j in 0..6 {
                    let GR: f64 = row.iter().map(|(dof, weight)| weight * R[(*dof as usize, j)]).sum();
                    small[(k, m + j)] = -GR;
                    small[(m + j, k)] = -GR;
                }
            }
        }
        let Z = blocks(&Z);
        let rigid = rigid.map(|R| Block::of_columns(&R, 0, 6));
        Some(Saddle { rows, Z, small: small.lu(), scale, rigid })
    }

    /// Solves `K u + Gᵀ λ = F` on the free DoF with `G u = g`; tied DoF are zero. F is overwritten
    /// by u.
    ///
    /// Returns λ, one row per constrained boundary DoF.
    fn solve_constrained(&self, F: &mut Block, g: Option<&DMatrix<f64>>) -> DMatrix<f64> {
        let width = F.width;
        let Some(saddle) = &self.saddle else {
            self.factor.solve_rows(&mut F.rows, Some(&self.solved));
            fill_others(&mut F.rows, &self.solved);
            return DMatrix::zeros(0, width);
        };
        // y = K_ii⁻¹ F, its constraint gap G y - g, and λ from the small system.
        let mut y = Block { rows: self.solved.iter().map(|dof| F.rows[*dof as usize]).collect(), width };
        self.factor.solve_block(&mut y);
        let m = saddle.rows.len();
        let mut right = DMatrix::zeros(saddle.small.l().nrows(), width);
        let mut gap = apply_rows(&saddle.rows, width, |at, j| y.rows[at].0[j]);
        if let Some(g) = g {
            gap -= g;
        }
        right.view_mut((0, 0), (m, width)).copy_from(&(gap / saddle.scale));
        if let Some(R) = &saddle.rigid {
            right.view_mut((m, 0), (6, width)).copy_from(&-R.gram(F));
        }
        if !saddle.small.solve_mut(&mut right) {
            right.fill(f64::NAN);
        }
        // u = y - Z λ, plus the rigid motion of an unsupported mesh.
        let forces = right.rows(0, m).into_owned();
        subtract_products(&mut y, &saddle.Z, &forces);
        self.solved.iter().zip(&y.rows).for_each(|(dof, y)| F.rows[*dof as usize] = *y);
        fill_others(&mut F.rows, &self.solved);
        if let Some(R) = &saddle.rigid {
            F.subtract_product(R, &(right.rows(m, 6) * -saddle.scale));
        }
        forces
    }

    /// Static shapes T over all DoF, and the forces λ of the distributing ties, one column per
    /// boundary DoF: `T = B + X` with `K X + Gᵀ λ = -K B` on the free DoF and `G X = g`, where row
    /// k of g has a one at the boundary DoF of row k of G.
    fn static_shapes(&self, columns: usize) -> (DMatrix<f64>, DMatrix<f64>) {
        let B = self.boundary.rigid_part();
        let mut X = -self.model.K.product(&B);
        let means = self.boundary.means();
        let g = DMatrix::from_fn(means.len(), columns, |k, j| if means[k].0 == j { 1.0 } else { 0.0 });
        let mut lambda = DMatrix::zeros(means.len(), columns);
        for first in (0..columns).step_by(WIDTH) {
            let width = WIDTH.min(columns - first);
            let mut block = Block::of_columns(&X, first, width);
            let forces = self.solve_constrained(&mut block, Some(&g.columns(first, width).into_owned()));
            block.put_columns(&mut X, first);
            lambda.columns_mut(first, width).copy_from(&forces);
        }
        (X + B, lambda)
    }

    /// Compliance of the interfaces after the first, which is clamped; empty with one interface.
    fn tip_compliance(&self) -> Result<DMatrix<f64>, ReductionError> {
        let n = self.K_g.nrows();
        if n < 12 {
            return Ok(DMatrix::zeros(0, 0));
        }
        let K_BB = self.K_g.view((6, 6), (n - 6, n - 6)).into_owned();
        match free_direction(&K_BB) {
            Some((interface, direction)) => Err(ReductionError::FreeInterface { interface: interface + 1, direction }),
            None => spd_inverse(&K_BB).ok_or(ReductionError::Modes(ModesError::NotFinite)),
        }
    }

    /// Compliance of the interfaces after the first, which is clamped (m/N, m/(N·m); rad/N,
    /// rad/(N·m)): six rows and columns per interface, at Io, mesh axes.
    pub fn tip(&self) -> &DMatrix<f64> {
        &self.tip
    }

    /// Model that was reduced.
    pub fn model(&self) -> &FeModel {
        self.model
    }

    /// Static shapes T: displacement of every DoF per unit of each boundary DoF, mesh axes; one row
    /// per DoF of the model, six columns per interface.
    pub fn shapes(&self) -> &DMatrix<f64> {
        &self.T
    }

    /// Guyan stiffness `K_g` (N/m, N/rad; N·m/m, N·m/rad), six rows per interface, at Io, mesh
    /// axes.
    pub fn stiffness(&self) -> &DMatrix<f64> {
        &self.K_g
    }

    /// Guyan mass `M_g` (kg, kg·m; kg·m, kg·m²), in the same layout.
    pub fn mass(&self) -> &DMatrix<f64> {
        &self.M_g
    }

    /// Displacements of all DoF under unit wrenches on the interfaces after the first, which is
    /// clamped: `U = T_B C_BB`.
    ///
    /// Returns one row per DoF of the model (m, rad; mesh axes) and six columns per interface.
    pub fn unit_load_shapes(&self) -> DMatrix<f64> {
        let n = self.K_g.nrows();
        let T_B = self.T.columns(6, n - 6).into_owned();
        let mut U = DMatrix::zeros(self.T.nrows(), n - 6);
        add_product(&mut U, 1.0, &T_B, &self.tip);
        U
    }

    /// Replaces nodal forces by the displacements of all DoF, with the first interface clamped and
    /// the others free.
    ///
    /// * `F`: forces on all DoF (N, N·m; mesh axes), one column per load; on return displacements.
    pub(crate) fn solve_held(&self, F: &mut DMatrix<f64>) {
        for first in (0..F.ncols()).step_by(WIDTH) {
            let mut block = Block::of_columns(F, first, WIDTH.min(F.ncols() - first));
            self.solve_held_block(&mut block);
            block.put_columns(F, first);
        }
    }

    /// As [`Self::solve_held`], for one block.
    ///
    /// ```text
    /// u = K_ii⁻¹ F + T_B u_B,   u_B = C_BB T_Bᵀ F
    /// ```
    fn solve_held_block(&self, F: &mut Block) {
        let u_B = &self.tip * grams(&self.T_B, F);
        self.solve_constrained(F, None);
        subtract_products(F, &self.T_B, &-u_B);
    }

    /// Displacements of the interfaces after the first under nodal forces, the first one clamped:
    /// `u_B = C_BB T_Bᵀ F`.
    ///
    /// * `F`: forces on all DoF (N, N·m; mesh axes), one column per load.
    ///
    /// Returns six rows per interface (m, rad; at Io, mesh axes).
    pub fn tip_under(&self, F: &DMatrix<f64>) -> DMatrix<f64> {
        let n = self.K_g.nrows();
        let T_B = self.T.columns(6, n - 6).into_owned();
        &self.tip * gram(&T_B, F)
    }

    /// Creates the superelement: Guyan reduction if `modes` is empty, Craig-Bampton otherwise.
    ///
    /// ```text
    /// K = [ K_g    0        ]      M = [ M_g       Tᵀ M Φ ]      Φ, ω: fixed-interface modes
    ///     [  0   diag(ω²)   ]          [ Φᵀ M T      1    ]
    /// ```
    /// * `frames`: name, frame and tie of each interface, in the order of the boundary.
    /// * `modes`: result of [`Self::fixed_modes`].
    ///
    /// Returns six coordinates per interface, then one per mode; mesh axes, SI.
    ///
    /// # Source
    /// [Guyan 1965], [Craig & Bampton 1968].
    pub fn superelement(&self, frames: Vec<InterfaceFrame>, modes: &Modes) -> Superelement {
        let (n, m) = (self.K_g.nrows(), modes.len());
        let mut K = DMatrix::zeros(n + m, n + m);
        let mut M = DMatrix::identity(n + m, n + m);
        K.view_mut((0, 0), (n, n)).copy_from(&self.K_g);
        M.view_mut((0, 0), (n, n)).copy_from(&self.M_g);
        for (k, omega2) in modes.omega2.iter().enumerate() {
            K[(n + k, n + k)] = *omega2;
        }
        let coupling = gram(&self.T, &self.model.M.product(&modes.shapes));
        M.view_mut((0, n), (n, m)).copy_from(&coupling);
        M.view_mut((n, 0), (m, n)).copy_from(&coupling.transpose());
        Superelement { interfaces: frames, K, M }
    }

    /// Maximum relative asymmetry of the condensed stiffness before symmetrisation.
    pub fn asymmetry(&self) -> f64 {
        self.asymmetry
    }

    /// Estimates the condition number of `K_ii`: the largest eigenvalue by power iteration, the
    /// smallest by two steps of subspace iteration that start from the static shapes of an
    /// interface. NaN if there are no internal unknowns.
    pub fn condition_estimate(&self) -> f64 {
        let rows = self.model.size();
        let keep_inside = |x: &mut DMatrix<f64>| {
            let mut kept = DMatrix::zeros(rows, 1);
            self.solved.iter().for_each(|dof| kept[*dof as usize] = x[*dof as usize]);
            *x = kept;
        };
        // Alternating signs at neighbouring nodes excite the stiff end of the spectrum.
        let mut stiff = DMatrix::from_fn(rows, 1, |i, _| if (i * 2_654_435_761) & 64 == 0 { 1.0 } else { -1.0 });
        let mut largest = 0.0;
        keep_inside(&mut stiff);
        for _ in 0..20 {
            stiff /= stiff.norm();
            stiff = self.model.K.product(&stiff);
            keep_inside(&mut stiff);
            largest = stiff.norm();
        }
        // Parts connected only to A do not move with B; then use the shapes of A.
        let T_A = || Block::of_columns(&self.T, 0, 6.min(self.T.ncols()));
        let inside = |T: &Block| -> Vec<Row> { self.solved.iter().map(|dof| T.rows[*dof as usize]).collect() };
        let moves = |rows: &Vec<Row>| rows.iter().any(|row| *row != Row::ZERO);
        let rows = self.T_B.first().map(inside).filter(moves).unwrap_or_else(|| inside(&T_A()));
        let mut y = Block { rows, width: WIDTH };
        self.factor.solve_block(&mut y);
        y.multiply(&orthonormalising(&y.gram(&y), 0.0).0);
        if y.width == 0 {
            return f64::NAN;
        }
        let Q = y.clone();
        self.factor.solve_block(&mut y);
        largest * SymmetricEigen::new(symmetric_part(&Q.gram(&y))).eigenvalues.max()
    }

    /// Figures of the linear algebra.
    pub fn figures(&self) -> SolverFigures {
        SolverFigures {
            dofs: self.model.size(),
            factor: self.factor.figures(),
            static_solves: self.boundary.columns() + self.boundary.means().len(),
            smallest_pivot: self.factor.smallest_pivot().0,
        }
    }
}

/// Product of G and a tall matrix with entries `x`.
fn apply_rows(rows: &[Vec<(u32, f64)>], columns: usize, x: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), columns, |k, j| rows[k].iter().map(|(at, w)| w * x(*at as usize, j)).sum())
}

/// Sets all rows except `kept`, which are ascending, to zero.
fn fill_others(rows: &mut [Row], kept: &[u32]) {
    let mut next = 0;
    for row in kept {
        rows[next..*row as usize].fill(Row::ZERO);
        next = *row as usize + 1;
    }
    rows[next..].fill(Row::ZERO);
}

/// Splits a tall matrix into blocks.
fn blocks(X: &DMatrix<f64>) -> Vec<Block> {
    let firsts = (0..X.ncols()).step_by(WIDTH);
    firsts.map(|first| Block::of_columns(X, first, WIDTH.min(X.ncols() - first))).collect()
}

/// Maximum of some measures; NaN if any of them is NaN.
pub(crate) fn worst(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |worst: f64, x| if !(x <= worst) { x } else { worst })
}

/// Interface with the largest motion, and its direction, if the boundary stiffness has a motion
/// without resistance.
fn free_direction(K: &DMatrix<f64>) -> Option<(usize, Direction)> {
    let scale = K.diagonal().map(|k| if k > 0.0 { 1.0 / k.sqrt() } else { 0.0 });
    let scaled = DMatrix::from_fn(K.nrows(), K.ncols(), |i, j| K[(i, j)] * scale[i] * scale[j]);
    if scaled.iter().any(|x| !x.is_finite()) {
        return None;
    }
    // A row without stiffness is a free motion.
    let motion = match (0..K.nrows()).find(|i| scale[*i] == 0.0) {
        Some(row) => DVector::from_fn(K.nrows(), |i, _| f64::from(i == row)),
        None => {
            let eigen = SymmetricEigen::new(scaled);
            let (at, smallest) = eigen.eigenvalues.argmin();
            if smallest > FREE {
                return None;
            }
            eigen.eigenvectors.column(at).component_mul(&scale)
        }
    };
    let size = |k: usize| motion.rows(6 * k, 6).norm();
    let most = (0..K.nrows() / 6).max_by(|a, b| size(*a).total_cmp(&size(*b)))?;
    Some((most, Direction::new(motion.rows(6 * most, 6).iter().copied())))
}

/// Inverse of a small SPD matrix with rows of different units, scaled to a unit diagonal first;
/// `None` if K is not positive definite.
pub(crate) fn spd_inverse(K: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = K.diagonal().map(|k| 1.0 / k.sqrt());
    let scaled = DMatrix::from_fn(K.nrows(), K.ncols(), |i, j| K[(i, j)] * scale[i] * scale[j]);
    if scaled.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let inverse = scaled.cholesky()?.inverse();
    Some(symmetric_part(&DMatrix::from_fn(K.nrows(), K.ncols(), |i, j| inverse[(i, j)] * scale[i] * scale[j])))
}
