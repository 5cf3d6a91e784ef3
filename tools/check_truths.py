#!/usr/bin/env python3
"""Checks that the stored results of other programs match the current input files. Plain Python 3.

    python3 tools/check_truths.py        status 1 and one line per file that has changed since

Each tests/verification/*.json lists the input files of its program with their SHA-256, and the
script that writes it again. Files under "outside" are not in the project and cannot be checked.
"""
import hashlib
import json
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def given(stored):
    """Yields the files and hashes listed in a stored result."""
    yield from ((mesh["file"], mesh["sha256"]) for mesh in stored.get("meshes", []))
    yield from stored.get("model", {}).get("sha256", {}).items()


def main():
    problems, checked = [], 0
    for path in sorted((ROOT / "tests" / "verification").glob("*.json")):
        stored = json.loads(path.read_text())
        files = list(given(stored))
        if not files and not stored.get("outside"):
            problems.append(f"{path.name}: names no file that it was made from")
        if not (ROOT / stored["script"]).is_file():
            problems.append(f"{path.name}: its script {stored['script']} is not there")
        for name, expected in files:
            checked += 1
            file = ROOT / name
            found = hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else "no file"
            if found != expected:
                problems.append(f"{path.name}: made from another {name} ({expected[:12]}, there is {found[:12]}): run {stored['script']} again")
    for problem in problems:
        print(problem)
    print(f"stored results: {checked} files checked, {len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
