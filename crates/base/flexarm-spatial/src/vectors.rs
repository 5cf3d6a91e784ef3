//! Spatial vectors and inertias as pairs of 3-vectors: linear part first, angular part second.
//!
//! Frames: A, B any two frames; `X_AB` is the pose of B in A. A twist consists of the velocity of a
//! frame's origin and its angular velocity; a wrench of the force through that origin and the
//! moment about it. Start at [`Twist`] and [`adjoint`]. Not here: joints, trees.
//!
//! Source: [Featherstone 2008], chapter 2, with linear and angular parts exchanged.

use nalgebra::{IsometryMatrix3, Matrix3, Matrix6, Rotation3, Scalar, Vector3, Vector6};
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use crate::products::{add, add3, cross, cross3, dot, lift, lift3, mul, mul3, scaled, sub, tr_mul, turn_symmetric};
use crate::real::Real;

/// Pose `X_AB` of frame B in frame A, as rotation matrix and translation (m). `p_A = X_AB * p_B`.
pub type Pose<T = f64> = IsometryMatrix3<T>;

/// Composition of poses, `X_AC = X_AB X_BC`.
///
/// ```text
/// R_AC = R_AB R_BC,   p_AoCo_A = p_AoBo_A + R_AB p_BoCo_B
/// ```
/// Translations in m. The rotation is not made orthonormal again.
#[inline(always)]
pub fn composed(X_AB: &Pose, X_BC: &Pose) -> Pose {
    let R = X_AB.rotation.matrix();
    let p = add(&X_AB.translation.vector, &mul(R, &X_BC.translation.vector));
    Pose::from_parts(p.into(), Rotation3::from_matrix_unchecked(mul3(R, X_BC.rotation.matrix())))
}

/// Velocity (or acceleration) of a frame: linear part of its origin (m/s), angular part (rad/s).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Twist<T: Scalar = f64> {
    /// Velocity of the origin.
    pub linear: Vector3<T>,
    /// Angular velocity.
    pub angular: Vector3<T>,
}

/// Force (N) through a frame's origin and moment (N m) about it.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Wrench<T: Scalar = f64> {
    /// Force.
    pub force: Vector3<T>,
    /// Moment about the origin.
    pub torque: Vector3<T>,
}

macro_rules! pair_algebra {
    ($type:ident, $first:ident, $second:ident) => {
        impl<T: Real> $type<T> {
            /// Creates it from its linear and its angular part, same point and axes.
            #[inline(always)]
            pub fn new($first: Vector3<T>, $second: Vector3<T>) -> Self {
                Self { $first, $second }
            }
            /// All six components zero.
            #[inline(always)]
            pub fn zeros() -> Self {
                Self { $first: Vector3::zeros(), $second: Vector3::zeros() }
            }
            /// Converts to a 6-vector, linear part first.
            #[inline(always)]
            pub fn to_vector(&self) -> Vector6<T> {
                let (a, b) = (&self.$first, &self.$second);
                Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
            }
            /// Converts from a 6-vector, linear part first.
            #[inline(always)]
            pub fn from_vector(v: &Vector6<T>) -> Self {
                Self { $first: Vector3::new(v[0], v[1], v[2]), $second: Vector3::new(v[3], v[4], v[5]) }
            }
        }
        impl<T: Real> Add for $type<T> {
            type Output = Self;
            #[inline(always)]
            fn add(self, o: Self) -> Self {
                Self { $first: add(&self.$first, &o.$first), $second: add(&self.$second, &o.$second) }
            }
        }
        impl<T: Real> Sub for $type<T> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, o: Self) -> Self {
                Self { $first: sub(&self.$first, &o.$first), $second: sub(&self.$second, &o.$second) }
            }
        }
        impl<T: Real> Neg for $type<T> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self { $first: -self.$first, $second: -self.$second }
            }
        }
        impl<T: Real> Mul<T> for $type<T> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, s: T) -> Self {
                Self { $first: scaled(&self.$first, s), $second: scaled(&self.$second, s) }
            }
        }
        impl<T: Real> AddAssign for $type<T> {
            #[inline(always)]
            fn add_assign(&mut self, o: Self) {
                *self = *self + o;
            }
        }
        impl<T: Real> SubAssign for $type<T> {
            #[inline(always)]
            fn sub_assign(&mut self, o: Self) {
                *self = *self - o;
            }
        }
    };
}
pair_algebra!(Twist, linear, angular);
pair_algebra!(Wrench, force, torque);

impl<T: Real> Twist<T> {
    /// Power `V_Aᵀ F_A` of a wrench on a body that moves with this twist, W.
    ///
    /// * `F`: at the same point and in the same axes as the twist. The power does not depend on
    ///   them.
    #[inline(always)]
    pub fn power(&self, F: &Wrench<T>) -> T {
        dot(&self.linear, &F.force) + dot(&self.angular, &F.torque)
    }

    /// Motion cross product `V × U`: time derivative of a twist `U` that is fixed to a body moving
    /// with `V`.
    ///
    /// ```text
    /// V × U = [w × u + v × α; w × α]      V = [v; w],   U = [u; α]
    /// ```
    /// * `U`: at the same point and in the same axes as V.
    ///
    /// Returns a twist at that point, in these axes, units of `U` per s.
    ///
    /// # Source
    /// [Featherstone 2008], section 2.9, with the linear part first.
    #[inline(always)]
    pub fn cross(&self, U: &Twist<T>) -> Twist<T> {
        let (v, w) = (&self.linear, &self.angular);
        Twist::new(add(&cross(w, &U.linear), &cross(v, &U.angular)), cross(w, &U.angular))
    }

    /// Force cross product `V ×* F`: time derivative of a wrench (or momentum) `F` that is fixed to
    /// a body moving with `V`.
    ///
    /// ```text
    /// V ×* F = [w × f; w × t + v × f]      V = [v; w],   F = [f; t]
    /// ```
    /// * `F`: at the same point and in the same axes as V.
    ///
    /// Returns a wrench at that point, in these axes, units of `F` per s.
    ///
    /// # Source
    /// [Featherstone 2008], section 2.9, with the linear part first.
    #[inline(always)]
    pub fn cross_force(&self, F: &Wrench<T>) -> Wrench<T> {
        let (v, w) = (&self.linear, &self.angular);
        Wrench::new(cross(w, &F.force), add(&cross(w, &F.torque), &cross(v, &F.force)))
    }

    /// Twist `V_B = Ad_BA V_A` of the same body, from Ao, A axes to Bo, B axes.
    ///
    /// ```text
    /// v_B = R_ABᵀ (v_A + w_A × p_AoBo_A),   w_B = R_ABᵀ w_A
    /// ```
    /// * `X_AB`: pose of B in A, m; both frames are fixed to the body.
    #[inline(always)]
    pub fn at_child(&self, X_AB: &Pose<T>) -> Twist<T> {
        let R = X_AB.rotation.matrix();
        let p = &X_AB.translation.vector;
        Twist::new(tr_mul(R, &add(&self.linear, &cross(&self.angular, p))), tr_mul(R, &self.angular))
    }

    /// Twist `V_A = Ad_AB V_B` of the same body, from Bo, B axes to Ao, A axes: the inverse of
    /// [`Twist::at_child`] for the same `X_AB`.
    #[inline(always)]
    pub fn at_parent(&self, X_AB: &Pose<T>) -> Twist<T> {
        let R = X_AB.rotation.matrix();
        let angular = mul(R, &self.angular);
        Twist::new(add(&mul(R, &self.linear), &cross(&X_AB.translation.vector, &angular)), angular)
    }
}

impl<T: Real> Wrench<T> {
    /// Wrench `F_A = Ad_BAᵀ F_B` that is statically equivalent, from Bo, B axes to Ao, A axes.
    ///
    /// ```text
    /// f_A = R_AB f_B,   t_A = R_AB t_B + p_AoBo_A × f_A
    /// ```
    /// * `X_AB`: pose of B in A, m.
    #[inline(always)]
    pub fn at_parent(&self, X_AB: &Pose<T>) -> Wrench<T> {
        let R = X_AB.rotation.matrix();
        let force = mul(R, &self.force);
        Wrench::new(force, add(&mul(R, &self.torque), &cross(&X_AB.translation.vector, &force)))
    }

    /// Wrench `F_B = Ad_ABᵀ F_A` that is statically equivalent, from Ao, A axes to Bo, B axes: the
    /// inverse of [`Wrench::at_parent`] for the same `X_AB`.
    #[inline(always)]
    pub fn at_child(&self, X_AB: &Pose<T>) -> Wrench<T> {
        let R = X_AB.rotation.matrix();
        let p = &X_AB.translation.vector;
        Wrench::new(tr_mul(R, &self.force), tr_mul(R, &sub(&self.torque, &cross(p, &self.force))))
    }
}

/// Skew matrix `[r]x` with `[r]x b = r × b`, in the unit and axes of r.
///
/// ```text
///         [  0   -z    y ]
/// [r]x =  [  z    0   -x ]
///         [ -y    x    0 ]
/// ```
#[inline(always)]
pub fn skew<T: Real>(r: &Vector3<T>) -> Matrix3<T> {
    let zero = T::zero();
    Matrix3::new(zero, -r.z, r.y, r.z, zero, -r.x, -r.y, r.x, zero)
}

/// Twist map `Ad_AB`, 6×6, linear part first, from Bo, B axes to Ao, A axes.
///
/// ```text
/// Ad_AB = [ R_AB   [p]x R_AB ]      V_A = Ad_AB V_B,   F_B = Ad_ABᵀ F_A,   p = p_AoBo_A
///         [  0       R_AB    ]
/// ```
/// * `X_AB`: pose of B in A, m; both frames are fixed to the same body.
pub fn adjoint(X_AB: &Pose) -> Matrix6<f64> {
    let R = X_AB.rotation.matrix();
    let mut Ad = Matrix6::zeros();
    Ad.fixed_view_mut::<3, 3>(0, 0).copy_from(R);
    Ad.fixed_view_mut::<3, 3>(3, 3).copy_from(R);
    Ad.fixed_view_mut::<3, 3>(0, 3).copy_from(&(skew(&X_AB.translation.vector) * R));
    Ad
}

/// Spatial inertia `M_BBo_B` of a rigid body about Bo, in B axes, given by ten parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpatialInertia<T: Scalar = f64> {
    /// Mass m (kg).
    pub mass: T,
    /// First moment `m p_BoBcm_B` (kg m).
    pub first_moment: Vector3<T>,
    /// Rotational inertia about Bo (not the centre of mass) (kg m²).
    pub rotational: Matrix3<T>,
}

impl SpatialInertia {
    /// Zero inertia.
    pub fn zeros() -> Self {
        Self { mass: 0.0, first_moment: Vector3::zeros(), rotational: Matrix3::zeros() }
    }

    /// Creates it from the mass properties of a body.
    ///
    /// ```text
    /// h = m c,   I = I_cm - m [c]x²      c = p_BoBcm_B
    /// ```
    /// * `mass`: kg.
    /// * `com`: `p_BoBcm_B`, m.
    /// * `inertia_com`: `I_cm` about the centre of mass, in B axes, kg·m².
    pub fn from_com(mass: f64, com: &Vector3<f64>, inertia_com: &Matrix3<f64>) -> Self {
        let c = skew(com);
        Self { mass, first_moment: com * mass, rotational: inertia_com - c * c * mass }
    }

    /// Centre of mass `p_BoBcm_B = h/m` (m); zero for a massless body.
    pub fn com(&self) -> Vector3<f64> {
        if self.mass == 0.0 { Vector3::zeros() } else { self.first_moment / self.mass }
    }

    /// Inertia about the centre of mass, in B axes: `I + m [c]x²`, `c = p_BoBcm_B` (kg m²).
    pub fn inertia_com(&self) -> Matrix3<f64> {
        let c = skew(&self.com());
        self.rotational + c * c * self.mass
    }

    /// Converts to the 6×6 matrix about Bo, in B axes, linear part first.
    ///
    /// ```text
    /// M_BBo_B = [ m 1   -[h]x ]      h = m p_BoBcm_B,   units kg, kg·m; kg·m, kg·m²
    ///           [ [h]x    I   ]
    /// ```
    pub fn to_matrix(&self) -> Matrix6<f64> {
        let h = skew(&self.first_moment);
        let mut M = Matrix6::zeros();
        M.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(self.mass);
        M.fixed_view_mut::<3, 3>(0, 3).copy_from(&-h);
        M.fixed_view_mut::<3, 3>(3, 0).copy_from(&h);
        M.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.rotational);
        M
    }
}

impl<T: Real> SpatialInertia<T> {
    /// Momentum `M V` (kg m/s, kg m²/s), or `M A` (N, N m), at Bo, in B axes.
    ///
    /// ```text
    /// M V = [m v - h × w; h × v + I w],   h = m p_BoBcm_B
    /// ```
    /// * `V`: twist or spatial acceleration of the body at Bo, in B axes.
    #[inline(always)]
    pub fn mul_twist(&self, V: &Twist<T>) -> Wrench<T> {
        let h = &self.first_moment;
        Wrench::new(
            sub(&scaled(&V.linear, self.mass), &cross(h, &V.angular)),
            add(&cross(h, &V.linear), &mul(&self.rotational, &V.angular)),
        )
    }

    /// Inertia of the same body about Ao in A axes, `Ad_BAᵀ M_BBo_B Ad_BA`.
    ///
    /// * `X_AB`: pose of B in A, m.
    #[inline(always)]
    pub fn at_parent(&self, X_AB: &Pose<T>) -> SpatialInertia<T> {
        self.turned(X_AB.rotation.matrix()).shifted(&X_AB.translation.vector)
    }

    /// Inertia of the same body about the same point, from B axes to A axes.
    ///
    /// * `R`: `R_AB`.
    #[inline(always)]
    pub fn turned(&self, R: &Matrix3<T>) -> SpatialInertia<T> {
        let Self { mass, first_moment, rotational } = self;
        SpatialInertia { mass: *mass, first_moment: mul(R, first_moment), rotational: turn_symmetric(R, rotational) }
    }

    /// Inertia of the same body about another point Ao, in the same axes.
    ///
    /// ```text
    /// h_A = h + m p,   I_A = I + (2 p·h + m p·p) 1 - (p hᵀ + h pᵀ + m p pᵀ)
    /// ```
    /// * `p`: `p_AoBo` from the new point to the present one, in the axes of the inertia, m.
    #[inline(always)]
    pub fn shifted(&self, p: &Vector3<T>) -> SpatialInertia<T> {
        let h = &self.first_moment;
        let (half, two) = (T::splat(0.5), T::splat(2.0));
        // With k = h + m p/2 the change of I is 2 p·k 1 - (p kᵀ + k pᵀ).
        let k = add(h, &scaled(p, self.mass * half));
        let (x, y, z) = (p.x * two * k.x, p.y * two * k.y, p.z * two * k.z);
        let (xy, xz, yz) = (p.x * k.y + k.x * p.y, p.x * k.z + k.x * p.z, p.y * k.z + k.y * p.z);
        let moved = Matrix3::new(y + z, -xy, -xz, -xy, x + z, -yz, -xz, -yz, x + y);
        SpatialInertia {
            mass: self.mass,
            first_moment: add(h, &scaled(p, self.mass)),
            rotational: add3(&self.rotational, &moved),
        }
    }

    /// Converts a constant inertia to the scalar type of a recursion.
    #[inline(always)]
    pub fn lift(constant: &SpatialInertia) -> Self {
        let SpatialInertia { mass, first_moment, rotational } = constant;
        Self { mass: T::splat(*mass), first_moment: lift(first_moment), rotational: lift3(rotational) }
    }
}

impl<T: Real> AddAssign for SpatialInertia<T> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        self.mass += o.mass;
        self.first_moment = add(&self.first_moment, &o.first_moment);
        self.rotational = add3(&self.rotational, &o.rotational);
    }
}

/// Articulated-body inertia at Bo, in B axes: symmetric 6×6 matrix `[[A, B], [Bᵀ, C]]` stored as
/// three blocks, linear part first.
#[derive(Clone, Copy, Debug)]
pub struct ArticulatedInertia {
    /// Linear-linear block.
    pub linear: Matrix3<f64>,
    /// Linear-angular block.
    pub coupling: Matrix3<f64>,
    /// Angular-angular block.
    pub angular: Matrix3<f64>,
}

impl ArticulatedInertia {
    /// Articulated inertia of a single rigid body: `M_BBo_B` as three blocks.
    #[inline(always)]
    pub fn from_rigid(M: &SpatialInertia) -> Self {
        Self { linear: Matrix3::from_diagonal_element(M.mass), coupling: -skew(&M.first_moment), angular: M.rotational }
    }

    /// Product `[A v + B w; Bᵀ v + C w]` with a twist or acceleration `[v; w]` at Bo, in B axes.
    ///
    /// Returns a wrench (or momentum) at Bo, in B axes.
    #[inline(always)]
    pub fn mul_twist(&self, V: &Twist) -> Wrench {
        Wrench::new(
            mul(&self.linear, &V.linear) + mul(&self.coupling, &V.angular),
            tr_mul(&self.coupling, &V.linear) + mul(&self.angular, &V.angular),
        )
    }

    /// Subtracts `s F Fᵀ`: releases a joint axis.
    ///
    /// * `F`: `I S` of the axis S, at Bo, in B axes.
    /// * `s`: `1/(Sᵀ I S)`; then S moves freely: `(I - s F Fᵀ) S = 0`.
    ///
    /// # Source
    /// [Featherstone 2008], Table 7.1, for one joint coordinate.
    #[inline(always)]
    pub fn rank_one_update(&mut self, F: &Wrench, s: f64) {
        let (f, t) = (F.force * s, F.torque * s);
        let outer = |a: &Vector3<f64>, b: &Vector3<f64>| Matrix3::from_columns(&[a * b.x, a * b.y, a * b.z]);
        self.linear -= outer(&f, &F.force);
        self.coupling -= outer(&f, &F.torque);
        self.angular -= outer(&t, &F.torque);
    }

    /// Articulated inertia about Ao in A axes, `Ad_BAᵀ I Ad_BA`.
    ///
    /// ```text
    /// A' = R A Rᵀ,   B' = R B Rᵀ - A' [p]x      R = R_AB,   p = p_AoBo_A
    /// C' = R C Rᵀ + [p]x B' - (R B Rᵀ)ᵀ [p]x
    /// ```
    /// * `X_AB`: pose of B in A, m.
    #[inline(always)]
    pub fn at_parent(&self, X_AB: &Pose) -> Self {
        let R = X_AB.rotation.matrix();
        let p = &X_AB.translation.vector;
        let linear = turn_symmetric(R, &self.linear);
        let rotated = mul3(&mul3(R, &self.coupling), &R.transpose());
        // A [p]x = -([p]x A)ᵀ for symmetric A
        let coupling = rotated + cross3(p, &linear).transpose();
        // Bᵀ [p]x = -([p]x B)ᵀ
        let angular = turn_symmetric(R, &self.angular) + cross3(p, &coupling) + cross3(p, &rotated).transpose();
        Self { linear, coupling, angular }
    }

    /// Converts to a 6×6 matrix, linear part first.
    #[inline]
    pub fn to_matrix(&self) -> Matrix6<f64> {
        let mut M = Matrix6::zeros();
        M.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.linear);
        M.fixed_view_mut::<3, 3>(0, 3).copy_from(&self.coupling);
        M.fixed_view_mut::<3, 3>(3, 0).copy_from(&self.coupling.transpose());
        M.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.angular);
        M
    }
}

impl AddAssign for ArticulatedInertia {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        self.linear += o.linear;
        self.coupling += o.coupling;
        self.angular += o.angular;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{Translation3, vector};

    fn pose() -> Pose {
        Pose::from_parts(Translation3::new(0.3, -0.7, 0.5), Rotation3::from_euler_angles(0.4, -1.1, 2.0))
    }
    fn inertia() -> SpatialInertia {
        let J = Matrix3::new(2.0, 0.1, -0.2, 0.1, 1.7, 0.05, -0.2, 0.05, 1.2);
        SpatialInertia::from_com(3.5, &vector![0.2, -0.1, 0.4], &J)
    }
    fn twist() -> Twist {
        Twist::new(vector![0.1, -0.4, 0.9], vector![1.2, 0.3, -0.7])
    }

    /// Truth: the 6×6 adjoint and congruence; measured 4e-16.
    #[test]
    fn pair_operations_equal_the_six_by_six_matrices() {
        let (X, M, V) = (pose(), inertia(), twist());
        let Ad = adjoint(&X);
        assert_relative_eq!(V.at_parent(&X).to_vector(), Ad * V.to_vector(), epsilon = 1e-13);
        assert_relative_eq!(V.at_parent(&X).at_child(&X).to_vector(), V.to_vector(), epsilon = 1e-13);
        let F = M.mul_twist(&V);
        assert_relative_eq!(F.to_vector(), M.to_matrix() * V.to_vector(), epsilon = 1e-13);
        let Ad_inv = adjoint(&X.inverse());
        assert_relative_eq!(F.at_parent(&X).to_vector(), Ad_inv.transpose() * F.to_vector(), epsilon = 1e-13);
        assert_relative_eq!(F.at_parent(&X).at_child(&X).to_vector(), F.to_vector(), epsilon = 1e-13);
        let congruent = Ad_inv.transpose() * M.to_matrix() * Ad_inv;
        assert_relative_eq!(M.at_parent(&X).to_matrix(), congruent, epsilon = 1e-13);
        let articulated = ArticulatedInertia::from_rigid(&M).at_parent(&X).to_matrix();
        assert_relative_eq!(articulated, congruent, epsilon = 1e-13);
        assert_relative_eq!(M.inertia_com()[(0, 0)], 2.0, epsilon = 1e-13);
        assert_relative_eq!(composed(&X, &X).to_homogeneous(), (X * X).to_homogeneous(), epsilon = 1e-13);
    }

    /// Power does not depend on the reference point and axes; measured 2e-16.
    #[test]
    fn power_does_not_depend_on_the_frame() {
        let (X, V) = (pose(), twist());
        let F = inertia().mul_twist(&twist());
        let here = V.power(&F);
        assert_relative_eq!(V.at_parent(&X).power(&F.at_parent(&X)), here, epsilon = 1e-13);
        // The two cross products are adjoint: (V × U)ᵀ F = -Uᵀ (V ×* F).
        let U = Twist::new(vector![0.3, 0.2, -0.1], vector![-0.5, 0.6, 0.1]);
        assert_relative_eq!(V.cross(&U).power(&F), -U.power(&V.cross_force(&F)), epsilon = 1e-13);
    }

    /// Truth: velocity of a point of a rigid body, `v_B = v_A + w × p_AB`, in rotated axes.
    #[test]
    fn adjoint_carries_a_rigid_displacement() {
        let R_BA = Rotation3::from_euler_angles(0.3, -0.8, 1.9);
        let p_BA = Vector3::new(0.2, -0.5, 0.7);
        let u_A = Vector6::new(0.1, -0.2, 0.3, 0.4, 0.5, -0.6);
        let (v_A, w_A) = (u_A.fixed_rows::<3>(0), u_A.fixed_rows::<3>(3));

        let u_B = adjoint(&Pose::from_parts(Translation3::from(p_BA), R_BA)) * u_A;

        let v_B = R_BA * v_A + (R_BA * w_A).cross(&-p_BA);
        assert!((u_B.fixed_rows::<3>(0) - v_B).norm() < 1e-14); // measured 1e-16
        assert!((u_B.fixed_rows::<3>(3) - R_BA * w_A).norm() < 1e-15);
    }
}
