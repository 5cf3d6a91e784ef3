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


def test_a_state_repeats_what_followed_and_periods_may_differ() -> None:
    live = flexarm.load("kr210").flexible().live(POSE)
    target = np.array(POSE)

    def move() -> np.ndarray:
        for period in (1e-3, 3e-3, 2e-3):
            target[0] += 0.01
            live.step(target, period=period)
        return live.tcp_pose

    state = live.state()
    first = move()
    live.restore(state)
    target[:] = POSE
    np.testing.assert_array_equal(move(), first)
    assert live.time == pytest.approx(0.006)
    with pytest.raises(ValueError):
        flexarm.load("kr210").flexible().live(POSE).restore(state)


def test_a_payload_is_put_down_and_the_tool_rises_to_where_it_is_without_it() -> None:
    robot = flexarm.load("kr210")
    live = robot.flexible().live(POSE, period=1e-2)
    loaded = live.tcp_pose[:3, 3]
    live.set_payload(False)
    for _ in range(400):
        live.step(POSE)
    empty = live.tcp_pose[:3, 3]
    assert empty[2] - loaded[2] > 1e-3
    live.reset(POSE)
    # Still without payload; the run above rings within 1 micrometre after 4 s.
    assert abs(live.tcp_pose[:3, 3] - empty).max() < 5e-6
    beam = flexarm.load("one_beam").flexible().live()
    with pytest.raises(ValueError, match="no payload"):
        beam.set_payload(False)


def test_open_servos_leave_the_motors_to_torques_and_links_follow_through_the_gears() -> None:
    arm = flexarm.load("kr300").flexible(drives="servo")
    live = arm.live(POSE, servos="open")
    holding = live.effort
    for _ in range(100):
        live.step(POSE, torque=holding)
    np.testing.assert_allclose(live.position, POSE, atol=1e-6)
    twist = live.link_position - live.position
    assert 1e-6 < abs(twist).max() < 1e-2
    np.testing.assert_allclose(live.link_velocity, 0.0, atol=1e-3)
    live.step(POSE)
    np.testing.assert_array_equal(live.effort, np.zeros(6))
    softer = arm.live(POSE, stiffness=0.5)
    np.testing.assert_allclose(softer.link_position - softer.position, 2 * twist, rtol=0.05, atol=1e-7)
    with pytest.raises(ValueError, match="servos"):
        arm.live(POSE, servos="off")


def test_the_state_space_has_the_modes_and_the_compliance_of_the_arm(arm: flexarm.Arm) -> None:
    linear = arm.linearise(WORKING_POSE)
    A, B, C, D = linear.state_space()
    poles = np.linalg.eigvals(A)
    found = np.sort(np.abs(poles[poles.imag > 1.0])) / (2 * np.pi)
    modes = arm.modes(WORKING_POSE)
    np.testing.assert_allclose(found[:3], modes.frequencies[:3], rtol=0.02)
    k, n = linear.M_a.shape
    size = k + n
    # At rest under a wrench: 0 = A z + B u for the free coordinates.
    free = np.r_[0:k]
    z = np.linalg.solve(A[np.ix_(size + free, free)], -B[size + free, n:])
    np.testing.assert_allclose(C[:, :k] @ z, linear.compliance, rtol=1e-9)
    assert not D.any()
