#!/usr/bin/env python3
"""Minimum durations of random paths within joint speeds and accelerations, by TOPP-RA.

Writes tests/golden/toppra.json. Needs: pip install toppra scipy numpy (toppra 0.6.10 wrote the
stored file).

The paths are those of TOPP-RA's own examples and benchmark (Pham & Pham 2018, section VI): cubic
splines through random points, random bounds. Each case stores the pieces of its spline, so that no
other spline code affects the comparison.
"""

import json
from importlib import metadata
from pathlib import Path

import numpy as np
import toppra
import toppra.algorithm as algorithm
import toppra.constraint as constraint
from scipy.interpolate import CubicSpline

toppra.setup_logging("ERROR")


def case(seed: int, dof: int, points: int) -> dict:
    rng = np.random.default_rng(seed)
    knots = np.linspace(0.0, 1.0, points)
    spline = CubicSpline(knots, rng.standard_normal((points, dof)))
    speed = 10.0 + 20.0 * rng.random(dof)
    acceleration = 10.0 + 2.0 * rng.random(dof)
    path = toppra.PPoly(spline.c, spline.x) if hasattr(toppra, "PPoly") else toppra.SplineInterpolator(knots, spline(knots))
    limits = [
        constraint.JointVelocityConstraint(np.column_stack([-speed, speed])),
        constraint.JointAccelerationConstraint(np.column_stack([-acceleration, acceleration])),
    ]
    durations = []
    for intervals in (1000, 4000):
        solver = algorithm.TOPPRA(limits, path, gridpoints=np.linspace(0.0, 1.0, intervals + 1), parametrizer="ParametrizeConstAccel")
        durations.append(solver.compute_trajectory(0, 0).duration)
    return {
        "seed": seed,
        "knots": knots.tolist(),
        # piece, joint: coefficients of (s - knot)^k, lowest first
        "pieces": np.transpose(spline.c[::-1], (1, 2, 0)).tolist(),
        "speed": speed.tolist(),
        "acceleration": acceleration.tolist(),
        "duration_s": durations[1],
        "duration_1000_s": durations[0],
    }


def main() -> None:
    cases = [case(seed, dof=6 + seed % 2, points=5 + 3 * (seed % 4)) for seed in range(12)]
    for one in cases:
        print(one["seed"], one["duration_s"], one["duration_1000_s"])
    out = Path(__file__).parent.parent / "tests" / "golden" / "toppra.json"
    out.write_text(json.dumps({"toppra": metadata.version("toppra"), "cases": cases}, separators=(",", ":")) + "\n")


if __name__ == "__main__":
    main()
