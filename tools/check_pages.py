#!/usr/bin/env python3
"""Compares the figures of README.md and docs/ with what is printed and what is stored.

    python3 tools/check_pages.py            lists what differs; exit status 1 if anything does
    python3 tools/check_pages.py --write    also puts the figures found into the pages

1. Text blocks that begin with "$ COMMAND" are run in a scratch folder, with the files that the page
   shows. Each line of a block must be printed, in this order; "..." stands for anything.
2. The sentences and table rows of FIGURES must have the figures of their source: a run, or stored
   results (docs/performance/peers.json, tests/verification, the claims of docs/verification.md).
3. The tables that tools/peers.py writes must be those of peers.json.

Figures of a run may differ by one unit in the last digit, because rounding depends on the processor.
The program is $FLEXARM, else target/release/flexarm, else flexarm on the PATH.
"""

import argparse
import concurrent.futures
import functools
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import make_gallery
import peers

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Pages with commands; those of a group use each other's files, groups run at the same time.
RUN = [
    ["docs/tutorials/my_arm.md", "docs/tutorials/measure.md"],
    ["docs/tutorials/mesh_to_link.md", "docs/links.md", "docs/response.md", "README.md", "docs/choosing.md", "docs/faq.md"],
]
NUMBER = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
TOKEN = re.compile(rf"{NUMBER}(?![\w.]*\w)|[^\s]")


# ----------------------------------------------------------------------------------------------------
# figures
def unit(text):
    """Value of one unit in the last digit of a printed number."""
    mantissa, _, exponent = text.partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def printed_like(value, text):
    """A value with the digits of a printed number."""
    mantissa, _, exponent = text.partition("e")
    decimals = len(mantissa.partition(".")[2])
    if exponent:
        mantissa, _, exponent = f"{value:.{decimals}e}".partition("e")
        return f"{mantissa}e{int(exponent)}"
    return f"{value:.{decimals}f}"


def is_value(text, value):
    return abs(float(text) - value) <= 0.51 * max(unit(text), unit(printed_like(value, text)))


# ---------------------------------------------------------------------------------------------------
# blocks that are run
def same_token(page, printed):
    if page == printed:
        return True
    numbers = all(re.fullmatch(NUMBER, token) for token in (page, printed))
    return numbers and unit(page) == unit(printed) < 1.0 and abs(float(page) - float(printed)) < 1.5 * unit(page)


def tokens(line):
    return TOKEN.findall(line)


def same_line(page, printed, same=same_token):
    """Whether a line is as printed, but for blanks; one that ends with "..." is the beginning."""
    page, printed = page.strip(), printed.strip()
    if page.endswith("..."):
        page = tokens(page[:-3])
        printed = tokens(printed)[: len(page)]
    else:
        page, printed = tokens(page), tokens(printed)
    return len(page) == len(printed) and all(map(same, page, printed))


def other_figures(page, printed):
    """Whether two lines differ in their numbers alone."""
    word = lambda token: "0" if re.fullmatch(NUMBER, token) else token
    return same_line(page, printed, lambda a, b: word(a) == word(b))


def blocks(text):
    """Language, lines and preceding text of each fenced block, with the number of its first line."""
    lines, before, at = text.splitlines(), [], 0
    while at < len(lines):
        fence = re.match(r"(\s*)```(\w*)", lines[at])
        if not fence:
            before.append(lines[at])
            at += 1
            continue
        end = next(k for k in range(at + 1, len(lines)) if lines[k].strip() == "```")
        yield fence[2], [line[len(fence[1]) :] for line in lines[at + 1 : end]], "\n".join(before), at + 1
        before, at = [], end + 1


def commands(lines):
    """Splits a block into (command, printed lines, offset of the first of these)."""
    found, k = [], 0
    while k < len(lines):
        if lines[k].startswith("$ "):
            command = lines[k][2:]
            while command.endswith("\\"):
                k += 1
                command = command[:-1] + lines[k].strip()
            found.append((command, [], k + 1))
        else:
            found[-1][1].append(lines[k])
        k += 1
    return found


def prepare(scratch, flexarm):
    """A folder in which the commands of the pages run, with `flexarm` on its PATH."""
    for name in ("robots", "trajectories", "tests"):
        (scratch / name).symlink_to(ROOT / name)
    (scratch / "bin").mkdir()
    (scratch / "bin/flexarm").symlink_to(pathlib.Path(flexarm).resolve())
    (scratch / "out").mkdir()
    # A description without masses, for the page of questions.
    urdf = (ROOT / "robots/kr210/kr210.urdf").read_text()
    (scratch / "arm.urdf").write_text(re.sub(r"<inertial>.*?</inertial>", "", urdf, flags=re.S))
    return dict(os.environ, PATH=f"{scratch / 'bin'}{os.pathsep}{os.environ['PATH']}", COLUMNS="80")


def run_pages(pages, flexarm):
    """Runs the blocks of some pages; returns (page, line number, line, line found or None)."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        scratch = pathlib.Path(folder)
        environment = prepare(scratch, flexarm)
        for page in pages:
            for language, lines, before, first in blocks((ROOT / page).read_text()):
                if language in ("toml", "python", "csv"):
                    files = re.findall(r"`(out/[\w./]+\.\w+)`", before)
                    if files:
                        file = scratch / files[-1]
                        start = (file.parent / "robot.toml").read_text() if "appended to a copy" in before else ""
                        file.parent.mkdir(parents=True, exist_ok=True)
                        file.write_text(start + "\n".join(lines) + "\n")
                elif language == "text" and lines[0].startswith("$ "):
                    for command, expected, offset in commands(lines):
                        run = subprocess.run(["bash", "-c", command], cwd=scratch, env=environment, capture_output=True, text=True)
                        answer = [run.stderr.splitlines(), run.stdout.splitlines()]
                        found += [(page, first + offset + k + 1, *pair) for k, pair in missing(expected, answer)]
    return found


def missing(expected, streams):
    """Yields (number, (line, line with other figures or None)) for lines that no stream has in order."""
    begin = [0] * len(streams)
    for number, line in enumerate(expected):
        if line.strip() in ("", "..."):
            continue
        for same in (same_line, other_figures):
            hits = [(s, k) for s, stream in enumerate(streams) for k in range(begin[s], len(stream)) if same(line, stream[k])]
            if hits:
                s, k = hits[0]
                begin[s] = k + 1
                if same is other_figures:
                    yield number, (line, streams[s][k])
                break
        else:
            yield number, (line, None)


# --------------------------------------------------------------------------------------------------
# sentences with figures
class Source:
    """What the figures of sentences are compared with; runs are kept."""

    def __init__(self, flexarm):
        self.flexarm = flexarm
        self.peers = json.loads((ROOT / "docs/performance/peers.json").read_text())
        self.arm = json.loads((ROOT / "tests/verification/measured_arm.json").read_text())

    @functools.cache
    def run(self, command):
        return make_gallery.answer(self.flexarm, *command.split(), *(["--no-files"] if command.split()[0] in ("compare", "compensate") else []))

    def peak_mm(self, robot):
        return 1e3 * self.run(f"compare {robot}")["tcp"]["peak_m"]

    def compensated(self, arguments):
        """Cutoff, peaks before and after each iteration, and RMS after (Hz, mm)."""
        run = self.run(f"compensate {arguments} --no-sweep")
        return [run["cutoff_hz"], *(1e3 * peak for peak in run["model_peaks_m"]), 1e3 * run["after"]["rms_m"]]

    def build_s(self):
        """CPU seconds of the default program from nothing, as docs/performance.md has them."""
        return float(re.search(r"^\| default program, .* \| (\d+) \|$", (ROOT / "docs/performance.md").read_text(), flags=re.M)[1])

    def claims(self):
        rows = re.findall(r"^\| \[.*\| (\d+) \| \d+ \| (\d+) \|$", (ROOT / "docs/verification.md").read_text(), flags=re.M)
        return [sum(int(row[k]) for row in rows) for k in (0, 1)]

    def ratio(self, error, figure="cpu_ms"):
        """CPU time of the best other program over ours, at equal error."""
        ours = [line for line in self.peers["lines"] if line["program"] == "flexarm"]
        others = [line for line in self.peers["lines"] if line["program"] != "flexarm"]
        return peers.fastest(others, error)["cpu_ms"] / peers.fastest(ours, error, figure)[figure]

    def verified(self, case, row, columns):
        """Cells of the first row of a table of a case that begins with some cells; per cent as printed."""
        text = (ROOT / f"docs/verification/{case}.md").read_text()
        cells = next(line for line in text.splitlines() if line.startswith(f"| {row} |")).split("|")[1:-1]
        return [float(re.search(NUMBER, cells[k])[0]) for k in columns]

    def error(self, stepper, step):
        return next(line["error"] for line in self.peers["lines"] if (line["stepper"], line["step"]) == (stepper, step))

    def shaped(self, flags):
        """Delay (s) of a shaper and vibration of the first two modes behind it (mm)."""
        run = self.run(f"compensate kr210 point_to_point --iterations 0 --no-sweep {flags}")
        return [run["shaper_delay_s"], *(1e3 * mode["after_m"] for mode in run["shaper"]["modes"][:2])]

    def measured(self, urdf, about=""):
        """A model of the measured arm: its fit on the poses of each floor (mm)."""
        if urdf.startswith("rigid"):
            return self.arm[urdf]
        return next(m for m in self.arm["models"] if (m["urdf"], m["about"]) == (urdf, about))

    def row(self, *key):
        model = self.measured(*key)
        rms = lambda floor: model[floor]["rms_mm"]
        return [model.get("free_numbers", 6), rms("train"), rms("held_out"), model["held_out"]["max_mm"], rms("outdoor"), rms("pallet")]


# Of the measured arm: rigid with fitted frames, springs, springs and play.
MODELS = [("rigid_frames",), ("published", ""), ("published", "y")]

cell = lambda percent: f"{{}} {percent}".strip()

# Page, sentence or table row with {} for each figure, and a function from the source to the figures.
FIGURES = [
    ("README.md", "program ({} CPU minutes", lambda s: [s.build_s() / 60]),
    ("README.md", "{} mm from where the rigid model says", lambda s: [s.peak_mm("fanuc_r2000_210f")]),
    ("README.md", "would be off by {} mm", lambda s: [1e3 * s.run("compare")["tcp"]["static_at_peak_m"]]),
    ("README.md", "[docs/verification.md](docs/verification.md): {} claims, each with its bound; {} of them", lambda s: s.claims()),
    (
        "README.md",
        "misses the tool by {} mm (rms), elastic tubes and gears by {} mm, with play by {} mm",
        lambda s: [s.row(*key)[2] for key in MODELS],
    ),
    (
        "README.md",
        "1/{} to 1/{} of the processor time of the best of MuJoCo and Exudyn; a whole process 1/{} to 1/{}",
        lambda s: [s.ratio(e, figure) for figure in ("cpu_ms", "process_ms") for e in (peers.CLASSES[0], peers.CLASSES[-1])],
    ),
    ("docs/accuracy.md", "within {} mm (rms); a rigid robot with fitted joint frames is off by {} mm", lambda s: [s.row(*key)[2] for key in (MODELS[2], MODELS[0])]),
    *(
        ("docs/measured_arm.md", f"| {name}, {urdf} URDF{more} | {{}} | {{}} | {{}} ({{}}) | {{}} | {{}} |", lambda s, key=key: s.row(*key))
        for name, urdf, more, key in [
            ("rigid", "calibrated", "", ("rigid",)),
            ("rigid", "published", ", frames fitted", ("rigid_frames",)),
            ("springs", "calibrated", "", ("calibrated", "")),
            ("springs, play about y", "calibrated", "", ("calibrated", "y")),
            ("springs", "published", "", ("published", "")),
            ("springs, play about y", "published", "", ("published", "y")),
        ]
    ),
    ("docs/choosing.md", "the peak error is {} mm; without the elastic gearboxes it is {} mm, without the flexible links {} mm", lambda s: [s.peak_mm(f"kr210 {x}") for x in ("", "--drives rigid", "--links rigid")]),
    ("docs/choosing.md", "castings of the KR 210 give {} mm, beams of similar outer size {} mm", lambda s: [s.peak_mm("robots/kr210/links.toml"), s.peak_mm("robots/kr210/beams.toml")]),
    ("docs/choosing.md", "steps of 1 to 8 ms | {} at 1 ms, {} at 8 ms |", lambda s: [s.error("generalized-alpha", h) for h in (1e-3, 8e-3)]),
    ("docs/choosing.md", "errors below 1e-4 | {} at 2 ms |", lambda s: [s.error("extrapolated-alpha", 2e-3)]),
    ("docs/choosing.md", "as a check | {} at 1 ms |", lambda s: [s.error("sdirk3", 1e-3)]),
    ("docs/choosing.md", "is refused | {} at 0.125 ms |", lambda s: [s.error("rk4", 1.25e-4)]),
    ("docs/choosing.md", "are judged | {} at `--rtol` 1e-9 |", lambda s: [s.error("reference", 1e-9)]),
    ("docs/choosing.md", "without motors | {} at 0.1 ms |", lambda s: [s.error("spook", 1e-4)]),
    *(
        ("docs/formulation.md", f"| {row} | {{}} | {cell(sag)} | {cell(first)} | {cell(second)} |", lambda s, row=row, k=columns: s.verified("one-beam", row, k))
        for row, sag, first, second, columns in [
            ("2 parts", "%", "%", "%", (1, 2, 4, 6)),
            ("3 parts", "%", "%", "%", (1, 2, 4, 6)),
            ("5 parts", "%", "%", "%", (1, 2, 4, 6)),
            ("9 parts", "%", "", "%", (1, 2, 4, 6)),
        ]
    ),
    ("docs/formulation.md", "| 2 parts | {} % |", lambda s: s.verified("manipulator", "2 parts | spring-damper, 1 ms", [11])),
    ("docs/formulation.md", "| 4 parts | {} % |", lambda s: s.verified("manipulator", "4 parts | spring-damper, 1 ms", [11])),
    ("docs/thesis.md", "the preset is {} % of the peak off, the exact formulas {} %", lambda s: [s.verified("manipulator", f"2 parts | {row}, 1 ms", [11])[0] for row in ("compliant constraints, preset `source`", "compliant constraints, local")]),
    ("docs/faq.md", "the peak is then {} mm instead of {} mm", lambda s: [s.peak_mm("kr210 --from-rest undeformed"), s.peak_mm("kr210")]),
    ("docs/faq.md", "the peaks differ by {} %", lambda s: [100 * abs(s.peak_mm("kr210 --links modal") / s.peak_mm("kr210") - 1)]),
    ("docs/compensate.md", "(column `after`: {} mm)", lambda s: s.compensated("kr210")[-2:-1]),
    *(
        ("docs/compensate.md", f"| `{arguments}`{more} | {{}} Hz | {{}} mm | {', '.join(['{}'] * n)} | {{}} mm |", lambda s, a=arguments: s.compensated(a))
        for arguments, more, n in [("kr300 --drives servo", "", 5), ("kr300", " (motors where they are commanded)", 3), ("manutec_r3 --drives servo", "", 4)]
    ),
    *(
        ("docs/compensate.md", f"| `{flags}` | {{}} s | {{}}, {{}} |", lambda s, f=flags: s.shaped(f))
        for flags in ("--shape zv", "--shape optimal --delay 0.093", "--shape optimal --delay 0.12", "--shape optimal --delay 0.14", "--shape zvd", "--shape optimal")
    ),
]


def check_sentences(source):
    """Yields (page, line number, template, figures of the page, figures found) where they differ."""
    for page, template, figures in FIGURES:
        words = [re.sub(r"(\\ )+", r"\\s+", re.escape(part)) for part in template.split("{}")]
        text = (ROOT / page).read_text()
        hits = list(re.finditer(f"({NUMBER})".join(words), text))
        values = figures(source)
        if not hits:
            yield page, None, template, [], values
        for hit in hits:
            if len(values) != hit.re.groups or not all(map(is_value, hit.groups(), values)):
                yield page, text[: hit.start()].count("\n") + 1, hit, list(hit.groups()), values


# ----------------------------------------------------------------------------------------------------
def write(page, number, old, new):
    """Replaces a line of a page, or the figures of a sentence."""
    path = ROOT / page
    text = path.read_text()
    if isinstance(old, str):
        lines = text.splitlines(keepends=True)
        indent = lines[number - 1][: len(lines[number - 1]) - len(lines[number - 1].lstrip(" "))] if lines[number - 1].startswith("   ") else ""
        if old.strip().endswith("..."):
            new = new.strip()[: len(old.strip()) - 3] + "..."
        lines[number - 1] = f"{indent}{new.strip() if indent else new.rstrip()}\n"
        path.write_text("".join(lines))
        return
    for k in reversed(range(old.re.groups)):
        begin, end = old.span(k + 1)
        text = text[:begin] + printed_like(new[k], old.group(k + 1)) + text[end:]
    path.write_text(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="put the figures found into the pages")
    arguments = parser.parse_args()
    flexarm = make_gallery.program()
    bad = 0
    with concurrent.futures.ThreadPoolExecutor() as pool:
        runs = [pool.submit(run_pages, pages, flexarm) for pages in RUN]
        source = Source(flexarm)
        for page, text in peers.pages(source.peers).items():
            if page.read_text() != text:
                bad += 1
                print(f"{page.relative_to(ROOT)}: not what tools/peers.py --draw writes")
        for page, number, old, figures, values in list(check_sentences(source)):
            bad += 1
            if number is None:
                print(f"{page}: has no sentence \"{old}\"; its figures are {values}")
                continue
            print(f"{page}:{number}: {' '.join(old.group().split())}\n  found: {', '.join(f'{value:.6g}' for value in values)}")
            if arguments.write and len(values) == old.re.groups:
                write(page, number, old, values)
        for page, number, line, found in [entry for run in runs for entry in run.result()]:
            bad += 1
            print(f"{page}:{number}: {line}\n  " + ("no such line is printed" if found is None else f"found: {found.strip()}"))
            if arguments.write and found is not None:
                write(page, number, line, found)
    print(f"{bad} differences" if bad else "the pages have the figures of the program")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
