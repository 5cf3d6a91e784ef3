"""First frequencies of arms in robots/ by Pinocchio with a spring at every joint. Needs pin, scipy.

    python tools/check_arms.py [--program target/release/flexarm] [NAME ...]

Rigid links, motors locked, the rated payload, at the rated pose of tests/arms. Here: the equilibrium
k (q - q0) + g(q) = 0 by Newton's method, then M(q) and k + dg/dq. The program: `flexarm modes --links
rigid`. Exit status 1 if a frequency differs by more than 1e-9 of itself.
"""

import argparse
import json
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.linalg import eigh

from robot_file import Arm

ROOT = Path(__file__).resolve().parent.parent
ARMS = ["fanuc_r2000_210f", "ur10e", "franka_fr3"]


def frequencies(folder, q0):
    """Returns the frequencies (Hz) of the arm on its springs at rest under gravity."""
    arm = Arm(folder, elastic=False)
    stiffness = {drive["joint"]: drive["gearbox"]["stiffness"] for drive in arm.file["drive"]}
    K = np.diag([stiffness[name] for name in arm.names])
    q = q0.copy()
    for _ in range(20):
        slope = K + pin.computeGeneralizedGravityDerivatives(arm.model, arm.data, q)
        q -= np.linalg.solve(slope, K @ (q - q0) + pin.computeGeneralizedGravity(arm.model, arm.data, q))
    slope = K + pin.computeGeneralizedGravityDerivatives(arm.model, arm.data, q)
    M = pin.crba(arm.model, arm.data, q)
    M = np.triu(M) + np.triu(M, 1).T
    return np.sqrt(eigh(0.5 * (slope + slope.T), M, eigvals_only=True)) / (2.0 * np.pi)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=ARMS)
    parser.add_argument("--program", default=ROOT / "target/release/flexarm")
    args = parser.parse_args()
    worst = 0.0
    for name in args.names:
        pose = tomllib.loads((ROOT / f"tests/arms/{name}.toml").read_text())["pose"]
        folder = ROOT / "robots" / name
        line = [args.program, "modes", folder, "--links", "rigid", f"--at={','.join(f'{angle}deg' for angle in pose)}", "--json"]
        own = json.loads(subprocess.run(line, check=True, capture_output=True, text=True).stdout)["undamped_frequencies_hz"]
        other = frequencies(folder, np.radians(pose).astype(float))
        off = np.abs(np.array(own) / other - 1.0).max()
        print(f"{name:20} " + " ".join(f"{f:.3f}" for f in other[:3]) + f" Hz, largest difference {off:.1e}")
        worst = max(worst, off)
    return 0 if worst <= 1e-9 else 1


if __name__ == "__main__":
    sys.exit(main())
