//! Statics at a pose: static deflection under gravity and a wrench at the TCP, and the compliance
//! there.
//!
//! Start at [`Arm::statics`]. Not here: the equilibrium (`flexarm-stepping`), its picture
//! (`statics_picture`), maps of many poses (`flexarm-map`).

use std::collections::BTreeMap;
use std::sync::Arc;

use flexarm_analysis::tcp_error;
use flexarm_kinematics::{forward_kinematics, frame_jacobian};
use flexarm_stepping::Linear;
use nalgebra::{DVector, Matrix6xX};
use serde::Serialize;

use crate::arm::Arm;
use crate::caveat::{self, Finding, validity};
use crate::error::Error;
use crate::poses::posed::{Posed, all_finite};
use crate::poses::statics_picture::{self, StaticsFiles, StaticsOutputs};
use crate::run::monitor::stress::stress_at_rest;
use crate::run::summary::LinkStressFigures;

/// Result of `flexarm statics`. SI units; world axes, at the TCP; six-vectors linear first.
#[derive(Clone, Debug, Serialize)]
pub struct Statics {
    /// Name of the robot.
    pub robot: String,
    /// Held joints, in coordinate order.
    pub joints: Vec<String>,
    /// Positions at which they are held (rad or m).
    pub at: Vec<f64>,
    /// Link that carries the TCP.
    pub tcp: String,
    /// Force (N) and moment (N m) on the TCP, in addition to gravity.
    pub wrench: [f64; 6],
    /// TCP position of the rigid robot (m).
    pub tcp_position_m: [f64; 3],
    /// Displacement of the flexible TCP from the rigid one, under gravity and wrench (m).
    pub tcp_displacement_m: [f64; 3],
    /// Rotation of the flexible TCP from the rigid one, as a rotation vector (rad).
    pub tcp_rotation_rad: [f64; 3],
    /// Displacement under gravity only (m).
    pub sag_m: [f64; 3],
    /// Rotation under gravity only, as a rotation vector (rad).
    pub sag_rad: [f64; 3],
    /// Compliance of the TCP at the equilibrium with the drives locked, 6×6 (m/N, rad/N; m/(N m),
    /// rad/(N m)).
    pub compliance: Vec<Vec<f64>>,
    /// Torques or forces with which the drives hold the pose (N m or N).
    pub holding_torque: Vec<f64>,
    /// Torques of motors that move several joints, after their gears: `Cᵀ` times the holding
    /// torques of these joints (N m or N).
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub motor_torque: BTreeMap<String, f64>,
    /// Elastic elements.
    pub elements: Vec<ElementStatics>,
    /// Stress of the links whose stress fields are stored.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stress: Vec<LinkStressFigures>,
    /// Residual force relative to the largest force.
    pub residual: f64,
    /// Written files.
    pub files: StaticsFiles,
    /// Warnings among the caveats, as sentences.
    pub warnings: Vec<String>,
    /// Probable errors in the input, and limits of the result's validity.
    pub caveats: Vec<Finding>,
}

/// An elastic element at the equilibrium.
#[derive(Clone, Debug, Serialize)]
pub struct ElementStatics {
    /// Name of the link.
    pub name: String,
    /// Elastic coordinates (m, rad), in the axes of the proximal part.
    pub deflection: Vec<f64>,
    /// Load of its spring (N, N m).
    pub load: Vec<f64>,
    /// TCP displacement caused by this element alone, to first order (m).
    pub tcp_displacement_m: [f64; 3],
    /// TCP rotation caused by this element alone (rad).
    pub tcp_rotation_rad: [f64; 3],
    /// Elastic energy (J).
    pub energy_j: f64,
}

impl Arm {
    /// Returns the equilibrium at a pose under gravity and a wrench at the TCP, with the drives
    /// locked.
    ///
    /// * `at`: values of all actuated joints (rad or m), [`crate::Robot::start_pose`] by default.
    /// * `wrench`: force and moment at the TCP in world axes (N, N m), not rotating with the
    ///   deflection.
    ///
    /// # Errors
    /// [`Error::Pose`] for joint values that do not fit, [`Error::Step`] if there is no
    /// equilibrium.
    pub fn statics(self: &Arc<Self>, at: Option<&[f64]>, wrench: [f64; 6]) -> Result<Statics, Error> {
        statics_at(self.resting(at)?, wrench, None)
    }

    /// As [`Arm::statics`], and writes the result and a picture of the arm with magnified
    /// deflections next to the rigid arm.
    ///
    /// # Errors
    /// As [`Arm::statics`]; [`Error::File`] and [`Error::Write`] for files.
    pub fn record_statics(
        self: &Arc<Self>,
        at: Option<&[f64]>,
        wrench: [f64; 6],
        outputs: &StaticsOutputs,
    ) -> Result<Statics, Error> {
        statics_at(self.resting(at)?, wrench, Some(statics_picture::places(outputs)?))
    }
}

/// Computes the figures; writes them to `paths` if given.
fn statics_at(posed: Posed, wrench: [f64; 6], paths: Option<[std::path::PathBuf; 2]>) -> Result<Statics, Error> {
    let robot = posed.arm.robot();
    let X_rigid = posed.rigid_tool();
    let loaded = posed.linear(&wrench.into())?;
    // Identical bit for bit to the figures of a map at this pose.
    let sag = tcp_error(&X_rigid, &posed.operating_point(&[0.0; 6])?.tcp_pose());
    let mut at = posed.operating_point(&wrench)?;
    let displacement = tcp_error(&X_rigid, &at.tcp_pose());
    let C = at.compliance();

    all_finite("the displacements", displacement.iter().chain(&sag))?;
    all_finite("the compliances", &C)?;
    all_finite("the holding torques", &loaded.holding)?;

    let elements = element_statics(&posed, &loaded);
    let stress = stress_at_rest(&posed.arm, &posed.plant, &loaded.q)?;
    let mut caveats = posed.caveats_of(&loaded, &wrench);
    caveats.extend(validity::stress(&stress));
    let [x, y, z, rx, ry, rz] = displacement;
    let [sx, sy, sz, srx, sry, srz] = sag;
    let mut statics = Statics {
        robot: robot.name.clone(),
        tcp: robot.tcp.0.clone(),
        wrench,
        tcp_position_m: X_rigid.translation.vector.into(),
        tcp_displacement_m: [x, y, z],
        tcp_rotation_rad: [rx, ry, rz],
        sag_m: [sx, sy, sz],
        sag_rad: [srx, sry, srz],
        compliance: C.row_iter().map(|row| row.iter().copied().collect()).collect(),
        motor_torque: robot.motor_torques(&posed.plant, loaded.holding.as_slice()),
        holding_torque: loaded.holding.as_slice().to_vec(),
        elements,
        stress,
        residual: loaded.residual,
        files: StaticsFiles::default(),
        warnings: caveat::warnings(&caveats),
        caveats,
        joints: posed.joints.clone(),
        at: posed.at.clone(),
    };
    if let Some(paths) = paths {
        statics_picture::save(&mut statics, paths, &posed, &loaded)?;
    }
    Ok(statics)
}

/// Computes the deflection and load of each elastic element, and its contribution to that of the
/// tool.
fn element_statics(posed: &Posed, loaded: &Linear) -> Vec<ElementStatics> {
    // To first order each element's contribution is its deflection times the Jacobian at the rigid
    // pose.
    let model = &posed.plant.model;
    let (mut data, state) = posed.undeformed();
    forward_kinematics(model, &mut data, &state.q);
    let mut J = Matrix6xX::zeros(model.nv());
    frame_jacobian(model, &data, &posed.tool, &mut J);
    let ne = model.n_elastic();
    let J = J.columns(model.nv() - ne, ne);
    let (springs, energies) = posed.plant.springs_at_rest(&loaded.q);
    let mut elements = Vec::new();
    for ((name, range), energy_j) in loaded.elements.iter().zip(energies) {
        let (first, n) = (range.start, range.len());
        let deflection: DVector<f64> = loaded.equilibrium.rows(first, n).into_owned();
        // For a nonlinear spring the tangent stiffness is not sufficient.
        let load = springs.rows(first - loaded.driven, n);
        let moved = J.columns(first - loaded.driven, n) * &deflection;
        elements.push(ElementStatics {
            name: name.clone(),
            energy_j,
            tcp_displacement_m: [moved[0], moved[1], moved[2]],
            tcp_rotation_rad: [moved[3], moved[4], moved[5]],
            load: load.iter().copied().collect(),
            deflection: deflection.as_slice().to_vec(),
        });
    }
    elements
}
