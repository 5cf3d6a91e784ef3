#!/usr/bin/env python3
"""Minimum durations of paths within joint speeds, accelerations and jerks (nonlinear program).

Writes tests/golden/jerk.json. Needs: pip install casadi numpy (casadi 3.8.2 with its IPOPT wrote
the stored file).

The paths are q_i(s) = b_i s + a_i sin(w_i s + p_i), 0 <= s <= 1, traversed from rest to rest with
zero acceleration at both ends. The jerk of s is constant on each of N equal intervals of time; s,
its speed and its acceleration follow exactly; bounds are imposed at both ends and in the middle of
each interval. The file has two values of N; the discretisation error falls with N^-1.4 (seeds 0 and
1 up to 1200).
"""

import json
from pathlib import Path

import casadi as ca
import numpy as np

BOUNDS = ("speed", "acceleration", "jerk")


def case(seed: int, dof: int) -> dict:
    rng = np.random.default_rng(seed)
    path = {
        "b": rng.uniform(-1.0, 1.0, dof),
        "a": rng.uniform(0.2, 0.6, dof),
        "w": rng.uniform(2.0, 9.0, dof),
        "p": rng.uniform(0.0, 2.0 * np.pi, dof),
        "speed": rng.uniform(1.5, 3.0, dof),
        "acceleration": rng.uniform(6.0, 12.0, dof),
        "jerk": rng.uniform(40.0, 120.0, dof) * (1.0 if seed % 2 else 4.0),
    }
    one = {"seed": seed} | {key: value.tolist() for key, value in path.items()}
    for intervals, key in ((150, "duration_150_s"), (600, "duration_s")):
        one[key] = duration(path, intervals)
    return one


def duration(path: dict, n: int) -> float:
    problem = ca.Opti()
    T, j = problem.variable(), problem.variable(n)
    s, v, acc = (problem.variable(n + 1) for _ in range(3))
    h = T / n

    def after(t):
        """Position, speed and acceleration at time t after the beginning of each interval."""
        s0, v0, a0 = s[:n], v[:n], acc[:n]
        return s0 + t * (v0 + t * (a0 / 2 + t * j / 6)), v0 + t * (a0 + t * j / 2), a0 + t * j

    for found, x in zip(after(h), (s, v, acc)):
        problem.subject_to(x[1:] == found)
    for part in (0.0, 0.5, 1.0):
        s_t, v_t, a_t = after(part * h)
        for a, b, w, p, speed, acceleration, jerk in zip(*(path[key] for key in ("a", "b", "w", "p", *BOUNDS))):
            phase = w * s_t + p
            d, dd, ddd = b + a * w * ca.cos(phase), -a * w**2 * ca.sin(phase), -a * w**3 * ca.cos(phase)
            problem.subject_to(problem.bounded(-1, d * v_t / speed, 1))
            problem.subject_to(problem.bounded(-1, (d * a_t + dd * v_t**2) / acceleration, 1))
            problem.subject_to(problem.bounded(-1, (d * j + 3 * dd * v_t * a_t + ddd * v_t**3) / jerk, 1))
    problem.subject_to(v >= 0)
    for k, end in ((0, 0.0), (n, 1.0)):
        problem.subject_to(s[k] == end)
        problem.subject_to(v[k] == 0)
        problem.subject_to(acc[k] == 0)
    problem.minimize(T)
    tau = np.linspace(0.0, 1.0, n + 1)
    guess = 4.0
    problem.set_initial(T, guess)
    problem.set_initial(s, tau - np.sin(2 * np.pi * tau) / (2 * np.pi))
    problem.set_initial(v, (1 - np.cos(2 * np.pi * tau)) / guess)
    problem.set_initial(acc, 2 * np.pi * np.sin(2 * np.pi * tau) / guess**2)
    problem.solver("ipopt", {"print_time": False, "expand": True}, {"print_level": 0, "max_iter": 3000, "tol": 1e-8})
    return float(problem.solve().value(T))


def main() -> None:
    cases = []
    for seed in range(8):
        one = case(seed, dof=3 + seed % 4)
        cases.append(one)
        print(one["seed"], one["duration_150_s"], one["duration_s"], flush=True)
    out = Path(__file__).parent.parent / "tests" / "golden" / "jerk.json"
    out.write_text(json.dumps({"casadi": ca.__version__, "cases": cases}, separators=(",", ":")) + "\n")


if __name__ == "__main__":
    main()
