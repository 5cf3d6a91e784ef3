//! Modal body: flexible body in a floating frame of reference fixed to its proximal interface.
//!
//! A point at `s` in the undeformed body is at `r = s + Σ φ_k(s) η_k`, in body axes; the shapes
//! vanish at the proximal interface. With a kinetic energy that is exact in η (including second
//! order), the equations of motion need only mass integrals:
//!
//! ```text
//! h   = ∫ r dm            = S + C_t η                                    (1)
//! Q_k = ∫ φ_k rᵀ dm       = P_kᵀ + Σ_l N_kl η_l                          (2)
//! J   = ∫ (r·r 1 - r rᵀ)  = J_0 + tr(E) 1 - E,   E = Σ_k η_k (P_k + Q_k) (3)
//! C_r,k = ∫ r × φ_k dm    = C_r0,k + axial(Σ_l N_kl η_l)                 (4)
//!
//! [ F ]   [ m 1    -[h]x   C_t ] [ a ]   [ 2 ω × C_t η̇ + ω × (ω × h)                              ]
//! [ T ] = [ [h]x    J      C_r ] [ α ] + [ ω × J ω + 2 (tr W 1 - Wᵀ) ω                              ]   (5)
//! [ f ]   [ C_tᵀ    C_rᵀ   M_e ] [ η̈ ]   [ 2 ω · Σ_l η̇_l g_lk + ωᵀ Q_k ω - tr(Q_k) ω·ω             ]
//!
//! W = ∫ r (dr/dt)ᵀ dm = (Σ_k η̇_k Q_k)ᵀ,   g_lk = ∫ φ_l × φ_k dm;   a = v̇ + ω × v in body axes
//! ```
//! Rotary inertia of beam cross-sections enters `J_0`, `C_r0` and `M_e` as constants.
//!
//! Only the symmetric part of `Q_k` is stored, as six numbers: `axial(N_kl)` is `g_lk`, and the
//! contribution of the skew part of W to T is `ω × C_r η̇`.
//!
//! Start at [`ModalBody`]. Sources: [Shabana 2013], chapter 5; [Wallrapp 1994] for the set of
//! integrals. Not here: modal stiffness and damping, computation of the shapes.

use flexarm_spatial::products::{add, add3, cross, dot, lift, lift3, mul, scaled, tr_mul};
use flexarm_spatial::{Pose, Real, SpatialInertia, Twist, Wrench};
use nalgebra::{Cholesky, DMatrix, Dyn, Matrix3, Matrix6xX, Scalar, Vector3};

/// Mode shapes at the interfaces and mass integrals; n coordinates, link axes, about the link
/// origin. SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct ModalBody {
    /// Mass (kg).
    pub mass: f64,
    /// `∫ s dm` (kg m).
    pub first_moment: Vector3<f64>,
    /// Inertia about the origin in the undeformed state (kg m²).
    pub inertia: Matrix3<f64>,
    /// `∫ φ_k dm`, one per coordinate.
    pub C_t: Vec<Vector3<f64>>,
    /// `∫ s × φ_k dm`, including rotary inertia of cross-sections.
    pub C_r: Vec<Vector3<f64>>,
    /// `P_k[a,b] = ∫ s_a φ_k,b dm`.
    pub P: Vec<Matrix3<f64>>,
    /// `N[k n + l][a,b] = ∫ φ_k,a φ_l,b dm`; if empty, second-order terms in the deformation are
    /// omitted.
    pub N: Vec<Matrix3<f64>>,
    /// Modal mass matrix, n×n.
    pub M: DMatrix<f64>,
    /// All interfaces except the proximal one.
    pub interfaces: Vec<InterfaceShape>,
}

/// Motion of one interface as a function of the coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct InterfaceShape {
    /// Undeformed pose of the interface in the link.
    pub X_LI: Pose,
    /// Displacement of its origin and rotation vector per unit coordinate, link axes, 6×n.
    pub Phi: Matrix6xX<f64>,
}

impl ModalBody {
    /// Number n of modal coordinates.
    pub fn n(&self) -> usize {
        self.C_t.len()
    }

    /// Mass properties `M_LLo_L` in the undeformed state, about the link origin.
    pub fn undeformed(&self) -> SpatialInertia {
        SpatialInertia { mass: self.mass, first_moment: self.first_moment, rotational: self.inertia }
    }

    /// Mass matrix of the undeformed body, (6 + n)×(6 + n): linear and angular acceleration of the
    /// link origin, then modal accelerations; matrix of (5) at η = 0.
    pub fn mass_matrix(&self) -> DMatrix<f64> {
        let n = self.n();
        let mut M = DMatrix::zeros(6 + n, 6 + n);
        M.view_mut((0, 0), (3, 3)).copy_from(&(Matrix3::identity() * self.mass));
        M.view_mut((3, 0), (3, 3)).copy_from(&self.first_moment.cross_matrix());
        M.view_mut((0, 3), (3, 3)).copy_from(&self.first_moment.cross_matrix().transpose());
        M.view_mut((3, 3), (3, 3)).copy_from(&self.inertia);
        for (k, (t, r)) in self.C_t.iter().zip(&self.C_r).enumerate() {
            for (row, column) in [t, r].into_iter().enumerate() {
                M.view_mut((3 * row, 6 + k), (3, 1)).copy_from(column);
                M.view_mut((6 + k, 3 * row), (1, 3)).copy_from(&column.transpose());
            }
        }
        M.view_mut((6, 6), (n, n)).copy_from(&self.M);
        M
    }

    /// Returns a description of inconsistent sizes or values, if any.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        let n = self.n();
        let shapes = self.interfaces.iter().all(|i| i.Phi.ncols() == n);
        let sizes = self.C_r.len() == n && self.P.len() == n && self.M.shape() == (n, n);
        let second = self.N.is_empty() || self.N.len() == n * n;
        let finite = self.M.iter().chain(self.interfaces.iter().flat_map(|i| i.Phi.iter())).all(|x| x.is_finite());
        match (n > 0, shapes && sizes && second, finite && self.mass.is_finite()) {
            (false, ..) => Some("the number of modal coordinates, which must be positive,"),
            (_, false, _) => Some("the size of its modal matrices, which do not fit each other,"),
            (.., false) => Some("an entry of its modal matrices"),
            _ => None,
        }
    }
}

/// Modal body with precomputed tables for the recursions.
#[derive(Clone, Debug)]
pub(crate) struct ModalTables {
    pub(crate) shapes: ModalBody,
    /// (2): column l holds `N_kl` for all k, each as its [`symmetric`] part.
    N: Integrals,
    /// Column l holds `g_lk` for all k.
    g: Integrals,
    /// `P_k` for all k, in the same form.
    P: Vec<f64>,
    /// Per interface, the number of leading coordinates that may move it; later ones do not.
    pub(crate) moving: Vec<usize>,
}

/// Second-order integrals of pairs of coordinates, one column per coordinate.
#[derive(Clone, Debug)]
enum Integrals {
    /// Dense storage, as for a mesh.
    All(DMatrix<f64>),
    /// Sparse storage, as for a beam whose modes each move along one axis: row and value of the
    /// nonzero entries, and the end of each column.
    Few { entries: Vec<(u32, f64)>, ends: Vec<usize> },
}

impl Integrals {
    /// Relative magnitude below which entries are dropped as rounding errors.
    const ROUNDING: f64 = 1e-14;
    /// Sparse storage is used if at most one in this many entries is nonzero; it is faster then.
    const SPARSE: usize = 4;

    fn new(all: DMatrix<f64>, shapes: &ModalBody) -> Self {
        let n = shapes.n();
        let per_coordinate = all.nrows() / n.max(1);
        if all.is_empty() {
            return Self::All(all);
        }
        let size: Vec<f64> = (0..n).map(|k| shapes.N[k * n + k].trace().abs().sqrt()).collect();
        let (mut entries, mut ends) = (Vec::new(), Vec::new());
        for (l, column) in all.column_iter().enumerate() {
            let counts = |row: usize, x: f64| x.abs() > Self::ROUNDING * size[row / per_coordinate] * size[l];
            entries.extend(
                (0..).zip(column.iter()).filter(|(row, x)| counts(*row as usize, **x)).map(|(row, x)| (row, *x)),
            );
            ends.push(entries.len());
        }
        match Self::SPARSE * entries.len() <= all.len() {
            true => Self::Few { entries, ends },
            false => Self::All(all),
        }
    }

    /// `y += A x`.
    #[inline(always)]
    fn add_product<T: Real>(&self, x: &[T], y: &mut [T]) {
        let (entries, ends) = match self {
            Self::All(all) if all.is_empty() => return,
            Self::All(all) => return add_product(all, x, y),
            Self::Few { entries, ends } => (entries, ends),
        };
        let mut begin = 0;
        for (&end, &x) in ends.iter().zip(x) {
            for (row, a) in &entries[begin..end] {
                y[*row as usize] += T::splat(*a) * x;
            }
            begin = end;
        }
    }
}

/// `∫ r × φ` from `Q = ∫ φ rᵀ`.
fn axial(Q: &Matrix3<f64>) -> Vector3<f64> {
    Vector3::new(Q[(2, 1)] - Q[(1, 2)], Q[(0, 2)] - Q[(2, 0)], Q[(1, 0)] - Q[(0, 1)])
}

/// Symmetric part with doubled off-diagonal entries: xx, yy, zz, xy + yx, xz + zx, yz + zy.
fn symmetric(Q: &Matrix3<f64>) -> [f64; 6] {
    let off = |a: usize, b: usize| Q[(a, b)] + Q[(b, a)];
    [Q[(0, 0)], Q[(1, 1)], Q[(2, 2)], off(0, 1), off(0, 2), off(1, 2)]
}

impl ModalTables {
    pub(crate) fn new(shapes: &ModalBody) -> Self {
        let n = shapes.n();
        let second = !shapes.N.is_empty();
        let mut N = DMatrix::zeros(if second { 6 * n } else { 0 }, n);
        let mut g = DMatrix::zeros(if second { 3 * n } else { 0 }, n);
        if second {
            for k in 0..n {
                for l in 0..n {
                    let N_kl = &shapes.N[k * n + l];
                    N.view_mut((6 * k, l), (6, 1)).copy_from_slice(&symmetric(N_kl));
                    // ∫ φ_l × φ_k = axial(∫ φ_k φ_lᵀ)
                    g.view_mut((3 * k, l), (3, 1)).copy_from(&axial(N_kl));
                }
            }
        }
        let (N, g) = (Integrals::new(N, shapes), Integrals::new(g, shapes));
        let P = shapes.P.iter().flat_map(symmetric).collect();
        let moves = |shape: &InterfaceShape| {
            let last = (0..n).rev().find(|k| shape.Phi.column(*k).iter().any(|x| *x != 0.0));
            last.map_or(0, |k| k + 1)
        };
        Self { moving: shapes.interfaces.iter().map(moves).collect(), shapes: shapes.clone(), N, g, P }
    }
}

/// Configuration, velocity terms and workspace of one modal body.
#[derive(Clone, Debug)]
pub(crate) struct ModalData<T: Scalar = f64> {
    /// `η̇` from the last velocity pass.
    pub(crate) rates: Vec<T>,
    /// Rigid-body inertia in the current configuration: mass, (1) and (3).
    pub(crate) inertia: SpatialInertia<T>,
    /// (2), as [`symmetric`] parts.
    Q: Vec<T>,
    /// `Σ_l axial(N_kl) η_l`, then `Σ_l η̇_l g_lk`.
    g: Vec<T>,
    /// (4).
    pub(crate) C_r: Vec<Vector3<T>>,
    /// Generalised forces on the modal coordinates.
    pub(crate) f: Vec<T>,
    /// Wrench columns of the mass matrix, or `H_rη` of the articulated recursion.
    pub(crate) columns: Vec<Wrench<T>>,
    /// `H_ηη` and the storage of its factorisation.
    pub(crate) H: DMatrix<f64>,
    pub(crate) factor: Option<Cholesky<f64, Dyn>>,
    /// `H_ηη^-1 [H_ηr, τ - p]`, n×7.
    pub(crate) solved: DMatrix<f64>,
}

/// `y += A x`, four columns at a time, to load and store y once per four columns.
#[inline(always)]
fn add_product<T: Real>(A: &DMatrix<f64>, x: &[T], y: &mut [T]) {
    let rows = A.nrows();
    let (a, y) = (A.as_slice(), &mut y[..rows]);
    let mut fours = a.chunks_exact(4 * rows);
    let mut x = x.chunks_exact(4);
    for (a, x) in fours.by_ref().zip(x.by_ref()) {
        let (a0, rest) = a.split_at(rows);
        let (a1, rest) = rest.split_at(rows);
        let (a2, a3) = rest.split_at(rows);
        for ((((y, a0), a1), a2), a3) in y.iter_mut().zip(a0).zip(a1).zip(a2).zip(a3) {
            let (a0, a1, a2, a3) = (T::splat(*a0), T::splat(*a1), T::splat(*a2), T::splat(*a3));
            *y += (a0 * x[0] + a1 * x[1]) + (a2 * x[2] + a3 * x[3]);
        }
    }
    for (column, x) in fours.remainder().chunks_exact(rows).zip(x.remainder()) {
        for (y, a) in y.iter_mut().zip(column) {
            *y += T::splat(*a) * *x;
        }
    }
}

impl<T: Real> ModalData<T> {
    pub(crate) fn new(tables: &ModalTables) -> Self {
        let n = tables.shapes.n();
        Self {
            rates: vec![T::zero(); n],
            inertia: SpatialInertia::lift(&tables.shapes.undeformed()),
            Q: tables.P.iter().map(|x| T::splat(*x)).collect(),
            g: vec![T::zero(); 3 * n],
            C_r: tables.shapes.C_r.iter().map(lift).collect(),
            f: vec![T::zero(); n],
            columns: vec![Wrench::zeros(); n],
            H: DMatrix::zeros(n, n),
            factor: Cholesky::new(DMatrix::identity(n, n)),
            solved: DMatrix::zeros(n, 7),
        }
    }

    /// Computes (1) to (4) at coordinates `eta`.
    #[inline(always)]
    pub(crate) fn place(&mut self, tables: &ModalTables, eta: &[T]) {
        let shapes = &tables.shapes;
        // Symmetric part of (2), and Σ_l g_lk η_l of (4).
        for (q, p) in self.Q.iter_mut().zip(&tables.P) {
            *q = T::splat(*p);
        }
        tables.N.add_product(eta, &mut self.Q);
        self.g.fill(T::zero());
        tables.g.add_product(eta, &mut self.g);
        // Sums over the modes: (1), E of (3), and (4).
        let (mut h, mut E) = (lift::<T>(&shapes.first_moment), [T::zero(); 6]);
        let matrices = self.Q.chunks_exact(6).zip(tables.P.chunks_exact(6)).zip(self.g.chunks_exact(3));
        for ((k, &eta_k), ((Q, P), g)) in eta.iter().enumerate().zip(matrices) {
            h = add(&h, &scaled(&lift::<T>(&shapes.C_t[k]), eta_k));
            for ((e, p), q) in E.iter_mut().zip(P).zip(Q) {
                *e += (T::splat(*p) + *q) * eta_k;
            }
            self.C_r[k] = add(&lift::<T>(&shapes.C_r[k]), &Vector3::new(g[0], g[1], g[2]));
        }
        // tr(E) 1 - E, from the six numbers of E; off the diagonal, half of the stored sums.
        let half = T::splat(0.5);
        let ([x, y, z, ..], [.., xy, xz, yz]) = (E, E);
        let (xy, xz, yz) = (half * xy, half * xz, half * yz);
        let moved = Matrix3::new(y + z, -xy, -xz, -xy, x + z, -yz, -xz, -yz, x + y);
        let J = add3(&lift3::<T>(&shapes.inertia), &moved);
        self.inertia = SpatialInertia { mass: T::splat(shapes.mass), first_moment: h, rotational: J };
    }

    /// Velocity terms of (5), without spatial acceleration and `η̈`: returns `[F; T]`, sets `f`. Twist
    /// and wrench at the origin of the body frame, in its axes.
    #[inline(always)]
    pub(crate) fn bias(&mut self, tables: &ModalTables, V: &Twist<T>, rates: &[T]) -> Wrench<T> {
        let (w, v) = (V.angular, V.linear);
        self.rates.copy_from_slice(rates);
        self.g.fill(T::zero());
        tables.g.add_product(rates, &mut self.g);
        let shapes = &tables.shapes;
        let (mut W, mut c_t, mut c_r) = ([T::zero(); 6], Vector3::zeros(), Vector3::zeros());
        let two = T::splat(2.0);
        // ω × v is the difference between the acceleration of the origin and the spatial
        // acceleration.
        let wv = cross(&w, &v);
        // ωᵀ Q ω - tr(Q) ω·ω as a weighted sum over the entries of Q.
        let (xx, yy, zz) = (w.x * w.x, w.y * w.y, w.z * w.z);
        let weights = [-(yy + zz), -(xx + zz), -(xx + yy), w.x * w.y, w.x * w.z, w.y * w.z];
        let w2 = scaled(&w, two);
        let matrices = self.Q.chunks_exact(6).zip(self.g.chunks_exact(3));
        for ((k, &rate), (Q, g)) in rates.iter().enumerate().zip(matrices) {
            let C_t = lift::<T>(&shapes.C_t[k]);
            let mut f = dot(&C_t, &wv) + dot(&w2, &Vector3::new(g[0], g[1], g[2]));
            for ((W, q), weight) in W.iter_mut().zip(Q).zip(&weights) {
                *W += *q * rate;
                f += *q * *weight;
            }
            c_t = add(&c_t, &scaled(&C_t, rate));
            c_r = add(&c_r, &scaled(&self.C_r[k], rate));
            self.f[k] = f;
        }
        let SpatialInertia { mass, first_moment: h, rotational: J } = &self.inertia;
        // Force and moment rows of the velocity terms in (5), plus the acceleration ω × v.
        let turned = add(&scaled(&c_t, two), &cross(&w, h));
        let force = add(&scaled(&wv, *mass), &cross(&w, &turned));
        // 2 (tr W 1 - W) ω for the symmetric part of W; the skew part is included in C_r η̇.
        let [x, y, z, xy, xz, yz] = W;
        let rest = Vector3::new(
            two * (y + z) * w.x - xy * w.y - xz * w.z,
            two * (x + z) * w.y - xy * w.x - yz * w.z,
            two * (x + y) * w.z - xz * w.x - yz * w.y,
        );
        let torque = add(&add(&cross(h, &wv), &cross(&w, &add(&mul(J, &w), &c_r))), &rest);
        Wrench::new(force, torque)
    }

    /// Mass terms of (5) for spatial acceleration A and `η̈` (`None` for zero): adds to `f` and
    /// returns the wrench, both at the origin of the body frame, in its axes.
    #[inline(always)]
    pub(crate) fn inertia_forces(
        &mut self,
        tables: &ModalTables,
        A: &Twist<T>,
        accelerations: Option<&[T]>,
    ) -> Wrench<T> {
        let shapes = &tables.shapes;
        let mut F = self.inertia.mul_twist(A);
        for (k, f) in self.f.iter_mut().enumerate() {
            *f += dot(&lift(&shapes.C_t[k]), &A.linear) + dot(&self.C_r[k], &A.angular);
        }
        if let Some(accelerations) = accelerations {
            for (k, &a) in accelerations.iter().enumerate() {
                F.force = add(&F.force, &scaled(&lift::<T>(&shapes.C_t[k]), a));
                F.torque = add(&F.torque, &scaled(&self.C_r[k], a));
            }
            add_product(&shapes.M, accelerations, &mut self.f);
        }
        F
    }
}

impl ModalData {
    /// Kinetic energy (J) for the twist V of the body frame and the modal rates of the last
    /// velocity pass.
    pub(crate) fn kinetic_energy(&self, tables: &ModalTables, V: &Twist) -> f64 {
        let mut energy = 0.5 * V.power(&self.inertia.mul_twist(V));
        for (k, rate) in self.rates.iter().enumerate() {
            energy += rate * (tables.shapes.C_t[k].dot(&V.linear) + self.C_r[k].dot(&V.angular));
            let row: f64 = self.rates.iter().enumerate().map(|(l, r)| tables.shapes.M[(k, l)] * r).sum();
            energy += 0.5 * rate * row;
        }
        energy
    }

    /// Momentum about the origin of the body frame, in its axes (kg m/s, kg m²/s), for the same
    /// rates.
    pub(crate) fn momentum(&self, tables: &ModalTables, V: &Twist) -> Wrench {
        let mut p = self.inertia.mul_twist(V);
        for (k, rate) in self.rates.iter().enumerate() {
            p.force += tables.shapes.C_t[k] * *rate;
            p.torque += self.C_r[k] * *rate;
        }
        p
    }
}

impl InterfaceShape {
    /// Displacement and rotation vector for modal coordinates (or their rates).
    #[inline(always)]
    pub(crate) fn times<T: Real>(&self, eta: &[T]) -> (Vector3<T>, Vector3<T>) {
        let mut y = [T::zero(); 6];
        for (column, x) in self.Phi.as_slice().chunks_exact(6).zip(eta) {
            for (y, a) in y.iter_mut().zip(column) {
                *y += T::splat(*a) * *x;
            }
        }
        (Vector3::new(y[0], y[1], y[2]), Vector3::new(y[3], y[4], y[5]))
    }

    /// `f += Φᵀ [force; moment]`, at the origin of the interface, in axes of the body.
    #[inline(always)]
    pub(crate) fn add_transposed<T: Real>(&self, force: &Vector3<T>, moment: &Vector3<T>, f: &mut [T]) {
        for (column, f) in self.Phi.as_slice().chunks_exact(6).zip(f) {
            let (l, a) = (Vector3::new(column[0], column[1], column[2]), Vector3::new(column[3], column[4], column[5]));
            *f += dot(&lift(&l), force) + dot(&lift(&a), moment);
        }
    }

    /// Column k of the motion subspace in the child's axes, with its maps L (translation) and B
    /// (rotation).
    #[inline(always)]
    pub(crate) fn twist<T: Real>(&self, k: usize, L: &Matrix3<T>, B: &Matrix3<T>) -> Twist<T> {
        let c = &self.Phi.as_slice()[6 * k..6 * k + 6];
        let (l, a) = (Vector3::new(c[0], c[1], c[2]), Vector3::new(c[3], c[4], c[5]));
        Twist::new(mul(L, &lift(&l)), mul(B, &lift(&a)))
    }

    /// Adds `Sᵀ F` to `f` for all coordinates, F in the child's axes.
    #[inline(always)]
    pub(crate) fn project<T: Real>(&self, L: &Matrix3<T>, B: &Matrix3<T>, F: &Wrench<T>, f: &mut [T]) {
        self.add_transposed(&tr_mul(L, &F.force), &tr_mul(B, &F.torque), f);
    }
}
