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
from conftest import SHARE, WORKING_POSE

import flexarm

tomllib = pytest.importorskip("tomllib")


def interrupted(code: str, cwd: Path, after: float = 1.0, patience: float = 60.0) -> "tuple[float, str]":
    """Send Ctrl-C `after` seconds after "go"; return seconds to KeyboardInterrupt, and output."""
    script = "import flexarm, numpy as np, time, sys\n" + textwrap.dedent(code)
    child = subprocess.Popen([sys.executable, "-u", "-c", script], cwd=cwd, stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    assert child.stdout.readline().strip() == "go"
    time.sleep(after)
    assert child.poll() is None
    begin = time.time()
    os.kill(child.pid, signal.SIGINT)
    said, _ = child.communicate(timeout=patience)
    caught = float(said.strip().splitlines()[-1]) - begin
    print(f"{1e3 * caught:.0f} ms")
    return caught, said


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
        ("robot = flexarm.load('kr210')", "flexarm.map(robot, spacing=0.05, output='out')"),
        ("robot = flexarm.load('kr210')", "flexarm.compensate(robot, step=2e-5, output='out')"),
        ("robot = flexarm.load('kr210')", "flexarm.lobes(robot, 'endmill_20mm', rpm=np.linspace(1e3, 2e4, 20000).tolist(), output='out')"),
    ],
    ids=["simulate", "simulate_batch", "deflections", "statics", "map", "compensate", "lobes"],
)
def test_ctrl_c_ends_long_calls_at_once(prepare: str, call: str, tmp_path: Path) -> None:
    seconds, _ = interrupted(prepare + WRAP.format(call=call), tmp_path)
    assert seconds <= 5.0  # 0.2 s on an idle machine; a call that does not listen takes far longer
    assert not list(tmp_path.rglob("*")), "what was broken off leaves no files"


#: Work that is not polled: it is abandoned, and writes nothing when it completes.
BEHIND = """
try:
    print("go", flush=True)
    {call}
except KeyboardInterrupt:
    end = time.time()
    time.sleep({then})
    print(end, flush=True)
"""


def test_ctrl_c_leaves_nothing_of_a_reduction_and_an_identification(tmp_path: Path) -> None:
    job = SHARE / "robots/test/lower_arm/lower_arm.reduce.toml"
    begin = time.perf_counter()
    flexarm.reduce({**tomllib.loads(job.read_text()), "mesh": str(job.parent / "lower_arm.msh.gz"), "modes": 20})
    alone = time.perf_counter() - begin
    keys = f"{{'mesh': {str(job.parent / 'lower_arm.msh.gz')!r}, 'modes': 20}}"
    prepare = f"import tomllib; job = tomllib.loads(open({str(job)!r}).read()) | {keys}"
    call = BEHIND.format(call="flexarm.reduce(job, output='out')", then=2 * alone)
    seconds, _ = interrupted(prepare + call, tmp_path, after=min(1.0, 0.3 * alone), patience=60 + 4 * alone)
    assert seconds <= 5.0
    assert not list(tmp_path.rglob("*"))


STUDY = """
def told(done, total):
    if done:
        print("go", flush=True)
try:
    flexarm.sweep("study.toml", "out", progress=told)
except KeyboardInterrupt:
    print(time.time(), flush=True)
"""


def test_a_study_that_is_stopped_goes_on_with_the_same_call(tmp_path: Path) -> None:
    study = """
format = 1
robot = "kr210"
metrics = ["peak_mm = 1e3 * tcp.peak_m"]
[options]
step = 1e-4
[[parameter]]
path = "motion.speed"
values = {values}
"""
    (tmp_path / "study.toml").write_text(study.format(values=[round(0.5 + 0.002 * k, 3) for k in range(200)]))
    seconds, _ = interrupted(STUDY, tmp_path, after=0.2)
    assert seconds <= 5.0
    begun = []
    with pytest.raises(LookupError):

        def look(done: float, total: float) -> None:
            begun.append(done)
            raise LookupError

        flexarm.sweep(tmp_path / "study.toml", tmp_path / "out", progress=look)
    assert begun[0] >= 1, "runs that were done are kept"


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


def test_threads_share_everything_that_can_be_held(arm: flexarm.Arm) -> None:
    """Eight threads use all objects at once; each result equals that of a single thread."""
    robot, model, motion, run = arm.robot, arm.model, arm.robot.motion("point_to_point"), arm.simulate(step=4e-3)
    rng = np.random.default_rng(5)
    poses = np.array(WORKING_POSE) + 0.1 * rng.standard_normal((24, 6))

    def asked(k: int) -> "list[bytes]":
        q = poses[k % len(poses)]
        full = np.concatenate([q, np.zeros(arm.n_elastic)])
        answers = [
            arm.statics(q).compliance,
            arm.statics(poses).frequencies,
            arm.modes(q).frequencies,
            arm.response(q, points=20).magnitude,
            arm.linearise(q).K,
            model.crba(np.tile(full, (80, 1))),
            robot.flexible(links="rigid").statics(q).compliance,
            motion.sample([0.1, 0.2])[0],
            run.to_pandas().to_numpy() if k % 8 == 0 else run.error,
            arm.deflections([motion], step=5e-3).peak,
            np.frombuffer(pickle.dumps(arm), dtype=np.uint8),
        ]
        return [answer.tobytes() for answer in answers]

    pytest.importorskip("pandas")
    alone = [asked(k) for k in range(24)]
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(asked, range(24)))
    assert together == alone


def test_threads_share_an_arm_that_is_commanded(arm: flexarm.Arm) -> None:
    live = arm.live(WORKING_POSE)
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda _: live.step(WORKING_POSE), range(400)))
    assert live.time == pytest.approx(0.4)


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
    # Warnings of one kind are merged into one, with the number of the others.
    messages = [caveat.message for caveat in told]
    firsts = [str(warning.message).split(" (and ")[0] for warning in caught]
    assert set(firsts) <= set(messages) and len(caught) < len(messages)
    assert {caveat.code for caveat in told} == {caveat.code for caveat in told if caveat.message in firsts}


def test_showing_a_robot_in_a_notebook_warns_of_nothing(recwarn: pytest.WarningsRecorder) -> None:
    """At zero, joint 2 of this arm is outside its limits; nobody asked for that pose."""
    assert "kr210" in flexarm.load("kr210")._repr_html_()
    assert not recwarn.list
