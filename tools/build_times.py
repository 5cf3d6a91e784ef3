#!/usr/bin/env python3
"""CPU seconds of a build from nothing, crate by crate. Plain Python 3, needs cargo.

    python3 tools/build_times.py                                 the default program, in a new target folder
    python3 tools/build_times.py --target target --check         in that folder; status 1 above the bound
    python3 tools/build_times.py -- test --release --no-run      another command of cargo

Each call of rustc is timed by this script, which cargo calls as RUSTC_WRAPPER. What cargo used beyond these calls are
build scripts and the C sources that they compile. The bound is a ratio to one crate that is built in the same run, so
that it holds on slow machines too. Crates that a target folder has already are not built again: then there is no check.
"""
import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LOG = "FLEXARM_BUILD_TIMES"
REFERENCE = "faer"  # the crate to which the sum is compared
MAX_RATIO = 42.0  # CPU seconds of the default program over those of the reference; 27 to 30 measured


def children():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def time_rustc():
    """Runs rustc as cargo asks for, and adds a line to the log."""
    arguments = sys.argv[1:]
    status = subprocess.run(arguments, close_fds=False).returncode  # the job server's pipe stays open
    crate = next((arguments[k + 1] for k, word in enumerate(arguments[:-1]) if word == "--crate-name"), None)
    if crate not in (None, "___"):
        kind = " (tests)" if "--test" in arguments else " (build script)" if crate.startswith("build_script") else ""
        with open(os.environ[LOG], "a") as log:
            log.write(f"{crate}{kind}\t{children():.3f}\n")
    sys.exit(status)


def build(command, target):
    """Returns CPU seconds by crate, CPU seconds in all, and wall seconds."""
    with tempfile.TemporaryDirectory() as scratch:
        log = Path(scratch, "log")
        log.touch()
        environment = {
            **os.environ, "RUSTC_WRAPPER": str(Path(__file__).resolve()), LOG: str(log),
            "CARGO_TARGET_DIR": str(target or Path(scratch, "target")),
        }
        begin, before = time.monotonic(), children()
        status = subprocess.run(["cargo", *command], cwd=ROOT, env=environment).returncode
        wall, used = time.monotonic() - begin, children() - before
        if status != 0:
            sys.exit(status)
        by_crate = defaultdict(float)
        for line in log.read_text().splitlines():
            crate, seconds = line.split("\t")
            by_crate[crate] += float(seconds)
    return by_crate, used, wall


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--target", type=Path, help="target folder [default: a new one]")
    parser.add_argument("--check", action="store_true", help=f"status 1 if the sum is above {MAX_RATIO} times {REFERENCE}")
    parser.add_argument("--rows", type=int, default=40, help="crates to list [default: %(default)s]")
    parser.add_argument("command", nargs="*", default=["build", "--release"], help="of cargo [default: build --release]")
    options = parser.parse_args()

    by_crate, used, wall = build(options.command, options.target)
    rustc = sum(by_crate.values())
    own = sum(seconds for crate, seconds in by_crate.items() if crate.startswith("flexarm"))
    print(f"{used:.0f} CPU s in {wall:.0f} s: own crates {own:.0f}, others {rustc - own:.0f}, "
          f"build scripts and C {used - rustc:.0f}")
    for crate, seconds in sorted(by_crate.items(), key=lambda row: -row[1])[:options.rows]:
        print(f"{seconds:8.1f}  {crate}")
    if not options.check:
        return
    reference = by_crate.get(REFERENCE)
    if reference is None:
        print(f"not checked: {REFERENCE} was built before")
        return
    ratio = used / reference
    print(f"{ratio:.1f} times {REFERENCE}, at most {MAX_RATIO}")
    if ratio > MAX_RATIO:
        sys.exit("the build has become heavier: find the crate above, or say in the commit why the bound moves")


if __name__ == "__main__":
    time_rustc() if LOG in os.environ and len(sys.argv) > 1 and "rustc" in Path(sys.argv[1]).name else main()
