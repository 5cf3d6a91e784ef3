"""Cost of calls. Bounds are wide, since test machines are busy; the figures are printed."""

import subprocess
import sys
import time

import numpy as np
import pytest
from conftest import WORKING_POSE

import flexarm


def best(call, repeats: int) -> float:
    least = float("inf")
    for _ in range(7):
        begin = time.perf_counter()
        for _ in range(repeats):
            call()
        least = min(least, (time.perf_counter() - begin) / repeats)
    return least


def test_a_call_costs_microseconds(arm: flexarm.Arm, capsys: pytest.CaptureFixture[str]) -> None:
    model, q = arm.robot.model, np.array(WORKING_POSE)
    many = np.tile(q, (60, 1))
    one, sixty = best(lambda: model.gravity(q), 3000), best(lambda: model.gravity(many), 300)
    # Extrapolated to zero rows.
    overhead = one - (sixty - one) / 59
    with capsys.disabled():
        print(f"\ncall overhead {1e6 * overhead:.2f} us (gravity: {1e6 * one:.2f} us a call)", end="")
    assert overhead <= 60e-6  # 3 us on an idle machine; the bound catches a slip of a decade


def test_import_is_quick(capsys: pytest.CaptureFixture[str]) -> None:
    code = "import time; t = time.perf_counter(); import flexarm; print(time.perf_counter() - t)"
    times = [float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout) for _ in range(5)]
    with capsys.disabled():
        print(f"\nimport flexarm: {min(times):.3f} s", end="")
    assert min(times) <= 1.5  # 0.15 s on an idle machine


def test_many_poses_cost_what_the_library_needs(arm: flexarm.Arm, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(1)
    lower, upper = arm.robot.limits.T
    q = lower + (upper - lower) * (0.2 + 0.6 * rng.random((20000, 6)))
    arm.statics(q[:512])
    begin = time.perf_counter()
    answer = arm.statics(q)
    seconds = time.perf_counter() - begin
    with capsys.disabled():
        print(f"\nstatics: {1e6 * seconds / len(q):.1f} us a pose of {len(q)}", end="")
    assert answer.compliance.shape == (len(q), 6, 6)
    assert seconds / len(q) <= 2e-3
