"""Links, identification, compensation, maps and new robots: same figures as the command line."""

import json
import pickle
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from conftest import SHARE, WORKING_POSE, command

import flexarm

tomllib = pytest.importorskip("tomllib")

JOB = SHARE / "robots/test/lower_arm/lower_arm.reduce.toml"


def told(*words: object, cwd: Path) -> dict:
    done = command(*words, "--json", cwd=cwd)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def without_clock(figures: dict) -> dict:
    clock = {"wall_s", "cpu_s", "peak_rss_bytes", "files", "phases", "file", "solver"}
    return {key: value for key, value in figures.items() if key not in clock}


def test_a_mesh_is_reduced_to_the_link_of_the_command_line(tmp_path: Path) -> None:
    # The keys of the job as a dict, with paths relative to this folder.
    job = tomllib.loads(JOB.read_text())
    job["mesh"] = str(JOB.parent / job["mesh"])
    job["modes"] = 2
    ours = flexarm.reduce(job, output=tmp_path / "a")
    theirs = told("reduce", JOB, "--modes", "2", "-o", "b", cwd=tmp_path)
    assert without_clock(ours) == without_clock(theirs)
    links = [next((tmp_path / folder).glob("*.flex")) for folder in "ab"]
    assert links[0].read_bytes() == links[1].read_bytes()
    with pytest.raises(flexarm.FileError, match="overwrite"):
        flexarm.reduce(JOB, output=tmp_path / "a")
    exported = flexarm.export_link(links[0], "matrix-market", tmp_path / "m")
    assert exported["link"] == "lower_arm" and list((tmp_path / "m").iterdir())
    imported = flexarm.import_link(sorted((tmp_path / "m").glob("*.mtx")))
    assert imported["mass_kg"] == pytest.approx(ours["mass_kg"], rel=1e-6)
    with pytest.raises(ValueError, match="unknown field `mash`"):
        flexarm.reduce({"mash": 1})
    with pytest.raises(ValueError, match='format="matrix": expected one of'):
        flexarm.import_link([], format="matrix")


def test_a_compensated_motion_is_that_of_the_command_line_and_helps(kr210: flexarm.Robot, tmp_path: Path) -> None:
    found = flexarm.compensate(kr210, "point_to_point", sweep=False)
    theirs = told("compensate", "kr210", "point_to_point", "--no-sweep", "--no-files", cwd=tmp_path)
    assert without_clock(found.to_dict()) == without_clock(theirs)
    assert found.after["peak_m"] < 0.2 * found.before["peak_m"]
    arm = kr210.flexible()
    was = np.linalg.norm(arm.simulate("point_to_point").tcp - arm.simulate("point_to_point").rigid_tcp, axis=1).max()
    assert was == pytest.approx(found.before["peak_m"], rel=1e-3)
    assert found.motion.joints == kr210.joints and found.curves.shape[1] == 3


def test_sensitivities_are_those_of_the_command_line_and_of_runs(kr210: flexarm.Robot, tmp_path: Path) -> None:
    ours = flexarm.sensitivity(kr210, "point_to_point", by=["drive.*", "payload.mass"], table=tmp_path / "slopes.csv")
    theirs = told("sensitivity", "kr210", "point_to_point", "--by", "drive.*", "--by", "payload.mass", cwd=tmp_path)
    assert without_clock({**ours, "table": None}) == without_clock(theirs)
    run = kr210.flexible().simulate("point_to_point")
    assert ours["peak_m"] == pytest.approx(np.linalg.norm(run.tcp - run.rigid_tcp, axis=1).max(), rel=1e-3)
    header = (tmp_path / "slopes.csv").read_text().splitlines()[0].split(",")
    assert len(header) == 1 + 6 * (1 + len(ours["parameters"])) and "payload.mass.z" in header
    with pytest.raises(ValueError, match="no parameter is called"):
        flexarm.sensitivity(kr210, by=["elbow"])


def test_friction_and_gains_of_servos_are_parameters_of_a_run(tmp_path: Path) -> None:
    kr300 = flexarm.load("kr300")
    by = ["drive.joint_a2.friction.*", "drive.joint_a2.servo.*"]
    ours = flexarm.sensitivity(kr300, by=by, drives="servo", step=4e-3)
    theirs = told(
        "sensitivity", "kr300", "--drives", "servo", "--step", "0.004", "--by", by[0], "--by", by[1], cwd=tmp_path
    )
    names = {own["name"].removeprefix("drive.joint_a2.") for own in ours["parameters"]}
    gains = {"servo.position_gain", "servo.velocity_gain", "servo.integral_gain", "servo.feed_forward"}
    assert names == gains | {"friction.viscous", "friction.coulomb", "friction.regularisation"}
    assert [own["peak_m"] for own in ours["parameters"]] == [own["peak_m"] for own in theirs["parameters"]]


def test_a_plan_of_measurements_is_that_of_the_command_line(kr210: flexarm.Robot, tmp_path: Path) -> None:
    ours = flexarm.plan_measurements(kr210, 4)
    theirs = told("identify", "kr210", "--plan", "4", "--no-files", cwd=tmp_path)
    assert without_clock(ours) == without_clock(theirs)


def test_measurements_of_an_arm_give_its_stiffness_back(arm: flexarm.Arm, tmp_path: Path) -> None:
    # A robot file whose second gearbox is 1.4 times too stiff, and displacements of the actual arm.
    shutil.copytree(SHARE / "robots/kr210", tmp_path / "kr210")
    file = tmp_path / "kr210/robot.toml"
    robot = tomllib.loads(file.read_text())
    drive = next(drive for drive in robot["drive"] if drive["joint"] == "joint_2")
    right = drive["gearbox"]["stiffness"]
    written = re.search(r'joint = "joint_2"[^\[]*?gearbox = \{ stiffness = ([0-9.e+_]+)', file.read_text())
    assert written is not None and float(written[1]) == right
    at = written.span(1)
    text = file.read_text()
    file.write_text(text[: at[0]] + f"{1.4 * right:e}" + text[at[1] :])

    readings = ["format = 1", 'fit = ["drive.joint_2.gearbox.stiffness"]']
    for k in range(6):
        q = np.array(WORKING_POSE) + 0.1 * k
        force = [0.0, 0.0, -800.0] if k % 2 else [600.0, 0.0, 0.0]
        moved = arm.statics(q, force).tcp - arm.statics(q).tcp
        load = f"load = {{ force = {force} }}"
        readings += ["[[displacement]]", f"joints = {q.tolist()}", load, f"value = {moved.tolist()}", "std = 1e-6"]
    measurements = tmp_path / "measurements.toml"
    measurements.write_text("\n".join(readings))

    found = flexarm.identify(flexarm.load(file), measurements, output=tmp_path / "new")
    [stiffness] = found["parameters"]
    assert stiffness["initial"] == pytest.approx(1.4 * right)
    assert stiffness["value"] == pytest.approx(right, rel=1e-3)
    assert found["residual"]["after"] < 1e-3 * found["residual"]["before"]
    mended = flexarm.load(found["file"]).flexible().statics(WORKING_POSE)
    np.testing.assert_allclose(mended.deflection, arm.statics(WORKING_POSE).deflection, rtol=1e-3)
    with pytest.raises(flexarm.FileError):
        flexarm.identify(arm.robot, tmp_path / "nothing.toml")


def test_an_entry_of_a_links_matrix_and_the_tool_are_found_and_differentiated(arm: flexarm.Arm, tmp_path: Path) -> None:
    # The tool of the file is wrong by 3 mm along its own x.
    shutil.copytree(SHARE / "robots/kr210", tmp_path / "kr210")
    file = tmp_path / "kr210/robot.toml"
    text = file.read_text()
    assert "xyz = [0.0, 0.0, 0.35]" in text
    file.write_text(text.replace("xyz = [0.0, 0.0, 0.35]", "xyz = [0.003, 0.0, 0.35]", 1))
    readings = ["format = 1", 'fit = ["tcp.x", "tcp.y", "tcp.z"]', "[instrument.tracker]", "xyz = [0, 0, 0]", "[target.tool]"]
    readings += ["xyz = [0, 0, 0]"]
    for k in range(5):
        q = np.array(WORKING_POSE) + 0.2 * np.sin(np.arange(6) + k)
        place = arm.statics(q).tcp
        readings += ["[[place]]", f"joints = {q.tolist()}", f"value = {place.tolist()}", "std = 1e-5"]
    measurements = tmp_path / "measurements.toml"
    measurements.write_text("\n".join(readings))
    found = flexarm.identify(flexarm.load(file), measurements, output=tmp_path / "new")
    assert [p["value"] for p in found["parameters"]] == pytest.approx([-0.003, 0.0, 0.0], abs=1e-7)
    mended = flexarm.load(found["file"]).flexible().statics(WORKING_POSE)
    np.testing.assert_allclose(mended.tcp, arm.statics(WORKING_POSE).tcp, atol=1e-6)

    by = ["link.link_2.stiffness[5][1]", "link.link_2.stiffness[1][1]"]
    entries = flexarm.sensitivity(arm.robot, "point_to_point", by=by)["parameters"]
    assert {p["name"] for p in entries} == {"link.link_2.stiffness[1][5]", "link.link_2.stiffness[1][1]"}
    assert {p["per"] for p in entries} == {"1 % of the root of K_ii K_jj"}


def test_a_map_is_that_of_the_command_line_and_of_statics(kr210: flexarm.Robot, arm: flexarm.Arm, tmp_path: Path) -> None:
    joints = {"joint_2": (-1.8, -0.4, 4), "joint_3": (0.4, 2.0, 3)}
    ours = flexarm.map(kr210, joints=joints, wrench=[0, 0, -500])
    words = ["--over", "joint_2=-1.8:-0.4:4", "--over", "joint_3=0.4:2:3", "--wrench", "0,0,-500", "--no-files"]
    theirs = told("map", "kr210", *words, cwd=tmp_path)
    assert without_clock(ours.to_dict()) == without_clock(theirs)
    table = ours.table
    assert set(table) == set(ours.meanings) and len(table[next(iter(table))]) == len(ours) == 12
    # Frequencies of a map equal those under gravity, to the last bit.
    assert arm.statics(ours.worst["q"]).frequencies[0] == ours.worst["quantities"]["frequency_1_hz"]


def test_a_map_of_poses_has_the_compliance_of_statics(kr210: flexarm.Robot, arm: flexarm.Arm) -> None:
    poses = np.array([[0.1, -1.0, 1.5, 0.3, 0.7, 0.2], [-0.4, -0.8, 1.2, 0.0, -0.5, 0.9]])
    found = flexarm.map(kr210, poses=poses)
    names = [name for name in found.meanings if name.startswith("c_")]
    assert len(names) == 36
    for k, pose in enumerate(poses):
        matrix = np.array([found[name][k] for name in names]).reshape(6, 6)
        assert np.array_equal(matrix, arm.statics(pose).compliance)
    with pytest.raises(ValueError, match="exclude each other"):
        flexarm.map(kr210, poses=poses, along="pick_and_place")


def test_a_compensation_takes_loads_and_limits_and_writes_other_files(kr210: flexarm.Robot, tmp_path: Path) -> None:
    wrench = [300.0, 0.0, -200.0, 0.0, 0.0, 0.0]
    load = flexarm.Load.during(wrench, 0.0, 10.0)
    ways = {"method": "static", "sweep": False}
    bare = flexarm.compensate(kr210, "pick_and_place", **ways)
    found = flexarm.compensate(
        kr210, "pick_and_place", loads=[load], output=tmp_path / "out", write=[tmp_path / "new.yaml"], **ways
    )
    scenario = flexarm.Scenario("pick_and_place", loads=[load])
    assert flexarm.compensate(kr210, scenario, **ways).after == found.after
    assert found.before["peak_m"] > 1.02 * bare.before["peak_m"]
    assert found.after["end_m"] < 0.1 * found.before["end_m"]
    assert "joint_names" in (tmp_path / "new.yaml").read_text()
    slow = np.full(6, 1e-2)
    told = flexarm.compensate(kr210, "pick_and_place", limits="tell", accelerations=slow, **ways)
    assert {limit["kind"] for limit in told.to_dict()["limits"]} == {"acceleration"}
    with pytest.raises(ValueError, match="limits"):
        flexarm.compensate(kr210, "pick_and_place", limits="loose", **ways)
    with pytest.raises(ValueError, match="accelerations"):
        flexarm.compensate(kr210, "pick_and_place", accelerations=[1.0], **ways)


def test_a_shaper_of_all_modes_is_that_of_the_command_line_and_keeps_its_delay(kr210: flexarm.Robot, tmp_path: Path) -> None:
    ways = {"iterations": 0, "sweep": False}
    found = flexarm.compensate(kr210, "point_to_point", shaper="optimal", delay=0.15, band=0.05, **ways).to_dict()
    flags = ("--shape", "optimal", "--delay", "0.15", "--band", "0.05", "--iterations", "0", "--no-sweep", "--no-files")
    theirs = told("compensate", "kr210", "point_to_point", *flags, cwd=tmp_path)
    assert without_clock(found) == without_clock(theirs)
    assert found["shaper"]["kind"] == "optimal" and found["shaper_delay_s"] <= 0.15
    assert sum(part for _, part in found["shaper"]["copies"]) == pytest.approx(1.0, abs=1e-12)
    assert all(mode["after_m"] < 0.3 * found["shaper"]["modes"][0]["before_m"] for mode in found["shaper"]["modes"])
    with pytest.raises(ValueError, match="band"):
        flexarm.compensate(kr210, "point_to_point", shaper="optimal", band=0.9, **ways)


def test_targets_of_servos_are_told_ahead_of_their_lag() -> None:
    found = flexarm.compensate(flexarm.load("kr300"), drives="servo", iterations=2, sweep=False)
    assert found.after["peak_m"] < 0.01 * found.before["peak_m"]


def test_a_plan_chooses_among_levers_points_and_gauges() -> None:
    levers = [[0.0, 0.0, 0.0], [0.0, 0.5, 0.0]]
    robot = flexarm.load("kr210_identified")
    plan = flexarm.plan_measurements(robot, 8, levers=levers, points=levers, gauges=[[0.0, 0.0, 1.0]])
    assert any(pose["at"] == levers[1] and pose["point"] == levers[1] for pose in plan["poses"])
    assert all(pose["direction"] == [0.0, 0.0, 1.0] for pose in plan["poses"])
    with pytest.raises(ValueError, match="levers"):
        flexarm.plan_measurements(robot, 3, levers=[[0.0, 1.0]])


def test_limits_of_depth_of_a_map_are_those_of_lobes(kr210: flexarm.Robot) -> None:
    joints = {"joint_2": (-1.2, -1.0, 2), "joint_3": (1.4, 1.4, 1)}
    found = flexarm.map(kr210, joints=joints, at=[0, 0, 0, 0, 0.6, 0], tool="endmill_20mm", rpm=[8000.0])
    assert found.to_dict()["by"] == "depth_m"
    depths = found["depth_m"]
    for k, joint_2 in enumerate([-1.2, -1.0]):
        q = [0, joint_2, 1.4, 0, 0.6, 0]
        alone = flexarm.lobes(kr210, "endmill_20mm", q=q, rpm=[8000.0])
        assert depths[k] == alone["stable_below_m"]


def test_maps_over_places_stop_on_what_is_wrong(kr210: flexarm.Robot) -> None:
    found = flexarm.map(kr210, bounds=[[1.4, -0.4, 0.4], [2.0, 0.4, 1.2]], spacing=0.2)
    assert len(found) > 10
    with pytest.raises(ValueError, match="exclude each other"):
        flexarm.map(kr210, spacing=0.1, along="point_to_point")
    with pytest.raises(flexarm.MapError):
        flexarm.map(kr210, spacing=-1.0)
    with pytest.raises(ValueError, match=r"bounds has the shape \(3, 2\)"):
        flexarm.map(kr210, bounds=np.zeros((3, 2)))


def test_a_robot_is_made_of_values(tmp_path: Path) -> None:
    folder = SHARE / "robots/kr210"
    keys = tomllib.loads((folder / "robot.toml").read_text())
    same = flexarm.robot(keys, folder)
    assert np.array_equal(same.flexible().statics(WORKING_POSE).compliance, flexarm.load(folder).flexible().statics(WORKING_POSE).compliance)
    lighter = flexarm.robot({**keys, "payload": {**keys["payload"], "mass": 10.0}}, folder)
    again = pickle.loads(pickle.dumps(lighter))
    for robot in [lighter, again]:
        sag = np.linalg.norm(robot.flexible().statics(WORKING_POSE).deflection)
        assert sag < 0.9 * np.linalg.norm(same.flexible().statics(WORKING_POSE).deflection)
    with pytest.raises(flexarm.RobotError, match="unknown field `tpc`"):
        flexarm.robot({"urdf": "kr210.urdf", "tpc": 1}, folder)
    with pytest.raises(flexarm.RobotError, match="there is no file"):
        flexarm.robot({"urdf": "kr211.urdf"}, folder)


def test_a_robot_file_is_made_of_a_urdf(tmp_path: Path) -> None:
    urdf = next((SHARE / "robots/kr210").glob("*.urdf"))
    made = flexarm.new_robot(urdf, tmp_path / "mine", payload=10.0)
    robot = flexarm.load(tmp_path / "mine")
    assert len(robot.joints) == 6 and made["files"]
    robot.flexible().statics(WORKING_POSE)
    with pytest.raises(flexarm.FileError, match="overwrite"):
        flexarm.new_robot(urdf, tmp_path / "mine")


def test_limits_of_depth_are_those_of_the_command(kr210: flexarm.Robot, tmp_path: Path) -> None:
    q = np.radians([0, -60, 90, 0, 60, 0])
    found = flexarm.lobes(kr210, "endmill_20mm", q=q, rpm=[4000, 9000], output=tmp_path / "lobes")
    assert [point["spindle_rpm"] for point in found["points"]] == [4000, 9000]
    assert all(0 < point["depth_m"] < 0.02 for point in found["points"])
    line = ["lobes", "kr210", "--at", "0,-60deg,90deg,0,60deg,0", "--tool", "endmill_20mm", "--rpm", "4000,9000", "--no-files"]
    other = told(*line, cwd=tmp_path)
    assert np.allclose([p["depth_m"] for p in found["points"]], [p["depth_m"] for p in other["points"]], rtol=1e-9)
    with pytest.raises(ValueError, match="exclude each other"):
        flexarm.lobes(kr210, "endmill_20mm", q=q, along="milling_square")
    with pytest.raises(flexarm.InputError):
        flexarm.lobes(kr210, "endmill_21mm")


def test_a_study_runs_and_goes_on(tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    study.write_text(
        """format = 1
robot = "one_beam"
metrics = ["peak_mm = 1e3 * tcp.peak_m"]
[options]
step = 0.005
[[parameter]]
path = "motion.speed"
values = [0.6, 0.8, 1.0]
"""
    )
    found = flexarm.sweep(study, tmp_path / "out", progress=lambda done, total: None)
    assert (found["runs"], found["done"], found["failed"]) == (3, 3, 0)
    assert Path(found["file"]).exists()
    again = flexarm.sweep(study, tmp_path / "out")
    assert again["done"] == 3
    study.write_text(study.read_text().replace("motion.speed", "motion.sped"))
    with pytest.raises(flexarm.InputError, match="matches no entry"):
        flexarm.sweep(study, tmp_path / "other")
