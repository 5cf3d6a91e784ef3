#!/usr/bin/env python3
"""Writes small motions in the formats of other programs, for crates/motion/flexarm-motion-io/tests.

    pip install rosbags==0.11.9 mcap==1.6.0 lz4==4.4.5 zstandard==0.25.0 PyYAML==6.0.3
    python3 tools/make_motion_fixtures.py

One motion of two joints, sampled from closed forms, as flexarm's CSV (the truth of the tests) and
as messages and bags written by the Python libraries of ROS: rosbags for SQLite bags, MCAP bags and
the bytes of messages (CDR in both byte orders, ROS 1), Foxglove's MCAP library for chunks packed by
lz4 and zstd, PyYAML and json for texts. The messages contain a gripper, the CSV does not. Reception
times differ from the stamps by design.
"""
import json
import math
import shutil
import sqlite3
from pathlib import Path

import yaml
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

FOLDER = Path(__file__).resolve().parent.parent / "crates/motion/flexarm-motion-io/tests/data"
JOINTS = ["joint_1", "joint_2"]
STEP_NS = 20_000_000
COUNT = 26
# ns since 1970: more digits than an f64 has
STAMP_0 = 1_700_000_000_123_456_789
CONTROLLER = """std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint reference
trajectory_msgs/JointTrajectoryPoint feedback
trajectory_msgs/JointTrajectoryPoint error
trajectory_msgs/JointTrajectoryPoint output
"""
ROBOT_TRAJECTORY = "trajectory_msgs/JointTrajectory joint_trajectory\n"


def at(k):
    """Positions, velocities, accelerations of the joints at sample k: a sine from rest to rest, and
    a cubic wave."""
    t, total = k * STEP_NS * 1e-9, (COUNT - 1) * STEP_NS * 1e-9
    w = math.pi / total
    s, c = math.sin(w * t), math.cos(w * t)
    first = (0.4 * (1 - c), 0.4 * w * s, 0.4 * w * w * c)
    second = (-0.25 * s**3, -0.75 * w * s * s * c, -0.75 * w * w * (2 * s * c * c - s**3))
    return [[round(first[d], 12), round(second[d], 12)] for d in range(3)]


def csv(path, derivatives):
    names = ["time"] + [j + end for end in ["", ".vel", ".acc"][: derivatives + 1] for j in JOINTS]
    rows = [",".join(names)]
    for k in range(COUNT):
        rows.append(",".join(repr(x) for x in [round(k * STEP_NS * 1e-9, 9)] + [x for d in at(k)[: derivatives + 1] for x in d]))
    path.write_text("# unit: rad\n" + "\n".join(rows) + "\n")


def trajectory(duration):
    """Returns a JointTrajectory as plain values; the gripper comes first and is at rest."""
    points = []
    for k in range(COUNT):
        q, v, a = at(k)
        points.append({"positions": [0.02] + q, "velocities": [0.0] + v, "accelerations": [0.0] + a, "effort": [],
                       "time_from_start": duration(k * STEP_NS)})
    return {"header": {"stamp": duration(0), "frame_id": "base_link"}, "joint_names": ["gripper_finger_joint"] + JOINTS, "points": points}


def in_ros2(ns):
    return {"sec": ns // 10**9, "nanosec": ns % 10**9}


def in_ros1(ns):
    return {"secs": ns // 10**9, "nsecs": ns % 10**9}


def texts():
    plan = trajectory(in_ros2)
    write = lambda name, value: (FOLDER / name).write_text(yaml.dump(value, sort_keys=False, default_flow_style=None, width=200))
    write("plan.yaml", plan)
    write("plan_ros1.yaml", trajectory(in_ros1))
    (FOLDER / "plan.json").write_text(json.dumps(plan, indent=1))
    floats = trajectory(lambda ns: ns / 1e9)
    floats["header"]["stamp"] = 0.0
    (FOLDER / "plan_floats.json").write_text(json.dumps(floats))
    state = {"joint_state": {"header": {"stamp": in_ros2(0), "frame_id": ""}, "name": JOINTS, "position": at(0)[0], "velocity": [], "effort": []},
             "is_diff": False}
    nested = {"joint_trajectory": plan, "multi_dof_joint_trajectory": {"header": plan["header"], "joint_names": [], "points": []}}
    write("display.yaml", {"model_id": "arm", "trajectory": [nested], "trajectory_start": state})
    documents = []
    for k, (stamp, names, q, v) in enumerate(states()):
        header = {"stamp": in_ros2(stamp), "frame_id": ""}
        documents.append({"header": header, "name": names, "position": q, "velocity": v, "effort": []})
    (FOLDER / "echo.yaml").write_text("".join(yaml.dump(d, sort_keys=False) + "---\n" for d in documents))


def states():
    """Yields stamp, names, positions, velocities of the JointStates; their order varies between
    messages."""
    for k in range(COUNT):
        q, v, _ = at(k)
        pairs = list(zip(JOINTS + ["gripper_finger_joint"], q + [0.02], v + [0.0]))
        pairs = pairs[k % 3:] + pairs[:k % 3]
        yield STAMP_0 + k * STEP_NS, [p[0] for p in pairs], [p[1] for p in pairs], [p[2] for p in pairs]


class Types:
    """Messages of one version of ROS, by the classes of rosbags."""

    def __init__(self, store):
        self.store = get_typestore(store)
        self.is_ros1 = store == Stores.ROS1_NOETIC
        self.store.register(get_types_from_msg(CONTROLLER, "control_msgs/msg/JointTrajectoryControllerState"))
        self.store.register(get_types_from_msg(ROBOT_TRAJECTORY, "demo_msgs/msg/RobotTrajectory"))

    def make(self, kind, /, **fields):
        return self.store.types[kind](**fields)

    def array(self, values):
        import numpy
        return numpy.array(values, dtype=numpy.float64)

    def header(self, ns):
        stamp = self.make("builtin_interfaces/msg/Time", sec=ns // 10**9, nanosec=ns % 10**9)
        more = {"seq": 7} if self.is_ros1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id="base", **more)

    def point(self, q, v, a, ns):
        time = self.make("builtin_interfaces/msg/Duration", sec=ns // 10**9, nanosec=ns % 10**9)
        lists = {"positions": q, "velocities": v, "accelerations": a, "effort": []}
        return self.make("trajectory_msgs/msg/JointTrajectoryPoint", **{k: self.array(x) for k, x in lists.items()}, time_from_start=time)

    def joint_states(self):
        for ns, names, q, v in states():
            name = "sensor_msgs/msg/JointState"
            yield ns, name, self.make(name, header=self.header(ns), name=names, position=self.array(q), velocity=self.array(v), effort=self.array([]))

    def controller_states(self):
        name = "control_msgs/msg/JointTrajectoryControllerState"
        for k in range(COUNT):
            ns, (q, v, a) = STAMP_0 + k * STEP_NS, at(k)
            none = self.point([], [], [], 0)
            measured = self.point([x + 1e-3 for x in q], [], [], 0)
            yield ns, name, self.make(name, header=self.header(ns), joint_names=JOINTS, reference=self.point(q, v, [], 0), feedback=measured,
                                      error=none, output=none)

    def plan(self):
        name = "trajectory_msgs/msg/JointTrajectory"
        plain = trajectory(in_ros2)
        points = [self.point(p["positions"], p["velocities"], p["accelerations"], k * STEP_NS) for k, p in enumerate(plain["points"])]
        yield STAMP_0, name, self.make(name, header=self.header(0), joint_names=plain["joint_names"], points=points)

    def nested_plan(self):
        (ns, _, message), name = next(self.plan()), "demo_msgs/msg/RobotTrajectory"
        yield ns, name, self.make(name, joint_trajectory=message)

    def text_message(self):
        name = "std_msgs/msg/String"
        yield STAMP_0, name, self.make(name, data="what no motion is")


def received(ns, k):
    """Returns the reception time: later than the stamp by a varying amount."""
    return ns + 1_000_000 + (k * 7919) % 400_000


def bag(name, types, topics, plugin=StoragePlugin.SQLITE3, mode=None):
    """Writes a rosbag2 folder."""
    path = FOLDER / name
    shutil.rmtree(path, ignore_errors=True)
    writer = Writer(path, version=9, storage_plugin=plugin)
    if mode:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        for topic, messages in topics:
            connection = None
            for k, (ns, kind, message) in enumerate(messages):
                connection = connection or writer.add_connection(topic, kind, typestore=types.store)
                writer.write(connection, received(ns, k), types.store.serialize_cdr(message, kind))


def mcap(name, types, topics, compression, little=True, ros1=False):
    """Writes an MCAP file."""
    with open(FOLDER / name, "wb") as file:
        writer = McapWriter(file, chunk_size=2048, compression=compression)
        writer.start(profile="ros1" if ros1 else "ros2", library="")
        for topic, messages in topics:
            channel = None
            for k, (ns, kind, message) in enumerate(messages):
                if channel is None:
                    text, _ = types.store.generate_msgdef(kind, ros_version=1 if ros1 else 2)
                    plain = kind.replace("/msg/", "/") if ros1 else kind
                    schema = writer.register_schema(plain, "ros1msg" if ros1 else "ros2msg", text.encode())
                    channel = writer.register_channel(topic, "ros1" if ros1 else "cdr", schema)
                data = types.store.serialize_ros1(message, kind) if ros1 else types.store.serialize_cdr(message, kind, little_endian=little)
                writer.add_message(channel, received(ns, k), bytes(data), ns, k)
        writer.finish()


def old_database(new, old):
    """Writes the format of recorders before ROS 2 Iron: without message definitions."""
    shutil.copy(new, old)
    database = sqlite3.connect(old)
    database.execute("DROP TABLE message_definitions")
    database.commit()
    database.execute("VACUUM")
    database.close()


def main():
    FOLDER.mkdir(parents=True, exist_ok=True)
    csv(FOLDER / "states.csv", 1)
    csv(FOLDER / "plan.csv", 2)
    texts()
    ros2, ros1 = Types(Stores.ROS2_HUMBLE), Types(Stores.ROS1_NOETIC)
    both = lambda types: [("/chatter", types.text_message()), ("/joint_states", types.joint_states())]
    mcap("states_zstd.mcap", ros2, both(ros2), CompressionType.ZSTD)
    mcap("states_lz4.mcap", ros2, both(ros2), CompressionType.LZ4)
    mcap("states_plain.mcap", ros2, both(ros2), CompressionType.NONE)
    mcap("states_big_endian.mcap", ros2, both(ros2), CompressionType.ZSTD, little=False)
    mcap("states_ros1.mcap", ros1, both(ros1), CompressionType.ZSTD, ros1=True)
    mcap("controller.mcap", ros2, [("/arm_controller/controller_state", ros2.controller_states())], CompressionType.ZSTD)
    mcap("plan.mcap", ros2, [("/arm_controller/joint_trajectory", ros2.plan())], CompressionType.ZSTD)
    mcap("nested_plan.mcap", ros2, [("/planned_path", ros2.nested_plan())], CompressionType.ZSTD)
    mcap("both.mcap", ros2, [("/arm_controller/controller_state", ros2.controller_states()), ("/joint_states", ros2.joint_states())],
         CompressionType.ZSTD)
    bag("bag_sqlite", ros2, both(ros2))
    bag("bag_mcap", ros2, both(ros2), StoragePlugin.MCAP)
    bag("bag_messages_packed", ros2, both(ros2), mode=CompressionMode.MESSAGE)
    bag("bag_file_packed", ros2, both(ros2), mode=CompressionMode.FILE)
    old_database(FOLDER / "bag_sqlite/bag_sqlite.db3", FOLDER / "old.db3")
    for path in sorted(FOLDER.rglob("*")):
        if path.is_file():
            print(f"{path.stat().st_size:8d}  {path.relative_to(FOLDER)}")


if __name__ == "__main__":
    main()
