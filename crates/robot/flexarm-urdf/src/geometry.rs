//! Geometry of links: shapes and meshes placed on links.
//!
//! Frames: L link, V the visual's own frame. Primitives as in URDF: centred at Vo, the cylinder
//! along z.
//!
//! Not here: formats of meshes (`mesh`), masses from volumes (`inertia.rs`).

use std::path::PathBuf;

use flexarm_kinematics::Pose;
use flexarm_settings::Finding;
use nalgebra::{Matrix3, Vector3};

use crate::mesh::{MassProperties, TriangleMesh, UpAxis, load_mesh};

/// A shape on a link.
#[derive(Clone, Debug, PartialEq)]
pub struct Visual {
    /// Name of the link L.
    pub link: String,
    /// Pose of the shape in the link, in m.
    pub X_LV: Pose,
    /// The shape.
    pub geometry: Geometry,
    /// Red, green, blue, alpha from 0 to 1, if the URDF gives one.
    pub color: Option<[f32; 4]>,
    /// Name of the visual, if it has one.
    pub name: Option<String>,
}

/// A shape in its own frame V. Lengths in m.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// Triangles in a file.
    Mesh {
        /// Reference as written in the URDF (`package://...`).
        uri: String,
        /// The file, if it was found.
        path: Option<PathBuf>,
        /// Scale factors along x, y and z, applied after the unit and the up axis of the file.
        scale: Vector3<f64>,
        /// Treatment of the up axis of a COLLADA file.
        up_axis: UpAxis,
    },
    /// A box.
    Box {
        /// Full edge lengths.
        size: Vector3<f64>,
    },
    /// A cylinder along z.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Full length.
        length: f64,
    },
    /// A cylinder along z between two half spheres.
    Capsule {
        /// Radius.
        radius: f64,
        /// Length of the cylinder, without the half spheres.
        length: f64,
    },
    /// A sphere.
    Sphere {
        /// Radius.
        radius: f64,
    },
}

/// Number of corners of the circles that approximate round shapes.
const CORNERS: u32 = 48;

impl Geometry {
    /// Returns the shape as triangles in V, with the scale applied and outward sides
    /// counter-clockwise.
    ///
    /// Round shapes become inscribed polyhedra with 48 corners, for drawing; for their exact mass
    /// properties use [`Geometry::mass_properties`].
    ///
    /// # Errors
    /// Finding about the file of a mesh.
    pub fn triangles(&self) -> Result<TriangleMesh, Box<Finding>> {
        Ok(match self {
            Self::Mesh { path: Some(path), scale, up_axis, .. } => load_mesh(path, *up_axis)?.scaled(scale),
            Self::Mesh { uri, path: None, .. } => {
                let message = format!("no file was found for {uri:?}");
                return Err(Box::new(Finding::error("mesh", "", message, "")));
            }
            Self::Box { size } => box_triangles(size),
            Self::Cylinder { radius, length } => cylinder_triangles(*radius, *length),
            Self::Capsule { radius, length } => round_triangles(*radius, *length),
            Self::Sphere { radius } => round_triangles(*radius, 0.0),
        })
    }

    /// Returns volume, centroid and inertia per unit density in V: closed forms for primitives, and
    /// exact integrals for meshes.
    ///
    /// # Errors
    /// Finding about the file of a mesh.
    pub fn mass_properties(&self) -> Result<MassProperties, Box<Finding>> {
        let (volume, second_moments) = match self {
            Self::Mesh { .. } => return Ok(self.triangles()?.mass_properties()),
            Self::Box { size: s } => (s.x * s.y * s.z, s.component_mul(s) / 12.0),
            Self::Cylinder { radius: r, length: l } => {
                let across = r * r / 4.0;
                (std::f64::consts::PI * r * r * l, Vector3::new(across, across, l * l / 12.0))
            }
            Self::Capsule { radius: r, length: l } => {
                let (r, l) = (*r, *l);
                let (ball, rod) = (4.0 / 3.0 * std::f64::consts::PI * r.powi(3), std::f64::consts::PI * r * r * l);
                // The centroid of a half sphere is 3 r / 8 from its flat side.
                let across = ball * r * r / 5.0 + rod * r * r / 4.0;
                let along = ball * (r * r / 5.0 + 3.0 / 8.0 * r * l + l * l / 4.0) + rod * l * l / 12.0;
                (ball + rod, Vector3::new(across, across, along) / (ball + rod))
            }
            Self::Sphere { radius: r } => (4.0 / 3.0 * std::f64::consts::PI * r.powi(3), Vector3::repeat(r * r / 5.0)),
        };
        // I = ∫ (r·r 1 - r rᵀ) dV, diagonal for all primitives
        let s = second_moments * volume;
        Ok(MassProperties {
            volume,
            centroid: Vector3::zeros(),
            inertia: Matrix3::from_diagonal(&Vector3::new(s.y + s.z, s.z + s.x, s.x + s.y)),
            open_edges: 0,
            inside_out: false,
        })
    }
}

fn box_triangles(size: &Vector3<f64>) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let mut normals = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            // u, v and the outward normal are right-handed
            let normal = Vector3::ith(axis, side);
            let u = Vector3::ith((axis + 1) % 3, 1.0);
            let v = normal.cross(&u);
            let first = mesh.positions.len() as u32;
            for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                let corner: Vector3<f64> = normal + u * a + v * b;
                mesh.positions.push(corner.component_mul(size).map(|x| (0.5 * x) as f32).into());
                normals.push(normal.map(|x| x as f32).into());
            }
            mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    mesh.normals = Some(normals);
    mesh
}

fn cylinder_triangles(radius: f64, length: f64) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let mut normals: Vec<[f32; 3]> = Vec::new();
    let half = 0.5 * length;
    let mut push = |mesh: &mut TriangleMesh, p: [f64; 3], n: [f64; 3]| {
        mesh.positions.push(p.map(|x| x as f32));
        normals.push(n.map(|x| x as f32));
    };
    for k in 0..CORNERS {
        let (s, c) = (f64::from(k) * std::f64::consts::TAU / f64::from(CORNERS)).sin_cos();
        let (x, y) = (radius * c, radius * s);
        // four rings: wall and cap have normals of their own
        push(&mut mesh, [x, y, -half], [c, s, 0.0]);
        push(&mut mesh, [x, y, half], [c, s, 0.0]);
        push(&mut mesh, [x, y, -half], [0.0, 0.0, -1.0]);
        push(&mut mesh, [x, y, half], [0.0, 0.0, 1.0]);
    }
    for k in 0..CORNERS {
        let (a, b) = (4 * k, 4 * ((k + 1) % CORNERS));
        mesh.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        if k > 0 && k + 1 < CORNERS {
            mesh.triangles.extend([[2, b + 2, a + 2], [3, a + 3, b + 3]]);
        }
    }
    mesh.normals = Some(normals);
    mesh
}

/// A sphere, or with a positive `length` a capsule.
fn round_triangles(radius: f64, length: f64) -> TriangleMesh {
    let half = 0.5 * length;
    let (poles, equator) = (CORNERS / 2, CORNERS / 4);
    // Circles from the top to the bottom: polar angle in parts of a half turn, centre along z.
    let circles: Vec<(u32, f64)> = match length > 0.0 {
        true => (1..=equator).map(|k| (k, half)).chain((equator..poles).map(|k| (k, -half))).collect(),
        false => (1..poles).map(|k| (k, 0.0)).collect(),
    };
    let mut mesh = TriangleMesh::default();
    let mut normals = Vec::new();
    let mut push = |mesh: &mut TriangleMesh, n: [f64; 3], z: f64| {
        mesh.positions.push([n[0] * radius, n[1] * radius, n[2] * radius + z].map(|x| x as f32));
        normals.push(n.map(|x| x as f32));
    };
    push(&mut mesh, [0.0, 0.0, 1.0], half);
    for &(polar, z) in &circles {
        let (sin_polar, cos_polar) = (f64::from(polar) * std::f64::consts::PI / f64::from(poles)).sin_cos();
        for k in 0..CORNERS {
            let (s, c) = (f64::from(k) * std::f64::consts::TAU / f64::from(CORNERS)).sin_cos();
            push(&mut mesh, [sin_polar * c, sin_polar * s, cos_polar], z);
        }
    }
    push(&mut mesh, [0.0, 0.0, -1.0], -half);

    let last = circles.len() as u32;
    let at = |circle: u32, k: u32| 1 + (circle - 1) * CORNERS + k % CORNERS;
    let south = 1 + last * CORNERS;
    for k in 0..CORNERS {
        mesh.triangles.push([0, at(1, k), at(1, k + 1)]);
        mesh.triangles.push([south, at(last, k + 1), at(last, k)]);
        for circle in 1..last {
            let (a, b, c, d) = (at(circle, k), at(circle + 1, k), at(circle + 1, k + 1), at(circle, k + 1));
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh.normals = Some(normals);
    mesh
}
