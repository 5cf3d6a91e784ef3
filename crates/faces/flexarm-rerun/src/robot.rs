//! One of the robots of a recording: rigid twin, flexible arm, or flexible arm with magnified
//! deflections.
//!
//! Start at [`RobotTracks`]. Poses in the world (m); a link is an entity with its mesh, moved by a
//! transform per sample. Not here: numbers and plots (`curves`), buffering of rows (`tracks`).

use flexarm_kinematics::{Pose, rotation_vector};
use nalgebra::{Point3, Vector3};
use rerun::components::MeshFaceRendering;
use rerun::{AlbedoFactor, Color, EntityPath, LineStrips3D, Mesh3D, Radius, Rgba32, TransformAxes3D};

use super::colors::{self, ColorScale};
use super::entity::{link_part, path};
use super::stream::{Result, RrdStream};
use super::tracks::{Instant, PoseTrack, ShapeTrack, SkeletonTrack, TintTrack, Track, point};
use flexarm_draw::{BendLine, BentMesh, BentPieces, stations_in_link};
use flexarm_log::{LinkInfo, LinkMesh, RunHeader, Sample, TwinSample};

/// Colouring of a robot.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Paint {
    /// Colours of the meshes.
    Own,
    /// Transparent.
    Ghost,
    /// Coloured by the distance from the rigid twin.
    Deviation(ColorScale),
    /// One colour, possibly transparent.
    Plain(Color),
}

/// Place and appearance of a robot in the recording.
#[derive(Clone, Debug)]
pub(crate) struct RobotAppearance {
    /// Parent entity of its links.
    pub(crate) root: EntityPath,
    /// Prefix of the names of its frames; none if they have no names.
    pub(crate) frames: Option<&'static str>,
    pub(crate) paint: Paint,
    /// Whether links are drawn bent; otherwise their surfaces stay undeformed.
    pub(crate) bends: bool,
    /// Vertex displacement above which a bent surface is written again (m).
    pub(crate) tolerance_m: f64,
    /// Minimum time between two writes of a bent surface (ns).
    pub(crate) every_ns: i64,
    /// Rounding of the vertices of bent surfaces (m), for better compression; 0 for none.
    pub(crate) quantum_m: f32,
}

/// Frames and surfaces of a robot.
pub(crate) struct RobotTracks {
    look: RobotAppearance,
    links: Vec<(usize, PoseTrack)>,
    tcp: PoseTrack,
    bent: Vec<BentTracks>,
    tints: Vec<(usize, Point3<f64>, TintTrack)>,
    /// Only for a robot without meshes, which would be invisible otherwise.
    skeleton: Option<SkeletonTrack>,
}

/// Surface between the interfaces of a flexible link.
struct BentTracks {
    /// Link, index of its first station in [`TwinSample::X_WS`], number of stations.
    link: usize,
    stations: (usize, usize),
    middle: BentMesh,
    shape: ShapeTrack,
    far: PoseTrack,
    /// Colours of the bending part, and of the part beyond it.
    tint: Option<(TintTrack, TintTrack)>,
    /// Stations at the last write.
    written: Option<Vec<Pose>>,
    /// Time of the last write (ns).
    last: Option<i64>,
}

/// Number of positions along a bent link at which its colour is computed.
const TINTS: usize = 32;

impl RobotTracks {
    /// Creates the tracks of a robot; writes its constant data.
    pub(crate) fn new(header: &RunHeader, look: RobotAppearance, stream: &RrdStream) -> Result<Self> {
        let at = |what: &str| look.root.join(&path([what]));
        let pairs = header.links.iter().enumerate();
        let pairs = pairs.filter_map(|(child, link)| Some((child, link.parent?))).collect();
        let line_color = match look.paint {
            Paint::Ghost => colors::rigid(),
            Paint::Plain(color) => color,
            Paint::Own | Paint::Deviation(_) => colors::series(1),
        };
        // Frames without a surface are those of the robots at true scale.
        let shown = |(k, _): &(usize, &LinkInfo)| {
            matches!(look.paint, Paint::Own | Paint::Ghost) || header.meshes.iter().any(|mesh| mesh.link == *k)
        };
        let pose_track = |(k, link): (usize, &LinkInfo)| (k, PoseTrack::new(at(&link_part(&link.name))));
        let mut robot = Self {
            links: header.links.iter().enumerate().filter(shown).map(pose_track).collect(),
            tcp: PoseTrack::new(at("tcp")),
            bent: Vec::new(),
            tints: Vec::new(),
            skeleton: header.meshes.is_empty().then(|| SkeletonTrack::new(at("skeleton"), line_color, pairs)),
            look,
        };
        for mesh in &header.meshes {
            robot.surface(header, mesh, stream)?;
        }
        if let Some(skeleton) = &robot.skeleton {
            skeleton.style(stream)?;
        }
        robot.name_frames(header, stream)?;
        const AXIS_LENGTH_M: f32 = 0.15;
        if !matches!(robot.look.paint, Paint::Ghost) {
            stream.constant(&robot.look.root.join(&path(["tcp"])), &TransformAxes3D::new(AXIS_LENGTH_M))?;
        }
        Ok(robot)
    }

    /// Names the frames of the links and of the tool as in MCAP files.
    fn name_frames(&self, header: &RunHeader, stream: &RrdStream) -> Result<()> {
        let Some(prefix) = self.look.frames else { return Ok(()) };
        for (link, _) in &self.links {
            let name = &header.links[*link].name;
            stream.name_frame(&self.look.root.join(&path([&link_part(name)])), &format!("{prefix}{name}"))?;
        }
        stream.name_frame(&self.look.root.join(&path(["tcp"])), &format!("{prefix}{}/tcp", header.tcp))
    }

    /// Adds the mesh of a link: rigid, or in pieces before, within and behind a bend.
    fn surface(&mut self, header: &RunHeader, mesh: &LinkMesh, stream: &RrdStream) -> Result<()> {
        let entity = self.look.root.join(&path([&link_part(&header.links[mesh.link].name), &mesh.name]));
        let mut first = 0;
        for bend in &header.bends {
            let stations = (first, bend.X_LS.len());
            first += bend.X_LS.len();
            if bend.link != mesh.link || !self.look.bends {
                continue;
            }
            let Some(BentPieces { near, middle, far }) = BentPieces::new(mesh, bend) else { continue };
            if middle.mesh.triangles.is_empty() {
                continue;
            }
            let (middle_at, far_at) = (entity.join(&path(["bending"])), entity.join(&path(["far"])));
            if !near.triangles.is_empty() {
                stream.constant(&entity, &self.painted(&near))?;
                self.tint(mesh.link, &near, entity);
            }
            // The vertices of the bending part are written later, as functions of time.
            let shape = ShapeTrack::new(middle_at.clone(), middle.mesh.positions.len());
            let line = middle.line();
            let place = |p: &[f32; 3]| line.place(&Vector3::from(p.map(f64::from))) / line.length();
            let along = middle.mesh.positions.iter().map(|p| place(p) as f32);
            stream.constant(&middle_at, &self.strip(&middle.mesh, TINTS, along))?;
            let far_surface = far_at.join(&path(["surface"]));
            if !far.triangles.is_empty() {
                stream.constant(&far_surface, &self.painted(&far))?;
            }
            let tinted = matches!(self.look.paint, Paint::Deviation(_));
            let tint = tinted.then(|| (TintTrack::new(middle_at), TintTrack::new(far_surface)));
            self.bent.push(BentTracks {
                link: mesh.link,
                stations,
                middle,
                shape,
                far: PoseTrack::new(far_at),
                tint,
                written: None,
                last: None,
            });
            return Ok(());
        }
        stream.constant(&entity, &self.painted(mesh))?;
        self.tint(mesh.link, mesh, entity);
        Ok(())
    }

    /// Adds a time-dependent colour to a rigid surface, if the robot is coloured by the deviation.
    fn tint(&mut self, link: usize, mesh: &LinkMesh, entity: EntityPath) {
        if let Paint::Deviation(_) = self.look.paint {
            let sum: Vector3<f64> = mesh.positions.iter().map(|p| Vector3::from(p.map(f64::from))).sum();
            let middle = Point3::from(sum / mesh.positions.len().max(1) as f64);
            self.tints.push((link, middle, TintTrack::new(entity)));
        }
    }

    fn painted(&self, mesh: &LinkMesh) -> Mesh3D {
        let surface = plain(mesh);
        let own = || {
            let [red, green, blue, alpha] = mesh.color.map(|part| (part.clamp(0.0, 1.0) * 255.0).round() as u8);
            Rgba32::from_unmultiplied_rgba(red, green, blue, alpha)
        };
        match self.look.paint {
            // Draw back faces only: they are hidden wherever the flexible robot is in the same
            // place.
            Paint::Ghost => {
                surface.with_albedo_factor(AlbedoFactor(colors::ghost())).with_face_rendering(MeshFaceRendering::Back)
            }
            Paint::Plain(color) => surface.with_albedo_factor(AlbedoFactor(color.0)),
            Paint::Own => surface.with_albedo_factor(AlbedoFactor(own())),
            Paint::Deviation(_) => self.strip(mesh, 1, mesh.positions.iter().map(|_| 0.5)),
        }
    }

    /// Returns a surface coloured by a strip that changes with time; `along` is the position of
    /// each vertex on the strip, 0 to 1.
    fn strip(&self, mesh: &LinkMesh, width: usize, along: impl Iterator<Item = f32>) -> Mesh3D {
        if !matches!(self.look.paint, Paint::Deviation(_)) {
            return self.painted(mesh);
        }
        let surface = plain(mesh).with_vertex_texcoords(along.map(|x| [x.clamp(0.0, 1.0), 0.5]));
        surface.with_albedo_texture_format(TintTrack::format(width))
    }

    /// Whether the robot is coloured by its distance from the rigid twin and has surfaces that show
    /// it.
    pub(crate) fn is_colored(&self) -> bool {
        matches!(self.look.paint, Paint::Deviation(_)) && self.skeleton.is_none()
    }

    /// Parent entity of the robot.
    pub(crate) fn root(&self) -> &EntityPath {
        &self.look.root
    }

    /// Writes the tool as a line from the frame of its link to the TCP: most robot files have no
    /// mesh for it.
    pub(crate) fn tool(&self, X_TL: &Pose, stream: &RrdStream) -> Result<()> {
        const SHORTEST_M: f64 = 0.01;
        if X_TL.translation.vector.norm() < SHORTEST_M {
            return Ok(());
        }
        let color = match self.look.paint {
            Paint::Ghost => Color(colors::ghost()),
            Paint::Plain(color) => color,
            Paint::Own | Paint::Deviation(_) => colors::total(),
        };
        let line =
            LineStrips3D::new([[point(X_TL), [0.0; 3]]]).with_colors([color]).with_radii([Radius::new_ui_points(2.5)]);
        stream.constant(&self.look.root.join(&path(["tcp", "tool"])), &line)
    }

    /// Adds a sample. `twin` is the robot as drawn; `sample` has the real poses for the distance
    /// from the rigid twin.
    pub(crate) fn push(&mut self, when: Instant, twin: &TwinSample, sample: &Sample) {
        for (link, track) in &mut self.links {
            track.push(when, &twin.X_WL[*link]);
        }
        self.tcp.push(when, &twin.X_WT);
        if let Some(skeleton) = &mut self.skeleton {
            skeleton.push(when, &twin.X_WL);
        }
        if let Paint::Deviation(scale) = self.look.paint {
            for (link, middle, track) in &mut self.tints {
                let [flexible, rigid] = [&sample.flexible, &sample.rigid].map(|twin| twin.X_WL[*link] * *middle);
                track.push(when, [scale.rgb((flexible - rigid).norm())]);
            }
        }
        for bent in &mut self.bent {
            bent.push(when, twin, sample, &self.look);
        }
    }

    pub(crate) fn tracks_mut(&mut self) -> impl Iterator<Item = &mut dyn Track> {
        let bent = self.bent.iter_mut().flat_map(|bent| {
            let tints = bent.tint.iter_mut().flat_map(|(middle, far)| [middle as &mut dyn Track, far]);
            [&mut bent.shape as &mut dyn Track, &mut bent.far].into_iter().chain(tints)
        });
        let links = self.links.iter_mut().map(|(_, track)| track).chain([&mut self.tcp]);
        let tints = self.tints.iter_mut().map(|(_, _, track)| track as &mut dyn Track);
        let skeleton = self.skeleton.as_mut().map(|track| track as &mut dyn Track);
        links.map(|track| track as &mut dyn Track).chain(bent).chain(tints).chain(skeleton)
    }
}

fn plain(mesh: &LinkMesh) -> Mesh3D {
    let surface = Mesh3D::new(mesh.positions.iter().copied()).with_triangle_indices(mesh.triangles.iter().copied());
    match mesh.normals.len() == mesh.positions.len() {
        true => surface.with_vertex_normals(mesh.normals.iter().copied()),
        false => surface,
    }
}

impl BentTracks {
    fn push(&mut self, when: Instant, twin: &TwinSample, sample: &Sample, look: &RobotAppearance) {
        let (first, count) = self.stations;
        let shown = stations_in_link(twin, self.link, first, count);
        let line = self.middle.line();
        self.far.push(when, &line.bent(&shown).section(line.length()));
        if let (Paint::Deviation(scale), Some((middle, far))) = (look.paint, &mut self.tint) {
            let real = stations_in_link(&sample.flexible, self.link, first, count);
            let tints = tints(line, &real, sample, self.link, scale);
            far.push(when, [tints[TINTS - 1]]);
            middle.push(when, tints);
        }
        let still = |written: &Vec<Pose>| !moved(written, &shown, line.length(), look.tolerance_m);
        if self.written.as_ref().is_some_and(still) || self.last.is_some_and(|last| when.0 - last < look.every_ns) {
            return;
        }
        self.last = Some(when.0);
        let rounded = |p: [f32; 3]| match look.quantum_m {
            quantum if quantum > 0.0 => p.map(|x| (x / quantum).round() * quantum),
            _ => p,
        };
        self.shape.push(when, self.middle.positions(&shown).map(rounded));
        self.written = Some(shown);
    }
}

/// Whether a vertex may have moved by more than a tolerance (m).
fn moved(before: &[Pose], now: &[Pose], length: f64, tolerance_m: f64) -> bool {
    before.iter().zip(now).any(|(a, b)| {
        let turn = rotation_vector((a.rotation.inverse() * b.rotation).matrix()).norm();
        // Vertices are assumed within 0.2 of the length of the line.
        (a.translation.vector - b.translation.vector).norm() + 0.2 * length * turn > tolerance_m
    })
}

/// Returns the colours along a bent link: distance of its line from that of the rigid twin.
fn tints(line: &BendLine, real: &[Pose], sample: &Sample, link: usize, scale: ColorScale) -> [[u8; 3]; TINTS] {
    let (X_flexible, X_rigid) = (&sample.flexible.X_WL[link], &sample.rigid.X_WL[link]);
    let bent = line.bent(real);
    std::array::from_fn(|k| {
        let s = line.length() * (k as f64 + 0.5) / TINTS as f64;
        let point = line.point(s);
        let deviation = X_flexible * bent.point(s) - X_rigid * point;
        scale.rgb(deviation.norm())
    })
}
