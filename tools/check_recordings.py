#!/usr/bin/env python3
"""Reads the recordings of a run with third-party readers and compares them with each other.

    flexarm compare -o out/check && python3 tools/check_recordings.py out/check

Uses installed readers and lists missing ones; for all of them: pip install mcap mcap-ros2-support
pymcap-cli rosbags "rerun-sdk>=0.36.3". One line per check; exit status 1 if any fails, 0 otherwise (also if
checks were skipped), 2 for wrong usage.
"""

import argparse
import collections
import csv
import json
import math
import os
import pathlib
import shutil
import signal
import subprocess
import sys
from xml.etree import ElementTree

# Maximum difference between two files that contain the same number.
SAME = 1e-12
# Maximum waiting time for another program.
PATIENCE_S = 60
# Tolerance of poses from up to ten multiplied transforms: a few units in the last place, in metres.
CHAINED = 1e-11


class Report:
    """Prints a line per check and records failures."""

    def __init__(self):
        self.failed = False

    def check(self, name, good, detail=""):
        self.failed |= not good
        print(f"{'ok' if good else 'FAILED':7} {name}{': ' if detail else ''}{detail}")

    def skip(self, name, why):
        print(f"skipped {name}: {why}")


def tool(report, name, command):
    """Runs a separate checker; exit status 0 is success."""
    program = shutil.which(command[0]) or shutil.which(command[0], path=str(pathlib.Path(sys.executable).parent))
    if program is None:
        report.skip(name, f"there is no {command[0]}")
        return
    # A separate process group, so that children of a wrapper end with it.
    process = subprocess.Popen(
        [program, *command[1:]], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )
    try:
        said, _ = process.communicate(timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        report.check(name, False, f"no end after {PATIENCE_S} s (a damaged file can do that)")
        return
    good = process.returncode == 0
    report.check(name, good, "" if good else " / ".join(said.strip().splitlines()[-3:]))


def table(path):
    """Returns the columns of run.csv by name."""
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    return {name: [float(row[k]) for row in rows[1:]] for k, name in enumerate(rows[0])}


def largest(pairs):
    """Maximum absolute difference; infinite if one list is longer."""
    worst = 0.0
    for a, b in pairs:
        if len(a) != len(b):
            return math.inf
        worst = max([worst, *(abs(x - y) for x, y in zip(a, b))])
    return worst


def product(A, B):
    """Product of two poses: rotation as rows, position."""
    (R, p), (S, q) = A, B
    turn = [[sum(R[i][k] * S[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    return turn, [p[i] + sum(R[i][k] * q[k] for k in range(3)) for i in range(3)]


def pose(place, q):
    x, y, z, w = q.x, q.y, q.z, q.w
    turn = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return turn, [place.x, place.y, place.z]


def flat(X):
    return [*X[0][0], *X[0][1], *X[0][2], *X[1]]


class Tree:
    """Frames received so far."""

    def __init__(self):
        self.parents = {}

    def add(self, message):
        for t in message.transforms:
            self.parents[t.child_frame_id] = (t.header.frame_id, pose(t.transform.translation, t.transform.rotation))

    def knows(self, frame):
        return frame == "world" or (frame in self.parents and self.knows(self.parents[frame][0]))

    def in_world(self, frame):
        if frame == "world":
            return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0, 0.0, 0.0]
        parent, X = self.parents[frame]
        return product(self.in_world(parent), X)


def stamp(time):
    return time.sec * 1_000_000_000 + time.nanosec


def mcap_file(report, path, rows):
    try:
        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory
    except ImportError as error:
        report.skip("run.mcap with Python's mcap", f"{error}; pip install mcap mcap-ros2-support")
        return

    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        if summary is None:
            report.check("run.mcap has an index", False)
            return
        seen = collections.Counter()
        messages = collections.defaultdict(list)
        frames, worst, order, unknown, stamps = Tree(), collections.Counter(), True, set(), True
        last_time, frames_time, markers, drawn_in = -1, -1, collections.Counter(), set()
        compared = collections.Counter()
        tcp = {m.name: m.metadata for m in reader.iter_metadata()}["flexarm.recording"]["tcp"]
        pending = []
        for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=True):
            topic = channel.topic
            seen[topic] += 1
            order &= message.log_time >= last_time
            last_time = message.log_time
            if hasattr(decoded, "header"):
                stamps &= stamp(decoded.header.stamp) == message.log_time
            if topic in ("/tf", "/tf_static"):
                frames.add(decoded)
                frames_time = message.log_time
                stamps &= all(stamp(t.header.stamp) == message.log_time for t in decoded.transforms)
            elif topic.startswith("/markers"):
                for marker in decoded.markers:
                    markers[marker.ns] += 1
                    drawn_in.add(marker.header.frame_id)
                    good = marker.type != 11 or (len(marker.points) % 3 == 0 and len(marker.points) > 0)
                    good &= all(math.isfinite(v) for p in marker.points for v in (p.x, p.y, p.z))
                    worst["triangles that are none"] += not good
            elif topic in ("/tcp/flexible", "/tcp/rigid"):
                pending.append((topic.removeprefix("/tcp/"), message.log_time, decoded.pose))
                messages[topic].append([decoded.pose.position.x, decoded.pose.position.y, decoded.pose.position.z])
            elif hasattr(decoded, "effort"):
                worst["numbers without a name"] += len(decoded.name) != len(decoded.position)
                messages[topic].append([list(decoded.name), list(decoded.position), list(decoded.effort)])
            elif topic == "/events":
                messages[topic].append((message.log_time, decoded.level, decoded.name, decoded.msg))
                stamps &= stamp(decoded.stamp) == message.log_time
            # Frames precede all other messages of the same time, but are not sent at every time.
            if topic == "/solver":
                for twin, time, tool in pending:
                    frame = f"{tcp}/tcp" if twin == "flexible" else f"{twin}/{tcp}/tcp"
                    if not frames.knows(frame):
                        unknown.add(frame)
                    elif time == message.log_time == frames_time:
                        compared[twin] += 1
                        there = flat(frames.in_world(frame))
                        truth = flat(pose(tool.position, tool.orientation))
                        worst[twin] = max(worst[twin], *(abs(a - b) for a, b in zip(there, truth)))
                pending.clear()

        counts = {summary.channels[k].topic: n for k, n in summary.statistics.channel_message_counts.items()}
        total = sum(seen.values())
        report.check("every message decodes", seen == collections.Counter(counts), f"{total} on {len(seen)} topics")
        print("        " + ", ".join(f"{topic} {seen[topic]}" for topic in sorted(seen)))
        bag(report, path, counts)
        report.check("messages come in order of time", order)
        report.check("header stamps are log times", stamps)
        report.check("no stamp is 0, which ROS reads as no time", summary.statistics.message_start_time > 0)
        layouts(report, path.parent, set(seen))
        spans = [(c.message_start_time, c.message_end_time) for c in summary.chunk_indexes]
        first, last = min(a for a, _ in spans), max(b for _, b in spans)
        whole = (summary.statistics.message_start_time, summary.statistics.message_end_time) == (first, last)
        report.check("times of chunks and file agree", whole, f"{first * 1e-9:g} s to {last * 1e-9:g} s")

        # Compare with the table.
        n = len(rows["time"])
        per_sample = ["/joint_states", "/tcp/flexible", "/energy", "/solver"]
        report.check("one message per row of run.csv", all(seen[t] == n for t in per_sample), f"{n} rows")
        # Every row up to 200 per second, fewer for higher rates.
        spacing = min((b - a for a, b in zip(rows["time"], rows["time"][1:])), default=1.0)
        each = max(1, math.ceil(0.005 / spacing - 1e-6))
        report.check("frames at least at one of so many rows", n / each <= seen["/tf"] <= n, f"{seen['/tf']}, one of {each}")

        def columns(names):
            return [list(row) for row in zip(*(rows[name] for name in names))]

        def same(name, mine, names, allowed=SAME):
            if not all(column in rows for column in names):
                report.skip(name, "run.csv has no such columns")
                return
            difference = largest(zip(mine, columns(names))) if len(mine) == n else math.inf
            report.check(f"{name} as in run.csv", difference <= allowed, f"differ by {difference:.1e} at most")

        xyz = ("x_m", "y_m", "z_m")
        same("/tcp/flexible", messages["/tcp/flexible"], [f"flexible_{c}" for c in xyz])
        if seen["/tcp/error"]:
            same("/tcp/rigid", messages["/tcp/rigid"], [f"rigid_{c}" for c in xyz])
            names = [f"error_{c}" for c in (*xyz, "rx_rad", "ry_rad", "rz_rad")]
            same("/tcp/error", [row[1][:6] for row in messages["/tcp/error"]], names)
            names = [f"error_{c}_m" for c in ("tangential", "normal", "binormal")]
            same("/tcp/error_path", [row[1][:3] for row in messages["/tcp/error_path"]], names)
        joints = messages["/joint_states"][0][0]
        units = [next(u for u in ("rad", "m", "rad") if f"{j}_position_{u}" in rows) for j in joints]
        names = [f"{j}_position_{u}" for j, u in zip(joints, units)]
        same("/joint_states, positions", [row[1] for row in messages["/joint_states"]], names)
        same("/joint_states, effort", [row[2] for row in messages["/joint_states"]], [f"{j}_effort" for j in joints])
        if seen["/elastic/joint_states"]:
            parts = messages["/elastic/joint_states"]
            suffix = dict(zip(("x", "y", "z", "rx", "ry", "rz"), (*xyz, "rx_rad", "ry_rad", "rz_rad")))
            load = dict(zip(("x", "y", "z", "rx", "ry", "rz"), ("fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm")))
            elements = [name.rsplit("/", 1) for name in parts[0][0]]
            same("/elastic/joint_states, deflection", [p[1] for p in parts], [f"{e}_{suffix[c]}" for e, c in elements])
            same("/elastic/joint_states, load", [p[2] for p in parts], [f"{e}_{load[c]}" for e, c in elements])
        energy = [f"{kind}_energy_j" for kind in ("kinetic", "potential", "elastic")]
        same("/energy", [row[1] for row in messages["/energy"]], energy)
        if seen["/tcp/contributions"]:
            labels = [name.rsplit("/", 1) for name in messages["/tcp/contributions"][0][0]]
            shares = [row[1] for row in messages["/tcp/contributions"]]
            for pattern in ("{}_contribution_{}_m", "{}_share_{}_m", "contribution_{}_{}_m"):
                names = [pattern.format(c, axis) for c, axis in labels]
                if names[0] in rows:
                    break
            same("/tcp/contributions", shares, names)
            if seen["/tcp/error"]:
                # To first order the shares add up to the error of an arm with ideal drives; servos
                # have an additional error.
                sums = [[math.fsum(row[c::3]) for c in range(3)] for row in shares]
                errors = [row[1][:3] for row in messages["/tcp/error"]]
                peak = max(math.hypot(*row) for row in errors)
                rest = max(math.dist(a, b) for a, b in zip(sums, errors))
                print(f"note    shares add up to the TCP error but for {1e6 * rest:.3g} um of {1e6 * peak:.4g} um")

        # Frames, pictures, events.
        for twin in ("flexible", "rigid"):
            if seen[f"/tcp/{twin}"]:
                detail = f"frame {tcp}/tcp, differ by {worst[twin]:.1e} at most, {compared[twin]} times"
                good = not unknown and worst[twin] <= CHAINED and compared[twin] >= seen["/tf"] - 1
                report.check(f"/tf leads to /tcp/{twin}", good, detail)
        lost = sorted(frame for frame in drawn_in if not frames.knows(frame))
        report.check("markers stand in known frames", not lost, ", ".join(lost) or f"{len(drawn_in)} frames")
        detail = ", ".join(f"{name} {count}" for name, count in sorted(markers.items()))
        report.check("markers are drawable", not worst["triangles that are none"], detail)
        report.check("numbers have names", not worst["numbers without a name"])
        inside = all(first <= time <= last for time, *_ in messages["/events"])
        # A recording of modes has neither events nor a summary.
        is_run = (path.parent / "summary.json").is_file()
        report.check("events lie within the run", inside and (seen["/events"] > 0 or not is_run), f"{seen['/events']} events")
        attachments = [a.name for a in reader.iter_attachments()]
        good = len(attachments) == summary.statistics.attachment_count and ("summary.json" in attachments or not is_run)
        report.check("attachments are readable", good, ", ".join(attachments))


def bag(report, path, expected):
    """Reads the file, and the folder with its metadata.yaml, as a bag of ROS 2."""
    try:
        from rosbags.highlevel import AnyReader
    except ImportError as error:
        report.skip("run.mcap as a bag", f"{error}; pip install rosbags")
        return
    for place in (path, path.parent):
        if place.is_dir() and not (place / "metadata.yaml").is_file():
            report.skip("the folder as a bag", "the run did not write a metadata.yaml")
            continue
        with AnyReader([place]) as reader:
            counts = {c.topic: c.msgcount for c in reader.connections}
            read = sum(reader.deserialize(raw, c.msgtype) is not None for c, _, raw in reader.messages())
            good = counts == expected and read == reader.message_count
            report.check(f"rosbags reads the {'folder' if place.is_dir() else 'file'}", good, f"{read} messages")


def layouts(report, folder, topics):
    """Checks that the layouts next to the recording are readable and refer to its topics."""
    foxglove, plotjuggler = folder / "run.foxglove.json", folder / "run.plotjuggler.xml"
    if not foxglove.is_file() or not plotjuggler.is_file():
        report.skip("layouts", "the run did not write them")
        return
    panels = json.loads(foxglove.read_text("utf-8"))["configById"].values()
    paths = [path["value"].split(".")[0] for panel in panels for path in panel.get("paths", [])]
    lost = sorted(set(paths) - topics)
    report.check("run.foxglove.json refers to topics of the recording", paths and not lost, f"{len(paths)} curves {lost or ''}")
    curves = [curve.get("name") for curve in ElementTree.parse(plotjuggler).iter("curve")]
    lost = [curve for curve in curves if not any(curve.startswith(topic + "/") for topic in topics)]
    report.check("run.plotjuggler.xml refers to topics of the recording", curves and not lost, f"{len(curves)} curves {lost or ''}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path, help="output folder of `flexarm compare` or `flexarm run`")
    folder = parser.parse_args().folder
    if not (folder / "run.csv").is_file():
        parser.error(f"{folder}: no run.csv there; give the output folder of a run")
    report = Report()
    rrd, mcap = folder / "run.rrd", folder / "run.mcap"
    if rrd.is_file():
        tool(report, "rerun rrd verify run.rrd", ["rerun", "rrd", "verify", str(rrd)])
    else:
        report.skip("run.rrd", "the run did not write one")
    if mcap.is_file():
        tool(report, "rerun mcap check run.mcap", ["rerun", "mcap", "check", "--full", str(mcap)])
        tool(report, "pymcap-cli doctor run.mcap", ["pymcap-cli", "doctor", str(mcap)])
        try:
            mcap_file(report, mcap, table(folder / "run.csv"))
        except Exception as error:  # readers raise arbitrary exceptions for a damaged file
            report.check("run.mcap reads to its end", False, f"{type(error).__name__}: {error}")
    else:
        report.skip("run.mcap", "the run did not write one")
    sys.exit(1 if report.failed else 0)


if __name__ == "__main__":
    main()
