//! Surfaces of the arm in the world: meshes of the links, or rods.
//!
//! Start at [`bodies`] and [`Skin`]. Frames: W world, L link, P parent link, C child, T tool; in m.
//! Not here: cutting and bending of a surface ([`crate::BentMesh`]), drawing ([`super::Stage`]).

use flexarm_sample::{BendInfo, LinkMesh, RunHeader, Sample, TwinSample};
use flexarm_spatial::Pose;
use nalgebra::{Point3, Vector3};

use crate::mesh_picture::topology::prism;
use crate::{BentMesh, stations_in_link};

/// Radius of the rods drawn for links, as a share of the size of the arm.
const ROD: f64 = 0.012;
/// Sides of a rod.
const ROD_SIDES: u32 = 10;

/// A surface attached to a link, deformed with it if the link is flexible.
pub(super) struct Body {
    link: usize,
    /// Deformable surface, and index of its first station and their number.
    bent: Option<(BentMesh, usize, usize)>,
    mesh: LinkMesh,
}

/// Returns the surfaces of the arm, cut for deformation; rods if there are none.
pub(super) fn bodies(header: &RunHeader, sample: &Sample) -> Vec<Body> {
    // Rods from each link to its children, and to the tool.
    let mut meshes = header.meshes.clone();
    let size = reach(&sample.rigid);
    if meshes.is_empty() {
        for (child, info) in header.links.iter().enumerate() {
            let Some(parent) = info.parent else { continue };
            let X_PC = sample.rigid.X_WL[parent].inv_mul(&sample.rigid.X_WL[child]);
            meshes.extend(rod(parent, &Vector3::zeros(), &X_PC.translation.vector, ROD * size));
        }
    }
    if let Some(link) = header.links.iter().position(|link| link.name == header.tcp) {
        let X_LT = sample.rigid.X_WL[link].inv_mul(&sample.rigid.X_WT);
        meshes.extend(rod(link, &Vector3::zeros(), &X_LT.translation.vector, 0.5 * ROD * size));
    }
    // Index of the first station of each bend.
    let mut firsts = Vec::new();
    let mut first = 0;
    for bend in &header.bends {
        firsts.push(first);
        first += bend.X_LS.len();
    }
    let body = |mesh: LinkMesh| {
        let found = header.bends.iter().zip(&firsts).find(|(bend, _)| bend.link == mesh.link);
        let bent = found
            .and_then(|(bend, first): (&BendInfo, _)| Some((BentMesh::new(&mesh, bend)?, *first, bend.X_LS.len())));
        Body { link: mesh.link, bent, mesh }
    };
    meshes.into_iter().map(body).collect()
}

/// Maximum distance of a link from the base (m).
pub(super) fn reach(twin: &TwinSample) -> f64 {
    let base = twin.X_WL[0].translation.vector;
    let places = twin.X_WL.iter().chain([&twin.X_WT]);
    places.map(|X| (X.translation.vector - base).norm()).fold(0.0, f64::max)
}

/// Creates a prism between two points of a link; `None` if they coincide.
fn rod(link: usize, from: &Vector3<f64>, to: &Vector3<f64>, radius: f64) -> Option<LinkMesh> {
    let (positions, triangles) = prism([from, to], radius, ROD_SIDES, 1e-6)?;
    let positions = positions.iter().map(|p| p.map(|x| x as f32).into()).collect();
    Some(LinkMesh { link, name: "rod".into(), positions, normals: Vec::new(), triangles, color: [0.7; 4], file: None })
}

/// A set of triangles in the world.
#[derive(Default)]
pub(super) struct Skin {
    pub(super) positions: Vec<Vector3<f64>>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Skin {
    pub(super) fn rigid(bodies: &[Body], twin: &TwinSample) -> Self {
        let mut skin = Self::default();
        for body in bodies {
            let mesh = body.bent.as_ref().map_or(&body.mesh, |(bent, ..)| &bent.mesh);
            skin.add(&twin.X_WL[body.link], mesh.positions.iter().copied(), &mesh.triangles);
        }
        skin
    }

    pub(super) fn bent(bodies: &[Body], header: &RunHeader, twin: &TwinSample) -> Self {
        let mut skin = Self::default();
        let stations: usize = header.bends.iter().map(|bend| bend.X_LS.len()).sum();
        for body in bodies {
            let X_WL = &twin.X_WL[body.link];
            match &body.bent {
                Some((bent, first, count)) if twin.X_WS.len() == stations => {
                    let moved = stations_in_link(twin, body.link, *first, *count);
                    skin.add(X_WL, bent.positions(&moved), &bent.mesh.triangles);
                }
                Some((bent, ..)) => skin.add(X_WL, bent.mesh.positions.iter().copied(), &bent.mesh.triangles),
                None => skin.add(X_WL, body.mesh.positions.iter().copied(), &body.mesh.triangles),
            }
        }
        skin
    }

    fn add(&mut self, X_WL: &Pose, positions: impl Iterator<Item = [f32; 3]>, triangles: &[[u32; 3]]) {
        let first = self.positions.len() as u32;
        self.positions.extend(positions.map(|p| (X_WL * Point3::from(Vector3::from(p.map(f64::from)))).coords));
        self.triangles.extend(triangles.iter().map(|t| t.map(|v| first + v)));
    }
}
