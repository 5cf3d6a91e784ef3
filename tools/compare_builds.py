#!/usr/bin/env python3
"""Compares the output of two builds on all shipped robots, steppers and link models.

    python3 tools/compare_builds.py OLD/flexarm NEW/flexarm [--only WORD] [--keep FOLDER]

For changes that must not change results. Each case runs once with either program, into the same
folder, so that paths in the files are equal. Compares exit status, recordings (.csv, .mcap,
.parquet) and pages byte by byte, the keys of summary.json, and its values except timings. A case
that both refuse with the same message is equal. Prints one line per differing case, and one at the
end; exit status 1 if any differs.
"""
import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
ROBOTS = ["abb_three_mass", "kr210", "robots/kr210/beams.toml", "robots/kr210/drives.toml", "robots/kr210/links.toml", "kr210_identified",
          "robots/kr210_identified/loaded.toml", "kr500_identified", "lower_arm", "manutec_r3", "one_beam", "robots/test/one_beam/mesh.toml",
          "reference_arm", "reference_arm_coupled", "three_beams", "robots/test/three_beams/mesh.toml"]
# Options that cover each stepper, link model and initial state; short motions, few samples.
RUNS = [
    ["--stepper", "generalized-alpha"],
    ["--stepper", "generalized-alpha", "--no-dispersion-correction", "--links", "modal", "--parquet"],
    ["--stepper", "rk4", "--step", "0.0001"],
    ["--stepper", "spook", "--links", "lumped"],
    ["--stepper", "spook", "--spook-form", "global", "--spook-preset", "source", "--links", "lumped"],
    ["--stepper", "reference", "--rtol", "1e-6", "--from-rest", "undeformed"],
    ["--links", "lumped", "--segments", "2", "--drives", "elastic"],
    ["--drives", "servo", "--loads", "trajectories/pick_and_place.loads.toml"],
]
POINTS = [["inspect"], ["check"], ["statics"], ["modes"], ["response", "--points", "50"]]
CLOCK = re.compile(r"cpu|wall|elapsed|real_time", re.I)
# Computation times in pages.
TOOK = re.compile(r"simulated in [^<\n]*? processor time|^\| (?:wall|CPU) time \|.*$", re.M)


def run(program, words, timeout=900):
    done = subprocess.run([program, *words], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=timeout)
    return done.returncode, done.stdout, done.stderr.decode(errors="replace")


def without_clock(value):
    """Replaces timings in a JSON value; keeps the keys."""
    if isinstance(value, dict):
        return {k: ("*" if CLOCK.search(k) else without_clock(v)) for k, v in value.items()}
    if isinstance(value, list):
        return [without_clock(v) for v in value]
    return value


def content(path):
    if path.suffix == ".json":
        return json.dumps(without_clock(json.loads(path.read_text(encoding="utf-8"))), sort_keys=True, indent=1)
    if path.suffix in (".html", ".md"):
        return TOOK.sub("", path.read_text(encoding="utf-8"))
    if path.suffix == ".rrd":
        return b""  # Rerun's SDK derives identifiers from time and random numbers
    return path.read_bytes()


def differing(old, new):
    """Returns the names of files that differ, with the first differing position."""
    found = []
    names = {p.relative_to(f) for f in (old, new) for p in f.rglob("*") if p.is_file()} if old.exists() or new.exists() else set()
    for name in sorted(names):
        a, b = old / name, new / name
        if not a.exists() or not b.exists():
            found.append(f"{name} is only in the {'new' if b.exists() else 'old'} result")
            continue
        one, two = content(a), content(b)
        if one != two:
            place = next((i for i, (x, y) in enumerate(zip(one, two)) if x != y), min(len(one), len(two)))
            show = lambda t: repr(t[max(0, place - 30): place + 50])
            found.append(f"{name} differs at {place}: {show(one)} | {show(two)}")
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--only", default="", help="cases whose words contain this")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for results that differ")
    given = parser.parse_args()
    programs = [str(pathlib.Path(p).resolve()) for p in (given.old, given.new)]
    cases = [["compare", robot, *words, "--log-rate", "50", "-q"] for robot in ROBOTS for words in RUNS]
    cases += [[*point, robot, "--json"] for robot in ROBOTS for point in POINTS if point[0] != "check"]
    cases += [["check", robot] for robot in ROBOTS]
    cases = [c for c in cases if given.only in " ".join(c)]
    different = refused = files = 0
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        for case in cases:
            results, folders = [], []
            for which, program in zip(("old", "new"), programs):
                out = scratch / "out"
                words = case + ["-o", str(out)] if case[0] in ("compare", "response") else case
                code, stdout, stderr = run(program, words)
                if "--json" in case and stdout:
                    stdout = json.dumps(without_clock(json.loads(stdout)), sort_keys=True).encode()
                results.append((code, stdout if case[0] != "compare" else b"", stderr if code else ""))
                kept = scratch / which
                shutil.rmtree(kept, ignore_errors=True)
                if out.exists():
                    out.rename(kept)
                folders.append(kept)
            problems = differing(*folders)
            files += sum(1 for p in folders[1].rglob("*") if p.is_file()) if folders[1].exists() else 0
            if results[0] != results[1]:
                problems.append(f"exit status or words differ: {results[0][0]} {results[0][2][:300]!r} | {results[1][0]} {results[1][2][:300]!r}")
            refused += results[1][0] != 0 and not problems
            if problems:
                different += 1
                print("flexarm " + " ".join(case))
                for problem in problems:
                    print("   ", problem)
                if given.keep:
                    for which, folder in zip(("old", "new"), folders):
                        if folder.exists():
                            shutil.copytree(folder, given.keep / re.sub(r"\W+", "_", " ".join(case)) / which, dirs_exist_ok=True)
    print(f"{len(cases)} cases, {files} files: {different} differ; {refused} are refused alike by both")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
