#!/usr/bin/env python3
"""Writes the tables and the plot of docs/catalogue.md: the shipped arms, how stiff and how fast.

    python3 tools/catalogue.py                 docs/catalogue.md and docs/images/catalogue.svg
    python3 tools/catalogue.py --check         compare the page instead; exit status 1 if it differs
    python3 tools/catalogue.py --folder DIR    print the same table of all URDFs and xacros of a folder

Arms of tests/arms stand at their rated pose with the rated payload; a URDF of DIR gets what `flexarm
new` assumes, and stands where its sample motion begins. Ranges are those of the assumed stiffness.
The program is $FLEXARM, else target/release/flexarm, else flexarm on the PATH. No third-party
packages.
"""

import argparse
import math
import pathlib
import re
import sys
import tempfile
import tomllib

from make_arms import ROBOTS, TABLES, answer, differs, outcome, reducers, robot_text, size, spread, stretch
from make_gallery import ROOT, digits

PAGE, PLOT = ROOT / "docs/catalogue.md", ROOT / "docs/images/catalogue.svg"
BEGIN, END = "<!-- begin: tools/catalogue.py -->\n", "<!-- end: tools/catalogue.py -->\n"
HEAD = ["arm", "payload (kg)", "mass (kg)", "sag (mm)", "compliance (µm/N)", "f1 (Hz)", "reducers (%)"]
# Arms with identified or assumed stiffness of their own.
OTHERS = ["kr210", "kr210_identified", "kr300", "kr500_identified", "manutec_r3", "palletiser"]


def ranged(name, payload, mass, found):
    """A row with ranges."""
    return dict(name=name, payload=payload, mass=mass, sag=spread(found, lambda f: f["sag"]), compliance=spread(found, lambda f: f["compliance"]),
                f1=spread(found, lambda f: f["f"][0]), gears=digits(found["stiffness"]["gears"]), range=sorted(found[at]["f"][0] for at in ("low", "stiffness", "high")))


def shipped(name, folder):
    arm = tomllib.loads((TABLES / f"{name}.toml").read_text())
    urdf = ROBOTS / name / f"{name}.urdf"
    made = answer("new", urdf, "--payload", arm["payload"], "--tool", "tool0", *reducers(arm), "-o", folder / "new", "--no-run", "--force")
    found = outcome(lambda at: robot_text(name, arm, made["drives"], at).replace(urdf.name, str(urdf)), arm["pose"], made["drives"], folder)
    return ranged(name, arm["payload"], sum(row[0] for row in arm["links"].values()), found)


def other(name):
    """A row of an arm whose robot file has its stiffness, at the start of its own motion."""
    file = ROBOTS / name / "robot.toml"
    keys = tomllib.loads(file.read_text())
    statics, modes = answer("statics", file), answer("modes", file)
    gears = {drive["joint"] for drive in keys.get("drive", [])}
    sag = statics["sag_m"]
    along = sum(a * b for e in statics["elements"] if e["name"] in gears for a, b in zip(e["tcp_displacement_m"], sag))
    payload, f1 = keys.get("payload", {}).get("mass", 0.0), modes["undamped_frequencies_hz"][0]
    mass = sum(link["mass_kg"] for link in answer("inspect", file)["links"])
    return dict(name=name, payload=payload, mass=mass, sag=digits(1e3 * size(sag)), compliance=digits(1e6 * stretch(statics["compliance"])), f1=digits(f1),
                gears=digits(100.0 * along / size(sag) ** 2), range=[f1, f1, f1])


def described(urdf, folder):
    """A row of somebody else's URDF."""
    made = answer("new", urdf, "-o", folder / "new", "--no-run", "--force")
    file = folder / "new/robot.toml"
    whole = file.read_text()
    walls = {f"wall = {link['wall']:.5f}": f"wall = {link['wall_of_half_mass']:.5f}" for link in made["links"] if link["wall_of_half_mass"]}

    def text_at(at):
        if at == "unloaded":
            return re.sub(r"(?m)^payload = .*$", "", whole)
        values = iter(drive[at] for drive in made["drives"])
        text = re.sub(r"(?<=gearbox = { stiffness = )[^ ]+", lambda _: repr(next(values)), whole)
        for all_of_it, half in walls.items() if at == "low" else ():
            text = text.replace(all_of_it.rstrip("0"), half)
        return text

    pose = [math.degrees(angle) for angle in answer("statics", file)["at"]]
    mass = sum(link["mass_kg"] for link in answer("inspect", file)["links"])
    return ranged(urdf.name.split(".")[0], made["payload"]["mass"], mass, outcome(text_at, pose, made["drives"], folder / "new"))


def table(rows):
    cells = [HEAD, ["---"] * len(HEAD)]
    for row in sorted(rows, key=lambda row: row["payload"]):
        payload = f"{row['payload']:g}" if row["payload"] else "none"
        cells.append([f"`{row['name']}`", payload, digits(row['mass']), row["sag"], row["compliance"], row["f1"], row["gears"]])
    return "".join("| " + " | ".join(line) + " |\n" for line in cells)


def plot(rows):
    """An SVG: first frequency over payload, both logarithmic, with ranges."""
    rows = [row for row in rows if row["payload"]]
    (x0, x1), (y0, y1), (width, height, edge) = (2.0, 600.0), (3.0, 60.0), (720, 460, 60)
    x = lambda kg: edge + (width - 2 * edge) * math.log(kg / x0) / math.log(x1 / x0)
    y = lambda hz: height - edge - (height - 2 * edge) * math.log(hz / y0) / math.log(y1 / y0)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="11">',
           f'<rect width="{width}" height="{height}" fill="white"/>']
    for kg in (2, 5, 10, 20, 50, 100, 200, 500):
        out.append(f'<path d="M{x(kg):.1f} {edge}V{height - edge}" stroke="#ddd"/><text x="{x(kg):.1f}" y="{height - edge + 16}" text-anchor="middle">{kg}</text>')
    for hz in (3, 5, 10, 20, 50):
        out.append(f'<path d="M{edge} {y(hz):.1f}H{width - edge}" stroke="#ddd"/><text x="{edge - 6}" y="{y(hz) + 4:.1f}" text-anchor="end">{hz}</text>')
    out.append(f'<text x="{width / 2}" y="{height - 14}" text-anchor="middle">payload (kg)</text>')
    out.append(f'<text transform="translate(18 {height / 2}) rotate(-90)" text-anchor="middle">first frequency with payload (Hz)</text>')
    for row in rows:
        low, typical, high = (y(value) for value in row["range"])
        at = x(row["payload"])
        out.append(f'<path d="M{at:.1f} {low:.1f}V{high:.1f}" stroke="#06c" stroke-width="2"/><circle cx="{at:.1f}" cy="{typical:.1f}" r="3.5" fill="#06c"/>'
                   f'<text transform="translate({at + 5:.1f} {typical - 4:.1f}) rotate(-30)">{row["name"]}</text>')
    return "\n".join(out) + "\n</svg>\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--folder", type=pathlib.Path, metavar="DIR")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        if args.folder:
            found = sorted(path for kind in ("*.urdf", "*.urdf.xacro") for path in args.folder.rglob(kind))
            print(table([described(path, folder) for path in found]), end="")
            return 0
        rows = [shipped(path.stem, folder) for path in sorted(TABLES.glob("*.toml"))]
    own = [other(name) for name in OTHERS]
    page = PAGE.read_text()
    before, rest = page.split(BEGIN)
    written, after = rest.split(END)
    made = f"\n{table(rows)}\nArms with a stiffness of their own, at the start of their own motion:\n\n{table(own)}\n"
    if args.check:
        if differs(written, made):
            print(f"{PAGE.name}: run tools/catalogue.py", file=sys.stderr)
            return 1
        return 0
    PAGE.write_text(f"{before}{BEGIN}{made}{END}{after}")
    PLOT.write_text(plot(rows + own))
    print(made, end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
