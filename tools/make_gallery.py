#!/usr/bin/env python3
"""Writes the table of docs/gallery.md: a row of computed numbers for each robot in robots/ that
has no table in tests/arms (tools/catalogue.py writes those).
Usage: make_gallery.py [--check]

Runs `flexarm inspect`, `modes` and `compare` with --json. The program is $FLEXARM, else
target/release/flexarm, else flexarm on the PATH. With --check the page stays as it is; exit status 1
if its table differs or a robot has no section. Computed numbers may differ by one unit in their last
digit, because rounding depends on the processor. Needs no third-party packages.
"""

import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/gallery.md"
BEGIN, END = "<!-- begin: tools/make_gallery.py -->\n", "<!-- end: tools/make_gallery.py -->\n"
HEAD = ["robot", "mass (kg)", "payload (kg)", "flexible links", "elastic joints", "f1 (Hz)", "motion", "TCP error (mm)", "static part (mm)"]
# Columns with numbers that the program computes.
COMPUTED = {"f1 (Hz)", "TCP error (mm)", "static part (mm)"}


def program():
    built = ROOT / "target/release/flexarm"
    found = os.environ.get("FLEXARM") or (str(built) if built.exists() else shutil.which("flexarm"))
    if not found:
        sys.exit("no flexarm: set FLEXARM, build it, or add it to the PATH")
    return found


def answer(flexarm, *arguments):
    """The JSON object that a command prints, run in the root of the repository."""
    run = subprocess.run([flexarm, *arguments, "--json", "-q"], cwd=ROOT, capture_output=True, text=True)
    if run.returncode:
        sys.exit(f"flexarm {' '.join(arguments)}: {run.stderr.strip()}")
    return json.loads(run.stdout)


def digits(value):
    """Three digits, none of them in an exponent."""
    if value == 0.0:
        return "0"
    whole = len(str(int(abs(value)))) if abs(value) >= 1.0 else 0
    return f"{value:.{max(3 - whole, 0)}f}"


def row(flexarm, name):
    file = f"robots/{name}/robot.toml"
    links = answer(flexarm, "inspect", file)["links"]
    modes = answer(flexarm, "modes", file)
    run = answer(flexarm, "compare", file, "--no-files")
    payload = tomllib.loads((ROOT / file).read_text()).get("payload", {}).get("mass", 0.0)
    return [
        f"[`{name}`](#{name})",
        f"{sum(link['mass_kg'] for link in links):.0f}",
        f"{payload:g}" if payload else "none",
        str(len(run["bends"]["links"])),
        str(len(run["bends"]["gearboxes"])),
        digits(modes["undamped_frequencies_hz"][0]),
        f"`{run['trajectory']}`",
        digits(1e3 * run["tcp"]["peak_m"]),
        digits(1e3 * run["tcp"]["static_at_peak_m"]),
    ]


def cells(line):
    """The cells of a line of a Markdown table."""
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def same(column, written, computed):
    """Whether two cells agree, computed numbers within one unit in the last digit."""
    if written == computed or column not in COMPUTED:
        return written == computed
    unit = 10.0 ** -max(len(number.partition(".")[2]) for number in (written, computed))
    try:
        return abs(float(written) - float(computed)) < 1.01 * unit
    except ValueError:
        return False


def differences(written, computed):
    """The differences of two tables, a sentence each."""
    tables = [[cells(line) for line in table.strip().splitlines()] for table in (written, computed)]
    if [row[:1] for row in tables[0]] != [row[:1] for row in tables[1]] or tables[0][0] != HEAD:
        return ["the table has other robots or columns"]
    found = []
    for old, new in zip(*tables):
        if len(old) != len(HEAD):
            found.append(f"{new[0]}: {len(old)} cells instead of {len(HEAD)}")
            continue
        pairs = zip(HEAD, old, new)
        found += [f"{new[0]}: {column} is {b}, the page has {a}" for column, a, b in pairs if not same(column, a, b)]
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare instead of writing")
    check = parser.parse_args().check
    flexarm = program()
    names = {file.parent.name for file in ROOT.glob("robots/*/robot.toml")}
    names = sorted(names - {file.stem for file in ROOT.glob("tests/arms/*.toml")})
    rows = [HEAD, ["---"] * len(HEAD), *(row(flexarm, name) for name in names)]
    table = "".join("| " + " | ".join(line) + " |\n" for line in rows)
    print(table, end="")
    page = PAGE.read_text()
    before, rest = page.split(BEGIN)
    written, after = rest.split(END)
    faults = [f"{PAGE.name}: no section for {name}" for name in names if f"\n### {name}\n" not in page]
    if check:
        found = differences(written, table)
        faults += [f"{PAGE.name}: {fault}" for fault in found]
        if found:
            faults.append(f"{PAGE.name}: run tools/make_gallery.py")
    else:
        PAGE.write_text(f"{before}{BEGIN}\n{table}\n{END}{after}")
    print("\n".join(faults), file=sys.stderr, end="\n" if faults else "")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
