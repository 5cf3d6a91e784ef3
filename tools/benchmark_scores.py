#!/usr/bin/env python3
"""Runs flexarm and other programs on the benchmarks of tests/benchmarks and scores them.

    python3 tools/benchmark_scores.py VENV                      prints all lines
    python3 tools/benchmark_scores.py VENV --write              also stores them in tests/benchmarks
    python3 tools/benchmark_scores.py VENV --only exudyn        one program; others stay as stored
    python3 tools/benchmark_scores.py VENV --draw               writes the tables from stored lines

VENV is a virtual environment with exudyn, mujoco, pin and scipy from PyPI; a program that is not
there is skipped. flexarm is target/release/flexarm, or --flexarm PROGRAM. Errors are those of
tests/benchmarks/README.md, at the times of the truths. Time: processor time of the simulation,
without set-up, one thread, the minimum of three runs if a run takes less than 5 s.
"""
import argparse
import csv
import datetime
import json
import math
import os
import platform
import re
import subprocess
import sys
import tempfile
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "tests" / "benchmarks"
STORE = FOLDER / "scores.json"
PAGE = FOLDER / "README.md"
BEGIN, END = "<!-- scores -->", "<!-- end of scores -->"
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))

TWO_LINK = ["slew_30", "slew_20", "spin_30", "slew_10", "spin_10"]
CRANK = "slider_crank"
# Two-link arms (SI).
LENGTH, WIDTH, YOUNG, POISSON, DENSITY = 1.0, 0.05, 7e10, 0.33, 2700.0
LUMP_MASS, LUMP_INERTIA, SHEAR_FACTOR = 1.0, 1e-3, 5 / 6
HUB_MASS, HUB_INERTIA = 1e-6, 1e-9
TWO_LINK_END, TWO_LINK_SAMPLE = 2.0, 0.01
# Slider crank (SI).
CRANK_LENGTH, ROD_LENGTH, ROD_SIDE, ROD_YOUNG, ROD_DENSITY = 0.15, 0.3, 0.008, 2e11, 7870.0
SLIDER_MASS, CRANK_SPEED, CRANK_RAMP = 0.075552, 150.0, 0.05
CRANK_END, CRANK_SAMPLE = 0.1, 2e-4
# Runs that take longer are not repeated (CPU s).
SHORT = 5.0


# --------------------------------------------------------------------------------------------------
# motions
def clamp(t, begin, duration, absolute):
    """Share of a move that is over at `t`, from 0 to 1, without branches."""
    u = (t - begin) / duration
    return 0.5 * (absolute(u) - absolute(u - 1.0) + 1.0)


def quintic(start, end, duration):
    """Returns position and speed of a quintic move, as functions of time and a library."""

    def place(t, lib):
        u = clamp(t, 0.0, duration, lib.abs)
        return start + (end - start) * (u * u * u * (10.0 - 15.0 * u + 6.0 * u * u))

    def rate(t, lib):
        u = clamp(t, 0.0, duration, lib.abs)
        return (end - start) * 30.0 / duration * (u * u * (1.0 - u) * (1.0 - u))

    return place, rate


def speed_up(speed, duration):
    """A joint that reaches `speed` at `duration` and keeps it."""

    def place(t, lib):
        u = clamp(t, 0.0, duration, lib.abs)
        after = 0.5 * (t - duration + lib.abs(t - duration))
        return speed * duration * (u * u * u * u * (2.5 - 3.0 * u + u * u)) + speed * after

    def rate(t, lib):
        u = clamp(t, 0.0, duration, lib.abs)
        return speed * (u * u * u * (10.0 - 15.0 * u + 6.0 * u * u))

    return place, rate


def swing(angle, begin, duration):
    """`angle sin^4` from `begin` for `duration`."""
    w = math.pi / duration

    def place(t, lib):
        s = lib.sin(math.pi * clamp(t, begin, duration, lib.abs))
        return angle * (s * s * s * s)

    def rate(t, lib):
        u = math.pi * clamp(t, begin, duration, lib.abs)
        s = lib.sin(u)
        return angle * 4.0 * w * (s * s * s * lib.cos(u))

    return place, rate


class Floats:
    """The functions of a motion, of numbers."""

    abs, sin, cos = staticmethod(abs), staticmethod(math.sin), staticmethod(math.cos)


MOTIONS = {
    "slew": [quintic(0.0, math.pi / 2, 1.0), quintic(0.5, -1.5, 1.0)],
    "spin": [speed_up(8.0, 1.0), swing(1.0, 0.5, 1.0)],
    "ramp": [speed_up(CRANK_SPEED, CRANK_RAMP)],
}


def arm(case):
    """Motion and height (m) of a run of the two-link arms."""
    motion, height = case.split("_")
    return MOTIONS[motion], int(height) / 1e3


def section(height):
    """Area, second moment, mass per length and bending stiffness of a bar of the arms."""
    area, inertia = WIDTH * height, WIDTH * height**3 / 12
    return area, inertia, DENSITY * area, YOUNG * inertia


# --------------------------------------------------------------------------------------------------
# truths
def read_columns(path, names):
    """Reads columns of a table."""
    with open(path, newline="") as file:
        return [[float(row[name]) for name in names] for row in csv.DictReader(file)]


def check_times(times, truth):
    """Refuses samples at other times than those of the truth."""
    if len(times) != len(truth) or any(abs(a - b) > 1e-9 for a, b in zip(times, truth)):
        raise RuntimeError(f"{len(times)} samples, but not those of the truth ({len(truth)})")


def two_link_error(case, samples):
    """Largest distance of the tip from the truth over the largest deviation of the truth."""
    names = ["t[s]", "deviation_x[m]", "deviation_y[m]"]
    truth = read_columns(FOLDER / "two_link" / f"truth_{case}.csv", names)
    check_times([row[0] for row in samples], [row[0] for row in truth])
    first, second = arm(case)[0]
    worst = 0.0
    for (t, x, y), (_, dx, dy) in zip(samples, truth):
        a = first[0](t, Floats)
        b = a + second[0](t, Floats)
        rigid = LENGTH * (math.cos(a) + math.cos(b)), LENGTH * (math.sin(a) + math.sin(b))
        distance = math.dist((x, y), (rigid[0] + dx, rigid[1] + dy))
        worst = max(worst, distance) if math.isfinite(distance) else math.inf
    return {"error": worst / max(math.hypot(dx, dy) for _, dx, dy in truth)}


def crank_error(samples):
    """Largest error of the slider (m), and of the deflection in the middle over its peak; against
    the geometrically exact rod."""
    names = ["t[s]", "exact_slider_x[m]", "exact_mid_v[m]"]
    truth = read_columns(FOLDER / CRANK / "truth_ramp.csv", names)
    check_times([row[0] for row in samples], [row[0] for row in truth])
    slider = middle = 0.0
    for (t, at, x, y), (_, true_at, true_middle) in zip(samples, truth):
        a = MOTIONS["ramp"][0][0](t, Floats)
        pin = CRANK_LENGTH * math.cos(a), CRANK_LENGTH * math.sin(a)
        chord = at - pin[0], -pin[1]
        lateral = (chord[0] * (y - pin[1]) - chord[1] * (x - pin[0])) / math.hypot(*chord)
        slider = max(slider, abs(at - true_at))
        middle = max(middle, abs(lateral - true_middle))
    return {"error": middle / max(abs(row[2]) for row in truth), "slider_m": slider}


def error_of(case, samples):
    """Errors of a run from its samples."""
    return crank_error(samples) if case == CRANK else two_link_error(case, samples)


# --------------------------------------------------------------------------------------------------
# flexarm
class Flexarm:
    """The command line on the files; modal links in a copy of the robot file."""

    name = "flexarm"
    # Model, size, stepper, step for the arms, step for the crank (s).
    LINES = [
        *[("rigid parts", n, "generalized-alpha", 1e-3, 1e-4) for n in (4, 8, 16, 32)],
        *[("rigid parts", n, "generalized-alpha", 2e-4, 2e-5) for n in (4, 8, 16, 32)],
        ("rigid parts", 16, "sdirk3", 1e-3, 1e-4),
        ("rigid parts", 16, "extrapolated-alpha", 1e-3, 1e-4),
        ("rigid parts", 16, "spook", 1e-4, 1e-5),
        ("rigid parts", 16, "spook", 2e-5, 2e-6),
        *[("modal, stiffened", n, "generalized-alpha", 1e-3, 1e-4) for n in (2, 4, 8)],
        *[("modal, stiffened", n, "generalized-alpha", 2e-4, 2e-5) for n in (2, 4, 8)],
    ]

    def __init__(self, program):
        self.program = program
        self.version = self.call("--version").split()[-1]

    def call(self, *arguments):
        """Runs the program and returns what it prints."""
        done = subprocess.run([self.program, *arguments], capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError((done.stderr.strip().splitlines() or ["failed"])[-1])
        return done.stdout

    def lines(self, case):
        """Lines of a case: model, size, stepper, step."""
        for model, size, stepper, arm_step, crank_step in self.LINES:
            if case == CRANK:
                # The rod is two links.
                yield model, size // 2, stepper, crank_step
            else:
                yield model, size, stepper, arm_step

    def robot(self, case, model, size, folder):
        """Writes a copy of the robot with another link model, and returns its path and motion."""
        if case == CRANK:
            source, motion = FOLDER / CRANK / "slider_crank.toml", "ramp.csv"
        else:
            kind, height = case.split("_")
            source = FOLDER / "two_link" / f"two_link_{height}.toml"
            motion = {"slew": "slew.toml", "spin": "spin.csv"}[kind]
        text = source.read_text()
        link = f'model = "lumped"\nsegments = {size}'
        if model.startswith("modal"):
            link = f'model = "modal"\nmodes = {size}\ngeometric_stiffening = true'
        text = re.sub(r'model = "lumped"\nsegments = \d+', link, text)
        urdf = source.with_suffix(".urdf")
        (folder / urdf.name).write_text(urdf.read_text())
        (folder / motion).write_text((source.parent / motion).read_text())
        (folder / "slew.toml").write_text((FOLDER / "two_link" / "slew.toml").read_text())
        (folder / source.name).write_text(text)
        return folder / source.name, folder / motion

    def positions(self, command, folder, tcp):
        """Times and positions of a frame."""
        self.call(*command, "--tcp", tcp, "-o", str(folder / tcp))
        return read_columns(folder / tcp / "run.csv", ["time", "flexible_x_m", "flexible_y_m"])

    def run(self, case, model, size, stepper, step):
        """Returns CPU s and samples of a run."""
        sample = CRANK_SAMPLE if case == CRANK else TWO_LINK_SAMPLE
        with tempfile.TemporaryDirectory() as made:
            folder = Path(made)
            robot, motion = self.robot(case, model, size, folder)
            command = ["run", str(robot), str(motion), "--stepper", stepper, "--step", repr(step),
                       "--log-rate", repr(1 / sample), "-q", "--json"]
            spent = json.loads(self.call(*command, "--no-files"))["cpu_s"]

            def samples():
                if case != CRANK:
                    return self.positions(command, folder, "tip")
                middle = self.positions(command, folder, "middle")
                slider = self.positions(command, folder, "slider")
                return [(t, s[1], x, y) for (t, x, y), s in zip(middle, slider)]

            return spent, samples()


# --------------------------------------------------------------------------------------------------
# Exudyn
class Exudyn:
    """Beams of large displacement in the plane; motions by compiled user functions."""

    name = "Exudyn"
    EXACT, CABLE = "exact beam, 2D", "ANCF cable, 2D"

    def __init__(self):
        import exudyn

        exudyn.config.printToConsole = False
        self.exu = exudyn
        self.version = version("exudyn")

    def lines(self, case):
        """Lines of a case: model, size, stepper, step."""
        steps = (1e-4, 2e-5) if case == CRANK else (1e-3, 2e-4)
        for model in (self.EXACT, self.CABLE):
            for step in steps:
                for size in (4, 8, 16, 32):
                    yield model, size, "generalised-alpha", step

    def run(self, case, model, size, stepper, step):
        """Returns CPU s and samples of a run."""
        self.kept = []
        container = self.exu.SystemContainer()
        self.system = container.AddSystem()
        self.items = __import__("exudyn.itemInterface", fromlist=["*"])
        ground = self.items.NodePointGround()
        self.ground = self.coordinate(self.system.AddNode(ground), 0)
        sensors = self.crank(model, size) if case == CRANK else self.arms(case, model, size)
        self.system.Assemble()
        end = CRANK_END if case == CRANK else TWO_LINK_END
        settings = self.exu.SimulationSettings()
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = CRANK_SAMPLE if case == CRANK else TWO_LINK_SAMPLE
        settings.timeIntegration.numberOfSteps = round(end / step)
        settings.timeIntegration.endTime = end
        settings.timeIntegration.verboseMode = 0
        self.settle(settings)
        begin = time.process_time()
        self.system.SolveDynamic(settings)
        spent = time.process_time() - begin
        tables = [self.system.GetSensorStoredData(sensor) for sensor in sensors]
        if case != CRANK:
            return spent, [tuple(row[:3]) for row in tables[0]]
        return spent, [(a[0], b[1], a[1], a[2]) for a, b in zip(*tables)]

    def settle(self, settings):
        """Chooses the solver."""
        settings.linearSolver.solverType = self.exu.LinearSolverType.EigenSparse
        settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
        settings.timeIntegration.newton.useModifiedNewton = True

    def coordinate(self, node, k):
        """Adds a marker of a coordinate of a node."""
        return self.system.AddMarker(self.items.MarkerNodeCoordinate(nodeNumber=node, coordinate=k))

    def equal(self, marker, other, offset=None, rate=None):
        """Makes two coordinates equal, or apart by functions of time."""
        from exudyn.utilities import CreateSymbolicUserFunction

        constraint = self.items.CoordinateConstraint(markerNumbers=[marker, other])
        item = self.system.AddObject(constraint)
        for name, function in (("offsetUserFunction", offset), ("offsetUserFunction_t", rate)):
            if function:
                four = self.arguments(function)
                compiled = CreateSymbolicUserFunction(self.system, four, name, item)
                self.kept.append(compiled)
                self.system.SetObjectParameter(item, name, compiled)

    @staticmethod
    def arguments(function):
        """Argument list that the compiler of user functions wants."""
        return lambda mbs, t, itemNumber, lOffset: function(t)

    def turn(self, marker, other, motion, reference):
        """Prescribes the angle between two coordinates, less their reference."""
        lib = self.exu.symbolic
        place, rate = motion
        self.equal(marker, other, lambda t: place(t, lib) - reference, lambda t: rate(t, lib))

    def position(self, node):
        """Adds a sensor of the position of a node."""
        kind = self.exu.OutputVariableType.Position
        return self.system.AddSensor(self.items.SensorNode(
            nodeNumber=node, outputVariableType=kind, storeInternal=True, writeToFile=False))

    def body(self, mass, inertia, place, angle):
        """Adds a rigid body at an angle, and returns its node and object."""
        node = self.system.AddNode(self.items.NodeRigidBody2D(referenceCoordinates=[*place, angle]))
        item = self.items.ObjectRigidBody2D(mass=mass, inertia=inertia,
                                            nodeNumber=node)
        return node, self.system.AddObject(item)

    def exact_beam(self, nodes, length, bending, axial, shear, mass, inertia):
        """Adds two-node geometrically exact elements along nodes."""
        for pair in zip(nodes, nodes[1:]):
            self.system.AddObject(self.items.ObjectBeamGeometricallyExact2D(
                nodeNumbers=list(pair), length=length / (len(nodes) - 1), massPerLength=mass,
                crossSectionInertia=inertia, bendingStiffness=bending, axialStiffness=axial,
                shearStiffness=shear))

    def cable(self, nodes, length, bending, axial, mass):
        """Adds ANCF elements along nodes."""
        return [self.system.AddObject(self.items.ObjectANCFCable2D(
            nodeNumbers=list(pair), length=length / (len(nodes) - 1), massPerLength=mass,
            bendingStiffness=bending, axialStiffness=axial,
            useReducedOrderIntegration=0)) for pair in zip(nodes, nodes[1:])]

    def arms(self, case, model, size):
        """Builds a two-link arm and returns the sensor of its tip."""
        motions, height = arm(case)
        angles = [motions[0][0](0.0, Floats)]
        angles.append(angles[0] + motions[1][0](0.0, Floats))
        build = self.arms_of_exact_beams if model == self.EXACT else self.arms_of_cables
        return [self.position(build(motions, height, angles, size))]

    def arms_of_exact_beams(self, motions, height, angles, size):
        """Returns the node of the tip."""
        area, inertia, mass, bending = section(height)
        shear = SHEAR_FACTOR * YOUNG / (2 * (1 + POISSON)) * area
        start, chains = (0.0, 0.0), []
        for angle in angles:
            along = LENGTH * math.cos(angle), LENGTH * math.sin(angle)
            nodes = []
            for k in range(size + 1):
                place = [start[i] + along[i] * k / size for i in (0, 1)]
                node = self.items.NodeRigidBody2D(referenceCoordinates=[*place, angle])
                nodes.append(self.system.AddNode(node))
            self.exact_beam(nodes, LENGTH, bending, YOUNG * area, shear, mass, DENSITY * inertia)
            self.system.AddObject(self.items.ObjectRigidBody2D(
                mass=LUMP_MASS, inertia=LUMP_INERTIA, nodeNumber=nodes[-1]))
            start = [start[i] + along[i] for i in (0, 1)]
            chains.append(nodes)
        first, second = chains
        for k in (0, 1):
            self.equal(self.ground, self.coordinate(first[0], k))
            self.equal(self.coordinate(first[-1], k), self.coordinate(second[0], k))
        self.turn(self.ground, self.coordinate(first[0], 2), motions[0], angles[0])
        elbow, base = self.coordinate(first[-1], 2), self.coordinate(second[0], 2)
        self.turn(elbow, base, motions[1], angles[1] - angles[0])
        return second[-1]

    def fix(self, body, place, other, other_place, angle=0.0):
        """Fixes a body to a place of another body."""
        c, s = math.cos(angle), math.sin(angle)
        markers = [self.system.AddMarker(self.items.MarkerBodyRigid(bodyNumber=b, localPosition=p))
                   for b, p in ((body, place), (other, other_place))]
        self.system.AddObject(self.items.GenericJoint(
            markerNumbers=markers, constrainedAxes=[1, 1, 0, 0, 0, 1],
            rotationMarker1=[[c, -s, 0], [s, c, 0], [0, 0, 1]]))

    def arms_of_cables(self, motions, height, angles, size):
        """Returns the node of the tip. Hubs of nearly no mass turn the first sections; hubs and lumps
        are fixed to the cables."""
        area, _, mass, bending = section(height)
        start, ends, hubs = [0.0, 0.0], [], []
        for angle in angles:
            way = [math.cos(angle), math.sin(angle)]
            hub, hub_body = self.body(HUB_MASS, HUB_INERTIA, start, angle)
            nodes = []
            for k in range(size + 1):
                place = [start[i] + LENGTH * way[i] * k / size for i in (0, 1)]
                node = self.items.NodePoint2DSlope1(referenceCoordinates=[*place, *way])
                nodes.append(self.system.AddNode(node))
            cables = self.cable(nodes, LENGTH, bending, YOUNG * area, mass)
            start = [start[i] + LENGTH * way[i] for i in (0, 1)]
            lump, lump_body = self.body(LUMP_MASS, LUMP_INERTIA, start, angle)
            self.fix(hub_body, [0, 0, 0], cables[0], [0, 0, 0])
            self.fix(lump_body, [0, 0, 0], cables[-1], [LENGTH / size, 0, 0])
            ends.append(lump)
            hubs.append(hub)
        for k in (0, 1):
            self.equal(self.ground, self.coordinate(hubs[0], k))
            self.equal(self.coordinate(ends[0], k), self.coordinate(hubs[1], k))
        self.turn(self.ground, self.coordinate(hubs[0], 2), motions[0], angles[0])
        elbow, base = self.coordinate(ends[0], 2), self.coordinate(hubs[1], 2)
        self.turn(elbow, base, motions[1], angles[1] - angles[0])
        return ends[1]

    def crank(self, model, size):
        """Builds the slider crank; returns the sensors of the rod's middle and of the slider."""
        area, inertia = ROD_SIDE**2, ROD_SIDE**4 / 12
        mass, bending, axial = ROD_DENSITY * area, ROD_YOUNG * inertia, ROD_YOUNG * area
        nodes = []
        for k in range(size + 1):
            x = CRANK_LENGTH + ROD_LENGTH * k / size
            node = (self.items.NodeRigidBody2D(referenceCoordinates=[x, 0, 0]) if model == self.EXACT
                    else self.items.NodePoint2DSlope1(referenceCoordinates=[x, 0, 1, 0]))
            nodes.append(self.system.AddNode(node))
        if model == self.EXACT:
            shear = SHEAR_FACTOR * ROD_YOUNG / 2.6 * area
            self.exact_beam(nodes, ROD_LENGTH, bending, axial, shear, mass, ROD_DENSITY * inertia)
        else:
            self.cable(nodes, ROD_LENGTH, bending, axial, mass)
        self.system.AddObject(self.items.ObjectMassPoint2D(mass=SLIDER_MASS, nodeNumber=nodes[-1]))
        lib, (place, rate) = self.exu.symbolic, MOTIONS["ramp"][0]
        x, y = self.coordinate(nodes[0], 0), self.coordinate(nodes[0], 1)
        self.equal(self.ground, x, lambda t: CRANK_LENGTH * lib.cos(place(t, lib)) - CRANK_LENGTH,
                   lambda t: -CRANK_LENGTH * lib.sin(place(t, lib)) * rate(t, lib))
        self.equal(self.ground, y, lambda t: CRANK_LENGTH * lib.sin(place(t, lib)),
                   lambda t: CRANK_LENGTH * lib.cos(place(t, lib)) * rate(t, lib))
        self.equal(self.ground, self.coordinate(nodes[-1], 1))
        return [self.position(nodes[size // 2]), self.position(nodes[-1])]


# --------------------------------------------------------------------------------------------------
# chains of rigid parts for the programs of rigid bodies
def chain_of_parts(size, length):
    """Begin and length of each part of a bar with `size` hinges, which are in the middle of equal
    pieces; the first and the last part are half as long."""
    piece = length / size
    ends = [0.0, *[(k + 0.5) * piece for k in range(size)], length]
    return [(a, b - a) for a, b in zip(ends, ends[1:])]


class MuJoCo:
    """A chain of rigid parts with a hinge and a spring between neighbours. The joints of the arm
    follow by motors of huge inertia, with set points that each integrator hits."""

    name = "MuJoCo"
    MODEL, ROTOR, PD = "hinged parts, 2D", 1e8, 200.0

    def __init__(self):
        import mujoco
        from mujoco import rollout

        mujoco.set_mju_user_warning(lambda text: None)
        self.mujoco, self.rollout = mujoco, rollout
        self.version = version("mujoco")

    def lines(self, case):
        """Lines of a case: model, size, stepper, step."""
        if case == CRANK:
            return
        yield from ((self.MODEL, n, "discrete", 1e-3) for n in (8, 16))
        yield from ((self.MODEL, n, "discrete", 1e-4) for n in (4, 8, 16, 32))
        yield from ((self.MODEL, n, "discrete", 1e-5) for n in (16,))
        for n, step in ((4, 2e-4), (8, 1e-4), (16, 2e-5), (32, 5e-6)):
            yield self.MODEL, n, "implicitfast", step
            yield self.MODEL, n, "RK4", step

    @staticmethod
    def part(begin, length, height, inner, joint):
        """A rigid part at `begin` of its parent, with what it carries."""
        mass = DENSITY * WIDTH * height * length
        turn = [mass * (a * a + b * b) / 12
                for a, b in ((height, WIDTH), (length, WIDTH), (length, height))]
        inertia = " ".join(f"{x:.17g}" for x in turn)
        return (f'<body pos="{begin:.17g} 0 0">{joint}<inertial pos="{length / 2:.17g} 0 0" '
                f'mass="{mass:.17g}" diaginertia="{inertia}"/>{inner}</body>')

    def bar(self, size, height, first_joint, carried):
        """A bar of parts, with a lump and what is beyond it at the end."""
        stiffness = section(height)[3] * size / LENGTH
        spring = f'<joint type="hinge" axis="0 0 1" stiffness="{stiffness:.17g}"/>'
        lump = f'mass="{LUMP_MASS}" diaginertia="{LUMP_INERTIA} {LUMP_INERTIA} {LUMP_INERTIA}"'
        parts = chain_of_parts(size, LENGTH)
        inner = (f'<body pos="{parts[-1][1]:.17g} 0 0"><inertial pos="0 0 0" {lump}/>{carried}</body>')
        for k in range(size, -1, -1):
            begin = parts[k - 1][1] if k else 0.0
            inner = self.part(begin, parts[k][1], height, inner, spring if k else first_joint)
        return inner

    def text(self, height, size, integrator, step):
        """The model as XML."""
        rotor = '<joint name="{}" type="hinge" axis="0 0 1" armature="' + repr(self.ROTOR) + '"/>'
        outer = self.bar(size, height, rotor.format("joint_2"), '<site name="tip"/>')
        arms = self.bar(size, height, rotor.format("joint_1"), outer)
        kp, kv = self.ROTOR * self.PD**2, 2 * self.ROTOR * self.PD
        motors = "".join(f'<motor joint="joint_{k}" gear="{self.ROTOR}"/>'
                         f'<position joint="joint_{k}" kp="{kp}"/>'
                         f'<velocity joint="joint_{k}" kv="{kv}"/>' for k in (1, 2))
        return (f'<mujoco><compiler angle="radian"/><option timestep="{step!r}" gravity="0 0 0" '
                f'integrator="{integrator}"><flag contact="disable"/></option><worldbody>{arms}'
                f"</worldbody><actuator>{motors}</actuator></mujoco>")

    @staticmethod
    def set_points(motion, integrator, step, n):
        """Acceleration, position and speed that a motor is given at each step."""
        import numpy as np

        place, rate = motion
        if integrator == "RK4":
            middle = [(k + 0.5) * step for k in range(n)]
            ends = [rate(k * step, Floats) for k in range(n + 1)]
            return np.diff(ends) / step, [place(t, Floats) for t in middle], [rate(t, Floats) for t in middle]
        # Semi-implicit Euler: q+ = q + h v+.
        q = np.array([place(k * step, Floats) for k in range(n + 1)])
        ahead = np.diff(q) / step
        behind = np.concatenate([[0.0], ahead[:-1]])
        force = (ahead - behind) / step
        return (force, q[1:], ahead) if integrator == "discrete" else (force, q[:-1], ahead)

    def run(self, case, model, size, stepper, step):
        """Returns CPU s and samples of a run."""
        import numpy as np

        mujoco = self.mujoco
        motions, height = arm(case)
        model = mujoco.MjModel.from_xml_string(self.text(height, size, stepper, step))
        data = mujoco.MjData(model)
        n, every = round(TWO_LINK_END / step), round(TWO_LINK_SAMPLE / step)
        control = np.zeros((n, model.nu))
        for k, motion in enumerate(motions):
            data.joint(f"joint_{k + 1}").qpos = motion[0](0.0, Floats)
            for i, points in enumerate(self.set_points(motion, stepper, step, n)):
                control[:, 3 * k + i] = points
        mujoco.mj_forward(model, data)
        everything = mujoco.mjtState.mjSTATE_FULLPHYSICS
        state = np.zeros(mujoco.mj_stateSize(model, everything))
        mujoco.mj_getState(model, data, state, everything)
        states, begin = [state], time.process_time()
        for k in range(0, n, every):
            found, _ = self.rollout.rollout(model, data, state[None], control[None, k:k + every])
            state = found[0, -1]
            states.append(state)
        spent = time.process_time() - begin
        samples = []
        for k, state in enumerate(states):
            data.qpos[:] = state[1:1 + model.nq]
            mujoco.mj_kinematics(model, data)
            samples.append((k * TWO_LINK_SAMPLE, *data.site("tip").xpos[:2]))
        return spent, samples


class Pinocchio:
    """The same chain of hinged parts; the library gives the mass matrix and the bias, numpy the
    accelerations and scipy the steps."""

    name = "Pinocchio"
    MODEL = "hinged parts, 2D"

    def __init__(self):
        import pinocchio
        from scipy.integrate import solve_ivp

        self.pin, self.solve = pinocchio, solve_ivp
        self.version = version("pin")

    def lines(self, case):
        """Lines of a case: model, size, stepper, relative tolerance."""
        if case != CRANK:
            yield from ((self.MODEL, n, "DOP853 of scipy", 1e-6) for n in (4, 8, 16))

    def model(self, height, size):
        """Returns the model, the indices of the prescribed joints and the frame of the tip."""
        import numpy as np

        pin, model = self.pin, self.pin.Model()
        at, place, prescribed = 0, 0.0, []
        lump = pin.Inertia(LUMP_MASS, np.zeros(3), LUMP_INERTIA * np.eye(3))
        for bar in range(2):
            for k, (_, length) in enumerate(chain_of_parts(size, LENGTH)):
                move = pin.SE3(np.eye(3), np.array([place, 0.0, 0.0]))
                at = model.addJoint(at, pin.JointModelRZ(), move, f"{bar}_{k}")
                mass = DENSITY * WIDTH * height * length
                turn = [mass * (a * a + b * b) / 12
                        for a, b in ((height, WIDTH), (length, WIDTH), (length, height))]
                own = pin.Inertia(mass, np.array([length / 2, 0.0, 0.0]), np.diag(turn))
                model.appendBodyToJoint(at, own, pin.SE3.Identity())
                if k == 0:
                    prescribed.append(at - 1)
                place = length
            end = pin.SE3(np.eye(3), np.array([place, 0.0, 0.0]))
            model.appendBodyToJoint(at, lump, end)
        model.gravity.linear = np.zeros(3)
        return model, prescribed, (at, end)

    def run(self, case, model, size, stepper, step):
        """Returns CPU s and samples of a run."""
        import numpy as np
        from scipy.linalg import cho_factor, cho_solve

        pin, (motions, height) = self.pin, arm(case)
        model, prescribed, (last, end) = self.model(height, size)
        data = model.createData()
        elastic = np.setdiff1d(np.arange(model.nv), prescribed)
        block = np.ix_(elastic, elastic)
        stiffness, n = section(height)[3] * size / LENGTH, len(elastic)
        q, v, a = np.zeros(model.nv), np.zeros(model.nv), np.zeros(model.nv)
        small = 1e-6

        def put(t, x):
            for joint, (place, rate) in zip(prescribed, motions):
                q[joint], v[joint] = place(t, Floats), rate(t, Floats)
                a[joint] = (rate(t + small, Floats) - rate(t - small, Floats)) / (2 * small)
            q[elastic], v[elastic] = x[:n], x[n:]

        def slope(t, x):
            put(t, x)
            mass = np.triu(pin.crba(model, data, q))[block]
            force = -pin.rnea(model, data, q, v, a)[elastic] - stiffness * x[:n]
            return np.concatenate([x[n:], cho_solve(cho_factor(mass, check_finite=False), force, check_finite=False)])

        times = [k * TWO_LINK_SAMPLE for k in range(round(TWO_LINK_END / TWO_LINK_SAMPLE) + 1)]
        begin = time.process_time()
        found = self.solve(slope, (0.0, times[-1]), np.zeros(2 * n), method="DOP853", t_eval=times,
                           rtol=step, atol=1e-3 * step)
        spent = time.process_time() - begin
        samples = []
        for t, x in zip(found.t, found.y.T):
            put(t, x)
            pin.forwardKinematics(model, data, q)
            samples.append((t, *data.oMi[last].act(end.translation)[:2]))
        return spent, samples


# --------------------------------------------------------------------------------------------------
# measure
def programs(flexarm):
    """Returns the programs that are there, and why the others are not."""
    made, skipped = [], {}
    for kind in (Flexarm, Exudyn, MuJoCo, Pinocchio):
        try:
            made.append(kind(flexarm) if kind is Flexarm else kind())
        except (ImportError, OSError, RuntimeError, PackageNotFoundError) as error:
            skipped[kind.name] = f"{type(error).__name__}: {error}"
    return made, skipped


def measure_line(program, case, model, size, stepper, step, repeat):
    """Runs one line and returns it with its errors and its time."""
    line = {"program": program.name, "case": case, "model": model, "size": size,
            "stepper": stepper, "step": step}
    try:
        spent, samples = program.run(case, model, size, stepper, step)
        line.update(error_of(case, samples), cpu_s=spent)
    except (RuntimeError, ValueError) as error:
        return {**line, "failed": str(error).strip().splitlines()[-1][:200]}
    if line["error"] >= 1.0 or not math.isfinite(line["error"]):
        return {**line, "error": None, "failed": "error above the whole deviation"}
    for _ in range(repeat - 1 if spent < SHORT else 0):
        again, _ = program.run(case, model, size, stepper, step)
        line["cpu_s"] = min(line["cpu_s"], again)
    return line


def measure(made, cases, repeat):
    """Runs all lines of the programs and prints them."""
    lines = []
    for program in made:
        for case in cases:
            for line in program.lines(case):
                found = measure_line(program, case, *line, repeat)
                print(told(found), flush=True)
                lines.append(found)
    return lines


def told(line):
    """One line as text."""
    start = f"{line['program']:10} {line['case']:13} {line['model']:18} {line['size']:3} {line['stepper']:18} {line['step']:7g}"
    if "failed" in line:
        return f"{start} failed: {line['failed']}"
    slider = f" slider {1e6 * line['slider_m']:.3g} um" if "slider_m" in line else ""
    return f"{start} error {line['error']:.2e}{slider} {line['cpu_s']:.3f} s"


def machine():
    """Names the processor."""
    information = Path("/proc/cpuinfo")
    names = [line.split(":")[1].strip() for line in
             (information.read_text().splitlines() if information.exists() else [])
             if line.startswith("model name")]
    return f"{names[0] if names else platform.processor()}, {os.cpu_count()} cores, {platform.system()}"


# --------------------------------------------------------------------------------------------------
# tables
def key(line):
    """What tells lines of a case apart."""
    return line["program"], line["model"], line["stepper"], line["step"], line["size"]


def percent(x):
    """An error as text."""
    return f"{100 * x:.2g} %" if x < 0.1 else f"{100 * x:.0f} %"


def seconds(x):
    """A time as text."""
    return f"{x:.2g}" if x < 10 else f"{x:.0f}"


def step_text(line):
    """A step size, or a relative tolerance."""
    if line["program"] == "Pinocchio":
        return f"tolerance {line['step']:g}"
    return f"{1e3 * line['step']:g} ms"


def cell(line):
    """Error and time of a line."""
    if line is None:
        return ""
    return "-" if "failed" in line else f"{percent(line['error'])}, {seconds(line['cpu_s'])} s"


def arms_table(found):
    """All lines of the two-link arms: a row per model and step, a column per run."""
    rows = {}
    for line in found["lines"]:
        if line["case"] != CRANK:
            rows.setdefault(key(line), {})[line["case"]] = line
    text = f"| program | model | parts | stepper | step | {' | '.join(TWO_LINK)} |\n"
    text += "| --- " * (5 + len(TWO_LINK)) + "|\n"
    for row in rows.values():
        any_line = next(iter(row.values()))
        cells = [any_line["program"], any_line["model"], str(any_line["size"]),
                 any_line["stepper"], step_text(any_line)]
        cells += [cell(row.get(case)) for case in TWO_LINK]
        text += f"| {' | '.join(cells)} |\n"
    return text


def crank_table(found):
    """All lines of the slider crank."""
    text = "| program | model | parts | stepper | step | deflection | slider | time |\n"
    text += "| --- " * 8 + "|\n"
    for line in found["lines"]:
        if line["case"] != CRANK:
            continue
        failed = "failed" in line
        parts = f"2 x {line['size']}" if line["program"] == "flexarm" else str(line["size"])
        cells = [line["program"], line["model"], parts, line["stepper"], step_text(line)]
        cells += ["-"] * 3 if failed else [percent(line["error"]), f"{1e6 * line['slider_m']:.2g} µm",
                                           f"{seconds(line['cpu_s'])} s"]
        text += f"| {' | '.join(cells)} |\n"
    return text


def fastest(found, case, name, bound):
    """The cheapest line of a program with an error of at most `bound`."""
    good = [line for line in found["lines"] if line["case"] == case and line["program"] == name
            and "failed" not in line and line["error"] <= bound]
    return min(good, key=lambda line: line["cpu_s"], default=None)


def best_table(found):
    """Shortest time of each program for errors of at most 1 % and 0.1 %."""
    names = [name for name in found["versions"] if any(line["program"] == name for line in found["lines"])]
    text = f"| run | error, at most | {' | '.join(names)} |\n" + "| --- " * (2 + len(names)) + "|\n"
    for case in [*TWO_LINK, CRANK]:
        for bound in (1e-2, 1e-3):
            lines = [fastest(found, case, name, bound) for name in names]
            ahead = min((line["cpu_s"] for line in lines if line), default=None)
            cells = []
            for line in lines:
                if line is None:
                    cells.append("none")
                    continue
                time_text = f"{seconds(line['cpu_s'])} s"
                mark = f"**{time_text}**" if line["cpu_s"] == ahead else time_text
                cells.append(f"{mark} ({line['model']}, {line['size']}; {percent(line['error'])})")
            text += f"| {case} | {percent(bound)} | {' | '.join(cells)} |\n"
    return text


def convergence(found):
    """Says for each program and model in which runs the error falls with each finer model."""
    series = {}
    for line in found["lines"]:
        if "failed" not in line:
            name = (line["program"], line["model"], line["case"])
            series.setdefault(name, {}).setdefault(line["size"], []).append(line["error"])
    falls, other = {}, {}
    for (program, model, case), sizes in series.items():
        if len(sizes) < 2:
            continue
        errors = [min(sizes[size]) for size in sorted(sizes)]
        good = all(b < a for a, b in zip(errors, errors[1:]))
        text = case if good else f"{case} ({', '.join(percent(e) for e in errors)})"
        (falls if good else other).setdefault((program, model), []).append(text)
    text = ""
    for name in dict.fromkeys([*falls, *other]):
        text += f"* {name[0]}, {name[1]}: falls in {', '.join(falls.get(name, ['no run']))}"
        text += f"; does not in {', '.join(other[name])}.\n" if name in other else ".\n"
    return text


def markdown(found):
    """The scores as Markdown."""
    versions = ", ".join(f"{name} {number}" for name, number in found["versions"].items())
    text = f"{versions}; {found['machine']}; {found['date']}.\n\n"
    for name, reason in found["skipped"].items():
        text += f"{name}: skipped ({reason}).\n\n"
    text += "Shortest time of each program for an error of at most 1 % or 0.1 %, with its model and size:\n\n"
    text += best_table(found)
    text += "\nTwo-link arms, all lines: error and processor time. `-`: the run fails, or its error is above 100 %.\n\n"
    text += arms_table(found)
    text += "\nSlider crank, all lines; errors against the exact rod:\n\n" + crank_table(found)
    text += "\nDoes the error (smallest over the steps) fall with each finer model?\n\n" + convergence(found)
    return text


def write(found):
    """Stores the scores, and the tables in the page."""
    STORE.write_text(json.dumps(found, indent=1) + "\n")
    page = PAGE.read_text()
    before, rest = page.split(BEGIN)
    _, after = rest.split(END)
    PAGE.write_text(f"{before}{BEGIN}\n\n{markdown(found)}\n{END}{after}")


def merge(found, stored, names):
    """Keeps the stored lines of programs that were not run."""
    kept = [line for line in stored["lines"] if line["program"] not in names]
    order = [kind.name for kind in (Flexarm, Exudyn, MuJoCo, Pinocchio)]
    found["lines"] = sorted(kept + found["lines"], key=lambda line: order.index(line["program"]))
    versions = {**stored["versions"], **found["versions"]}
    found["versions"] = {name: versions[name] for name in order if name in versions}


def inside(venv):
    """Runs this script again with the Python of the environment, on one thread."""
    if os.environ.get("FLEXARM_SCORES"):
        return
    python = Path(venv) / "bin" / "python"
    if not python.exists():
        sys.exit(f"there is no {python}: python3 -m venv {venv}, then {python} -m pip install exudyn mujoco pin scipy")
    threads = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
    environment = dict(os.environ, FLEXARM_SCORES="1", **threads)
    sys.exit(subprocess.run([str(python), *sys.argv], env=environment).returncode)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("venv", help="virtual environment with the other programs")
    parser.add_argument("--write", action="store_true", help="store scores.json and the tables")
    parser.add_argument("--draw", action="store_true", help="write the tables from the stored lines")
    parser.add_argument("--only", help="one program: flexarm, exudyn, mujoco or pinocchio")
    parser.add_argument("--cases", nargs="+", choices=[*TWO_LINK, CRANK], help="print some cases only")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--flexarm", default=str(TARGET / "release" / "flexarm"), help="the program")
    arguments = parser.parse_args()
    if arguments.cases and arguments.write:
        parser.error("--write needs all cases")
    if arguments.draw:
        write(json.loads(STORE.read_text()))
        return
    inside(arguments.venv)
    made, skipped = programs(arguments.flexarm)
    for name, reason in skipped.items():
        print(f"{name}: skipped ({reason})")
    if arguments.only:
        made = [program for program in made if program.name.lower() == arguments.only.lower()]
    found = {"date": datetime.date.today().isoformat(), "machine": machine(),
             "versions": {program.name: program.version for program in made}, "skipped": skipped}
    found["lines"] = measure(made, arguments.cases or [*TWO_LINK, CRANK], arguments.repeat)
    if arguments.only and STORE.exists():
        merge(found, json.loads(STORE.read_text()), list(found["versions"]))
    print("\n" + markdown(found))
    if arguments.write:
        write(found)


if __name__ == "__main__":
    main()
