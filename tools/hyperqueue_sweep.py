#!/usr/bin/env python3
"""Runs a study through HyperQueue with a restart and compares the bytes.

    pip install hyperqueue
    python3 tools/hyperqueue_sweep.py                          # the release build in target/
    python3 tools/hyperqueue_sweep.py --program PATH --shards 12

The server and its workers run on this machine. The workers of the Python package run in the process
of its server, so both are killed with their tasks (SIGKILL to the whole process group) after the
first runs are stored; then the shards are submitted to a new server. Without the package it prints
a message and ends with status 0. Status 1 if the merged table differs in any byte from that of a
run on one machine.
"""
import argparse
import importlib.util
import os
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
metrics = ["tcp.peak_m", "tcp.rms_m", "frequencies_hz.0"]

[options]
step = 0.005

[[parameter]]
path = "payload.mass"
from = 50.0
to = 200.0
count = 6

[[parameter]]
path = "drive.*.gearbox.stiffness"
each = true
as = "factor"
distribution = "lognormal"
median = 1.0
sigma = 0.1

[sample]
method = "sobol"
count = 128
seed = 7
"""


def runs_kept(results):
    """Returns the number of journal lines so far."""
    parts = results / "parts"
    return sum(path.read_bytes().count(b"\n") for path in parts.glob("*.journal")) if parts.exists() else 0


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("--program", type=Path, default=ROOT / "target/release/flexarm")
    ap.add_argument("--shards", type=int, default=8)
    ap.add_argument("--workers", type=int, default=2)
    args = ap.parse_args()
    if importlib.util.find_spec("hyperqueue") is None:
        print("skipped: there is no package hyperqueue (pip install hyperqueue)")
        return 0
    program = args.program.resolve()
    with tempfile.TemporaryDirectory() as scratch:
        scratch = Path(scratch)
        study, results = scratch / "scatter.toml", scratch / "results"
        study.write_text(STUDY)
        quiet = {"check": True, "stdout": subprocess.DEVNULL}
        subprocess.run([program, "sweep", study, "-o", scratch / "alone", "--quiet"], **quiet)
        subprocess.run([program, "sweep", "plan", study, "-n", str(args.shards), "--engine", "hyperqueue",
                        "--results", results, "-o", scratch / "plan"], **quiet)
        submit = [sys.executable, scratch / "plan/submit.py", "--local", str(args.workers)]
        log = open(scratch / "log.txt", "w")
        first = subprocess.Popen(submit, stdout=log, stderr=log, start_new_session=True, cwd=scratch)
        while first.poll() is None and runs_kept(results) < 40:
            time.sleep(0.01)
        was_running = first.poll() is None
        before = runs_kept(results)
        children = subprocess.run(["ps", "-o", "pid=", "--ppid", str(first.pid)], capture_output=True, text=True).stdout.split()
        for pid in [first.pid, *map(int, children)]:
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
        first.wait()
        print(f"killed server, {args.workers} workers and {len(children)} shards after {before} of 768 runs")
        time.sleep(0.5)
        kept = runs_kept(results)
        second = subprocess.run(submit, stdout=log, stderr=log, cwd=scratch)
        if second.returncode != 0:
            print((scratch / "log.txt").read_text()[-3000:])
            return 1
        alone, merged = ((scratch / name / "runs.parquet").read_bytes() for name in ("alone", "results"))
        good = alone == merged and was_running and kept >= before
        print(f"{args.shards} shards, {kept} runs kept, then the rest: {len(merged)} bytes, {'equal' if alone == merged else 'DIFFERENT'}")
        return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
