"""Checks trajectories/ against their robots: limits, torques, floor. Needs Pinocchio.

    python tools/check_trajectories.py

Samples each file at 1 kHz with an independent reader of the format, and prints the maximum used
share of position range, speed limit and effort limit (rigid arm with payload) of any joint, and the
lowest point of arm and payload above the floor z = 0. Ends with status 1 if a limit is exceeded,
except that stress.toml exceeds the efforts by design.
"""
import sys
import tomllib
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicHermiteSpline, make_interp_spline
from scipy.optimize import brentq

from robot_file import Arm, origin

ROOT = Path(__file__).parent.parent
FILES = {"pick_and_place.toml": "kr210", "point_to_point.toml": "kr210", "large_moves.toml": "kr210", "stress.toml": "kr210", "iso9283_path.csv": "kr210",
         "handling.toml": "fanuc_r2000_210f", "reference_arm.toml": "test/reference_arm", "beam_hold.toml": "test/one_beam", "beam_swing.toml": "test/three_beams",
         "manutec_r3.toml": "manutec_r3", "identified_arms.toml": ("kr210_identified", "kr500_identified"), "three_mass.toml": "abb_three_mass", "moberg_arm.toml": "test/moberg_arm"}
# m; the box behind the inertia of the payload
PAYLOAD_HALF_SIZE = np.array([0.25, 0.25, 0.20])
quintic = lambda u: u**3 * (10 - 15 * u + 6 * u * u)


def quintic_move(points, duration, weights):
    """Curve of minimum squared jerk through the points; passing times by the travel of the fastest
    joint."""
    points = np.array(points)
    if np.ptp(points, axis=0).max() == 0:
        return lambda t: points[0] + 0 * t[:, None]
    way = np.r_[0, np.cumsum((np.abs(np.diff(points, axis=0)) / weights).max(axis=1))]
    times = [0.0] + [brentq(lambda u: quintic(u) - s, 0, 1) for s in way[1:-1] / way[-1]] + [1.0]
    rest = [(1, np.zeros(points.shape[1])), (2, np.zeros(points.shape[1]))]
    if len(points) == 2:
        return lambda t: points[0] + quintic(np.clip(t / duration, 0, 1))[:, None] * (points[1] - points[0])
    spline = make_interp_spline(times, points, k=5, bc_type=(rest, rest))
    return lambda t: spline(np.clip(t / duration, 0, 1))


def ramp_move(p, q, v, a, jerk):
    """Synchronised seven-phase move within speed, acceleration and jerk limits; returns curve and
    duration."""
    d = np.abs(q - p)
    moving = d > 0
    v, a = (v[moving] / d[moving]).min(), (a[moving] / d[moving]).min()
    t_jerk = a / (jerk / d[moving]).min() if jerk else 0.0
    ramp = v / a + t_jerk
    total = 1 / v + ramp
    assert total >= 2 * ramp and ramp >= 2 * t_jerk, "the move is too short to reach the speed limit"
    t = np.arange(0, total, 1e-4)
    t_a = ramp - t_jerk if t_jerk else ramp
    acc = lambda t: np.interp(t, [0, t_jerk, t_a, ramp], [0, a, a, 0]) if t_jerk else np.where((t >= 0) & (t < ramp), a, 0.0)
    s = np.cumsum(np.cumsum(acc(t) - acc(total - t)) * 1e-4) * 1e-4
    s /= s[-1]
    return lambda x: p + np.interp(x, t, s)[:, None] * (q - p), total


def read_toml(path, speed_limits):
    file = tomllib.loads(path.read_text())
    scale = np.pi / 180 if file["unit"] == "deg" else 1.0
    here, parts = np.array(file["start"]) * scale, []
    for move in file["move"]:
        get = lambda key, default=None: move.get(key, file.get(key, default))
        to = np.array(move["to"]) * scale
        if get("profile", "quintic") == "quintic":
            duration = move["duration"]
            curve = quintic_move([here, *(np.array(p) * scale for p in move.get("via", [])), to], duration, speed_limits)
        else:
            jerk = get("jerk") * scale if get("profile") == "s-curve" else None
            own = [file.get("limits", {}).get(j, {}) for j in file["joints"]]
            speed = np.array([l["velocity"] * scale if "velocity" in l else v for l, v in zip(own, speed_limits)])
            acceleration = np.array([l["acceleration"] if "acceleration" in l else get("acceleration") for l in own]) * scale
            curve, duration = ramp_move(here, to, speed * get("speed", 1.0), acceleration, jerk)
        total = duration + move.get("hold", 0.0)
        parts.append(curve(np.arange(0, total, 1e-3)))
        here = to
    q = np.vstack(parts + [here[None]])
    return np.arange(len(q)) * 1e-3, q, file["joints"]


def read_csv(path):
    lines = [l for l in path.read_text().splitlines() if not l.startswith("#")]
    names, table = lines[0].split(","), np.array([[float(x) for x in l.split(",")] for l in lines[1:]])
    joints = [n for n in names[1:] if "." not in n]
    column = lambda n: table[:, names.index(n)]
    t = np.arange(0, table[-1, 0], 1e-3)
    q = np.column_stack([CubicHermiteSpline(table[:, 0], column(j), column(j + ".vel"))(t) for j in joints])
    return t, q, joints


def corners(arm, folder):
    """Points of each link, link axes: vertices of its meshes, corners of its primitives, box of the
    payload."""
    import xml.etree.ElementTree as ET
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    out = {}
    for link in ET.parse(folder / arm.file["urdf"]).getroot().findall("link"):
        for visual in link.findall("visual"):
            shape = visual.find("geometry")[0]
            if shape.tag == "mesh":
                raw = (folder / shape.get("filename")).read_bytes()
                p = np.frombuffer(raw[84:], dtype=[("n", "<3f4"), ("v", "<9f4"), ("x", "<u2")])["v"].reshape(-1, 3)
                p = np.unique(p, axis=0)
            elif shape.tag == "box":
                p = signs * [float(x) / 2 for x in shape.get("size").split()]
            else:
                r = float(shape.get("radius"))
                p = signs * [r, r, float(shape.get("length", 2 * r)) / 2]
            X = origin(visual)
            out.setdefault(link.get("name"), []).append(p @ X.rotation.T + X.translation)
    load = arm.file.get("payload")
    if load:
        out.setdefault(load["link"], []).append(np.array(load["com"]) + signs * PAYLOAD_HALF_SIZE)
    return {k: np.vstack(v) for k, v in out.items()}


def check(name, robot):
    folder, path = ROOT / "robots" / robot, ROOT / "trajectories" / name
    arm = Arm(folder, elastic=False)
    low, high, speed, effort = (np.array([l[k] for l in arm.limits]) for k in ("lower", "upper", "velocity", "effort"))
    t, q, joints = read_csv(path) if path.suffix == ".csv" else read_toml(path, speed)
    assert joints == arm.names, (joints, arm.names)
    qd = np.gradient(q, t, axis=0)
    qdd = np.gradient(qd, t, axis=0)
    tau = np.array([pin.rnea(arm.model, arm.data, *x) for x in zip(q[::5], qd[::5], qdd[::5])])
    # frames of the links from a second model, directly from the URDF
    model = pin.buildModelFromUrdf(str(folder / arm.file["urdf"]))
    data, points, lowest = model.createData(), corners(arm, folder), {}
    for x in q[::20]:
        pin.framesForwardKinematics(model, data, x)
        for link, p in points.items():
            if link in ("base_link", "link_0", "link_1", "beam_1"):   # these are on the floor
                continue
            X = data.oMf[model.getFrameId(link)]
            lowest[link] = min(lowest.get(link, np.inf), (p @ X.rotation[2] + X.translation[2]).min())
    link = min(lowest, key=lowest.get)
    position = (np.abs(q - (low + high) / 2) / ((high - low) / 2)).max()
    share = [position, (np.abs(qd) / speed).max(), (np.abs(tau) / effort).max()]
    tcp = np.array([arm.pose(x).translation for x in q[::5]])
    print(f"{name:20} {robot:18} {t[-1]:6.2f} s; position {share[0]:.2f}, speed {share[1]:.3f}, effort {share[2]:.2f} of the limit;"
          f" TCP up to {np.linalg.norm(np.diff(tcp, axis=0), axis=1).max() / 5e-3:.2f} m/s; lowest {lowest[link]:.3f} m ({link})")
    ok = share[0] <= 1 and share[1] <= 1.001 and (share[2] <= 1 or name == "stress.toml")
    # their axis is at height zero
    return ok and (lowest[link] > 0.05 or robot in ("test/one_beam", "abb_three_mass", "test/moberg_arm"))


if __name__ == "__main__":
    pairs = [(name, robot) for name, robots in FILES.items() for robot in np.atleast_1d(robots)]
    sys.exit(0 if all([check(*pair) for pair in pairs]) else 1)
