//! Closed-form stiffness, compliance, consistent mass and partial mass of a straight uniform beam.
//!
//! Beam axes E: origin at the proximal end A, x along the beam to B, y and z along the principal
//! axes of the section. Displacements are ordered `u_x u_y u_z theta_x theta_y theta_z`, A before
//! B. The static matrices are exact for loads at the two ends, so one element is enough for any
//! length.
//!
//! Signs: `theta_z = dv/dx` for the deflection v along y, but `theta_y = -dw/dx` for the deflection
//! w along z.
//!
//! Not here: distributed loads, buckling, offsets between beam and joint ([`crate::BeamLink`]).

use flexarm_spatial::Matrix12;
use nalgebra::{Matrix3, Matrix4, Matrix6, SMatrix, Vector3, Vector4};
use serde::{Deserialize, Serialize};

use crate::error::{FemError, positive};
use crate::rigid_part::RigidPart;
use crate::section::Bar;

/// Beam theory: with or without shear deformation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BeamTheory {
    /// Without shear deformation; for slender beams.
    EulerBernoulli,
    /// With shear deformation `F l/(kGA)`.
    #[default]
    Timoshenko,
}

impl BeamTheory {
    /// Name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::EulerBernoulli => "euler-bernoulli",
            Self::Timoshenko => "timoshenko",
        }
    }
}

/// Straight uniform beam from A to B along x of its axes E; section at its centroid, principal axes
/// y and z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    bar: Bar,
    length: f64,
    /// `1/(kGA_y)` and `1/(kGA_z)`, 1/N; zero without shear.
    shear_y: f64,
    shear_z: f64,
}

/// One bending plane: xy with the deflection v and `theta_z`, or xz with w and `theta_y`.
struct Plane {
    /// Row numbers of the deflection and the rotation at A, then at B.
    rows: [usize; 4],
    /// `theta = sign * d(deflection)/dx`.
    sign: f64,
    EI: f64,
    /// Rotary inertia of the section per length, kg·m.
    rotary: f64,
    /// Ratio of shear to bending compliance, `12 EI/(kGA l²)`.
    phi: f64,
}

impl Beam {
    /// Creates a beam of the given length in m.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] for an invalid length or value of the bar; [`FemError::Missing`] if
    /// Timoshenko's theory lacks a shear stiffness.
    pub fn new(bar: Bar, theory: BeamTheory, length: f64) -> Result<Self, FemError> {
        bar.check()?;
        positive("beam length (m)", length)?;
        let shear = |kGA: Option<f64>, what| match (theory, kGA) {
            (BeamTheory::EulerBernoulli, _) => Ok(0.0),
            (BeamTheory::Timoshenko, Some(kGA)) => Ok(1.0 / kGA),
            (BeamTheory::Timoshenko, None) => {
                Err(FemError::Missing { what, help: "give it, or choose the theory \"euler-bernoulli\"" })
            }
        };
        Ok(Self {
            bar,
            length,
            shear_y: shear(bar.kGA_y, "the shear stiffness kGA_y of the section")?,
            shear_z: shear(bar.kGA_z, "the shear stiffness kGA_z of the section")?,
        })
    }

    /// Distance from A to B, m.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The two bending planes, xy and xz, with `φ = 12 EI/(kGA l²)` of each.
    fn planes(&self) -> [Plane; 2] {
        let l = self.length;
        let plane = |w: usize, theta: usize, sign, EI: f64, rotary, shear: f64| Plane {
            rows: [w, theta, w + 6, theta + 6],
            sign,
            EI,
            rotary,
            phi: 12.0 * EI * shear / (l * l),
        };
        let bar = &self.bar;
        [
            plane(1, 5, 1.0, bar.EI_z, bar.rotary_z, self.shear_y),
            plane(2, 4, -1.0, bar.EI_y, bar.rotary_y, self.shear_z),
        ]
    }

    /// Stiffness matrix of both ends, 12×12, beam axes.
    ///
    /// ```text
    /// F = K [u_A; u_B]
    /// ```
    /// Units N/m, N/rad; N·m/m, N·m/rad. Exactly symmetric; its null space is the six rigid
    /// motions.
    ///
    /// # Source
    /// Przemieniecki (1968), *Theory of Matrix Structural Analysis*, eq. (5.116).
    pub fn stiffness12(&self) -> Matrix12 {
        let l = self.length;
        let mut K = Matrix12::zeros();
        // Tension EA/l and torsion GJ/l.
        for (row, k) in [(0, self.bar.EA / l), (3, self.bar.GJ / l)] {
            K[(row, row)] = k;
            K[(row + 6, row + 6)] = k;
            K[(row, row + 6)] = -k;
            K[(row + 6, row)] = -k;
        }
        // Bending in each plane with shear: f = EI / (l³ (1 + φ)), φ = 12 EI / (kGA l²).
        for plane in self.planes() {
            let phi = plane.phi;
            let f = plane.EI / (l.powi(3) * (1.0 + phi));
            let near = (4.0 + phi) * l * l;
            let far = (2.0 - phi) * l * l;
            let k = f * Matrix4::new(
                12.0,
                6.0 * l,
                -12.0,
                6.0 * l, //
                6.0 * l,
                near,
                -6.0 * l,
                far, //
                -12.0,
                -6.0 * l,
                12.0,
                -6.0 * l, //
                6.0 * l,
                far,
                -6.0 * l,
                near,
            );
            plane.scatter(&k, &mut K);
        }
        K
    }

    /// Stiffness of the end B with A clamped: the distal block of [`Self::stiffness12`].
    ///
    /// ```text
    /// F_B = K_BB u_B,   K_BB = C_BB⁻¹
    /// ```
    /// Returns `K_BB`, 6×6 (N/m, N/rad; N·m/m, N·m/rad), at Bo, beam axes, exactly symmetric.
    pub fn tip_stiffness(&self) -> Matrix6<f64> {
        self.stiffness12().fixed_view::<6, 6>(6, 6).into_owned()
    }

    /// Compliance of the end B with A clamped, `u_B = C_BB F_B`.
    ///
    /// ```text
    /// stretch  F l/EA            bending by a force   F l³/(3EI) + F l/(kGA),   slope F l²/(2EI)
    /// twist    T l/GJ            bending by a moment  M l²/(2EI),               slope M l/EI
    /// ```
    /// Returns `C_BB`, 6×6 (m/N, m/(N·m); rad/N, rad/(N·m)), at Bo, beam axes, exactly symmetric.
    ///
    /// # Source
    /// Castigliano's theorem with the constant section forces of a load at B; [Przemieniecki 1968].
    pub fn tip_compliance(&self) -> Matrix6<f64> {
        let (bar, l) = (&self.bar, self.length);
        let mut C = Matrix6::zeros();
        C[(0, 0)] = l / bar.EA;
        C[(3, 3)] = l / bar.GJ;
        for (w, theta, sign, EI, shear) in [(1, 5, 1.0, bar.EI_z, self.shear_y), (2, 4, -1.0, bar.EI_y, self.shear_z)] {
            C[(w, w)] = l.powi(3) / (3.0 * EI) + l * shear;
            C[(theta, theta)] = l / EI;
            C[(w, theta)] = sign * l * l / (2.0 * EI);
            C[(theta, w)] = C[(w, theta)];
        }
        C
    }

    /// Consistent mass matrix of both ends, 12×12, beam axes, including the rotary inertia of the
    /// section.
    ///
    /// ```text
    /// M = ∫ (rho A Nᵀ N + rho I N_thetaᵀ N_theta) dx
    /// ```
    /// with the static shape functions of [`Self::stiffness12`]; units kg, kg·m; kg·m, kg·m². Exact
    /// for rigid motions; otherwise equal to the Guyan-reduced mass.
    ///
    /// Shape functions: Friedman & Kosmatka (1993), *Computers & Structures* 47(3).
    pub fn mass12(&self) -> Matrix12 {
        let l = self.length;
        let mut M = Matrix12::zeros();
        let polar = self.bar.rotary_y + self.bar.rotary_z;
        // Tension and torsion have linear shapes: m/3 at each end, m/6 between the ends.
        for (row, m) in [(0, self.bar.mass_per_length * l), (3, polar * l)] {
            M[(row, row)] = m / 3.0;
            M[(row + 6, row + 6)] = m / 3.0;
            M[(row, row + 6)] = m / 6.0;
            M[(row + 6, row)] = m / 6.0;
        }
        // Bending in each plane: translation and rotary inertia of the sections, by quadrature.
        for plane in self.planes() {
            let mut m = Matrix4::zeros();
            for (xi, weight) in gauss4() {
                let (N, N_theta) = plane.shapes(xi, l);
                m += weight
                    * l
                    * (self.bar.mass_per_length * N * N.transpose() + plane.rotary * N_theta * N_theta.transpose());
            }
            plane.scatter(&m, &mut M);
        }
        M
    }

    /// Section properties.
    pub(crate) fn bar(&self) -> &Bar {
        &self.bar
    }

    /// Motion of the section at `xi = x/l` per end displacement `[u_A; u_B]`, beam axes.
    ///
    /// Returns 3×12 matrices: `u` and `theta` of the section, and their derivatives by x.
    pub(crate) fn section_at(&self, xi: f64) -> SectionShapes {
        let l = self.length;
        let mut s = SectionShapes::default();
        for (row, target, slope) in [(0, &mut s.u, &mut s.du), (3, &mut s.theta, &mut s.dtheta)] {
            // Stretch and twist are linear in xi.
            (target[(0, row)], target[(0, row + 6)]) = (1.0 - xi, xi);
            (slope[(0, row)], slope[(0, row + 6)]) = (-1.0 / l, 1.0 / l);
        }
        for plane in self.planes() {
            let (N, N_theta) = plane.shapes(xi, l);
            let (dN, dN_theta) = plane.slopes(xi, l);
            let signs = [1.0, plane.sign, 1.0, plane.sign];
            // Deflection along y rotates the section about z, deflection along z rotates it about
            // y.
            let (along, about) = (plane.rows[0], plane.rows[1] - 3);
            for i in 0..4 {
                let column = plane.rows[i];
                s.u[(along, column)] = signs[i] * N[i];
                s.du[(along, column)] = signs[i] * dN[i];
                s.theta[(about, column)] = plane.sign * signs[i] * N_theta[i];
                s.dtheta[(about, column)] = plane.sign * signs[i] * dN_theta[i];
            }
        }
        s
    }

    /// Mass, centre of mass and inertia of the piece between two sections.
    ///
    /// ```text
    /// m = μ l,   I_xx = (μ_y + μ_z) l,   I_yy = m l²/12 + μ_y l,   I_zz = m l²/12 + μ_z l
    /// ```
    /// with the mass μ, the rotary inertias `μ_y`, `μ_z` of the section per length and the length l
    /// of the piece.
    ///
    /// * `from`, `to`: bounds of the piece as fractions of the length, from A.
    ///
    /// Returns mass (kg), centre of mass from A (m) and inertia about it (kg·m²), beam axes.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] unless `0 <= from < to <= 1`.
    pub fn piece(&self, from: f64, to: f64) -> Result<RigidPart, FemError> {
        let refuse = |what: &str, found, allowed: String| {
            let what = format!("{what} of a beam piece (fraction of the length)");
            Err(FemError::OutOfRange { what, found, allowed })
        };
        if !(0.0..1.0).contains(&from) {
            return refuse("start", from, "from 0 to below 1".into());
        }
        if !(to > from && to <= 1.0) {
            return refuse("end", to, format!("above {from} and up to 1"));
        }
        let bar = &self.bar;
        let l = (to - from) * self.length;
        let mass = bar.mass_per_length * l;
        let slender = mass * l * l / 12.0;
        let moments =
            Vector3::new((bar.rotary_y + bar.rotary_z) * l, slender + bar.rotary_y * l, slender + bar.rotary_z * l);
        Ok(RigidPart {
            mass,
            com: Vector3::new(0.5 * (from + to) * self.length, 0.0, 0.0),
            inertia: Matrix3::from_diagonal(&moments),
        })
    }
}

impl Plane {
    /// Adds a 4×4 matrix over (w, dw/dx) at A and B to the 12×12, with the sign of the rotations.
    fn scatter(&self, k: &Matrix4<f64>, K: &mut Matrix12) {
        let signs = [1.0, self.sign, 1.0, self.sign];
        for i in 0..4 {
            for j in 0..4 {
                K[(self.rows[i], self.rows[j])] += signs[i] * signs[j] * k[(i, j)];
            }
        }
    }

    /// Deflection N and rotation `N_theta` of the section at `xi = x/l` per (w_A, theta_A, w_B,
    /// theta_B), where theta is dw/dx without shear.
    ///
    /// Source: [Friedman & Kosmatka 1993], exact for end loads.
    fn shapes(&self, xi: f64, l: f64) -> (Vector4<f64>, Vector4<f64>) {
        let phi = self.phi;
        let (x2, x3) = (xi * xi, xi * xi * xi);
        let N = Vector4::new(
            2.0 * x3 - 3.0 * x2 - phi * xi + 1.0 + phi,
            l * (x3 - (2.0 + 0.5 * phi) * x2 + (1.0 + 0.5 * phi) * xi),
            -(2.0 * x3 - 3.0 * x2 - phi * xi),
            l * (x3 - (1.0 - 0.5 * phi) * x2 - 0.5 * phi * xi),
        );
        let N_theta = Vector4::new(
            6.0 * (x2 - xi) / l,
            3.0 * x2 - (4.0 + phi) * xi + 1.0 + phi,
            -6.0 * (x2 - xi) / l,
            3.0 * x2 - (2.0 - phi) * xi,
        );
        (N / (1.0 + phi), N_theta / (1.0 + phi))
    }

    /// Derivatives of [`Self::shapes`] with respect to x, 1/m.
    fn slopes(&self, xi: f64, l: f64) -> (Vector4<f64>, Vector4<f64>) {
        let phi = self.phi;
        let x2 = xi * xi;
        let dN = Vector4::new(
            (6.0 * x2 - 6.0 * xi - phi) / l,
            3.0 * x2 - (4.0 + phi) * xi + 1.0 + 0.5 * phi,
            -(6.0 * x2 - 6.0 * xi - phi) / l,
            3.0 * x2 - (2.0 - phi) * xi - 0.5 * phi,
        );
        let dN_theta = Vector4::new(
            6.0 * (2.0 * xi - 1.0) / (l * l),
            (6.0 * xi - 4.0 - phi) / l,
            -6.0 * (2.0 * xi - 1.0) / (l * l),
            (6.0 * xi - 2.0 + phi) / l,
        );
        (dN / (1.0 + phi), dN_theta / (1.0 + phi))
    }
}

/// Three rows over the twelve end displacements of a beam.
pub(crate) type Matrix3x12 = SMatrix<f64, 3, 12>;

/// Motion of one section per unit end displacement, beam axes.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SectionShapes {
    /// Displacement of the centre line.
    pub(crate) u: Matrix3x12,
    /// Derivative of `u` along the beam, 1/m.
    pub(crate) du: Matrix3x12,
    /// Rotation of the section.
    pub(crate) theta: Matrix3x12,
    /// Derivative of `theta` along the beam, 1/m.
    pub(crate) dtheta: Matrix3x12,
}

/// Four Gauss points on [0, 1] with their weights: exact to degree 7; the mass needs degree 6.
pub(crate) fn gauss4() -> [(f64, f64); 4] {
    let root = (6.0_f64 / 5.0).sqrt();
    let inner = (3.0 / 7.0 - 2.0 / 7.0 * root).sqrt();
    let outer = (3.0 / 7.0 + 2.0 / 7.0 * root).sqrt();
    let w_inner = (18.0 + 30.0_f64.sqrt()) / 72.0;
    let w_outer = (18.0 - 30.0_f64.sqrt()) / 72.0;
    [(-outer, w_outer), (-inner, w_inner), (inner, w_inner), (outer, w_outer)].map(|(x, w)| (0.5 * (1.0 + x), w))
}
