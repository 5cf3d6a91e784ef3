"""Writes trajectories/iso9283_path.csv: a test path in the diagonal plane of a cube. Needs
Pinocchio.

    python tools/make_iso_path.py

In the manner of ISO 9283 (not a conformity test): the test plane is the diagonal plane of a cube in
front of the arm; the TCP of robots/kr210 moves along the four sides of a rectangle and around a
circle in that plane, at 0.5 m/s, with fixed orientation perpendicular to the plane. Each side
starts and ends at rest; the speed rises and falls as a quintic, so that the acceleration is
continuous. Joint positions come from inverse kinematics, velocities and accelerations from the
Jacobian: J q' = V, J q'' = A - J' q'.
"""
from pathlib import Path

import numpy as np
import pinocchio as pin

from robot_file import Arm

ROOT = Path(__file__).parent.parent
RATE_HZ, SPEED, RAMP_S, REST_S = 100, 0.5, 0.4, 0.5
CENTRE, CUBE = np.array([1.75, 0.0, 1.05]), 0.63                     # m, world
# part of the cube's diagonal plane; m
RECTANGLE, DIAMETER = 0.8, 0.40
ACROSS, UP = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 1.0]) / np.sqrt(2)
SEED = np.radians([0.0, -70.0, 85.0, 0.0, 30.0, 0.0])


def profile(length):
    """Distance, speed and acceleration along a path from rest to rest, as functions of time, and
    the duration."""
    total = length / SPEED + RAMP_S
    assert total >= 2 * RAMP_S, "too short for the cruising speed"

    # from 0, with v = SPEED (10 u3 - 15 u4 + 6 u5)
    def rise(t):
        u = min(max(t / RAMP_S, 0.0), 1.0)
        s = SPEED * RAMP_S * (2.5 * u**4 - 3 * u**5 + u**6) + SPEED * max(t - RAMP_S, 0.0)
        return s, SPEED * u**3 * (10 - 15 * u + 6 * u * u), SPEED / RAMP_S * 30 * u * u * (1 - u)**2

    def at(t):
        if t <= total / 2:
            return rise(t)
        s, v, a = rise(total - t)
        return length - s, v, -a
    return at, total


def line(start, end):
    d = end - start
    length = np.linalg.norm(d)
    return length, lambda s, v, a: (start + d / length * s, d / length * v, d / length * a)


def circle():
    r = DIAMETER / 2

    def at(s, v, a):
        radial = np.cos(s / r) * ACROSS + np.sin(s / r) * UP
        tangent = -np.sin(s / r) * ACROSS + np.cos(s / r) * UP
        return CENTRE + r * radial, v * tangent, a * tangent - v * v / r * radial
    return 2 * np.pi * r, at


def path():
    """Position, velocity and acceleration of the TCP as a function of time, and the duration."""
    half = 0.5 * RECTANGLE * CUBE * ACROSS, 0.5 * RECTANGLE * CUBE * np.sqrt(2) * UP
    corners = [CENTRE + i * half[0] + j * half[1] for i, j in ((1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1))]
    on_circle = CENTRE + DIAMETER / 2 * ACROSS
    shapes = [line(CENTRE, corners[0])] + [line(p, q) for p, q in zip(corners, corners[1:])]
    shapes += [line(corners[-1], on_circle), circle(), line(on_circle, CENTRE)]
    pieces, begin = [], REST_S
    for length, at in shapes:
        way, total = profile(length)
        pieces.append((begin, total, at, way))
        begin += total

    def sample(t):
        now = max((p for p in pieces if p[0] <= t), key=lambda p: p[0], default=pieces[0])
        begin, total, at, way = now
        return at(*way(min(max(t - begin, 0.0), total)))
    return sample, begin + REST_S


def joints(arm, samples):
    """q, q', q'' of the joints for (position, velocity, acceleration) of the TCP, orientation
    fixed."""
    z = np.cross(UP, ACROSS)
    # tool z: perpendicular to the plane, forward and down
    z = z if z[2] < 0 else -z
    R_WT = np.column_stack([np.cross(ACROSS, z), ACROSS, z])
    R_WT = R_WT if np.trace(R_WT.T @ arm.pose(SEED).rotation) > 0 else R_WT @ np.diag([-1, -1, 1.0])
    q, rows = SEED.copy(), []
    for p, v, a in samples:
        for _ in range(100):
            X = arm.pose(q)
            error = np.r_[p - X.translation, pin.log3(R_WT @ X.rotation.T)]
            if np.abs(error).max() < 1e-13:
                break
            q = q + np.clip(np.linalg.solve(arm.jacobian(q), error), -0.2, 0.2)
        assert np.abs(error).max() < 1e-11, error
        J = arm.jacobian(q)
        qd = np.linalg.solve(J, np.r_[v, 0, 0, 0])
        pin.forwardKinematics(arm.model, arm.data, q, qd, np.zeros(6))
        pin.updateFramePlacements(arm.model, arm.data)
        # J' q'
        bias = pin.getFrameClassicalAcceleration(arm.model, arm.data, arm.tcp, pin.LOCAL_WORLD_ALIGNED)
        rows.append((q, qd, np.linalg.solve(J, np.r_[a, 0, 0, 0] - bias.vector)))
    return rows


if __name__ == "__main__":
    arm = Arm(ROOT / "robots" / "kr210" / "beams.toml", elastic=False)
    sample, total = path()
    times = np.arange(int(np.ceil(total * RATE_HZ)) + 1) / RATE_HZ
    rows = joints(arm, [sample(t) for t in times])
    q, qd, qdd = (np.array([r[i] for r in rows]) for i in range(3))
    # consistency of the columns: central differences, bounded by their own error of order h2
    for name, x, dx in (("velocity", q, qd), ("acceleration", qd, qdd)):
        print(f"largest difference of {name} from central differences: {np.abs(np.gradient(x, times, axis=0)[1:-1] - dx[1:-1]).max():.2e}")
    header = ["time"] + [f"joint_{i}{part}" for i in range(1, 7) for part in ("", ".vel", ".acc")]
    lines = ["# Test path in the manner of ISO 9283 for robots/kr210: rectangle and circle in the diagonal plane of a cube",
             f"# of {CUBE} m around x {CENTRE[0]}, y {CENTRE[1]}, z {CENTRE[2]} m, TCP at {SPEED} m/s. Written by tools/make_iso_path.py.",
             "# unit: rad", "# time: s", ",".join(header)]
    for t, *values in zip(times, q, qd, qdd):
        lines.append(",".join([f"{t:.2f}"] + [f"{values[part][i] + 0.0:.10f}" for i in range(6) for part in range(3)]))
    out = ROOT / "trajectories" / "iso9283_path.csv"
    out.write_text("\n".join(lines) + "\n")
    print(f"{out.name}: {len(times)} rows, {times[-1]:.2f} s")
