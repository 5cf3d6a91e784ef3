"""Rigid-body algorithms compared with Pinocchio, which reads the same URDFs."""

import time
from pathlib import Path

import numpy as np
import pytest
from conftest import SHARE

import flexarm

pin = pytest.importorskip("pinocchio")

#: Robots without payload, loops and balancers in their URDF, so that both read the same model.
URDFS = ["kr210/kr210.urdf", "manutec_r3", "test/reference_arm", "test/three_beams", "kr300"]


def urdf_of(name: str) -> Path:
    path = SHARE / "robots" / name
    return path if path.suffix == ".urdf" else next(path.glob("*.urdf"))


@pytest.fixture(params=URDFS)
def both(request: pytest.FixtureRequest):
    path = urdf_of(request.param)
    waived = ["link_1", "link1", "base"]
    model = flexarm.load(path, waive_inertia=waived).model
    other = pin.buildModelFromUrdf(str(path))
    assert list(other.names)[1:] == list(model.joints)
    return model, other, other.createData()


def states(n: int, m: int):
    rng = np.random.default_rng(2026)
    return [rng.uniform(-1.0, 1.0, (m, n)) for _ in range(3)]


def close(found, expected) -> None:
    scale = max(1.0, float(np.abs(expected).max()))
    assert np.abs(found - expected).max() <= 1e-12 * scale


def test_recursions_agree_with_pinocchio(both) -> None:
    model, other, data = both
    n = model.nv
    q, v, a = states(n, 20)
    tau, bias, gravity = model.rnea(q, v, a), model.nonlinear_effects(q, v), model.gravity(q)
    M = model.crba(q)
    tip = other.frames[-1].name
    J = model.jacobian(q, tip)
    X = model.fk(q, tip)
    frame = other.getFrameId(tip)
    for k in range(len(q)):
        close(tau[k], pin.rnea(other, data, q[k], v[k], a[k]))
        close(bias[k], pin.nonLinearEffects(other, data, q[k], v[k]))
        close(gravity[k], pin.computeGeneralizedGravity(other, data, q[k]))
        expected = np.triu(pin.crba(other, data, q[k]))
        close(M[k], expected + np.triu(expected, 1).T)
        # Pinocchio's array for a single joint is one-dimensional.
        close(J[k], pin.computeFrameJacobian(other, data, q[k], frame, pin.LOCAL_WORLD_ALIGNED).reshape(6, n))
        close(X[k], data.oMf[frame].homogeneous)


def test_forward_dynamics_agree_with_pinocchio_and_undo_the_inverse(both) -> None:
    model, other, data = both
    q, v, tau = states(model.nv, 20)
    a = model.aba(q, v, 10 * tau)
    for k in range(len(q)):
        expected = pin.aba(other, data, q[k], v[k], 10 * tau[k])
        # Small inertias: both are as accurate as the condition of the mass matrix permits.
        condition = np.linalg.cond(model.crba(q[k]))
        assert np.abs(a[k] - expected).max() <= 1e-15 * condition * max(1.0, np.abs(expected).max()) + 1e-12 * np.abs(expected).max()
    scale = np.abs(10 * tau).max()
    np.testing.assert_allclose(model.rnea(q, v, a), 10 * tau, atol=1e-9 * scale)


def seconds(call, repeats: int = 20000) -> float:
    best = float("inf")
    for _ in range(5):
        begin = time.perf_counter()
        for _ in range(repeats // 5):
            call()
        best = min(best, (time.perf_counter() - begin) / (repeats // 5))
    return best


def test_calls_from_python_are_about_as_fast_as_pinocchios(capsys: pytest.CaptureFixture[str]) -> None:
    path = urdf_of("kr210/kr210.urdf")
    model, other = flexarm.load(path).model, pin.buildModelFromUrdf(str(path))
    data = other.createData()
    q, v, a = (row[0] for row in states(6, 1))
    pairs = {
        "rnea": (lambda: model.rnea(q, v, a), lambda: pin.rnea(other, data, q, v, a)),
        "crba": (lambda: model.crba(q), lambda: pin.crba(other, data, q)),
        "aba": (lambda: model.aba(q, v, a), lambda: pin.aba(other, data, q, v, a)),
    }
    told = {name: (1e6 * seconds(ours), 1e6 * seconds(theirs)) for name, (ours, theirs) in pairs.items()}
    with capsys.disabled():
        for name, (ours, theirs) in told.items():
            print(f"\n{name}: {ours:.2f} us, Pinocchio {theirs:.2f} us", end="")
    for ours, theirs in told.values():
        assert ours <= max(10.0 * theirs, 50.0)
