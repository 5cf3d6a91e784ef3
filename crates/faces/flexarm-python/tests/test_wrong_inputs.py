"""Errors name the argument, what was found, and what is expected."""

from pathlib import Path

import numpy as np
import pytest
from conftest import WORKING_POSE

import flexarm


@pytest.mark.parametrize(
    "q, words",
    [
        (np.zeros(5), r"q has the shape \(5,\), expected \(6,\) or \(m, 6\)"),
        (np.zeros((2, 5)), r"q has the shape \(2, 5\), expected"),
        (np.zeros((2, 2, 6)), r"q has the shape \(2, 2, 6\)"),
        (np.zeros(6, dtype=complex), r"q is of dtype complex128"),
        (["a"] * 6, r"q is of dtype <U1"),
        ([[1.0], [1.0, 2.0]], r"q is no array"),
        ([0, 0, np.nan, 0, 0, 0], r"q\[2\] is NaN"),
        (np.array([[0.0] * 6, [0, 0, 0, 0, np.inf, 0]]), r"q\[1, 4\] is inf"),
        (None, None),
        ([0, 0, 0, 0, 0, 0], None),
        (np.zeros((6, 3), order="F").T[:, :6] if False else np.asfortranarray(np.zeros((3, 6))), None),
    ],
)
def test_arrays_are_checked(arm: flexarm.Arm, q: object, words: "str | None") -> None:
    if words is None:
        arm.statics(q)
    else:
        with pytest.raises(ValueError, match=words):
            arm.statics(q)


def test_other_memory_orders_and_types_give_the_same(arm: flexarm.Arm) -> None:
    q = np.array([WORKING_POSE, np.array(WORKING_POSE) + 0.1])
    right = arm.statics(q).compliance
    for same in [np.asfortranarray(q), q.tolist(), np.repeat(q, 2, axis=1)[:, ::2], q.astype(">f8")]:
        assert np.array_equal(arm.statics(same).compliance, right)


@pytest.mark.parametrize(
    "call, kind, words",
    [
        (lambda a: flexarm.load("kr21"), flexarm.FileError, 'did you mean "kr210"'),
        (lambda a: flexarm.load(7), TypeError, "robot is <class 'int'>: expected a path"),
        (lambda a: a.robot.flexible(links="model"), ValueError, 'did you mean "modal"'),
        (lambda a: a.robot.flexible(segments=1), flexarm.ModellingError, "segments|parts"),
        (lambda a: a.simulate("no_such_motion"), flexarm.FileError, "no_such_motion"),
        (lambda a: a.simulate(step=-1), flexarm.SettingError, "must be positive, found -1"),
        (lambda a: a.simulate(step=100), flexarm.SettingError, r"the step \(step 100 s\)"),
        (lambda a: a.simulate(stepper="spok"), ValueError, 'did you mean "spook"'),
        (lambda a: a.simulate(stepper_options={"rtol": 1}), ValueError, "generalized-alpha takes"),
        (lambda a: a.simulate(start="standing"), ValueError, "start=\"standing\": expected one of"),
        (lambda a: a.simulate(loads=[1]), TypeError, "loads has a <class 'int'>"),
        (lambda a: a.simulate(loads=[flexarm.Load.during([1, 2], 0, 1)]), ValueError, r"wrench has the shape \(2,\)"),
        (lambda a: a.simulate(loads=[flexarm.Load.during([0, 0, 1], 0, 1, "hand")]), flexarm.LoadError, "hand"),
        (lambda a: a.simulate(overwrite=True), ValueError, "need an output folder"),
        (lambda a: a.simulate(output="x", formats=["xls"]), ValueError, "formats=\"xls\""),
        (lambda a: a.simulate(flexarm.Motion([0, 1], [[0, 0], [1, 1]])), ValueError, r"has 2 joints, the robot 6"),
        (lambda a: flexarm.Motion([0, 1], [[0] * 6]), ValueError, "q has 1 rows, t has 2 times"),
        (lambda a: flexarm.Motion([0, 1, 1], np.zeros((3, 6))), ValueError, r"t\[2\] is 1 after 1"),
        (lambda a: flexarm.Motion([0, 1], 5), ValueError, "q has no rows"),
        (lambda a: a.model.rnea(np.zeros(18), np.zeros(24), np.zeros(24)), ValueError, r"q has the shape \(18,\)"),
        (lambda a: a.robot.model.rnea(np.zeros((2, 6)), np.zeros(6), np.zeros(6)), ValueError, "v has one row, q has 2 rows"),
        (lambda a: a.robot.model.jacobian(np.zeros(6), "hand"), ValueError, "hand"),
        (lambda a: a.response(inputs=["force-q"]), flexarm.SettingError, "force-q"),
        (lambda a: a.response(points=1), flexarm.SettingError, "points must lie between"),
        (lambda a: a.live(period=1.5e-3), flexarm.SettingError, "not a whole number of steps"),
        (lambda a: a.deflections([None] * 3, stiffness=[1, 2]), ValueError, "stiffness has 2 values, runs has 3"),
        (lambda a: a.simulate(([0, 1], np.zeros((2, 6)))), TypeError, r"expected a flexarm.Motion, such as flexarm.Motion\(t, q\)"),
        (lambda a: a.simulate(step="1ms"), TypeError, "must be real number, not str"),
        (lambda a: a.simulate(output="x", formats=5), TypeError, "expected str or a list of str, found 5"),
        (lambda a: a.simulate(output="x", formats="xls"), ValueError, "formats=\"xls\""),
        (lambda a: a.modes(count=-1), ValueError, "expected a whole number of at least 0, found -1"),
        (lambda a: a.modes(count=1.5), TypeError, "expected a whole number of at least 0, found 1.5"),
        (lambda a: a.robot.flexible(segments=-2), ValueError, "expected a whole number of at least 0, found -2"),
        (lambda a: a.deflections(None, stiffness="soft"), ValueError, "stiffness is of dtype"),
        (lambda a: a.simulate_batch("point_to_point"), TypeError, "runs is <class 'str'>: expected a list"),
        (lambda a: a.robot.model.fk(np.zeros(6), "tcpp"), ValueError, 'did you mean "tcp"'),
        (lambda a: flexarm.Payload.attach(0, -5, [0, 0, 0]), ValueError, "mass=-5: expected"),
        (lambda a: flexarm.lobes(a.robot, "endmill_20"), flexarm.FileError, 'no shipped tool of this name .did you mean "endmill_20mm"'),
        (lambda a: flexarm.map("kr210"), TypeError, "not an instance of 'Robot'"),
        (lambda a: flexarm.robot({"urdf": 3}), flexarm.RobotError, "keys: "),
        (lambda a: flexarm.robot({"urdf": "x", "payload": {"mass": np.nan}}), ValueError, "payload.mass is nan"),
        (lambda a: flexarm.robot({"urdf": object()}), TypeError, "urdf is <class 'object'>"),
        (lambda a: a.robot.motion("point_to_point").scaled(-1), flexarm.MotionError, "time scale -1"),
        (lambda a: flexarm.Motion([0, 1], np.zeros((2, 6))).scaled(2), ValueError, "knows no robot yet"),
        (lambda a: a.statics(wrench=[1, 2, 3, 4]), ValueError, r"wrench has the shape \(4,\)"),
    ],
)
def test_what_is_wrong_is_said(arm: flexarm.Arm, call, kind, words: str) -> None:
    with pytest.raises(kind, match=words) as caught:
        call(arm)
    told = str(caught.value)
    assert not any(word in told for word in ["--", "panicked", "Vec", ".rs", "unsigned"]), told


def test_errors_are_by_cause(tmp_path: Path) -> None:
    assert issubclass(flexarm.InputError, ValueError) and issubclass(flexarm.RunError, RuntimeError)
    file = tmp_path / "robot.toml"
    file.write_text('format = 1\nurdf = "x.urdf"\n')
    with pytest.raises(flexarm.RobotError, match=r"robot\.toml:2:8"):
        flexarm.load(file)
    (tmp_path / "x.urdf").write_text("<robot")
    with pytest.raises(flexarm.UrdfError):
        flexarm.load(file)
    with pytest.raises(flexarm.FileError):
        flexarm.load(tmp_path / "robot.txt")


def test_the_content_of_a_wrong_table_is_a_file_error(arm: flexarm.Arm, tmp_path: Path) -> None:
    loads = tmp_path / "loads.toml"
    loads.write_text('format = 1\n[[load]]\nkind = "table"\nfile = "force.csv"\n')
    (tmp_path / "force.csv").write_text("time,fx\n0,1\n1,one\n")
    with pytest.raises(flexarm.FileError, match=r"force\.csv:3:3"):
        arm.simulate(loads=loads)


def test_files_are_not_overwritten(arm: flexarm.Arm, tmp_path: Path) -> None:
    run = arm.simulate(step=4e-3, output=tmp_path, formats=["csv"])
    before = Path(run.files["csv"]).read_bytes()
    with pytest.raises(flexarm.Error, match="overwrite"):
        arm.simulate(step=2e-3, output=tmp_path, formats=["csv"])
    assert Path(run.files["csv"]).read_bytes() == before
    arm.simulate(step=2e-3, output=tmp_path, formats=["csv"], overwrite=True)
    assert Path(run.files["csv"]).read_bytes() != before
