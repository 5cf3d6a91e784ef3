#!/usr/bin/env python3
"""Writes the output of ROS's xacro for the test files of flexarm-urdf, as NAME.expected.xml.

The files are in crates/robot/flexarm-urdf/tests/data/xacro; results are written next to them.

Needs xacro from PyPI (2.1.1 was used, with PyYAML 6.0.3): python3 tools/xacro_expectations.py
The package test_parts, required by one file, is that folder itself; its path is written as PACKAGE.
"""
import sys
import types
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / "crates/robot/flexarm-urdf/tests/data/xacro"

packages = types.ModuleType("ament_index_python.packages")
packages.get_package_share_directory = lambda name: {"test_parts": str(FOLDER)}[name]
sys.modules["ament_index_python"] = types.ModuleType("ament_index_python")
sys.modules["ament_index_python.packages"] = packages

import xacro  # noqa: E402, it looks for the module above


def without_comments(node):
    for child in list(node.childNodes):
        if child.nodeType == child.COMMENT_NODE:
            node.removeChild(child)
        else:
            without_comments(child)


for path in sorted(FOLDER.glob("*.xacro")):
    document = xacro.process_file(str(path))
    without_comments(document)
    text = document.toprettyxml(indent="  ").replace(str(FOLDER), "PACKAGE")
    path.with_suffix(".expected.xml").write_text(text)
    print(f"{path.name}: {text.count(chr(10))} lines")
