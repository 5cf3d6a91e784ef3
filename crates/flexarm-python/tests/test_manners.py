"""Signals, threads, pickles, progress, observers."""

import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from conftest import WORKING_POSE

import flexarm


def interrupted(code: str, cwd: Path) -> "tuple[float, str]":
    """Send Ctrl-C once the script says "go"; seconds until it has KeyboardInterrupt, and what it said."""
    script = "import flexarm, numpy as np, time, sys\n" + textwrap.dedent(code)
    child = subprocess.Popen([sys.executable, "-u", "-c", script], cwd=cwd, stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    assert child.stdout.readline().strip() == "go"
    time.sleep(1.0)
    begin = time.time()
    os.kill(child.pid, signal.SIGINT)
    said, _ = child.communicate(timeout=60)
    caught = float(said.strip().splitlines()[-1])
    return caught - begin, said


WRAP = """
try:
    print("go", flush=True)
    {call}
except KeyboardInterrupt:
    print(time.time(), flush=True)
"""


@pytest.mark.parametrize(
    "prepare, call",
    [
        ("arm = flexarm.load('kr210').flexible()", "arm.simulate(step=1e-6)"),
        ("arm = flexarm.load('kr210').flexible()", "arm.simulate_batch([None] * 500, step=1e-5)"),
        ("arm = flexarm.load('kr210').flexible()", "arm.deflections([None] * 2000, step=1e-4)"),
        ("arm = flexarm.load('kr210').flexible(); q = np.tile([0, -1.2, 1.5, 0, 0.4, 0], (2_000_000, 1))", "arm.statics(q)"),
    ],
    ids=["simulate", "simulate_batch", "deflections", "statics"],
)
def test_ctrl_c_ends_long_calls_at_once(prepare: str, call: str, tmp_path: Path) -> None:
    seconds, _ = interrupted(prepare + WRAP.format(call=call), tmp_path)
    assert seconds <= 5.0  # 0.2 s on an idle machine; a call that does not listen takes far longer


def test_ctrl_c_leaves_readable_files(tmp_path: Path) -> None:
    call = "arm.simulate(step=1e-6, log_rate=1000, output='out', formats=['csv', 'mcap'])"
    interrupted("arm = flexarm.load('kr210').flexible()" + WRAP.format(call=call), tmp_path)
    done = subprocess.run(
        [sys.executable, "-m", "flexarm", "convert", "out/run.mcap", "again.csv"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert len((tmp_path / "again.csv").read_text().splitlines()) > 2


def test_the_lock_is_given_back_while_it_runs(arm: flexarm.Arm) -> None:
    ticks = 0
    stop = threading.Event()

    def count() -> None:
        nonlocal ticks
        while not stop.wait(0.001):
            ticks += 1

    thread = threading.Thread(target=count)
    thread.start()
    begin = time.perf_counter()
    arm.simulate(step=1e-4)
    seconds = time.perf_counter() - begin
    stop.set()
    thread.join()
    assert ticks >= 0.02 * seconds / 0.001


def test_threads_share_an_arm(arm: flexarm.Arm) -> None:
    alone = arm.simulate(step=4e-3).error
    with ThreadPoolExecutor(4) as pool:
        runs = list(pool.map(lambda _: arm.simulate(step=4e-3).error, range(8)))
    assert all(np.array_equal(error, alone) for error in runs)


def peak(arm: flexarm.Arm, motion: flexarm.Motion) -> float:
    return arm.simulate(motion, step=4e-3).summary["tcp"]["peak_m"]


def test_robots_arms_and_motions_are_pickled(arm: flexarm.Arm) -> None:
    modal = arm.robot.flexible(links="modal", drives="rigid", modes=4)
    again = pickle.loads(pickle.dumps(modal))
    assert repr(again) == repr(modal)
    pose = np.array(WORKING_POSE)
    assert np.array_equal(again.statics(pose).compliance, modal.statics(pose).compliance)
    motion = arm.robot.motion("point_to_point", round_corners=0.01)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        there = pool.submit(peak, arm, motion).result()
    assert there == peak(arm, motion)
    t = np.linspace(0, 0.2, 11)
    samples = flexarm.Motion(t, np.tile(pose, (11, 1)))
    load = flexarm.Load.during([0, 0, -100], 0.05, 0.1)
    scenario = flexarm.Scenario(samples, loads=[load], payloads=[flexarm.Payload.release(0.1)])
    assert np.array_equal(arm.simulate(pickle.loads(pickle.dumps(scenario))).error, arm.simulate(scenario).error)


def test_progress_and_observers_are_called(arm: flexarm.Arm) -> None:
    told, seen = [], []
    run = arm.simulate(step=1e-4, progress=lambda t, total: told.append((t, total)), observer=lambda s: seen.append(s.time))
    assert told[-1][0] == told[-1][1] == pytest.approx(run.summary["duration_s"])
    assert np.array_equal(seen, run.time)


def test_an_observer_ends_a_run(arm: flexarm.Arm) -> None:
    with pytest.raises(flexarm.Stopped, match=r"stopped at t = 0\.1"):
        arm.simulate(observer=lambda sample: sample.time < 0.1)

    def fails(sample: flexarm.Sample) -> None:
        raise LookupError(f"at {sample.time}")

    with pytest.raises(LookupError, match="at 0.0"):
        arm.simulate(observer=fails)


def test_columns_are_read_only_views_that_outlive_the_run(arm: flexarm.Arm) -> None:
    run = arm.simulate(step=4e-3)
    error, copy = run.error, run.error.copy()
    with pytest.raises(ValueError):
        error[0, 0] = 1.0
    assert error.base is not None and error.flags.c_contiguous and error.dtype == np.float64
    assert error.__array_interface__["data"] == run.error.__array_interface__["data"]
    del run
    assert np.array_equal(error, copy)


def test_caveats_are_warnings_of_their_own_class(kr210: flexarm.Robot) -> None:
    heavy = flexarm.Payload.attach(0.0, 5000.0, [0.0, 0.0, 0.2])
    arm = kr210.flexible()
    t = np.linspace(0.0, 0.2, 5)
    still = flexarm.Motion(t, np.tile(WORKING_POSE, (5, 1)))
    with pytest.warns(flexarm.Caveat) as caught:
        run = arm.simulate(still, payloads=[heavy])
    assert caught[0].filename == __file__
    told = [caveat for caveat in run.caveats if caveat.severity == "warning"]
    assert told and all(caveat.message and caveat.code for caveat in told)
    assert [str(warning.message) for warning in caught] == [caveat.message for caveat in told]
