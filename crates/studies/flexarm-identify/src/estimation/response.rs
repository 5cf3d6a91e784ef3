//! Frequency responses of an arm with locked drives, and their derivatives with respect to its
//! parameters.
//!
//! ```text
//! H(ω) = (iω)^s cᵀ Z^-1 b,     Z = K + iωD - ω²M
//! dH   = (iω)^s [ dcᵀ Z^-1 b + cᵀ Z^-1 db - (Z^-T c)ᵀ dZ Z^-1 b ]
//! ```
//! with b and c the Jacobians of the excited and the measured point along their directions, at the
//! equilibrium under gravity, drives locked. Modal damping depends on the mode shapes; its
//! derivative contains theirs,
//!
//! ```text
//! dφ_j = Σ_i a_ij φ_i,   a_ij = φ_iᵀ(dK - ω_j² dM)φ_j / (ω_j² - ω_i²),   a_jj = -φ_jᵀ dM φ_j / 2
//! ```
//! Start at [`structure_slopes`]. Not here: stiffness, mass and their derivatives
//! ([`super::sensitivity`]).

use flexarm_kinematics::{Frame, Wrench};
use flexarm_stepping::{Damping, ElasticElement, Plant, StepError, Tangents};
use nalgebra::{Complex, DMatrix, DVector, RowDVector, Vector3};

use crate::estimation::parameter::{Effect, NominalArm, Parameter, entry_slope, slope_of};
use crate::estimation::sensitivity::{FRAME_STEP, Linearised, frames_beside, linearised};

/// Relative distance between squared frequencies below which the shapes of the two modes are not
/// determined.
const SAME_FREQUENCY: f64 = 1e-9;

/// Point of the arm and direction of a force or an accelerometer.
#[derive(Clone, Debug)]
pub struct Probe {
    /// Origin of a frame on a body.
    pub frame: Frame,
    /// Unit vector in world axes.
    pub direction: Vector3<f64>,
}

impl PartialEq for Probe {
    /// Compares point and direction; ignores the name of the frame.
    fn eq(&self, other: &Self) -> bool {
        let place = |probe: &Self| (probe.frame.body, probe.frame.X_BF, probe.direction);
        place(self) == place(other)
    }
}

/// Measured quantity of the response per newton.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Answer {
    /// Displacement (m/N).
    Receptance,
    /// Velocity (m/s/N).
    Mobility,
    /// Acceleration (m/s²/N).
    #[default]
    Accelerance,
}

impl Answer {
    /// Returns `(iω)^s`.
    pub fn factor(self, omega: f64) -> Complex<f64> {
        match self {
            Self::Receptance => Complex::new(1.0, 0.0),
            Self::Mobility => Complex::new(0.0, omega),
            Self::Accelerance => Complex::new(-omega * omega, 0.0),
        }
    }

    /// Returns the unit of the magnitude.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Receptance => "m/N",
            Self::Mobility => "m/(s N)",
            Self::Accelerance => "m/(s2 N)",
        }
    }
}

/// An arm with locked drives, linearised about its equilibrium; n elastic coordinates.
#[derive(Clone, Debug)]
pub struct Structure {
    /// Mass matrix, n×n.
    pub M: DMatrix<f64>,
    /// Damping matrix, n×n.
    pub D: DMatrix<f64>,
    /// Stiffness matrix including the derivative of gravity forces, n×n.
    pub K: DMatrix<f64>,
    /// Displacement of each probe along its direction per elastic coordinate.
    pub rows: Vec<RowDVector<f64>>,
}

/// A structure and its derivatives with respect to the parameters' coordinates.
#[derive(Clone, Debug)]
pub struct StructureSlopes {
    /// Structure with the present parameters.
    pub structure: Structure,
    /// Derivatives, one per parameter.
    pub slopes: Vec<Structure>,
    /// Squares of the natural frequencies, ascending (rad²/s²).
    pub omega2: Vec<f64>,
    /// Mode shapes with `φᵀ M φ = 1`, one column each.
    pub shapes: DMatrix<f64>,
}

/// Linearises an arm held at a pose under gravity, and computes its derivatives with respect to the
/// parameters.
///
/// * `nominal`: arm with the present parameters.
/// * `q`: actuated joints (rad or m).
/// * `probes`: excited and measured points.
///
/// Explicit derivatives are exact. Those due to the change of the equilibrium are central
/// differences of fourth order along its path. Where two natural frequencies coincide, modal
/// damping that differs between elements is not differentiable.
///
/// # Errors
/// As `OperatingPoint::solve`; [`StepError::Singular`] if a coordinate has no mass.
pub fn structure_slopes(
    nominal: &NominalArm,
    parameters: &[Parameter],
    q: &[f64],
    probes: &[Probe],
) -> Result<StructureSlopes, StepError> {
    let plant = nominal.locked(q)?;
    let as_matrix = |row: RowDVector<f64>| DMatrix::from_row_slice(1, row.len(), row.as_slice());
    let jacobians = |q: &DVector<f64>| rows(&plant, probes, q).into_iter().map(as_matrix).collect();
    let found = linearised(nominal, &plant, parameters, q, jacobians)?;
    let Linearised { q, here, omega2, shapes, slopes: changes } = found;
    let damped = Damped { plant: &plant, M: &here.M, omega2: &omega2, shapes: &shapes };
    let mut slopes = Vec::with_capacity(parameters.len());
    for (parameter, change) in parameters.iter().zip(changes) {
        let mut change = change.into_iter();
        let (K, M) = (change.next().unwrap_or_default(), change.next().unwrap_or_default());
        let D = damped.slope(&parameter.effect, &K, &M);
        let mut rows: Vec<RowDVector<f64>> = change.map(|row| RowDVector::from_row_slice(row.as_slice())).collect();
        // A displaced joint frame moves the probes with all coordinates locked.
        if let Effect::Frame { body, twist, .. } = &parameter.effect {
            let [ahead, behind] = frames_beside(&plant, *body, twist).map(|plant| self::rows(&plant, probes, &q));
            for ((row, up), down) in rows.iter_mut().zip(ahead).zip(behind) {
                *row += (up - down) / (2.0 * FRAME_STEP);
            }
        }
        slopes.push(Structure { M, D, K, rows });
    }
    let structure = Structure { M: here.M, D: plant.D.clone(), K: here.K, rows: rows(&plant, probes, &q) };
    Ok(StructureSlopes { structure, slopes, omega2, shapes })
}

/// Computes the Jacobian of each probe along its direction.
fn rows(plant: &Plant, probes: &[Probe], q: &DVector<f64>) -> Vec<RowDVector<f64>> {
    let row = |probe: &Probe| {
        let J = Tangents::at(plant, &probe.frame, &Wrench::zeros(), q).J;
        RowDVector::from_fn(J.ncols(), |_, j| (0..3).map(|c| probe.direction[c] * J[(c, j)]).sum())
    };
    probes.iter().map(row).collect()
}

/// Data for the derivative of the damping matrix.
pub(crate) struct Damped<'a> {
    pub(crate) plant: &'a Plant,
    pub(crate) M: &'a DMatrix<f64>,
    pub(crate) omega2: &'a [f64],
    pub(crate) shapes: &'a DMatrix<f64>,
}

/// Stiffness and damping of a spring, and their derivatives with respect to a parameter.
struct SpringSlope {
    first: usize,
    size: usize,
    K: DMatrix<f64>,
    dK: DMatrix<f64>,
    damping: Damping,
    /// Relative change of the damping coefficients per unit of the parameter.
    more: f64,
    /// Index of the damper that changes, if only one does.
    damper: Option<usize>,
}

impl Damped<'_> {
    /// Computes the derivative of the damping matrix, given those of stiffness and mass.
    pub(crate) fn slope(&self, effect: &Effect, dK: &DMatrix<f64>, dM: &DMatrix<f64>) -> DMatrix<f64> {
        let springs = self.springs(effect);
        let n = dK.nrows();
        let mut dD = DMatrix::zeros(n, n);
        if springs.iter().any(|spring| matches!(spring.damping, Damping::Modal(zeta) if zeta != 0.0)) {
            self.add_modal(&springs, dK, dM, &mut dD);
        }
        for s in &springs {
            let (k, size) = (s.first, s.size);
            let mut block = dD.view_mut((k, k), (size, size));
            let (M, dM) = (self.M.view((k, k), (size, size)), dM.view((k, k), (size, size)));
            match s.damping {
                Damping::Modal(_) => {}
                Damping::StiffnessProportional(b) => block += (&s.dK + &s.K * s.more) * b,
                Damping::Rayleigh(a, b) => {
                    block += (&s.dK + &s.K * s.more) * b;
                    block += (dM + M * s.more) * a;
                }
                Damping::Dampers(d) => (0..size.min(6)).for_each(|c| {
                    block[(c, c)] += d[c] * if s.damper == Some(c) { 1.0 } else { s.more };
                }),
            }
        }
        // With coupled gears, each motor's damper contributes to the damping of several joints.
        let one;
        let dampers = match effect {
            Effect::Damping(dampers) => &dampers[..],
            Effect::Damper { spring, .. } => {
                one = [*spring];
                &one
            }
            _ => return dD,
        };
        for (places, coupled) in dampers.iter().filter_map(|spring| self.plant.coupled_damping_slope(*spring)) {
            for (a, i) in places.iter().enumerate() {
                places.iter().enumerate().for_each(|(b, j)| dD[(*i, *j)] += coupled[(a, b)]);
            }
        }
        dD
    }

    /// Returns the springs with their derivatives with respect to a parameter.
    fn springs(&self, effect: &Effect) -> Vec<SpringSlope> {
        let element_change = |(number, e): (usize, &ElasticElement)| {
            let mut dK = DMatrix::zeros(e.size, e.size);
            let (mut more, mut damper) = (0.0, None);
            match effect {
                Effect::Stiffness(places) => {
                    for place in places {
                        // With coupled gears, each motor's spring contributes to the stiffness of
                        // several joints.
                        match self.plant.coupled_stiffness_slope(place.spring) {
                            Some((coupled, slope)) => {
                                let own = coupled.iter().position(|k| *k == self.plant.offset(e));
                                dK.iter_mut().for_each(|dK| *dK += own.map_or(0.0, |k| slope[(k, k)]));
                            }
                            None if place.spring == number => dK += slope_of(&e.K, place.coordinate),
                            None => {}
                        }
                    }
                }
                Effect::Entry { spring, row, column, factor, .. } if *spring == number => {
                    dK += entry_slope(e.size, *row, *column, *factor);
                }
                Effect::Damping(springs) => {
                    let own = springs.contains(&number) && self.plant.coupled_damping_slope(number).is_none();
                    more = f64::from(u8::from(own));
                }
                Effect::Damper { spring, coordinate } => {
                    let own = *spring == number && self.plant.coupled_damping_slope(number).is_none();
                    damper = own.then_some(*coordinate);
                }
                _ => {}
            }
            let first = self.plant.offset(e);
            SpringSlope { first, size: e.size, K: e.K.clone(), dK, damping: e.damping, more, damper }
        };
        self.plant.elements.iter().enumerate().map(element_change).collect()
    }

    /// Adds the derivative of `D = Σ 2 ζ_j ω_j Mφ_j (Mφ_j)ᵀ`, where ζ_j is the mean over the
    /// springs weighted by strain energy:
    ///
    /// ```text
    /// ζ_j = Σ ζ_s φᵀK_sφ / Σ φᵀK_sφ,   dω_j = φᵀ(dK - ω² dM)φ / 2ω,   c = 2ζω,   v = Mφ
    /// dD  = Σ_j dc v vᵀ + c (dv vᵀ + v dvᵀ)
    /// ```
    fn add_modal(&self, springs: &[SpringSlope], dK: &DMatrix<f64>, dM: &DMatrix<f64>, dD: &mut DMatrix<f64>) {
        let (S, T) = (self.shapes.tr_mul(&(dK * self.shapes)), self.shapes.tr_mul(&(dM * self.shapes)));
        let n = self.omega2.len();
        for j in 0..n {
            let w2 = self.omega2[j];
            let phi = self.shapes.column(j).into_owned();
            let dphi = self.shapes * shape_parts(self.omega2, j, &S, &T);
            let omega = w2.sqrt();
            let domega = (S[(j, j)] - w2 * T[(j, j)]) / (2.0 * omega);
            // Strain energies, total and weighted by damping ratio.
            let [mut total, mut dtotal, mut lost, mut dlost] = [0.0; 4];
            for s in springs {
                let (x, dx) = (phi.rows(s.first, s.size), dphi.rows(s.first, s.size));
                let energy = x.dot(&(&s.K * x));
                let denergy = 2.0 * dx.dot(&(&s.K * x)) + x.dot(&(&s.dK * x));
                (total, dtotal) = (total + energy, dtotal + denergy);
                if let Damping::Modal(zeta) = s.damping {
                    lost += zeta * energy;
                    dlost += zeta * (denergy + s.more * energy);
                }
            }
            let zeta = lost / total;
            let dzeta = (dlost - zeta * dtotal) / total;
            let (c, dc) = (2.0 * zeta * omega, 2.0 * (dzeta * omega + zeta * domega));
            let v = self.M * &phi;
            let dv = dM * &phi + self.M * &dphi;
            dD.ger(dc, &v, &v, 1.0);
            dD.ger(c, &dv, &v, 1.0);
            dD.ger(c, &v, &dv, 1.0);
        }
    }
}

impl StructureSlopes {
    /// Computes the derivatives of a mode's shape (`mode` from 0, the lowest) with respect to each
    /// parameter's coordinate, at unit modal mass.
    pub fn shape_slopes(&self, mode: usize) -> Vec<DVector<f64>> {
        let shape_change = |change: &Structure| {
            let (S, T) =
                (self.shapes.tr_mul(&(&change.K * &self.shapes)), self.shapes.tr_mul(&(&change.M * &self.shapes)));
            &self.shapes * shape_parts(&self.omega2, mode, &S, &T)
        };
        self.slopes.iter().map(shape_change).collect()
    }
}

/// Coefficients `a_ij` of the modes in the derivative of mode j, from the derivatives of stiffness
/// and mass in modal coordinates.
fn shape_parts(omega2: &[f64], j: usize, S: &DMatrix<f64>, T: &DMatrix<f64>) -> DVector<f64> {
    let w2 = omega2[j];
    DVector::from_fn(omega2.len(), |i, _| match w2 - omega2[i] {
        _ if i == j => -0.5 * T[(j, j)],
        apart if apart.abs() <= SAME_FREQUENCY * w2 => 0.0,
        apart => (0.5 * (S[(i, j)] + S[(j, i)]) - w2 * T[(i, j)]) / apart,
    })
}

/// Response of one probe to a force at another, per frequency, and its derivatives.
#[derive(Clone, Debug)]
pub struct ResponseSlopes {
    /// Values, one per frequency.
    pub values: Vec<Complex<f64>>,
    /// Derivatives: a row per frequency, a column per parameter.
    pub slopes: DMatrix<Complex<f64>>,
}

impl StructureSlopes {
    /// Computes `H(ω)` of the probe `watched` per newton at the probe `hit` (indices of the probes)
    /// at `omega` (rad/s), and its derivatives with respect to the parameters.
    ///
    /// Cost per frequency: two factorisations of an n×n complex matrix, one without parameters.
    ///
    /// # Errors
    /// [`StepError::Singular`] at an undamped resonance.
    pub fn response(
        &self,
        watched: usize,
        hit: usize,
        answer: Answer,
        omega: &[f64],
    ) -> Result<ResponseSlopes, StepError> {
        let s = &self.structure;
        let complex = |row: &RowDVector<f64>| row.transpose().map(|x| Complex::new(x, 0.0));
        let (b, c) = (complex(&s.rows[hit]), complex(&s.rows[watched]));
        let mut found = ResponseSlopes {
            values: Vec::with_capacity(omega.len()),
            slopes: DMatrix::zeros(omega.len(), self.slopes.len()),
        };
        for (k, w) in omega.iter().enumerate() {
            // Z u = b, H = factor cᵀ u
            let Z = dynamic(s, *w);
            let singular = || StepError::Singular { matrix: "dynamic stiffness (a resonance without damping)", t: 0.0 };
            let u = Z.clone().lu().solve(&b).ok_or_else(singular)?;
            let factor = answer.factor(*w);
            found.values.push(factor * c.dot(&u));
            if self.slopes.is_empty() {
                continue;
            }
            // Zᵀ y = c serves all parameters: dH = factor (dcᵀ u + yᵀ db - yᵀ dZ u).
            let y = Z.transpose().lu().solve(&c).ok_or_else(singular)?;
            for (p, slope) in self.slopes.iter().enumerate() {
                let (db, dc) = (complex(&slope.rows[hit]), complex(&slope.rows[watched]));
                found.slopes[(k, p)] = factor * (dc.dot(&u) + y.dot(&db) - y.dot(&(dynamic(slope, *w) * &u)));
            }
        }
        Ok(found)
    }
}

/// Returns the dynamic stiffness `K + iωD - ω²M`.
fn dynamic(s: &Structure, omega: f64) -> DMatrix<Complex<f64>> {
    let square = omega * omega;
    DMatrix::from_fn(s.K.nrows(), s.K.ncols(), |i, j| {
        Complex::new(s.K[(i, j)] - square * s.M[(i, j)], omega * s.D[(i, j)])
    })
}
