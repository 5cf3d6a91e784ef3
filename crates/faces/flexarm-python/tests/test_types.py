"""The stubs match the module, and the examples pass strict type checkers."""

import inspect
import os
import subprocess
import sys
from pathlib import Path

import pytest

from flexarm import _flexarm

EXAMPLES = Path(os.environ.get("FLEXARM_EXAMPLES", Path(__file__).parent.parent / "examples"))
PROGRAMS = sorted(EXAMPLES.glob("*.py"))


def checked(*line: object, cwd: Path) -> None:
    done = subprocess.run([sys.executable, "-m", *map(str, line)], cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_stubs_are_those_of_the_module(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    checked("mypy.stubtest", "flexarm._flexarm", "--concise", cwd=tmp_path)


def test_the_stub_of_a_wheel_has_the_docstrings_of_the_module() -> None:
    stub = Path(_flexarm.__file__).with_name("_flexarm.pyi").read_text()
    if stub.count('"""') < 10:
        pytest.skip("docstrings are put into the stubs of wheels")
    classes = [owner for owner in vars(_flexarm).values() if isinstance(owner, type)]
    members = [getattr(owner, name) for owner in classes for name in vars(owner) if not name.startswith("_")]
    first_lines = [doc.splitlines()[0] for member in members if (doc := inspect.getdoc(member))]
    assert len(first_lines) > 100
    assert [line for line in first_lines if line not in stub] == []


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
