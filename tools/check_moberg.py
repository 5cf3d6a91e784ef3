"""Compares flexarm with the four-mass arm of tools/golden_moberg.py: poles, responses, runs.

    cargo build --release && python tools/check_moberg.py     (pip install numpy scipy)

The program is $FLEXARM, else target/release/flexarm; the library of plants is $FLEXARM_LIBRARY, else
target/release/libflexarm_fmu.so. Prints every error beside its bound; exit status 1 if one is larger.
A gear with one stiffness instead of the curve is a copy of the robot file in a temporary folder.

published.toml runs under loads files on its motor. torque.toml, without friction of the arm masses,
runs under `joint.joint_1.torque` of the C interface, held over each step: the chirp has the torque of
the middle of the step.
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
import tomllib
from pathlib import Path

import numpy as np

import golden_moberg as arm

ROOT = Path(__file__).resolve().parent.parent
ROBOT = ROOT / "robots/test" / "moberg_arm"
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


def undamped(k1):
    """Frequencies (Hz) without dampers, the motor free, beside the free rotation."""
    w2 = np.linalg.eigvals(np.linalg.solve(arm.J, arm.chain(k1, arm.K2, arm.K3))).real
    return np.sqrt(np.sort(w2)[1:]) / (2 * np.pi)


def apart(found, truth):
    """Largest relative difference of the last three modes."""
    return max(abs(x / y - 1) for x, y in zip(found[-3:], truth, strict=True))


def check_modes(folder):
    for name, held in (("robot.toml", True), ("torque.toml", False)):
        for k1 in (None, arm.SOFT, 58.35, arm.STIFF):
            found = flexarm("modes", robot(folder, name, k1))
            hz, ratio = arm.modes(k1 or arm.SOFT, "motor", held)
            of = f"motor {'held' if held else 'free'}, " + ("curve of the gear" if k1 is None else f"k1 {k1:g}")
            report(f"frequencies, {of}", apart(found["frequencies_hz"], hz), 1e-6)
            report(f"damping ratios, {of}", apart(found["damping_ratio"], ratio), 1e-5)
            if not held:
                slow = arm.poles(k1 or arm.SOFT, "motor", held)[1].real
                report(f"decay of the free rotation, {of}", abs(2 * np.pi * found["frequencies_hz"][1] / -slow - 1), 1e-5)
    C, friction = arm.coupled_friction()
    file = tomllib.loads((ROBOT / "published.toml").read_text())
    found = [drive["friction"]["viscous"] for drive in file["drive"]]
    report("published.toml: friction and coupling", max(np.abs(np.array(file["coupling"]["matrix"]) - C).max(), np.abs(found / friction - 1).max()), 1e-12)
    found, truth = flexarm("modes", ROBOT / "published.toml"), arm.modes(arm.SOFT, "all", False)
    report("published.toml: undamped frequencies", apart(found["undamped_frequencies_hz"], undamped(arm.SOFT)), 1e-6)
    # `modes` takes the friction of coupled motors joint by joint; runs do not.
    report("published.toml: damping ratios", apart(found["damping_ratio"], truth[1]), 1e-5)


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
            truth = arm.responses(rows[:, 0], k1 or arm.SOFT, "motor")[:, column]
            of = "curve of the gear" if k1 is None else f"k1 {k1:g}"
            report(f"{what}, {of}, over the peak", np.abs(found - truth).max() / np.abs(truth).max(), 1e-6)


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
        self.angles = self.references("joint.joint_1.motor_position", *(f"joint.joint_{k}.link_position" for k in (1, 2, 3)))
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
        """Absolute angles of motor and arm masses as the motor sees them."""
        values = (c.c_double * 4)()
        self.checked(self.library.flexarm_get(self.plant, self.angles, values, 4))
        motor, *links = values
        return [arm.RATIO * motor, *(arm.RATIO * np.cumsum(links))]

    def advance(self, torque, step):
        self.set(self.torque, arm.RATIO * torque)
        self.checked(self.library.flexarm_step(self.plant, step))

    def free(self):
        self.library.flexarm_free(self.plant)


def table(path, **options):
    return np.genfromtxt(path, delimiter=",", names=True, **options)


def orders(errors):
    powers = [math.log(a / b) / math.log(g / h) for a, b, g, h in zip(errors, errors[1:], STEPS, STEPS[1:])]
    print(f"  orders {', '.join(f'{power:.2f}' for power in powers)}")


def check_loads(name, folder):
    """published.toml under the loads file of this name, against the published model."""
    truth, errors = table(arm.FOLDER / f"{name}.csv", skip_header=3), []
    peak = np.abs(truth["tool_m"]).max()
    angles = np.stack([truth[f"q_{mass}"] for mass in ("motor", "arm_1", "arm_2", "arm_3")], axis=1)
    for step in STEPS:
        out = Path(folder) / "run"
        flexarm("run", ROBOT / "published.toml", "--loads", f"trajectories/moberg_{name}.loads.toml", "--step", step, "--log-rate", 200, "-o", out, "--force")
        rows = table(out / "run.csv")
        q = arm.RATIO * np.cumsum([rows[f"joint_{joint}_position_rad"] for joint in ("motor", 1, 2, 3)], axis=0).T
        errors.append(np.abs(q @ arm.LEVERS - truth["tool_m"]).max() / peak)
        report(f"published.toml, {name}, {1e3 * step:g} ms: tool over {1e3 * peak:.3f} mm", errors[-1], 1e-5 if step == STEPS[-1] else None)
    orders(errors)
    report("  angles over the largest of the motor", np.abs(q - angles).max() / np.abs(angles).max(), 1e-5)
    report("  the arm's own TCP along y, a sine of the angles", np.abs(rows["flexible_y_m"] - truth["tool_m"]).max() / peak, None)


def check_plant(name):
    """torque.toml under torques through the C interface, against the model without friction of the arm."""
    truth, errors = table(arm.FOLDER / f"{name}.csv", skip_header=3), []
    torque, peak = getattr(arm, name), np.abs(truth["tool_motor_friction_m"]).max()
    for step in STEPS:
        plant, every = Plant(step), round(5e-3 / step)
        found = [plant.read()]
        for k in range(round(arm.SECONDS / step)):
            plant.advance(torque((k + 0.5) * step), step)
            if (k + 1) % every == 0:
                found.append(plant.read())
        plant.free()
        tool = np.array(found) @ arm.LEVERS
        errors.append(np.abs(tool - truth["tool_motor_friction_m"]).max() / peak)
        report(f"torque.toml, {name}, {1e3 * step:g} ms: tool over {1e3 * peak:.3f} mm", errors[-1], 1e-5 if step == STEPS[-1] else None)
    orders(errors)
    lacking = np.abs(tool - truth["tool_m"]).max()
    report(f"  less friction of the arm masses: {1e3 * lacking:.3f} mm", lacking / np.abs(truth["tool_m"]).max(), None)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        check_modes(folder)
        check_responses(folder)
        for name in ("pulse", "chirp"):
            check_loads(name, folder)
            check_plant(name)
    print(f"{len(FAILED)} errors are too large" if FAILED else "all errors are within their bounds")
    sys.exit(1 if FAILED else 0)
