//! What a run gives: a [`RunHeader`] once, then one [`Sample`] per logged instant, its
//! [`RunResult`] at the end.
//!
//! All poses are in the world; SI units; six-vectors linear first. "Flexible" is the simulated
//! robot, "rigid" its twin with every elastic coordinate held at zero.

use std::path::PathBuf;

use flexarm_spatial::Pose;

/// The first of January 2000, 0:00 UTC (ns since 1970): when runs begin that are not told when, so
/// that equal runs are equal files. Not 0, which ROS reads as no time at all.
pub const START_NS: u64 = 946_684_800_000_000_000;

/// What stays the same during a run.
#[derive(Clone, Debug, Default)]
pub struct RunHeader {
    /// Name of the robot; first part of entity paths.
    pub robot: String,
    /// Name of the trajectory.
    pub trajectory: String,
    /// The robot's URDF text, as read.
    pub urdf: String,
    /// Names of the actuated joints, in coordinate order.
    pub joints: Vec<String>,
    /// Which of them slide instead of turning; all turn if empty.
    pub prismatic: Vec<bool>,
    /// Links of the URDF, parents before children; the first is the base.
    pub links: Vec<LinkInfo>,
    /// Names of the elastic elements (one per flexible link joint).
    pub elements: Vec<String>,
    /// Triangle meshes in link axes.
    pub meshes: Vec<LinkMesh>,
    /// Name of the frame that is the tool centre point.
    pub tcp: String,
    /// Labelled text: groups such as `flexarm.run` with their key-value pairs.
    pub metadata: Vec<(String, Vec<(String, String)>)>,
    /// Files to put into the recording.
    pub attachments: Vec<Attachment>,
    /// A Markdown summary of the set-up for the viewer's text panel.
    pub description: String,
    /// Whether samples carry a rigid twin.
    pub has_rigid: bool,
    /// Whether samples carry [`Sample::static_m`], which without a twin nobody can say.
    pub has_static: bool,
    /// Samples per second.
    pub log_rate_hz: f64,
    /// Time of simulated time zero in recordings whose times have a date (ns since 1970);
    /// [`START_NS`] without it.
    pub start_ns: Option<u64>,
    /// Step of the stepper (s): times of samples are whole multiples of it; 0 if it is not known.
    pub step_s: f64,
    /// Links that bend.
    pub bends: Vec<BendInfo>,
    /// Flexible links and drives that move the tool, in the order of [`Sample::contributions`].
    pub contributors: Vec<String>,
    /// What is shown from which instant on, in a recording of shapes that have no size of their
    /// own, such as modes: errors and deflections in it are drawn ones and are not told. Empty for
    /// a run.
    pub captions: Vec<Caption>,
    /// What stands still around the robot, such as the points of a map.
    pub scenery: Vec<Scenery>,
    /// Factor by which pictures show deflections; 0 for recordings without a magnified arm.
    pub magnification: f64,
    /// Deviation from the rigid twin that gets the last colour of the scale (m).
    pub color_scale_m: f64,
    /// Box in the world that holds all link frames at all times: lowest and highest corner (m).
    /// What to point a camera at.
    pub volume: Option<[[f64; 3]; 2]>,
}

impl RunHeader {
    /// Number of the colour that a link, spring or joint has in all plots of the run: contributors
    /// are counted first, then springs and joints of other names.
    #[must_use]
    pub fn color_number(&self, name: &str) -> usize {
        let mut known: Vec<&String> = Vec::new();
        for other in self.contributors.iter().chain(&self.elements).chain(&self.joints) {
            if other == name {
                break;
            }
            if !known.contains(&other) {
                known.push(other);
            }
        }
        known.len()
    }
}

/// The name of what is shown from an instant on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Caption {
    /// When (s).
    pub from_s: f64,
    /// In a few words.
    pub text: String,
}

/// Something that stands in the world and does not move.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenery {
    /// Title of the view that shows it; those of one title are shown together, those without one in
    /// all views.
    pub view: String,
    /// Name, unique within the view.
    pub name: String,
    /// What it is.
    pub form: SceneryForm,
}

/// Shape and colours of what stands still (m, world; red, green, blue, alpha).
#[derive(Clone, Debug, PartialEq)]
pub enum SceneryForm {
    /// Balls.
    Points {
        /// Centres.
        places: Vec<[f32; 3]>,
        /// One per ball, or one for all.
        colors: Vec<[u8; 4]>,
        /// Of every ball.
        radius_m: f32,
        /// One per ball, or none.
        labels: Vec<String>,
    },
    /// A surface of triangles.
    Surface {
        /// Corners.
        places: Vec<[f32; 3]>,
        /// Corner indices.
        triangles: Vec<[u32; 3]>,
        /// Of all of it.
        color: [u8; 4],
    },
    /// Ellipsoids.
    Ellipsoids {
        /// Centres.
        places: Vec<[f32; 3]>,
        /// Half axes.
        half_axes_m: Vec<[f32; 3]>,
        /// Rotations, x, y, z, w.
        quaternions: Vec<[f32; 4]>,
        /// One per ellipsoid.
        colors: Vec<[u8; 4]>,
    },
    /// The edges of a box.
    Box {
        /// Lowest and highest corner.
        corners: [[f32; 3]; 2],
        /// Of all edges.
        color: [u8; 4],
    },
}

/// How a link bends: stations along the line from its near interface to its far one.
///
/// In a sample [`TwinSample::X_WS`] says where the stations are; between them the link is drawn as
/// a beam.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BendInfo {
    /// Index into [`RunHeader::links`].
    pub link: usize,
    /// Poses of the undeformed stations in the link, near interface first.
    pub X_LS: Vec<Pose>,
    /// Links that hang on a station: index into [`RunHeader::links`], number of the station.
    pub carries: Vec<(usize, usize)>,
}

/// A link and the link that carries it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LinkInfo {
    /// Name of the link.
    pub name: String,
    /// Index of the parent in `RunHeader::links`; `None` for the base.
    pub parent: Option<usize>,
    /// Whether the joint to the parent is fixed (and stays so in the flexible robot).
    pub fixed: bool,
}

/// A surface fixed to a link, in metres and link axes.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkMesh {
    /// Index into `RunHeader::links`.
    pub link: usize,
    /// Name, unique per link.
    pub name: String,
    /// Corners (m).
    pub positions: Vec<[f32; 3]>,
    /// Normals, one per corner.
    pub normals: Vec<[f32; 3]>,
    /// Corner indices.
    pub triangles: Vec<[u32; 3]>,
    /// Red, green, blue, alpha, 0 to 1.
    pub color: [f32; 4],
    /// File it came from, if any.
    pub file: Option<PathBuf>,
}

/// A file inside a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// File name.
    pub name: String,
    /// Media type, for instance `application/xml`.
    pub media_type: String,
    /// Contents.
    pub bytes: Vec<u8>,
}

/// One of the two robots at one instant.
#[derive(Debug, Default)]
pub struct TwinSample {
    /// Positions of the actuated joints (rad or m).
    pub q: Vec<f64>,
    /// Velocities.
    pub qdot: Vec<f64>,
    /// Forces the drives must supply (N m or N).
    pub effort: Vec<f64>,
    /// Pose of each link of the header in the world.
    pub X_WL: Vec<Pose>,
    /// Pose of the tool centre point in the world.
    pub X_WT: Pose,
    /// Poses of the stations of all [`RunHeader::bends`] in the world, one link after the other;
    /// empty for the rigid twin, whose stations are where [`BendInfo::X_LS`] says.
    pub X_WS: Vec<Pose>,
}

impl Clone for TwinSample {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    /// Without allocation where there is room already.
    fn clone_from(&mut self, source: &Self) {
        let Self { q, qdot, effort, X_WL, X_WT, X_WS } = source;
        self.q.clone_from(q);
        self.qdot.clone_from(qdot);
        self.effort.clone_from(effort);
        self.X_WL.clone_from(X_WL);
        self.X_WT = *X_WT;
        self.X_WS.clone_from(X_WS);
    }
}

/// One elastic element at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ElasticSample {
    /// Deflection in the proximal face's axes: 3 translations (m), 3 angles (rad).
    pub deflection: [f64; 6],
    /// Load on the distal part: force (N), moment (N m).
    pub load: [f64; 6],
}

/// Energies of the flexible robot (J).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergySample {
    /// Kinetic.
    pub kinetic: f64,
    /// Gravity, zero at the world origin.
    pub potential: f64,
    /// Stored in the elastic elements.
    pub elastic: f64,
}

/// One logged instant.
#[derive(Debug, Default)]
pub struct Sample {
    /// Time since the start (s).
    pub time_s: f64,
    /// Steps taken so far.
    pub step: u64,
    /// Simulated robot.
    pub flexible: TwinSample,
    /// Rigid twin; meaningless unless `RunHeader::has_rigid`.
    pub rigid: TwinSample,
    /// TCP error flexible minus rigid, world axes: translation (m), rotation vector (rad).
    pub error_world: [f64; 6],
    /// The same in path axes: tangential, normal, binormal.
    pub error_path: [f64; 6],
    /// Static part of the error: the TCP error if the arm stood still where it is, under weight and
    /// the loads of the instant (m, world axes); meaningless unless [`RunHeader::has_static`].
    pub static_m: [f64; 3],
    /// Elastic elements, in header order.
    pub elastic: Vec<ElasticSample>,
    /// TCP displacement that each contributor's deflection alone causes (m, world axes), in header
    /// order.
    pub contributions: Vec<[f64; 3]>,
    /// Energies.
    pub energy: EnergySample,
    /// Iterations of the last step (0 for explicit steppers) and residual norm.
    pub solver: [f64; 2],
}

impl Clone for Sample {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    /// Without allocation where there is room already.
    fn clone_from(&mut self, source: &Self) {
        let Self {
            time_s,
            step,
            flexible,
            rigid,
            error_world,
            error_path,
            static_m,
            elastic,
            contributions,
            energy,
            solver,
        } = source;
        (self.time_s, self.step, self.energy, self.solver) = (*time_s, *step, *energy, *solver);
        (self.error_world, self.error_path, self.static_m) = (*error_world, *error_path, *static_m);
        self.flexible.clone_from(flexible);
        self.rigid.clone_from(rigid);
        self.elastic.clone_from(elastic);
        self.contributions.clone_from(contributions);
    }
}

/// What kind of thing happened at an instant of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EventKind {
    /// A move begins.
    MoveStart,
    /// A move ends; the joints rest.
    MoveEnd,
    /// The TCP error is largest.
    Peak,
    /// The TCP error stays within the settling band from here on.
    Settled,
    /// A limit is passed.
    Limit,
    /// A load or payload changes.
    Load,
    /// The run was given up.
    Stopped,
}

impl EventKind {
    /// A word for files.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::MoveStart => "move start",
            Self::MoveEnd => "move end",
            Self::Peak => "peak",
            Self::Settled => "settled",
            Self::Limit => "limit",
            Self::Load => "load",
            Self::Stopped => "stopped",
        }
    }

    /// The kind that a word of [`EventKind::word`] names.
    #[must_use]
    pub fn from_word(word: &str) -> Option<Self> {
        let all = [Self::MoveStart, Self::MoveEnd, Self::Peak, Self::Settled, Self::Limit, Self::Load, Self::Stopped];
        all.into_iter().find(|kind| kind.word() == word)
    }
}

/// Something that happened at an instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// When (s).
    pub time_s: f64,
    /// What kind of thing.
    pub kind: EventKind,
    /// In words, with numbers and units.
    pub text: String,
}

/// What is known only at the end of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunResult {
    /// Label and value pairs for programs.
    pub figures: Vec<(String, String)>,
    /// The same for people: name, and value with its unit.
    pub readable: Vec<(String, String)>,
    /// What happened, in order of time.
    pub events: Vec<Event>,
    /// Files about the result to put into the recording, such as its summary.
    pub attachments: Vec<Attachment>,
}
