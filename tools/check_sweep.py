#!/usr/bin/env python3
"""Reads the table of a new study with pandas and DuckDB (docs/sweep.md) and compares both.

    pip install pandas pyarrow duckdb
    python3 tools/check_sweep.py                 # the release build in target/
    python3 tools/check_sweep.py --program PATH

Missing packages are skipped with a message. The study also has failing runs and a text parameter:
nulls and texts must be read back as such. The program is killed twice during the study and
continued: the bytes must equal those of an uninterrupted study.
"""
import argparse
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STUDY = """format = 1
robot = "kr210"
motion = "pick_and_place"
metrics = ["peak_mm = 1e3 * tcp.peak_m", "tcp.overshoot_m", "tcp.settling_s"]

[options]
step = 0.01

[[parameter]]
path = "payload.mass"
from = 50.0
to = 200.0
count = 4

[[parameter]]
path = "motion.speed"
values = [0.8, 1.0, 30.0]

[[parameter]]
path = "options.links"
values = ["lumped", "rigid"]

[[parameter]]
path = "drive.joint_2.gearbox.stiffness"
as = "factor"
distribution = "normal"
mean = 1.0
std = 0.1

[sample]
count = 12
"""


def examples():
    """Returns the pandas and the DuckDB code of the page."""
    page = (ROOT / "docs/sweep.md").read_text()
    return [re.search(rf"```{language}\n(.*?)```", page, re.S)[1] for language in ("python", "sql")]


def killed(program, study, folder):
    """Starts the study, kills it twice, and lets it finish."""
    for wanted in (20, 90):
        process = subprocess.Popen([program, "sweep", study, "-o", folder, "--quiet"], stdout=subprocess.DEVNULL)
        journal = folder / "parts/1-of-1.journal"
        while process.poll() is None and not (journal.exists() and journal.read_bytes().count(b"\n") >= wanted):
            time.sleep(0.005)
        if process.poll() is not None:
            return "it ended before it could be killed"
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        if journal.read_bytes().count(b"\n") < wanted:
            return "runs were lost"
    subprocess.run([program, "sweep", study, "-o", folder, "--quiet"], check=True, stdout=subprocess.DEVNULL)
    return None


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("--program", type=Path, default=ROOT / "target/release/flexarm")
    program = ap.parse_args().program.resolve()
    with tempfile.TemporaryDirectory() as scratch:
        scratch = Path(scratch)
        study = scratch / "payload_speed.toml"
        study.write_text(STUDY)
        subprocess.run([program, "sweep", study, "--quiet"], check=True, cwd=scratch, stdout=subprocess.DEVNULL)
        table = scratch / "out/payload_speed/runs.parquet"
        fault = killed(program, study, scratch / "killed")
        same = fault is None and table.read_bytes() == (scratch / "killed/runs.parquet").read_bytes()
        print(f"killed twice and resumed: {fault or ('equal bytes' if same else 'DIFFERENT bytes')}")
        python, sql = examples()
        os.chdir(scratch)
        found = {}
        try:
            import pandas as pd
            frame = pd.read_parquet(table)
            exec(python, {})
            done = frame[frame["status"] == "done"]
            assert frame["run"].tolist() == list(range(len(frame))) and len(frame) == 4 * 3 * 2 * 12
            failed = frame[frame["status"] == "failed"]
            assert (failed["motion.speed"] == 30).all() and failed["peak_mm"].isna().all() and failed["reason"].notna().all()
            assert done["peak_mm"].notna().all() and done["reason"].isna().all()
            assert set(frame["options.links"]) == {"lumped", "rigid"}
            found["pandas"] = done.groupby(["payload.mass", "motion.speed"])["peak_mm"].mean().tolist()
        except ImportError as error:
            print(f"skipped pandas: {error}")
        try:
            import duckdb
            rows = duckdb.sql(sql.split("\n", 1)[1]).fetchall()
            print(*rows, sep="\n")
            found["duckdb"] = [row[2] for row in rows]
        except ImportError as error:
            print(f"skipped DuckDB: {error}")
        means = list(found.values())
        agree = all(len(m) == len(means[0]) and max(abs(a - b) for a, b in zip(m, means[0])) < 1e-12 for m in means)
        print(f"{' and '.join(found) or 'nothing'} read the table{'' if agree else ', and DIFFER'}")
        return 0 if agree and same else 1


if __name__ == "__main__":
    sys.exit(main())
