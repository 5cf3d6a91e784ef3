"""Compares modal links with floating-frame bodies of Exudyn on the reference arm.

    cargo build --release -p flexarm-cli --no-default-features --features mcap
    python tools/crosscheck/exudyn_ffrf.py                       # pip install exudyn ngsolve numpy scipy pin
    python tools/crosscheck/exudyn_ffrf.py --curved --size-mm 25 --program target/release/flexarm --keep out/exudyn

Both flexible links have the same meshes and the same motion in both programs. Each link is meshed
once as its hollow section (netgen, ten-node tetrahedra) with the density that gives its mass.
flexarm gets the mesh as a file: `reduce`, then `model = "modal"`. Exudyn gets it through NGSolve,
which assembles its own K and M, computes its own Hurty-Craig-Bampton modes (rigid ends, RBE2), and
runs its own ObjectFFRFreducedOrder with GenericJoint in redundant coordinates by generalised-alpha
with index 3 constraints. Only the nodes, the elements and the parameters are shared.

Prints frequencies of each reduced link held at A, and of the arm at home; sag; TCP difference over
4 s, relative to the peak deflection; CPU time per simulated second, one thread each. Converged
curves are compared: Exudyn at its two smallest steps, extrapolated to zero (its error is
proportional to the square of the step), and flexarm with its stepper with error control. Curved
elements also differ in the integration: NGSolve uses the rule of `reduce --quadrature calculix`,
flexarm otherwise an exact one.

Two properties of Exudyn's MarkerSuperElementRigid (1.13.6) are visible, both found by statics of
one link:
- Its `offset` shifts the point but not the moment of the force. The mean of an unstructured set of
  nodes misses the joint by 0.2 to 0.6 mm here, and the sag by 0.06 %. Weights whose centre is the
  joint need no offset: sag to 4e-8.
- A moment m on the marker enters the coordinates as J m instead of J^T m, with J the left Jacobian
  of the exponential map at the rotation vector of the interface. The difference is theta x m: zero
  for bending in one plane, of second order in space. The static solution is then not at the minimum
  of the energy (that of flexarm is, to all digits): 4e-4 of the deflection under lateral gravity.
  The remaining difference between the curves is of that kind: `--stiffer 10` reduces it from 5.6e-4
  of the peak to 3.3e-5.
"""
import argparse
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import exudyn as exu
import exudyn.itemInterface as item
import ngsolve
import numpy as np
import scipy.linalg as sl
from exudyn.FEM import FEMinterface, HCBstaticModeSelection, ObjectFFRFreducedOrderInterface
from exudyn.solver import ComputeODE2Eigenvalues
from exudyn.utilities import CreateSymbolicUserFunction, RigidBodyInertia
from netgen import csg, meshing

sys.path.insert(0, str(Path(__file__).parent.parent))
from golden_reference_arm import Motion
from robot_file import read_urdf, skew

ROOT = Path(__file__).parent.parent.parent
ROBOT = ROOT / "robots/test" / "reference_arm"
MOTION = ROOT / "trajectories" / "reference_arm.toml"
BETA = 0.0010536078174585805            # damping D = beta K of robots/test/reference_arm, s
TCP = ("link_6", np.array([0.2, 0.0, 0.0]))
GRAVITY = [0.0, 0.0, -9.81]
EVERY_S = 0.004

# The flexible links: B in link axes (A is the origin), joint there, E and nu
LINKS = {
    "link_2": dict(distal="joint_3", B=np.array([0.0, 0.0, 1.095]), E=70e9, nu=0.33),
    "link_4": dict(distal="joint_5", B=np.array([1.0, 0.0, 0.0]), E=210e9, nu=0.30),
}
# Nodes of a netgen tetrahedron (with opposite orientation) in the order of Abaqus
ABAQUS_ORDER = [1, 0, 2, 3, 4, 5, 7, 8, 6, 9]


# ---------------------------------------------------------------------------------------------
# meshes
def solid(name):
    """Box 160 x 120 mm along z, wall 10 mm; tube of 140 mm along x, wall 6 mm."""
    geometry = csg.CSGeometry()
    if name == "link_2":
        block = lambda x, y, z0, z1: csg.OrthoBrick(csg.Pnt(-x, -y, z0), csg.Pnt(x, y, z1))
        geometry.Add(block(0.08, 0.06, 0.0, 1.095) - block(0.07, 0.05, -1.0, 2.0))
    else:
        pipe = lambda radius: csg.Cylinder(csg.Pnt(-1, 0, 0), csg.Pnt(2, 0, 0), radius)
        plane = lambda x, way: csg.Plane(csg.Pnt(x, 0, 0), csg.Vec(way, 0, 0))
        geometry.Add((pipe(0.070) - pipe(0.064)) * plane(0, -1) * plane(1, 1))
    return geometry


def straight(mesh):
    """Returns the mesh without its geometry, so that mid-edge nodes are the means of their
    corners."""
    flat = meshing.Mesh(dim=3)
    for point in mesh.Points():
        flat.Add(meshing.MeshPoint(csg.Pnt(*point.p)))
    for k in range(max(e.index for e in mesh.Elements2D())):
        flat.Add(meshing.FaceDescriptor(surfnr=k + 1, domin=1, domout=0, bc=k + 1))
    for e in mesh.Elements2D():
        flat.Add(meshing.Element2D(e.index, list(e.vertices)))
    for e in mesh.Elements3D():
        flat.Add(meshing.Element3D(1, list(e.vertices)))
    return flat


def mesh_link(name, size, curved):
    mesh = solid(name).GenerateMesh(maxh=size)
    mesh = ngsolve.Mesh(mesh if curved else straight(mesh))
    return mesh


def write_inp(path, x, elements):
    with open(path, "w") as out:
        out.write("*NODE, NSET=all\n")
        out.writelines(f"{k + 1}, {p[0]!r}, {p[1]!r}, {p[2]!r}\n" for k, p in enumerate(x.tolist()))
        out.write("*ELEMENT, TYPE=C3D10, ELSET=body\n")
        out.writelines(f"{k + 1}, " + ", ".join(str(n + 1) for n in e) + "\n" for k, e in enumerate(elements.tolist()))


# ----------------------------------------------------------------------------------------------
# Exudyn
class ExudynLink:
    """A link's mesh in Exudyn, with its own K, M and modes."""

    def __init__(self, name, mass, size, curved, modes):
        self.link = LINKS[name]
        E, nu, B = self.link["E"], self.link["nu"], self.link["B"]
        start = time.process_time()
        self.fem = FEMinterface()
        mesh = mesh_link(name, size, curved)
        meshed = time.process_time()
        self.fem.ImportMeshFromNGsolve(mesh, density=1.0, youngsModulus=E, poissonsRatio=nu, meshOrder=2)
        M = self.fem.GetMassMatrix()
        self.density = mass / (M.sum() / 3)
        self.fem.ScaleMassMatrix(self.density)
        self.x = self.fem.GetNodePositionsAsArray()
        nodes = np.array([[p.nr - 1 for p in e.points] for e in mesh.ngmesh.Elements3D()])
        self.elements = nodes[:, ABAQUS_ORDER]
        corners = self.x[self.elements[:, :4]]
        assert np.linalg.det(corners[:, 1:] - corners[:, :1]).min() > 0
        along = B / np.linalg.norm(B)
        self.ends = [np.array(self.fem.GetNodesInPlane(list(p), list(along))) for p in (np.zeros(3), B)]
        self.fem.ComputeHurtyCraigBamptonModes(boundaryNodesList=[e.tolist() for e in self.ends], nEigenModes=modes,
                                               useSparseSolver=True, computationMode=HCBstaticModeSelection.RBE2, timerTreshold=10**9)
        reduced = time.process_time()
        self.cms = ObjectFFRFreducedOrderInterface(self.fem)
        self.cpu = dict(mesh=meshed - start, assembly_and_modes=reduced - meshed, integrals=time.process_time() - reduced)

    def frequencies(self):
        """Frequencies with A, the frame of this body, held."""
        omega2 = sl.eigh(self.cms.stiffnessMatrixReduced, self.cms.massMatrixReduced, eigvals_only=True)
        return np.sqrt(omega2) / (2 * math.pi)


def compiled(mbs, function, key, joint):
    made = CreateSymbolicUserFunction(mbs, function, key, joint)
    KEEP.append(made)
    mbs.SetObjectParameter(joint, key, made)


KEEP = []                                # Exudyn does not keep user functions alive


def drive(mbs, joint, axis, number, motion):
    """Adds the joint angle along the motion, compiled: quintic moves from rest to rest."""
    sym = exu.symbolic
    moves = [(start, T, float(way[number])) for start, T, way in motion.moves]
    first = float(motion.start[number])

    def clamp(u):
        return 0.5 * (sym.abs(u) - sym.abs(u - 1.0) + 1.0)

    def angle(t):
        q = first + 0.0 * t
        for start, T, way in moves:
            u = clamp((t - start) * (1.0 / T))
            q = q + way * u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
        return q

    def speed(t):
        v = 0.0 * t
        for start, T, way in moves:
            u = clamp((t - start) * (1.0 / T))
            v = v + (30.0 * way / T) * u * u * (1.0 - u) * (1.0 - u)
        return v

    axis = [float(a) for a in axis]

    def offset(mbs, t, itemNumber, lOffset):
        q = angle(t)
        return [0.0 * t, 0.0 * t, 0.0 * t, axis[0] * q, axis[1] * q, axis[2] * q]

    def offset_t(mbs, t, itemNumber, lOffset):
        v = speed(t)
        return [0.0 * t, 0.0 * t, 0.0 * t, axis[0] * v, axis[1] * v, axis[2] * v]

    compiled(mbs, offset, "offsetUserFunction", joint)
    compiled(mbs, offset_t, "offsetUserFunction_t", joint)


def centred(x, p):
    """Weights of the nodes x, nearly equal, with centre p, so that the marker needs no offset (see
    above)."""
    A, equal = np.vstack([np.ones(len(x)), 10 * (x - p).T]), np.full(len(x), 1 / len(x))
    w = equal + np.linalg.lstsq(A, np.array([1.0, 0.0, 0.0, 0.0]) - A @ equal, rcond=1e-10)[0]
    assert w.min() > 0
    return w


def equal(x, p):
    return np.full(len(x), 1 / len(x))


def exudyn_arm(links, motion, weights=centred, gravity=GRAVITY):
    """The arm at q = 0: all frames parallel to the world. Returns the system and the sensor of the
    TCP."""
    inertials, joints = read_urdf(ROBOT / "reference_arm.urdf")
    mbs = exu.SystemContainer().AddSystem()
    base = mbs.CreateGround()
    # marker at r of the last link
    tip = lambda r: mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=base, localPosition=r))
    here, number = np.zeros(3), 0
    for j in joints:
        assert j["type"] == "revolute" and np.abs(j["X"].rotation - np.eye(3)).max() == 0
        name, origin = j["child"], j["X"].translation
        here = here + origin
        near = tip(origin)
        if name in links:
            link = links[name]
            body = link.cms.AddObjectFFRFreducedOrder(mbs, positionRef=here.tolist(), gravity=gravity, stiffnessProportionalDamping=BETA)
            markers = [mbs.AddMarker(item.MarkerSuperElementRigid(
                bodyNumber=body["oFFRFreducedOrder"], meshNodeNumbers=end, weightingFactors=w, offset=(p - w @ link.x[end]).tolist()))
                for end, p in zip(link.ends, (np.zeros(3), link.link["B"])) for w in [weights(link.x[end], p)]]
            own = markers[0]

            def tip(r, at=markers[1], B=link.link["B"]):
                assert np.abs(r - B).max() == 0
                return at
        else:
            mass, com, inertia = inertials[name]
            body = mbs.CreateRigidBody(inertia=RigidBodyInertia(mass, inertia), referencePosition=here + com,
                                       nodeType=exu.NodeType.RotationEulerParameters, gravity=gravity)
            own = mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=body, localPosition=-com))

            def tip(r, body=body, com=com):
                return mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=body, localPosition=r - com))
        joint = mbs.AddObject(item.GenericJoint(markerNumbers=[near, own], constrainedAxes=[1] * 6))
        drive(mbs, joint, j["axis"], number, motion)
        number += 1
    assert name == TCP[0]
    sensor = mbs.AddSensor(item.SensorBody(bodyNumber=body, localPosition=TCP[1] - com, storeInternal=True,
                                           outputVariableType=exu.OutputVariableType.Position))
    mbs.Assemble()
    return mbs, sensor


def at_rest(links, motion, weights=centred, gravity=GRAVITY):
    """Returns the arm in static equilibrium at q = 0: system, sensor, settings."""
    mbs, sensor = exudyn_arm(links, motion, weights, gravity)
    s = exu.SimulationSettings()
    s.solution.file.write = False
    s.parallel.numberOfThreads = 1
    s.linearSolver.solverType = exu.LinearSolverType.EXUdense
    s.staticSolver.newton.relativeTolerance = 1e-10
    s.staticSolver.newton.absoluteTolerance = 1e-12
    # statics use a pseudo time, and the joints move with time
    s.staticSolver.loadStepDuration = 1e-9
    mbs.SolveStatic(s, updateInitialValues=True)
    return mbs, sensor, s


def run_exudyn(links, motion, step, weights=centred, every=EVERY_S, rho=0.9):
    """Returns TCP times and positions, and CPU seconds of the integration per simulated second."""
    mbs, sensor, s = at_rest(links, motion, weights)
    s.solution.sensors.writePeriod = every
    s.timeIntegration.numberOfSteps = round(motion.t_end / step)
    s.timeIntegration.endTime = motion.t_end
    s.timeIntegration.generalizedAlpha.spectralRadius = rho
    s.timeIntegration.newton.useModifiedNewton = True
    start = time.process_time()
    mbs.SolveDynamic(s)
    cpu = time.process_time() - start
    data = mbs.GetSensorStoredData(sensor)
    return data[:, 0], data[:, 1:4], cpu / motion.t_end


def exudyn_modes(links, motion):
    """Frequencies at home without gravity (Hz): Exudyn's eigenvalues omit the stiffness of
    constraint forces."""
    mbs, _, s = at_rest(links, motion, gravity=[0.0, 0.0, 0.0])
    values = ComputeODE2Eigenvalues(mbs, s, useSparseSolver=False, computeComplexEigenvalues=False, ignoreAlgebraicEquations=False)[0]
    return np.sqrt(np.abs(np.sort(values))) / (2 * math.pi)


# ---------------------------------------------------------------------------------------------
# flexarm
class Program:
    def __init__(self, path, folder):
        self.path, self.folder = Path(path).resolve(), folder

    def json(self, *words):
        done = subprocess.run([self.path, *map(str, words), "--json"], capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"flexarm {' '.join(map(str, words))}:\n{done.stderr}{done.stdout}")
        return json.loads(done.stdout)

    def reduce(self, name, link, modes):
        write_inp(self.folder / f"{name}.inp", link.x, link.elements)
        E, nu, B = link.link["E"], link.link["nu"], link.link["B"]
        along = B / np.linalg.norm(B)
        words = lambda v: ",".join(f"{x:g}" for x in v)
        start = os.times()
        answer = self.json("reduce", self.folder / f"{name}.inp", "--units", "m-kg-s", "--material", f"{E!r},{nu!r},{float(link.density)!r}",
                         "--interface", f"A=plane(0,0,0; {words(along)})", "--at", "A=0,0,0",
                         "--interface", f"B=plane({words(B)}; {words(along)})", "--at", f"B={words(B)}",
                         "--modes", modes, "--name", name, "--flex", self.folder / f"{name}.flex", "--force")
        end = os.times()
        return answer, end.children_user + end.children_system - start.children_user - start.children_system

    def robot(self, modes, file="robot.toml", gravity=GRAVITY):
        shutil.copy(ROBOT / "reference_arm.urdf", self.folder)
        text = f"""format = 1
name = "reference_arm_modal"
urdf = "reference_arm.urdf"
tcp = {{ link = "{TCP[0]}", xyz = {TCP[1].tolist()} }}
gravity = {gravity}
"""
        for name, link in LINKS.items():
            text += f"""
[[flexible_link]]
link = "{name}"
distal = "{link['distal']}"
reduced = "{name}.flex"
model = "modal"
modes = {modes}
damping = {{ stiffness_beta = {BETA!r} }}
"""
        (self.folder / file).write_text(text)
        return self.folder / file

    def frequencies(self, name):
        """Frequencies of the stored modal link held at A."""
        text = (self.folder / f"{name}.flex").read_text().split("[modal]")[1]
        matrix = {}
        for key in "KM":
            entries = np.array(eval(re.search(rf"^{key} = (\[.*?\])", text, re.M | re.S).group(1)))
            n = (math.isqrt(8 * len(entries) + 1) - 1) // 2
            A = np.zeros((n, n))
            A[np.tril_indices(n)] = entries
            matrix[key] = A + np.tril(A, -1).T
        return np.sqrt(sl.eigh(matrix["K"], matrix["M"], eigvals_only=True)) / (2 * math.pi)

    def curve(self, *words):
        out = self.folder / "run"
        self.json("compare", self.folder, MOTION, "--log-rate", 1 / EVERY_S, "-o", out, "--force", *words)
        lines = (out / "run.csv").read_text().splitlines()
        lines = [line for line in lines if not line.startswith("#")]
        table = np.genfromtxt(lines, delimiter=",", names=True)
        return table

    def cpu(self, repeat, *words):
        return min(self.json("compare", self.folder, MOTION, "--no-files", "--log-rate", 100, *words)["cpu_s_per_simulated_s"]
                   for _ in range(repeat))


# -------------------------------------------------------------------------------------------- the
# table
def largest(p, q):
    return np.linalg.norm(p - q, axis=1).max()


def rms(p, q):
    return np.sqrt((np.linalg.norm(p - q, axis=1)**2).mean())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=ROOT / "target" / "release" / "flexarm", help="flexarm to compare with")
    parser.add_argument("--size-mm", type=float, default=50.0, help="largest element edge")
    parser.add_argument("--curved", action="store_true", help="mid-edge nodes on the tube instead of on its chords (folds coarse elements: 25 mm or less)")
    parser.add_argument("--modes", type=int, default=8, help="fixed-interface modes of each link")
    parser.add_argument("--stiffer", type=float, default=1.0, help="multiplies E: what is of second order in the deflection falls by as much")
    parser.add_argument("--exudyn-ms", default="4,2,1,0.5", help="steps of Exudyn, falling")
    parser.add_argument("--flexarm-ms", default="4,2,1,0.5", help="steps of flexarm's generalised-alpha")
    parser.add_argument("--repeat", type=int, default=5, help="runs of flexarm for its least CPU time")
    parser.add_argument("--keep", type=Path, help="folder for meshes, links and curves (default: temporary)")
    args = parser.parse_args()
    exu.config.printToConsole = False
    exu.config.suppressWarnings = True
    motion = Motion(MOTION)
    for link in LINKS.values():
        link["E"] *= args.stiffer
    with tempfile.TemporaryDirectory() as temporary:
        folder = args.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        compare(args, motion, folder, Program(args.program, folder))


def compare(args, motion, folder, program):
    inertials, _ = read_urdf(ROBOT / "reference_arm.urdf")
    show = lambda values: " ".join(f"{v:.4f}" for v in values)
    links = {}
    for name in LINKS:
        links[name] = link = ExudynLink(name, inertials[name][0], args.size_mm / 1e3, args.curved, args.modes)
        answer, cpu = program.reduce(name, link, args.modes)
        ours, theirs = program.frequencies(name), link.frequencies()
        apart = np.abs(ours / theirs - 1)
        print(f"{name}: {len(link.x)} nodes, {len(link.elements)} elements, density {link.density:.4f} kg/m3, E {link.link['E']:.3g} Pa, nu {link.link['nu']}")
        print(f"  CPU s of Exudyn: {', '.join(f'{k} {v:.1f}' for k, v in link.cpu.items())}; of flexarm reduce: {cpu:.1f}")
        print(f"  held at A, Hz: flexarm {show(ours[:6])}; Exudyn {show(theirs[:6])}; largest relative difference of all {len(ours)}: {apart.max():.1e}", flush=True)
    program.robot(args.modes)

    weightless = program.robot(args.modes, "weightless.toml", [0.0, 0.0, 0.0])
    ours = [m["frequency_hz"] for m in program.json("modes", weightless, "--count", 40)["modes"] if m["damping_ratio"] < 1]
    theirs = exudyn_modes(links, motion)[:len(ours)]
    print(f"arm at home without weight, Hz: flexarm {show(ours)}\n                                 Exudyn {show(theirs)}\n"
          f"  largest relative difference {np.abs(ours / theirs - 1).max():.1e}")

    table = program.curve("--stepper", "reference", "--rtol", "1e-10")
    pick = lambda who: np.column_stack([table[f"{who}_{a}_m"] for a in "xyz"])
    rigid, truth = pick("rigid"), pick("flexible")
    deflection = np.linalg.norm(truth - rigid, axis=1)
    peak, spread = deflection.max(), np.sqrt((deflection**2).mean())
    print(f"sag at home: flexarm {deflection[0] * 1e3:.5f} mm; peak {peak * 1e3:.5f} mm at {table['time'][deflection.argmax()]:.3f} s; RMS {spread * 1e3:.5f} mm")

    for weights in (centred, equal):
        mbs, sensor, _ = at_rest(links, motion, weights)
        p = mbs.GetSensorValues(sensor)
        print(f"              Exudyn {np.linalg.norm(p - rigid[0]) * 1e3:.5f} mm ({weights.__name__} weights); difference of the vectors"
              f" {np.linalg.norm(p - truth[0]) * 1e9:.2f} nm = {np.linalg.norm(p - truth[0]) / deflection[0]:.1e}")

    steps = [float(s) * 1e-3 for s in args.exudyn_ms.split(",")]
    runs = {}
    for step in steps:
        t, p, cpu = run_exudyn(links, motion, step)
        assert len(t) == len(table) and np.abs(t - table["time"]).max() < 1e-9
        runs[step] = p, cpu
    h, half = steps[-2:]
    r = (h / half)**2
    limit = (r * runs[half][0] - runs[h][0]) / (r - 1)
    np.savetxt(folder / "curves.csv", np.column_stack([table["time"], rigid, truth, limit]), delimiter=",", header="time, rigid, flexarm, Exudyn, x y z each, m")
    print(f"\nconverged curves: largest difference {largest(limit, truth) * 1e9:.0f} nm = {largest(limit, truth) / peak:.2e} of the peak,"
          f" RMS {rms(limit, truth) / spread:.2e}\n")

    print("program, stepper, step | difference to the own converged curve | to the other's | CPU s per simulated s")
    for step in steps:
        p, cpu = runs[step]
        print(f"Exudyn FFRFreducedOrder, generalised-alpha, {step * 1e3:g} ms | {largest(p, limit) / peak:.2e} | {largest(p, truth) / peak:.2e} | {cpu:.4f}")
    for plain in ((), ("--no-dispersion-correction",)):
        for step in [float(s) * 1e-3 for s in args.flexarm_ms.split(",")]:
            words = ("--step", step, *plain)
            table = program.curve(*words)
            p, cpu = pick_from(table), program.cpu(args.repeat, *words)
            print(f"flexarm modal, generalised-alpha{', plain' if plain else ''}, {step * 1e3:g} ms | {largest(p, truth) / peak:.2e} | {largest(p, limit) / peak:.2e} | {cpu:.4f}", flush=True)


def pick_from(table):
    return np.column_stack([table[f"flexible_{a}_m"] for a in "xyz"])


if __name__ == "__main__":
    main()
