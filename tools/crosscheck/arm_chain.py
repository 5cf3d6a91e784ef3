"""Reads a robot file with links from .flex files as a chain of bodies, as input for any program.

The frame of a body is at its joint. `X` is that frame in the frame of the preceding body, with all
coordinates zero. A joint rotates about one axis, or is elastic: e = (x, y, z, rx, ry, rz) in the
axes of the link, R = Rz(rz) Ry(ry) Rx(rx), force -(K e + beta K e'). The motion of the joints is a
list of quintics, also independent of the program.
"""
import math
import sys
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.interpolate import make_interp_spline
from scipy.optimize import brentq

sys.path.insert(0, str(Path(__file__).parent.parent))
from robot_file import merge, read_urdf, rpy_matrix, transport

TO_SI = {"m": 1.0, "mm": 1e-3, "N": 1.0, "kN": 1e3, "kg": 1.0, "t": 1e3}


def tensor(xx, yy, zz, xy, xz, yz):
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], float)


def moved(X, body):
    """Returns mass, centre and inertia of a body given in a frame at X."""
    mass, com, inertia = body
    return mass, X.act(np.asarray(com, float)), X.rotation @ inertia @ X.rotation.T


def read_flex(path):
    """p_B, p_S, K_S and the two parts (mass, com, inertia about com): link axes, SI."""
    file = tomllib.loads(path.read_text())
    assert (file["format"], file["version"]) == ("flexarm-reduced-link", 1) and len(file["part"]) == 2
    length, force, mass = (TO_SI[file["units"][k]] for k in ("length", "force", "mass"))
    # both in link axes, A the origin
    for frame in (file["interface"]["A"], file["split"]):
        assert np.abs(frame.get("rpy", [0.0])).max() == 0 and np.abs(np.array(frame.get("rotation", np.eye(3))) - np.eye(3)).max() == 0
    assert np.abs(file["interface"]["A"]["xyz"]).max() == 0
    s = file["stiffness"]
    assert s["kind"] == "6x6" and s["axes"] == "link" and s["order"] == "ux uy uz rx ry rz"
    unit = np.array([1.0] * 3 + [length] * 3)
    K_BB = np.array(s["matrix"]) * force / length * np.outer(unit, unit)
    p_B, p_S = (length * np.array(file[k]["xyz"]) if k == "split" else length * np.array(file["interface"][k]["xyz"]) for k in ("B", "split"))
    Ad_BS = transport(p_B - p_S)
    K_S = Ad_BS.T @ K_BB @ Ad_BS
    parts = [(p["mass"] * mass, length * np.array(p["com"]), tensor(*p["inertia"]) * mass * length**2) for p in file["part"]]
    return p_B, p_S, 0.5 * (K_S + K_S.T), parts


@dataclass
class Body:
    name: str
    X: pin.SE3
    axis: np.ndarray | None                             # None: an elastic joint
    K: np.ndarray | None = None
    inertias: list = field(default_factory=list)
    limit: dict = field(default_factory=dict)

    def inertia(self):
        return merge(self.inertias)


class Chain:
    """Bodies from base to tool, with the TCP in the frame of the last one."""

    def __init__(self, path):
        folder, file = path.parent, tomllib.loads(path.read_text())
        links, joints = read_urdf(folder / file["urdf"])
        flexible = {f["link"]: f for f in file["flexible_link"]}
        self.gravity = np.array(file["gravity"], float)
        self.bodies, self.flex_files = [], [folder / f["reduced"] for f in flexible.values()]
        tcp, load = file["tcp"], file["payload"]

        def visit(link, X, number):
            """X: the link's frame in that of the body with this index."""
            assert number == len(self.bodies) - 1                            # a chain, not a tree
            own = [links[link]] if links[link] else []
            if load["link"] == link:
                own.append((load["mass"], np.array(load["com"], float), tensor(*load["inertia"])))
            if link in flexible:
                f = flexible[link]
                distal = next(j for j in joints if j["name"] == f["distal"])
                p_B, p_S, K_S, parts = read_flex(folder / f["reduced"])
                assert f.get("segments", 2) == 2 and f.get("model", "lumped") == "lumped" and np.abs(distal["X"].translation - p_B).max() < 1e-12
                assert len(own) == 1 and abs(sum(p[0] for p in parts) / own[0][0] - 1) < 1e-6
                self.bodies[-1].inertias.append(moved(X, parts[0]))
                S = pin.SE3(np.eye(3), p_S)
                self.bodies.append(Body(link, X * S, None, K_S))
                X, own, number = S.inverse(), [parts[1]], number + 1
            # bodies on the floor do not move
            if self.bodies:
                self.bodies[-1].inertias += [moved(X, b) for b in own]
            if tcp["link"] == link:
                self.tcp = X.act(np.array(tcp["xyz"], float))
            for j in (j for j in joints if j["parent"] == link):
                if j["type"] == "fixed":
                    visit(j["child"], X * j["X"], number)
                else:
                    assert j["type"] == "revolute"
                    self.bodies.append(Body(j["name"], X * j["X"], j["axis"] / np.linalg.norm(j["axis"]), limit=j["limit"]))
                    visit(j["child"], pin.SE3.Identity(), number + 1)

        children = {j["child"] for j in joints}
        visit(next(l for l in links if l not in children), pin.SE3.Identity(), -1)
        self.speed_limits = [b.limit["velocity"] for b in self.bodies if b.axis is not None]


class Motion:
    """A waypoint file of quintic moves as pieces: joint = sum over k of coefficient[k] (t -
    knot)^k."""

    def __init__(self, path, speed_limits):
        file = tomllib.loads(path.read_text())
        assert file["unit"] == "deg" and file["profile"] == "quintic" and file["synchronised"]
        here, now = np.radians(file["start"]), 0.0
        self.start, knots, pieces = here, [], []
        for move in file["move"]:
            points = np.array([here, *(np.radians(p) for p in move.get("via", [])), np.radians(move["to"])])
            spline = self.move(points, move["duration"], np.array(speed_limits))
            for at, coefficients in spline:
                knots.append(now + at)
                pieces.append(coefficients)
            here, now = points[-1], now + move["duration"]
            if move.get("hold", 0.0):
                knots.append(now)
                pieces.append(np.vstack([here, np.zeros((5, len(here)))]))
                now += move["hold"]
        self.knots, self.pieces, self.t_end = np.array(knots), np.array(pieces), now

    @staticmethod
    def move(points, duration, weights):
        """Curve of minimum squared jerk through the points; passing times by the travel of the
        fastest joint.

        Returns pairs of the time of a point and the Taylor coefficients from there on."""
        quintic = lambda u: u**3 * (10 - 15 * u + 6 * u * u)
        if len(points) == 2:
            way, zero = points[1] - points[0], 0 * points[0]
            return [(0.0, np.array([points[0], zero, zero, 10 * way / duration**3, -15 * way / duration**4, 6 * way / duration**5]))]
        way = np.r_[0, np.cumsum((np.abs(np.diff(points, axis=0)) / weights).max(axis=1))]
        times = [0.0] + [brentq(lambda u: quintic(u) - s, 0, 1, xtol=1e-15) for s in way[1:-1] / way[-1]] + [1.0]
        rest = [(1, np.zeros(points.shape[1])), (2, np.zeros(points.shape[1]))]
        curve = make_interp_spline(duration * np.array(times), points, k=5, bc_type=(rest, rest))
        return [(t, np.array([curve(t, nu=k) / math.factorial(k) for k in range(6)])) for t in duration * np.array(times[:-1])]

    def __call__(self, t):
        k = min(max(np.searchsorted(self.knots, t, side="right") - 1, 0), len(self.knots) - 1)
        c, s = self.pieces[k], t - self.knots[k]
        return (c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5])))),
                c[1] + s * (2 * c[2] + s * (3 * c[3] + s * (4 * c[4] + s * 5 * c[5]))),
                2 * c[2] + s * (6 * c[3] + s * (12 * c[4] + s * 20 * c[5])))

    def many(self, times):
        """Values, velocities, accelerations and jerks at many times: arrays of rows."""
        k = np.clip(np.searchsorted(self.knots, times, side="right") - 1, 0, len(self.knots) - 1)
        c, s = self.pieces[k], (np.asarray(times) - self.knots[k])[:, None]
        out = []
        for order in range(4):
            out.append(sum(math.perm(i, order) * c[:, i] * s ** (i - order) for i in range(order, 6)))
        return out
