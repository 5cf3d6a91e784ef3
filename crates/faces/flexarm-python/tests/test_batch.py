"""Arrays of parameters in one call: each run is bitwise equal to the same run on its own."""

import re
import time

import numpy as np
import pytest

import flexarm


@pytest.fixture(scope="module")
def reference() -> flexarm.Arm:
    return flexarm.load("reference_arm").flexible()


def parameters(m: int) -> "dict[str, np.ndarray]":
    """Parameters varied in crates/faces/flexarm/examples/many_runs.rs, and inertias."""
    part = np.arange(m) / m
    com = np.zeros((m, 3))
    com[:, 2] = 0.05 + 0.01 * part
    return {
        "stiffness": 0.8 + 0.4 * part,
        "damping": 1.5 - part,
        "time_scale": 1.0 + 0.2 * part,
        "payload_mass": 1.0 + 4.0 * part,
        "payload_com": com,
        "payload_inertia": np.multiply.outer(0.01 + 0.01 * part, np.diag([1.0, 1.2, 0.7])),
    }


def alone(arm: flexarm.Arm, motion: flexarm.Motion, p: "dict[str, np.ndarray]", k: int) -> flexarm.Scenario:
    payload = flexarm.Payload.attach(0.0, p["payload_mass"][k], p["payload_com"][k], p["payload_inertia"][k])
    return flexarm.Scenario(motion.scaled(p["time_scale"][k]), payloads=[payload])


def test_rows_have_the_bits_of_the_runs_alone(reference: flexarm.Arm) -> None:
    m, motion = 11, reference.robot.motion()
    p = parameters(m)
    found = reference.deflections(motion, **p, step=4e-3, samples=True)
    assert len(found) == m and found.peak.shape == (m,) and found.end.shape == (m, 3)
    for k in range(m):
        factors = {name: float(p[name][k]) for name in ["stiffness", "damping"]}
        one = reference.deflections([alone(reference, motion, p, k)], **factors, step=4e-3, samples=True)
        assert found.samples(k).tobytes() == one.samples(0).tobytes()
        assert (found.peak[k], found.rms[k], found.time_of_peak[k]) == (one.peak[0], one.rms[0], one.time_of_peak[0])


def test_rows_are_the_errors_of_simulated_runs(reference: flexarm.Arm) -> None:
    m, step, motion = 5, 4e-3, reference.robot.motion()
    p = {name: value for name, value in parameters(m).items() if name not in ("stiffness", "damping")}
    found = reference.deflections(motion, **p, step=step, samples=True)
    for k in range(m):
        run = reference.simulate(alone(reference, motion, p, k), step=step, log_rate=1 / step)
        apart = np.abs(found.samples(k)[: len(run)] - run.error).max()
        assert apart <= 1e-12, f"{apart:.1e} m"  # of 5e-3 m; measured 2e-15


def test_one_number_counts_for_all_and_lists_of_runs_take_parameters(reference: flexarm.Arm) -> None:
    masses = np.array([1.0, 2.0, 3.0])
    a = reference.deflections(payload_mass=masses, payload_com=[0, 0, 0.1], stiffness=0.9, step=5e-3)
    com = np.tile([0, 0, 0.1], (3, 1))
    b = reference.deflections([None] * 3, payload_mass=masses, payload_com=com, stiffness=np.full(3, 0.9), step=5e-3)
    assert np.array_equal(a.peak, b.peak) and len(set(a.peak)) == 3
    assert len(reference.deflections(step=5e-3)) == 1


@pytest.mark.parametrize(
    "given, words",
    [
        ({"stiffness": [1, 2], "damping": [1, 2, 3]}, "damping has 3 values, stiffness has 2"),
        ({"stiffness": [[1.0, 2.0]]}, r"stiffness has the shape (1, 2), expected one number, or (m,)"),
        ({"stiffness": [1.0, np.nan]}, "stiffness[1] is NaN"),
        ({"stiffness": "soft"}, "stiffness is of dtype"),
        ({"payload_mass": [1.0, 2.0]}, "needs payload_mass (kg) and payload_com"),
        ({"payload_com": [0, 0, 0.1]}, "needs payload_mass (kg) and payload_com"),
        ({"payload_mass": 1.0, "payload_com": [[0, 0]]}, "payload_com has the shape (1, 2), expected (3,) or (m, 3)"),
        ({"payload_mass": 1.0, "payload_com": [0, 0, 0], "payload_inertia": [[0, 1, 0], [0, 0, 0], [0, 0, 0]]}, "payload_inertia is not symmetric"),
        ({"payload_mass": [1.0, -1.0], "payload_com": [0, 0, 0]}, "payload"),
        ({"time_scale": [1.0, 0.0]}, "time scale 0 is not a positive number"),
        ({"stiffness": [1.0, -1.0]}, "stiffness"),
    ],
)  # fmt: skip
def test_wrong_parameters_are_said(reference: flexarm.Arm, given: "dict[str, object]", words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        reference.deflections(**given, step=5e-3)  # type: ignore[arg-type]


def test_a_thousand_runs_in_one_call(reference: flexarm.Arm, capsys: pytest.CaptureFixture[str]) -> None:
    p = parameters(1000)
    p["payload_com"] = np.array([0.0, 0.0, 0.05])
    del p["payload_inertia"]
    motion = reference.robot.motion()
    best = float("inf")
    for _ in range(3):
        begin = time.perf_counter()
        found = reference.deflections(motion, **p, step=5e-3)
        best = min(best, time.perf_counter() - begin)
    assert np.isfinite(found.peak).all() and not found.failures
    with capsys.disabled():
        print(f"\n1000 runs of 4 to 4.8 s in steps of 5 ms: {best:.2f} s", end="")
