"""Helpers of the tests. They run on the installed package, never on the sources next to them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import flexarm

SHARE = Path(flexarm.__file__).parent / "share"
#: Every shipped robot.
ROBOTS = sorted(file.parent.name for file in (SHARE / "robots").rglob("robot.toml"))
#: A pose of the KR 210 within its limits (rad).
WORKING_POSE = [0.0, -1.2, 1.5, 0.0, 0.4, 0.0]


def command(*words: Any, cwd: Path) -> "subprocess.CompletedProcess[str]":
    """Run the command line of the installed package."""
    line = [sys.executable, "-m", "flexarm", *map(str, words)]
    return subprocess.run(line, cwd=cwd, capture_output=True, text=True, check=False)


@pytest.fixture(scope="session")
def kr210() -> flexarm.Robot:
    return flexarm.load("kr210")


@pytest.fixture(scope="session")
def arm(kr210: flexarm.Robot) -> flexarm.Arm:
    return kr210.flexible()


@pytest.fixture(scope="session")
def run(arm: flexarm.Arm) -> flexarm.Run:
    return arm.simulate()
