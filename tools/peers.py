"""Work-precision comparison of flexarm with other programs, for docs/performance.md.

    python3 tools/peers.py                     measure and print the table
    python3 tools/peers.py --write             also store it: docs/performance, docs/performance.md
    python3 tools/peers.py --draw              write tables and picture from the stored numbers

The robot is robots/test/reference_arm (18 coordinates, 12 of them elastic) on its motion of 4 s. The
error is the maximum TCP distance from tests/golden/reference_arm_mid.csv over the peak deflection,
every 4 ms. Three measurements of flexarm: a run of a prepared arm (set-up of the run, steps, a
sample at its start and its end: crates/faces/flexarm/examples/prepared_runs.rs), the same with 100
samples per second and the rigid twin, and the whole process `flexarm compare --no-files`; of the
others: the stepping call, without set-up. CPU time of one thread, all lines in turn, the minimum of
--repeat runs.

MuJoCo and Exudyn are installed from PyPI into a separate environment (target/peers-venv); if they
are unavailable, the line says so and only flexarm is measured. Needs cargo's release build of
flexarm and its example, or --flexarm PROGRAM --prepared PROGRAM.
"""
import argparse
import datetime
import json
import math
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
STORE = ROOT / "docs" / "performance"
PACKAGES = ["numpy", "scipy", "pin", "mujoco", "exudyn"]
GOLDEN = ROOT / "tests" / "golden" / "reference_arm_mid.csv"
END_S = 4.0

# Program, stepper, step sizes (s).
OURS = [
    ("generalized-alpha", [1.6e-2, 1e-2, 8e-3, 5e-3, 4e-3, 2.5e-3, 2e-3, 1e-3, 5e-4, 2.5e-4]),
    ("extrapolated-alpha", [8e-3, 4e-3, 3e-3, 2.5e-3, 2e-3]),
    ("sdirk3", [4e-3, 2e-3, 1e-3, 5e-4]),
    ("spook", [1e-3, 5e-4, 2e-4, 1e-4]),
    ("rk4", [1.25e-4]),
    ("reference", [1e-8, 1e-9]),
]
MUJOCO = [("implicitfast", [2e-3, 1e-3, 8e-4, 5e-4, 2.5e-4, 1e-4]), ("discrete", [2e-3, 1e-3, 5e-4, 1e-4, 2e-5]), ("Euler", [2e-4, 1e-4]), ("RK4", [1.25e-4, 1e-4])]
EXUDYN = [("tree, generalised-alpha", [4e-3, 2e-3, 1e-3, 5e-4])]
# Maximum errors at which the programs are compared.
CLASSES = [1e-2, 2e-3, 3e-4, 1e-5]


# -------------------------------------------------------------------------------------------------------
# environment
def inside():
    """Runs this script again with the packages, if that is needed and possible."""
    if os.environ.get("FLEXARM_PEERS") or "--draw" in sys.argv:
        return
    venv = TARGET / "peers-venv"
    python = venv / "bin" / "python"
    log = []

    def run(*command):
        done = subprocess.run(command, capture_output=True, text=True)
        log.append((done.stdout + done.stderr).strip().splitlines()[-1:] or [""])
        return done.returncode == 0

    have = python.exists() or run(sys.executable, "-m", "venv", str(venv))
    have = have and (run(str(python), "-c", "import numpy, pinocchio, mujoco, exudyn") or run(str(python), "-m", "pip", "install", "-q", *PACKAGES))
    if not have:
        print("skipped: the other programs cannot be installed from PyPI:", *log[-1], file=sys.stderr)
    environment = dict(os.environ, FLEXARM_PEERS="with" if have else "alone", OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    sys.exit(subprocess.run([str(python) if have else sys.executable, *sys.argv], env=environment).returncode)


# --------------------------------------------------------------------------------------------------------------
# truth
def golden():
    """Returns times in ms -> flexible TCP position; peak deflection (m)."""
    places, peak = {}, 0.0
    for line in GOLDEN.read_text().splitlines():
        if line[0] in "#t":
            continue
        t, *x = map(float, line.split(","))
        places[round(1e3 * t)] = x[3:6]
        peak = max(peak, math.dist(x[0:3], x[3:6]))
    return places, peak


def error_of(samples):
    """Maximum distance from the truth over the peak deflection, at common times; None if a value is
    not finite."""
    places, peak = golden()
    distances = [math.dist(p, places[k]) for t, p in samples for k in [round(1e3 * t)] if abs(1e3 * t - k) < 1e-3 and k in places]
    # Steps of 8 and 10 ms hit every second or fifth of its times.
    if len(distances) <= 90 or not all(map(math.isfinite, distances)):
        return None
    # An error as large as the whole deflection is no solution.
    return error if (error := max(distances) / peak) < 1.0 else None


# ---------------------------------------------------------------------------------------------------------------
# ours
def flexarm(program, stepper, step, files=None):
    """CPU s of the whole process, user and system."""
    command = [program, "compare", str(ROOT / "robots/test" / "reference_arm"), "--stepper", stepper, "-q", "--json"]
    command += ["--rtol", repr(step)] if stepper == "reference" else ["--step", repr(step)]
    # Samples at the times of the truth, or at every step if its steps do not match them.
    every_4_ms = stepper == "reference" or abs(round(4e-3 / step) * step - 4e-3) < 1e-12
    rate = 100.0 if files is None else 250.0 if every_4_ms else 1 / step
    command += ["--log-rate", repr(rate)] + (["--no-files"] if files is None else ["-o", files])
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip().splitlines()[-1])
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def prepared(program):
    """CPU ms per simulated second of runs of a prepared arm, without and with samples, for all
    flexarm lines."""
    wanted = [f"{name}:{h!r}" for name, steps in OURS for h in steps]
    done = subprocess.run([program, *wanted], capture_output=True, text=True, check=True)
    return {name: [float(x) for x in spent] for name, *spent in map(str.split, done.stdout.splitlines())}


def our_error(program, stepper, step):
    with tempfile.TemporaryDirectory() as folder:
        flexarm(program, stepper, step, str(Path(folder) / "run"))
        head, *lines = (Path(folder) / "run" / "run.csv").read_text().splitlines()
        names = head.split(",")
        columns = [names.index(name) for name in ("time", "flexible_x_m", "flexible_y_m", "flexible_z_m")]
        rows = ([float(line.split(",")[k]) for k in columns] for line in lines)
        return error_of([(t, p) for t, *p in rows])


# ------------------------------------------------------------------------------------------------------------
# the robot
def read_robot():
    """Returns the chain of bodies from the robot file (by tools/robot_file.py), motion, static
    deflections."""
    sys.path.insert(0, str(ROOT / "tools"))
    import numpy as np
    from golden_reference_arm import Motion
    from robot_file import Arm

    arm = Arm(ROOT / "robots/test" / "reference_arm")
    motion = Motion(ROOT / "trajectories" / "reference_arm.toml")
    axes = {joint["name"]: joint["axis"] for joint in arm.joints}
    bodies, at = [], np.zeros(3)
    for i in range(1, arm.model.njoints):
        name, X, I = arm.model.names[i], arm.model.jointPlacements[i], arm.model.inertias[i]
        assert np.allclose(X.rotation, np.eye(3)), "the joint frames of the arm are parallel"
        if name.startswith("elt_"):
            at = X.translation
            continue
        elastic = name.startswith("elr_")
        bodies.append(dict(name=name, axis=None if elastic else axes[name], place=at if elastic else X.translation,
                           mass=I.mass, com=I.lever, inertia=I.inertia))
    blocks = iter([arm.K[k : k + 6, k : k + 6] for k in range(0, len(arm.K), 6)])
    for body in bodies:
        body["K"] = next(blocks) if body["axis"] is None else None
    beta = arm.file["flexible_link"][0]["damping"]["stiffness_beta"]
    frame = arm.model.frames[arm.tcp]
    return dict(bodies=bodies, motion=motion, beta=beta, tool=frame.placement.translation, rest=arm.statics(motion(0.0)[0]),
                gravity=arm.model.gravity.linear)


# --------------------------------------------------------------------------------------------------------------
# MuJoCo
class MuJoCo:
    """The arm as `flexarm export --to mjcf` writes it: three slides and three hinges for each elastic
    joint, fixed tendons for the full 6x6, motors of huge inertia with set points that each integrator
    hits."""

    def __init__(self, program, motion):
        import mujoco

        mujoco.set_mju_user_warning(lambda text: None)
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([program, "export", str(ROOT / "robots" / "test" / "reference_arm"), "--to", "mjcf", "-o", folder], check=True, capture_output=True)
            self.model = mujoco.MjModel.from_xml_path(f"{folder}/reference_arm.xml")
        self.motion = motion

    def run(self, integrator, h):
        import mujoco
        import numpy as np
        from mujoco import rollout

        model = self.model
        data = mujoco.MjData(model)
        model.opt.timestep, model.opt.integrator = h, getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
        mujoco.mj_resetDataKeyframe(model, data, 0)
        n, motion = round(END_S / h), self.motion
        if integrator == "RK4":
            middle = [motion((k + 0.5) * h) for k in range(n)]
            points = [np.array([m[i] for m in middle]) for i in (2, 0, 1)]
        else:
            # Semi-implicit Euler: q+ = q + h v+
            q = np.array([motion(k * h)[0] for k in range(n + 2)])
            ahead = np.diff(q, axis=0) / h
            behind = np.vstack([0 * ahead[:1], ahead[:-1]])
            # Positions that the servo sees: of the begin of a step; `discrete` takes those of its end.
            seen = q[1 : n + 1] if integrator == "discrete" else q[:n]
            points = [((ahead - behind) / h)[:n], seen, (behind if integrator == "Euler" else ahead)[:n]]
        control = np.zeros((n, model.nu))
        for i in range(3):
            control[:, i::3] = points[i]
        mujoco.mj_forward(model, data)
        everything = mujoco.mjtState.mjSTATE_FULLPHYSICS
        start = np.zeros(mujoco.mj_stateSize(model, everything))
        mujoco.mj_getState(model, data, start, everything)
        begin = time.process_time()
        states, _ = rollout.rollout(model, data, start[None], control[None])
        spent = time.process_time() - begin

        def tool(x):
            data.qpos[:] = x
            mujoco.mj_kinematics(model, data)
            return data.site("tcp").xpos.copy()

        every = max(1, round(1e-3 / h)) if h < 1e-3 else 1
        samples = lambda: [((k + 1) * h, tool(states[0, k, 1 : 1 + model.nq])) for k in range(every - 1, n, every)]
        return spent, samples


# --------------------------------------------------------------------------------------------------------------
# Exudyn
class Exudyn:
    """A kinematic tree of one-DoF joints with stiffness; the motion by constraints with compiled
    user functions."""

    def __init__(self, robot):
        self.robot = robot

    def run(self, _, h):
        import exudyn as exu
        import exudyn.itemInterface as ei
        import numpy as np
        from exudyn.utilities import CreateSymbolicUserFunction

        exu.config.printToConsole = False
        es, motion = exu.symbolic, self.robot["motion"]

        def along(k):
            """Quintic moves as one expression without branches."""

            def inside(t, begin, duration):
                u = (t - begin) / duration
                return 0.5 * (es.abs(u) - es.abs(u - 1.0) + 1.0)

            def place(t):
                return sum((float(way[k]) * u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
                            for begin, T, way in motion.moves for u in [inside(t, begin, T)]), float(motion.start[k]))

            def rate(t):
                return sum((float(way[k]) * 30.0 / T * u * u * (1.0 - u) * (1.0 - u)
                            for begin, T, way in motion.moves for u in [inside(t, begin, T)]), 0.0)

            return place, rate

        container = exu.SystemContainer()
        system = container.AddSystem()
        J, zero = exu.JointType, np.zeros(3)
        turns, slides = (J.RevoluteX, J.RevoluteY, J.RevoluteZ), (J.PrismaticX, J.PrismaticY, J.PrismaticZ)
        links, joints, springs = [], [], []
        for b in self.robot["bodies"]:
            own = (b["mass"], b["com"], b["inertia"])
            if b["axis"] is not None:
                joints.append(len(links))
                links.append((turns[int(np.argmax(b["axis"]))], b["place"], *own))
                continue
            first = len(links)
            springs.append(([first + k for k in (0, 1, 2, 5, 4, 3)], b["K"]))
            for i, axis in enumerate((0, 1, 2, 2, 1, 0)):
                inertia = own if i == 5 else (0.0, zero, np.zeros((3, 3)))
                links.append(((slides if i < 3 else turns)[axis], b["place"] if i == 0 else zero, *inertia))
        n = len(links)
        kinds, offsets, masses, coms, inertias = zip(*links)
        node = system.AddNode(ei.NodeGenericODE2(referenceCoordinates=[0.0] * n, initialCoordinates=[0.0] * n, initialCoordinates_t=[0.0] * n, numberOfODE2Coordinates=n))
        tree = system.AddObject(ei.ObjectKinematicTree(
            nodeNumber=node, jointTypes=list(kinds), linkParents=list(range(-1, n - 1)), jointTransformations=exu.Matrix3DList([np.eye(3)] * n),
            jointOffsets=exu.Vector3DList(list(offsets)), linkInertiasCOM=exu.Matrix3DList(list(inertias)), linkCOMs=exu.Vector3DList(list(coms)),
            linkMasses=list(masses), gravity=self.robot["gravity"]))
        K = np.zeros((n, n))
        for coordinates, k in springs:
            K[np.ix_(coordinates, coordinates)] = k
        system.AddObject(ei.ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.zeros((n, n)), stiffnessMatrix=K, dampingMatrix=self.robot["beta"] * K))
        ground = system.AddMarker(ei.MarkerNodeCoordinate(nodeNumber=system.AddNode(ei.NodePointGround()), coordinate=0))
        keep = []
        for k, coordinate in enumerate(joints):
            marker = system.AddMarker(ei.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
            item = system.AddObject(ei.CoordinateConstraint(markerNumbers=[ground, marker]))
            for name, function in zip(("offsetUserFunction", "offsetUserFunction_t"), along(k)):
                compiled = CreateSymbolicUserFunction(system, self.four(function), name, item)
                keep.append(compiled)
                system.SetObjectParameter(item, name, compiled)
        sensor = system.AddSensor(ei.SensorKinematicTree(objectNumber=tree, linkNumber=n - 1, localPosition=self.robot["tool"], storeInternal=True,
                                                         outputVariableType=exu.OutputVariableType.Position))
        system.Assemble()
        s = exu.SimulationSettings()
        s.solution.file.write = False
        s.solution.sensors.writePeriod = max(h, 4e-3)
        s.parallel.numberOfThreads = 1
        s.linearSolver.solverType = exu.LinearSolverType.EXUdense
        s.staticSolver.newton.relativeTolerance, s.staticSolver.newton.absoluteTolerance = 1e-10, 1e-12
        s.staticSolver.loadStepDuration = 1e-9  # the static solver advances time
        system.SolveStatic(s, updateInitialValues=True)
        s.timeIntegration.numberOfSteps, s.timeIntegration.endTime = round(END_S / h), END_S
        s.timeIntegration.generalizedAlpha.spectralRadius = 0.9
        s.timeIntegration.newton.useModifiedNewton = True
        begin = time.process_time()
        system.SolveDynamic(s)
        spent = time.process_time() - begin
        table = system.GetSensorStoredData(sensor)
        return spent, lambda: [(row[0], row[1:4]) for row in table]

    @staticmethod
    def four(function):
        """Argument list required by the compiler of user functions."""
        return lambda mbs, t, itemNumber, lOffset: function(t)


# -------------------------------------------------------------------------------------------------------------
# measure
def machine():
    cpu = next((l.split(":")[1].strip() for l in Path("/proc/cpuinfo").read_text().splitlines() if l.startswith("model name")), "") if Path("/proc/cpuinfo").exists() else ""
    return f"{cpu or platform.processor()}, {os.cpu_count()} cores, {platform.system()}"


def measure(program, example, repeat):
    peers, versions = [], {}
    if os.environ.get("FLEXARM_PEERS") == "with":
        from importlib.metadata import version

        versions = {name: version(name) for name in ("mujoco", "exudyn", "pin")}
        robot = read_robot()
        mujoco, exudyn = MuJoCo(program, robot["motion"]), Exudyn(robot)
        peers += [("MuJoCo", mujoco, name, h) for name, steps in MUJOCO for h in steps]
        peers += [("Exudyn", exudyn, name, h) for name, steps in EXUDYN for h in steps]
    versions["flexarm"] = subprocess.run([program, "--version"], capture_output=True, text=True).stdout.split()[-1]
    lines = [dict(program="flexarm", stepper=name, step=h, error=our_error(program, name, h), cpu_ms=math.inf, sampled_ms=math.inf, process_ms=math.inf) for name, steps in OURS for h in steps]
    lines += [dict(program=who, stepper=name, step=h, error=None, cpu_ms=math.inf, peer=peer) for who, peer, name, h in peers]
    for _ in range(repeat):
        built = prepared(example)
        for line in lines:
            if "peer" in line:
                spent, samples = line["peer"].run(line["stepper"], line["step"])
                if line["error"] is None:
                    line["error"] = error_of(samples())
                cpu_ms = 1e3 * spent / END_S
            else:
                process = flexarm(program, line["stepper"], line["step"]) / END_S
                line["process_ms"] = min(line["process_ms"], 1e3 * process)
                cpu_ms, sampled = built[f"{line['stepper']}:{line['step']!r}"]
                line["sampled_ms"] = min(line["sampled_ms"], sampled)
            line["cpu_ms"] = min(line["cpu_ms"], cpu_ms)
    for line in lines:
        line.pop("peer", None)
    return dict(date=datetime.date.today().isoformat(), machine=machine(), repeat=repeat, versions=versions, lines=lines)


# ------------------------------------------------------------------------------------------------------------
# table
def fastest(lines, error, figure="cpu_ms"):
    good = [line for line in lines if line["error"] is not None and line["error"] <= error]
    return min(good, key=lambda line: line[figure], default=None)


def told_step(line):
    return f"rtol {line['step']:g}" if line["stepper"] == "reference" else f"{1e3 * line['step']:g} ms"


def named(line, figure="cpu_ms"):
    return "none" if line is None else f"{line['stepper']}, {told_step(line)}: {line[figure]:.3g}"


def comparison(found):
    """The best lines at equal error: the table of docs/performance.md."""
    text = "| error, at most | a run | best other program | ratio | sampled | ratio | a process | ratio |\n| --- | --- | --- | --- | --- | --- | --- | --- |\n"
    ours = [line for line in found["lines"] if line["program"] == "flexarm"]
    peers = [line for line in found["lines"] if line["program"] != "flexarm"]
    for error in CLASSES:
        other = fastest(peers, error)
        cells = [f"{100 * error:g} %"]
        for figure in ("cpu_ms", "sampled_ms", "process_ms"):
            own = fastest(ours, error, figure)
            cells.append(named(own, figure) if figure == "cpu_ms" else f"{own[figure]:.3g}")
            cells += [f"{other['program']} {named(other)}" if other else "none"] if figure == "cpu_ms" else []
            cells.append(f"{other['cpu_ms'] / own[figure]:.2g}" if own and other else "")
        text += f"| {' | '.join(cells)} |\n"
    return text


def all_lines(found):
    """The page docs/performance/peers.md."""
    others = ", ".join(f"{name} {version}" for name, version in sorted(found["versions"].items()) if name != "flexarm")
    text = "# All lines of the comparison with other programs\n\nWritten by `python3 tools/peers.py --write`; [performance](../performance.md#against-other-programs) has the best lines at equal error.\n\n"
    text += "![Error against CPU time](work_precision.svg)\n\n"
    text += f"Measured on {found['date']}, {found['machine']}; {others or 'no other program'}; minimum of {found['repeat']} runs in turn. CPU ms per simulated second.\n\n"
    text += f"{found['note']}\n\n" if "note" in found else ""
    text += "| program | stepper | step | error | a run | sampled | a process |\n| --- | --- | --- | --- | --- | --- | --- |\n"
    for line in found["lines"]:
        error = "unstable" if line["error"] is None else f"{line['error']:.1e}"
        times = [f"{line[figure]:.3g}" if figure in line else "" for figure in ("cpu_ms", "sampled_ms", "process_ms")]
        text += f"| {line['program']} | {line['stepper']} | {told_step(line)} | {error} | {' | '.join(times)} |\n"
    return text


def pages(found):
    """What each page has of the stored numbers: file and whole text."""
    page = ROOT / "docs/performance.md"
    begin, end = "<!-- begin: tools/peers.py -->\n", "<!-- end: tools/peers.py -->\n"
    before, _, rest = page.read_text().partition(begin)
    after = rest.partition(end)[2]
    return {
        page: f"{before}{begin}\n{comparison(found)}\n{end}{after}",
        STORE / "peers.md": all_lines(found),
        STORE / "work_precision.svg": picture(found),
    }


COLORS = ["#0b6e4f", "#3a7ca5", "#7a5195", "#8d99ae", "#2f4858", "#d1495b", "#edae49", "#e07a5f", "#6c584c"]


def picture(found):
    """Error over CPU time, both logarithmic, a line per stepper."""
    series = {}
    for line in found["lines"]:
        if line["error"]:
            series.setdefault((line["program"], line["stepper"]), []).append((line["error"], line["cpu_ms"]))
    width, height, left, right, top, bottom = 760, 470, 70, 215, 20, 50
    decades = lambda values: (math.floor(math.log10(min(values))), math.ceil(math.log10(max(values))))
    points = [point for line in series.values() for point in line]
    (x0, x1), (y0, y1) = decades([e for e, _ in points]), decades([c for _, c in points])
    X = lambda e: left + (math.log10(e) - x0) / (x1 - x0) * (width - left - right)
    Y = lambda c: height - bottom - (math.log10(c) - y0) / (y1 - y0) * (height - top - bottom)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">',
           f'<rect width="{width}" height="{height}" fill="#ffffff"/>']
    for k in range(x0, x1 + 1):
        out.append(f'<path d="M{X(10**k):.1f} {top}V{height - bottom}" stroke="#dddddd"/><text x="{X(10**k):.1f}" y="{height - bottom + 18}" text-anchor="middle">1e{k}</text>')
    for k in range(y0, y1 + 1):
        out.append(f'<path d="M{left} {Y(10**k):.1f}H{width - right}" stroke="#dddddd"/><text x="{left - 8}" y="{Y(10**k) + 4:.1f}" text-anchor="end">{10.0**k:g}</text>')
    out.append(f'<text x="{(left + width - right) / 2}" y="{height - 12}" text-anchor="middle">error over the peak deflection</text>')
    out.append(f'<text transform="translate(18 {(top + height - bottom) / 2}) rotate(-90)" text-anchor="middle">CPU ms per simulated second</text>')
    for number, ((program, stepper), line) in enumerate(series.items()):
        color, dashed = COLORS[number % len(COLORS)], "" if program == "flexarm" else ' stroke-dasharray="6 3"'
        line.sort()
        path = "M" + "L".join(f"{X(e):.1f} {Y(c):.1f}" for e, c in line)
        out.append(f'<path d="{path}" fill="none" stroke="{color}" stroke-width="2"{dashed}/>')
        out += [f'<circle cx="{X(e):.1f}" cy="{Y(c):.1f}" r="3" fill="{color}"/>' for e, c in line]
        y = top + 14 + 20 * number
        out.append(f'<path d="M{width - right + 12} {y - 4}h22" stroke="{color}" stroke-width="2"{dashed}/><text x="{width - right + 40}" y="{y}">{program} {stepper}</text>')
    return "\n".join(out) + "\n</svg>\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="store numbers, table and picture")
    parser.add_argument("--draw", action="store_true", help="table and picture from the stored numbers")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--flexarm", default=str(TARGET / "release" / "flexarm"), help="the program")
    parser.add_argument("--prepared", default=str(TARGET / "release" / "examples" / "prepared_runs"), help="the example")
    arguments = parser.parse_args()
    if arguments.draw:
        found = json.loads((STORE / "peers.json").read_text())
    else:
        for program in (arguments.flexarm, arguments.prepared):
            if not Path(program).exists():
                sys.exit(f"there is no program {program}: cargo build --release --bins --examples, or --flexarm and --prepared")
        found = measure(arguments.flexarm, arguments.prepared, arguments.repeat)
    print(comparison(found))
    if arguments.write or arguments.draw:
        (STORE / "peers.json").write_text(json.dumps(found, indent=1) + "\n")
        for path, text in pages(found).items():
            path.write_text(text)


if __name__ == "__main__":
    inside()
    main()
