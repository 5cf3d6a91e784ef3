"""Compares flexarm with the four-mass arm of tools/golden_moberg.py: poles, responses, runs.

    cargo build --release && python tools/check_moberg.py     (pip install numpy scipy)

The program is $FLEXARM, else target/release/flexarm; the library of plants is $FLEXARM_LIBRARY, else
target/release/libflexarm_fmu.so. Prints every error beside its bound; exit status 1 if one is larger.
A gear with one stiffness instead of the curve is a copy of the robot file in a temporary folder. The
runs drive the motor with the inputs `joint.joint_1.torque` of the C interface, held over each step:
the chirp has the torque of the middle of the step.
"""
import csv
import ctypes as c
import json
import math
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import golden_moberg as arm

ROOT = Path(__file__).resolve().parent.parent
ROBOT = ROOT / "robots" / "moberg_arm"
STEPS = (1e-3, 5e-4, 2e-4, 1e-4)
AT_THE_JOINT = arm.RATIO**2
FAILED = []


def report(what, error, bound):
    """Prints an error beside its bound, or without one as information."""
    late = "" if bound is None else f"  allowed {bound:.0e}" + ("" if error <= bound else "  TOO LARGE")
    print(f"{what:68} {error:.1e}{late}")
    if bound is not None and not error <= bound:
        FAILED.append(what)


def flexarm(*arguments):
    program = os.environ.get("FLEXARM", ROOT / "target/release/flexarm")
    run = subprocess.run([program, *map(str, arguments), "--json", "-q"], cwd=ROOT, capture_output=True, text=True)
    if run.returncode:
        sys.exit(f"flexarm {' '.join(map(str, arguments))}: {run.stderr.strip()}")
    return json.loads(run.stdout)


def robot(folder, name, k1):
    """A robot file whose gear has the stiffness k1; the shipped one for None."""
    if k1 is None:
        return ROBOT / name
    text, changed = re.subn(r"gearbox = \{ curve = \[\[.*?\]\]", f"gearbox = {{ stiffness = {k1 * AT_THE_JOINT!r}", (ROBOT / name).read_text())
    assert changed == 1
    text = text.replace('urdf = "', f'urdf = "{ROBOT}/').replace('"../../', f'"{ROOT}/')
    path = Path(folder) / f"{k1:g}_{name}"
    path.write_text(text)
    return path


def check_modes(folder):
    for name, held in (("robot.toml", True), ("torque.toml", False)):
        for k1 in (None, arm.SOFT, 58.35, arm.STIFF):
            found = flexarm("modes", robot(folder, name, k1))
            hz, ratio = arm.modes(k1 or arm.SOFT, "motor", held)
            apart = lambda a, b: max(abs(x / y - 1) for x, y in zip(a[-3:], b, strict=True))
            of = f"motor {'held' if held else 'free'}, " + ("curve of the gear" if k1 is None else f"k1 {k1:g}")
            report(f"frequencies, {of}", apart(found["frequencies_hz"], hz), 1e-6)
            report(f"damping ratios, {of}", apart(found["damping_ratio"], ratio), 1e-5)
            if not held:
                slow = arm.poles(k1 or arm.SOFT, "motor", held)[1].real
                report(f"decay of the free rotation, {of}", abs(2 * np.pi * found["frequencies_hz"][1] / -slow - 1), 1e-5)
            hz_all, ratio_all = arm.modes(k1 or arm.SOFT, "all", held)
            report(f"  published model with friction of the arm: frequencies", apart(found["frequencies_hz"], hz_all), None)
            report(f"  published model with friction of the arm: damping", apart(found["damping_ratio"], ratio_all), None)


def check_responses(folder):
    # Columns of arm.responses, and factors from the joint to the motor's side: angle, torques.
    cases = (("robot.toml", "joint_1", 0, 1 / arm.RATIO, "tool per motor angle"), ("robot.toml", "torque-z", 1, arm.RATIO, "tool per w, motor held"),
             ("torque.toml", "torque-z", 2, arm.RATIO, "tool per w, motor free"))
    for k1 in (None, arm.STIFF):
        for name, given, column, factor, what in cases:
            out = Path(folder) / "response"
            flexarm("response", robot(folder, name, k1), "--input", given, "--output", "y", "--from", 0.1, "--to", 300, "-o", out, "--force")
            rows = np.array([[float(x) for x in row] for row in list(csv.reader((out / "response.csv").open()))[1:]])
            found = factor * rows[:, 1] * np.exp(1j * rows[:, 2])
            for friction, bound in (("motor", 1e-6), ("all", None)):
                truth = arm.responses(rows[:, 0], k1 or arm.SOFT, friction)[:, column]
                of = "curve" if k1 is None else f"k1 {k1:g}"
                report(f"{what}, {of}" if bound else "  published model with friction of the arm", np.abs(found - truth).max() / np.abs(truth).max(), bound)


class Plant:
    """The arm with its motor under given torques, through the C interface."""

    def __init__(self, step):
        self.library = lib = c.CDLL(str(os.environ.get("FLEXARM_LIBRARY", ROOT / "target/release/libflexarm_fmu.so")))
        lib.flexarm_open.restype = lib.flexarm_error.restype = c.c_void_p
        lib.flexarm_open.argtypes = [c.c_char_p] * 3 + [c.c_double, c.c_void_p, c.c_size_t]
        for function in ("set", "get"):
            getattr(lib, f"flexarm_{function}").argtypes = [c.c_void_p, c.POINTER(c.c_uint32), c.POINTER(c.c_double), c.c_size_t]
        lib.flexarm_find.argtypes = [c.c_void_p, c.c_char_p]
        lib.flexarm_start.argtypes = lib.flexarm_step.argtypes = [c.c_void_p, c.c_double]
        lib.flexarm_free.argtypes = [c.c_void_p]
        self.plant = lib.flexarm_open(str(ROBOT / "torque.toml").encode(), None, None, step, None, 0)
        self.checked(0 if self.plant else -1)
        self.torque = self.references("joint.joint_1.torque")
        self.angles = self.references("joint.joint_1.motor_position", *(f"joint.joint_{k}.link_position" for k in (1, 2, 3)), "tcp.position.y")
        self.set(self.references("open_servos"), 1.0)
        self.checked(lib.flexarm_start(self.plant, 0.0))

    def checked(self, status):
        if status < 0:
            sys.exit(f"plant: {c.string_at(self.library.flexarm_error()).decode()}")
        return status

    def references(self, *names):
        return (c.c_uint32 * len(names))(*(self.checked(self.library.flexarm_find(self.plant, n.encode())) for n in names))

    def set(self, references, value):
        self.checked(self.library.flexarm_set(self.plant, references, (c.c_double * 1)(value), 1))

    def read(self):
        """Absolute angles as the motor sees them, and the place of the tool along y (m)."""
        values = (c.c_double * 5)()
        self.checked(self.library.flexarm_get(self.plant, self.angles, values, 5))
        motor, *links, y = values
        return [arm.RATIO * motor, *(arm.RATIO * np.cumsum(links)), y]

    def advance(self, torque, step):
        self.set(self.torque, arm.RATIO * torque)
        self.checked(self.library.flexarm_step(self.plant, step))

    def free(self):
        self.library.flexarm_free(self.plant)


def check_runs():
    for name in ("pulse", "chirp"):
        torque = getattr(arm, name)
        rows = np.genfromtxt(arm.FOLDER / f"{name}.csv", delimiter=",", names=True, comments="#", skip_header=3)
        truth = np.stack([rows[f"q_{mass}"] for mass in ("motor", "arm_1", "arm_2", "arm_3")], axis=1)
        peak, errors = np.abs(rows["tool_m"]).max(), []
        for step in STEPS:
            plant = Plant(step)
            found = [plant.read()]
            every = round(5e-3 / step)
            for k in range(round(arm.SECONDS / step)):
                plant.advance(torque((k + 0.5) * step), step)
                if (k + 1) % every == 0:
                    found.append(plant.read())
            plant.free()
            q, y = np.array(found)[:, :4], np.array(found)[:, 4]
            tool = q @ arm.LEVERS
            errors.append(np.abs(tool - rows["tool_m"]).max() / peak)
            report(f"{name}, steps of {1e3 * step:g} ms: tool over its excursion of {1e3 * peak:.3f} mm", errors[-1], 1e-5 if step == STEPS[-1] else None)
        orders = [math.log(a / b) / math.log(g / h) for a, b, g, h in zip(errors, errors[1:], STEPS, STEPS[1:])]
        print(f"  orders {', '.join(f'{order:.2f}' for order in orders)}")
        report("  angles over the motor's largest", np.abs(q - truth).max() / np.abs(truth).max(), 1e-5)
        report("  the arm's own TCP along y, a sine of the angles", np.abs(y - tool).max() / peak, None)
        published = rows["tool_published_m"]
        report(f"  published model with friction of the arm: {1e3 * np.abs(tool - published).max():.3f} mm", np.abs(tool - published).max() / np.abs(published).max(), None)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        check_modes(folder)
        check_responses(folder)
    check_runs()
    print(f"{len(FAILED)} errors are too large" if FAILED else "all errors are within their bounds")
    sys.exit(1 if FAILED else 0)
