"""Messages other than results go through ``logging``; nothing is printed unless requested."""

import logging
import re
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from conftest import SHARE, command

import flexarm

JOB = SHARE / "robots/test/lower_arm/lower_arm.reduce.toml"


def test_files_and_runs_are_logged(arm: flexarm.Arm, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.DEBUG, "flexarm"):
        run = arm.simulate(step=4e-3, output=tmp_path, formats=["csv"])
    told = [(record.name, record.levelname, record.getMessage()) for record in caplog.records]
    assert ("flexarm", "INFO", f"wrote {run.files['csv']}") in told
    assert ("flexarm", "DEBUG", f"ran {repr(run)[5:-1]}") in told


def test_steps_of_a_reduction_are_logged_in_order(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "flexarm"):
        flexarm.reduce(JOB)
    steps = [record.args for record in caplog.records if record.msg == "%s (%d of %d)"]
    assert steps[0][0] == "reading the mesh" and [step[1] for step in steps] == list(range(1, len(steps) + 1))


def test_notes_are_logged_and_warnings_warned_as_the_command_line_says(arm: flexarm.Arm, caplog: pytest.LogCaptureFixture) -> None:
    heavy = flexarm.Payload.attach(0.0, 5000.0, [0.0, 0.0, 0.2])
    with caplog.at_level(logging.INFO, "flexarm"), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run = arm.simulate("point_to_point", step=4e-3, payloads=[heavy])
    notes = [c for c in run.caveats if c.severity == "note"]
    logged = [record for record in caplog.records if record.levelname == "INFO"]
    assert [record.caveat.message for record in logged] == [c.message for c in notes]
    # Warnings of one kind are merged into one, with the number of the others.
    more = [re.search(r" \(and (\d+) more of this kind: .*\)$", str(w.message)) for w in caught]
    firsts = [str(w.message)[: m.start()] if m else str(w.message) for w, m in zip(caught, more)]
    assert set(firsts) <= set(run.summary["warnings"])
    assert len(caught) + sum(int(m[1]) for m in more if m) == len(run.summary["warnings"])


def test_nothing_is_printed_unless_somebody_asks(tmp_path: Path) -> None:
    code = "import flexarm; flexarm.new_robot({urdf!r}, 'mine'); flexarm.load('kr210').flexible().simulate(step=4e-3, output='out')"
    urdf = str(next((SHARE / "robots/kr210").glob("*.urdf")))
    run = [sys.executable, "-W", "ignore", "-c", code.format(urdf=urdf)]
    quiet = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert quiet.stdout == quiet.stderr == ""
    run[-1] = "import logging; logging.basicConfig(level=logging.INFO); " + run[-1].replace("'mine'", "'ours'").replace("'out'", "'more'")
    loud = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "INFO:flexarm:wrote " in loud.stderr
    # Findings of a new robot equal the warnings of the command line.
    theirs = command("new", urdf, "-o", "theirs", "--no-run", cwd=tmp_path).stderr
    ours = [line.split(":flexarm:", 1)[1] for line in loud.stderr.splitlines() if line.startswith("WARNING:")]
    assert ours == [line.removeprefix("warning: ") for line in theirs.splitlines() if line.startswith("warning: ")]
