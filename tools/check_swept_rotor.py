#!/usr/bin/env python3
"""Compares the modes of a turning blade with a swept tip with CalculiX. Plain Python 3.

    cargo build --release && python3 tools/check_swept_rotor.py

The blade is the aluminium strip of Epps and Chandra, J. American Helicopter Society 41(1), 1996:
25.4 mm wide, 1.6 mm thick, clamped 63.5 mm from the axis, straight over 0.8 m, the last 152.4 mm
swept back in the plane of rotation. Truth: 400 elements C3D20R in CalculiX 2.20, static step with
large displacements under the spin, then eigenvalues with the stiffness of that state; half the
elements change them by up to 1 %. The mesh for flexarm is made here. The program is $FLEXARM, else
target/release/flexarm. Exit status 1 if an error is larger than its bound.
"""
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = os.environ.get("FLEXARM", str(ROOT / "target/release/flexarm"))
INCH = 0.0254
#: Root, length of the straight and of the swept part, width, thickness (m).
START, STRAIGHT, SWEPT, WIDTH, THICK = 2.5 * INCH, 31.5 * INCH, 6 * INCH, INCH, 0.063 * INCH
#: Elements along the straight and the swept part and across.
ALONG, TIP, ACROSS = 84, 16, 4
#: Distance from the corner over which sections turn into the mitre (m).
BLEND = 2 * INCH
#: Sweep (deg), speed (rpm): the lowest eight frequencies (Hz).
TRUTH = {
    (0, 0): [1.49223, 9.35173, 23.60645, 26.18641, 51.32118, 84.85386, 104.7553, 126.7897],
    (15, 0): [1.49536, 9.37471, 23.65045, 25.88532, 49.32559, 78.63841, 109.2216, 135.5471],
    (30, 0): [1.50449, 9.44695, 23.78062, 24.98654, 44.80367, 72.82033, 111.5841, 148.6711],
    (45, 0): [1.5191, 9.57824, 23.601, 23.99133, 40.65997, 70.21615, 112.2468, 150.3228],
    (0, 500): [9.20198, 23.86796, 24.03833, 44.63181, 72.76678, 105.4741, 108.3443, 148.8635],
    (15, 500): [9.20355, 23.54552, 24.08137, 42.42743, 67.74403, 98.05712, 126.839, 149.1644],
    (30, 500): [9.20818, 22.61083, 24.20881, 37.78502, 62.42327, 95.80209, 137.7483, 150.0995],
    (45, 500): [9.21566, 21.28689, 24.41541, 33.99614, 59.70817, 94.57602, 139.4809, 151.7616],
    (0, 750): [13.56532, 24.5598, 34.04128, 59.57335, 91.96935, 106.3655, 131.099, 150.616],
    (15, 750): [13.56703, 24.60179, 32.93964, 53.94413, 83.36044, 116.5413, 144.7105, 150.9204],
    (30, 750): [13.57213, 24.72623, 29.83216, 46.69616, 79.04, 118.0216, 151.8645, 163.5869],
    (45, 750): [13.58043, 24.92827, 26.28649, 43.08278, 76.52511, 116.6356, 153.5378, 165.391],
}
#: Largest error, and that of a swept blade that turns (%).
BOUND, SWEPT_BOUND = 1.0, 2.0
#: Nodes of HEX20 on a grid of half elements, in CalculiX's order.
CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
MIDDLES = [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)]
UPRIGHT = [(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]


def place(sweep, i, j, k):
    """Returns the position (m) of a node: half elements along, across and through the blade."""
    y, z = (j / (2 * ACROSS) - 0.5) * WIDTH, (k / 2 - 0.5) * THICK
    s = (i - 2 * ALONG) / 2
    s *= STRAIGHT / ALONG if s < 0 else SWEPT / TIP
    lean = y * math.tan(sweep / 2) * max(0.0, 1 - abs(s) / BLEND)
    if s <= 0:
        return START + STRAIGHT + s + lean, y, z
    x, c, d = s - lean, math.cos(sweep), math.sin(sweep)
    return START + STRAIGHT + x * c + y * d, y * c - x * d, z


def mesh(sweep):
    """Returns the deck of the blade."""
    numbers, nodes, elements = {}, [], []
    for i in range(ALONG + TIP):
        for j in range(ACROSS):
            own = []
            for a, b, c in CORNERS + MIDDLES + UPRIGHT:
                at = (2 * i + a, 2 * j + b, c)
                if at not in numbers:
                    numbers[at] = len(numbers) + 1
                    nodes.append(place(sweep, *at))
                own.append(numbers[at])
            elements.append(own)
    lines = ["*NODE"] + [f"{n + 1}, {x:.12g}, {y:.12g}, {z:.12g}" for n, (x, y, z) in enumerate(nodes)]
    lines += ["*ELEMENT, TYPE=C3D20, ELSET=BLADE"]
    for n, own in enumerate(elements):
        lines += [f"{n + 1}, " + ", ".join(map(str, own[:10])) + ",", ", ".join(map(str, own[10:]))]
    for name, end in [("ROOT", 0), ("TIP", 2 * (ALONG + TIP))]:
        lines += [f"*NSET, NSET={name}"] + [f"{n}," for at, n in numbers.items() if at[0] == end]
    return "\n".join(lines) + "\n"


def files(sweep):
    """Returns mesh, reduction, URDF and robot file."""
    x, y = START + STRAIGHT + SWEPT * math.cos(sweep), -SWEPT * math.sin(sweep)
    urdf = f"""<robot name="rotor">
  <link name="base"/>
  <link name="blade"/>
  <link name="tip"/>
  <joint name="spin" type="continuous"><parent link="base"/><child link="blade"/><axis xyz="0 0 1"/></joint>
  <joint name="end" type="fixed"><parent link="blade"/><child link="tip"/><origin xyz="{x} {y} 0"/></joint>
</robot>
"""
    job = f"""mesh = "blade.inp"
link = "blade"
units = "m-kg-s"
modes = 16
geometric = true
material = {{ E = 73.0844e9, nu = 0.325, rho = 2682.46 }}
interface = [
    {{ name = "A", select = "ROOT", xyz = [{START}, 0.0, 0.0] }},
    {{ name = "B", select = "TIP", xyz = [{x}, {y}, 0.0] }},
]
"""
    robot = """format = 1
urdf = "rotor.urdf"
tcp = { link = "tip" }
gravity = [0.0, 0.0, 0.0]
flexible_link = [
    { link = "blade", distal = "end", model = "modal", modes = 16, geometric_stiffening = true, reduced = "blade.flex" },
]
"""
    return {"blade.inp": mesh(sweep), "blade.reduce.toml": job, "rotor.urdf": urdf, "robot.toml": robot}


def flexarm(folder, *arguments):
    done = subprocess.run([PROGRAM, *arguments], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(arguments)}: {done.stderr}")
    return done.stdout


def main():
    failed = False
    for degrees in (0, 15, 30, 45):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for path, text in files(math.radians(degrees)).items():
                (folder / path).write_text(text)
            flexarm(folder, "reduce", "blade.reduce.toml", "--flex", "blade.flex", "-q")
            for rpm in (0, 500, 750):
                found = json.loads(flexarm(folder, "modes", "robot.toml", "--speeds", f"spin={rpm}rpm", "--json"))
                own = found["undamped_frequencies_hz"]
                errors = [100 * (own / truth - 1) for own, truth in zip(own, TRUTH[degrees, rpm])]
                worst, bound = max(map(abs, errors)), SWEPT_BOUND if degrees and rpm else BOUND
                failed |= worst > bound
                each = " ".join(f"{error:+.2f}" for error in errors)
                print(f"sweep {degrees:2} deg, {rpm:3} rpm: {worst:.2f} %, allowed {bound:g} %  ({each})")
    sys.exit(failed)


if __name__ == "__main__":
    main()
