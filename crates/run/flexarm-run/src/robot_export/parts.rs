//! The tree of an arm as bodies with one-coordinate joints.
//!
//! An elastic joint of six coordinates becomes three slides and three hinges in Z-Y-X order, exact for
//! those angles and to first order for rotation vectors. B is a body, P its parent, V a mesh; axes,
//! anchors and inertias are in body axes (m, kg m²). Start at [`parts`]. Not here: the text of the
//! formats (`mjcf.rs`, `urdf.rs`), the springs over the joints (`springs.rs`).

use std::path::PathBuf;

use flexarm_kinematics::{AxisMotion, Body, JointMotion, Pose};
use nalgebra::{Matrix3, Vector3};

use crate::error::Error;
use crate::poses::posed::Posed;
use crate::robot::Robot;

/// Minimum moment of inertia that MuJoCo takes (kg m²).
const MIN_INERTIA: f64 = 1e-15;
/// Folder of the meshes.
pub(super) const MESHES: &str = "meshes";
/// Parts of a six-coordinate joint in the order of their motion: translation, then Z-Y-X angles.
const SIX: [(&str, usize); 6] = [("x", 0), ("y", 1), ("z", 2), ("rz", 5), ("ry", 4), ("rx", 3)];

/// A body with the joints to its parent, which move in their order.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub(super) name: String,
    /// Index of the parent; 0 is the world.
    pub(super) parent: usize,
    /// Pose in the parent with all joints at zero.
    pub(super) X_PB: Pose,
    pub(super) joints: Vec<Axis>,
    pub(super) mass: f64,
    pub(super) com: Vector3<f64>,
    /// About the centre of mass, in body axes (kg m²).
    pub(super) inertia: Matrix3<f64>,
    pub(super) shapes: Vec<Shape>,
}

/// A joint of one coordinate; axis and anchor in the axes of the body.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) name: String,
    pub(super) slides: bool,
    pub(super) axis: Vector3<f64>,
    pub(super) anchor: Vector3<f64>,
    /// Index of its coordinate in the model.
    pub(super) coordinate: usize,
    /// Factor and offset of the coordinate of another joint that it follows.
    pub(super) follows: Option<(f64, f64)>,
}

/// A mesh file, placed in a body.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    pub(super) name: String,
    pub(super) X_BV: Pose,
    pub(super) color: [f32; 4],
}

/// Name and content of a file.
type MeshFile = (PathBuf, Vec<u8>);

/// Returns the world and the bodies of an arm, parents first, and the mesh files.
pub(super) fn parts(robot: &Robot, posed: &Posed) -> Result<(Vec<Part>, Vec<MeshFile>), Error> {
    let model = &posed.plant.model;
    if let Some(closed) = model.loops().first() {
        return Err(not_exportable(&closed.name, "a closed loop"));
    }
    let bodies = model.bodies().iter();
    let mut parts = bodies.map(part).collect::<Result<Vec<_>, _>>()?;
    // The first joint of a coordinate drives it; those after it follow.
    for (part, body) in parts.iter_mut().zip(model.bodies()) {
        let follows = (body.ratio, body.offset);
        let Some(axis) = part.joints.first_mut().filter(|_| follows != (1.0, 0.0)) else { continue };
        axis.follows = Some(follows).filter(|_| axis.coordinate < model.nv());
    }
    let mut files = Vec::new();
    for visual in &robot.urdf.visuals {
        let Some(frame) = model.frame(&visual.link) else { continue };
        let Ok(mesh) = visual.geometry.triangles() else { continue }; // a missing mesh is a caveat of the robot
        let name = format!("{}_{}", super::file_name(&visual.link), files.len());
        files.push((PathBuf::from(MESHES).join(format!("{name}.stl")), mesh.to_stl()));
        let color = visual.color.or(mesh.color).unwrap_or([0.7, 0.7, 0.7, 1.0]);
        parts[frame.body].shapes.push(Shape { name, X_BV: frame.X_BF * visual.X_LV, color });
    }
    Ok((parts, files))
}

/// Error about a part that has no counterpart in formats of other simulators.
fn not_exportable(name: &str, what: &str) -> Error {
    Error::Value(format!("{name:?} is {what}, which cannot be exported"))
}

fn part(body: &Body) -> Result<Part, Error> {
    let cannot = |what| not_exportable(&body.joint, what);
    let axis = |name: String, slides: bool, axis: Vector3<f64>, coordinate: usize| Axis {
        name,
        slides,
        axis,
        anchor: Vector3::zeros(),
        coordinate,
        follows: None,
    };
    let joints = match body.motion {
        _ if body.joint.is_empty() => Vec::new(), // the world
        JointMotion::Axis(AxisMotion::Helical { .. }) => return Err(cannot("a screw joint")),
        JointMotion::Axis(motion) => vec![axis(body.joint.clone(), motion.slides(), motion.axis(), body.coordinate)],
        JointMotion::Elastic(_) => SIX
            .iter()
            .map(|&(part, k)| {
                axis(format!("{}_{part}", body.joint), k < 3, Vector3::ith(k % 3, 1.0), body.coordinate + k)
            })
            .collect(),
        JointMotion::Welded | JointMotion::Interface { .. } => {
            return Err(cannot("a modal body (lumped links are none)"));
        }
    };
    let com = body.inertia.com();
    let about_com = flexarm_kinematics::skew(&com);
    let inertia = body.inertia.rotational + about_com * about_com * body.inertia.mass;
    let (name, parent, X_PB, mass) = (body.name.clone(), body.parent, body.X_PJ, body.inertia.mass);
    Ok(Part {
        name,
        parent,
        X_PB,
        joints,
        mass,
        com,
        inertia: 0.5 * (inertia + inertia.transpose()),
        shapes: Vec::new(),
    })
}

/// Checks that MuJoCo takes the inertia of each body, and joins each moving body without mass, such
/// as the motor of an elastic gear, with its only child: MuJoCo lets no such body move.
pub(super) fn with_mass(mut parts: Vec<Part>) -> Result<Vec<Part>, Error> {
    while let Some(light) = (1..parts.len()).find(|&k| parts[k].mass == 0.0 && !parts[k].joints.is_empty()) {
        let mut children = (light + 1..parts.len()).filter(|&k| parts[k].parent == light);
        let (Some(child), None) = (children.next(), children.next()) else {
            return Err(not_exportable(&parts[light].name, "a moving body without mass"));
        };
        let (above, X_LC) = (parts[light].clone(), parts[child].X_PB);
        // Joints and shapes of the body, in the frame of its child.
        let moved = above.joints.into_iter().map(|axis| Axis {
            axis: X_LC.rotation.inverse() * axis.axis,
            anchor: X_LC.rotation.inverse() * (axis.anchor - X_LC.translation.vector),
            ..axis
        });
        let shapes = above.shapes.into_iter().map(|shape| Shape { X_BV: X_LC.inverse() * shape.X_BV, ..shape });
        let part = &mut parts[child];
        // The child takes the place of the body; later indices decrease by one.
        part.joints.splice(0..0, moved);
        part.shapes.extend(shapes);
        (part.parent, part.X_PB) = (above.parent, above.X_PB * X_LC);
        parts.remove(light);
        parts.iter_mut().filter(|part| part.parent > light).for_each(|part| part.parent -= 1);
    }
    // No principal moment may exceed the sum of the other two.
    let refused = |part: &&Part| {
        let moments = part.inertia.symmetric_eigenvalues();
        part.mass > 0.0 && (moments.min() < MIN_INERTIA || 2.0 * moments.max() > moments.sum() * (1.0 + 1e-9))
    };
    match parts[1..].iter().find(refused) {
        Some(part) => Err(not_exportable(&part.name, "a body with an inertia that no mass distribution has")),
        None => Ok(parts),
    }
}
