//! Topics of a recording: names, message types, qualities of service.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Seek, Write};

use mcap::{McapResult, Writer};

use super::definitions::schema_text;
use crate::RunHeader;

/// Channel numbers of all topics. Those of a rigid twin exist only if there is one.
#[derive(Debug)]
pub(crate) struct Channels {
    /// Only if there is a URDF.
    pub(crate) robot_description: Option<u16>,
    pub(crate) tf: u16,
    pub(crate) tf_static: u16,
    pub(crate) joint_states: u16,
    pub(crate) tcp_flexible: u16,
    pub(crate) rigid: Option<RigidChannels>,
    pub(crate) elastic: Vec<ElasticChannels>,
    pub(crate) solver: u16,
    pub(crate) energy: u16,
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

impl Channels {
    /// Adds all topics of a run to the file.
    pub(crate) fn add<W: Write + Seek>(writer: &mut Writer<W>, header: &RunHeader) -> McapResult<Self> {
        let mut add = |topic: &str, kind: &str, note: &str| add_channel(writer, topic, kind, note);
        const ARRAY: &str = "std_msgs/Float64MultiArray";
        const JOINTS: &str = "sensor_msgs/JointState";
        const POSE: &str = "geometry_msgs/PoseStamped";
        const TWIST: &str = "geometry_msgs/TwistStamped";

        let robot_description = match header.urdf.is_empty() {
            true => None,
            false => Some(add("/robot_description", "std_msgs/String", "URDF as read")?),
        };
        let tf = add("/tf", "tf2_msgs/TFMessage", "flexible robot; rigid twin with the prefix rigid/")?;
        let tf_static = add("/tf_static", "tf2_msgs/TFMessage", "base and fixed links, once")?;
        let joint_states = add("/joint_states", JOINTS, "flexible robot; effort is what the drives must supply")?;
        let tcp_flexible = add("/tcp/flexible", POSE, "tool centre point of the flexible robot")?;
        let rigid = match header.has_rigid {
            false => None,
            true => Some(RigidChannels {
                joint_states: add("/rigid/joint_states", JOINTS, "rigid twin; effort is what the drives must supply")?,
                tcp: add("/tcp/rigid", POSE, "tool centre point of the rigid twin")?,
                error: add(
                    "/tcp/error",
                    TWIST,
                    "not a velocity: TCP error, flexible minus rigid, world axes; linear = translation [m], angular = rotation vector [rad]",
                )?,
                error_plot: add("/tcp/error_plot", ARRAY, "translation of /tcp/error, for plotting")?,
                error_path: add(
                    "/tcp/error_path",
                    TWIST,
                    "not a velocity: TCP error, flexible minus rigid, along tangent, normal and binormal of the rigid path; linear = translation [m], angular = rotation vector [rad]",
                )?,
                error_path_plot: add("/tcp/error_path_plot", ARRAY, "translation of /tcp/error_path, for plotting")?,
            }),
        };
        let mut elastic = Vec::new();
        for (name, element) in topic_names(&header.elements).iter().zip(&header.elements) {
            let load = format!("load of {element} on its distal part, axes of the proximal face [N, N m]");
            let deflection = format!("deflection of {element}, axes of the proximal face [m, rad]");
            elastic.push(ElasticChannels {
                load: add(&format!("/elastic/{name}"), "geometry_msgs/WrenchStamped", &load)?,
                deflection: add(&format!("/elastic/{name}/deflection"), ARRAY, &deflection)?,
            });
        }
        let solver = add("/diagnostics/solver", ARRAY, "stepper")?;
        let energy = add("/energy", ARRAY, "energies of the flexible robot [J]")?;

        Ok(Self { robot_description, tf, tf_static, joint_states, tcp_flexible, rigid, elastic, solver, energy })
    }
}

fn add_channel<W: Write + Seek>(writer: &mut Writer<W>, topic: &str, kind: &str, note: &str) -> McapResult<u16> {
    // ROS 2 names a type package/msg/Type in the file and package/Type inside definitions.
    let name = kind.replacen('/', "/msg/", 1);
    let schema = writer.add_schema(&name, "ros2msg", schema_text(kind).as_bytes())?;
    let latched = ["/robot_description", "/tf_static"].contains(&topic);
    let metadata = BTreeMap::from([
        ("offered_qos_profiles".to_owned(), qos_profile(latched)),
        ("description".to_owned(), note.to_owned()),
    ]);
    writer.add_channel(schema, topic, "cdr", &metadata)
}

/// Quality of service as `ros2 bag` writes it. Latched topics reach subscribers that come late.
fn qos_profile(latched: bool) -> String {
    const FOREVER: &str = "\n    sec: 9223372036\n    nsec: 854775807";
    let (depth, durability) = if latched { (1, "transient_local") } else { (10, "volatile") };
    format!(
        "- history: keep_last\n  depth: {depth}\n  reliability: reliable\n  durability: {durability}\n  \
         deadline:{FOREVER}\n  lifespan:{FOREVER}\n  liveliness: automatic\n  \
         liveliness_lease_duration:{FOREVER}\n  avoid_ros_namespace_conventions: false\n"
    )
}

/// Names turned into valid and distinct parts of a ROS topic: letters, digits and `_`, no digit first.
fn topic_names(names: &[String]) -> Vec<String> {
    let mut taken = BTreeSet::new();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn element_names_become_valid_and_distinct_topics() {
        let names = ["lower_arm", "lower arm", "lower.arm", "3rd", ""].map(str::to_owned);
        assert_eq!(topic_names(&names), ["lower_arm", "lower_arm_2", "lower_arm_3", "_3rd", "_"]);
    }
}
