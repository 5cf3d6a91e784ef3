//! Stress of a link that is one beam, from its section forces.
//!
//! The section force at a plane across the beam balances all that is beyond it: the wrench at B and
//! the inertia of the rigid parts. A part that the plane cuts is spread evenly over its length, so
//! that each whole part has its own mass, centre of mass and inertia.
//!
//! ```text
//! F(x) = Ad_BXᵀ F_B + Σ F_part(beyond x),     σ(x, y, z) from F(x)      X: the section at x
//! ```
//! The places are points on the outline of the section at planes along the beam. What the section
//! forces do not contain is not there: stress concentration at joints, warping, local bending.
//!
//! Start at [`BeamLink::stress_fields`]. x along the beam from E, m; wrenches in link axes. Not
//! here: the outline (`section_outline`), meshes (`fields`).

use nalgebra::{DMatrix, Matrix3, Point3, Vector3, Vector6};

use super::fields::{INERTIA_LOADS, SectionForces, StressFields, StressSite};
use super::map::part_load;
use crate::beam_link::BeamLink;
use crate::error::{FemError, positive};
use crate::reduced::ElasticSplit;
use crate::rigid_part::RigidPart;
use crate::section_outline::OutlinePoint;

/// Number of pieces of equal length between the planes.
const PIECES: usize = 20;

/// Part of a link, spread along the beam.
struct SpreadPart<'a> {
    part: &'a RigidPart,
    /// Length along the beam, m.
    length: f64,
    /// Start along the beam, m.
    start: f64,
}

impl BeamLink {
    /// Returns the stress at points on the outline of the section, at planes along the beam.
    ///
    /// * `joints`, `parts`: of the lumped model whose motion causes the stress, proximal first, one
    ///   more part than joints; link axes.
    ///
    /// Returns the stress (Pa per unit load) in link axes, and the section forces in beam axes.
    ///
    /// # Errors
    /// As [`BeamLink::reduce`]; [`FemError::Missing`] for a section that is given by its stiffness,
    /// [`FemError::OutOfRange`] for a beam whose ends are in the order from B to A.
    pub fn stress_fields(&self, joints: &[ElasticSplit], parts: &[RigidPart]) -> Result<StressFields, FemError> {
        // Geometry of the beam and its section.
        let axis = self.X_LE.rotation.matrix().column(0).into_owned();
        let advance = axis.dot(&(self.X_LB.translation.vector - self.X_LA.translation.vector));
        positive("advance of the beam from A to B (m)", advance)?;
        let outline = self.section.outline(self.material.nu)?;
        let own = self.section.properties(self.material.nu)?;
        let R_LE = *self.X_LE.rotation.matrix();
        let K_BB = self.tip_stiffness()?;
        let C_BB = K_BB.try_inverse().ok_or(FemError::Missing {
            what: "the compliance of the beam",
            help: "its stiffness is singular in rounding: check its dimensions",
        })?;
        // Section forces F(x) at each plane, in beam axes; from them the stress at each point.
        let spread = self.spread(joints, parts);
        let columns = 6 + INERTIA_LOADS;
        let count = outline.len();
        let mut stress = DMatrix::zeros(6 * count * (PIECES + 1), columns);
        let mut sites = Vec::with_capacity(count * (PIECES + 1));
        let x: Vec<f64> = (0..=PIECES).map(|plane| self.length * plane as f64 / PIECES as f64).collect();
        let mut forces = DMatrix::zeros(6 * x.len(), columns);
        for (plane, &x) in x.iter().enumerate() {
            let section: Vec<Vector6<f64>> = self.section_forces(x, &spread).iter().map(|F| turned(&R_LE, F)).collect();
            for (j, F) in section.iter().enumerate() {
                forces.fixed_view_mut::<6, 1>(6 * plane, j).copy_from(&F.cast::<f32>());
            }
            for point in &outline {
                let first = 6 * sites.len();
                let position = self.X_LE * Point3::new(x, point.y, point.z);
                sites.push(StressSite {
                    node: sites.len() as u64 + 1,
                    position: position.coords,
                    material: 0,
                    from_tie: f64::INFINITY,
                });
                // σ_L = R_LE [σ_x τ; τ 0] R_LEᵀ: normal stress along x, shear stress along the
                // outline.
                for (j, F) in section.iter().enumerate() {
                    let [normal, shear] = stress_at(point, [own.A, own.I_y, own.I_z], F);
                    let [t_y, t_z] = point.tangent.map(|t| shear * t);
                    let sigma_E = Matrix3::new(normal, t_y, t_z, t_y, 0.0, 0.0, t_z, 0.0, 0.0);
                    let s = R_LE * sigma_E * R_LE.transpose();
                    let six = [s[(0, 0)], s[(1, 1)], s[(2, 2)], s[(0, 1)], s[(1, 2)], s[(2, 0)]];
                    (0..6).for_each(|c| stress[(first + c, j)] = six[c] as f32);
                }
            }
        }
        Ok(StressFields {
            link: self.name.clone(),
            interfaces: vec!["A".into(), "B".into()],
            poses: vec![self.X_LA, self.X_LB],
            compliance: DMatrix::from_column_slice(6, 6, C_BB.as_slice()),
            frequencies_hz: Vec::new(),
            materials: vec![self.material],
            triangles: surface(&sites, count),
            sites,
            stress,
            section_forces: Some(SectionForces { x, forces }),
        })
    }

    /// Spreads the parts along the beam: each over the distance between the joints beside it.
    fn spread<'a>(&self, joints: &[ElasticSplit], parts: &'a [RigidPart]) -> Vec<SpreadPart<'a>> {
        let along = |p: &Vector3<f64>| self.X_LE.inverse_transform_point(&(*p).into()).x;
        let inner = joints.iter().map(|joint| joint.X_LS.translation.vector);
        let mut ends = vec![along(&self.X_LA.translation.vector)];
        ends.extend(inner.map(|p| along(&p)));
        ends.push(along(&self.X_LB.translation.vector));
        let spread = |(part, ends): (&'a RigidPart, &[f64])| {
            let length = (ends[1] - ends[0]).abs();
            SpreadPart { part, length, start: along(&part.com) - 0.5 * length }
        };
        parts.iter().zip(ends.windows(2)).map(spread).collect()
    }

    /// Section forces at x along the beam: force and moment about the axis of the beam there, in
    /// link axes, on the side of A; one column per wrench component at B and inertia load.
    fn section_forces(&self, x: f64, parts: &[SpreadPart<'_>]) -> Vec<Vector6<f64>> {
        // X: the section at x, with its origin on the axis of the beam.
        let p_LX = (self.X_LE * Point3::new(x, 0.0, 0.0)).coords;
        let axis = self.X_LE.rotation.matrix().column(0).into_owned();
        let p_XB = self.X_LB.translation.vector - p_LX;
        let of_wrench = (0..6).map(|c| {
            let unit = Vector6::ith(c, 1.0);
            let moment = unit.fixed_rows::<3>(3) + p_XB.cross(&unit.fixed_rows::<3>(0));
            joined(&unit.fixed_rows::<3>(0).into_owned(), &moment)
        });
        let beyond: Vec<RigidPart> = parts.iter().filter_map(|part| part.beyond(x, &axis)).collect();
        let of_inertia = (0..INERTIA_LOADS).map(|j| beyond.iter().map(|part| part_load(part, j, &p_LX)).sum());
        of_wrench.chain(of_inertia).collect()
    }
}

impl SpreadPart<'_> {
    /// Returns what is beyond a plane at x along the beam; `axis`: direction of the beam, link
    /// axes.
    fn beyond(&self, x: f64, axis: &Vector3<f64>) -> Option<RigidPart> {
        let Self { part, length, start } = self;
        let end = start + length;
        if x >= end {
            return None;
        }
        let share = ((end - x) / length).min(1.0);
        // Inertia of a bar across its axis per mass and squared length.
        let bar = (Matrix3::identity() - axis * axis.transpose()) / 12.0;
        let mass = share * part.mass;
        let across = part.inertia - bar * (part.mass * length * length);
        Some(RigidPart {
            mass,
            com: part.com + axis * (0.5 * length * (1.0 - share)),
            inertia: across * share + bar * (mass * (share * length).powi(2)),
        })
    }
}

/// Normal stress along x and shear stress along the outline (Pa) at a point of it.
///
/// ```text
/// σ = N/A + M_y z/I_y - M_z y/I_z,   τ = T torsion + V_y shear_y + V_z shear_z
/// ```
/// * `A`, `I_y`, `I_z`: area (m²) and second moments (m⁴) of the section.
/// * `F`: section force `[N V_y V_z T M_y M_z]` on its axis, beam axes.
fn stress_at(point: &OutlinePoint, [A, I_y, I_z]: [f64; 3], F: &Vector6<f64>) -> [f64; 2] {
    let normal = F[0] / A + F[4] * point.z / I_y - F[5] * point.y / I_z;
    [normal, F[3] * point.torsion + F[1] * point.shear_y + F[2] * point.shear_z]
}

/// Triangles between the outlines at neighbouring planes; none between two points at one place.
fn surface(sites: &[StressSite], count: usize) -> Vec<[u32; 3]> {
    let quads = (0..PIECES).flat_map(|plane| (0..count).map(move |k| (plane * count, k)));
    let triangles = quads.filter_map(|(first, k)| {
        let [a, b] = [first + k, first + (k + 1) % count];
        let is_wide = (sites[a].position - sites[b].position).norm() > 0.0;
        let [a, b, c, d] = [a, b, b + count, a + count].map(|site| site as u32);
        is_wide.then_some([[a, b, c], [a, c, d]])
    });
    triangles.flatten().collect()
}

/// Wrench `[f; t]`.
fn joined(force: &Vector3<f64>, moment: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
}

/// Returns a wrench, given in link axes, in beam axes at the same point.
fn turned(R_LE: &Matrix3<f64>, F: &Vector6<f64>) -> Vector6<f64> {
    joined(&(R_LE.transpose() * F.fixed_rows::<3>(0)), &(R_LE.transpose() * F.fixed_rows::<3>(3)))
}
