#!/usr/bin/env python3
"""Compares flexarm with the large-deflection beams of tests/benchmarks. Plain Python 3.

    cargo build --release && python3 tools/check_large_beams.py     prints tables and bounds
    python3 tools/check_large_beams.py --write                      and puts the tables into README.md

The program is $FLEXARM, else target/release/flexarm. Robots of other sizes and models than the
shipped ones come from tools/make_benchmarks.py, in a temporary folder. Exit status 1 if an error is
larger than its bound.
"""
import argparse
import csv
import json
import math
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import make_benchmarks as make

ROOT = Path(__file__).resolve().parent.parent
README = make.FOLDER / "README.md"
BEGIN, END = "<!-- large beams -->", "<!-- end of large beams -->"
SIZES = (2, 4, 8, 16, 32)
FAILED = []


def report(what, error, bound):
    """Prints an error (%) beside its bound."""
    print(f"{what:60} {error:.3f} %  allowed {bound:.3g} %{'' if error <= bound else '  TOO LARGE'}")
    if not error <= bound:
        FAILED.append(what)


def second_order(what, error, constant):
    """Bounds errors by size n by `constant (8 / n)^2`."""
    for n in SIZES[2:]:
        report(f"{what}, {n}", error[n], constant * (8 / n)**2)


def parts(n):
    return f'model = "lumped"\nsegments = {n}'


def modal(modes, stiffened=True):
    return f'model = "modal"\nmodes = {modes}' + "\ngeometric_stiffening = true" * stiffened


def write(folder, files):
    """Writes a robot; returns its file."""
    for name, text in files.items():
        (folder / Path(name).name).write_text(text)
    return folder / Path(next(name for name in files if name.endswith(".toml"))).name


def flexarm(*arguments):
    """Returns the figures of a run, or the time (s) at which it diverged."""
    program = os.environ.get("FLEXARM", ROOT / "target/release/flexarm")
    run = subprocess.run([program, *map(str, arguments), "--json", "-q"], capture_output=True, text=True)
    if not run.returncode:
        return json.loads(run.stdout)
    lost = re.search(r"diverged at t = ([\d.]+)", run.stderr)
    return float(lost[1]) if lost else sys.exit(f"flexarm {' '.join(map(str, arguments))}: {run.stderr.strip()}")


def truth(name):
    lines = (line for line in (make.FOLDER / "large_beams" / name).open() if line[0] != "#")
    return [[float(x) for x in row] for row in list(csv.reader(lines))[1:]]


def statics(robot, force):
    """Returns displacement and rotation vector of the tip, and whether the caveat is there."""
    found = flexarm("statics", robot, f"--wrench={','.join(map(repr, force))}")
    warned = any(caveat["code"] == "large-deformation" for caveat in found["caveats"])
    return found["tcp_displacement_m"], found["tcp_rotation_rad"], warned


def apart(u, v):
    """Returns the distance of u from v over the length of v, in %."""
    return 100 * math.dist(u, v) / math.hypot(*v)


def twist(a):
    """Returns the angle of the section's height seen along x, for the rotation vector a."""
    angle = math.hypot(*a)
    s, c = (math.sin(angle) / angle, (1 - math.cos(angle)) / angle**2) if angle else (1.0, 0.5)
    return math.atan2(s * a[0] + c * a[1] * a[2], 1 - c * (a[0]**2 + a[2]**2))


def shown(error, warned=False):
    return f"{float(f'{error:.2g}'):g}{'*' if warned else ''}"


def line(*cells):
    return f"| {' | '.join(map(str, cells))} |"


def head(*cells):
    return [line(*cells), line(*["---"] * len(cells))]


def curved(folder):
    loads = truth("truth_arc.csv")
    table = head("links", "model of each link", *(f"{P:.5g} N" for P, *_ in loads))
    for name, rest, constant in (("2 rigid parts", parts(2), 0.5), ("modal, stiffened", modal(2), 0.7), ("modal", modal(2, False), 0.7)):
        last = {}
        for n in SIZES:
            robot, cells = write(folder, make.arc(n, rest)), []
            for P, *u in loads:
                tip, _, warned = statics(robot, [0.0, 0.0, P])
                last[n] = apart(tip, u)
                cells.append(shown(last[n], warned))
            table.append(line(n, name, *cells))
        second_order(f"arc, 600 lbf: links of {name}" if "parts" in name else f"arc, 600 lbf: links, {name}", last, constant)
    return table


def crossing(loads, errors, limit):
    """Returns the load at which the error passes the limit, on a straight line of the logarithms."""
    for (p, a), (q, b) in zip(zip(loads, errors), list(zip(loads, errors))[1:]):
        if a < limit <= b:
            return p * (q / p)**(math.log(limit / a) / math.log(b / a))
    return None


def straight(folder):
    rows = truth("truth_princeton.csv")
    most = max(abs(row[5]) for row in rows)

    def solved(rest):
        """Load, direction, truth and result of all rows."""
        robot = write(folder, make.princeton(rest))
        for P, degrees, *u in rows:
            a = math.radians(degrees)
            yield P, degrees, u, statics(robot, [0.0, -P * math.cos(a), P * math.sin(a)])

    # Chains: the worst of all loads.
    tip, turn = {}, {}
    for n in SIZES:
        found = list(solved(parts(n)))
        tip[n] = max(apart(f[0], u[:3]) for _, _, u, f in found)
        turn[n] = max(100 * abs(twist(f[1]) - u[3]) / most for _, _, u, f in found)
    table = [*head("rigid parts", *SIZES), line("tip, worst of all loads", *map(shown, tip.values())),
             line("twist over its peak, worst of all loads", *map(shown, turn.values())), ""]
    second_order("Princeton, tip, all loads: rigid parts", tip, 0.25)
    second_order("Princeton, twist, all loads: rigid parts", turn, 2.0)

    # Modal links: load by load, to see where they end.
    unseen, forces = 0.0, sorted({row[0] for row in rows})
    table += head("modal link", "direction", "displacement", *(f"{P:.5g} N" for P in forces), "1 % at", "5 % at")
    for name, rest in (("plain", modal(4, False)), ("stiffened", modal(4))):
        found = list(solved(rest))
        for degrees in (0, 45, 90):
            of = [(u, f) for _, d, u, f in found if d == degrees]
            for what, first in (("whole", 0), ("across", 1)):
                errors = [apart(f[0][first:], u[first:3]) for u, f in of]
                limits = [crossing(forces, errors, limit) for limit in (1.0, 5.0)]
                table.append(line(name, f"{degrees}°", what, *(shown(e, f[2]) for e, (_, f) in zip(errors, of)),
                                  *(f"{P:.2g} N" if P else "-" for P in limits)))
        unseen = max([unseen] + [apart(f[0], u[:3]) for _, _, u, f in found if not f[2]])
    # The shortening is 0.6 w^2 / L, the rotation 1.5 w / L: at 0.05 rad 2 % of w are missing.
    report("Princeton, modal links: largest error without a caveat", unseen, 2.0)
    return table


def spin_up(folder):
    rows = truth("truth_spin_up.csv")
    peaks = [max(abs(row[k]) for row in rows) for k in (1, 2)]
    (folder / "spin_up.csv").write_text(make.spin_up_motion())
    table = head("model", "across", "along", "largest deflection across (m)")
    found = {}
    models = [(f"{n} rigid parts", parts(n)) for n in SIZES] + [(f"modal, {n} modes, stiffened", modal(n)) for n in (0, 2, 4, 8)]
    for name, rest in [*models, ("modal, 4 modes", modal(4, False))]:
        out = flexarm("run", write(folder, make.spin_up(rest)), "--log-rate", 20, "-o", folder / "run", "--force")
        if isinstance(out, float):
            table.append(line(name, f"diverges at {out:.1f} s", "-", "-"))
            continue
        errors, largest = [0.0, 0.0], 0.0
        for got, (_, *u) in zip(csv.DictReader((folder / "run" / "run.csv").open()), rows, strict=True):
            q, x, y = (float(got[key]) for key in ("root_position_rad", "flexible_x_m", "flexible_y_m"))
            tip = math.cos(q) * x + math.sin(q) * y - 10.0, -math.sin(q) * x + math.cos(q) * y
            errors = [max(e, 100 * abs(a - b) / peak) for e, a, b, peak in zip(errors, tip, u, peaks)]
            largest = min(largest, tip[1])
        found[name] = errors
        table.append(line(name, shown(errors[1]), shown(errors[0]), f"{largest:.4f}"))
    for k, what in ((1, "across"), (0, "along")):
        second_order(f"spin-up, {what}: rigid parts", {n: found[f"{n} rigid parts"][k] for n in SIZES[2:]}, (2.0, 1.5)[k])
    for n in (2, 4, 8):
        report(f"spin-up, across: modal, stiffened, {n} modes", found[f"modal, {n} modes, stiffened"][1], 0.5)
    return table


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("--write", action="store_true")
    write_tables = arguments.parse_args().write
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        tables = {"Curved cantilever": curved(folder), "Princeton beam": straight(folder), "Spin-up": spin_up(folder)}
    text = "\n\n".join("\n".join([f"{title}, error (%):", "", *table]) for title, table in tables.items())
    print(f"\n{text}\n")
    if write_tables:
        before, rest = README.read_text().split(BEGIN)
        README.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.split(END)[1]}")
    print(f"{len(FAILED)} errors are too large" if FAILED else "all errors are within their bounds")
    return 1 if FAILED else 0


if __name__ == "__main__":
    sys.exit(main())
