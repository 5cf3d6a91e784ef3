"""The same numbers, to the last bit, from Python and from the command line."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from conftest import ROBOTS, WORKING_POSE, command

import flexarm

#: Entries that depend on computation time, and file locations.
CLOCK = ["wall_s", "cpu_s", "real_time_factor", "cpu_s_per_simulated_s", "files"]


def answered(*words: object, cwd: Path) -> dict:
    done = command(*words, "--json", cwd=cwd)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_run_has_the_figures_and_the_table_of_the_command_line(name: str, tmp_path: Path) -> None:
    told = answered("compare", name, "-o", "out", cwd=tmp_path)
    run = flexarm.load(name).flexible().simulate()
    summary = dict(run.summary)
    for key in CLOCK:
        told.pop(key, None), summary.pop(key, None)
    assert json.dumps(summary) == json.dumps(told)
    with (tmp_path / "out" / "run.csv").open() as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    table = run.table()
    assert list(table) == rows[0]
    written = np.array(rows[1:], dtype=float)
    ours = np.column_stack(list(table.values()))
    assert written.shape == ours.shape
    assert np.array_equal(written, ours)


def test_statics_modes_and_response_have_the_figures_of_the_command_line(arm: flexarm.Arm, tmp_path: Path) -> None:
    at = ["kr210", "--at", ",".join(map(str, WORKING_POSE))]
    wrench = [10.0, -20.0, -1000.0, 1.0, 2.0, 3.0]
    told = answered("statics", *at, "--wrench", ",".join(map(str, wrench)), cwd=tmp_path)
    assert json.dumps(arm.statics(WORKING_POSE, wrench).details) == json.dumps(told)
    told = answered("modes", *at, cwd=tmp_path)
    assert json.dumps(arm.modes(WORKING_POSE).to_dict()) == json.dumps(told)
    told = answered("response", *at, "--input", "force-z,joint_2", "--output", "x,z", "--points", "50", "--no-files", cwd=tmp_path)
    response = arm.response(WORKING_POSE, inputs=["force-z", "joint_2"], outputs=["x", "z"], points=50)
    assert json.dumps(response.to_dict()) == json.dumps(told)
    told = answered("inspect", *at, cwd=tmp_path)
    assert json.dumps(arm.robot.inspect(WORKING_POSE)) == json.dumps(told)


def test_one_pose_and_many_poses_agree(arm: flexarm.Arm) -> None:
    rng = np.random.default_rng(9283)
    lower, upper = arm.robot.limits.T
    q = lower + (upper - lower) * (0.3 + 0.4 * rng.random((300, 6)))
    many = arm.statics(q, [0.0, 0.0, -500.0])
    assert many.compliance.shape == (300, 6, 6) and not many.failures
    for k in [0, 7, 255, 256, 299]:
        one = arm.statics(q[k], [0.0, 0.0, -500.0])
        np.testing.assert_allclose(one.deflection, many.deflection[k], rtol=1e-9, atol=1e-15)
        np.testing.assert_allclose(one.compliance, many.compliance[k], rtol=1e-9, atol=1e-18)
        np.testing.assert_allclose(one.frequencies, many.frequencies[k], rtol=1e-9)


def test_the_linear_structure_gives_the_compliance_and_the_undamped_modes(arm: flexarm.Arm) -> None:
    linear = arm.linearise(WORKING_POSE)
    C = linear.J @ np.linalg.solve(linear.K, linear.J.T)
    np.testing.assert_allclose(C, arm.statics(WORKING_POSE).compliance, rtol=1e-8, atol=1e-16)
    eigenvalues = np.linalg.eigvals(np.linalg.solve(linear.M, linear.K))
    hz = np.sort(np.sqrt(eigenvalues.real)) / (2 * np.pi)
    np.testing.assert_allclose(hz, arm.statics(WORKING_POSE).frequencies, rtol=1e-7)


def test_a_batch_has_the_bits_of_its_runs(arm: flexarm.Arm) -> None:
    t = np.linspace(0.0, 0.4, 41)
    sway = 0.1 * (1 - np.cos(2 * np.pi * t / 0.4))
    motions = [flexarm.Motion(t, np.outer(sway, np.eye(6)[k]) + WORKING_POSE) for k in range(6)]
    pushed = flexarm.Scenario(motions[0], loads=[flexarm.Load.during([0, 0, -300], 0.1, 0.2)])
    batch = arm.simulate_batch([*motions, pushed])
    for run, motion in zip(batch, [*motions, pushed]):
        alone = arm.simulate(motion)
        assert np.array_equal(run.error, alone.error)
    assert not np.array_equal(batch[0].error, batch[-1].error)
    peaks = arm.deflections(motions).peak
    np.testing.assert_allclose(peaks, [run.summary["tcp"]["peak_m"] for run in batch[:6]], rtol=1e-3)


def test_a_motion_of_samples_goes_through_them(arm: flexarm.Arm) -> None:
    t = np.linspace(0.0, 0.5, 26)
    q = WORKING_POSE + 0.05 * np.outer(t**2 * (0.5 - t) ** 2 * 100, np.ones(6))
    motion = flexarm.Motion(t, q).on(arm.robot)
    np.testing.assert_allclose(motion.sample(t)[0], q, atol=1e-15)
