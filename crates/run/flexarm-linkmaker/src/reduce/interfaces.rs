//! Maps the interfaces of a job to nodes and frames of a mesh, with messages that contain the text
//! to type.
//!
//! Start at [`MeshFrame::choose`]. M is the frame of the mesh, L the link, I an interface; node
//! selections are in M, poses and centroids in L (m). Not here: the selectors themselves
//! (`flexarm_fem::mesh::select`), ties (`flexarm_fem::reduction`).

use flexarm_fem::mesh::{Surface, SurfaceNodes, select};
use flexarm_fem::reduction::{Interface, Tie};
use flexarm_fem::{Mesh, NodeSelector};
use flexarm_settings::Setting;
use flexarm_spatial::Pose;
use nalgebra::{Rotation3, Translation3, Vector3};

use super::job::{FrameEntry, InterfaceEntry, ReduceJob};
use super::urdf_link::UrdfLink;
use crate::LinkError;

/// An interface of the mesh with its figures for the report. Link axes, m.
#[derive(Clone, Debug)]
pub(super) struct SelectedInterface {
    pub(super) interface: Interface,
    pub(super) selector: NodeSelector,
    pub(super) centroid: Vector3<f64>,
    pub(super) extent: Vector3<f64>,
    /// Position of the chosen nodes on the surface.
    pub(super) on_surface: SurfaceNodes,
    /// Number of chosen nodes, before mid-side nodes were added.
    pub(super) chosen_nodes: usize,
}

impl SelectedInterface {
    /// Returns warnings about nodes that do not form a seat: corners without mid-side nodes, edges,
    /// nodes inside.
    pub(super) fn node_warnings(&self) -> Vec<String> {
        // Corners without mid-side nodes; no face at all, or nodes beside the faces; nodes inside.
        let (name, on_surface, chosen) = (&self.interface.name, &self.on_surface, self.chosen_nodes);
        let mut findings = Vec::new();
        if !on_surface.missing.is_empty() {
            findings.push(format!(
                "interface {name:?}: its {chosen} nodes include the corners of {} faces, but {} of the {} mid-side \
                 nodes of these faces are missing; they were added, because faces tied only at their corners make \
                 the link too soft; write node sets with all nodes of their faces",
                on_surface.faces,
                on_surface.missing.len(),
                on_surface.middles
            ));
        }
        if on_surface.faces == 0 && on_surface.on_beams == 0 {
            findings.push(format!(
                "interface {name:?}: no face of the surface has all its corners among its {chosen} node(s), so it \
                 is an edge or single nodes, and the tied area depends on the mesh; select the nodes of a surface"
            ));
        } else if 2 * on_surface.stray > chosen {
            findings.push(format!(
                "interface {name:?}: {} of its {chosen} nodes are on none of its {} faces; is the tolerance too \
                 small, or is the selector not on the surface?",
                on_surface.stray, on_surface.faces
            ));
        }
        if on_surface.inside > 0 {
            findings.push(format!(
                "interface {name:?}: {} of its {chosen} nodes are inside the body, where no joint is attached, and \
                 the material between them cannot deform; select nodes of the surface",
                on_surface.inside
            ));
        }
        findings
    }
}

/// The mesh with the link frame in which the user gives positions.
pub(super) struct MeshFrame<'a> {
    /// Mesh in its own frame (m).
    pub(super) mesh: &'a Mesh,
    /// Unit of length of the mesh (m); 1 if unknown.
    pub(super) unit: f64,
    /// Frame of the mesh in the link frame (m).
    pub(super) X_LM: Pose,
}

/// Converts a pose of the job to m.
pub(super) fn pose(frame: &FrameEntry, unit: f64) -> Pose {
    let [roll, pitch, yaw] = frame.rpy;
    let position = Vector3::from(frame.xyz) * unit;
    Pose::from_parts(Translation3::from(position), Rotation3::from_euler_angles(roll, pitch, yaw))
}

impl MeshFrame<'_> {
    /// Centroid and extent of some nodes along the link axes (m).
    pub(super) fn middle_and_extent(&self, nodes: &[u32]) -> (Vector3<f64>, Vector3<f64>) {
        let points = || nodes.iter().map(|node| self.X_LM * nalgebra::Point3::from(self.mesh.nodes[*node as usize]));
        let sum: Vector3<f64> = points().map(|p| p.coords).sum();
        let low = points().fold(Vector3::repeat(f64::INFINITY), |low, p| low.inf(&p.coords));
        let high = points().fold(Vector3::repeat(f64::NEG_INFINITY), |high, p| high.sup(&p.coords));
        (sum / nodes.len().max(1) as f64, high - low)
    }

    /// Formats three lengths in the unit of the mesh, with digits suited to the size of the mesh.
    pub(super) fn typed(&self, p: &Vector3<f64>) -> String {
        let size = self.mesh.bounding_box().map_or(1.0, |(low, high)| (high - low).norm()) / self.unit;
        let digits = (6.0 - size.log10().ceil()).clamp(0.0, 12.0) as usize;
        let one = |x: f64| {
            let text = format!("{:.digits$}", x / self.unit);
            let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
            if short == "-0" { "0".to_owned() } else { short.to_owned() }
        };
        format!("{},{},{}", one(p.x), one(p.y), one(p.z))
    }

    /// Lists the node sets of the mesh, for messages.
    pub(super) fn known_sets(&self) -> String {
        const MAX: usize = 12;
        let sets = &self.mesh.node_sets;
        if sets.is_empty() {
            return "the mesh has no node sets: select nodes by position, such as plane(0,0,0; 1,0,0)".into();
        }
        let shown: Vec<String> =
            sets.iter().take(MAX).map(|(name, nodes)| format!("{name:?} ({} nodes)", nodes.len())).collect();
        let more = sets.len().saturating_sub(MAX);
        let rest = if more > 0 { format!(" and {more} more ({} shows all)", Setting::List) } else { String::new() };
        format!("node sets of the mesh: {}{rest}", shown.join(", "))
    }

    /// Returns nodes and frames of all interfaces, or all errors.
    pub(super) fn choose(
        &self,
        job: &ReduceJob,
        robot: Option<&UrdfLink>,
    ) -> Result<Vec<SelectedInterface>, Vec<LinkError>> {
        let (mut chosen, mut faults) = (Vec::new(), Vec::new());
        if job.interface.len() < 2 {
            let found = job.interface.len();
            let what = format!(
                "{found} interface(s) given, a link needs at least two, the proximal one first: {interface} \
                 A=SELECTOR {interface} B=SELECTOR, where SELECTOR is a node set or a region such as plane(x,y,z; \
                 nx,ny,nz); {sets}",
                interface = Setting::Interface,
                sets = self.known_sets()
            );
            faults.push(LinkError::content(&job.mesh, what));
        }
        let surface = Surface::new(self.mesh);
        for (index, entry) in job.interface.iter().enumerate() {
            match self.one(job, index, entry, robot, &surface) {
                Ok(interface) => chosen.push(interface),
                Err(fault) => faults.push(fault),
            }
        }
        if faults.is_empty() { Ok(chosen) } else { Err(faults) }
    }

    /// Returns the interface of an entry: its nodes, with the mid-side nodes of their faces, and its
    /// frame.
    fn one(
        &self,
        job: &ReduceJob,
        index: usize,
        entry: &InterfaceEntry,
        robot: Option<&UrdfLink>,
        surface: &Surface,
    ) -> Result<SelectedInterface, LinkError> {
        let name = entry.name.clone().unwrap_or_default();
        let place = if entry.place.is_empty() { job.mesh.display().to_string() } else { entry.place.clone() };
        let fail = |what: String| LinkError::Interface { place: place.clone(), interface: name.clone(), what };
        let Some(selector) = &entry.select else {
            return Err(fail(format!(
                "it has no nodes: {} {name}=SELECTOR or select = \"...\"; {}",
                Setting::Interface,
                self.known_sets()
            )));
        };
        let mut nodes = select(self.mesh, selector, self.unit).map_err(|source| fail(source.to_string()))?;
        let (on_surface, chosen_nodes) = (surface.surface_nodes(&nodes), nodes.len());
        // Tie whole faces: corners without mid-side nodes would hold a face only at points.
        nodes.extend(&on_surface.missing);
        nodes.sort_unstable();
        let (centroid, extent) = self.middle_and_extent(&nodes);
        if let Some(angle) = entry.rpy.iter().flatten().find(|angle| angle.abs() > std::f64::consts::TAU) {
            return Err(fail(format!("rpy has {angle} rad, more than a turn: angles are in rad, are these degrees?")));
        }
        let X_LI = self.frame(entry, robot, index, (nodes.len(), &centroid)).map_err(fail)?;
        let tie = entry.tie.or(job.tie).unwrap_or(Tie::Rigid);
        let interface = Interface { name, X_LI, nodes, tie };
        Ok(SelectedInterface { interface, selector: selector.clone(), centroid, extent, on_surface, chosen_nodes })
    }

    /// Returns the frame `X_LI` of an interface from its one position: coordinates, centroid, joint, or
    /// by default that of the robot's joint.
    ///
    /// * `index`: number of the interface in the job, from 0.
    /// * `nodes`, `centroid`: number of its nodes and their centroid (m, link axes).
    fn frame(
        &self,
        entry: &InterfaceEntry,
        robot: Option<&UrdfLink>,
        index: usize,
        (nodes, centroid): (usize, &Vector3<f64>),
    ) -> Result<Pose, String> {
        let name = entry.name.as_deref().unwrap_or_default();
        let turned = |position: Vector3<f64>| {
            let frame = FrameEntry { xyz: (position / self.unit).into(), rpy: entry.rpy.unwrap_or_default() };
            pose(&frame, self.unit)
        };
        Ok(match (entry.xyz, entry.at, &entry.joint) {
            // One of coordinates, centroid and joint.
            (Some(xyz), None, None) => {
                if xyz.iter().chain(&entry.rpy.unwrap_or_default()).any(|x| !x.is_finite()) {
                    return Err(format!("its position is {xyz:?}, expected finite numbers"));
                }
                pose(&FrameEntry { xyz, rpy: entry.rpy.unwrap_or_default() }, self.unit)
            }
            (None, Some(_), None) => turned(*centroid),
            (None, None, Some(joint)) => {
                let robot = robot.ok_or_else(|| {
                    let (urdf, link) = (Setting::Urdf, Setting::Link);
                    format!("joint {joint:?} needs a robot: {urdf} FILE {link} NAME, or [urdf] in the job file")
                })?;
                robot.joint(joint)?
            }
            // By default the frames of the robot's link: A its origin, B the next joint.
            (None, None, None) => match (robot, index) {
                (Some(_), 0) => Pose::identity(),
                (Some(robot), 1) => robot.X_LB,
                (Some(robot), _) => {
                    let joints = robot.leading_on().map(|joint| format!("{} {name}=joint:{}", Setting::At, joint.name));
                    let hint = joints.collect::<Vec<_>>();
                    let hint = format!("; at a joint of the link: {}", hint.join(" or "));
                    return Err(self.no_position(name, nodes, centroid) + &hint);
                }
                (None, _) => return Err(self.no_position(name, nodes, centroid)),
            },
            _ => return Err("it has more than one position: xyz, at and joint exclude each other".into()),
        })
    }

    fn no_position(&self, name: &str, nodes: usize, centroid: &Vector3<f64>) -> String {
        let xyz = self.typed(centroid);
        format!(
            "it has no position: {at} {name}={xyz} (that is the centroid of its {nodes} nodes; link frame, in the \
             unit of the mesh), {at} {name}=centroid, or frames from a robot with {urdf} FILE {link} NAME; in a job \
             file xyz = [{list}], at = \"centroid\" or [urdf]",
            at = Setting::At,
            urdf = Setting::Urdf,
            link = Setting::Link,
            list = xyz.replace(',', ", ")
        )
    }

    /// Returns warnings about positions that suggest a wrong unit or frame.
    pub(super) fn findings(&self, chosen: &[SelectedInterface]) -> Vec<String> {
        let size = self.mesh.bounding_box().map_or(0.0, |(low, high)| (high - low).norm());
        let mut findings = Vec::new();
        for one in chosen {
            let distance = (one.interface.X_LI.translation.vector - one.centroid).norm();
            if distance > 0.5 * size {
                findings.push(format!(
                    "interface {:?} is {distance:.4} m from the centroid of its nodes, in a mesh of {size:.4} m: \
                     is its position in the unit of the mesh and in the link frame?",
                    one.interface.name
                ));
            }
        }
        // The interfaces should be about as far apart as their nodes.
        if let [a, b, ..] = chosen {
            let X = [a, b].map(|one| one.interface.X_LI.translation.vector);
            let (apart, nodes) = ((X[1] - X[0]).norm(), (b.centroid - a.centroid).norm());
            if apart < 0.05 * nodes {
                findings.push(format!(
                    "interfaces {:?} and {:?} are {apart:.2e} m apart, the centroids of their nodes {nodes:.4} m: \
                     are the positions in the unit of the mesh?",
                    a.interface.name, b.interface.name
                ));
            }
        }
        findings
    }
}
