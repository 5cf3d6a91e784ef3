//! Visual and collision shapes of a robot: finds their files and, on request, inspects them.
//!
//! Start at [`find_shapes`] and [`inspect`]. Frames: L link, V the shape's own frame; lengths in m.
//! Not here: reading meshes ([`crate::mesh`]), conclusions for masses ([`crate::inertia`]).

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use flexarm_kinematics::Pose;
use flexarm_settings::Place;
use nalgebra::{Point3, Vector3};
use urdf_rs::Geometry as Shape;

use crate::geometry::{Geometry, Visual};
use crate::mesh::{MassProperties, TriangleMesh, UpAxis, load_with_remarks};
use crate::raw::{RawLink, RawRobot, RawVisual, color};
use crate::report::Report;
use crate::resolve::Resolver;

/// Size above which geometry was probably drawn in millimetres (m).
const LARGE: f64 = 30.0;
/// Size below which geometry was probably scaled twice (m).
const SMALL: f64 = 1e-4;

/// Shape data of a link for the inertia checks.
pub(crate) struct LinkShape {
    /// Bounding box of all shapes in L; `None` if there are none or one is unknown.
    pub(crate) bounds: Option<Bounds>,
    /// Poses `X_LV` and mass properties of all shapes, or the reason why one is unknown.
    pub(crate) solids: Result<Vec<(Pose, MassProperties)>, String>,
}

/// Lowest and highest corner of a box (m).
type Bounds = (Vector3<f64>, Vector3<f64>);

/// Returns the visual or collision shapes of all links, with their mesh files if found.
pub(crate) fn find_shapes(
    robot: &RawRobot,
    of_link: fn(&RawLink) -> &[RawVisual],
    resolver: &Resolver<'_>,
    up_axis: UpAxis,
    report: &mut Report,
) -> Vec<Visual> {
    let mut found = Vec::new();
    for link in &robot.links {
        for raw in of_link(link) {
            let material = raw.urdf.material.as_ref();
            let named = || robot.materials.get(&material?.name).copied();
            found.push(Visual {
                link: link.name.clone(),
                X_LV: raw.X_LV,
                geometry: geometry(raw, &link.name, resolver, up_axis, report),
                color: material.and_then(color).or_else(named),
                name: raw.urdf.name.clone(),
            });
        }
    }
    found
}

fn geometry(raw: &RawVisual, link: &str, resolver: &Resolver<'_>, up_axis: UpAxis, report: &mut Report) -> Geometry {
    match &raw.urdf.geometry {
        Shape::Box { size } => Geometry::Box { size: Vector3::from(**size) },
        Shape::Cylinder { radius, length } => Geometry::Cylinder { radius: *radius, length: *length },
        Shape::Capsule { radius, length } => Geometry::Capsule { radius: *radius, length: *length },
        Shape::Sphere { radius } => Geometry::Sphere { radius: *radius },
        Shape::Mesh { filename, scale } => {
            let uri = filename.trim();
            let path = resolver.resolve(uri).map_err(|not_found| {
                let message = format!("link {link:?}: no mesh for {uri:?}: {}", not_found.reason);
                report.warning(&raw.place, "missing-mesh", message, not_found.help);
            });
            let scale = scale.map_or(Vector3::repeat(1.0), |scale| Vector3::from(*scale));
            Geometry::Mesh { uri: uri.to_owned(), path: path.ok(), scale, up_axis }
        }
    }
}

/// Bounds and mass properties of every link's visuals, which are those of [`find_shapes`].
pub(crate) fn inspect(robot: &RawRobot, visuals: &[Visual], report: &mut Report) -> Vec<LinkShape> {
    let mut meshes = Meshes::default();
    let mut visuals = visuals.iter();
    robot
        .links
        .iter()
        .map(|link| {
            let mut bounds: Option<Bounds> = None;
            let mut solids = Ok(Vec::new());
            for (raw, visual) in link.visuals.iter().zip(visuals.by_ref()) {
                // One visual without a solid leaves the link without mass properties.
                match meshes.inspect(visual, &raw.place, report) {
                    Ok(((low, high), solid)) => {
                        bounds = Some(bounds.map_or((low, high), |b| (b.0.inf(&low), b.1.sup(&high))));
                        if let Ok(solids) = &mut solids {
                            solids.push((visual.X_LV, solid));
                        }
                    }
                    Err(reason) => solids = Err(reason),
                }
            }
            check_size(&link.name, &link.place, bounds, report);
            LinkShape { bounds: bounds.filter(|_| solids.is_ok()), solids }
        })
        .collect()
}

/// Shape data without inspection of files.
pub(crate) fn unknown(robot: &RawRobot) -> Vec<LinkShape> {
    let unknown = || LinkShape { bounds: None, solids: Err("meshes were not inspected".to_owned()) };
    robot.links.iter().map(|_| unknown()).collect()
}

fn check_size(link: &str, place: &Place, bounds: Option<Bounds>, report: &mut Report) {
    let Some((low, high)) = bounds else { return };
    let size = (high - low).norm();
    if size > LARGE {
        let message = format!("the geometry of link {link:?} is {size:.0} m large");
        report.warning(place, "huge-geometry", message, "meshes in millimetres need scale=\"0.001 0.001 0.001\"");
    } else if size < SMALL {
        let message = format!("the geometry of link {link:?} is {size:.1e} m small");
        report.warning(place, "tiny-geometry", message, "was it scaled twice? URDF lengths are metres");
    }
}

/// Mesh files, each read once.
#[derive(Default)]
struct Meshes {
    loaded: HashMap<PathBuf, Result<TriangleMesh, String>>,
}

impl Meshes {
    /// Box in L and mass properties in V of one visual.
    fn inspect(
        &mut self,
        visual: &Visual,
        place: &Place,
        report: &mut Report,
    ) -> Result<(Bounds, MassProperties), String> {
        let (low_V, high_V, properties) = match &visual.geometry {
            Geometry::Mesh { path: None, uri, .. } => return Err(format!("the mesh {uri:?} was not found")),
            Geometry::Mesh { path: Some(path), scale, up_axis, .. } => {
                let mesh = self.load(path, *up_axis, &visual.link, place, report);
                let mesh = mesh.clone()?.scaled(scale);
                let (low, high) = mesh.bounds().unwrap_or_default();
                (low, high, mesh.mass_properties())
            }
            shape => {
                let mesh = shape.triangles().map_err(|error| error.to_string())?;
                let (low, high) = mesh.bounds().unwrap_or_default();
                (low, high, shape.mass_properties().map_err(|error| error.to_string())?)
            }
        };
        // Bounding box of the rotated box: slightly larger than that of the shape.
        let corners = (0..8).map(|k| {
            let corner = Vector3::from_fn(|i, _| if k >> i & 1 == 0 { low_V[i] } else { high_V[i] });
            (visual.X_LV * Point3::from(corner)).coords
        });
        let start = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        Ok((corners.fold(start, |(low, high), p| (low.inf(&p), high.sup(&p))), properties))
    }

    fn load(
        &mut self,
        path: &Path,
        up_axis: UpAxis,
        link: &str,
        place: &Place,
        report: &mut Report,
    ) -> &Result<TriangleMesh, String> {
        self.loaded.entry(path.to_owned()).or_insert_with(|| match load_with_remarks(path, up_axis) {
            Ok(loaded) => {
                for remark in loaded.remarks {
                    report.note(place, "mesh-remark", format!("{}: {remark}", path.display()), "");
                }
                Ok(loaded.mesh)
            }
            Err(error) => {
                let message = format!("link {link:?}: {error}");
                report.warning(place, "unreadable-mesh", message, "export the mesh again, as STL for example");
                Err(error.to_string())
            }
        })
    }
}
