//! Topics of a recording: names, message types, quality of service.
//!
//! Every group of numbers is a `sensor_msgs/JointState`: Rerun, PlotJuggler and Foxglove label its
//! curves by the names in the message. Start at [`Channels::add`]. Channel numbers follow the order
//! of the calls, so topics are added at the end. Not here: messages ([`super::messages`]).

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use super::definitions::schema_text;
use super::frames::is_magnified;
use super::output::Output;
use crate::RunHeader;
use crate::table::distinct;

/// Channel numbers of all topics. Topics of the rigid twin exist only if there is one.
#[derive(Debug)]
pub(crate) struct Channels {
    /// Present if there is a URDF.
    pub(crate) robot_description: Option<u16>,
    pub(crate) tf: u16,
    pub(crate) tf_static: u16,
    pub(crate) joint_states: u16,
    pub(crate) tcp_flexible: u16,
    pub(crate) rigid: Option<RigidChannels>,
    /// Loads of the elastic elements, for arrows.
    pub(crate) elastic: Vec<u16>,
    /// Present if there are elastic elements.
    pub(crate) elastic_joint_states: Option<Named>,
    /// Present if there is a rigid twin and the header announces the static error.
    pub(crate) static_error: Option<Named>,
    /// Present if there are contributors.
    pub(crate) contributions: Option<Named>,
    /// Present if there are gauges.
    pub(crate) gauges: Option<Named>,
    pub(crate) solver: Named,
    pub(crate) energy: Named,
    pub(crate) events: u16,
    /// Markers of surfaces; present if there are meshes.
    pub(crate) surfaces: Option<u16>,
    /// Markers of the paths of the TCP.
    pub(crate) paths: u16,
    /// Markers of the error; present if there is a magnified arm.
    pub(crate) error_markers: Option<u16>,
}

/// Topic of named numbers, a `sensor_msgs/JointState`.
#[derive(Debug)]
pub(crate) struct Named {
    pub(crate) channel: u16,
    pub(crate) names: Vec<String>,
}

/// Topics of the rigid twin and of the comparison with it.
#[derive(Debug)]
pub(crate) struct RigidChannels {
    pub(crate) joint_states: u16,
    pub(crate) tcp: u16,
    pub(crate) error: Named,
    pub(crate) error_path: Named,
}

const JOINTS: &str = "sensor_msgs/JointState";
const POSE: &str = "geometry_msgs/PoseStamped";
const WRENCH: &str = "geometry_msgs/WrenchStamped";
const MARKERS: &str = "visualization_msgs/MarkerArray";

impl Channels {
    /// Adds all topics of a run to the file.
    pub(crate) fn add(output: &mut Output, header: &RunHeader) -> io::Result<Self> {
        // The robot, its frames and joints.
        let robot_description =
            add_if(!header.urdf.is_empty(), output, "/robot_description", "std_msgs/String", "URDF as read")?;
        let trees = "flexible robot with stations along its bent links; rigid twin below rigid/; magnified arm below magnified/";
        let tf = add(output, "/tf", "tf2_msgs/TFMessage", trees)?;
        let tf_static = add(output, "/tf_static", "tf2_msgs/TFMessage", "base and fixed links, once")?;
        let what = "flexible robot; effort is the required force of the drives";
        let joint_states = add(output, "/joint_states", JOINTS, what)?;
        let tcp_flexible = add(output, "/tcp/flexible", POSE, "tool centre point of the flexible robot")?;
        let rigid = header.has_rigid.then(|| RigidChannels::add(output)).transpose()?;
        // Elastic elements: a topic of each for arrows, and one of all for curves.
        let elastic = wrenches(output, &header.elements)?;
        let what = "all elastic elements by name: position = deflection [m, rad], effort = load on the distal part [N, N m], axes of \
                    the proximal face";
        let names = parts(&header.elements, &ERROR[..6]);
        let elastic_joint_states = named_if(!header.elements.is_empty(), output, "/elastic/joint_states", names, what)?;
        // Causes of the error, and measurements.
        let what = "static part of /tcp/error: the TCP error if the arm stood still where it is, world axes [m]";
        let wanted = header.has_rigid && header.has_static;
        let static_error = named_if(wanted, output, "/tcp/static_error", owned(&ERROR[..3]), what)?;
        let what = "displacement of the TCP caused by each flexible link or drive, world axes [m]";
        let names = parts(&header.contributors, &ERROR[..3]);
        let contributions = named_if(!names.is_empty(), output, "/tcp/contributions", names, what)?;
        let what = "strain gauges [m/m] and stress points [Pa] of links";
        let gauges = named_if(!header.gauges.is_empty(), output, "/gauges", header.gauges.clone(), what)?;
        // Pictures.
        let what = "surfaces of the links in their frames: flexible as in the URDF, rigid twin as a ghost, magnified arm in blue";
        let surfaces = add_if(!header.meshes.is_empty(), output, "/markers", MARKERS, what)?;
        let what = format!("TCP error from the rigid tool on, drawn {} times", header.magnification);
        let error_markers = add_if(is_magnified(header), output, "/markers/error", MARKERS, &what)?;
        // The solver, energies and events; the paths are the last topic.
        let solver = named(output, "/solver", owned(&["iterations", "residual"]), "stepper")?;
        let names = owned(&["kinetic", "potential", "elastic"]);
        let energy = named(output, "/energy", names, "energies of the flexible robot [J]")?;
        let what = "events; name = kind; written at the end of the run, with the times of the events";
        let events = add(output, "/events", "rcl_interfaces/Log", what)?;
        let paths = add(output, "/markers/path", MARKERS, "paths of the tool so far, each second")?;
        Ok(Self {
            robot_description,
            tf,
            tf_static,
            joint_states,
            tcp_flexible,
            rigid,
            elastic,
            elastic_joint_states,
            static_error,
            contributions,
            gauges,
            solver,
            energy,
            events,
            surfaces,
            paths,
            error_markers,
        })
    }
}

impl RigidChannels {
    fn add(output: &mut Output) -> io::Result<Self> {
        let what = "rigid twin; effort is the required force of the drives";
        let joint_states = add(output, "/rigid/joint_states", JOINTS, what)?;
        let tcp = add(output, "/tcp/rigid", POSE, "tool centre point of the rigid twin")?;
        let what = "TCP error, flexible minus rigid, world axes: translation [m], rotation vector [rad], norm of the translation [m]";
        let error = named(output, "/tcp/error", owned(&ERROR), what)?;
        let what = "TCP error, flexible minus rigid, along tangent, normal and binormal of the rigid path: translation [m], rotation \
                    vector [rad]";
        let error_path = named(output, "/tcp/error_path", owned(&PATH_ERROR), what)?;
        Ok(Self { joint_states, tcp, error, error_path })
    }
}

/// Names of the parts of an error in world axes.
const ERROR: [&str; 7] = ["x", "y", "z", "rx", "ry", "rz", "norm"];
/// Names of the parts of an error along the path.
const PATH_ERROR: [&str; 6] = ["tangential", "normal", "binormal", "r_tangential", "r_normal", "r_binormal"];

/// Adds a topic for the load of each elastic element.
fn wrenches(output: &mut Output, elements: &[String]) -> io::Result<Vec<u16>> {
    let wrench = |(topic, element): (String, &String)| {
        let what = format!(
            "load of {element} on its distal part, axes of the proximal face [N, N m], as in /elastic/joint_states"
        );
        add(output, &format!("/elastic/{topic}"), WRENCH, &what)
    };
    topic_names(elements).into_iter().zip(elements).map(wrench).collect()
}

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

/// Returns the names `<name>/<part>`.
fn parts(names: &[String], parts: &[&str]) -> Vec<String> {
    names.iter().flat_map(|name| parts.iter().map(move |part| format!("{name}/{part}"))).collect()
}

fn named(output: &mut Output, topic: &str, names: Vec<String>, note: &str) -> io::Result<Named> {
    Ok(Named { channel: add(output, topic, JOINTS, note)?, names })
}

fn named_if(
    wanted: bool,
    output: &mut Output,
    topic: &str,
    names: Vec<String>,
    note: &str,
) -> io::Result<Option<Named>> {
    wanted.then(|| named(output, topic, names, note)).transpose()
}

fn add_if(wanted: bool, output: &mut Output, topic: &str, kind: &str, note: &str) -> io::Result<Option<u16>> {
    wanted.then(|| add(output, topic, kind, note)).transpose()
}

fn add(output: &mut Output, topic: &str, kind: &str, note: &str) -> io::Result<u16> {
    // ROS 2 names a type package/msg/Type in the file and package/Type inside definitions.
    let name = kind.replacen('/', "/msg/", 1);
    let latched = ["/robot_description", "/tf_static", "/markers", "/markers/path"].contains(&topic);
    let metadata = BTreeMap::from([
        (QUALITY_OF_SERVICE.to_owned(), qos_profile(latched)),
        ("description".to_owned(), note.to_owned()),
    ]);
    output.add_channel(topic, &name, &schema_text(kind), &metadata)
}

/// Key of a channel's quality of service.
pub(crate) const QUALITY_OF_SERVICE: &str = "offered_qos_profiles";

/// Quality of service as `ros2 bag` writes it: the numbers of the enumerations of ROS, which all
/// its releases read (words only the newest ones). Late subscribers also receive latched topics.
fn qos_profile(latched: bool) -> String {
    const FOREVER: &str = "\n    sec: 9223372036\n    nsec: 854775807";
    let (depth, durability) = if latched { (1, TRANSIENT_LOCAL) } else { (10, VOLATILE) };
    format!(
        "- history: {KEEP_LAST}\n  depth: {depth}\n  reliability: {RELIABLE}\n  durability: {durability}\n  \
         deadline:{FOREVER}\n  lifespan:{FOREVER}\n  liveliness: {AUTOMATIC}\n  \
         liveliness_lease_duration:{FOREVER}\n  avoid_ros_namespace_conventions: false\n"
    )
}

const KEEP_LAST: u8 = 1;
const RELIABLE: u8 = 1;
const TRANSIENT_LOCAL: u8 = 1;
const VOLATILE: u8 = 2;
const AUTOMATIC: u8 = 1;

/// Turns names into valid and distinct parts of a ROS topic: letters, digits and `_`, no digit
/// first.
pub fn topic_names(names: &[String]) -> Vec<String> {
    // `/elastic/joint_states` is taken.
    let mut taken = BTreeSet::from(["joint_states".to_owned()]);
    let valid = |name: &String| {
        let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        if plain.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') { plain } else { format!("_{plain}") }
    };
    names.iter().map(|name| distinct(valid(name), &mut taken)).collect()
}
