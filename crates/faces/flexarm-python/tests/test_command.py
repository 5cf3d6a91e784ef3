"""The command line of the wheel, in an empty folder."""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from conftest import SHARE, command

import flexarm


def test_the_first_command_works_in_an_empty_folder(tmp_path: Path) -> None:
    done = command("compare", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    files = json.loads(done.stdout)["files"]
    for kind in ["csv", "mcap", "rrd", "report"]:
        assert (tmp_path / files[kind]).stat().st_size > 1000, kind
    assert command("compare", "--parquet", "-q", cwd=tmp_path).returncode == 0
    assert list((tmp_path / "out").rglob("run.parquet"))


def test_shipped_robots_come_from_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    robot = flexarm.load()
    assert robot.path.is_relative_to(SHARE) and robot.default_motion is not None
    assert len(list(SHARE.glob("robots/**/robot.toml"))) == 26
    assert robot.motion("handling").duration > 0


@pytest.mark.skipif(not (SHARE / "lib").exists(), reason="a wheel built from the source package alone")
def test_an_fmu_holds_the_library_of_the_package(tmp_path: Path) -> None:
    done = command("export-fmu", "kr210", "-o", "arm.fmu", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["states"] == 36
    with zipfile.ZipFile(tmp_path / "arm.fmu") as fmu:
        binaries = [name for name in fmu.namelist() if name.startswith("binaries/")]
        assert len(binaries) == 1 and len(fmu.read(binaries[0])) == next((SHARE / "lib").iterdir()).stat().st_size


def test_exit_codes_and_messages_are_those_of_the_program(tmp_path: Path) -> None:
    wrong = command("compare", "kr21", cwd=tmp_path)
    assert wrong.returncode == 2 and 'did you mean "kr210"' in wrong.stderr
    usage = command("compare", "--stpe", "1", cwd=tmp_path)
    assert usage.returncode == 2 and "--step" in usage.stderr
    flags = command("compare", "--step", "100", cwd=tmp_path)
    assert flags.returncode == 2 and "--step 100 s" in flags.stderr
    assert command("--help", cwd=tmp_path).returncode == 0
    version = command("--version", cwd=tmp_path)
    assert version.stdout.strip() == f"flexarm {flexarm.__version__}"


def test_there_is_a_script(tmp_path: Path) -> None:
    script = Path(sys.executable).parent / "flexarm"
    if not script.exists():
        pytest.skip("the package is not installed with its scripts")
    done = subprocess.run([script, "inspect", "one_beam", "--json"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0 and json.loads(done.stdout)["robot"] == "one_beam"


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_ends_the_command_with_readable_files(tmp_path: Path) -> None:
    import signal
    import time

    line = [sys.executable, "-m", "flexarm", "compare", "--step", "1e-6", "-o", "out"]
    child = subprocess.Popen(line, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    while not (tmp_path / "out" / "run.csv").exists():
        time.sleep(0.05)
        assert child.poll() is None
    time.sleep(0.5)
    child.send_signal(signal.SIGINT)
    _, said = child.communicate(timeout=30)
    assert child.returncode == 1 and "complete and readable" in said
