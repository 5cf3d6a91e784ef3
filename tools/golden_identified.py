"""Writes tests/golden/identified_arms.json: frequencies and compliance of the arms with identified
gearboxes.

    python tools/golden_identified.py             (pip install pin scipy)

Everything is computed twice: from the robot files by Pinocchio, and from the Denavit-Hartenberg
tables of make_identified_robots.py by Jacobians of the centres of mass, written out below. The two
must agree to 1e-11 before anything is written.
"""
import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import scipy
import scipy.linalg as sl

from drives import GearedArm
from make_identified_robots import ARMS, tensor

ROOT = Path(__file__).parent.parent
MILLING = (-10.09, 9.36, 17.81, 21.30, -28.85, -18.86)      # deg; the pose named in the source
CASES = [(robot, load, pose) for robot, poses in (("kr210_identified", ((0,) * 6, MILLING)), ("kr500_identified", ((0,) * 6,)))
         for pose in poses for load in (False, True)]
FIELDS = {
    "file": "robot file; loaded.toml has a point mass `payload_kg` at the flange, robot.toml none",
    "q": "angles of the motors, joint side, rad",
    "tcp": "position of the frame tool0 at the angles q, m, and its rotation matrix by rows",
    "mass_matrix": "joint space, at q; kg m2",
    "springs.frequencies_hz": "undamped, motors held, links at q, without gravity: det(K - w2 M) = 0",
    "springs.poles": "of M s2 + D s + K with the dampers: real and imaginary part, 1/s, those with positive or zero imaginary part",
    "gravity.windup": "angle of the links minus that of the motors at rest under gravity, rad",
    "gravity.sag": "TCP at rest minus TCP at q, m",
    "gravity.frequencies_hz, gravity.poles": "about that rest, with the stiffness of the weight",
    "compliance": "6x6 at tool0 at the angles q, springs only, linear first, world axes; m/N, rad/N, rad/(N m)",
}


# ------------------------------------------------------------------------------ second way: the
# table itself
def frames(arm, q):
    T = np.eye(4)
    T[2, 3] = arm["base"]
    out = [T]
    for (d, a, alpha, offset), angle in zip(arm["dh"], q):
        theta, al = angle + np.radians(offset), np.radians(alpha)
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(al), np.sin(al)
        T = T @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
        out.append(T)
    return out


def by_table(arm, q, load):
    """Returns mass matrix and Jacobian at the flange."""
    T = frames(arm, q)
    axes, origins, tip = [X[:3, 2] for X in T[:-1]], [X[:3, 3] for X in T[:-1]], T[6][:3, 3]
    jacobian = lambda p, n: np.array([[*np.cross(axes[j], p - origins[j]), *axes[j]] if j < n else [0.0] * 6 for j in range(6)]).T
    M = np.zeros((6, 6))
    for i in range(6):
        R, p = T[i + 1][:3, :3], T[i + 1][:3, 3]
        J = jacobian(p + R @ arm["com"][i], i + 1)
        M += arm["mass"][i] * J[:3].T @ J[:3] + J[3:].T @ R @ tensor(*arm["inertia"][i]) @ R.T @ J[3:]
    J = jacobian(tip, 6)
    return M + load * J[:3].T @ J[:3], J, T[6]


def case(robot, loaded, pose):
    table, q = ARMS[robot], np.radians(pose)
    file = f"robots/{robot}/{'loaded' if loaded else 'robot'}.toml"
    geared = GearedArm(ROOT / file)
    load = table["load"] if loaded else 0.0
    tcp, M, C = geared.arm.pose(q), geared.mass(q), geared.compliance(q)
    (hz, poles), (hz_g, poles_g) = geared.modes(q, False), geared.modes(q, True)
    windup = geared.statics(q)

    M2, J2, T2 = by_table(table, q, load)
    hz2 = np.sqrt(sl.eigh(np.diag(table["stiffness"]), M2, eigvals_only=True)) / (2 * np.pi)
    C2 = J2 @ np.diag(1 / np.array(table["stiffness"])) @ J2.T
    apart = max(np.abs(M - M2).max() / np.abs(M2).max(), np.abs(C - C2).max() / np.abs(C2).max(), np.abs(hz / hz2 - 1).max(),
                np.abs(tcp.homogeneous - T2).max())
    assert apart < 1e-11, apart

    sag = geared.arm.pose(geared.link(q, windup)).translation - tcp.translation
    ratio = lambda s: np.array([-x.real / abs(x) for x in s if x.imag >= 0])
    print(f"{file:36} {[round(x, 2) for x in pose]}: the two ways agree to {apart:.1e}")
    print(f"   springs alone {hz} Hz\n   under gravity {hz_g} Hz\n   damping {ratio(poles)}\n   sag {sag * 1e3} mm")
    print(f"   flange compliance {np.diag(C)[:3] * 1e6} um/N")
    rows, row = (lambda a: [[float(x) + 0.0 for x in r] for r in a]), (lambda a: [float(x) + 0.0 for x in a])
    pairs = lambda s: [[float(x.real), float(x.imag)] for x in s if x.imag >= 0]
    return {"robot": robot, "file": file, "payload_kg": load, "q": row(q), "tcp": {"position": row(tcp.translation), "rotation": rows(tcp.rotation)},
            "mass_matrix": rows(M), "springs": {"frequencies_hz": row(hz), "poles": pairs(poles)},
            "gravity": {"windup": row(windup), "sag": row(sag), "frequencies_hz": row(hz_g), "poles": pairs(poles_g)}, "compliance": rows(C)}


if __name__ == "__main__":
    np.set_printoptions(precision=6, linewidth=150, suppress=True)
    for name, arm in ARMS.items():      # no moment of a real body exceeds the sum of the other two
        for i, entries in enumerate(arm["inertia"]):
            low, middle, high = np.linalg.eigvalsh(tensor(*entries))
            assert 0 < low and high <= low + middle, (name, i + 1)
    golden = {"provenance": {
        "tool": "Pinocchio and numpy, two ways", "version": f"Pinocchio {pin.__version__}, numpy {np.__version__}, scipy {scipy.__version__}",
        "script": "tools/golden_identified.py", "units": "m, kg, s, rad, N, N m", "ordering": "joints from base to flange; linear first, angular second; world axes",
        "fields": FIELDS}, "cases": [case(*c) for c in CASES]}
    (ROOT / "tests" / "golden" / "identified_arms.json").write_text(json.dumps(golden, indent=1) + "\n")
    print("written: tests/golden/identified_arms.json")
