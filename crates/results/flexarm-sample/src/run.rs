//! Output of a run: a [`RunHeader`] once, then one [`Sample`] per logged instant, a [`RunResult`]
//! at the end.
//!
//! All poses are in the world; SI units; six-vectors linear first. "Flexible" is the simulated
//! robot, "rigid" its twin with every elastic coordinate held at zero.
//!
//! Not here: how a run is computed (`flexarm-run`), formats of recordings (`flexarm-log`).

use std::path::PathBuf;

use flexarm_spatial::Pose;
use serde::{Deserialize, Serialize};

/// 1 January 2000, 0:00 UTC (ns since 1970): default start time of runs, so that equal runs give
/// equal files. Not 0, which ROS interprets as no time.
pub const START_NS: u64 = 946_684_800_000_000_000;

/// Constant data of a run.
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
    /// Whether each joint is prismatic; all are revolute if empty.
    pub prismatic: Vec<bool>,
    /// Links of the URDF, parents before children; the first is the base.
    pub links: Vec<LinkInfo>,
    /// Names of the elastic elements (one per flexible link joint).
    pub elements: Vec<String>,
    /// Triangle meshes in link axes.
    pub meshes: Vec<LinkMesh>,
    /// Name of the TCP frame.
    pub tcp: String,
    /// Labelled text: groups such as `flexarm.run` with their key-value pairs.
    pub metadata: Vec<(String, Vec<(String, String)>)>,
    /// Files to put into the recording.
    pub attachments: Vec<Attachment>,
    /// A Markdown summary of the set-up for the viewer's text panel.
    pub description: String,
    /// Whether samples carry a rigid twin.
    pub has_rigid: bool,
    /// Whether the result has surfaces coloured by stress ([`RunResult::scenery`]).
    pub has_stress: bool,
    /// Whether samples carry [`Sample::static_m`], which needs the rigid twin.
    pub has_static: bool,
    /// Samples per second.
    pub log_rate_hz: f64,
    /// Absolute time of simulated time zero in recordings with dates (ns since 1970); [`START_NS`]
    /// if `None`.
    pub start_ns: Option<u64>,
    /// Step size of the stepper (s); sample times are whole multiples of it; 0 if unknown.
    pub step_s: f64,
    /// Flexible links.
    pub bends: Vec<BendInfo>,
    /// Flexible links and drives that contribute to the TCP error, in the order of
    /// [`Sample::contributions`].
    pub contributors: Vec<String>,
    /// Channels of strain gauges and stress points, in the order of [`Sample::gauges`]. A name ends
    /// in its quantity ([`GAUGE_ENDS`]).
    pub gauges: Vec<String>,
    /// Captions by start time, in a recording of shapes without a magnitude of their own, such as
    /// modes: its errors and deflections are only drawn, not reported. Empty for a run.
    pub captions: Vec<Caption>,
    /// Static objects around the robot, such as the points of a map.
    pub scenery: Vec<Scenery>,
    /// Magnification of deflections in pictures; 0 for recordings without a magnified arm.
    pub magnification: f64,
    /// Deviation from the rigid twin at the upper end of the colour scale (m).
    pub color_scale_m: f64,
    /// Box in the world that contains all link frames at all times, for camera placement: lowest
    /// and highest corner (m).
    pub volume: Option<[[f64; 3]; 2]>,
}

impl RunHeader {
    /// Returns the colour index of a link, spring or joint in all plots of the run: contributors
    /// come first, then springs and joints with other names.
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

    /// Returns the gauge channels of a quantity: index in [`Self::gauges`], and name to display.
    pub fn gauges_of(&self, quantity: GaugeQuantity) -> impl Iterator<Item = (usize, String)> {
        let is_strain = quantity == GaugeQuantity::Strain;
        let own = self.gauges.iter().enumerate().filter(move |(_, name)| name.ends_with("_strain") == is_strain);
        own.map(|(k, name)| {
            let shown = GAUGE_ENDS.iter().find_map(|(end, shown)| Some(format!("{}{shown}", name.strip_suffix(end)?)));
            (k, shown.unwrap_or_else(|| name.clone()))
        })
    }
}

/// Ends of [`RunHeader::gauges`], and the words that replace them in pictures.
pub const GAUGE_ENDS: [(&str, &str); 4] = [
    ("_strain", ""),
    ("_von_mises_pa", " von Mises"),
    ("_principal_1_pa", " principal 1"),
    ("_principal_3_pa", " principal 3"),
];

/// Quantity of a gauge channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GaugeQuantity {
    /// Strain (m/m).
    Strain,
    /// Stress (Pa).
    Stress,
}

impl GaugeQuantity {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Strain, Self::Stress];

    /// Returns the name of the quantity, the unit in pictures, and the factor from SI units.
    #[must_use]
    pub fn shown(self) -> (&'static str, &'static str, f64) {
        match self {
            Self::Strain => ("strain", "µm/m", 1e6),
            Self::Stress => ("stress", "MPa", 1e-6),
        }
    }
}

/// Caption shown from an instant on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Caption {
    /// Time (s).
    pub from_s: f64,
    /// Short text.
    pub text: String,
}

/// View of the links coloured by stress.
pub const STRESS_VIEW: &str = "Stress";

/// A static object in the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scenery {
    /// Title of the view that shows it; objects with the same title are shown together, those
    /// without one in all views.
    pub view: String,
    /// Name, unique within the view.
    pub name: String,
    /// Shape.
    pub form: SceneryForm,
}

/// Shape and colours of a static object (m, world; red, green, blue, alpha).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum SceneryForm {
    /// Spheres.
    Points {
        /// Centres.
        places: Vec<[f32; 3]>,
        /// One per sphere, or one for all.
        colors: Vec<[u8; 4]>,
        /// Radius of every sphere.
        radius_m: f32,
        /// One per sphere, or none.
        labels: Vec<String>,
    },
    /// A surface of triangles.
    Surface {
        /// Corners.
        places: Vec<[f32; 3]>,
        /// Corner indices.
        triangles: Vec<[u32; 3]>,
        /// One per corner, or one for all.
        colors: Vec<[u8; 4]>,
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
        /// Colour of the edges.
        color: [u8; 4],
    },
}

/// Deformation of a link: stations along the line from its near interface to its far one.
///
/// [`TwinSample::X_WS`] of a sample gives the poses of the stations; between them the link is drawn
/// as a beam.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BendInfo {
    /// Index into [`RunHeader::links`].
    pub link: usize,
    /// Poses of the undeformed stations in the link, near interface first.
    pub X_LS: Vec<Pose>,
    /// Links attached to a station: index into [`RunHeader::links`], index of the station.
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
    /// Velocities of the actuated joints (rad/s or m/s).
    pub qdot: Vec<f64>,
    /// Drive forces (N m or N).
    pub effort: Vec<f64>,
    /// Pose of each link of the header in the world.
    pub X_WL: Vec<Pose>,
    /// TCP pose in the world.
    pub X_WT: Pose,
    /// Poses of the stations of all [`RunHeader::bends`] in the world, one link after the other;
    /// empty for the rigid twin, whose stations are given by [`BendInfo::X_LS`].
    pub X_WS: Vec<Pose>,
}

impl Clone for TwinSample {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    /// Does not allocate if the capacity suffices.
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
    /// Deflection in axes of the proximal face: 3 translations (m), 3 angles (rad).
    pub deflection: [f64; 6],
    /// Load on the distal part: force (N), moment (N m).
    pub load: [f64; 6],
}

/// Energies of the flexible robot (J).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergySample {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Gravitational energy, zero at the world origin.
    pub potential: f64,
    /// Energy stored in the elastic elements.
    pub elastic: f64,
}

/// One logged instant.
#[derive(Debug, Default)]
pub struct Sample {
    /// Time since the start (s).
    pub time_s: f64,
    /// Number of steps so far.
    pub step: u64,
    /// Simulated robot.
    pub flexible: TwinSample,
    /// Rigid twin; meaningless unless `RunHeader::has_rigid`.
    pub rigid: TwinSample,
    /// TCP error flexible minus rigid, world axes: translation (m), rotation vector (rad).
    pub error_world: [f64; 6],
    /// The same error in path axes: tangential, normal, binormal.
    pub error_path: [f64; 6],
    /// Static part of the error: the static TCP error at the pose of the instant, under gravity and
    /// the loads of the instant (m, world axes); meaningless unless [`RunHeader::has_static`].
    pub static_m: [f64; 3],
    /// Elastic elements, in header order.
    pub elastic: Vec<ElasticSample>,
    /// TCP displacement due to each contributor's deflection (m, world axes), in header order.
    pub contributions: Vec<[f64; 3]>,
    /// Strain (m/m) or stress (Pa) of each gauge channel, in header order; NaN without
    /// accelerations.
    pub gauges: Vec<f64>,
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

    /// Does not allocate if the capacity suffices.
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
            gauges,
            energy,
            solver,
        } = source;
        (self.time_s, self.step, self.energy, self.solver) = (*time_s, *step, *energy, *solver);
        (self.error_world, self.error_path, self.static_m) = (*error_world, *error_path, *static_m);
        self.flexible.clone_from(flexible);
        self.rigid.clone_from(rigid);
        self.elastic.clone_from(elastic);
        self.contributions.clone_from(contributions);
        self.gauges.clone_from(gauges);
    }
}

/// Kind of an event in a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EventKind {
    /// A move begins.
    MoveStart,
    /// A move ends; the joints rest.
    MoveEnd,
    /// The TCP error reaches its maximum.
    Peak,
    /// The TCP error stays within the settling band from here on.
    Settled,
    /// A limit is exceeded.
    Limit,
    /// A load or payload changes.
    Load,
    /// The run was stopped early.
    Stopped,
}

impl EventKind {
    /// Returns a word for files.
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

    /// Returns the kind for a word of [`EventKind::word`].
    #[must_use]
    pub fn from_word(word: &str) -> Option<Self> {
        let all = [Self::MoveStart, Self::MoveEnd, Self::Peak, Self::Settled, Self::Limit, Self::Load, Self::Stopped];
        all.into_iter().find(|kind| kind.word() == word)
    }
}

/// An event at an instant of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Time (s).
    pub time_s: f64,
    /// Kind of event.
    pub kind: EventKind,
    /// Description, with numbers and units.
    pub text: String,
}

/// Results that are known only at the end of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunResult {
    /// Label and value pairs for programs.
    pub figures: Vec<(String, String)>,
    /// The same for people: name, and value with unit.
    pub readable: Vec<(String, String)>,
    /// Events, in order of time.
    pub events: Vec<Event>,
    /// Files on the result to put into the recording, such as its summary.
    pub attachments: Vec<Attachment>,
    /// Objects to show in a view of their own, such as links coloured by stress.
    pub scenery: Vec<Scenery>,
}
