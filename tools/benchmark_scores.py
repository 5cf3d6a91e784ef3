#!/usr/bin/env python3
"""Runs flexarm and other programs on the benchmarks of tests/benchmarks and scores them.

    python3 tools/benchmark_scores.py VENV                      prints all lines
    python3 tools/benchmark_scores.py VENV --write              also stores them in scores.json
    python3 tools/benchmark_scores.py VENV --only exudyn        one program; others stay as stored
    python3 tools/benchmark_scores.py --draw                    writes the tables of README.md

VENV is a virtual environment with exudyn, mujoco, pin and scipy from PyPI; a program that is not
there is skipped. flexarm is target/release/flexarm, or --flexarm PROGRAM. Models and settings are in
benchmark_programs.py. Errors are those of tests/benchmarks/README.md, at the times of the truths.
Time: processor time of the simulation on one thread, the least of three runs if a run takes less
than 5 s; without set-up, but flexarm's includes it.
"""
import argparse
import datetime
import json
import math
import os
import platform
import subprocess
import sys
from importlib.metadata import PackageNotFoundError
from pathlib import Path

from benchmark_programs import (CRANK, CRANK_LENGTH, FOLDER, LENGTH, MOTIONS, ROOT, TWO_LINK, Exudyn, Flexarm, Floats,
                                MuJoCo, Pinocchio, arm, read_columns)

STORE = FOLDER / "scores.json"
PAGE = FOLDER / "README.md"
BEGIN, END = "<!-- scores -->", "<!-- end of scores -->"
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
PROGRAMS = (Flexarm, Exudyn, MuJoCo, Pinocchio)
# Runs that take longer are not repeated (CPU s).
SHORT = 5.0
# Errors that the tables ask for: relative ones, and those of the slider (m).
BOUNDS = {"error": (3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4), "slider_m": (1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8)}


# --------------------------------------------------------------------------------------------------
# truths
def check_times(times, truth):
    """Refuses samples at other times than those of the truth."""
    if len(times) != len(truth) or any(abs(a - b) > 1e-9 for a, b in zip(times, truth)):
        raise RuntimeError(f"{len(times)} samples, but not those of the truth ({len(truth)})")


def two_link_error(case, samples):
    """Largest distance of the tip from the truth over the largest deviation of the truth."""
    names = ["t[s]", "deviation_x[m]", "deviation_y[m]"]
    truth = read_columns(FOLDER / "two_link" / f"truth_{case}.csv", names)
    check_times([row[0] for row in samples], [row[0] for row in truth])
    first, second = arm(case)[0]
    worst = 0.0
    for (t, x, y), (_, dx, dy) in zip(samples, truth):
        a = first[0](t, Floats)
        b = a + second[0](t, Floats)
        rigid = LENGTH * (math.cos(a) + math.cos(b)), LENGTH * (math.sin(a) + math.sin(b))
        distance = math.dist((x, y), (rigid[0] + dx, rigid[1] + dy))
        worst = max(worst, distance) if math.isfinite(distance) else math.inf
    return {"error": worst / max(math.hypot(dx, dy) for _, dx, dy in truth)}


def crank_error(samples):
    """Largest error of the slider (m), and of the deflection in the middle over its peak; against
    the geometrically exact rod."""
    names = ["t[s]", "exact_slider_x[m]", "exact_mid_v[m]"]
    truth = read_columns(FOLDER / CRANK / "truth_ramp.csv", names)
    check_times([row[0] for row in samples], [row[0] for row in truth])
    slider = middle = 0.0
    for (t, at, x, y), (_, true_at, true_middle) in zip(samples, truth):
        a = MOTIONS["ramp"][0][0](t, Floats)
        pin = CRANK_LENGTH * math.cos(a), CRANK_LENGTH * math.sin(a)
        chord = at - pin[0], -pin[1]
        lateral = (chord[0] * (y - pin[1]) - chord[1] * (x - pin[0])) / math.hypot(*chord)
        slider = max(slider, abs(at - true_at))
        middle = max(middle, abs(lateral - true_middle))
    return {"error": middle / max(abs(row[2]) for row in truth), "slider_m": slider}


def error_of(case, samples):
    """Errors of a run from its samples."""
    return crank_error(samples) if case == CRANK else two_link_error(case, samples)


# --------------------------------------------------------------------------------------------------
# measure
def programs(flexarm, only):
    """Returns the programs that are there, and why the others are not."""
    made, skipped = [], {}
    for kind in PROGRAMS:
        if only and kind.name.lower() != only.lower():
            continue
        try:
            made.append(kind(flexarm) if kind is Flexarm else kind())
        except (ImportError, OSError, RuntimeError, PackageNotFoundError) as error:
            skipped[kind.name] = f"{type(error).__name__}: {error}"
    return made, skipped


def measure_line(program, case, model, size, stepper, step, repeat):
    """Runs one line and returns it with its errors and its time."""
    line = {"program": program.name, "case": case, "model": model, "size": size,
            "stepper": stepper, "step": step}
    try:
        spent, samples = program.run(case, model, size, stepper, step)
        line.update(error_of(case, samples()), cpu_s=spent)
    except (RuntimeError, ValueError) as error:
        return {**line, "failed": str(error).strip().splitlines()[-1][:200]}
    if line["error"] >= 1.0 or not math.isfinite(line["error"]):
        return {**line, "error": None, "failed": "error above the whole deviation"}
    for _ in range(repeat - 1 if spent < SHORT else 0):
        line["cpu_s"] = min(line["cpu_s"], program.run(case, model, size, stepper, step)[0])
    return line


def measure(made, cases, repeat):
    """Runs all lines of the programs and prints them."""
    lines = []
    for program in made:
        for case in cases:
            for line in program.lines(case):
                found = measure_line(program, case, *line, repeat)
                print(told(found), flush=True)
                lines.append({k: float(f"{v:.4g}") if isinstance(v, float) else v for k, v in found.items()})
    return lines


def told(line):
    """One line as text."""
    start = (f"{line['program']:9} {line['case']:12} {line['model']:19} {line['size']:2} {line['stepper']:33} "
             f"{line['step']:6g}")
    if "failed" in line:
        return f"{start} failed: {line['failed']}"
    slider = f" slider {1e6 * line['slider_m']:.3g} um" if "slider_m" in line else ""
    return f"{start} error {line['error']:.2e} {line['cpu_s']:.3f} s{slider}"


def machine():
    """Names the processor."""
    information = Path("/proc/cpuinfo")
    facts = [line.split(":", 1) for line in
             (information.read_text().splitlines() if information.exists() else []) if ":" in line]
    facts = {name.strip(): value.strip() for name, value in facts}
    name = facts.get("model name", platform.processor())
    if "model" in facts:
        name += f", family {facts.get('cpu family')}, model {facts['model']}"
    return f"{name}; {os.cpu_count()} threads; {platform.system()}; Python {platform.python_version()}"


# --------------------------------------------------------------------------------------------------
# tables
def percent(x):
    """An error as text."""
    return f"{100 * x:.2g} %" if x < 0.1 else f"{100 * x:.0f} %"


def seconds(x):
    """A time as text."""
    return f"{x:.3f}" if x < 0.1 else f"{x:.2f}" if x < 10 else f"{x:.0f}"


def bound_text(measure, bound):
    """A bound as text."""
    return percent(bound) if measure == "error" else f"{1e6 * bound:g} µm"


def sure(line, lines, measure):
    """The largest error of a line and of all finer lines of its model and stepper: what is left if
    errors of model, elements and steps do not cancel each other."""
    kind = [line[name] for name in ("program", "case", "model", "stepper")]
    return max(other[measure] for other in lines if "failed" not in other
               and [other[name] for name in ("program", "case", "model", "stepper")] == kind
               and other["size"] >= line["size"] and other["step"] <= line["step"])


def fastest(found, case, program, measure, bound):
    """The cheapest line of a program and model whose sure `measure` is at most `bound`."""
    good = [line for line in found["lines"] if line["case"] == case and "failed" not in line
            and (line["program"], line["model"]) == program and sure(line, found["lines"], measure) <= bound]
    return min(good, key=lambda line: line["cpu_s"], default=None)


def step_text(line):
    """A step size, or a relative tolerance."""
    return f"{line['step']:g}" if line["program"] == Pinocchio.name else f"{1e3 * line['step']:g} ms"


def models(found, case):
    """Programs and models of a case, in order."""
    return list(dict.fromkeys((line["program"], line["model"]) for line in found["lines"] if line["case"] == case))


def time_table(found, case, measure="error"):
    """Shortest time of each program and model by error, with size and step."""
    bounds = BOUNDS[measure]
    title = {"error": case if case != CRANK else f"{case}, deflection", "slider_m": f"{case}, slider"}[measure]
    text = f"| {title} | {' | '.join(bound_text(measure, bound) for bound in bounds)} |\n"
    text += "| --- " * (1 + len(bounds)) + "|\n"
    table = {name: [fastest(found, case, name, measure, bound) for bound in bounds] for name in models(found, case)}
    ahead = [min((line["cpu_s"] for line in column if line), default=None) for column in zip(*table.values())]
    for (program, model), row in table.items():
        cells = []
        for line, least in zip(row, ahead):
            if line is None:
                cells.append("-")
                continue
            spent = f"**{seconds(line['cpu_s'])}**" if line["cpu_s"] == least else seconds(line["cpu_s"])
            cells.append(f"{spent} ({line['size']}, {step_text(line)})")
        text += f"| {program}, {model} | {' | '.join(cells)} |\n"
    return text


def convergence_table(found):
    """Errors with the shortest step that works, from the smallest to the largest size."""
    columns = [(case, case, "error", 1e2) for case in TWO_LINK]
    columns += [("deflection", CRANK, "error", 1e2), ("slider (µm)", CRANK, "slider_m", 1e6)]
    text = f"| model, sizes | {' | '.join(column[0] for column in columns)} |\n" + "| --- " * (1 + len(columns)) + "|\n"
    for program, model in models(found, TWO_LINK[0]):
        series = [line for line in found["lines"] if (line["program"], line["model"]) == (program, model)]
        sizes = sorted({line["size"] for line in series})
        row = []
        for _, case, measure, unit in columns:
            errors = []
            for size in sizes:
                works = [line for line in series if line["case"] == case and line["size"] == size and "failed" not in line]
                finest = min(works, key=lambda line: (line["step"], line["error"]), default=None)
                errors.append(f"{unit * finest[measure]:.2g}" if finest else "-")
            row.append(", ".join(errors) if any(error != "-" for error in errors) else "-")
        text += f"| {program}, {model}, {', '.join(map(str, sizes))} | {' | '.join(row)} |\n"
    return text


def markdown(found):
    """The scores as Markdown."""
    versions = ", ".join(f"{name} {number}" for name, number in found["versions"].items())
    text = f"{versions}. {found['date']}; {found['machine']}.\n\n"
    for name in found["versions"]:
        text += f"* **{name}**: {found['settings'][name]}\n"
    for name, reason in found["skipped"].items():
        text += f"* **{name}**: skipped ({reason}).\n"
    text += "\nProcessor time (s) for an error of at most the head of the column, with size and step:\n\n"
    text += "\n".join(time_table(found, case) for case in [*TWO_LINK, CRANK])
    text += "\n" + time_table(found, CRANK, "slider_m")
    text += "\nError (%) with the shortest step that works, by size:\n\n" + convergence_table(found)
    return text


def draw(found):
    """Writes the tables in the page."""
    page = PAGE.read_text()
    before, rest = page.split(BEGIN)
    _, after = rest.split(END)
    PAGE.write_text(f"{before}{BEGIN}\n\n{markdown(found)}\n{END}{after}")


def store(found):
    """Stores the scores, one line of the file for each line."""
    head = {name: value for name, value in found.items() if name != "lines"}
    lines = ",\n".join("  " + json.dumps(line) for line in found["lines"])
    STORE.write_text(json.dumps(head, indent=1)[:-2] + f',\n "lines": [\n{lines}\n ]\n}}\n')


def merge(found, stored):
    """Keeps the stored lines of programs that were not run."""
    kept = [line for line in stored["lines"] if line["program"] not in found["versions"]]
    order = [kind.name for kind in PROGRAMS]
    found["lines"] = sorted(kept + found["lines"], key=lambda line: order.index(line["program"]))
    for part in ("versions", "settings"):
        both = {**stored[part], **found[part]}
        found[part] = {name: both[name] for name in order if name in both}


def inside(venv):
    """Runs this script again with the Python of the environment, on one thread."""
    if os.environ.get("FLEXARM_SCORES"):
        return
    python = Path(venv) / "bin" / "python"
    if not python.exists():
        sys.exit(f"there is no {python}: python3 -m venv {venv}, then {python} -m pip install exudyn mujoco pin scipy")
    threads = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
    environment = dict(os.environ, FLEXARM_SCORES="1", **threads)
    sys.exit(subprocess.run([str(python), *sys.argv], env=environment).returncode)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("venv", nargs="?", help="virtual environment with the other programs")
    parser.add_argument("--write", action="store_true", help="store the lines in scores.json")
    parser.add_argument("--draw", action="store_true", help="write the tables from the stored lines, without a run")
    parser.add_argument("--only", help="one program: flexarm, exudyn, mujoco or pinocchio")
    parser.add_argument("--cases", nargs="+", choices=[*TWO_LINK, CRANK], help="print some cases only")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--flexarm", default=str(TARGET / "release" / "flexarm"), help="the program")
    arguments = parser.parse_args()
    if arguments.draw:
        draw(json.loads(STORE.read_text()))
        return
    if not arguments.venv or (arguments.cases and arguments.write):
        parser.error("--write needs all cases" if arguments.venv else "a run needs VENV")
    inside(arguments.venv)
    made, skipped = programs(arguments.flexarm, arguments.only)
    for name, reason in skipped.items():
        print(f"{name}: skipped ({reason})")
    found = {"date": datetime.date.today().isoformat(), "machine": machine(),
             "versions": {program.name: program.version for program in made},
             "settings": {program.name: program.settings for program in made}, "skipped": skipped}
    found["lines"] = measure(made, arguments.cases or [*TWO_LINK, CRANK], arguments.repeat)
    if arguments.only and STORE.exists():
        merge(found, json.loads(STORE.read_text()))
    if arguments.write:
        store(found)


if __name__ == "__main__":
    main()
