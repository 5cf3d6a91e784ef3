"""The stubs match the module, and the examples pass strict type checkers."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(os.environ.get("FLEXARM_EXAMPLES", Path(__file__).parent.parent / "examples"))
PROGRAMS = sorted(EXAMPLES.glob("*.py"))


def checked(*line: object, cwd: Path) -> None:
    done = subprocess.run([sys.executable, "-m", *map(str, line)], cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_stubs_are_those_of_the_module(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    checked("mypy.stubtest", "flexarm._flexarm", "--concise", cwd=tmp_path)


def test_package_and_examples_are_clean_under_mypy(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    checked("mypy", "--strict", "-p", "flexarm", cwd=tmp_path)
    checked("mypy", "--strict", *PROGRAMS, cwd=tmp_path)


def test_examples_are_clean_under_pyright(tmp_path: Path) -> None:
    pytest.importorskip("pyright")
    (tmp_path / "pyrightconfig.json").write_text('{"typeCheckingMode": "strict"}')
    checked("pyright", "-p", tmp_path / "pyrightconfig.json", "--pythonpath", sys.executable, *PROGRAMS, cwd=tmp_path)


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: path.stem)
def test_examples_run(program: Path, tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, program], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    print(done.stdout)
