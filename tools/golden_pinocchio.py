"""Writes tests/golden/{kr210,ur10_like,seven_axis,branched,scara}.json: dynamics of rigid robots by
Pinocchio.

    python tools/golden_pinocchio.py [NAME ...]          (pip install pin)

Models: robots/kr210/kr210.urdf, the others next to the JSON files; artificial, plausible numbers.
Rerunning writes the same files up to rounding. Before writing, the data are checked for
consistency: M q'' + bias = tau, forward dynamics back to q'', J' against central differences,
energy against the mass matrix.
"""
import json
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pinocchio as pin

ROOT = Path(__file__).parent.parent
MODELS = {  # name: (URDF, frame)
    "kr210": ("robots/kr210/kr210.urdf", "tool0"),
    "ur10_like": ("tests/golden/ur10_like.urdf", "tip"),
    "seven_axis": ("tests/golden/seven_axis.urdf", "tip"),
    "branched": ("tests/golden/branched.urdf", "tip"),
    "scara": ("tests/golden/scara.urdf", "tip"),
}
# joints that translate along their axis as they turn, m per turn
LEADS = {"scara": {"quill": 0.05}}
SEED, CASES = 20240607, 6
GRAVITY = [0.0, 0.0, -9.81]
FIELDS = {
    "q, qd, qdd": "joint positions, velocities, accelerations, in the order of `joints`; rad and m",
    "tau": "inverse dynamics of (q, qd, qdd); N m and N",
    "mass_matrix": "joint-space mass matrix; kg m2, kg m, kg",
    "nonlinear_effects": "inverse dynamics of (q, qd, 0): Coriolis, centrifugal and gravity",
    "gravity_torque": "inverse dynamics of (q, 0, 0)",
    "forward.tau, forward.qdd": "forward dynamics: qdd that tau gives at (q, qd); tau is drawn at random, not that of above",
    "frame.rotation": "R_WF, rows; p_W = R_WF p_F + translation",
    "frame.translation": "origin of the frame in the world, m",
    "jacobian": "6 x n, rows linear first: velocity of the frame's origin, angular velocity; world axes",
    "jacobian_rate": "time derivative of that jacobian along qd",
    "kinetic_energy, potential_energy": "J; potential energy is zero for masses at the height of the world origin; moving links only",
    "com": "centre of mass of the moving links in the world, m",
}


def rows(a):
    return [[float(x) + 0.0 for x in r] for r in np.atleast_2d(a)]


def row(a):
    return [float(x) + 0.0 for x in np.ravel(a)]


def jacobian(model, q, frame):
    data = model.createData()
    return pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)


def with_leads(model, urdf, leads):
    """Returns the model with helical instead of revolute joints, rebuilt joint by joint (URDF has
    no such joints)."""
    axes = {j.get("name"): np.array([float(x) for x in j.find("axis").get("xyz").split()])
            for j in ET.parse(urdf).getroot().iter("joint") if j.find("axis") is not None}
    made = pin.Model()
    for i in range(1, model.njoints):
        name, joint = model.names[i], model.joints[i]
        if name in leads:
            axis = axes[name] / np.linalg.norm(axes[name])
            joint = pin.JointModelHelicalUnaligned(axis, leads[name] / (2 * np.pi))
        limits = [a[model.joints[i].idx_v:][:1] for a in (model.effortLimit, model.velocityLimit, model.lowerPositionLimit,
                                                         model.upperPositionLimit)]
        j = made.addJoint(model.parents[i], joint, model.jointPlacements[i], name, *limits)
        made.appendBodyToJoint(j, model.inertias[i], pin.SE3.Identity())
    for frame in list(model.frames)[1:]:
        made.addFrame(pin.Frame(frame.name, frame.parentJoint, 0, frame.placement, frame.type), False)
    return made


def case(model, frame, rng):
    data = model.createData()
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    q = low + (high - low) * rng.uniform(0.1, 0.9, model.nq)
    qd, qdd = rng.uniform(-2, 2, model.nv), rng.uniform(-5, 5, model.nv)
    tau = pin.rnea(model, data, q, qd, qdd).copy()
    M = np.triu(pin.crba(model, data, q))
    M = M + np.triu(M, 1).T
    bias = pin.nonLinearEffects(model, data, q, qd).copy()
    gravity = pin.computeGeneralizedGravity(model, data, q).copy()
    some_tau = gravity + rng.uniform(-1, 1, model.nv) * (M @ np.full(model.nv, 3.0))
    some_qdd = pin.aba(model, data, q, qd, some_tau).copy()

    pin.computeJointJacobiansTimeVariation(model, data, q, qd)
    pin.updateFramePlacements(model, data)
    X = data.oMf[frame].copy()
    J = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED).copy()
    J_rate = pin.getFrameJacobianTimeVariation(model, data, frame, pin.LOCAL_WORLD_ALIGNED).copy()
    kinetic = pin.computeKineticEnergy(model, data, q, qd)
    potential = pin.computePotentialEnergy(model, data, q)
    com = pin.centerOfMass(model, data, q).copy()

    near = lambda a, b, tol: np.abs(a - b).max() <= tol * max(1.0, np.abs(b).max())
    assert near(M @ qdd + bias, tau, 1e-11) and near(M @ some_qdd + bias, some_tau, 1e-11)
    h = 1e-6
    assert near((jacobian(model, q + h * qd, frame) - jacobian(model, q - h * qd, frame)) / (2 * h), J_rate, 1e-7)
    assert near(J, jacobian(model, q, frame), 1e-13) and near(kinetic, 0.5 * qd @ M @ qd, 1e-12)
    moving = sum(i.mass for i in list(model.inertias)[1:])
    assert near(potential, moving * 9.81 * com[2], 1e-12)
    return dict(q=row(q), qd=row(qd), qdd=row(qdd), tau=row(tau), mass_matrix=rows(M), nonlinear_effects=row(bias),
                gravity_torque=row(gravity), forward=dict(tau=row(some_tau), qdd=row(some_qdd)),
                frame=dict(rotation=rows(X.rotation), translation=row(X.translation)), jacobian=rows(J),
                jacobian_rate=rows(J_rate), kinetic_energy=float(kinetic), potential_energy=float(potential), com=row(com))


def written(value, indent=1):
    """JSON with 17 significant digits and one line per innermost list."""
    if isinstance(value, float):
        return f"{value:.17g}" if value % 1 or abs(value) >= 1e15 else f"{value:.1f}"
    if isinstance(value, dict):
        inner = ",\n".join(" " * indent + f"{json.dumps(k)}: {written(v, indent + 1)}" for k, v in value.items())
        return "{\n" + inner + "\n" + " " * (indent - 1) + "}"
    if isinstance(value, list):
        if any(isinstance(v, (list, dict)) for v in value):
            return "[\n" + ",\n".join(" " * indent + written(v, indent + 1) for v in value) + "\n" + " " * (indent - 1) + "]"
        return "[" + ", ".join(written(v) for v in value) + "]"
    return json.dumps(value)


if __name__ == "__main__":
    for name, (urdf, frame) in MODELS.items():
        if sys.argv[1:] and name not in sys.argv[1:]:
            continue
        model = pin.buildModelFromUrdf(str(ROOT / urdf))
        leads = LEADS.get(name, {})
        if leads:
            model = with_leads(model, ROOT / urdf, leads)
        model.gravity.linear = np.array(GRAVITY)
        assert model.nq == model.nv, "a continuous joint would take two numbers in q"
        rng = np.random.default_rng(SEED)
        header = dict(
            tool="Pinocchio", version=pin.__version__, script="tools/golden_pinocchio.py",
            units="m, kg, s, rad, N, N m, J", ordering="linear first, angular second; world axes; quantities by joint in the order of `joints`",
            seed=SEED, fields=FIELDS)
        doc = dict(provenance=header, urdf=urdf, frame=frame, gravity=GRAVITY, joints=list(model.names)[1:],
                   moving_mass=float(sum(i.mass for i in list(model.inertias)[1:])),
                   cases=[case(model, model.getFrameId(frame), rng) for _ in range(CASES)])
        if leads:
            doc["leads"] = leads
        text = written(doc)
        assert json.loads(text) == doc                       # every digit is kept
        (ROOT / "tests" / "golden" / f"{name}.json").write_text(text + "\n")
        print(name, model.nv, "joints:", ", ".join(doc["joints"]))
