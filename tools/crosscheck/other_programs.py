"""Compares one arm and motion in Pinocchio, Exudyn, MuJoCo and flexarm: curves and CPU times.

    cargo build --release -p flexarm-cli --no-default-features --features mcap
    python tools/crosscheck/other_programs.py            # pip install pin exudyn mujoco numpy scipy; seven minutes
    python tools/crosscheck/other_programs.py --write    # also replaces the two files in tests/verification/

Robot: robots/kr210/links.toml, two links of two rigid parts each with one elastic joint between
them, full 6x6. Two things are changed in every program, including flexarm, since not every program
supports them: the damping is D = beta K (3 % for the first mode at the start of pick_and_place),
and the angles of the elastic joints are Z-Y-X Euler angles. Each program starts from its own
equilibrium.

Truth: hybrid dynamics by Pinocchio (joints given, elastic coordinates e free), e'' = M_ee^-1 (-K e
- beta K e' - h_e), integrated by scipy's DOP853 at rtol 1e-12, restarted at the knots of the
motion. Errors are TCP differences from it, every 2 ms (every step if that is longer), over the peak
deflection of the flexible arm from the rigid one.

Exudyn: one ObjectKinematicTree (minimal coordinates, the same ones), K and D by ObjectGenericODE2
on its node, the six joints by CoordinateConstraint with compiled functions of time (symbolic: no
Python during the run). The same in redundant coordinates is another model: the torque of a
RigidBodySpringDamper is K times Tait-Bryan angles, not their generalised force. The relative
difference of the sag is 3.2e-4, and a tenth of that with springs ten times as stiff: terms of
second order in the deflection.

MuJoCo: slides x, y, z and hinges z, y, x on one body. K = sum_k s_k l_k l_k^T (Cholesky), so that
six fixed tendons with coefficients l_k, stiffness s_k and damping beta s_k give K and D exactly. It
has no joints with prescribed motion: each gets an armature of 1e18 kg m2 and a motor with the
torque for the wanted acceleration. The load then moves it by less than 1e-12 rad, and a sequence of
accelerations whose steps add up to the motion makes feedback unnecessary. (discrete: 1e12 and 1e-7
rad.) The maximum error of the joints is in the notes. implicitfast treats D implicitly, but not K:
unstable here beyond 1.75 ms. discrete is backward Euler.

CPU: process time on one thread, the minimum of three runs. Exudyn: SolveDynamic. MuJoCo: rollout,
which steps in C. flexarm: the time that `compare --no-files` reports: steps, rigid twin, samples
and figures, but not reading files. At large steps the samples cost as much as the steps, so the
notes also have the cost with few samples. Pinocchio: a loop in Python, not representative of
Pinocchio.
"""
import argparse
import hashlib
import json
import math
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"
sys.exudynFast = True              # its build without range checks

import exudyn as exu
import exudyn.itemInterface as item
import mujoco
import numpy as np
import pinocchio as pin
import scipy.linalg as sl
from exudyn.solver import ComputeODE2Eigenvalues
from exudyn.utilities import CreateSymbolicUserFunction, RigidBodyInertia
from mujoco import rollout
from scipy.integrate import solve_ivp

from arm_chain import Chain, Motion

ROOT = Path(__file__).parent.parent.parent
ROBOT = ROOT / "robots" / "kr210" / "links.toml"
STORED = ROOT / "tests" / "verification" / "other_programs.json"
CURVE = ROOT / "tests" / "verification" / "kr210_pick_and_place_pinocchio.csv"
DATE = "2026-11-21"
RATIO = 0.03                       # of the first mode at the start of pick_and_place
EVERY_S, CURVE_EVERY_S = 0.002, 0.010
REPEATS = 3
FEW_HZ = 10
# kg m2; the solver of discrete stops early with 1e18
ARMATURE = {"implicitfast": 1e18, "RK4": 1e18, "discrete": 1e12}
norm = lambda x: np.linalg.norm(x, axis=-1)


def cheapest(run, repeats=REPEATS):
    """Returns the result of the last run and the minimum CPU time."""
    best = math.inf
    for _ in range(repeats):
        *result, cpu = run()
        best = min(best, cpu)
    return *result, best


# ------------------------------------------------------------------------------------------- Pinocchio
class Hybrid:
    """The arm in Pinocchio, with the elastic coordinates in the order x y z rx ry rz per link."""

    def __init__(self, chain):
        self.model, self.rigid = pin.Model(), pin.Model()
        self.given, self.free, blocks = [], [], []
        parent = rigid_parent = 0
        # of the last body in that of the rigid twin
        held = pin.SE3.Identity()
        for model in (self.model, self.rigid):
            model.gravity.linear = chain.gravity
        for body in chain.bodies:
            inertia, held = pin.Inertia(*body.inertia()), held * body.X
            if body.axis is not None:
                parent = self.model.addJoint(parent, pin.JointModelRevoluteUnaligned(body.axis), body.X, body.name)
                self.given.append(self.model.joints[parent].idx_q)
                rigid_parent = self.rigid.addJoint(rigid_parent, pin.JointModelRevoluteUnaligned(body.axis), held, body.name)
                held = pin.SE3.Identity()
            else:
                parent = self.model.addJoint(parent, pin.JointModelTranslation(), body.X, body.name + "_t")
                first = self.model.joints[parent].idx_q
                parent = self.model.addJoint(parent, pin.JointModelSphericalZYX(), pin.SE3.Identity(), body.name + "_r")
                self.free += [first, first + 1, first + 2, first + 5, first + 4, first + 3]
                blocks.append(body.K)
            self.model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        self.K, self.n = sl.block_diag(*blocks), len(self.free)
        self.data, self.rigid_data = self.model.createData(), self.rigid.createData()
        self.tip, self.rigid_tip = (parent, chain.tcp), (rigid_parent, held.act(chain.tcp))
        self.block = np.ix_(self.free, self.free)

    def full(self, given, free=0.0):
        q = np.empty(self.model.nq)
        q[self.given], q[self.free] = given, free
        return q

    def mass(self, q):
        M = np.triu(pin.crba(self.model, self.data, q))
        return (M + np.triu(M, 1).T)[self.block]

    def gravity(self, q_a, e):
        return pin.computeGeneralizedGravity(self.model, self.data, self.full(q_a, e))[self.free].copy()

    def tangent(self, q_a, e, step=1e-5):
        """K plus the tangent of gravity; Pinocchio's own derivative omits dS/dq of the Z-Y-X
        joint."""
        columns = [(self.gravity(q_a, e + d) - self.gravity(q_a, e - d)) / (2 * step) for d in step * np.eye(self.n)]
        return self.K + np.column_stack(columns)

    def statics(self, q_a):
        e = np.zeros(self.n)
        for _ in range(20):
            e = e - np.linalg.solve(self.tangent(q_a, e), self.K @ e + self.gravity(q_a, e))
        return e

    def frequencies(self, q_a):
        e = self.statics(q_a)
        K = self.tangent(q_a, e)
        return np.sqrt(sl.eigh(0.5 * (K + K.T), self.mass(self.full(q_a, e)), eigvals_only=True)) / (2 * math.pi)

    def tcp(self, q_a, e):
        pin.forwardKinematics(self.model, self.data, self.full(q_a, e))
        return self.data.oMi[self.tip[0]].act(self.tip[1])

    def rigid_tcp(self, q_a):
        pin.forwardKinematics(self.rigid, self.rigid_data, q_a)
        return self.rigid_data.oMi[self.rigid_tip[0]].act(self.rigid_tip[1])

    def rates(self, t, y, motion, beta):
        e, e_dot = y[:self.n], y[self.n:]
        q_a, v_a, a_a = motion(t)
        q = self.full(q_a, e)
        bias = pin.rnea(self.model, self.data, q, self.full(v_a, e_dot), self.full(a_a))[self.free]
        return np.r_[e_dot, sl.cho_solve(sl.cho_factor(self.mass(q), check_finite=False), -self.K @ (e + beta * e_dot) - bias, check_finite=False)]

    def integrate(self, motion, beta, times, method, rtol):
        """Returns the elastic coordinates at the times."""
        atol = np.r_[np.full(self.n, 1e-4), np.full(self.n, 1e-2)] * rtol       # m and rad, per s
        y, out = np.r_[self.statics(motion(0.0)[0]), np.zeros(self.n)], np.empty((len(times), self.n))
        edges = np.r_[motion.knots, motion.t_end]
        for begin, end in zip(edges[:-1], edges[1:]):
            inside = (times >= begin - 1e-9) & (times <= end + 1e-9)
            asked = np.union1d(np.clip(times[inside], begin, end), [end])
            run = solve_ivp(self.rates, (begin, end), y, method=method, rtol=rtol, atol=atol, max_step=0.02, t_eval=asked, args=(motion, beta))
            assert run.success, run.message
            out[inside] = run.y[:self.n, np.searchsorted(asked, np.clip(times[inside], begin, end) - 1e-12)].T
            y = run.y[:, -1]
        return out

    def rk4(self, motion, beta, step):
        y, out = np.r_[self.statics(motion(0.0)[0]), np.zeros(self.n)], []
        f, steps = lambda t, y: self.rates(t, y, motion, beta), round(motion.t_end / step)
        start = time.process_time()
        for k in range(steps):
            out.append(y)
            t = k * step
            k1 = f(t, y)
            k2 = f(t + step / 2, y + step / 2 * k1)
            k3 = f(t + step / 2, y + step / 2 * k2)
            y = y + step / 6 * (k1 + 2 * k2 + 2 * k3 + f(t + step, y + step * k3))
        cpu = time.process_time() - start
        return np.array([*out, y])[:, :self.n], cpu / motion.t_end

    def curve(self, motion, times, e):
        return np.array([self.tcp(motion(t)[0], x) for t, x in zip(times, e)])


# ---------------------------------------------------------------------------------------------- Exudyn
KEEP = []                          # Exudyn does not keep user functions alive


def exudyn_motion(motion, joint):
    """Angle and speed of a joint as expressions of t. A tree of conditions selects the piece; a sum
    over all pieces would take twice as long."""
    pieces = [(float(knot), [float(x) for x in c[:, joint]]) for knot, c in zip(motion.knots, motion.pieces)]

    def at(t, piece, low, high):
        if high - low == 1:
            knot, c = pieces[low]
            return piece(t - knot, c)
        middle = (low + high) // 2
        return exu.symbolic.IfThenElse(t < pieces[middle][0], at(t, piece, low, middle), at(t, piece, middle, high))

    angle = lambda s, c: c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5]))))
    speed = lambda s, c: c[1] + s * (2 * c[2] + s * (3 * c[3] + s * (4 * c[4] + s * (5 * c[5]))))
    return lambda t: at(t, angle, 0, len(pieces)), lambda t: at(t, speed, 0, len(pieces))


def exudyn_drive(mbs, constraint, motion, joint, vector=False):
    """vector: the constraint has six rows, the last of which is the joint's."""
    def value(f):
        return (lambda mbs, t, itemNumber, lOffset: [0.0 * t] * 5 + [f(t)]) if vector else (lambda mbs, t, itemNumber, lOffset: f(t))

    for key, f in zip(("offsetUserFunction", "offsetUserFunction_t"), exudyn_motion(motion, joint)):
        KEEP.append(CreateSymbolicUserFunction(mbs, value(f), key, constraint))
        mbs.SetObjectParameter(constraint, key, KEEP[-1])


def exudyn_tree(chain, motion, beta):
    """Minimal coordinates: system, TCP sensor, indices of the prescribed coordinates."""
    turns = (exu.JointType.RevoluteX, exu.JointType.RevoluteY, exu.JointType.RevoluteZ)
    slides = (exu.JointType.PrismaticX, exu.JointType.PrismaticY, exu.JointType.PrismaticZ)
    nothing = (0.0, np.zeros(3), np.zeros((3, 3)))
    kinds, frames, offsets, bodies, given, springs = [], [], [], [], [], []

    def add(kind, X, body):
        kinds.append(kind), frames.append(X.rotation), offsets.append(X.translation), bodies.append(body)

    for body in chain.bodies:
        if body.axis is not None:
            given.append(len(kinds))
            axis = int(np.argmax(body.axis))
            assert np.abs(body.axis - np.eye(3)[axis]).max() == 0
            add(turns[axis], body.X, body.inertia())
        else:
            first = len(kinds)
            for i, kind in enumerate((*slides, *turns[::-1])):
                add(kind, body.X if i == 0 else pin.SE3.Identity(), body.inertia() if i == 5 else nothing)
            springs.append(([first, first + 1, first + 2, first + 5, first + 4, first + 3], body.K))
    n = len(kinds)
    start = np.zeros(n)
    start[given] = motion.start
    mbs = exu.SystemContainer().AddSystem()
    node = mbs.AddNode(item.NodeGenericODE2(numberOfODE2Coordinates=n, referenceCoordinates=[0.0] * n, initialCoordinates=start.tolist(),
                                            initialCoordinates_t=[0.0] * n))
    tree = mbs.AddObject(item.ObjectKinematicTree(
        nodeNumber=node, jointTypes=kinds, linkParents=list(range(-1, n - 1)), jointTransformations=exu.Matrix3DList(frames),
        jointOffsets=exu.Vector3DList(offsets), linkMasses=[b[0] for b in bodies], linkCOMs=exu.Vector3DList([b[1] for b in bodies]),
        linkInertiasCOM=exu.Matrix3DList([b[2] for b in bodies]), gravity=chain.gravity))
    K = np.zeros((n, n))
    for rows, block in springs:
        K[np.ix_(rows, rows)] = block
    mbs.AddObject(item.ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.zeros((n, n)), stiffnessMatrix=K, dampingMatrix=beta * K))
    ground = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(item.NodePointGround()), coordinate=0))
    for joint, coordinate in enumerate(given):
        marker = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        exudyn_drive(mbs, mbs.AddObject(item.CoordinateConstraint(markerNumbers=[ground, marker])), motion, joint)
    sensor = mbs.AddSensor(item.SensorKinematicTree(objectNumber=tree, linkNumber=n - 1, localPosition=chain.tcp, storeInternal=True,
                                                    outputVariableType=exu.OutputVariableType.Position))
    return mbs, sensor, given


def exudyn_bodies(chain, motion, beta):
    """Redundant coordinates: rigid bodies, GenericJoint and RigidBodySpringDamper, assembled in the
    start pose."""
    mbs = exu.SystemContainer().AddSystem()
    before, centre, place, joint = mbs.CreateGround(), np.zeros(3), pin.SE3.Identity(), 0
    for body in chain.bodies:
        mass, com, inertia = body.inertia()
        place = place * body.X
        if body.axis is not None:
            place = place * pin.SE3(pin.exp3(body.axis * motion.start[joint]), np.zeros(3))
        number = mbs.CreateRigidBody(inertia=RigidBodyInertia(mass, inertia), referencePosition=place.act(com), referenceRotationMatrix=place.rotation,
                                     nodeType=exu.NodeType.RotationEulerParameters, gravity=chain.gravity)
        near = mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=before, localHT=exu.HT(rotation=body.X.rotation, translation=body.X.translation - centre)))
        far = mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=number, localPosition=-com))
        if body.axis is not None:
            assert np.abs(body.axis - [0, 0, 1]).max() == 0
            exudyn_drive(mbs, mbs.AddObject(item.GenericJoint(markerNumbers=[near, far], constrainedAxes=[1] * 6)), motion, joint, vector=True)
            joint += 1
        else:
            mbs.AddObject(item.RigidBodySpringDamper(markerNumbers=[near, far], stiffness=body.K, damping=beta * body.K))
        before, centre = number, com
    return mbs, mbs.AddSensor(item.SensorBody(bodyNumber=before, localPosition=chain.tcp - centre, storeInternal=True,
                                              outputVariableType=exu.OutputVariableType.Position)), None


def exudyn_at_rest(build, chain, motion, beta):
    """Returns the arm at rest at t = 0: system, sensor, settings, indices of the prescribed
    coordinates."""
    mbs, sensor, given = build(chain, motion, beta)
    mbs.Assemble()
    s = exu.SimulationSettings()
    s.solution.file.write = False
    s.parallel.numberOfThreads = 1
    s.linearSolver.solverType = exu.LinearSolverType.EXUdense
    s.staticSolver.newton.relativeTolerance = 1e-10
    s.staticSolver.newton.absoluteTolerance = 1e-12
    # statics use a pseudo time, and the joints move with time
    s.staticSolver.loadStepDuration = 1e-9
    mbs.SolveStatic(s, updateInitialValues=True)
    return mbs, sensor, s, given


def run_exudyn(build, chain, motion, beta, step, every):
    """Returns times, positions, CPU seconds of the integration per simulated second."""
    mbs, sensor, s, _ = exudyn_at_rest(build, chain, motion, beta)
    s.solution.sensors.writePeriod = every
    s.timeIntegration.numberOfSteps = round(motion.t_end / step)
    s.timeIntegration.endTime = motion.t_end
    s.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    s.timeIntegration.newton.useModifiedNewton = True
    start = time.process_time()
    mbs.SolveDynamic(s)
    cpu = time.process_time() - start
    data = mbs.GetSensorStoredData(sensor)
    KEEP.clear()
    return data[:, 0], data[:, 1:4], cpu / motion.t_end


def exudyn_frequencies(chain, motion, beta):
    mbs, _, s, given = exudyn_at_rest(exudyn_tree, chain, motion, beta)
    return np.sort(ComputeODE2Eigenvalues(mbs, s, constrainedCoordinates=given, convert2Frequencies=True, ignoreAlgebraicEquations=True)[0])


# ---------------------------------------------------------------------------------------------- MuJoCo
class MuJoCo:
    def __init__(self, chain, beta, step, integrator):
        text, tendons, motors, armature = "", "", "", ARMATURE[integrator]
        words = lambda a: " ".join(f"{x:.17g}" for x in np.ravel(a))
        given, free = [], []
        for body in chain.bodies:
            mass, com, I = body.inertia()
            quaternion = pin.Quaternion(body.X.rotation).normalized()
            text += (f'<body pos="{words(body.X.translation)}" quat="{words([quaternion.w, quaternion.x, quaternion.y, quaternion.z])}">'
                     f'<inertial mass="{mass:.17g}" pos="{words(com)}" fullinertia="{words([I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]])}"/>')
            if body.axis is not None:
                given.append(body.name)
                text += f'<joint name="{body.name}" type="hinge" axis="{words(body.axis)}" armature="{armature:g}"/>'
                motors += f'<motor joint="{body.name}" gear="{armature:g}"/>'
                continue
            names = [f"{body.name}_{c}" for c in ("x", "y", "z", "rx", "ry", "rz")]
            free += names
            for k in (0, 1, 2, 5, 4, 3):
                text += f'<joint name="{names[k]}" type="{"slide" if k < 3 else "hinge"}" axis="{words(np.eye(3)[k % 3])}"/>'
            L = np.linalg.cholesky(body.K)
            for k in range(6):
                s = L[k, k] ** 2
                terms = "".join(f'<joint joint="{names[i]}" coef="{L[i, k] / L[k, k]:.17g}"/>' for i in range(k, 6))
                tendons += f'<fixed springlength="0 0" stiffness="{s:.17g}" damping="{beta * s:.17g}">{terms}</fixed>'
        text += f'<site name="tcp" pos="{words(chain.tcp)}"/>' + "</body>" * len(chain.bodies)
        self.model = mujoco.MjModel.from_xml_string(f"""<mujoco><compiler angle="radian" balanceinertia="false"/>
<option timestep="{step!r}" integrator="{integrator}" gravity="{words(chain.gravity)}"><flag contact="disable"/></option>
<worldbody>{text}</worldbody><tendon>{tendons}</tendon><actuator>{motors}</actuator></mujoco>""")
        self.data = mujoco.MjData(self.model)
        self.step, self.integrator = step, integrator
        self.given, self.free = ([self.model.joint(n).qposadr[0] for n in names] for names in (given, free))

    def force(self, e):
        """Static force of springs and gravity on the elastic coordinates."""
        self.data.qpos[self.free] = e
        mujoco.mj_forward(self.model, self.data)
        return (self.data.qfrc_passive - self.data.qfrc_bias)[self.free]

    def tangent(self, e, step=1e-5):
        return -np.column_stack([(self.force(e + d) - self.force(e - d)) / (2 * step) for d in step * np.eye(len(e))])

    def rest(self, q_a):
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self.given] = q_a
        e = np.zeros(len(self.free))
        for _ in range(8):
            e = e + np.linalg.solve(self.tangent(e), self.force(e))
        self.force(e)
        return e

    def frequencies(self, q_a):
        e = self.rest(q_a)
        K = self.tangent(e)
        self.force(e)
        M = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, M)
        return np.sqrt(sl.eigh(0.5 * (K + K.T), M[np.ix_(self.free, self.free)], eigvals_only=True)) / (2 * math.pi)

    def accelerations(self, motion):
        """Accelerations per step and joint with which the integrator follows the motion."""
        times = np.arange(round(motion.t_end / self.step) + 2) * self.step
        q, v, a, _ = motion.many(times)
        # q+ = q + h (v + v+)/2: speeds minus the resulting error in q
        if self.integrator == "RK4":
            j = np.gradient(a, self.step, axis=0)
            j[0] = 0
            w = v - self.step**2 / 12 * j
        else:                                 # q+ = q + h v+
            w = np.vstack([0 * q[:1], np.diff(q, axis=0) / self.step])
        return (np.diff(w, axis=0) / self.step)[:-1], q[:-1]

    def run(self, motion, every):
        """Returns times, positions, CPU per simulated second, joint error; None for positions if it
        diverged."""
        m, d = self.model, self.data
        control, wanted = self.accelerations(motion)
        self.rest(motion.start)
        state = np.zeros(mujoco.mj_stateSize(m, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        mujoco.mj_getState(m, d, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        start = time.process_time()
        states, _ = rollout.rollout(m, d, state[None], control[None])
        cpu = (time.process_time() - start) / motion.t_end
        q = np.vstack([state[1:1 + m.nq], states[0, :, 1:1 + m.nq]])
        if not np.isfinite(q).all() or np.abs(q[:, self.free]).max() > 0.1:
            return None, None, math.nan, cpu
        stride = round(every / self.step)
        return np.arange(len(q))[::stride] * self.step, self.positions(q[::stride]), np.abs(q[:, self.given] - wanted).max(), cpu

    def positions(self, q):
        out = []
        for x in q:
            self.data.qpos[:] = x
            mujoco.mj_kinematics(self.model, self.data)
            out.append(self.data.site("tcp").xpos.copy())
        return np.array(out)

    def run_exact(self, motion, every):
        """RK4 with the acceleration at each of its stages, by a Python function: too slow for
        timing."""
        m, d = self.model, self.data
        stages = motion.many(np.arange(2 * round(motion.t_end / self.step) + 2) * self.step / 2)[2]
        self.rest(motion.start)
        stride, q = round(every / self.step), []

        def control(model, data):
            data.ctrl[:] = stages[round(data.time * 2 / self.step)]

        mujoco.set_mjcb_control(control)
        try:
            for _ in range(round(motion.t_end / every)):
                q.append(d.qpos.copy())
                mujoco.mj_step(m, d, nstep=stride)
            q.append(d.qpos.copy())
        finally:
            mujoco.set_mjcb_control(None)
        times = np.arange(len(q)) * every
        return times, self.positions(q), np.abs(np.array(q)[:, self.given] - motion.many(times)[0]).max()


# --------------------------------------------------------------------------------------------- flexarm
class Flexarm:
    def __init__(self, program, folder, beta, angles):
        self.program, self.folder = Path(program).resolve(), folder / angles
        shutil.copytree(ROBOT.parent, self.folder)
        text = ROBOT.read_text()
        damping = "damping = { modal = 0.03 }"
        assert text.count(damping) == 2
        self.robot = self.folder / "robot.toml"
        self.robot.write_text(text.replace(damping, f'damping = {{ stiffness_beta = {beta!r} }}\nangles = "{angles}"'))

    def json(self, *words):
        done = subprocess.run([self.program, *map(str, words), "--json", "--quiet"], capture_output=True, text=True)
        if done.returncode:
            if "unstable" in done.stderr:
                return done.stderr
            sys.exit(f"flexarm {' '.join(map(str, words))}:\n{done.stderr}{done.stdout}")
        return json.loads(done.stdout)

    def frequencies(self, q_a):
        return self.json("modes", self.robot, "--at", ",".join(repr(float(x)) for x in q_a))["undamped_frequencies_hz"]

    def run(self, trajectory, step, every, *words, repeats=REPEATS):
        """Returns times, rigid and flexible positions, CPU, CPU with few samples; the message if
        the step is refused."""
        words = ["compare", self.robot, trajectory, "--step", step, *words]
        out = self.folder / "run"
        done = self.json(*words, "--log-rate", round(1 / every), "-o", out, "--force")
        if isinstance(done, str):
            return done
        table = np.genfromtxt(out / "run.csv", delimiter=",", names=True)
        shutil.rmtree(out)
        cost = lambda rate: min(self.json(*words, "--no-files", "--log-rate", rate)["cpu_s_per_simulated_s"] for _ in range(repeats))
        column = lambda arm: np.column_stack([table[f"{arm}_{c}_m"] for c in "xyz"])
        return table["time"], column("rigid"), column("flexible"), cost(round(1 / every)), cost(FEW_HZ)


# ------------------------------------------------------------------------------------------ the table
def digits(x, n=6):
    if isinstance(x, (list, tuple, np.ndarray)):
        return [digits(y, n) for y in x]
    return None if x is None or not math.isfinite(x) else float(f"{x:.{n}g}")


def written(x, depth=0):
    """JSON with one line for values without objects."""
    flat = lambda x: not isinstance(x, dict) and not (isinstance(x, list) and any(isinstance(y, (dict, list)) for y in x))
    if flat(x) or (depth > 2 and isinstance(x, dict)):
        return json.dumps(x)
    inner, outer = "\n" + " " * (depth + 1), "\n" + " " * depth
    if isinstance(x, dict):
        return "{" + inner + ("," + inner).join(f"{json.dumps(k)}: {written(v, depth + 1)}" for k, v in x.items()) + outer + "}"
    return "[" + inner + ("," + inner).join(written(v, depth + 1) for v in x) + outer + "]"


class Table:
    """Rows against the truth at multiples of EVERY_S."""

    def __init__(self, truth, deflection):
        self.truth, self.peak, self.rms, self.rows = truth, norm(deflection).max(), math.sqrt((norm(deflection) ** 2).mean()), []

    def add(self, program, method, step, times, p, cpu=None, note=""):
        row = dict(program=program, method=method, step_s=step)
        if p is not None:
            k = np.rint(np.asarray(times) / EVERY_S).astype(int)
            assert np.abs(np.asarray(times) - k * EVERY_S).max() < 1e-9 and k[-1] == len(self.truth) - 1
            d = p - self.truth[k]
            row |= dict(error_peak_rel=digits(norm(d).max() / self.peak), error_xyz_rel=digits(np.abs(d).max(axis=0) / self.peak),
                        error_rms_rel=digits(math.sqrt((norm(d) ** 2).mean()) / self.rms), sag_difference_m=digits(norm(d[0])))
        else:
            row |= dict(error_peak_rel=None, error_xyz_rel=None, error_rms_rel=None, sag_difference_m=None)
        self.rows.append(row | dict(cpu_s_per_s=digits(cpu, 3) if cpu is not None else None, note=note))
        show = lambda key: "-" if row[key] is None else f"{row[key]:.2e}"
        print(f"  {program:10} {method:44} {f'{step * 1e3:g} ms' if step else '-':>8}  error {show('error_peak_rel'):>9}  rms {show('error_rms_rel'):>9}"
              f"  sag {show('sag_difference_m'):>9} m  CPU {f'{cpu * 1e3:.3g} ms/s' if cpu is not None else '-':>10}  {note}", flush=True)


def extrapolated(runs, weights):
    """Extrapolates times and positions to zero step size; each run has half the step of the
    previous one."""
    times = runs[-1][0]
    assert len(runs) == len(weights) and all(np.abs(t - times).max() < 1e-9 for t, _ in runs)
    return times, sum(w * p for w, (_, p) in zip(weights, runs))


SECOND_ORDER = (-1 / 3, 4 / 3)              # eliminates h^2
FIRST_ORDER = (1 / 3, -2.0, 8 / 3)          # h and h^2


def compare(name, chain, hybrid, beta, soft, vector):
    """Runs all programs on one motion. soft: flexarm with Euler angles; vector: with rotation
    vectors."""
    path = ROOT / "trajectories" / f"{name}.toml"
    motion = Motion(path, chain.speed_limits)
    times = np.arange(round(motion.t_end / EVERY_S) + 1) * EVERY_S
    start = time.process_time()
    e = hybrid.integrate(motion, beta, times, "DOP853", 1e-12)
    cpu = (time.process_time() - start) / motion.t_end
    truth, rigid = hybrid.curve(motion, times, e), np.array([hybrid.rigid_tcp(motion(t)[0]) for t in times])
    table = Table(truth, truth - rigid)
    frequencies = {"Pinocchio": hybrid.frequencies(motion.start)}
    print(f"{name}: peak {table.peak * 1e3:.6f} mm, sag {norm(truth[0] - rigid[0]) * 1e3:.6f} mm, f {frequencies['Pinocchio'][:4]} Hz")
    python = "Python loop, one run"
    table.add("Pinocchio", "RNEA and CRBA, DOP853, rtol 1e-12", None, times, truth, cpu, f"the truth; {python}")
    other = hybrid.integrate(motion, beta, times, "Radau", 1e-9)
    table.add("Pinocchio", "RNEA and CRBA, Radau, rtol 1e-9", None, times, hybrid.curve(motion, times, other), note="second integrator")
    rk4, cpu = hybrid.rk4(motion, beta, 2.5e-4)
    table.add("Pinocchio", "RNEA and CRBA, RK4", 2.5e-4, times, hybrid.curve(motion, times, rk4[::round(EVERY_S / 2.5e-4)]), cpu, python)

    # flexarm
    frequencies["flexarm"] = soft.frequencies(motion.start)
    alpha, plain = ["--stepper", "generalized-alpha"], ["--stepper", "generalized-alpha", "--no-dispersion-correction"]
    twin = 0.0

    def ours(arm, method, words, steps, note="", **more):
        nonlocal twin
        runs = []
        for step in steps:
            done = arm.run(path, step, max(step, EVERY_S), *words, **more)
            if isinstance(done, str):
                limit = re.search(r"needs a step below ([0-9.e-]+) s", done)[1]
                table.add("flexarm", method, step, None, None, note=f"refused: unstable, needs a step below {limit} s")
                continue
            t, stiff, p, cpu, few = done
            twin = max(twin, norm(stiff - rigid[np.rint(t / EVERY_S).astype(int)]).max())
            table.add("flexarm", method, step, t, p, cpu, "; ".join(filter(None, (note, f"{few * 1e3:.3g} ms/s at {FEW_HZ} samples/s"))))
            runs.append((t, p))
        return runs

    ours(soft, "generalised-alpha, dispersion corrected", alpha, (4e-3, 2e-3, 1e-3, 5e-4))
    runs = ours(soft, "generalised-alpha, plain", plain, (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4))
    table.add("flexarm", "the same, 0.5 and 0.25 ms extrapolated", None, *extrapolated(runs[-2:], SECOND_ORDER))
    spook = ["--stepper", "spook"]
    runs = ours(soft, "SPOOK, local", spook, (1e-3, 5e-4, 1e-4))[-1:] + ours(soft, "SPOOK, local", spook, (5e-5, 2.5e-5), "one run", repeats=1)
    table.add("flexarm", "the same, 0.1, 0.05, 0.025 ms extrapolated", None, *extrapolated(runs, FIRST_ORDER))
    ours(soft, "RK4", ["--stepper", "rk4"], (5e-4, 2.5e-4, 1.25e-4))
    for rtol in ("1e-7", "1e-9", "1e-11"):
        ours(soft, f"reference (BDF), rtol {rtol}", ["--stepper", "reference", "--rtol", rtol], (EVERY_S,), "steps of its own")
    ours(vector, "RK4, rotation vectors", ["--stepper", "rk4"], (1.25e-4,), "another model: angles of the elastic joints")

    # Exudyn
    frequencies["Exudyn"] = exudyn_frequencies(chain, motion, beta)
    for method, build, about in (("KinematicTree, generalised-alpha", exudyn_tree, ""),
                                 ("RigidBodySpringDamper, generalised-alpha", exudyn_bodies, "another model: its spring")):
        runs = []
        for step, repeats in ((4e-3, REPEATS), (2e-3, REPEATS), (1e-3, REPEATS), (5e-4, 1), (2.5e-4, 1)):
            t, p, cpu = cheapest(lambda: run_exudyn(build, chain, motion, beta, step, max(step, EVERY_S)), repeats)
            table.add("Exudyn", method, step, t, p, cpu, "; ".join(filter(None, (about, "one run" if repeats == 1 else ""))))
            runs.append((t, p))
        table.add("Exudyn", "the same, 0.5 and 0.25 ms extrapolated", None, *extrapolated(runs[-2:], SECOND_ORDER), note=about)

    # MuJoCo
    frequencies["MuJoCo"] = MuJoCo(chain, beta, 1e-3, "implicitfast").frequencies(motion.start)
    for integrator, steps in (("implicitfast", (2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4)), ("discrete", (4e-3, 2e-3, 1e-3, 5e-4)),
                              ("RK4", (5e-4, 2.5e-4, 1.25e-4))):
        runs = []
        for step in steps:
            arm = MuJoCo(chain, beta, step, integrator)
            t, p, slip, cpu = cheapest(lambda: arm.run(motion, max(step, EVERY_S)))
            table.add("MuJoCo", integrator, step, t, p, cpu if p is not None else None,
                      f"joints follow to {slip:.1e} rad" if p is not None else "unstable")
            runs.append((t, p))
        if integrator == "implicitfast":
            table.add("MuJoCo", "the same, 0.5, 0.25, 0.125 ms extrapolated", None, *extrapolated(runs[-3:], FIRST_ORDER))
    t, p, slip = MuJoCo(chain, beta, 1.25e-4, "RK4").run_exact(motion, EVERY_S)
    table.add("MuJoCo", "RK4, motion by a callback", 1.25e-4, t, p, note=f"joints follow to {slip:.1e} rad")

    for program, f in frequencies.items():
        print(f"  {program:10} {np.array(f)[:4]} Hz, against Pinocchio {np.abs(np.array(f)[:4] / frequencies['Pinocchio'][:4] - 1).max():.1e}")
    print(f"  rigid twins of flexarm and Pinocchio: {twin:.1e} m")
    result = dict(name=name, duration_s=motion.t_end, peak_m=digits(table.peak), rms_m=digits(table.rms), sag_m=digits(norm(truth[0] - rigid[0])),
                  rigid_difference_m=digits(twin), frequencies_hz=digits(frequencies["Pinocchio"][:4]),
                  frequencies_by_program_hz={k: digits(np.array(f)[:4], 9) for k, f in frequencies.items()}, rows=table.rows)
    return result, np.column_stack([times, rigid, truth])


def write_curve(rows, beta, f1):
    head = f"""\
# robots/kr210/links.toml on trajectories/pick_and_place.toml: converged motion of the TCP, joints exactly along the motion, start in equilibrium.
# Unlike robot.toml: damping = {{ stiffness_beta = {beta!r} }} (s; 3 % of the first mode at the start, {f1:.6f} Hz) and angles = "euler-zyx", both links.
# Pinocchio {pin.__version__} (RNEA, CRBA) with scipy's DOP853 at rtol 1e-12. Regenerate: tools/crosscheck/other_programs.py --write. Units m, s; world axes.
time,rigid_x,rigid_y,rigid_z,flexible_x,flexible_y,flexible_z
"""
    stride = round(CURVE_EVERY_S / EVERY_S)
    CURVE.write_text(head + "".join(f"{r[0]:.2f}," + ",".join(f"{x:.9f}" for x in r[1:]) + "\n" for r in rows[::stride]))


if __name__ == "__main__":
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("--program", default="target/release/flexarm", help="flexarm")
    ap.add_argument("--write", action="store_true", help="replace the stored files")
    ap.add_argument("--trajectories", default="pick_and_place,point_to_point")
    args = ap.parse_args()
    exu.config.printToConsole = False
    mujoco.set_mju_user_warning(lambda text: None)                # what blows up is in the table
    chain = Chain(ROBOT)
    hybrid = Hybrid(chain)
    f1 = hybrid.frequencies(Motion(ROOT / "trajectories" / "pick_and_place.toml", chain.speed_limits).start)[0]
    beta = digits(2 * RATIO / (2 * math.pi * f1))
    names, results = args.trajectories.split(","), []
    with tempfile.TemporaryDirectory() as folder:
        soft, vector = (Flexarm(args.program, Path(folder), beta, angles) for angles in ("euler-zyx", "rotation-vector"))
        for name in names:
            result, curve = compare(name, chain, hybrid, beta, soft, vector)
            results.append(result)
            if name == "pick_and_place" and args.write:
                write_curve(curve, beta, f1)
    digest = lambda path: hashlib.sha256(path.read_bytes()).hexdigest()
    cpu = next((l.split(":")[1].strip() for l in open("/proc/cpuinfo") if l.startswith("model name")), platform.processor())
    about = subprocess.run([args.program, "--version"], capture_output=True, text=True).stdout.split()
    stored = {
        "what": "TCP of robots/kr210/links.toml in four programs. Error: largest distance to the truth, over the peak deflection of the truth (peak_m, all axes alike);"
                " RMS over rms_m. CPU: process time per simulated second, one thread, smallest of three runs.",
        "script": "tools/crosscheck/other_programs.py", "date": DATE, "machine": f"{cpu}, {os.cpu_count()} cores",
        "versions": {"flexarm": about[-1], "exudyn": version("exudyn"), "mujoco": mujoco.__version__, "pinocchio": pin.__version__,
                     "scipy": version("scipy"), "numpy": np.__version__, "python": platform.python_version()},
        "model": {"damping_beta_s": beta, "first_mode_hz": digits(f1), "first_mode_ratio": RATIO, "angles": "euler-zyx",
                  "sha256": {str(p.relative_to(ROOT)): digest(p) for p in
                             [ROBOT, *chain.flex_files, *(ROOT / "trajectories" / f"{n}.toml" for n in names)]}},
        "trajectories": results}
    if args.write:
        STORED.write_text(written(stored) + "\n")
        print("written:", STORED.relative_to(ROOT), CURVE.relative_to(ROOT))
