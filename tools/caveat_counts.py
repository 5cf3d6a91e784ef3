#!/usr/bin/env python3
"""Counts reported mistakes, and false alarms on unmodified robots.

    tools/caveat_counts.py [--flexarm PATH] [--verbose] [URDF ...]

Each mistake is one wrong number in a copy of a shipped robot, a motion, loads or a command line. It
is caught if the command then gives a warning that it does not give without the mistake, or refuses
it (exit code 2). False alarms are warnings of `flexarm check` about shipped robots, and about the
robots that `flexarm new` makes from the URDFs given.
"""

import argparse
import json
import math
import pathlib
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable

ROOT = pathlib.Path(__file__).resolve().parent.parent
ROBOTS = ROOT / "robots"
POSE = "0,-60deg,90deg,0,60deg,0"
# Codes that concern the URDF itself, not the request.
MESHES = {"missing-mesh"}


class Place:
    """A folder with copies of robots and motions that contain one mistake."""

    def __init__(self, program: str) -> None:
        """Creates the folder; `program`: the command line under test."""
        self.program = program
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="flexarm-slips-"))
        shutil.copytree(ROBOTS, self.folder / "robots")
        shutil.copytree(ROOT / "trajectories", self.folder / "trajectories")

    def close(self) -> None:
        """Removes the folder."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def change(self, file: str, pattern: str, new: str, count: int = 1) -> None:
        """Replaces text that matches a pattern; raises an error if nothing matches."""
        path = self.folder / file
        text, times = re.subn(pattern, new, path.read_text(), count=count, flags=re.MULTILINE)
        if times == 0:
            raise ValueError(f"{file}: nothing fits {pattern}")
        path.write_text(text)

    def write(self, file: str, text: str) -> None:
        """Writes a file."""
        (self.folder / file).write_text(text)

    def told(self, line: list[str]) -> tuple[int, set[str]]:
        """Returns exit code and warnings (without numbers) of a command."""
        done = subprocess.run(
            [self.program, "--json", *line], cwd=self.folder, capture_output=True, text=True, timeout=600, check=False
        )
        said = set(re.findall(r"^warning: (.*)$", done.stderr, flags=re.MULTILINE))
        try:
            answer = json.loads(done.stdout or "{}")
        except json.JSONDecodeError:
            answer = {}
        said |= set(answer.get("warnings", []))
        # Errors in a URDF itself are reported with their line.
        findings = [f for f in answer.get("findings", []) if ".urdf" not in f["where"] and f["code"] not in MESHES]
        said |= {f["message"] for f in findings if f["severity"] != "note"}
        return done.returncode, {re.sub(r"-?\d[\d.e+-]*", "#", text).replace(str(self.folder), "") for text in said}


Slip = Callable[[Place], list[str]]
CHECK = ["check", "robots/kr210/robot.toml"]


def toml(robot: str, pattern: str, new: str, count: int = 1) -> Slip:
    """Returns a mistake with a wrong value in a robot file."""

    def slip(place: Place) -> list[str]:
        place.change(f"robots/{robot}", pattern, new, count)
        return ["check", f"robots/{robot}"]

    return slip


def stiffness(change: Callable[[list[list[float]]], list[list[float]]]) -> Slip:
    """Returns a mistake with the changed matrix of the .flex file of link_2 in its robot file."""

    def slip(place: Place) -> list[str]:
        text = (place.folder / "robots/kr210/fe/link_2.flex").read_text()
        block = re.search(r"^\[stiffness\].*?^matrix = (\[.*?^\])", text, flags=re.MULTILINE | re.DOTALL)
        if block is None:
            raise ValueError("link_2.flex has no stiffness")
        rows = change(json.loads(block.group(1).replace(",\n]", "\n]")))
        place.change("robots/kr210/robot.toml", r'^(link = "link_2")$', rf"\1\nstiffness = {rows}")
        return CHECK

    return slip


def diagonal(rows: list[list[float]]) -> list[list[float]]:
    """Keeps only the diagonal."""
    return [[x if i == j else 0.0 for j, x in enumerate(row)] for i, row in enumerate(rows)]


def loads(entry: str, table: str = "") -> Slip:
    """Returns a mistake with a file of loads on kr210."""

    def slip(place: Place) -> list[str]:
        place.write("push.csv", table)
        place.write("loads.toml", "format = 1\n[[load]]\n" + entry)
        return [*CHECK, "--loads", "loads.toml"]

    return slip


def asked(*line: str) -> Slip:
    """Returns a mistake on the command line."""
    return lambda _: list(line)


def swept(path: str, value: str) -> Slip:
    """Returns a study with one wrong value."""

    def slip(place: Place) -> list[str]:
        entry = f'[[parameter]]\npath = "{path}"\nvalues = [{value}]\n'
        motion = 'motion = "trajectories/pick_and_place.toml"\n'
        place.write("study.toml", f'format = 1\nrobot = "robots/kr210/robot.toml"\n{motion}{entry}')
        return ["sweep", "study.toml", "-o", "swept", "--force"]

    return slip


def matrices(flexibility: bool, heavy: float) -> Slip:
    """Returns a steel bar (0.6 m, 60 x 40 mm) as two matrices: stiffness or flexibility, and
    mass."""

    def slip(place: Place) -> list[str]:
        e, rho, length, width, height = 210e9, 7850.0, 0.6, 0.06, 0.04
        mass = rho * width * height * length
        k = [[0.0] * 6 for _ in range(6)]  # of the far end, the near end held
        k[0][0], k[3][3] = e * width * height / length, 80e9 * 2.8e-7 / length
        for inertia, across, turn, sign in [(height * width**3 / 12, 1, 5, -1), (width * height**3 / 12, 2, 4, 1)]:
            ei = e * inertia
            if flexibility:
                k[across][across], k[turn][turn] = length**3 / 3 / ei, length / ei
                k[across][turn] = k[turn][across] = -sign * length**2 / 2 / ei
            else:
                k[across][across], k[turn][turn] = 12 * ei / length**3, 4 * ei / length
                k[across][turn] = k[turn][across] = sign * 6 * ei / length**2
        if flexibility:
            k[0][0], k[3][3] = 1 / k[0][0], 1 / k[3][3]
        # Motion of the far end relative to the near end: u_B - u_A - theta_A x p, theta_B -
        # theta_A.
        seen = [[float(j == i + 6) - float(j == i) for j in range(12)] for i in range(6)]
        seen[1][5], seen[2][4] = -length, length
        rows = range(12)
        whole = [
            [sum(seen[a][i] * k[a][b] * seen[b][j] for a in range(6) for b in range(6)) for j in rows] for i in rows
        ]
        turns = [(width**2 + height**2) / 12, length**2 / 24, length**2 / 24]
        masses = [[heavy * mass / 2 * ([1.0] * 3 + turns)[i % 6] if i == j else 0.0 for j in rows] for i in rows]
        for name, matrix in [("K", whole), ("M", masses)]:
            lines = [f"{i + 1} {j + 1} {matrix[i][j]:.17e}" for i in rows for j in range(i + 1) if matrix[i][j] != 0.0]
            head = f"%%MatrixMarket matrix coordinate real symmetric\n12 12 {len(lines)}\n"
            place.write(f"bar_{name}.mtx", head + "\n".join(lines) + "\n")
        at = ["--map", "A=#1-6,B=#7-12", "--at", "A=0,0,0", "--at", "B=0.6,0,0", "--units", "m-kg-s"]
        return ["import", "bar_K.mtx", "--mass-file", "bar_M.mtx", *at, "--no-files"]

    return slip


def reduced(half: str) -> Slip:
    """Returns a reduction with a box of nodes as its interface A."""

    def slip(_: Place) -> list[str]:
        mesh = ["reduce", "robots/test/one_beam/fe/one_beam.msh", "--units", "m-kg-s", "--material", "aluminium"]
        faces = ["--interface", half, "--interface", "B=plane(0.8,0,0; 1,0,0)", "--at", "A=0,0,0", "--at", "B=0.8,0,0"]
        return [*mesh, *faces, "--no-files"]

    return slip


TABLE = "time,fx\n0,0\n{0},200\n{1},0\n"
GEARS = r"(\[\[drive\]\]\njoint = \"joint_{0}\"\nkind = )\"gearbox\"\ngearbox = .*"
SINE = 'kind = "sine"\nforce = [50, 0, 0]\nfrequency = 3\n'
TOOL = ["lobes", "robots/kr210/robot.toml", "--at", POSE, "--no-files", "--tool", "robots/tools/endmill_20mm.toml"]


def tool(pattern: str, new: str) -> Slip:
    """Returns a mistake with a wrong value in the file of a cutting tool."""

    def slip(place: Place) -> list[str]:
        place.change("robots/tools/endmill_20mm.toml", pattern, new)
        return TOOL

    return slip


def table(missing: range) -> Slip:
    """Returns a recorded table of a move of joint 1 at 100 Hz, without some of its samples."""

    def slip(place: Place) -> list[str]:
        rows = ["time,joint_1,joint_2,joint_3,joint_4,joint_5,joint_6"]
        for k in range(101):
            if k not in missing:
                way = k / 100 - math.sin(2 * math.pi * k / 100) / (2 * math.pi)
                rows.append(f"{k * 0.01:.2f},{0.5 * way:.9f},-1.2,1.5,0,0.4,0")
        place.write("move.csv", "\n".join(rows) + "\n")
        return [*CHECK, "move.csv"]

    return slip


# Name, command without the mistake, command with it.
SLIPS: list[tuple[str, Slip, Slip]] = [
    ("TCP on the base link", asked(*CHECK), toml("kr210/robot.toml", 'tcp = { link = "tool0"', 'tcp = { link = "base_link"')),
    ("TCP on the elbow", asked(*CHECK), toml("kr210/robot.toml", 'tcp = { link = "tool0"', 'tcp = { link = "link_3"')),
    ("--tcp link_3", asked(*CHECK), asked(*CHECK, "--tcp", "link_3")),
    ("payload on link_3", asked(*CHECK), toml("kr210/robot.toml", 'payload = { link = "tool0"', 'payload = { link = "link_3"')),
    *[
        (f"drive {n} of six rigid", asked(*CHECK), toml("kr210/robot.toml", GEARS.format(n), r'\1"prescribed"'))
        for n in range(1, 7)
    ],
    (
        "stiffness_factor = 100",
        asked(*CHECK),
        toml("kr210/robot.toml", r'^(link = "link_2")$', r"\1\nstiffness_factor = 100"),
    ),
    ("6x6 of the .flex file as stiffness", asked(*CHECK), stiffness(lambda rows: rows)),
    ("6x6 times 1000", asked(*CHECK), stiffness(lambda rows: [[1e3 * x for x in row] for row in rows])),
    ("6x6, its diagonal alone", asked(*CHECK), stiffness(diagonal)),
    ("links with damping 0", asked(*CHECK), toml("kr210/robot.toml", r"modal = 0\.03", "modal = 0.0", 0)),
    ("gears with damping 0", asked(*CHECK), toml("kr210/robot.toml", r"damping = \d+\.\d+ }", "damping = 0.0 }", 0)),
    ("wall 1.4 mm for 14 mm", asked("check", "robots/kr210/beams.toml"), toml("kr210/beams.toml", r"0\.014", "0.0014")),
    ("wall 1.4 m for 14 mm", asked("check", "robots/kr210/beams.toml"), toml("kr210/beams.toml", r"0\.014", "1.4")),
    (
        "tube radius as diameter",
        asked("check", "robots/test/three_beams/robot.toml"),
        toml("test/three_beams/robot.toml", r"outer_diameter = 0\.06", "outer_diameter = 0.03"),
    ),
    (
        "counterbalance on the wrong side",
        asked("check", "robots/kr300/robot.toml"),
        toml("kr300/robot.toml", r"xyz = \[-0\.45", "xyz = [0.45"),
    ),
    (
        "load table in ms",
        loads('kind = "table"\nfile = "push.csv"', TABLE.format(0.5, 1)),
        loads('kind = "table"\nfile = "push.csv"', TABLE.format(500, 1000)),
    ),
    (
        "sine of degrees in a load",
        loads('kind = "expression"\nfx = "50*sin(2*PI*3*t)"'),
        loads('kind = "expression"\nfx = "50*sin(360*3*t)"'),
    ),
    ("phase of a load in degrees", loads(SINE), loads(SINE + "phase = 90")),
    ("interface box over half of the link", reduced("A=plane(0,0,0; 1,0,0)"), reduced("A=box(-1,-1,-1; 0.4,1,1)")),
    ("import: flexibility for stiffness", matrices(False, 1.0), matrices(True, 1.0)),
    ("import: mass in g", matrices(False, 1.0), matrices(False, 1000.0)),
    # Warnings of other commands.
    ("settling band of 100 m", asked("compare", "kr210", "--no-files"), asked("compare", "kr210", "--no-files", "--settling-band", "100")),
    (
        "explicit stepper with a coarse step",
        asked("compare", "kr210", "--no-files"),
        asked("compare", "kr210", "--no-files", "--stepper", "rk4", "--step", "0.01"),
    ),
    ("sweep: gravity 98.1", swept("payload.mass", "150.0"), swept("gravity[2]", "-98.1")),
    ("sweep: step 0.1 s", swept("payload.mass", "150.0"), swept("options.step", "0.1")),
    ("sweep: payload 7.5 t", swept("payload.mass", "150.0"), swept("payload.mass", "7500.0")),
    ("sweep: TCP in mm", swept("payload.mass", "150.0"), swept("tcp.xyz[2]", "350.0")),
    ("sweep: gears in N m/deg", swept("payload.mass", "150.0"), swept("drive.joint_2.gearbox.stiffness", "58935.0")),
    ("lobes: coefficients in Pa", asked(*TOOL), tool('"N/mm2"', '"N/m2"')),
    ("lobes: stiffness in N/mm", asked(*TOOL), tool(r"stiffness = 1\.5e7", "stiffness = 1.5e4")),
    ("lobes: damping in per cent", asked(*TOOL), tool(r"^damping = 0\.03", "damping = 3.0")),
    (
        "map with one place",
        asked("map", "kr210", "--box", "1.5:2,0:0.5,1:1.5", "--grid", "0.25", "--no-files"),
        asked("map", "kr210", "--box", "1.5:2,0:0.5,1:1.5", "--grid", "5", "--no-files"),
    ),
    ("--at in degrees", asked("statics", "kr210", "--at", POSE), asked("statics", "kr210", "--at=0,-60,90,0,60,0")),
    ("gap in a table", table(range(0)), table(range(40, 55))),
]


def tried(program: str, slip: Slip) -> tuple[int, set[str]]:
    """Runs a command in a separate folder; returns exit code and warnings."""
    place = Place(program)
    try:
        return place.told(slip(place))
    finally:
        place.close()


def false_alarms(program: str, urdfs: list[str]) -> tuple[int, list[str]]:
    """Returns the number of robots tested and their warnings: shipped ones and those of `flexarm
    new`."""
    place = Place(program)
    robots = sorted(str(p.relative_to(place.folder)) for p in (place.folder / "robots").rglob("*.toml"))
    robots = [robot for robot in robots if "urdf =" in (place.folder / robot).read_text()]
    for k, urdf in enumerate(urdfs):
        folder = f"made_{k}_{pathlib.Path(urdf).stem}"
        line = [program, "--json", "new", str(pathlib.Path(urdf).resolve()), "-o", folder, "--no-run"]
        done = subprocess.run(line, cwd=place.folder, capture_output=True, text=True, timeout=600, check=False)
        made = sorted((place.folder / folder).glob("robot.toml"))
        if made:
            robots.append(str(made[0].relative_to(place.folder)))
        else:
            print(f"  no robot of {urdf}: {(done.stderr.splitlines() or [''])[0]}")
    alarms = []
    for robot in robots:
        _, said = place.told(["check", robot])
        alarms += [f"{robot}: {text}" for text in sorted(said)]
    place.close()
    return len(robots), alarms


def main() -> None:
    """Prints the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flexarm", default=str(ROOT / "target/release/flexarm"), help="the program")
    parser.add_argument("--only", default="", help="slips with this in their name")
    parser.add_argument("--verbose", action="store_true", help="print what is said")
    parser.add_argument("urdfs", nargs="*", help="URDFs of which robots are made")
    args = parser.parse_args()
    program = str(pathlib.Path(args.flexarm).resolve())
    caught = 0
    chosen = [slip for slip in SLIPS if args.only in slip[0]]
    for name, sound, slip in chosen:
        before_code, before = tried(program, sound)
        code, after = tried(program, slip)
        new = after - before
        told = (code == 2 and before_code != 2) or bool(new)
        caught += told
        print(f"{'caught' if told else 'MISSED'}  {name}")
        if args.verbose:
            print(*[f"          {text}" for text in sorted(new)], sep="\n")
        if before_code != 0:
            print(f"          the sound one ends with {before_code}")
    print(f"{caught} of {len(chosen)} slips caught")
    robots, alarms = false_alarms(program, args.urdfs)
    print(*[f"  {alarm}" for alarm in alarms], sep="\n")
    print(f"{len(alarms)} warnings on {robots} robots as they are")


if __name__ == "__main__":
    main()
