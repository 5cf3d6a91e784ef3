"""Models of the benchmarks of tests/benchmarks in flexarm and other programs, for benchmark_scores.py.

Every program has `name`, `version`, `settings` (a sentence for the page), `lines(case)` (model, size,
stepper, step) and `run(case, model, size, stepper, step)`, which returns the processor time of the
simulation and a function that gives the samples: time and x, y of the tip; for the crank time, x of
the slider and x, y of the rod's middle. flexarm's links are in space, all others in the plane.
"""
import csv
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "tests" / "benchmarks"

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


def steps(case):
    """Steps of the implicit steppers; each hits the times of the truth (s)."""
    return (2e-4, 1e-4, 5e-5, 2e-5) if case == CRANK else (5e-3, 2e-3, 1e-3, 5e-4, 2e-4)


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


def shear_stiffness(young, poisson, area):
    """Shear stiffness of a rectangle."""
    return SHEAR_FACTOR * young / (2 * (1 + poisson)) * area


def read_columns(path, names):
    """Reads columns of a table."""
    with open(path, newline="") as file:
        return [[float(row[name]) for name in names] for row in csv.DictReader(file)]


# --------------------------------------------------------------------------------------------------
# flexarm
class Flexarm:
    """The command line on the files; other link models in a copy of the robot file."""

    name = "flexarm"
    RIGID, MODAL = "rigid parts", "modal, stiffened"
    settings = ("Chains of rigid parts (4 to 32 per bar) with elastic joints of six coordinates, and modal links (2 and "
                "4 modes) with stiffness by load; `generalized-alpha` as it is, with its correction of dispersion, and "
                "`sdirk3` for chains. The rod of the crank is two links, each with half of the parts or modes. The time "
                "includes reading the files.")

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
        for step in steps(case):
            yield from ((self.RIGID, n, "generalized-alpha", step) for n in (4, 8, 16, 32))
            yield from ((self.MODAL, n, "generalized-alpha", step) for n in (2, 4))
        yield from ((self.RIGID, n, "sdirk3", step) for step in steps(case)[:3] for n in (8, 16, 32))

    def robot(self, case, model, size, folder):
        """Writes a copy of the robot with another link model, and returns its path and motion."""
        if case == CRANK:
            source, motions = FOLDER / CRANK / "slider_crank.toml", ["ramp.csv"]
            size //= 2
        else:
            kind, height = case.split("_")
            source = FOLDER / "two_link" / f"two_link_{height}.toml"
            motions = [{"slew": "slew.toml", "spin": "spin.csv"}[kind], "slew.toml"]
        link = f'model = "lumped"\nsegments = {size}'
        if model == self.MODAL:
            link = f'model = "modal"\nmodes = {size}\ngeometric_stiffening = true'
        text, found = re.subn(r'model = "lumped"\nsegments = \d+', link, source.read_text())
        if found != 2:
            raise RuntimeError(f"{source} has not two links of rigid parts")
        for name in [source.with_suffix(".urdf").name, *motions]:
            (folder / name).write_text((source.parent / name).read_text())
        (folder / source.name).write_text(text)
        return folder / source.name, folder / motions[0]

    def run(self, case, model, size, stepper, step):
        sample = CRANK_SAMPLE if case == CRANK else TWO_LINK_SAMPLE
        options = ["--stepper", stepper, "--step", repr(step), "--log-rate", repr(1 / sample), "-q", "--json"]
        with tempfile.TemporaryDirectory() as folder:
            files = self.robot(case, model, size, Path(folder))
            spent = json.loads(self.call("run", *files, *options, "--no-files"))["cpu_s"]

        def positions(tcp):
            with tempfile.TemporaryDirectory() as made:
                folder = Path(made)
                files = self.robot(case, model, size, folder)
                self.call("run", *files, *options, "--tcp", tcp, "-o", str(folder / "out"))
                return read_columns(folder / "out" / "run.csv", ["time", "flexible_x_m", "flexible_y_m"])

        def samples():
            if case != CRANK:
                return positions("tip")
            return [(t, s[1], x, y) for (t, x, y), s in zip(positions("middle"), positions("slider"))]

        return spent, samples


# --------------------------------------------------------------------------------------------------
# Exudyn
class Exudyn:
    """Beams of large displacement in the plane; motions by compiled user functions."""

    name = "Exudyn"
    EXACT, CABLE = "exact beam, 3 nodes", "ANCF cable"
    settings = ("Geometrically exact beams of three nodes (1 to 8 elements per bar) and ANCF cables with Lobatto's points "
                "(2 to 8), in the plane; the module without range checks, `EigenDense` up to four elements and "
                "`EigenSparse` above, modified Newton with tolerances of 1e-4 and 1e-5, generalised-alpha with a spectral "
                "radius of 0.9, no adaptive steps, motions as compiled symbolic functions. Tighter tolerances, full "
                "Newton, `EXUdense` and beams of two nodes mostly took longer for the same error. The cable has neither "
                "shear nor rotary inertia. For the crank the beam's shear stiffness is a hundredfold, as the truth has "
                "no shear.")

    def __init__(self):
        sys.exudynFast = True
        import exudyn
        from exudyn import itemInterface

        exudyn.config.printToConsole = False
        self.exu, self.items = exudyn, itemInterface
        self.version = version("exudyn")

    def lines(self, case):
        for tolerance in ("1e-4", "1e-5"):
            for step in steps(case):
                for model, sizes in ((self.EXACT, (1, 2, 4, 8)), (self.CABLE, (2, 4, 8))):
                    yield from ((model, n, f"generalized-alpha, tolerance {tolerance}", step) for n in sizes)

    def run(self, case, model, size, stepper, step):
        self.kept = []
        container = self.exu.SystemContainer()
        self.system = container.AddSystem()
        ground = self.items.NodePointGround()
        self.ground = self.coordinate(self.system.AddNode(ground), 0)
        sensors = self.crank(model, size) if case == CRANK else self.arms(case, model, size)
        self.system.Assemble()
        settings = self.settle(case, size, float(stepper.split()[-1]), step)
        begin = time.process_time()
        self.system.SolveDynamic(settings)
        spent = time.process_time() - begin
        tables = [self.system.GetSensorStoredData(sensor) for sensor in sensors]

        def samples():
            if case != CRANK:
                return [tuple(row[:3]) for row in tables[0]]
            return [(a[0], b[1], a[1], a[2]) for a, b in zip(*tables)]

        return spent, samples

    def settle(self, case, size, tolerance, step):
        """Returns the settings of the solver."""
        end, sample = (CRANK_END, CRANK_SAMPLE) if case == CRANK else (TWO_LINK_END, TWO_LINK_SAMPLE)
        settings = self.exu.SimulationSettings()
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = sample
        solvers = self.exu.LinearSolverType
        settings.linearSolver.solverType = solvers.EigenDense if size <= 4 else solvers.EigenSparse
        settings.linearSolver.reuseAnalyzedPattern = True
        integration = settings.timeIntegration
        integration.numberOfSteps, integration.endTime = round(end / step), end
        integration.verboseMode, integration.adaptiveStep = 0, False
        integration.generalizedAlpha.spectralRadius = 0.9
        integration.newton.useModifiedNewton = True
        integration.newton.relativeTolerance = integration.newton.absoluteTolerance = tolerance
        return settings

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
        """Adds geometrically exact elements of three nodes along nodes."""
        for k in range(0, len(nodes) - 1, 2):
            self.system.AddObject(self.items.ObjectBeamGeometricallyExact2D(
                nodeNumbers=nodes[k:k + 3], length=2 * length / (len(nodes) - 1), massPerLength=mass,
                crossSectionInertia=inertia, bendingStiffness=bending, axialStiffness=axial,
                shearStiffness=shear))

    def cable(self, nodes, length, bending, axial, mass):
        """Adds ANCF elements along nodes."""
        return [self.system.AddObject(self.items.ObjectANCFCable2D(
            nodeNumbers=list(pair), length=length / (len(nodes) - 1), massPerLength=mass,
            bendingStiffness=bending, axialStiffness=axial,
            useReducedOrderIntegration=2)) for pair in zip(nodes, nodes[1:])]

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
        shear, n = shear_stiffness(YOUNG, POISSON, area), 2 * size
        start, chains = (0.0, 0.0), []
        for angle in angles:
            along = LENGTH * math.cos(angle), LENGTH * math.sin(angle)
            nodes = []
            for k in range(n + 1):
                place = [start[i] + along[i] * k / n for i in (0, 1)]
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
        nodes, n = [], 2 * size if model == self.EXACT else size
        for k in range(n + 1):
            x = CRANK_LENGTH + ROD_LENGTH * k / n
            node = (self.items.NodeRigidBody2D(referenceCoordinates=[x, 0, 0]) if model == self.EXACT
                    else self.items.NodePoint2DSlope1(referenceCoordinates=[x, 0, 1, 0]))
            nodes.append(self.system.AddNode(node))
        if model == self.EXACT:
            shear = 100 * shear_stiffness(ROD_YOUNG, 0.3, area)
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
        return [self.position(nodes[n // 2]), self.position(nodes[-1])]


# --------------------------------------------------------------------------------------------------
# chains of rigid parts for the programs of rigid bodies
def hinged_parts(size, height):
    """Begin and length of each part of a bar with `size` hinges, and the stiffness of each hinge.

    Hinges are in the middle of equal pieces. The compliance of the first and last hinge is larger
    by the share `a`, that of their neighbours smaller: so a load at the end moves the end as it
    does that of Timoshenko's beam.
    """
    area, _, _, bending = section(height)
    piece = LENGTH / size
    ends = [0.0, *[(k + 0.5) * piece for k in range(size)], LENGTH]
    shear = bending / (shear_stiffness(YOUNG, POISSON, area) * LENGTH**2)
    a = (size / 12 + size**3 * shear) / (2 * (size - 2))
    shares = [1 + a, 1 - a, *[1.0] * (size - 4), 1 - a, 1 + a]
    return [(x, y - x) for x, y in zip(ends, ends[1:])], [bending / (piece * share) for share in shares]


def part_inertia(height, length):
    """Mass and moments of inertia of a part."""
    mass = DENSITY * WIDTH * height * length
    return mass, [mass * (a * a + b * b) / 12 for a, b in ((height, WIDTH), (length, WIDTH), (length, height))]


class MuJoCo:
    """A chain of rigid parts with a hinge and a spring between neighbours. The joints of the arm
    follow by motors of huge inertia, with set points that each integrator hits."""

    name = "MuJoCo"
    MODEL, ROTOR, PD = "hinged parts", 1e8, 200.0
    # Steps by the number of hinges (s).
    STEPS = {4: (1e-3, 5e-4, 2e-4), 8: (2e-4, 1e-4, 5e-5), 16: (5e-5, 2e-5)}
    settings = ("A chain of rigid parts with hinges and springs (4 to 16 hinges per bar), whose end moves under a load "
                "as that of Timoshenko's beam; `implicitfast` and `RK4`, with steps near the limit of stability and "
                "shorter ones. The integrator `discrete` is stable with longer steps, but of first order, and needs "
                "more time for the same error. Shear is right for loads at the ends only. Not for the crank, as "
                "constraints are soft.")

    def __init__(self):
        import mujoco
        from mujoco import rollout

        mujoco.set_mju_user_warning(lambda text: None)
        self.mujoco, self.rollout = mujoco, rollout
        self.version = version("mujoco")

    def lines(self, case):
        if case == CRANK:
            return
        for n, limits in self.STEPS.items():
            for stepper in ("implicitfast", "RK4"):
                yield from ((self.MODEL, n, stepper, step) for step in limits)

    @staticmethod
    def part(begin, length, height, inner, joint):
        """A rigid part at `begin` of its parent, with what it carries."""
        mass, turn = part_inertia(height, length)
        inertia = " ".join(f"{x:.17g}" for x in turn)
        return (f'<body pos="{begin:.17g} 0 0">{joint}<inertial pos="{length / 2:.17g} 0 0" '
                f'mass="{mass:.17g}" diaginertia="{inertia}"/>{inner}</body>')

    def bar(self, size, height, first_joint, carried):
        """A bar of parts, with a lump and what is beyond it at the end."""
        lump = f'mass="{LUMP_MASS}" diaginertia="{LUMP_INERTIA} {LUMP_INERTIA} {LUMP_INERTIA}"'
        parts, stiffness = hinged_parts(size, height)
        inner = (f'<body pos="{parts[-1][1]:.17g} 0 0"><inertial pos="0 0 0" {lump}/>{carried}</body>')
        for k in range(size, 0, -1):
            spring = f'<joint type="hinge" axis="0 0 1" stiffness="{stiffness[k - 1]:.17g}"/>'
            inner = self.part(parts[k - 1][1], parts[k][1], height, inner, spring)
        return self.part(0.0, parts[0][1], height, inner, first_joint)

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

        def samples():
            for k, state in enumerate(states):
                data.qpos[:] = state[1:1 + model.nq]
                mujoco.mj_kinematics(model, data)
                yield k * TWO_LINK_SAMPLE, *data.site("tip").xpos[:2]

        return spent, lambda: list(samples())


class Pinocchio:
    """The same chain of hinged parts; the library gives forces, mass matrix and derivatives, numpy
    the accelerations and scipy the steps."""

    name = "Pinocchio"
    MODEL = "hinged parts"
    settings = ("The same chain (4 to 32 hinges per bar); accelerations from `crba` and `rnea` in Python, steps by SciPy's "
                "`Radau` with the Jacobian of `computeRNEADerivatives` and relative tolerances of 1e-2 to 1e-4 instead of "
                "steps. Explicit methods (`DOP853`, `RK45`) took 5 to 60 times as long. Most of the time is Python's and "
                "SciPy's. Not for the crank, as SciPy has no stepper for loops.")

    def __init__(self):
        import pinocchio
        from scipy.integrate import solve_ivp

        self.pin, self.solve = pinocchio, solve_ivp
        self.version = version("pin")

    def lines(self, case):
        if case != CRANK:
            for n in (4, 8, 16, 32):
                yield from ((self.MODEL, n, "Radau of SciPy", tolerance) for tolerance in (1e-2, 1e-3, 1e-4))

    def model(self, height, size):
        """Returns the model, the prescribed coordinates, the stiffness of the others and the tip."""
        import numpy as np

        pin, model = self.pin, self.pin.Model()
        at, place, prescribed = 0, 0.0, []
        parts, stiffness = hinged_parts(size, height)
        lump = pin.Inertia(LUMP_MASS, np.zeros(3), LUMP_INERTIA * np.eye(3))
        for bar in range(2):
            for k, (_, length) in enumerate(parts):
                move = pin.SE3(np.eye(3), np.array([place, 0.0, 0.0]))
                at = model.addJoint(at, pin.JointModelRZ(), move, f"{bar}_{k}")
                mass, turn = part_inertia(height, length)
                own = pin.Inertia(mass, np.array([length / 2, 0.0, 0.0]), np.diag(turn))
                model.appendBodyToJoint(at, own, pin.SE3.Identity())
                if k == 0:
                    prescribed.append(at - 1)
                place = length
            end = pin.SE3(np.eye(3), np.array([place, 0.0, 0.0]))
            model.appendBodyToJoint(at, lump, end)
        model.gravity.linear = np.zeros(3)
        return model, prescribed, np.array(2 * stiffness), (at, end)

    def run(self, case, model, size, stepper, step):
        import numpy as np
        from scipy.linalg import cho_factor, cho_solve

        pin, (motions, height) = self.pin, arm(case)
        model, prescribed, stiffness, (last, end) = self.model(height, size)
        data = model.createData()
        elastic = np.setdiff1d(np.arange(model.nv), prescribed)
        block, n = np.ix_(elastic, elastic), len(elastic)
        q, v, a = np.zeros(model.nv), np.zeros(model.nv), np.zeros(model.nv)
        small = 1e-6

        def accelerations(t, x):
            """Accelerations of the hinges, and the factors of their mass matrix."""
            for joint, (place, rate) in zip(prescribed, motions):
                q[joint], v[joint] = place(t, Floats), rate(t, Floats)
                a[joint] = (rate(t + small, Floats) - rate(t - small, Floats)) / (2 * small)
            q[elastic], v[elastic], a[elastic] = x[:n], x[n:], 0.0
            factors = cho_factor(np.triu(pin.crba(model, data, q))[block], check_finite=False)
            force = -pin.rnea(model, data, q, v, a)[elastic] - stiffness * x[:n]
            return cho_solve(factors, force, check_finite=False), factors

        def slope(t, x):
            return np.concatenate([x[n:], accelerations(t, x)[0]])

        def jacobian(t, x):
            a[elastic], factors = accelerations(t, x)
            by_q, by_v, _ = pin.computeRNEADerivatives(model, data, q, v, a)
            right = -np.hstack([by_q[block] + np.diag(stiffness), by_v[block]])
            below = cho_solve(factors, right, check_finite=False)
            return np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), below])

        times = [k * TWO_LINK_SAMPLE for k in range(round(TWO_LINK_END / TWO_LINK_SAMPLE) + 1)]
        method = stepper.split()[0]
        options = {"jac": jacobian} if method == "Radau" else {}
        begin = time.process_time()
        found = self.solve(slope, (0.0, times[-1]), np.zeros(2 * n), method=method, t_eval=times,
                           rtol=step, atol=1e-3 * step, **options)
        spent = time.process_time() - begin

        def samples():
            for t, x in zip(found.t, found.y.T):
                accelerations(t, x)
                pin.forwardKinematics(model, data, q)
                yield t, *data.oMi[last].act(end.translation)[:2]

        return spent, lambda: list(samples())
