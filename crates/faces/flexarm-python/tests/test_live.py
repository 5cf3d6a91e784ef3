"""Arms that are commanded online."""

import numpy as np
import pytest
from conftest import WORKING_POSE

import flexarm


#: Within the limits of all robots in these tests (rad).
POSE = [0.0, -0.9, 0.9, 0.0, 0.4, 0.0]


def error_along(arm: flexarm.Arm, motion: flexarm.Motion, period: float) -> np.ndarray:
    """TCP error of an arm that gets the motion as targets."""
    steps = round(motion.duration / period)
    q, v, _ = motion.sample(period * np.arange(steps + 1))
    live = arm.live(q[0], period=period, step=1e-3)
    error = [live.tcp_pose[:3, 3] - live.target_pose[:3, 3]]
    for k in range(1, steps + 1):
        live.step(q[k], v[k])
        error.append(live.tcp_pose[:3, 3] - live.target_pose[:3, 3])
    return np.array(error)


@pytest.mark.parametrize("period, bound", [(1e-3, 2e-5), (4e-3, 2e-5)])
def test_targets_along_a_motion_give_the_run_along_it(arm: flexarm.Arm, period: float, bound: float) -> None:
    motion = arm.robot.motion("point_to_point")
    run = arm.simulate(motion, log_rate=1 / period)
    found = error_along(arm, motion, period)
    assert found.shape == run.error.shape
    difference = np.linalg.norm(found - run.error, axis=1).max() / np.linalg.norm(run.error, axis=1).max()
    assert difference <= bound


@pytest.mark.parametrize("robot, drives", [("kr210", "elastic"), ("reference_arm", "servo"), ("kr300", "servo")])
def test_an_arm_that_is_told_to_stay_stays_in_equilibrium(robot: str, drives: str) -> None:
    live = flexarm.load(robot).flexible(drives=drives).live(POSE)
    begin = live.tcp_pose
    for _ in range(200):
        live.step(POSE)
    np.testing.assert_allclose(live.tcp_pose, begin, atol=1e-9)
    assert live.time == pytest.approx(0.2)


def test_a_push_moves_the_tool_by_the_compliance(arm: flexarm.Arm) -> None:
    live = arm.live(WORKING_POSE)
    force = np.array([0.0, 0.0, -100.0, 0.0, 0.0, 0.0])
    begin = live.tcp_pose[:3, 3]
    for _ in range(8000):  # until the ringing has decayed
        live.step(WORKING_POSE, wrench=force)
    moved = live.tcp_pose[:3, 3] - begin
    expected = (arm.statics(WORKING_POSE).compliance @ force)[:3]
    np.testing.assert_allclose(moved, expected, atol=2e-3 * np.linalg.norm(expected))
    live.reset(WORKING_POSE)
    np.testing.assert_allclose(live.tcp_pose[:3, 3], begin, atol=1e-12)
    assert live.time == 0.0


def test_servos_follow_a_ramp_and_settle() -> None:
    live = flexarm.load("reference_arm").flexible(drives="servo").live(POSE)
    target = np.array(POSE)
    for _ in range(100):
        target = target + [2e-4, 0, 0, 0, 0, 0]
        live.step(target)
    assert abs(target[0] - live.position[0]) < 2e-3  # for a ramp that starts with a jerk
    assert live.position[0] != target[0]
    for _ in range(2000):
        live.step(target)
    np.testing.assert_allclose(live.position, target, atol=1e-4)  # the integrals are slow
