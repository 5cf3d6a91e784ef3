"""Robots from values: closed forms of a pendulum and a cantilever, and equality with files."""

import json
import pickle

import numpy as np
import pytest
from conftest import SHARE, WORKING_POSE

import flexarm

tomllib = pytest.importorskip("tomllib")


STEEL = {"E": 210e9, "nu": 0.3, "rho": 7850.0}


def cantilever(model: str = "modal") -> flexarm.RobotBuilder:
    """A nearly massless steel rod of 1 m along x on a held hinge about z; 2 kg at its end."""
    builder = flexarm.RobotBuilder(name="cantilever").link("base").link("rod", 1e-6).link("tool0")
    builder.joint("hinge", "base", "rod", axis=[0, 0, 1], lower=-1.0, upper=1.0)
    builder.joint("tip", "rod", "tool0", "fixed", xyz=[1.0, 0.0, 0.0])
    builder.payload(2.0).gravity([0.0, 0.0, -9.81])
    shape = {"diameter": 0.03, "theory": "euler-bernoulli", "parts": "uniform"}
    return builder.beam("rod", "circle", material=STEEL, model=model, **shape)


@pytest.mark.parametrize("model", ["lumped", "modal"])
def test_a_rod_of_values_sags_as_the_formula_says(model: str) -> None:
    expected = -2.0 * 9.81 / (3 * STEEL["E"] * np.pi * 0.03**4 / 64)  # F L^3 / 3 E I = 0.78 mm
    found = cantilever(model).build().flexible().statics().deflection[2]
    assert found == pytest.approx(expected, rel=1e-5)


def test_a_pendulum_of_values_weighs_what_it_should() -> None:
    builder = flexarm.RobotBuilder(name="pendulum").link("base")
    builder.link("rod", 2.0, com=np.array([0.0, 0.0, -0.5]), inertia=np.diag([0.17, 0.17, 0.001]))
    builder.joint("hinge", "base", "rod", "continuous", axis=[0, 1, 0])
    model = builder.build().model
    q = 0.3
    # Torque against gravity and moment of inertia about the hinge.
    assert model.gravity([q])[0] == pytest.approx(2.0 * 9.81 * 0.5 * np.sin(q), rel=1e-12)
    assert model.crba([q])[0, 0] == pytest.approx(0.17 + 2.0 * 0.25, rel=1e-12)


def test_the_calls_write_the_keys_of_a_file() -> None:
    """The shipped arm built by calls equals the one from its file, to the last bit."""
    folder = SHARE / "robots/kr210"
    keys = tomllib.loads((folder / "robot.toml").read_text())
    builder = flexarm.RobotBuilder(folder / "kr210.urdf", name="kr210")
    builder.tcp("tool0", [0.0, 0.0, 0.35]).gravity([0.0, 0.0, -9.81])
    builder.payload(150.0, [0.0, 0.0, 0.25], np.diag([5.125, 5.125, 6.25]), "tool0")
    for link, distal in [("link_2", "joint_3"), ("link_3", "joint_4")]:
        builder.reduced(link, f"fe/{link}.flex", distal=distal, model="lumped", segments=2, damping=0.03)
    for drive in keys["drive"]:
        builder.drive(drive["joint"], "gearbox", **drive["gearbox"])
    builder.default_motion(keys["default_trajectory"])
    ours, theirs = builder.build().flexible(), flexarm.load("kr210").flexible()
    assert np.array_equal(ours.simulate(step=4e-3).error, theirs.simulate(step=4e-3).error)
    again = pickle.loads(pickle.dumps(ours))
    assert np.array_equal(again.statics(WORKING_POSE).compliance, theirs.statics(WORKING_POSE).compliance)


def test_a_loaded_robot_is_changed() -> None:
    robot = flexarm.load("kr210", tcp="link_6")
    same = flexarm.RobotBuilder.of(robot).build()
    assert np.array_equal(same.model.fk(WORKING_POSE), robot.model.fk(WORKING_POSE))
    stiff = flexarm.RobotBuilder.of(robot).drive("joint_2", stiffness=1e9, damping=1e4).build()
    drives = [drive for drive in flexarm.RobotBuilder.of(stiff).keys["drive"] if drive["joint"] == "joint_2"]
    assert len(drives) == 1 and drives[0]["gearbox"]["stiffness"] == 1e9
    sag = [np.linalg.norm(r.flexible().statics(WORKING_POSE).deflection) for r in (stiff, robot)]
    assert sag[0] < 0.9 * sag[1]


def test_the_text_of_a_urdf_is_a_robot() -> None:
    folder = SHARE / "robots/kr210"
    text = (folder / "kr210.urdf").read_text()
    builder = flexarm.RobotBuilder(text, folder=folder).set(hold={"joint_6": 0.1}, gravity=np.array([0, 0, -1.6]))
    robot = builder.build()
    assert robot.model.gravity(WORKING_POSE)[1] == pytest.approx(1.6 / 9.81 * flexarm.load(folder / "kr210.urdf").model.gravity(WORKING_POSE)[1])
    assert builder.urdf == text and len(robot.joints) == 6
    assert pickle.loads(pickle.dumps(robot)).joints == robot.joints
    assert json.dumps(builder.keys)


@pytest.mark.parametrize(
    "call, kind, words",
    [
        (lambda b: b.drive("hinge", stiffness=[1.0, 2.0]), ValueError, r"stiffness has the shape \(2,\), expected \(\) or \(3,\)"),
        (lambda b: b.drive("hinge", stiffness=float("nan")), ValueError, "stiffness is nan: expected finite"),
        (lambda b: b.drive("hinge", stiffness="stiff"), ValueError, "stiffness is 'stiff': expected real numbers"),
        (lambda b: b.drive("hing", stiffness=1e4).build(), flexarm.RobotError, '"hing"'),
        (lambda b: b.drive("hinge", stiffness=-1.0).build(), flexarm.RobotError, "positive"),
        (lambda b: b.drive("hinge", stiffnes=1.0).build(), flexarm.RobotError, "unknown field `stiffnes`"),
        (lambda b: b.beam("rod", "cirle", diameter=0.03, material="steel").build(), flexarm.RobotError, '"cirle" is not known'),
        (lambda b: b.beam("rod", "circle", wall=0.03, material="steel").build(), flexarm.RobotError, "needs diameter"),
        (lambda b: b.beam("rd", "circle", diameter=0.03, material="steel").build(), flexarm.RobotError, '"rd"'),
        (lambda b: b.payload(-1.0).build(), flexarm.RobotError, "-1 kg"),
        (lambda b: b.payload(1.0, [0, 0]), ValueError, r"com has the shape \(2,\), expected \(3,\)"),
        (lambda b: b.payload(1.0, inertia=[[1, 2, 0], [0, 1, 0], [0, 0, 1]]), ValueError, "not symmetric"),
        (lambda b: b.joint("j", "base", "x"), ValueError, "needs lower and upper"),
        (lambda b: b.joint("j", "base", "x", "ball"), ValueError, "kind='ball': expected one of"),
        (lambda b: b.joint("j", "base", "x", "fixed").build(), flexarm.UrdfError, '"x"'),
        (lambda b: b.link("lost").build(), flexarm.UrdfError, "lost"),
        (lambda b: b.tcp("hand").build(), flexarm.InputError, "hand"),
        (lambda b: b.add("balancer", joint="hinge", spring={"rate": np.inf}), ValueError, r"balancer.spring.rate is inf"),
        (lambda b: b.add("ballancer", joint="hinge").build(), flexarm.RobotError, "unknown field `ballancer`"),
        (lambda b: flexarm.RobotBuilder.of(flexarm.load("kr210")).link("x"), ValueError, "cannot be added to a URDF"),
        (lambda b: flexarm.RobotBuilder().build(), ValueError, "there are no links"),
    ],
)
def test_what_is_wrong_is_said_without_places_in_texts_that_nobody_wrote(call, kind, words: str) -> None:
    with pytest.raises(kind, match=words) as caught:
        call(cantilever())
    assert "robot of values" not in str(caught.value), str(caught.value)
