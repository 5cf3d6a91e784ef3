"""Results survive transfer to other processes and to disk unchanged."""

import pickle
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest
from conftest import WORKING_POSE

import flexarm


@pytest.fixture(scope="module")
def results(arm: flexarm.Arm) -> "dict[str, Any]":
    seen: "list[flexarm.Sample]" = []
    run = arm.simulate(step=4e-3, observer=seen.append)
    still = flexarm.Motion([0.0, 0.2], [WORKING_POSE, WORKING_POSE])
    return {
        "run": run,
        "run without twin": arm.simulate(still, step=4e-3, twin=False),
        "sample": seen[3],
        "statics": arm.statics(WORKING_POSE, [0, 0, -100]),
        "statics of many": arm.statics([WORKING_POSE] * 3),
        "statics with failures": arm.statics([WORKING_POSE, [0.0] * 6], [1e9, 0.0, 0.0]),
        "modes": arm.modes(WORKING_POSE),
        "response": arm.response(WORKING_POSE, points=50),
        "linear": arm.linearise(WORKING_POSE),
        "deflections": arm.deflections([None, still], step=4e-3, samples=True),
        "map": flexarm.map(arm.robot, joints={"joint_2": (-1.8, -0.4, 3)}),
        "compensated": flexarm.compensate(arm.robot, "point_to_point", iterations=1, sweep=False),
        "motion": arm.robot.motion("point_to_point").scaled(1.3),
    }


NAMES = [
    "run", "run without twin", "sample", "statics", "statics of many", "statics with failures", "modes", "response", "linear",
    "deflections", "map", "compensated", "motion",
]  # fmt: skip


def same(a: Any, b: Any, where: str) -> None:
    """Check equality to the last bit, attribute by attribute."""
    assert type(a) is type(b), where
    if isinstance(a, np.ndarray):
        assert a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes(), where
    elif isinstance(a, dict):
        assert list(a) == list(b), where
        for key in a:
            same(a[key], b[key], f"{where}[{key!r}]")
    elif isinstance(a, (list, tuple)):
        assert len(a) == len(b), where
        for k, pair in enumerate(zip(a, b)):
            same(*pair, f"{where}[{k}]")
    elif isinstance(a, flexarm.Caveat):
        assert vars(a) == vars(b), where
    elif type(a).__module__ == "flexarm":
        assert repr(a) == repr(b), where
        for name in [name for name in dir(type(a)) if not name.startswith("_")]:
            if name == "details" and len(getattr(a, "tcp").shape) > 1:
                continue
            # Without the twin there are no errors.
            x, y = getattr(a, name, None), getattr(b, name, None)
            if name in ("to_dict", "table") and callable(x):
                x, y = x(), y()
            if not callable(x) and not isinstance(x, (flexarm.Robot, flexarm.Arm)):
                same(x, y, f"{where}.{name}")
    else:
        assert a == b, where


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", NAMES)
def test_results_are_the_same_after_a_pickle(results: "dict[str, Any]", name: str) -> None:
    before = results[name]
    after = pickle.loads(pickle.dumps(before))
    same(before, after, name)
    same(before, pickle.loads(pickle.dumps(after)), name)


def test_a_run_from_a_pickle_does_what_a_run_does(results: "dict[str, Any]") -> None:
    after = pickle.loads(pickle.dumps(results["run"]))
    assert not after.error.flags.writeable and "load" in after
    pa = pytest.importorskip("pyarrow")
    assert pa.table(after).equals(pa.table(results["run"]))
    assert after._repr_html_() == results["run"]._repr_html_()


def run_there(arm: flexarm.Arm) -> flexarm.Run:
    return arm.simulate(step=4e-3)


def test_other_processes_return_runs(arm: flexarm.Arm, results: "dict[str, Any]") -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        there = pool.submit(run_there, arm).result()
    assert np.array_equal(there.error, results["run"].error)


def test_a_compensated_motion_runs_elsewhere_with_the_same_bits(arm: flexarm.Arm, results: "dict[str, Any]") -> None:
    motion = results["compensated"].motion
    again = pickle.loads(pickle.dumps(motion))
    assert np.array_equal(arm.simulate(again, step=2e-3).error, arm.simulate(motion, step=2e-3).error)


def test_what_is_going_on_says_what_to_do_instead(arm: flexarm.Arm) -> None:
    for thing, words in [(arm.live(), "arm.live"), (arm.operating_point(), "arm.operating_point"), (arm.model, "take .model")]:
        with pytest.raises(TypeError, match=words):
            pickle.dumps(thing)


def test_a_pickle_of_another_version_is_refused_in_words(results: "dict[str, Any]") -> None:
    make, (kind, parts) = results["modes"].__reduce__()
    del parts["elements"]
    with pytest.raises(ValueError, match='the pickle has no "elements"'):
        make(kind, parts)
