#!/usr/bin/env python3
"""Writes the robots and motions of tests/benchmarks again. Plain Python 3.

    python3 tools/make_benchmarks.py            writes the files
    python3 tools/make_benchmarks.py --check    status 1 if a file differs

The truths beside them (truth_*.csv) are not made here: README.md there says where they come from.
"""
import argparse
import math
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / "tests" / "benchmarks"


def box_inertia(mass, x, y, z):
    """Returns the <inertial> of a box with its centre at x/2, sizes in m."""
    ixx, iyy, izz = (mass * (a * a + b * b) / 12 for a, b in ((y, z), (x, z), (x, y)))
    return (f'<inertial><origin xyz="{x / 2:g} 0 0"/><mass value="{mass:.12g}"/>'
            f'<inertia ixx="{ixx:.12g}" ixy="0" ixz="0" iyy="{iyy:.12g}" iyz="0" izz="{izz:.12g}"/></inertial>')


def bar(name, mass, x, y, z):
    visual = f'<visual><origin xyz="{x / 2:g} 0 0"/><geometry><box size="{x:g} {y:g} {z:g}"/></geometry></visual>'
    return f'  <link name="{name}">\n    {box_inertia(mass, x, y, z)}\n    {visual}\n  </link>\n'


def lump(name, mass, inertia, size):
    turn = " ".join(f'{key}="{value:g}"' for key, value in zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
                                                            (inertia, 0, 0, inertia, 0, inertia)))
    return (f'  <link name="{name}">\n    <inertial><mass value="{mass:g}"/><inertia {turn}/></inertial>\n'
            f'    <visual><geometry><box size="{size:g} {size:g} {size:g}"/></geometry></visual>\n  </link>\n')


def joint(name, kind, parent, child, x=0.0, rest="", turn=0.0):
    rpy = f' rpy="0 0 {turn:.15g}"' if turn else ""
    return (f'  <joint name="{name}" type="{kind}">\n    <parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{x:.12g} 0 0"{rpy}/>{rest}\n  </joint>\n')


def hinge(name, parent, child, x=0.0):
    return joint(name, "continuous", parent, child, x, '<axis xyz="0 0 1"/>')


def urdf(name, parts):
    return f'<?xml version="1.0"?>\n<robot name="{name}">\n  <link name="base"/>\n{"".join(parts)}</robot>\n'


def rectangle(width, height, material, theory="timoshenko"):
    return f'section = "rectangle", width = {width}, height = {height}, material = {material}, theory = "{theory}"'


def flexible(link, distal, section, rest, y_axis="[0.0, 0.0, 1.0]"):
    return f"""
[[flexible_link]]
link = "{link}"
distal = "{distal}"
{rest}
damping = {{ modal = 0.0 }}
beam = {{ {section}, y_axis = {y_axis}, parts = "uniform" }}
"""


def two_link(height_mm):
    """Two bars of 1 m with 1 kg at the elbow and at the tip; they bend in the plane."""
    height, width, rho = height_mm / 1e3, 0.05, 2700.0
    name, mass = f"two_link_{height_mm}", rho * height_mm / 1e3 * width
    parts = [hinge("joint_1", "base", "link_1"), bar("link_1", mass, 1.0, height, width), joint("end_1", "fixed", "link_1", "elbow", 1.0),
             lump("elbow", 1.0, 1e-3, 0.06), hinge("joint_2", "elbow", "link_2"), bar("link_2", mass, 1.0, height, width),
             joint("end_2", "fixed", "link_2", "tip", 1.0), lump("tip", 1.0, 1e-3, 0.06)]
    material = "{ E = 7e10, nu = 0.33, rho = 2700.0 }"
    robot = f"""# Two aluminium bars of 1 m, 50 mm wide and {height_mm} mm high in the plane of motion: see ../README.md.
format = 1
name = "{name}"
urdf = "{name}.urdf"
tcp = {{ link = "tip" }}
gravity = [0.0, 0.0, 0.0]
default_trajectory = "slew.toml"
"""
    for k in (1, 2):
        robot += flexible(f"link_{k}", f"end_{k}", rectangle(width, height, material), 'model = "lumped"\nsegments = 16')
    return {f"two_link/{name}.urdf": urdf(name, parts), f"two_link/{name}.toml": robot}


SLEW = """# A slew of both joints in 1 s, and 1 s of rest.
format = 1
unit = "rad"
joints = ["joint_1", "joint_2"]
start = [0.0, 0.5]
profile = "quintic"

[[move]]
to = [1.5707963267948966, -1.5]
duration = 1.0
hold = 1.0
"""


def table(names, rows):
    head = ["t[s]"] + [f"{name}{of}" for name in names for of in ("_position[rad]", "_velocity[rad/s]", "_acceleration[rad/s^2]")]
    return "\n".join([",".join(head)] + [",".join(f"{x:.15g}" for x in row) for row in rows]) + "\n"


def speed_up(omega, T, t):
    """Position, velocity and acceleration of a joint that reaches `omega` at T and keeps it."""
    s = min(t / T, 1.0)
    return (omega * T * s**4 * (2.5 - 3 * s + s * s) + omega * max(t - T, 0.0), omega * s**3 * (10 - 15 * s + 6 * s * s),
            omega / T * 30 * s * s * (1 - s)**2)


def swing(a, start, T, t):
    """`a sin^4` from `start` to `start + T`."""
    s, w = min(max((t - start) / T, 0.0), 1.0), math.pi / T
    S, C = math.sin(math.pi * s), math.cos(math.pi * s)
    return a * S**4, a * 4 * S**3 * C * w, a * 4 * w * w * (3 * S * S * C * C - S**4)


def spin():
    rows = [(k / 1000, *speed_up(8.0, 1.0, k / 1000), *swing(1.0, 0.5, 1.0, k / 1000)) for k in range(2001)]
    return table(["joint_1", "joint_2"], rows)


def slider_crank():
    """Crank of 0.15 m, steel rod of 0.3 m and 8 x 8 mm, slider: Simeon's mechanism."""
    crank, rod, side, rho = 0.15, 0.3, 0.008, 7870.0
    mass = rho * side * side * rod / 2
    limit = '<axis xyz="1 0 0"/><limit lower="-0.4" upper="0.1" effort="1e5" velocity="100"/>'
    parts = [hinge("crank", "base", "crank_arm"), bar("crank_arm", 0.36, crank, 0.016, 0.016),
             hinge("rod", "crank_arm", "rod_a", crank), bar("rod_a", mass, rod / 2, side, side),
             joint("middle_joint", "fixed", "rod_a", "middle", rod / 2), '  <link name="middle"/>\n',
             joint("middle_to_b", "fixed", "middle", "rod_b"), bar("rod_b", mass, rod / 2, side, side),
             joint("end_joint", "fixed", "rod_b", "rod_end", rod / 2), '  <link name="rod_end"/>\n',
             joint("slide", "prismatic", "base", "slider", crank + rod, limit), lump("slider", 0.075552, 1e-5, 0.03)]
    material = "{ E = 2e11, nu = 0.3, rho = 7870.0 }"
    robot = """# Crank, flexible rod and slider: a closed loop, see ../README.md. The rod is two links, so that its middle is a frame.
format = 1
name = "slider_crank"
urdf = "slider_crank.urdf"
tcp = { link = "middle" }
gravity = [0.0, 0.0, 0.0]
default_trajectory = "ramp.csv"

[[loop]]
name = "slider"
pin = { link = "slider", xyz = [0.0, 0.0, 0.0] }
eye = { link = "rod_end", xyz = [0.0, 0.0, 0.0] }
dependent = ["rod", "slide"]
"""
    for link, distal in (("rod_a", "middle_joint"), ("rod_b", "end_joint")):
        robot += flexible(link, distal, rectangle(side, side, material, "euler-bernoulli"), 'model = "lumped"\nsegments = 8')
    rows = [(k / 1e4, *speed_up(150.0, 0.05, k / 1e4)) for k in range(1001)]
    return {"slider_crank/slider_crank.urdf": urdf("slider_crank", parts), "slider_crank/slider_crank.toml": robot,
            "slider_crank/ramp.csv": table(["crank"], rows)}


def cantilever(name, what, tip, rest=""):
    return f"""# {what}: see ../README.md.
format = 1
name = "{name}"
urdf = "{name}.urdf"
tcp = {{ link = "{tip}" }}
gravity = [0.0, 0.0, 0.0]
{rest}"""


def arc(n, rest='model = "lumped"\nsegments = 2'):
    """Bathe's arc of 45 degrees and 100 in, along +y and towards +x, as chords: n straight links."""
    inch, psi = 0.0254, 4.4482216152605 / 0.0254**2
    step = math.pi / 4 / n
    length, side, E, G = 2 * 100 * inch * math.sin(step / 2), inch, 1e7 * psi, 5e6 * psi
    A, I = side**2, side**4 / 12
    section = (f'section = "given", EA = {E * A:.12g}, EI_y = {E * I:.12g}, EI_z = {E * I:.12g}, GJ = {2 * G * I:.12g}, '
               f'kGA_y = {5 / 6 * G * A:.12g}, kGA_z = {5 / 6 * G * A:.12g}, '
               f'mass_per_length = {2700 * A:.12g}, rotary_y = {2700 * I:.12g}, rotary_z = {2700 * I:.12g}')
    name, parts, robot = f"arc_{n}", [], ""
    for k in range(1, n + 1):
        turn = math.pi / 2 - step / 2 if k == 1 else -step
        parent = "base" if k == 1 else f"node_{k - 1}"
        kind, axis = ("continuous", '<axis xyz="0 0 1"/>') if k == 1 else ("fixed", "")
        parts += [joint(f"joint_{k}", kind, parent, f"link_{k}", 0.0, axis, turn), bar(f"link_{k}", 2700 * A * length, length, side, side),
                  joint(f"end_{k}", "fixed", f"link_{k}", f"node_{k}", length), f'  <link name="node_{k}"/>\n']
        robot += flexible(f"link_{k}", f"end_{k}", section, rest)
    head = cantilever(name, f"Bathe's curved cantilever in {n} straight links", f"node_{n}")
    return {f"large_beams/{name}.urdf": urdf(name, parts), f"large_beams/{name}.toml": head + robot}


def straight(name, what, length, mass, sides, section, rest, motion=""):
    """A cantilever along x on a joint about z; `sides` along y and z."""
    parts = [hinge("root", "base", "beam"), bar("beam", mass, length, *sides), joint("end", "fixed", "beam", "tip", length), '  <link name="tip"/>\n']
    robot = cantilever(name, what, "tip", motion) + flexible("beam", "end", section, rest, "[0.0, 1.0, 0.0]")
    return {f"large_beams/{name}.urdf": urdf(name, parts), f"large_beams/{name}.toml": robot}


def princeton(rest='model = "lumped"\nsegments = 16'):
    """Dowell and Traybar's beam, its height along y."""
    height, width, rho = 12.3777e-3, 3.2024e-3, 2800.0
    section = rectangle(height, width, "{ E = 71.7e9, nu = 0.31, rho = 2800.0 }")
    return straight("princeton", "The Princeton beam", 0.508, rho * 0.508 * height * width, (height, width), section, rest)


def spin_up(rest='model = "lumped"\nsegments = 16'):
    """Simo and Vu-Quoc's beam; a square of this side has its mass, inertia, EA and EI."""
    side = math.sqrt(6e-3)
    section = ('section = "given", EA = 2.8e7, EI_y = 1.4e4, EI_z = 1.4e4, GJ = 1.4e4, kGA_y = 1e7, kGA_z = 1e7, '
               'mass_per_length = 1.2, rotary_y = 6e-4, rotary_z = 6e-4')
    return straight("spin_up", "The spin-up manoeuvre", 10.0, 12.0, (side, side), section, rest, 'default_trajectory = "spin_up.csv"\n')


def spin_up_motion():
    """`psi = 6/15 (t^2/2 + (15/2pi)^2 (cos(2 pi t/15) - 1))` rad to 15 s, then 6 rad/s."""
    def psi(t, omega=6.0, T=15.0):
        w = 2 * math.pi / T
        if t >= T:
            return omega * (t - T / 2), omega, 0.0
        return omega / T * (t * t / 2 + (math.cos(w * t) - 1) / w**2), omega / T * (t - math.sin(w * t) / w), omega / T * (1 - math.cos(w * t))
    return table(["root"], [(k / 10, *psi(k / 10)) for k in range(201)])


def files():
    made = {"two_link/slew.toml": SLEW, "two_link/spin.csv": spin(), **slider_crank(), **arc(16), **princeton(), **spin_up()}
    made["large_beams/spin_up.csv"] = spin_up_motion()
    for height in (30, 20, 10):
        made.update(two_link(height))
    return made


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("--check", action="store_true")
    check = arguments.parse_args().check
    differ = 0
    for name, text in files().items():
        path = FOLDER / name
        if check:
            if not path.is_file() or path.read_text() != text:
                differ += 1
                print(f"{path}: differs from what this script writes")
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
