//! Texts of the ROS 2 message definitions used by a recording.
//!
//! The field lists follow the packages `std_msgs`, `geometry_msgs`, `sensor_msgs`, `tf2_msgs`,
//! `visualization_msgs` (as since Humble, with texture and embedded mesh), `rcl_interfaces` and
//! `builtin_interfaces` of ROS 2; readers decode messages by them.

/// Line between a message and the definitions it depends on.
const SEPARATOR: &str = "================================================================================";

/// A message type: name without `/msg`, fields, and all types it needs, directly or indirectly.
type Definition = (&'static str, &'static str, &'static [&'static str]);

const DEFINITIONS: &[Definition] = &[
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n", &[]),
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n", &["builtin_interfaces/Time"]),
    ("std_msgs/String", "string data\n", &[]),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n", &[]),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n", &[]),
    ("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n", &[]),
    ("geometry_msgs/Transform", "Vector3 translation\nQuaternion rotation\n", &[]),
    ("geometry_msgs/Pose", "Point position\nQuaternion orientation\n", &[]),
    ("geometry_msgs/Wrench", "Vector3 force\nVector3 torque\n", &[]),
    ("geometry_msgs/TransformStamped", "std_msgs/Header header\nstring child_frame_id\nTransform transform\n", &[]),
    (
        "geometry_msgs/PoseStamped",
        "std_msgs/Header header\nPose pose\n",
        &[
            "std_msgs/Header",
            "builtin_interfaces/Time",
            "geometry_msgs/Pose",
            "geometry_msgs/Point",
            "geometry_msgs/Quaternion",
        ],
    ),
    (
        "geometry_msgs/WrenchStamped",
        "std_msgs/Header header\nWrench wrench\n",
        &["std_msgs/Header", "builtin_interfaces/Time", "geometry_msgs/Wrench", "geometry_msgs/Vector3"],
    ),
    (
        "tf2_msgs/TFMessage",
        "geometry_msgs/TransformStamped[] transforms\n",
        &[
            "geometry_msgs/TransformStamped",
            "std_msgs/Header",
            "builtin_interfaces/Time",
            "geometry_msgs/Transform",
            "geometry_msgs/Vector3",
            "geometry_msgs/Quaternion",
        ],
    ),
    (
        "sensor_msgs/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
        &["std_msgs/Header", "builtin_interfaces/Time"],
    ),
    ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n", &[]),
    ("std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n", &[]),
    ("sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n", &[]),
    ("visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n", &[]),
    ("visualization_msgs/MeshFile", "string filename\nuint8[] data\n", &[]),
    (
        "visualization_msgs/Marker",
        "int32 ARROW=0\nint32 CUBE=1\nint32 SPHERE=2\nint32 CYLINDER=3\nint32 LINE_STRIP=4\nint32 LINE_LIST=5\n\
         int32 CUBE_LIST=6\nint32 SPHERE_LIST=7\nint32 POINTS=8\nint32 TEXT_VIEW_FACING=9\nint32 MESH_RESOURCE=10\n\
         int32 TRIANGLE_LIST=11\nint32 ADD=0\nint32 MODIFY=0\nint32 DELETE=2\nint32 DELETEALL=3\n\
         std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\ngeometry_msgs/Pose pose\n\
         geometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\nbool frame_locked\n\
         geometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring texture_resource\n\
         sensor_msgs/CompressedImage texture\nUVCoordinate[] uv_coordinates\nstring text\nstring mesh_resource\n\
         MeshFile mesh_file\nbool mesh_use_embedded_materials\n",
        &[],
    ),
    (
        "visualization_msgs/MarkerArray",
        "Marker[] markers\n",
        &[
            "visualization_msgs/Marker",
            "std_msgs/Header",
            "builtin_interfaces/Time",
            "geometry_msgs/Pose",
            "geometry_msgs/Point",
            "geometry_msgs/Quaternion",
            "geometry_msgs/Vector3",
            "std_msgs/ColorRGBA",
            "builtin_interfaces/Duration",
            "sensor_msgs/CompressedImage",
            "visualization_msgs/UVCoordinate",
            "visualization_msgs/MeshFile",
        ],
    ),
    (
        "rcl_interfaces/Log",
        "byte DEBUG=10\nbyte INFO=20\nbyte WARN=30\nbyte ERROR=40\nbyte FATAL=50\n\
         builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line\n",
        &["builtin_interfaces/Time"],
    ),
];

/// Returns the full text of a message type (`package/Type`) with all its dependencies, in ros2msg
/// form.
pub(crate) fn schema_text(name: &str) -> String {
    let (fields, needs) = find(name);
    let mut text = fields.to_owned();
    for need in needs {
        text.push_str(&format!("\n{SEPARATOR}\nMSG: {need}\n{}", find(need).0));
    }
    text
}

fn find(name: &str) -> (&'static str, &'static [&'static str]) {
    let entry = DEFINITIONS.iter().find(|(known, ..)| *known == name);
    let (_, fields, needs) = entry.expect("every message type in use is in the table");
    (fields, needs)
}
