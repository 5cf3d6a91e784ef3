"""Regenerates tests/golden/{manutec_r3,kr210_identified}.csv: arms with elastic gearboxes.

The files contain the converged motion.

    python tools/golden_gearboxes.py             compare with the stored files; status 1 if they differ by over 1e-11
    python tools/golden_gearboxes.py --check     also compare with Radau
    python tools/golden_gearboxes.py --write     replace the stored files          (pip install pin scipy)

The model is described in drives.py; motors follow the motion exactly, start in static equilibrium.
"""
import argparse
import sys
import tomllib
from pathlib import Path

import numpy as np
import pinocchio as pin

from drives import GearedArm, Quintic, Trapezoid

ROOT = Path(__file__).parent.parent
RUNS = {  # robot and file: motion, its kind, sample interval (s)
    "manutec_r3": ("manutec_r3.toml", Trapezoid, 0.002),
    "kr210_identified": ("identified_arms.toml", Quintic, 0.002),
}
ALLOWED = 1e-11
HEADER = """\
# robots/{name} on trajectories/{motion}: converged motion with elastic gearboxes, motors prescribed,
# tau = k (q_motor - q) + d (q_motor' - q') on the joint side, no friction; start in static equilibrium.
# Tool: Pinocchio {pin} (RNEA, CRBA) with scipy's DOP853 at rtol 1e-12, restarted at the kinks of the motion; Radau at rtol
# 1e-10 agrees to 1e-13 m. Regenerate: tools/golden_gearboxes.py --write. Units m, rad, s; world axes (z up);
# rotation = rotation vector of R_flexible R_rigid^T; windup_i = angle of link i minus that of its motor, joint side.
"""


def golden(name, args):
    motion_file, kind, every = RUNS[name]
    motion = kind(tomllib.loads((ROOT / "trajectories" / motion_file).read_text()))
    arm = GearedArm(ROOT / "robots" / name)
    times = np.arange(int(motion.t_end / every + 1e-9) + 1) * every
    y, calls = arm.integrate(motion, times)
    table = arm.table(motion, times, y)
    error = np.linalg.norm(table[:, 4:7] - table[:, 1:4], axis=1)
    print(f"{name}: {motion.t_end:.6f} s, kinks {np.round(motion.kinks, 6)}; DOP853, {calls} evaluations")
    print(f"  TCP error: start {error[0]:.9f} m, peak {error.max():.9f} m at {times[error.argmax()]:.3f} s, end {error[-1]:.9f} m")
    print(f"  windup at the start {arm.statics(motion(0.0)[0])} rad; peaks {np.abs(table[:, 10:]).max(axis=0)}")
    for at in (0.0, motion.t_end):
        undamped, s = arm.modes(motion(at)[0], True)
        print(f"  t = {at:.3f} s: {undamped} Hz, damping {(-s.real / abs(s))[::2]}")
    if args.check:
        other, calls = arm.integrate(motion, times, "Radau", 1e-10, 1e-14)
        apart = arm.table(motion, times, other) - table
        print(f"  Radau, {calls} evaluations: agrees to {np.abs(apart[:, 4:7]).max():.1e} m, {np.abs(apart[:, 10:]).max():.1e} rad")

    columns = ["time", *(f"{kind}_{x}" for kind in ("rigid", "flexible", "rotation") for x in "xyz"),
               *(f"windup_{i + 1}" for i in arm.free)]
    header = HEADER.format(name=name, motion=motion_file, pin=pin.__version__) + ",".join(columns) + "\n"
    path = ROOT / "tests" / "golden" / f"{name}.csv"
    if args.write:
        path.write_text(header + "".join(",".join(f"{x:.12g}" for x in row) + "\n" for row in table))
        print("  written:", path.relative_to(ROOT))
    stored = path.read_text()
    body = np.array([[float(x) for x in l.split(",")] for l in stored.splitlines() if l[0] not in "#t"])
    difference = np.abs(body - table).max()
    print(f"  stored file, {len(body)} rows: largest difference {difference:.1e}; header {'the same' if stored.startswith(header) else 'DIFFERS'}")
    return difference <= ALLOWED and stored.startswith(header)


if __name__ == "__main__":
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("--check", action="store_true", help="second integrator (Radau)")
    ap.add_argument("--write", action="store_true", help="replace the stored files")
    args = ap.parse_args()
    np.set_printoptions(precision=9, linewidth=140)
    sys.exit(0 if all([golden(name, args) for name in RUNS]) else 1)
