"""Regenerates tests/golden/reference_arm_mid.csv: converged TCP motion of the reference arm.

Computed by Pinocchio and scipy.

    python tools/golden_reference_arm.py             compare with the stored file; status 1 if they differ by over 1e-11
    python tools/golden_reference_arm.py --check     also compare with Radau
    python tools/golden_reference_arm.py --write     replace the stored file          (pip install pin scipy)

Hybrid dynamics: the six actuated joints follow the motion of trajectories/reference_arm.toml
exactly, the twelve elastic coordinates e are free:

    M_ee e'' = -K e - beta K e' - h_e(q, q', [q_a'', 0])          h by one RNEA, M_ee from CRBA

Model: robots/test/reference_arm as read by robot_file.py; each elastic joint is a translation and a
Z-Y-X rotation, so that all coordinates live in a vector space. The integrator is restarted where
the jerk of the motion jumps.
"""
import argparse
import sys
import tomllib
from pathlib import Path

import numpy as np
import pinocchio as pin
import scipy.linalg as sl
from scipy.integrate import solve_ivp

from robot_file import Arm

ROOT = Path(__file__).parent.parent
GOLDEN = ROOT / "tests" / "golden" / "reference_arm_mid.csv"
EVERY_S = 0.004
ALLOWED = 1e-11
HEADER = """\
# Reference arm (robots/test/reference_arm): converged TCP motion, drives prescribed, elastic joints as x y z rx ry rz with
# R = Rz Ry Rx and generalised force -(K e + beta K de/dt), start in static equilibrium.
# Tool: Pinocchio 4.1.0 (RNEA, CRBA) with scipy's DOP853 at rtol 1e-10, restarted at the jumps of the jerk; a Radau run
# at rtol 1e-9 agrees to 7.3e-13 m. Regenerate: tools/golden_reference_arm.py. Units m, rad, s; world axes;
# rotation = rotation vector of R_flexible R_rigid^T.
time,rigid_x,rigid_y,rigid_z,flexible_x,flexible_y,flexible_z,rotation_x,rotation_y,rotation_z
"""


class Motion:
    """Quintic moves from rest to rest with holds, from a waypoint file."""

    def __init__(self, path):
        file = tomllib.loads(path.read_text())
        assert file["profile"] == "quintic" and file["unit"] == "deg"
        here, self.t_end, self.moves = np.radians(file["start"]), 0.0, []
        self.start, self.kinks = here, [0.0]
        for move in file["move"]:
            to = np.radians(move["to"])
            self.moves.append((self.t_end, move["duration"], to - here))
            self.kinks.append(self.t_end + move["duration"])
            self.t_end += move["duration"] + move.get("hold", 0.0)
            self.kinks.append(self.t_end)
            here = to

    def __call__(self, t):
        q, v, a = self.start.copy(), np.zeros(len(self.start)), np.zeros(len(self.start))
        for start, T, way in self.moves:
            u = min(max((t - start) / T, 0.0), 1.0)
            q += way * u**3 * (10 - 15 * u + 6 * u * u)
            v += way * 30 * u * u * (1 - u) ** 2 / T
            a += way * 60 * u * (1 - u) * (1 - 2 * u) / T**2
        return q, v, a


class Hybrid:
    """e'' of the flexible arm along a motion."""

    def __init__(self, arm, motion):
        self.arm, self.motion, self.n = arm, motion, len(arm.elastic)
        betas = {f["damping"]["stiffness_beta"] for f in arm.file["flexible_link"]}
        assert len(betas) == 1
        self.beta = betas.pop()

    def acceleration(self, t, e, e_dot):
        arm, (q_a, v_a, a_a) = self.arm, self.motion(t)
        q, v, a = arm.full(q_a, e), arm.full(v_a, e_dot), arm.full(a_a)
        bias = pin.rnea(arm.model, arm.data, q, v, a)[arm.elastic]
        M = np.triu(pin.crba(arm.model, arm.data, q))
        M = (M + np.triu(M, 1).T)[np.ix_(arm.elastic, arm.elastic)]
        return sl.cho_solve(sl.cho_factor(M), -arm.K @ (e + self.beta * e_dot) - bias)

    def rates(self, t, y):
        return np.concatenate([y[self.n:], self.acceleration(t, y[:self.n], y[self.n:])])

    def integrate(self, times, method, rtol, atol):
        """Elastic coordinates at the times, from static equilibrium."""
        y = np.concatenate([self.arm.statics(self.motion(0.0)[0]), np.zeros(self.n)])
        out, calls = np.empty((len(times), self.n)), 0
        for begin, end in zip(self.motion.kinks[:-1], self.motion.kinks[1:]):
            inside = (times >= begin - 1e-9) & (times <= end + 1e-9)
            asked = np.union1d(np.clip(times[inside], begin, end), [end])
            run = solve_ivp(self.rates, (begin, end), y, method=method, rtol=rtol, atol=atol, max_step=0.02, t_eval=asked)
            assert run.success, run.message
            out[inside] = run.y[:self.n, np.searchsorted(asked, np.clip(times[inside], begin, end) - 1e-12)].T
            y, calls = run.y[:, -1], calls + run.nfev
        return out, calls

    def table(self, times, e):
        rows = []
        for t, x in zip(times, e):
            q_a = self.motion(t)[0]
            rigid, soft = self.arm.pose(q_a), self.arm.pose(q_a, x)
            rows.append([t, *rigid.translation, *soft.translation, *pin.log3(soft.rotation @ rigid.rotation.T)])
        return np.array(rows)


if __name__ == "__main__":
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("--check", action="store_true", help="second integrator (Radau)")
    ap.add_argument("--write", action="store_true", help="replace the stored file")
    args = ap.parse_args()
    motion = Motion(ROOT / "trajectories" / "reference_arm.toml")
    hybrid = Hybrid(Arm(ROOT / "robots/test" / "reference_arm"), motion)
    times = np.arange(round(motion.t_end / EVERY_S) + 1) * EVERY_S

    e, calls = hybrid.integrate(times, "DOP853", 1e-10, 1e-13)
    table = hybrid.table(times, e)
    deflection = np.linalg.norm(table[:, 4:7] - table[:, 1:4], axis=1)
    print(f"Pinocchio {pin.__version__}; DOP853, {calls} evaluations; f1 to f4"
          f" {hybrid.arm.modes(motion(0.0)[0])[:4].round(5)} Hz; peak {deflection.max():.8f} m at {times[deflection.argmax()]:.3f} s")
    if args.check:
        other, calls = hybrid.integrate(times, "Radau", 1e-9, 1e-12)
        apart = np.linalg.norm(hybrid.table(times, other)[:, 4:7] - table[:, 4:7], axis=1).max()
        print(f"Radau, {calls} evaluations: agrees to {apart:.1e} m")

    lines = "".join(",".join(f"{x:.12g}" for x in row) + "\n" for row in table + 0.0)
    if args.write:
        GOLDEN.write_text(HEADER + lines)
        print("written:", GOLDEN.relative_to(ROOT))
    stored = GOLDEN.read_text()
    body = [l for l in stored.splitlines() if l[0] not in "#t"]
    difference = np.abs(np.array([[float(x) for x in l.split(",")] for l in body]) - table)
    print(f"stored file, {len(body)} rows: largest difference {difference[:, 1:7].max():.1e} m, {difference[:, 7:].max():.1e} rad;"
          f" header {'the same' if stored.startswith(HEADER) else 'DIFFERS'}")
    sys.exit(0 if difference.max() <= ALLOWED and stored.startswith(HEADER) else 1)
