"""Result dictionaries have exactly the keys and types that the package declares."""

import types as builtin
import typing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import SHARE, WORKING_POSE

import flexarm
from flexarm import types


def check(value: Any, kind: Any, where: str) -> None:
    """Check recursively that the value has the declared type."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if kind is Any:
        return
    if origin in (typing.Union, builtin.UnionType):
        told = []
        for one in arguments:
            try:
                return check(value, one, where)
            except AssertionError as error:
                told.append(str(error))
        raise AssertionError("; ".join(told))
    if origin is typing.Literal:
        assert value in arguments, where
    elif origin is list:
        assert isinstance(value, list), where
        for k, item in enumerate(value):
            check(item, arguments[0], f"{where}[{k}]")
    elif origin is dict:
        assert isinstance(value, dict), where
        for key, item in value.items():
            check(item, arguments[1], f"{where}[{key!r}]")
    elif typing.is_typeddict(kind):
        assert isinstance(value, dict), where
        hints = typing.get_type_hints(kind)
        unknown, missing = set(value) - set(hints), required(kind) - set(value)
        assert not unknown and not missing, f"{where}: keys that are not declared {unknown}, missing {missing}"
        for key, item in value.items():
            check(item, hints[key], f"{where}[{key!r}]")
    elif kind is float:
        assert isinstance(value, (int, float)) and not isinstance(value, bool), f"{where} is {value!r}, not a float"
    elif kind is type(None):
        assert value is None, f"{where} is {value!r}, not None"
    else:
        assert type(value) is kind, f"{where} is {value!r}, not {kind}"


def without_twin(arm: flexarm.Arm) -> "dict[str, Any]":
    """Figures of a run without error, completed with the error of another run."""
    found, other = (arm.simulate("point_to_point", step=2e-3, twin=twin).summary for twin in [False, True])
    assert "tcp" not in found
    return {**found, "tcp": other["tcp"]}


def required(kind: Any) -> "set[str]":
    return set(kind.__required_keys__)


URDF = next((SHARE / "robots/kr210").glob("*.urdf"))
JOB = SHARE / "robots/test/lower_arm/lower_arm.reduce.toml"


def answers(robot: flexarm.Robot, arm: flexarm.Arm, folder: Path) -> "dict[str, tuple[Any, Any]]":
    servo = flexarm.load("reference_arm").flexible(drives="servo")
    compensated = flexarm.compensate(robot, "point_to_point", iterations=1, output=folder / "compensated")
    map = flexarm.map(robot, bounds=[[1.4, -0.4, 0.4], [2.0, 0.4, 1.2]], spacing=0.3, workpiece=[0.3, 0.3, 0.3], output=folder / "map")
    reduced = flexarm.reduce(JOB, output=folder / "link")
    exported = flexarm.export_link(folder / "link/lower_arm.flex", "matrix-market", folder / "matrices")
    imported = flexarm.import_link(sorted((folder / "matrices").glob("*.mtx")), output=folder / "imported")
    study = folder / "study.toml"
    study.write_text(
        'format = 1\nrobot = "one_beam"\nmetrics = ["peak_mm = 1e3 * tcp.peak_m", "end = tcp.end_m"]\n[options]\nstep = 0.005\n'
        '[[parameter]]\npath = "motion.speed"\nvalues = [0.6, 0.8, 1.0]\n'
    )
    measurements = folder / "measurements.toml"
    readings = ["format = 1", 'fit = ["drive.joint_2.gearbox.stiffness", "drive.joint_3.gearbox.stiffness"]']
    for k in range(4):
        q = np.array(WORKING_POSE) + 0.1 * k
        moved = 1.2 * (arm.statics(q, [0, 0, -800.0]).tcp - arm.statics(q).tcp)
        readings += ["[[displacement]]", f"joints = {q.tolist()}", "load = { force = [0.0, 0.0, -800.0] }", f"value = {moved.tolist()}"]
    measurements.write_text("\n".join(readings))
    return {
        "run": (arm.simulate(step=2e-3, output=folder / "run").summary, types.RunSummary),
        "servo": (servo.simulate(step=1e-3).summary, types.RunSummary),
        "spook": (arm.simulate("point_to_point", step=1e-3, stepper="spook").summary, types.RunSummary),
        "no twin": (without_twin(arm), types.RunSummary),
        "files": (arm.simulate("point_to_point", step=2e-3).files, types.RunFiles),
        "statics": (arm.statics(WORKING_POSE, [0, 0, -100]).details, types.StaticsDetails),
        "modes": (arm.modes(WORKING_POSE).to_dict(), types.ModesSummary),
        "modes of servos": (servo.modes([0.0, -0.9, 0.9, 0.0, 0.4, 0.0]).to_dict(), types.ModesSummary),
        "response": (arm.response(WORKING_POSE, points=20).to_dict(), types.ResponseSummary),
        "map": (map.to_dict(), types.MapSummary),
        "worst": (map.worst, types.MapPose),
        "compensation": (compensated.to_dict(), types.Compensation),
        "before": (compensated.before, types.ErrorFigures),
        "identification": (flexarm.identify(robot, measurements, output=folder / "identified"), types.Identification),
        "plan": (flexarm.plan_measurements(robot, 3), types.MeasurementPlan),
        "lobes": (flexarm.lobes(robot, "endmill_20mm", q=WORKING_POSE, rpm=[4000, 9000], ranges=True), types.Lobes),
        "sweep": (flexarm.sweep(study, folder / "study"), types.SweepSummary),
        "reduction": (reduced, types.ReduceSummary),
        "import": (imported, types.ImportSummary),
        "export": (exported, types.ExportSummary),
        "inspection": (robot.inspect(), types.Inspection),
        "inspection of loops": (flexarm.load("palletiser").inspect(), types.Inspection),
        "findings": (flexarm.check("kr210", "point_to_point"), list[types.Finding]),
        "new robot": (flexarm.new_robot(URDF, folder / "new", payload=10.0), types.NewRobot),
    }


@pytest.mark.filterwarnings("ignore")
def test_answers_are_what_their_types_say(kr210: flexarm.Robot, arm: flexarm.Arm, tmp_path: Path) -> None:
    wrong = []
    for name, (value, kind) in answers(kr210, arm, tmp_path).items():
        try:
            check(value, kind, name)
        except AssertionError as error:
            wrong.append(str(error).splitlines()[0])
    assert not wrong, "\n".join(wrong)


def test_a_wrong_answer_would_be_found(arm: flexarm.Arm) -> None:
    found = arm.modes(WORKING_POSE).to_dict()
    for spoilt in [{**found, "more": 1}, {key: found[key] for key in list(found)[1:]}, {**found, "total": 1.5}]:
        with pytest.raises(AssertionError):
            check(spoilt, types.ModesSummary, "spoilt")
