"""Writes tests/golden/closed_loops.json: closed-loop dynamics by Pinocchio.

    python tools/golden_loops.py          (pip install pin)

Constrained dynamics of the palletiser's URDF with three closed loops. The bars differ from those of
the shipped robot: two rods are shorter, so that no loop is a parallelogram. Loops are point
contacts between two links (pin.RigidConstraintModel, CONTACT_3D), the dynamics
pin.constraintDynamics. Before writing, the accelerations are checked against the equations with
multipliers in the plane of the loops, solved with numpy. Rerunning writes the same file up to
rounding.
"""
import json
from pathlib import Path

import numpy as np
import pinocchio as pin

ROOT = Path(__file__).parent.parent
URDF = "robots/palletiser/palletiser.urdf"
LOOPS = [  # name, link and point of the pin, link and point of the eye, dependent joints
    ("drive", "upper_arm", [-0.327660818, 0.0, -0.229430575], "drive_rod_bar", [0.0, 0.0, 1.17], ["elbow", "drive_rod"]),
    ("plate", "plate_body", [-0.261402519, 0.0, 0.100343026], "level_rod_bar", [0.0, 0.0, 1.25], ["plate", "level_rod"]),
    ("hand", "hand", [0.214492444, 0.0, 0.179980531], "hand_rod_bar", [1.31, 0.0, 0.0], ["wrist", "hand_rod"]),
]
DRIVEN = ["joint_1", "joint_2", "joint_3", "joint_4"]
SEED, CASES = 20261123, 8
GRAVITY = [0.0, 0.0, -9.81]


def number(model, name):
    return model.joints[model.getJointId(name)].idx_v


def gaps(model, data, q):
    """Vectors from pin to eye in the plane of the column, two numbers per loop, and their
    Jacobian."""
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    column = data.oMf[model.getFrameId("column")].rotation
    c, J = [], []
    for _, a, p, b, r, _ in LOOPS:
        ends = []
        for link, point in ((a, p), (b, r)):
            frame = model.getFrameId(link)
            X = data.oMf[frame]
            at = X.act(np.array(point))
            J6 = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            ends.append((at, J6[:3] + pin.skew(X.translation - at) @ J6[3:]))
        d, Jd = ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]
        c += list((column.T @ d)[[0, 2]])
        J += list((column.T @ Jd)[[0, 2]])
    return np.array(c), np.array(J)


def close(model, data, q, dependent):
    for _ in range(50):
        c, J = gaps(model, data, q)
        if np.abs(c).max() < 3e-15:
            break
        q[dependent] -= np.linalg.solve(J[:, dependent], c)
    assert np.abs(gaps(model, data, q)[0]).max() < 1e-13
    return q


def multipliers(model, data, q, v, tau):
    """[M J'; J 0] [a; -f] = [tau - h; -J' v], with the rate of J by a five-point difference."""
    J, h = gaps(model, data, q)[1], 1e-3
    rate = lambda s: gaps(model, data, q + s * h * v)[1] @ v
    Jdot_v = (rate(-2) - 8 * rate(-1) + 8 * rate(1) - rate(2)) / (12 * h)
    M = pin.crba(model, data, q).copy()
    M = np.triu(M) + np.triu(M, 1).T
    n, m = len(q), len(J)
    A = np.block([[M, J.T], [J, np.zeros((m, m))]])
    b = np.concatenate([tau - pin.nonLinearEffects(model, data, q, v), -Jdot_v])
    return np.linalg.solve(A, b)[:n]


def main():
    model = pin.buildModelFromUrdf(str(ROOT / URDF))
    model.gravity.linear = np.array(GRAVITY)
    data = model.createData()
    driven = [number(model, j) for j in DRIVEN]
    dependent = [number(model, j) for loop in LOOPS for j in loop[5]]
    contacts, contact_data = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for _, a, p, b, r, _ in LOOPS:
        ends = []
        for link, point in ((a, p), (b, r)):
            frame = model.frames[model.getFrameId(link)]
            ends += [frame.parentJoint, frame.placement * pin.SE3(np.eye(3), np.array(point))]
        contacts.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, *ends, pin.LOCAL))
    contact_data.extend([c.createData() for c in contacts])
    pin.initConstraintDynamics(model, data, contacts, contact_data)
    rng, cases, worst = np.random.default_rng(SEED), [], 0.0
    for _ in range(CASES):
        q = np.zeros(model.nq)
        start = np.array([rng.uniform(-2, 2), rng.uniform(-0.3, 0.6), rng.uniform(0.2, 0.9), rng.uniform(-3, 3)])
        # From rest in small steps, so that each loop stays in its assembly branch.
        for s in np.linspace(0, 1, 41):
            q[driven] = s * start
            q = close(model, data, q, dependent)
        v = np.zeros(model.nv)
        v[driven] = rng.uniform(-2, 2, 4)
        J = gaps(model, data, q)[1]
        v[dependent] = -np.linalg.solve(J[:, dependent], J[:, driven] @ v[driven])
        tau = np.zeros(model.nv)
        tau[driven] = rng.uniform(-1, 1, 4) * [3000, 6000, 6000, 200]
        # Out of the plane the contacts are redundant: a proximal solution.
        settings = pin.ProximalSettings(1e-15, 1e-15, 1e-8, 200)
        a = pin.constraintDynamics(model, data, q, v, tau, contacts, contact_data, settings).copy()
        worst = max(worst, np.abs(a - multipliers(model, data, q, v, tau)).max() / np.abs(a).max())
        pin.framesForwardKinematics(model, data, q)
        tool = data.oMf[model.getFrameId("tool0")]
        cases.append({
            "q": q[driven].tolist(), "qd": v[driven].tolist(), "tau": tau[driven].tolist(), "qdd": a[driven].tolist(),
            "dependent_q": q[dependent].tolist(), "dependent_qd": v[dependent].tolist(), "dependent_qdd": a[dependent].tolist(),
            "tool": tool.translation.tolist(), "tool_rotation": tool.rotation.tolist(),
            "energy": [pin.computeKineticEnergy(model, data, q, v), pin.computePotentialEnergy(model, data, q)],
        })
    print(f"multipliers in the plane against pin.constraintDynamics: {worst:.1e} of the largest acceleration")
    assert worst < 1e-9
    out = {
        "provenance": f"tools/golden_loops.py, Pinocchio {pin.__version__}, numpy {np.__version__}, seed {SEED}",
        "fields": {
            "q, qd, tau, qdd": "driving joints: positions, velocities, forces on them, accelerations that these give; rad, N m",
            "dependent_*": "the same of the dependent joints, loop by loop",
            "tool": "origin of tool0 in the world (m); tool_rotation its axes as columns, by rows",
            "energy": "kinetic and potential energy (J), potential zero at the height of the world origin",
        },
        "urdf": URDF, "gravity": GRAVITY, "driven": DRIVEN,
        "loops": [dict(zip(["name", "pin_link", "pin", "eye_link", "eye", "dependent"], loop)) for loop in LOOPS],
        "multipliers_against_contacts": worst,
        "cases": cases,
    }
    (ROOT / "tests/golden/closed_loops.json").write_text(json.dumps(out, indent=1) + "\n")


if __name__ == "__main__":
    main()
