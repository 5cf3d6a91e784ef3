#!/usr/bin/env python3
"""Checks the package of integrations/ros2_control as far as it goes without ROS.

    cargo build --release -p flexarm-fmu && python3 tools/check_ros2_control.py

Compiles and runs the tests of the arm under commands, and checks that the example names the plugin
and joints that there are. Without a C++ compiler it says 'skipped'.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "integrations/ros2_control"
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve() / "release"


def names_fit():
    """Returns what does not fit between the files of the package."""
    wrong = []
    plugin = ElementTree.parse(PACKAGE / "flexarm_ros2_control.xml").find("class")
    tag = ElementTree.parse(PACKAGE / "description/kr210.ros2_control.urdf").find("ros2_control")
    source = (PACKAGE / "src/flexarm_system.cpp").read_text()
    if tag.findtext("hardware/plugin") != plugin.get("name"):
        wrong.append("the example does not name the plugin of flexarm_ros2_control.xml")
    if plugin.get("type") not in source:
        wrong.append("the source does not export the class of flexarm_ros2_control.xml")

    urdf = ElementTree.parse(ROOT / "robots/kr210/kr210.urdf")
    moving = [joint.get("name") for joint in urdf.iter("joint") if joint.get("type") != "fixed"]
    if [joint.get("name") for joint in tag.iter("joint")] != moving:
        wrong.append("the example does not name the joints of robots/kr210")
    controllers = (PACKAGE / "config/kr210_controllers.yaml").read_text()
    if re.search(r"^    joints: \[(.*)\]", controllers, re.M).group(1).split(", ") != moving:
        wrong.append("the controllers do not name the joints of robots/kr210")
    return wrong


def main():
    wrong = names_fit()
    for text in wrong:
        print(text)
    compiler = os.environ.get("CXX", "c++")
    if shutil.which(compiler) is None:
        print(f"skipped: there is no {compiler}")
        return int(bool(wrong))
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "test_commanded_arm"
        includes = [PACKAGE / "include", ROOT / "crates/faces/flexarm-fmu/include"]
        command = [compiler, "-std=c++17", "-O1", "-Wall", "-Wextra", "-Wconversion", "-Werror"]
        command += [f"-I{path}" for path in includes]
        command += [PACKAGE / "test/test_commanded_arm.cpp", f"-L{TARGET}", "-lflexarm_fmu"]
        subprocess.run([*command, f"-Wl,-rpath,{TARGET}", "-o", program], check=True)
        tests = subprocess.run([program, ROOT / "robots"])
    return int(bool(wrong) or tests.returncode != 0)


if __name__ == "__main__":
    sys.exit(main())
