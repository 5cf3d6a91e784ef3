//! Topics of a recording: names, message types, quality of service.
//!
//! Rerun plots eight topics of joint states and arrays by default, in the order of their names. So
//! the TCP error has a name that sorts first, and data that would take all eight places, such as
//! the deflection of each element, has a type that Rerun does not plot.

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use super::definitions::schema_text;
use super::frames::is_magnified;
use super::output::Output;
use crate::RunHeader;

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
    pub(crate) elastic: Vec<ElasticChannels>,
    /// Present if there are elastic elements.
    pub(crate) elastic_joint_states: Option<u16>,
    /// Present if there is a rigid twin and the header announces the static error.
    pub(crate) static_error: Option<u16>,
    /// Present if there are contributors.
    pub(crate) contributions: Option<u16>,
    /// Present if there are gauges.
    pub(crate) gauges: Option<u16>,
    pub(crate) solver: u16,
    pub(crate) energy: u16,
    pub(crate) events: u16,
    pub(crate) markers: MarkerChannels,
}

/// Topics of markers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MarkerChannels {
    /// Present if there are meshes.
    pub(crate) surfaces: Option<u16>,
    pub(crate) paths: u16,
    /// Present if there is a magnified arm.
    pub(crate) error: Option<u16>,
}

/// Topics of the rigid twin and of the comparison with it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RigidChannels {
    pub(crate) joint_states: u16,
    pub(crate) tcp: u16,
    pub(crate) error: u16,
    pub(crate) error_plot: u16,
    pub(crate) error_path: u16,
    pub(crate) error_path_plot: u16,
}

/// Topics of one elastic element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ElasticChannels {
    pub(crate) load: u16,
    pub(crate) deflection: u16,
}

const ARRAY: &str = "std_msgs/Float64MultiArray";
const JOINTS: &str = "sensor_msgs/JointState";
const POSE: &str = "geometry_msgs/PoseStamped";
const TWIST: &str = "geometry_msgs/TwistStamped";
const WRENCH: &str = "geometry_msgs/WrenchStamped";
const MARKERS: &str = "visualization_msgs/MarkerArray";

impl Channels {
    /// Adds all topics of a run to the file.
    pub(crate) fn add(output: &mut Output, header: &RunHeader) -> io::Result<Self> {
        let robot_description =
            add_if(!header.urdf.is_empty(), output, "/robot_description", "std_msgs/String", "URDF as read")?;
        let trees = "flexible robot with stations along its bent links; rigid twin below rigid/; magnified arm below magnified/";
        let tf = add(output, "/tf", "tf2_msgs/TFMessage", trees)?;
        let tf_static = add(output, "/tf_static", "tf2_msgs/TFMessage", "base and fixed links, once")?;
        let what = "flexible robot; effort is the required force of the drives";
        let joint_states = add(output, "/joint_states", JOINTS, what)?;
        let tcp_flexible = add(output, "/tcp/flexible", POSE, "tool centre point of the flexible robot")?;
        let rigid = header.has_rigid.then(|| RigidChannels::add(output)).transpose()?;
        let elements = topic_names(&header.elements).into_iter().zip(&header.elements);
        let elastic = elements.map(|(topic, element)| ElasticChannels::add(output, &topic, element));
        let elastic = elastic.collect::<io::Result<_>>()?;
        let what = "all elastic elements by name: position = deflection [m, rad], effort = load on the distal part [N, N m], axes of \
                    the proximal face";
        let elastic_joint_states = add_if(!header.elements.is_empty(), output, "/elastic/joint_states", JOINTS, what)?;
        let what = "static part of /tcp/error: the TCP error if the arm stood still where it is, world axes [m]";
        let static_error = add_if(header.has_rigid && header.has_static, output, "/tcp/static_error", ARRAY, what)?;
        let what = "displacement of the TCP caused by each flexible link or drive, world axes [m]";
        let contributions = add_if(!header.contributors.is_empty(), output, "/tcp/contributions", ARRAY, what)?;
        let what = "strain gauges [m/m] and stress points [Pa] of links";
        let gauges = add_if(!header.gauges.is_empty(), output, "/gauges", ARRAY, what)?;
        let what = "surfaces of the links in their frames: flexible as in the URDF, rigid twin as a ghost, magnified arm in blue";
        let surfaces = add_if(!header.meshes.is_empty(), output, "/markers", MARKERS, what)?;
        let what = format!("TCP error from the rigid tool on, drawn {} times", header.magnification);
        let error = add_if(is_magnified(header), output, "/markers/error", MARKERS, &what)?;
        let solver = add(output, "/solver", ARRAY, "stepper")?;
        let energy = add(output, "/energy", ARRAY, "energies of the flexible robot [J]")?;
        let what = "events; name = kind; written at the end of the run, with the times of the events";
        let events = add(output, "/events", "rcl_interfaces/Log", what)?;
        let paths = add(output, "/markers/path", MARKERS, "paths of the tool so far, each second")?;
        let markers = MarkerChannels { surfaces, paths, error };
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
            markers,
        })
    }
}

impl RigidChannels {
    fn add(output: &mut Output) -> io::Result<Self> {
        let mut add = |topic: &str, kind: &str, note: &str| add(output, topic, kind, note);
        let what = "not a velocity: TCP error, flexible minus rigid, world axes; linear = translation [m], angular = rotation vector [rad]";
        let along = "not a velocity: TCP error, flexible minus rigid, along tangent, normal and binormal of the rigid path; linear = translation [m], angular = rotation vector [rad]";
        Ok(Self {
            joint_states: add("/rigid/joint_states", JOINTS, "rigid twin; effort is the required force of the drives")?,
            tcp: add("/tcp/rigid", POSE, "tool centre point of the rigid twin")?,
            error: add("/tcp/error", TWIST, what)?,
            error_plot: add("/deviation/tcp", ARRAY, "translation of /tcp/error, for plotting")?,
            error_path: add("/tcp/error_path", TWIST, along)?,
            error_path_plot: add("/deviation/tcp_path", ARRAY, "translation of /tcp/error_path, for plotting")?,
        })
    }
}

impl ElasticChannels {
    fn add(output: &mut Output, topic: &str, element: &str) -> io::Result<Self> {
        let load = format!(
            "load of {element} on its distal part, axes of the proximal face [N, N m], as in /elastic/joint_states"
        );
        let deflection = format!("not a velocity: deflection of {element}, axes of the proximal face [m, rad]");
        Ok(Self {
            load: add(output, &format!("/elastic/{topic}"), WRENCH, &load)?,
            deflection: add(output, &format!("/elastic/{topic}/deflection"), TWIST, &deflection)?,
        })
    }
}

fn add_if(wanted: bool, output: &mut Output, topic: &str, kind: &str, note: &str) -> io::Result<Option<u16>> {
    wanted.then(|| add(output, topic, kind, note)).transpose()
}

fn add(output: &mut Output, topic: &str, kind: &str, note: &str) -> io::Result<u16> {
    // ROS 2 names a type package/msg/Type in the file and package/Type inside definitions.
    let name = kind.replacen('/', "/msg/", 1);
    let latched = ["/robot_description", "/tf_static", "/markers", "/markers/path"].contains(&topic);
    let metadata = BTreeMap::from([
        ("offered_qos_profiles".to_owned(), qos_profile(latched)),
        ("description".to_owned(), note.to_owned()),
    ]);
    output.add_channel(topic, &name, &schema_text(kind), &metadata)
}

/// Quality of service in the form written by `ros2 bag`. Late subscribers also receive latched
/// topics.
fn qos_profile(latched: bool) -> String {
    const FOREVER: &str = "\n    sec: 9223372036\n    nsec: 854775807";
    let (depth, durability) = if latched { (1, "transient_local") } else { (10, "volatile") };
    format!(
        "- history: keep_last\n  depth: {depth}\n  reliability: reliable\n  durability: {durability}\n  \
         deadline:{FOREVER}\n  lifespan:{FOREVER}\n  liveliness: automatic\n  \
         liveliness_lease_duration:{FOREVER}\n  avoid_ros_namespace_conventions: false\n"
    )
}

/// Turns names into valid and distinct parts of a ROS topic: letters, digits and `_`, no digit
/// first.
pub fn topic_names(names: &[String]) -> Vec<String> {
    // `/elastic/joint_states` is taken.
    let mut taken = BTreeSet::from(["joint_states".to_owned()]);
    let mut distinct = |base: String| {
        let numbered = (2..).map(|n| format!("{base}_{n}"));
        let mut candidates = std::iter::once(base.clone()).chain(numbered);
        candidates.find(|name| taken.insert(name.clone())).unwrap_or(base)
    };
    let valid = |name: &String| {
        let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        if plain.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') { plain } else { format!("_{plain}") }
    };
    names.iter().map(|name| distinct(valid(name))).collect()
}
