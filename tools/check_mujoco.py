#!/usr/bin/env python3
"""Compares arms exported by `flexarm export --to mjcf` with flexarm itself, in MuJoCo.

    python3 tools/check_mujoco.py [--flexarm PROGRAM] [ROBOT ...]     (pip install mujoco scipy)

For each robot: the sag of the TCP at ten poses, the first six frequencies, and the TCP error along
the robot's own motion with prescribed motors, in the step that the file states, in longer and in
shorter ones. Robots whose links turn by rotation vectors are compared as copies with Z-Y-X angles,
the joints of MuJoCo; the sag of the original is printed too. One line per check; exit status 1 if
one fails or MuJoCo warns.
"""

import argparse
import csv
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import tomllib

import mujoco
import numpy as np
import scipy.linalg as sl
from mujoco import rollout
from scipy.interpolate import CubicHermiteSpline

ROOT = pathlib.Path(__file__).resolve().parent.parent
ROBOTS = ["test/reference_arm", "test/reference_arm_coupled", "kr210/links.toml", "kr210/drives.toml"]
# Bounds: of sag and frequencies relative to those of flexarm, of a run relative to its peak TCP error.
SAG, FREQUENCY, RUN = 1e-6, 1e-5, 5e-3
POSES, FREQUENCIES = 10, 6


class Program:
    def __init__(self, path):
        self.path = path

    def __call__(self, *words):
        done = subprocess.run([self.path, *map(str, words)], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{' '.join(map(str, words))}: {done.stderr.strip()}")
        return json.loads(done.stdout) if "--json" in words else None


class Exported:
    """An exported arm in MuJoCo."""

    def __init__(self, program, robot, folder):
        self.told = program("export", robot, "--to", "mjcf", "-o", folder, "--json")
        self.springs = json.loads((folder / "springs.json").read_text())
        self.model = mujoco.MjModel.from_xml_path(self.told["files"][0])
        self.data = mujoco.MjData(self.model)
        address = lambda names: np.array([self.model.joint(name).qposadr[0] for name in names], int)
        self.motors, self.elastic = address(self.springs["motors"]), address(self.springs["joints"])
        self.K = np.array(self.springs["stiffness"])
        self.rest = np.array(self.springs["rest"])

    def tool(self):
        return self.data.site("tcp").xpos.copy()

    def force(self, q, e):
        """Generalised force on the elastic coordinates at rest."""
        self.data.qpos[self.motors], self.data.qpos[self.elastic] = q, e
        self.data.qvel[:] = 0
        mujoco.mj_forward(self.model, self.data)
        return (self.data.qfrc_passive - self.data.qfrc_bias)[self.elastic]

    def sag(self, q):
        """Displacement of the TCP under gravity; leaves the arm at rest."""
        e = np.zeros(len(self.elastic))
        self.force(q, e)
        straight = self.tool()
        for _ in range(60):
            move = np.linalg.solve(self.K, self.force(q, e))
            e += move
            if np.abs(move).max() < 1e-15:
                break
        self.force(q, e)
        return self.tool() - straight, e

    def frequencies(self, q):
        _, e = self.sag(q)
        M = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, M)
        step, n = 1e-6, len(e)
        K = np.column_stack([(self.force(q, e - d) - self.force(q, e + d)) / (2 * step) for d in step * np.eye(n)])
        M = M[np.ix_(self.elastic, self.elastic)]
        return np.sqrt(np.sort(sl.eigh(0.5 * (K + K.T), M, eigvals_only=True))) / (2 * np.pi)

    def run(self, motion, h, end):
        """TCP at the end of each step of a run in which the motors follow `motion`."""
        n = round(end / h)
        # Semi-implicit Euler moves by the speed at the end of the step.
        q = np.array([motion(min(k * h, end)) for k in range(n + 2)])
        ahead = np.diff(q, axis=0) / h
        behind = np.vstack([ahead[:1] * 0, ahead[:-1]])
        control = np.zeros((n, self.model.nu))
        for k, part in enumerate([(ahead - behind) / h, q, ahead]):
            control[:, k::3] = part[:n]
        self.model.opt.timestep = h
        mujoco.mj_resetData(self.model, self.data)
        _, e = self.sag(q[0])
        every = mujoco.mjtState.mjSTATE_FULLPHYSICS
        start = np.zeros(mujoco.mj_stateSize(self.model, every))
        mujoco.mj_getState(self.model, self.data, start, every)
        states, _ = rollout.rollout(self.model, self.data, start[None], control[None])
        tools = []
        for state in states[0]:
            self.data.qpos[:] = state[1 : 1 + self.model.nq]
            mujoco.mj_kinematics(self.model, self.data)
            tools.append(self.tool())
        return h * np.arange(1, n + 1), np.array(tools)


def with_angles(robot, folder):
    """Copies a robot's folder, its links with Z-Y-X angles."""
    copy = folder / robot.relative_to(ROOT)
    shutil.copytree(robot.parent, copy.parent)
    shutil.copytree(ROOT / "trajectories", folder / "trajectories", dirs_exist_ok=True)
    copy.write_text(copy.read_text().replace("[[flexible_link]]", '[[flexible_link]]\nangles = "euler-zyx"'))
    return copy


def recorded(program, robot, folder):
    """Columns of a run of flexarm by name."""
    program("compare", robot, "-o", folder, "--step", 2.5e-4, "--stepper", "extrapolated-alpha", "--log-rate", 1000, "-q")
    with (folder / "run.csv").open(newline="") as file:
        head, *rows = csv.reader(file)
    return dict(zip(head, np.array(rows, float).T))


def motors(program, robot, folder):
    """The robot's own motion as a spline."""
    path = robot.parent / tomllib.loads(robot.read_text())["default_trajectory"]
    program("motion", path, robot, "-o", folder / "motion.csv", "--rate", 1000, "-q")
    with (folder / "motion.csv").open(newline="") as file:
        head, *rows = csv.reader(line for line in file if line[0] != "#")
    n, rows = (len(head) - 1) // 3, np.array(rows, float)
    return CubicHermiteSpline(rows[:, 0], rows[:, 1 : n + 1], rows[:, n + 1 : 2 * n + 1])


def compare(program, robot, folder):
    """Prints the checks of one robot; returns whether all are good."""
    good = True

    def check(what, found, allowed):
        nonlocal good
        good &= bool(found <= allowed)
        print(f"  {'ok' if found <= allowed else 'FAILED':7} {what}: {found:.1e} (at most {allowed:.0e})")

    warnings = []
    mujoco.set_mju_user_warning(warnings.append)
    arm = Exported(program, robot, folder / "as_filed")
    joints = program("inspect", robot, "--json")["joints"]
    bounds = np.array([[max(j["lower"] or -3.0, -3.0), min(j["upper"] or 3.0, 3.0)] for j in joints])
    poses = np.random.default_rng(9283).uniform(bounds[:, 0], bounds[:, 1], (POSES, len(bounds)))

    def sags(arm, robot):
        worst = 0.0
        for q in poses:
            truth = np.array(program("statics", robot, "--at=" + ",".join(map(repr, map(float, q))), "--json")["sag_m"])
            worst = max(worst, np.linalg.norm(arm.sag(q)[0] - truth) / max(np.linalg.norm(truth), 1e-9))
        return worst

    print(f"{robot.relative_to(ROOT)}: {arm.model.nv} coordinates, step {arm.told['step_s']} s")
    for what in arm.told["left_out"]:
        print(f"  note    left out: {what}")
    if any("rotation vectors" in what for what in arm.told["left_out"]):
        print(f"  note    sag with rotation vectors in flexarm, Z-Y-X angles in MuJoCo: {sags(arm, robot):.1e} apart")
        robot = with_angles(robot, folder)
        arm = Exported(program, robot, folder / "exported")
    check(f"sag at {POSES} poses", sags(arm, robot), SAG)
    worst = 0.0
    for q in poses:
        modes = program("modes", robot, "--at=" + ",".join(map(repr, map(float, q))), "--json")
        truth = np.array(modes["undamped_frequencies_hz"][:FREQUENCIES])
        worst = max(worst, np.max(np.abs(arm.frequencies(q)[: len(truth)] / truth - 1)))
    check(f"first {FREQUENCIES} frequencies", worst, FREQUENCY)

    run = recorded(program, robot, folder / "run")
    motion = motors(program, robot, folder)
    truth, rigid = (np.array([run[f"{twin}_{c}_m"] for c in "xyz"]).T for twin in ("flexible", "rigid"))
    peak = np.linalg.norm(truth - rigid, axis=1).max()
    for factor in (8, 4, 2, 1, 0.5):
        h, before = factor * arm.told["step_s"], len(warnings)
        times, tools = arm.run(motion, h, run["time"][-1])
        common = np.abs(1000 * times - np.round(1000 * times)) < 1e-6  # with the samples of the run
        there = truth[np.round(1000 * times[common]).astype(int)]
        error = np.linalg.norm(tools[common] - there, axis=1).max() / peak
        if factor == 1:
            check(f"run in steps of {h:g} s", error, RUN)
            continue
        print(f"  note    run in steps of {h:g} s: {f'{error:.1e}' if error < 1 else 'unstable'}")
        del warnings[before:]
    mujoco.set_mju_user_warning(None)
    if warnings:
        print(f"  FAILED  MuJoCo warns: {warnings[0]}")
    return good and not warnings


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("robots", nargs="*", default=ROBOTS, help="folders or files in robots/")
    parser.add_argument("--flexarm", default=str(ROOT / "target" / "release" / "flexarm"))
    arguments = parser.parse_args()
    program, good = Program(arguments.flexarm), True
    for name in arguments.robots:
        robot = ROOT / "robots" / name
        robot = robot / "robot.toml" if robot.is_dir() else robot
        with tempfile.TemporaryDirectory() as folder:
            good &= compare(program, robot, pathlib.Path(folder))
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
