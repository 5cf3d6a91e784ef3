"""Snapshot of instruction counts of the numeric kernels, which shows regressions without timing.

    python3 tools/instruction_counts.py            count and compare with docs/performance/instructions.json; status 1 beyond 5 %
    python3 tools/instruction_counts.py --write    store the current counts

Each kernel of the example `kernels` runs twice under valgrind, with more calls the second time; the
difference is the count per call. Counts depend on compiler and processor family: if these differ
from the stored ones, or valgrind is missing, nothing is compared, and the script prints that. A
lower count is also reported: the snapshot should then be updated.
"""
import argparse
import json
import os
import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "docs" / "performance" / "instructions.json"
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
# Allowed relative difference from the stored count; builds of other sets of crates differ by up to
# 2 %.
ALLOWED = 0.05
# Number of calls in the first and the second run.
CALLS = {"step_spook": (100, 600), "step_rk4": (100, 600)}
USUAL = (200, 1200)


def instructions(program, kernel, calls):
    command = ["valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null", str(program), kernel, str(calls)]
    done = subprocess.run(command, capture_output=True, text=True)
    found = re.search(r"I\s+refs:\s+([\d,]+)", done.stderr)
    if done.returncode != 0 or not found:
        sys.exit(f"{' '.join(command)}: {done.stderr.strip().splitlines()[-1:]}")
    return int(found.group(1).replace(",", ""))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="store the counts")
    parser.add_argument("--kernels", default=str(TARGET / "release" / "examples" / "kernels"), help="the example")
    arguments = parser.parse_args()
    if not shutil.which("valgrind"):
        print("skipped: there is no valgrind")
        return
    if not Path(arguments.kernels).exists():
        sys.exit(f"there is no {arguments.kernels}: cargo build --release --examples")
    here = dict(rustc=subprocess.run(["rustc", "--version"], capture_output=True, text=True, cwd=ROOT).stdout.strip(), machine=platform.machine())
    stored = json.loads(STORE.read_text()) if STORE.exists() else None
    if stored and not arguments.write and {key: stored[key] for key in here} != here:
        print(f"skipped: the counts are of {stored['rustc']} on {stored['machine']}, here is {here['rustc']} on {here['machine']}")
        return
    names = subprocess.run([arguments.kernels], capture_output=True, text=True, check=True).stdout.split()
    counts = {}
    for name in names:
        few, many = CALLS.get(name, USUAL)
        counts[name] = round((instructions(arguments.kernels, name, many) - instructions(arguments.kernels, name, few)) / (many - few))
    failed = False
    print(f"{'kernel':<26}{'instructions':>14}{'stored':>10}")
    for name, count in counts.items():
        before = stored["counts"].get(name) if stored else None
        change = (count - before) / before if before else None
        told = "" if change is None else f"{100 * change:+.1f} %"
        print(f"{name:<26}{count:>14}{before if before else '-':>10}  {told}")
        failed = failed or not before or abs(change) > ALLOWED
    gone = sorted(set(stored["counts"]) - set(counts)) if stored else []
    if arguments.write:
        STORE.parent.mkdir(exist_ok=True)
        STORE.write_text(json.dumps(dict(**here, counts=counts), indent=1) + "\n")
    elif failed or gone:
        sys.exit(f"more than {100 * ALLOWED:g} % apart, or not stored{': gone are ' + ', '.join(gone) if gone else ''}; if that is meant: python3 tools/instruction_counts.py --write")


if __name__ == "__main__":
    main()
