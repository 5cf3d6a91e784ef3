#!/usr/bin/env python3
"""Writes the folders of robots/ whose figures are published: one arm for each table in tests/arms.

    python3 tools/make_arms.py [NAME ...]                  URDF, robot.toml, motion.toml, README.md
    python3 tools/make_arms.py --check                     compare with the folders, write nothing
    python3 tools/make_arms.py --vendor DIR [NAME ...]     compare the tables with the maker's files
    python3 tools/make_arms.py --vendor DIR --write        read the tables from the maker's files again
    python3 tools/make_arms.py --vendor DIR --meshes OUT   the same arms with the maker's meshes

A table holds what the maker publishes (masses, inertias, frames, limits, rated payload), with the
file, its version and its licence, the sections that the maker's meshes show, and the parts that
each link is drawn with: few lengths, chosen by eye. Reducers, the motion and all that follows are
computed by the program: $FLEXARM, else target/release/flexarm, else flexarm on the PATH. DIR holds
the makers' packages, each in a folder of its own, by the name that the table gives. Needs no
third-party packages.
"""

import argparse
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap
import tomllib
from xml.etree import ElementTree

from make_gallery import ROOT, digits, program
from make_meshes import X, Y, Z, body, cylinder, difference, dot, pipe, stl, unit

TABLES, ROBOTS = ROOT / "tests/arms", ROOT / "robots"
MARK = "# Written by tools/make_arms.py from the maker's files.\n"
SECTIONS = {"casting": 3.5, "box": 7.0}  # powers of the superellipse
EDGE = 0.1  # chamfer of a drum over its radius
CUT, TURN = 0.45, 30.0  # of each side of a corner of a pipe, at most; degrees from ring to ring
STEP = 0.2  # m, at most from ring to ring: a link that bends is drawn smoothly
POSES = 32  # of the set in which the worst is looked for
DENSITY = 2700.0  # kg/m³, aluminium: the cube that stands for the payload


def answer(*arguments):
    """Returns what a command prints with --json."""
    run = subprocess.run([program(), *map(str, arguments), "--json", "-q"], capture_output=True, text=True)
    if run.returncode:
        sys.exit(f"flexarm {' '.join(map(str, arguments))}: {run.stderr.strip()}")
    return json.loads(run.stdout)


# Rotations and poses: lists of rows, (R, p).

def rotation(roll, pitch, yaw):
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a), math.sin(a)) for a in (roll, pitch, yaw))
    return [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], [-sp, cp * sr, cp * cr]]


def angles(R):
    """Returns roll, pitch, yaw; roll is zero where only its sum with yaw is determined."""
    pitch = math.atan2(-R[2][0], math.hypot(R[0][0], R[1][0]))
    if math.hypot(R[0][0], R[1][0]) < 1e-9:
        return [0.0, pitch, math.atan2(-R[0][1], R[1][1])]
    return [math.atan2(R[2][1], R[2][2]), pitch, math.atan2(R[1][0], R[0][0])]


def moved(pose, point):
    R, p = pose
    return [sum(R[i][k] * point[k] for k in range(3)) + p[i] for i in range(3)]


def chained(a, b):
    """Returns the pose a times b; b itself where a is the identity, so that figures stay as they are."""
    if a == IDENTITY:
        return b
    if b == IDENTITY:
        return a
    return [[sum(a[0][i][k] * b[0][k][j] for k in range(3)) for j in range(3)] for i in range(3)], moved(a, b[1])


IDENTITY = rotation(0.0, 0.0, 0.0), [0.0, 0.0, 0.0]


def numbers(text):
    return [float(word) for word in text.split()]


def origin(element):
    found = element.find("origin") if element is not None else None
    return [] if found is None else numbers(found.get("xyz", "0 0 0")) + numbers(found.get("rpy", "0 0 0"))


def pose_of(row):
    return (rotation(*row[3:]), row[:3]) if row else IDENTITY


# The maker's files.

def expanded(arm, vendor, folder):
    """Returns the maker's URDF, expanded by `flexarm new`, and what that command found."""
    source = arm["source"]
    given = [f"--arg={key}={value}" for key, value in source.get("arguments", {}).items()]
    for name, place in source.get("packages", {}).items():
        given.append(f"--package={name}={vendor / place}")
    found = answer("new", vendor / source["xacro"], *given, "--payload", arm["payload"], *reducers(arm), "-o", folder, "--no-run", "--force")
    return next(folder.glob("*.urdf")), found


def figures(urdf, tool):
    """Returns links and joints from the root to the tool frame; frames without mass are left out."""
    root = ElementTree.parse(urdf).getroot()
    links = {link.get("name"): link for link in root.findall("link")}
    above = {joint.find("child").get("link"): joint for joint in root.findall("joint") if joint.find("child") is not None}
    chain, at = [], tool
    while at in above:
        chain.append(above[at])
        at = above[at].find("parent").get("link")
    rows, bodies, pose, parent = {}, {}, IDENTITY, None
    for joint in reversed(chain):
        child, fixed = joint.find("child").get("link"), joint.get("type") == "fixed"
        pose = chained(pose, pose_of(origin(joint)))
        heavy = links[child].find("inertial") is not None
        if parent is None and heavy:
            if pose != IDENTITY:
                rows["base_joint"] = dict(parent="base", child=child, origin=[*pose[1], *angles(pose[0])])
            bodies[child], parent, pose = links[child], child, IDENTITY
        elif not fixed or heavy:
            limit, axis = joint.find("limit"), joint.find("axis")
            row = dict(parent=parent, child=child, origin=origin(joint) if pose == pose_of(origin(joint)) else [*pose[1], *angles(pose[0])])
            if not fixed:
                turns = joint.get("type") == "continuous"
                reach = [-2.0 * math.pi, 2.0 * math.pi] if turns else [float(limit.get(k)) for k in ("lower", "upper")]
                row |= dict(axis=numbers(axis.get("xyz")), limits=[*reach, *(float(limit.get(k)) for k in ("velocity", "effort"))])
            rows[joint.get("name")], bodies[child], parent, pose = row, links[child], child, IDENTITY
    rows["tool_joint"] = dict(parent=parent, child="tool0", origin=[round(x, 12) for x in [*pose[1], *angles(pose[0])]])
    table = {}
    for name, link in bodies.items():
        inertial = link.find("inertial")
        at, I = origin(inertial) or [0.0] * 6, inertial.find("inertia")
        tensor = [float(I.get(k)) for k in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")]
        table[name] = [float(inertial.find("mass").get("value")), *at[:3], *tensor, *(at[3:] if any(at[3:]) else [])]
    return table, rows


def solid(part):
    """Returns a closed solid (m) from a line of a table (mm): `drum AXIS RADIUS FROM TO`; with a comma
    between sections, `box AXIS PLACE HALF HALF, PLACE HALF HALF`, and `casting`, which is rounder;
    `pipe X Y Z RADIUS, X Y Z RADIUS`, whose bends are round. Two more numbers of a drum or section are
    its centre across the axis. What lies across an axis is in the order of x, y, z."""
    kind, sizes = part.split(maxsplit=1)
    if kind == "pipe":
        return pipe(filled(bent(metres(sizes)), 3))
    letter, sizes = sizes.split(maxsplit=1)
    rows, axis = metres(sizes), "xyz".index(letter)

    def centre(place, across):
        point = list(across or (0.0, 0.0))
        return point[:axis] + [place] + point[axis:]

    if kind == "drum":
        (radius, start, end, *across), = rows
        return cylinder(centre(0.0, across), (X, Y, Z)[axis], radius, start, end, EDGE * radius)
    stations = [(centre(place, across), *((b, a) if letter == "y" else (a, b))) for place, a, b, *across in filled(rows, 1)]
    return body((X, Y, Z)[axis], stations, SECTIONS[kind])


def metres(text):
    return [[1e-3 * x for x in numbers(row)] for row in text.split(",")]


def mixed(a, b, at):
    return [x + at * (y - x) for x, y in zip(a, b)]


def bent(rows):
    """Returns rows of a pipe with parabolas for its corners, which begin at most a radius before them."""
    line = rows[:1]
    for a, b, c in zip(rows, rows[1:], rows[2:]):
        low, high = (mixed(b, end, min(CUT, b[3] / math.dist(b[:3], end[:3]))) for end in (a, c))
        turn = math.degrees(math.acos(min(1.0, dot(unit(difference(b, a)), unit(difference(c, b))))))
        steps = math.ceil(turn / TURN) or 1
        line += [mixed(mixed(low, b, k / steps), mixed(b, high, k / steps), k / steps) for k in range(steps + 1)]
    return line + rows[-1:]


def filled(rows, places):
    """Adds rows so that neighbours are at most STEP apart; the first `places` numbers of a row are its place."""
    out = rows[:1]
    for a, b in zip(rows, rows[1:]):
        steps = math.ceil(math.dist(a[:places], b[:places]) / STEP) or 1
        out += [mixed(a, b, k / steps) for k in range(1, steps + 1)]
    return out


def table_of(arm, vendor):
    """Returns the part of a table that the maker's files give."""
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        urdf, found = expanded(arm, vendor, folder)
        links, joints = figures(urdf, arm["source"]["tool"])
        made = tomllib.loads((folder / "robot.toml").read_text())
    half = {link["name"]: link["wall_of_half_mass"] for link in found["links"]}
    lines = ["# kg; centre of mass (m); ixx iyy izz ixy ixz iyz (kg m2) about it; roll pitch yaw of its axes, if any.", "[links]"]
    lines += [f"{name} = {row}" for name, row in links.items()]
    lines += ["", "# Origin (m, rad) in the frame of the parent; lower, upper (rad), speed (rad/s), effort (N m).", "[joints]"]
    for name, row in joints.items():
        lines.append(f"{name} = {{ " + ", ".join(f"{key} = {json.dumps(value)}" for key, value in row.items()) + " }")
    # Other parts than those of the published inertia would replace it.
    for entry in (e for e in made.get("flexible_link", []) if e["beam"]["parts"] == "from-link"):
        beam = ", ".join(f"{key} = {json.dumps(value)}" for key, value in entry["beam"].items())
        lines += ["", "# The section that the mesh shows, hollow so that the link has its mass (`flexarm new`).", "[[beams]]",
                  f"link = \"{entry['link']}\"", f"distal = \"{entry['distal']}\"", f"beam = {{ {beam} }}"]
        if half.get(entry["link"]):
            lines.append(f"wall_of_half_mass = {round(half[entry['link']], 5)}")
    return "\n".join(lines) + "\n"


# The folders.

def floats(values):
    return " ".join(f"{value:.12g}" if value == round(value, 12) else repr(value) for value in values)


def urdf_text(name, arm):
    out = ['<?xml version="1.0"?>', f"<!-- {arm['title']}: written by tools/make_arms.py from tests/arms/{name}.toml; sources in README.md. -->",
           f'<robot name="{name}">']
    if "base_joint" in arm["joints"]:
        out.append('  <link name="base"/>')
    for link, row in arm["links"].items():
        rpy = f' rpy="{floats(row[10:])}"' if row[10:] else ""
        tensor = " ".join(f'{key}="{value!r}"' for key, value in zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), row[4:10]))
        out.append(f'  <link name="{link}">')
        out.append(f'    <inertial><origin xyz="{floats(row[1:4])}"{rpy}/><mass value="{row[0]!r}"/><inertia {tensor}/></inertial>')
        if arm["shapes"].get(link):
            out.append(f'    <visual><geometry><mesh filename="meshes/{link}.stl"/></geometry></visual>')
        out.append("  </link>")
    out.append('  <link name="tool0"/>')
    for joint, row in arm["joints"].items():
        kind = "revolute" if "axis" in row else "fixed"
        out.append(f'  <joint name="{joint}" type="{kind}">')
        out.append(f'    <parent link="{row["parent"]}"/><child link="{row["child"]}"/>')
        place = row["origin"] or [0.0] * 6
        out.append(f'    <origin xyz="{floats(place[:3])}" rpy="{floats(place[3:])}"/>')
        if "axis" in row:
            low, high, speed, effort = row["limits"]
            out.append(f'    <axis xyz="{floats(row["axis"])}"/><limit lower="{low!r}" upper="{high!r}" velocity="{speed!r}" effort="{effort!r}"/>')
        out.append("  </joint>")
    return "\n".join(out) + "\n</robot>\n"


def reducers(arm):
    return ["--reducers", arm["reducers"]] if "reducers" in arm else []


def payload_text(mass):
    side = (mass / DENSITY) ** (1.0 / 3.0)
    moment = mass * side * side / 6.0
    return (f"payload = {{ link = \"tool0\", mass = {mass}, com = [0.0, 0.0, {0.5 * side:.4f}], "
            f"inertia = [{moment:.4g}, {moment:.4g}, {moment:.4g}, 0.0, 0.0, 0.0] }}")


def robot_text(name, arm, drives, at="stiffness"):
    """Returns robot.toml: reducers typical, or at one end of their range; at the lower end half of each
    link's mass stiffens it."""
    motion = f"../../trajectories/{arm['motion']}.toml" if "motion" in arm else "motion.toml"
    out = [f"# {arm['title']}: written by tools/make_arms.py; what is published and what is ASSUMED: README.md.", "format = 1", f'name = "{name}"',
           f'urdf = "{name}.urdf"', f'default_trajectory = "{motion}"', 'tcp = { link = "tool0", xyz = [0.0, 0.0, 0.0], rpy = [0.0, 0.0, 0.0] }', "",
           "# Rated payload. ASSUMED: an aluminium cube that is bolted to the flange."]
    out.append(payload_text(arm["payload"]) if at != "unloaded" else "")
    if "waive_inertia" in arm:
        out += ["", "# PUBLISHED so, and impossible: the largest principal moment is above the sum of the others.", f"waive_inertia = {json.dumps(arm['waive_inertia'])}"]
    if arm.get("beams"):
        out += ["", "# Sections that the maker's meshes show. ASSUMED: the material, and all of the mass in the wall."]
    for entry in arm.get("beams", []):
        beam = dict(entry["beam"])
        if at == "low" and "wall_of_half_mass" in entry:
            beam["wall"] = entry["wall_of_half_mass"]
        beam = ", ".join(f"{key} = {json.dumps(value)}" for key, value in beam.items())
        out += ["[[flexible_link]]", f"link = \"{entry['link']}\"", f"distal = \"{entry['distal']}\"", "damping = { modal = 0.03 }", f"beam = {{ {beam} }}"]
    out += ["", "# Reducers. ASSUMED: the class of the rated torque, which is the effort limit over 2.5. Damping: 3 % of critical."]
    for drive in drives:
        low, high, stiffness = (float(f"{drive[key]:.3g}") for key in ("low", "high", "stiffness"))
        value = {"low": low, "high": high}.get(at, stiffness)
        out += [f"# {low:.3g} to {high:.3g} N m/rad; rated torque {drive['rated_torque']:.4g} N m", "[[drive]]", f"joint = \"{drive['joint']}\"", 'kind = "gearbox"',
                f"gearbox = {{ stiffness = {value} }}"]
    return "\n".join(out) + "\n"


def halton(k, base):
    found, share = 0.0, 1.0
    while k:
        share /= base
        found += share * (k % base)
        k //= base
    return found


def degrees(pose):
    return ",".join(f"{angle:g}deg" for angle in pose)


def poses(arm):
    """A fixed set of poses over the ranges of the joints (at most half a turn to each side), degrees."""
    ranges = [row["limits"][:2] for row in arm["joints"].values() if "axis" in row]
    ranges = [(math.degrees(max(low, -math.pi)), math.degrees(min(high, math.pi))) for low, high in ranges]
    return [[round(low + (high - low) * halton(k, base), 1) for (low, high), base in zip(ranges, (2, 3, 5, 7, 11, 13, 17))] for k in range(1, POSES + 1)]


def size(vector):
    return math.sqrt(sum(x * x for x in vector))


def stretch(C):
    """Returns the largest eigenvalue of the translations of a compliance (m/N)."""
    v = [1.0, 0.7, 0.4]
    for _ in range(200):
        w = [sum(C[i][j] * v[j] for j in range(3)) for i in range(3)]
        v = [x / size(w) for x in w]
    return size(w)


def gear_share(statics, drives):
    """Returns the part of the sag that the reducers cause, along its direction."""
    sag, gears = statics["sag_m"], {drive["joint"] for drive in drives}
    along = sum(a * b for e in statics["elements"] if e["name"] in gears for a, b in zip(e["tcp_displacement_m"], sag))
    return along / size(sag) ** 2


def outcome(text_at, pose, drives, folder):
    """Returns sag, compliance, frequencies and shares: typical, at both ends of the range, without payload.
    `text_at` gives the robot file."""
    found = {}
    for at in ("stiffness", "low", "high", "unloaded"):
        file = folder / f"{at}.toml"
        file.write_text(text_at(at))
        statics, modes = (answer(command, file, f"--at={degrees(pose)}") for command in ("statics", "modes"))
        found[at] = dict(sag=1e3 * size(statics["sag_m"]), compliance=1e6 * stretch(statics["compliance"]), gears=100.0 * gear_share(statics, drives),
                         f=modes["undamped_frequencies_hz"][:3], tcp=statics["tcp_position_m"])
    return found


def sags(arm, file):
    """Returns the sag (mm) and the pose of every pose of the set whose flange is above the floor."""
    found = [(answer("statics", file, f"--at={degrees(pose)}"), pose) for pose in poses(arm)]
    return [(1e3 * size(statics["sag_m"]), pose) for statics, pose in found if statics["tcp_position_m"][2] > 0.0]


def spread(found, get):
    """A number with its range."""
    low, typical, high = sorted(get(found[at]) for at in ("stiffness", "low", "high"))
    return f"{digits(get(found['stiffness']))} ({digits(low)} to {digits(high)})"


def readme(name, arm, made, found, poses):
    source, joints = arm["source"], [row for row in arm["joints"].values() if "axis" in row]
    side = 1e3 * (arm["payload"] / DENSITY) ** (1.0 / 3.0)
    rows = [f"| {drive['joint']} | {math.degrees(row['limits'][0]):.0f} to {math.degrees(row['limits'][1]):.0f} | {math.degrees(row['limits'][2]):.0f} | "
            f"{row['limits'][3]:g} | {'cycloidal' if 'cycloidal' in drive['source'] else 'strain wave'} | "
            f"{drive['stiffness']:.3g} | {drive['low']:.3g} | {drive['high']:.3g} |" for drive, row in zip(made["drives"], joints)]
    beams = [f"  * `{entry['link']}`: {section(entry)}" for entry in arm.get("beams", [])] or ["  * none"]
    worst = max(poses)
    typical, pose = found["stiffness"], degrees(arm["pose"])
    return "\n".join([
        f"# {arm['title']}", "",
        wrapped(f"{arm['what']} None of this is endorsed by the maker."), "",
        wrapped(f"At the rated pose with {arm['payload']:g} kg the flange sags by {spread(found, lambda f: f['sag']).replace(' (', ' mm (')}, and the first natural frequency is "
                f"{spread(found, lambda f: f['f'][0]).replace(' (', ' Hz (')}. In brackets: the range that follows from the assumed stiffness. More figures are at the end of "
                "the page."), "",
        "```sh", f"flexarm compare {name}                # the sample motion with the rated payload", f"flexarm statics {name} --at={pose}", "```", "",
        "## Published", "",
        wrapped(f"* Masses, centres of mass, inertias, frames and limits of all links: `{source['file']}` of {source['repository']}, commit "
                f"`{source['commit'][:12]}`, version {source['version']}, {source['licence']}, copyright {source['copyright'].rstrip('.')}. The figures are in "
                f"`tests/arms/{name}.toml`; `tools/make_arms.py --vendor DIR` compares them with that file."),
        wrapped(f"* Links: {sum(row[0] for row in arm['links'].values()):.4g} kg. {arm['published']}"), "",
        "## Assumed", "",
        wrapped(f"* Payload: a cube of aluminium (side {side:.0f} mm) bolted to the flange, its centre of mass {side / 2:.0f} mm in front of it."),
        wrapped("* Reducers: no stiffness is published. The rated torque of a reducer is the effort limit of its joint divided by 2.5; stiffness and range are those of "
                "reducers of this torque in catalogues ([method](../../docs/new_robot.md)). Damping is 3 % of critical; there is no friction and no play."),
        *(wrapped(f"* {note}") for note in arm.get("notes", [])),
        wrapped("* Flexible links: the slender ones whose published inertia can be divided into two rigid bodies. The outer section is that of the maker's mesh. The wall "
                "contains all of the link's mass (half of it at the lower end of the range). The other links are rigid."),
        *beams, "* Shapes: drums, boxes and pipes of about the maker's sizes, for pictures only.", "",
        "| joint | range (deg) | speed (deg/s) | effort limit (N m) | reducer | stiffness (N m/rad) | from | to |", "| --- | --- | --- | --- | --- | --- | --- | --- |", *rows, "",
        "## Results", "",
        wrapped(f"At the rated pose ({arm['pose_words']}: {pose}; flange {typical['tcp'][2]:.2f} m high) with the payload and locked drives:"), "",
        "| quantity | value |", "| --- | --- |",
        f"| reach: maximum distance of the flange from the first joint, over 400 poses (m) | {made['reach_m']:.2f} |",
        f"| sag of the flange under the weight of arm and payload (mm) | {spread(found, lambda f: f['sag'])} |",
        f"| of which under the payload (mm) | {digits(typical['sag'] - found['unloaded']['sag'])} |",
        f"| maximum compliance of the flange (µm/N) | {spread(found, lambda f: f['compliance'])} |",
        *(f"| natural frequency {k + 1} (Hz) | {spread(found, lambda f, k=k: f['f'][k])} |" for k in range(3)),
        f"| shares of the sag (%) | reducers {digits(typical['gears'])}, links {digits(100.0 - typical['gears'])} |", "",
        wrapped(f"Maximum sag over {len(poses)} poses ({POSES} of a Halton sequence over the joint ranges, without those below the floor): {digits(worst[0])} mm at "
                f"{degrees(worst[1])}."), ""])


def wrapped(text):
    return textwrap.fill(text, 100, subsequent_indent="  " if text.startswith("* ") else "", break_long_words=False, break_on_hyphens=False)


def section(entry):
    beam = entry["beam"]
    if "outer_diameter" in beam:
        shape = f"tube {1e3 * beam['outer_diameter']:.0f} mm"
    else:
        shape = f"{beam['section']} {1e3 * beam['width']:.0f} x {1e3 * beam['height']:.0f} mm"
    wall = f", wall {1e3 * beam['wall']:.1f} mm" if "wall" in beam else ", solid"
    return f"{shape}{wall}, {beam['material'].replace('_', ' ')}"


def texts(name, arm):
    """Returns the files of an arm's folder."""
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        urdf = urdf_text(name, arm)
        (folder / f"{name}.urdf").write_text(urdf)
        meshes = {f"meshes/{link}.stl": stl(map(solid, parts.splitlines())) for link, parts in arm["shapes"].items()}
        (folder / "meshes").mkdir()
        for file, data in meshes.items():
            (folder / file).write_bytes(data)
        made = answer("new", folder / f"{name}.urdf", "--payload", arm["payload"], "--tool", "tool0", *reducers(arm), "-o", folder / "new", "--no-run")
        found = outcome(lambda at: robot_text(name, arm, made["drives"], at), arm["pose"], made["drives"], folder)
        page = readme(name, arm, made, found, sags(arm, folder / "stiffness.toml"))
        own = {} if "motion" in arm else {"motion.toml": (folder / "new/motion.toml").read_text()}
        return {f"{name}.urdf": urdf, "robot.toml": robot_text(name, arm, made["drives"]), "README.md": page, **own, **meshes}


def differs(written, computed):
    """Whether two texts differ by more than one unit in the last digit of a number."""
    pairs = [re.split(r"(-?\d+\.?\d*(?:e[-+]?\d+)?)", text) for text in (written, computed)]
    if len(pairs[0]) != len(pairs[1]):
        return True
    for a, b in zip(*pairs):
        if a != b:
            try:
                unit = 10.0 ** -max(len(x.split("e")[0].partition(".")[2]) for x in (a, b))
                if abs(float(a) - float(b)) > 1.01 * unit * (10.0 ** int(a.split("e")[1]) if "e" in a else 1.0):
                    return True
            except ValueError:
                return True
    return False


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="arms; all without")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--vendor", type=pathlib.Path, metavar="DIR")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--meshes", type=pathlib.Path, metavar="OUT")
    args = parser.parse_args()
    faults = []
    for name in args.names or sorted(path.stem for path in TABLES.glob("*.toml")):
        table = TABLES / f"{name}.toml"
        arm = tomllib.loads(table.read_text())
        if args.vendor and args.meshes:
            urdf, _ = expanded(arm, args.vendor, args.meshes / name)
            text = (ROBOTS / name / "robot.toml").read_text()
            for own, theirs in ((f"{name}.urdf", urdf.name), ("tool0", arm["source"]["tool"]), ("../../trajectories", f"{ROOT}/trajectories")):
                text = text.replace(own, theirs)
            (args.meshes / name / "robot.toml").write_text(text)
        elif args.vendor:
            head, _, body = table.read_text().partition(MARK)
            read = table_of(arm, args.vendor)
            if args.write:
                table.write_text(f"{head}{MARK}{read}")
            elif read != body:
                faults.append(f"{table.relative_to(ROOT)}: differs from the maker's files")
        else:
            for file, text in texts(name, arm).items():
                path, data = ROBOTS / name / file, text if isinstance(text, bytes) else text.encode()
                if not args.check:
                    path.parent.mkdir(exist_ok=True, parents=True)
                    path.write_bytes(data)
                elif not path.exists() or (path.read_bytes() != data if data is text else differs(path.read_text(), text)):
                    faults.append(f"{path.relative_to(ROOT)}: run tools/make_arms.py {name}")
        print(name)
    print("\n".join(faults), file=sys.stderr, end="\n" if faults else "")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
