"""Loads a shipped arm, simulates two motions, and computes statics at several poses."""

from __future__ import annotations

import numpy as np

import flexarm


def main() -> None:
    robot = flexarm.load("kr210")
    arm = robot.flexible(links="modal", drives="elastic")

    run = arm.simulate()  # default motion
    print(f"{run!r}: peak TCP error {1e3 * np.linalg.norm(run.error, axis=1).max():.3f} mm")

    t = np.linspace(0.0, 1.0, 101)
    swing = 0.2 * (1.0 - np.cos(np.pi * t))
    q = np.outer(swing, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]) + [0.0, -1.2, 1.5, 0.0, 0.4, 0.0]
    run = arm.simulate(flexarm.Motion(t, q), step=1e-3)
    print(f"{run!r}")

    poses = np.linspace([0.0, -1.6, 1.5, 0.0, 0.4, 0.0], [0.0, -0.6, 1.5, 0.0, 0.4, 0.0], 5)
    answer = arm.statics(poses)
    for pose, hz, C in zip(poses, answer.frequencies[:, 0], answer.compliance):
        print(f"joint 2 at {pose[1]:+.2f} rad: first frequency {hz:.2f} Hz, {1e6 * C[2, 2]:.2f} um/N downwards")


if __name__ == "__main__":
    main()
