//! Statics at a pose: deflection under weight and a wrench at the TCP, and compliance there.

use std::collections::BTreeMap;

use flexarm_analysis::tcp_error;
use flexarm_kinematics::{forward_kinematics, frame_jacobian};
use nalgebra::{DVector, Matrix6xX};
use serde::Serialize;

use crate::arm::Arm;
use crate::caveat::{self, Caveat};
use crate::error::Error;
use crate::options::Modelling;
use crate::posed::{Posed, all_finite};
use crate::robot::Robot;
use crate::statics_picture::{self, StaticsFiles, StaticsOutputs};

/// Answer of `flexarm statics`. SI units; world axes, at the TCP; six-vectors linear first.
#[derive(Clone, Debug, Serialize)]
pub struct Statics {
    /// Name of the robot.
    pub robot: String,
    /// Joints that are held, in coordinate order.
    pub joints: Vec<String>,
    /// Positions at which they are held (rad or m).
    pub at: Vec<f64>,
    /// Link that carries the TCP.
    pub tcp: String,
    /// Force (N) and moment (N m) on the TCP, besides weight.
    pub wrench: [f64; 6],
    /// TCP of the rigid robot (m).
    pub tcp_position_m: [f64; 3],
    /// From the rigid TCP to the flexible one, under weight and wrench (m).
    pub tcp_displacement_m: [f64; 3],
    /// The same as a rotation vector (rad).
    pub tcp_rotation_rad: [f64; 3],
    /// The part of weight alone (m).
    pub sag_m: [f64; 3],
    /// The same as a rotation vector (rad).
    pub sag_rad: [f64; 3],
    /// Displacement of the TCP per wrench at the equilibrium, drives locked, 6×6 (m/N, rad/N; m/(N
    /// m), rad/(N m)).
    pub compliance: Vec<Vec<f64>>,
    /// Forces with which the drives hold the pose (N m or N).
    pub holding_torque: Vec<f64>,
    /// Torques of motors that move several joints, behind their gears: `Cᵀ` times the holding
    /// torques of these (N m or N).
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub motor_torque: BTreeMap<String, f64>,
    /// Flexible elements.
    pub elements: Vec<ElementStatics>,
    /// Unbalanced force over the largest force.
    pub residual: f64,
    /// Written files.
    pub files: StaticsFiles,
    /// Warnings among the caveats, as sentences.
    pub warnings: Vec<String>,
    /// Doubts about the input and limits of the result.
    pub caveats: Vec<Caveat>,
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
    /// Displacement of the TCP that it causes by itself, to first order (m).
    pub tcp_displacement_m: [f64; 3],
    /// Rotation of the TCP that it causes by itself (rad).
    pub tcp_rotation_rad: [f64; 3],
    /// Energy in it (J).
    pub energy_j: f64,
}

/// Equilibrium of the flexible robot at a pose under its weight and a wrench at the TCP, drives
/// locked.
///
/// `at`: all actuated joints (rad or m), zero without it; `wrench` in world axes, constant while
/// the arm deflects.
///
/// # Errors
/// [`Error::Pose`] for joint values that do not fit, [`Error::Step`] where there is no equilibrium.
pub fn statics(robot: &Robot, modelling: &Modelling, at: Option<&[f64]>, wrench: [f64; 6]) -> Result<Statics, Error> {
    statics_of(robot, modelling, at, wrench, None)
}

/// As [`statics()`], and writes the answer and a picture of the arm, its deflections magnified
/// beside the rigid arm.
///
/// # Errors
/// As [`statics()`]; [`Error::File`] and [`Error::Write`] for files.
pub fn record_statics(
    robot: &Robot,
    modelling: &Modelling,
    at: Option<&[f64]>,
    wrench: [f64; 6],
    outputs: &StaticsOutputs,
) -> Result<Statics, Error> {
    statics_of(robot, modelling, at, wrench, Some(outputs))
}

fn statics_of(
    robot: &Robot,
    modelling: &Modelling,
    at: Option<&[f64]>,
    wrench: [f64; 6],
    outputs: Option<&StaticsOutputs>,
) -> Result<Statics, Error> {
    let paths = outputs.map(statics_picture::places).transpose()?;
    statics_at(robot, Posed::new(robot, modelling, at)?, wrench, paths)
}

impl Arm {
    /// As [`statics()`], of an arm whose links and drives are in place.
    ///
    /// # Errors
    /// As [`statics()`].
    pub fn statics(&self, at: Option<&[f64]>, wrench: [f64; 6]) -> Result<Statics, Error> {
        statics_at(self.robot(), Posed::on(self, at)?, wrench, None)
    }
}

fn statics_at(
    robot: &Robot,
    posed: Posed,
    wrench: [f64; 6],
    paths: Option<[std::path::PathBuf; 2]>,
) -> Result<Statics, Error> {
    let X_rigid = posed.rigid_tool();
    let loaded = posed.linear(&wrench.into())?;
    // The figures of a map at this pose, to the last bit.
    let sag = tcp_error(&X_rigid, &posed.operating_point(&[0.0; 6])?.tcp_pose());
    let mut at = posed.operating_point(&wrench)?;
    let displacement = tcp_error(&X_rigid, &at.tcp_pose());
    let C = at.compliance();

    all_finite("the displacements", displacement.iter().chain(&sag))?;
    all_finite("the compliances", &C)?;
    all_finite("the holding torques", &loaded.holding)?;

    // To first order each element's share is its deflection by the Jacobian of the rigid pose.
    let model = &posed.arm.model;
    let (mut data, state) = posed.undeformed();
    forward_kinematics(model, &mut data, &state.q);
    let mut J = Matrix6xX::zeros(model.nv());
    frame_jacobian(model, &data, &posed.tool, &mut J);
    let ne = model.n_elastic();
    let J = J.columns(model.nv() - ne, ne);
    let (springs, energies) = posed.arm.springs_at_rest(&loaded.q);
    let mut elements = Vec::new();
    for ((name, range), energy_j) in loaded.elements.iter().zip(energies) {
        let (first, n) = (range.start, range.len());
        let deflection: DVector<f64> = loaded.equilibrium.rows(first, n).into_owned();
        // The tangent is not enough for a nonlinear spring.
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
    let caveats = posed.caveats_of(robot, &loaded, &wrench);
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
        motor_torque: robot.motor_torques(&posed.arm, loaded.holding.as_slice()),
        holding_torque: loaded.holding.as_slice().to_vec(),
        elements,
        residual: loaded.residual,
        files: StaticsFiles::default(),
        warnings: caveat::warnings(&caveats),
        caveats,
        joints: posed.joints.clone(),
        at: posed.at.clone(),
    };
    if let Some(paths) = paths {
        statics_picture::save(&mut statics, paths, robot, &posed, &loaded)?;
    }
    Ok(statics)
}
