"""Models a measured arm on a telescopic column and predicts poses that were not used for the fit.

    python tools/crosscheck/measured_arm.py FOLDER [-o FIGURES.json]     (pip install numpy scipy)

FOLDER has the data of Hilti's construction robot (CC BY-NC-SA 3.0), as measured_arm_data.py writes it
from the published files. With trailblazer_calibrated.urdf, whose joint frames were fitted by an
independent model and which is not published, the rows of the calibrated URDF are made as well. The program is $FLEXARM, else
target/release/flexarm. Prints every figure beside its bound; exit status 1 if one is larger. With -o,
the figures are written to a file, tests/verification/measured_arm.json; none of the data is.

1. Method: the displacement of the prism under the arm's weight with given springs, against a model of
   its own below: a chain of finite rotations whose moments are iterated to convergence.
2. Positions: `flexarm identify` on every second pose of one floor; the other poses and two other floors
   are predicted by `flexarm statics`. For comparison: the rigid robot, as it is and with its joint frames
   fitted, and fits to all poses of that floor.
3. Tilts of two accelerometers over the moment of the weight, and the law of a guide fitted to them.
4. Tilt of the foot on each floor.
"""
import argparse
import concurrent.futures
import csv
import datetime
import gzip
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

ROOT = Path(__file__).resolve().parent.parent.parent
FLEXARM = os.environ.get("FLEXARM", str(ROOT / "target" / "release" / "flexarm"))
SOURCE = "Hilti construction_robot_stationing_datasets@f26546d"
LICENCE = "Data: CC BY-NC-SA 3.0, Hilti; figures only."
GRAVITY = 9.81
JOINTS = ["column_prismatic_joint"] + [f"dsr_joint{k}" for k in range(1, 7)]
FOOT = "tracks_base_link_to_column_base"
# Sliding joint and end of its outer tube (m).
GUIDES = {"column_middle_joint": 1.448, "column_top_joint": 1.414}
URDFS = {"calibrated": "trailblazer_calibrated.urdf", "published": "trailblazer.urdf"}
FLOORS = ["outdoor", "pallet"]
# Start of every fit: round numbers of the right order of magnitude.
START = {"foot": 2e5, "tilt": [0.0, 0.0, 3e-7], "gears": [3e4, 3e4, 1.7e4, 1e4, 1e4]}
START_PLAY = {"gap": 5e-4, "centre": 0.0, "width": 20.0}
# Stiffness of the rigid robot whose joint frames are fitted; `identify` needs elastic drives.
STIFF = {"foot": 1e12, "tilt": [0.0, 0.0, 1e-16], "gears": [1e12] * 5}
FAILED = []


def report(what, found, bound, unit):
    """Prints a figure beside its bound, or without one as information."""
    late = "" if bound is None else f"  allowed {bound:g}" + ("" if found <= bound else "  TOO LARGE")
    print(f"{what:68} {found:.3g} {unit}{late}")
    if bound is not None and not found <= bound:
        FAILED.append(what)


def read(folder, name):
    """Columns of a data set: joint values, prism in the station's frame, accelerations, heights."""
    with gzip.open(folder / f"{name}.csv.gz", "rt") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    columns = lambda *names: np.array([[float(row[name]) for name in names] for row in rows])
    return {
        "q": columns(*JOINTS),
        "prism": columns("prism_x", "prism_y", "prism_z"),
        "foot": columns("base_ax", "base_ay", "base_az"),
        "tip": columns("tip_ax", "tip_ay", "tip_az"),
        "height": columns("height_m")[:, 0],
    }


def some(data, which):
    return {key: values[which] for key, values in data.items()}


# --- A model of its own ------------------------------------------------------------------------


def rotation(axis, angle):
    """Rodrigues' formula."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def pose(R=np.eye(3), p=(0, 0, 0)):
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, p
    return X


def of_rpy(rpy):
    roll, pitch, yaw = rpy
    return rotation((0, 0, 1), yaw) @ rotation((0, 1, 0), pitch) @ rotation((1, 0, 0), roll)


class Chain:
    """Joints from the base to the prism, with the masses on their links."""

    def __init__(self, urdf):
        root = ET.parse(urdf).getroot()
        numbers = lambda text: np.array([float(x) for x in text.split()])
        parents = {joint.find("child").get("link"): joint for joint in root.findall("joint")}
        self.joints, link = [], "prism"
        while link in parents:
            self.joints.insert(0, parents[link])
            link = parents[link].find("parent").get("link")
        masses = {}
        for link in root.findall("link"):
            inertial = link.find("inertial")
            if inertial is not None:
                origin = inertial.find("origin")
                at = numbers(origin.get("xyz", "0 0 0"))
                masses[link.get("name")] = (float(inertial.find("mass").get("value")), at)
        self.links = []
        for joint in self.joints:
            origin, mimic = joint.find("origin"), joint.find("mimic")
            at = pose(of_rpy(numbers(origin.get("rpy", "0 0 0"))), numbers(origin.get("xyz", "0 0 0")))
            follows = (mimic.get("joint"), float(mimic.get("multiplier")), float(mimic.get("offset"))) if mimic is not None else None
            self.links.append((joint.get("name"), joint.get("type"), at, follows, masses.get(joint.find("child").get("link"))))

    def prism(self, q, springs=None, gravity=None):
        """Prism in the base frame; with springs, at rest under gravity (unit vector, base axes)."""
        values = dict(zip(JOINTS, q))
        turns = np.zeros(2 + 2 * len(GUIDES) + 6)
        for _ in range(60 if springs else 1):
            X, axes, weights, k = np.eye(4), [], [], 0

            def turn(X, axis, angle):
                axes.append((X[:3, :3] @ axis, X[:3, 3].copy(), len(weights)))
                return X @ pose(rotation(axis, angle))

            for name, kind, at, follows, mass in self.links:
                X = X @ at
                if name == FOOT or name in GUIDES:
                    value = 0.0
                    if follows:
                        value = follows[1] * values[follows[0]] + follows[2]
                    middle = 0.5 * (GUIDES[name] + value) if name in GUIDES else 0.0
                    X = X @ pose(p=(0, 0, middle))
                    X = turn(X, np.array([1.0, 0, 0]), turns[k])
                    X = turn(X, np.array([0, 1.0, 0]), turns[k + 1])
                    X, k = X @ pose(p=(0, 0, value - middle)), k + 2
                elif kind == "revolute":
                    X = turn(X, np.array([0, 0, 1.0]), turns[k])
                    X, k = X @ pose(rotation((0, 0, 1), values[name])), k + 1
                if mass:
                    weights.append(((X @ np.append(mass[1], 1))[:3], mass[0]))
            if not springs:
                return X[:3, 3]
            moments = []
            for axis, point, first in axes:
                outward = weights[first:]
                moments.append(sum(m * GRAVITY * np.dot(axis, np.cross(c - point, gravity)) for c, m in outward))
            new = springs(values["column_prismatic_joint"], moments)
            if np.abs(new - turns).max() < 1e-14:
                return X[:3, 3]
            turns = new
        raise RuntimeError("the rotations do not converge")


def overlaps(column):
    """Overlaps of the two pairs of tubes (m) with the column's joint at a value."""
    return 1.448 - (0.5 * column - 0.706), 1.414 - (0.5 * column - 0.736)


def laws(foot, tilts, gears, plays):
    """Rotations of foot, guides and gears under their moments."""

    def of(column, moments):
        turns = [foot[axis] * moments[axis] for axis in (0, 1)]
        for stage, l in enumerate(overlaps(column)):
            for axis in (0, 1):
                M = moments[2 + 2 * stage + axis]
                c = tilts[axis]
                theta = (c[0] + c[1] / l + c[2] / l**2) * M
                if plays and plays[axis]:
                    gap, centre, width = plays[axis]
                    theta += 0.5 * gap / l * np.tanh((M - centre) / width)
                turns.append(theta)
        return np.array(turns + [c * M for c, M in zip(gears, moments[6:])])

    return of


# --- flexarm -----------------------------------------------------------------------------------


def robot_text(urdf, gravity, foot, tilts, gears, plays):
    """A robot file; foot and gears as stiffnesses, tilts and plays per axis."""

    def law(axis):
        play = ""
        if plays and plays[axis]:
            gap, centre, width = plays[axis]
            play = f", play = {{ gap = {gap!r}, centre = {centre!r}, width = {width!r} }}"
        return f"{{ compliance = {list(map(float, tilts[axis]))!r}{play} }}"

    text = f'format = 1\nname = "measured_arm"\nurdf = "{urdf}"\ngravity = {list(map(float, gravity))!r}\n'
    text += 'tcp = { link = "prism" }\n\n'
    drive = lambda joint, gearbox: f'[[drive]]\njoint = "{joint}"\nkind = "gearbox"\ngearbox = {{ {gearbox} }}\n\n'
    text += drive(FOOT, f"stiffness = [{foot[0]!r}, {foot[1]!r}, 1e10]")
    for joint, end in GUIDES.items():
        text += drive(joint, f"guide = {{ outer_end = {end}, inner_end = 0.0, x = {law(0)}, y = {law(1)} }}")
    for k, stiffness in enumerate(gears):
        text += drive(f"dsr_joint{k + 1}", f"stiffness = {stiffness!r}")
    return text


def run(*arguments):
    done = subprocess.run([FLEXARM, *map(str, arguments)], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, arguments))}\n{done.stderr}")
    return json.loads(done.stdout)


def places(robot, poses, rigid=False):
    """Positions of the TCP at rest, base frame (m)."""

    def place(q):
        found = run("statics", robot, "--json", "--at", ",".join(repr(float(x)) for x in q))
        return np.array(found["tcp_position_m"]) + (0 if rigid else np.array(found["sag_m"]))

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        return np.array(list(pool.map(place, poses)))


def station(own, seen):
    """Rotation and shift with the least sum of squares, seen = R own + t."""
    p, y = own.mean(0), seen.mean(0)
    U, _, Vt = np.linalg.svd((own - p).T @ (seen - y))
    R = Vt.T @ np.diag([1, 1, np.sign(np.linalg.det(Vt.T @ U.T))]) @ U.T
    return R, y - R @ p


def figures(own, seen, at):
    """Distances (mm) with the station where it is."""
    R, t = at
    return 1e3 * np.linalg.norm(seen - own @ R.T - t, axis=1)


def summary(mm):
    return {"rms_mm": round(float(np.sqrt((mm**2).mean())), 2), "p95_mm": round(float(np.percentile(mm, 95)), 2), "max_mm": round(float(mm.max()), 2)}


def measurements(folder, name, data, frames, plays, stiff):
    """Writes a measurement file and its table; returns its path."""
    table = "\n".join(",".join(repr(float(x)) for x in np.append(q, p)) for q, p in zip(data["q"], data["prism"]))
    (folder / f"{name}.csv").write_text(",".join(JOINTS + ["x", "y", "z"]) + "\n" + table + "\n")
    fit = ([] if stiff else ["drive.*stiffness*", "drive.*guide*"]) + (["joint.dsr*"] if frames else [])
    tie = [f"drive.*.guide.{axis}.compliance[{k}]" for axis in "xy" for k in range(3)]
    tie += [f"drive.*.guide.{axis}.play.{key}" for axis in plays for key in START_PLAY]
    text = f"format = 1\nfit = {json.dumps(fit)}\n"
    if not stiff:
        text += f'keep = ["drive.{FOOT}.gearbox.stiffness[2]"]\ntie = {json.dumps(tie)}\n'
    text += "[instrument.station]\n[target.prism]\nxyz = [0.0, 0.0, 0.0]\nunknown = true\n"
    text += f'[[place]]\nfile = "{name}.csv"\nstd = 0.001\n'
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path


def identified(folder, name, urdf, gravity, data, frames, plays, stiff=False):
    """Identifies a model; returns the robot file with the prism as TCP, and the answer."""
    start = STIFF if stiff else START
    play = tuple(START_PLAY.values())
    given = [play if axis in plays else None for axis in "xy"]
    text = robot_text(urdf, gravity, [start["foot"]] * 2, [start["tilt"]] * 2, start["gears"], given)
    robot = folder / f"{name}_start.toml"
    robot.write_text(text)
    found = run("identify", robot, measurements(folder, name, data, frames, plays, stiff), "--json", "-o", folder / name)
    written = (folder / name / "robot.toml").read_text()
    target = found["targets"][0]["xyz"]
    (folder / name / "robot.toml").write_text(written.replace('{ link = "prism" }', f'{{ link = "prism", xyz = {target!r} }}'))
    return folder / name / "robot.toml", found


def on_floor(robot, gravity, name):
    """A copy of a robot file for another floor."""
    lines = robot.read_text().splitlines()
    lines = [f"gravity = {list(map(float, gravity))!r}" if line.startswith("gravity") else line for line in lines]
    other = robot.with_name(f"robot_{name}.toml")
    other.write_text("\n".join(lines) + "\n")
    return other


# --- The checks --------------------------------------------------------------------------------


def method(folder, source, flat, gravity, given):
    """Displacement under given springs, against the chain above."""
    print("1. Method, without a fit")
    urdf = next(iter(URDFS.values()))
    chain, poses = Chain(source / urdf), flat["q"][::8]
    col, gear = given["without_play"]["col"], given["gear"][:5]
    play_of = lambda key: (given[key][0], given[key][1], abs(given[key][2]) + 3.0)
    found = {}
    for name, plays in (("springs", None), ("play", [play_of("play_x"), play_of("play_y")])):
        tilts = [[0.0, col[1], col[2]], [0.0, col[4], col[5]]]
        robot = folder / f"method_{name}.toml"
        stiffness = [1 / c for c in gear]
        robot.write_text(robot_text(urdf, GRAVITY * gravity, [1 / col[0], 1 / col[3]], tilts, stiffness, plays))
        law = laws((col[0], col[3]), tilts, list(gear) + [0.0], plays)
        truth = np.array([chain.prism(q, law, gravity) for q in poses])
        rigid = np.array([chain.prism(q) for q in poses])
        own = places(robot, poses)
        apart = 1e3 * np.linalg.norm(own - truth, axis=1).max()
        size = 1e3 * np.linalg.norm(truth - rigid, axis=1).max()
        report(f"   {len(poses)} poses, {name}, displacement of at most {size:.1f} mm", apart, 0.05, "mm")
        found[f"{name}_mm"] = float(f"{apart:.1e}")
    return found


def positions(folder, source, flat, floors, down):
    """Fits on half of the poses of one floor, predictions of the others."""
    print("2. Positions: rms of the distance [mm]: fitted, held out (p95, largest), other floors")
    half = np.arange(len(flat["q"])) % 2 == 0
    train, held = some(flat, half), some(flat, ~half)
    models, kept, whole = [], {}, []

    def judged(robot, entry):
        """Adds the figures of all sets to an entry; returns the distances of the held-out poses."""
        own = places(robot, train["q"])
        at = station(own, train["prism"])
        entry["train"] = summary(figures(own, train["prism"], at))
        mm = figures(places(robot, held["q"]), held["prism"], at)
        entry["held_out"] = summary(mm)
        on_others(robot, entry)
        out = entry["held_out"]
        print(f"   {entry['name']}: {entry['train']['rms_mm']}, {out['rms_mm']} ({out['p95_mm']}, {out['max_mm']}), outdoor {entry['outdoor']['rms_mm']}, pallet {entry['pallet']['rms_mm']}")
        return mm

    def on_others(robot, entry):
        for floor in FLOORS:
            own = places(on_floor(robot, GRAVITY * down[floor], floor), floors[floor]["q"])
            entry[floor] = summary(figures(own, floors[floor]["prism"], station(own, floors[floor]["prism"])))

    for urdf in URDFS:
        for plays in ("", "y", "xy"):
            frames = urdf == "published"
            name = f"{urdf}_{plays or 'springs'}"
            robot, found = identified(folder, name, URDFS[urdf], GRAVITY * down["flat"], train, frames, plays)
            entry = {"name": name, "urdf": urdf, "play": bool(plays), "about": plays, "free_numbers": len(found["parameters"]) + 9}
            mm = judged(robot, entry)
            report(f"   {name}: held out", entry["held_out"]["rms_mm"], 1.35 if plays else 2.0, "mm")
            models.append(entry)
            kept[name] = (mm, found)
            if plays != "xy":
                robot, found = identified(folder, f"{name}_whole", URDFS[urdf], GRAVITY * down["flat"], flat, frames, plays)
                own = places(robot, flat["q"])
                all_of_it = {"name": name, "train": summary(figures(own, flat["prism"], station(own, flat["prism"])))}
                on_others(robot, all_of_it)
                print(f"   {name}, fitted to all {len(flat['q'])} poses: {all_of_it['train']['rms_mm']}, outdoor {all_of_it['outdoor']['rms_mm']}, pallet {all_of_it['pallet']['rms_mm']}")
                whole.append(all_of_it)
    robot, found = identified(folder, "published_rigid", URDFS["published"], GRAVITY * down["flat"], train, True, "", stiff=True)
    frames_only = {"name": "published_rigid", "urdf": "published", "free_numbers": len(found["parameters"]) + 9}
    judged(robot, frames_only)
    report("   published URDF, joint frames fitted, rigid: held out", frames_only["held_out"]["rms_mm"], None, "mm")
    first, urdf = next(iter(URDFS.items()))
    chain = Chain(source / urdf)
    own = lambda data: np.array([chain.prism(q) for q in data["q"]])
    at = station(own(train), train["prism"])
    rigid = {"urdf": first, "train": summary(figures(own(train), train["prism"], at)), "held_out": summary(figures(own(held), held["prism"], at))}
    for floor in FLOORS:
        rigid[floor] = summary(figures(own(floors[floor]), floors[floor]["prism"], station(own(floors[floor]), floors[floor]["prism"])))
    report(f"   the {first} URDF as a rigid robot: held out", rigid["held_out"]["rms_mm"], None, "mm")
    scatter = np.column_stack([kept[f"{first}_springs"][0], kept[f"{first}_y"][0]])
    numbers = [
        {"name": p["name"], "value": float(f"{p['value']:.4g}"), "std": float(f"{p['std']:.2g}"), "unit": p["unit"]}
        for p in kept[f"{first}_y"][1]["parameters"]
        if p["identifiable"]
    ]
    for urdf, undeformed in {first: rigid, "published": frames_only}.items():
        best = next(m for m in models if m["name"] == f"{urdf}_y")["held_out"]["rms_mm"]
        part = 1 - (best / undeformed["held_out"]["rms_mm"]) ** 2
        print(f"   {urdf}: springs and play about y explain {100 * part:.1f} % of the mean square of the rigid robot")
    return {"models": models, "whole": whole, "rigid": rigid, "rigid_frames": frames_only, "scatter": np.round(scatter, 2).tolist(), "identified": numbers}


def tilts(source, flat, gravity):
    """Tilt of the column's tip against its foot over the moment of the weight at the tip."""
    print("3. Tilts: measured slope, law [urad/(N m)]")
    chain = Chain(source / URDFS["published"])
    tilt = lambda a: np.column_stack([a[:, 1], -a[:, 0]]) / np.linalg.norm(a, axis=1)[:, None]
    turned = 1e6 * (tilt(flat["tip"]) - tilt(flat["foot"]))
    moments = np.array([moment_at_mount(chain, q, gravity) for q in flat["q"]])
    heights = np.unique(flat["height"])
    rows, widths = [], []
    for axis in (0, 1):
        slopes, lengths = [], []
        for height in heights:
            at = flat["height"] == height
            M, theta = moments[at, axis], turned[at, axis]
            A = np.column_stack([np.ones(at.sum()), M])
            if axis == 1:
                # With the step of the play, whose centre and width are searched.
                step = lambda x: np.column_stack([A, np.tanh((M - x[0]) / (1 + abs(x[1])))])
                rest = lambda x: theta - step(x) @ np.linalg.lstsq(step(x), theta, rcond=None)[0]
                starts = [least_squares(rest, [c, w]) for c in (0, 10, 20) for w in (5, 15, 30)]
                A = step(min(starts, key=lambda s: s.cost).x)
            fit = np.linalg.lstsq(A, theta, rcond=None)[0]
            slopes.append(fit[1])
            lengths.append(overlaps(flat["q"][at, 0].mean()))
            widths.append(1 - (theta - A @ fit).var() / theta.var())
        law = np.array([[1, sum(1 / l for l in pair), sum(1 / l**2 for l in pair)] for pair in lengths])
        slopes = np.array(slopes)
        weights = 1 / slopes
        c = least_squares(lambda c: weights * (law @ c - slopes), [5, 0, 0.2], bounds=(0, np.inf)).x
        for height, measured, own, r2 in zip(heights, slopes, law @ c, widths[-len(heights):]):
            rows.append({"height_m": float(height), "axis": "xy"[axis], "measured_urad_per_nm": round(float(measured), 2), "law_urad_per_nm": round(float(own), 2), "r2": round(float(r2), 4)})
            report(f"   {height:.2f} m about {'xy'[axis]}: {measured:.2f}, {own:.2f}", abs(own / measured - 1), 0.05 if axis == 0 else None, "")
        print(f"   law about {'xy'[axis]}: {c[0]:.3f} + {c[1]:.3f} sum 1/l + {c[2]:.4f} sum 1/l^2")
    return rows


def foot_tilts(source, sets, down):
    """Tilt of the column's foot over the moment of the weight: how far the floor yields."""
    print("4. Tilt of the foot: range [urad], slope over the moment [urad/(N m)]")
    chain, rows = Chain(source / URDFS["published"]), []
    for floor, data in sets.items():
        turned = 1e6 * np.column_stack([data["foot"][:, 1], -data["foot"][:, 0]]) / np.linalg.norm(data["foot"], axis=1)[:, None]
        moments = np.array([moment_at_mount(chain, q, down[floor]) for q in data["q"]])
        for axis in (0, 1):
            slope = np.polyfit(moments[:, axis], turned[:, axis], 1)[0]
            rows.append({"floor": floor, "axis": "xy"[axis], "range_urad": round(float(np.ptp(turned[:, axis]))), "urad_per_nm": round(float(slope), 2)})
            print(f"   {floor} about {'xy'[axis]}: {rows[-1]['range_urad']}, {rows[-1]['urad_per_nm']}")
    return rows


def moment_at_mount(chain, q, gravity):
    """Moment of the weight outward of the column's mount about its origin, base axes (N m)."""
    values, X, weights, mount = dict(zip(JOINTS, q)), np.eye(4), [], None
    for name, kind, at, follows, mass in chain.links:
        X = X @ at
        if kind == "revolute":
            X = X @ pose(rotation((0, 0, 1), values[name]))
        elif kind == "prismatic":
            value = follows[1] * values[follows[0]] + follows[2] if follows else values[name]
            X = X @ pose(p=(0, 0, value))
        if name == "column_tip_to_tip_mount":
            mount = X[:3, 3].copy()
        elif mount is not None and mass:
            weights.append(((X @ np.append(mass[1], 1))[:3], mass[0]))
    return sum(np.cross(c - mount, m * GRAVITY * gravity) for c, m in weights)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of the data")
    parser.add_argument("-o", "--output", type=Path, help="file of the figures")
    arguments = parser.parse_args()
    source = arguments.folder
    if not (source / URDFS["calibrated"]).is_file():
        del URDFS["calibrated"]
    needed = [*URDFS.values(), "poses.json", "compliances.json", *(f"{name}.csv.gz" for name in ("flat_train", *FLOORS))]
    missing = [name for name in needed if not (source / name).is_file()]
    if missing:
        sys.exit(f"{source} has no {', '.join(missing)}: tools/crosscheck/measured_arm_data.py writes them")
    down = {name: np.array(found["gravity_in_base"]) for name, found in json.loads((source / "poses.json").read_text()).items()}
    given = json.loads((source / "compliances.json").read_text())
    flat, floors = read(source, "flat_train"), {floor: read(source, floor) for floor in FLOORS}
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for urdf in URDFS.values():
            (folder / urdf).write_bytes((source / urdf).read_bytes())
        found = {
            "source": SOURCE,
            "licence": LICENCE,
            "program": "flexarm",
            "script": "tools/crosscheck/measured_arm.py",
            "date": datetime.date.today().isoformat(),
            "outside": {name: hashlib.sha256((source / name).read_bytes()).hexdigest() for name in needed},
            "method": method(folder, source, flat, down["flat"], given),
        }
        found.update(positions(folder, source, flat, floors, down))
        found["tilts"] = tilts(source, flat, down["flat"])
        found["foot"] = foot_tilts(source, {"flat": flat, **floors}, down)
    if arguments.output:
        arguments.output.write_text(json.dumps(found, indent=1) + "\n")
    sys.exit(f"too large: {', '.join(FAILED)}" if FAILED else 0)


if __name__ == "__main__":
    main()
