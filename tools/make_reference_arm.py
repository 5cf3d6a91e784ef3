"""Writes robots/test/reference_arm and robots/test/reference_arm_coupled: URDF and robot.toml. Needs numpy
only.

    python tools/make_reference_arm.py

An artificial six-axis arm with two uniform beams, for comparing simulators. The plain variant
splits each beam at half its length, its elastic centre, so that the stiffness of the elastic joint
is diagonal. The coupled variant has the same beams off the joint line, the box rotated by 25
degrees, and splits at 0.4 and 0.6: the 6x6 is full. All joint frames are parallel to the world at
q = 0.
"""
import math
from pathlib import Path

import numpy as np

ROBOTS = Path(__file__).parent.parent / "robots/test"
X, Y, Z = np.eye(3)

# lower arm: aluminium box, 160 mm along link x (section y), 120 mm along link y (section z), wall
# 10 mm
BOX = dict(width=0.16, height=0.12, wall=0.01)
ALUMINIUM = dict(E=70e9, nu=0.33, rho=2700.0)
# forearm: steel tube, outer diameter 140 mm, wall 6 mm; shear factor of Cowper (1966) for a *thin*
# tube
RO, RI, STEEL_E, STEEL_NU = 0.070, 0.064, 210e9, 0.30

# split, offset, roll of lower arm and forearm; beta of D = beta K, about 3 % on the first mode at q
# = 0
VARIANTS = {
    "reference_arm": dict(low=(0.5, [0, 0, 0], 0.0), up=(0.5, [0, 0, 0], 0.0), beta=0.0010536078174585805),
    "reference_arm_coupled": dict(low=(0.4, [0.03, 0.05, 0], math.radians(25.0)), up=(0.6, [0, 0.02, -0.04], 0.0),
                                  beta=0.0010220415109918086),
}


def box_inertia(m, dx, dy, dz):
    return m / 12.0 * np.diag([dy * dy + dz * dz, dx * dx + dz * dz, dx * dx + dy * dy])


def merge(bodies):
    mass = sum(b[0] for b in bodies)
    com = sum(b[0] * np.asarray(b[1]) for b in bodies) / mass
    inertia = np.zeros((3, 3))
    for m, c, I in bodies:
        d = np.asarray(c) - com
        inertia += I + m * (d @ d * np.eye(3) - np.outer(d, d))
    return mass, com, inertia


def uniform_beam(mass, length, axis, y, offset, roll, i_y2, i_z2):
    """The whole bar with the rotary inertia of its section; i_y2 = I_y / A."""
    z = np.cross(axis, y)
    c, s = math.cos(roll), math.sin(roll)
    R = np.column_stack([axis, c * y + s * z, -s * y + c * z])
    I = mass * np.diag([i_y2 + i_z2, length**2 / 12 + i_y2, length**2 / 12 + i_z2])
    return mass, np.asarray(offset) + 0.5 * length * axis, R @ I @ R.T


def box_radii():
    w, h, t = BOX["width"], BOX["height"], BOX["wall"]
    wi, hi = w - 2 * t, h - 2 * t
    A = w * h - wi * hi
    return (w * h**3 - wi * hi**3) / 12 / A, (h * w**3 - hi * wi**3) / 12 / A


def tube_numbers():
    A = math.pi * (RO**2 - RI**2)
    I = math.pi / 4 * (RO**4 - RI**4)
    G = STEEL_E / (2 * (1 + STEEL_NU))
    kGA = 2 * (1 + STEEL_NU) / (4 + 3 * STEEL_NU) * G * A
    per_length = 40.0                                                # kg/m: 40 kg on 1 m
    return dict(EA=STEEL_E * A, EI_y=STEEL_E * I, EI_z=STEEL_E * I, GJ=G * 2 * I, kGA_y=kGA, kGA_z=kGA,
                mass_per_length=per_length, rotary_y=per_length * I / A, rotary_z=per_length * I / A)


def arm(variant):
    """(link, axis, joint origin, body, visual primitives (shape, xyz, rpy, colour)) from the base
    to the tool."""
    low, up = variant["low"], variant["up"]
    tube = tube_numbers()
    i2 = tube["rotary_y"] / tube["mass_per_length"]
    lower = uniform_beam(60.0, 1.095, Z, X, low[1], low[2], *box_radii())
    forearm = uniform_beam(40.0, 1.0, X, Y, up[1], up[2], i2, i2)
    tool = merge([(3.0, [-0.01, 0, 0], box_inertia(3.0, 0.03, 0.10, 0.10)),
                  (20.0, [0.12, 0, 0.04], box_inertia(20.0, 0.20, 0.20, 0.20))])
    box, turned = '<box size="{} {} {}"/>', f"{0.5 * math.pi!r} 0 0"
    cylinder = '<cylinder radius="{}" length="{}"/>'
    lo, fo = np.asarray(low[1], float), np.asarray(up[1], float)
    return [
        ("link_1", Z, [0, 0, 0], (140.0, [0.06, 0, 0.33], box_inertia(140.0, 0.45, 0.40, 0.50)),
         [(cylinder.format(0.2, 0.3), [0, 0, 0.15], "0 0 0", "rigid"), (box.format(0.4, 0.3, 0.3), [0.08, 0, 0.42], "0 0 0", "rigid")]),
        ("link_2", Y, [0.175, 0, 0.495], lower,
         [(cylinder.format(0.12, 0.34), [0, 0, 0], turned, "flexible"),
          (box.format(0.16, 0.12, 1.095), lo + [0, 0, 0.5475], f"0 0 {low[2]!r}", "flexible")]),
        ("link_3", Y, [0, 0, 1.095], (90.0, [0.03, 0, 0.15], box_inertia(90.0, 0.50, 0.35, 0.38)),
         [(cylinder.format(0.13, 0.32), [0, 0, 0], turned, "rigid"), (box.format(0.5, 0.24, 0.25), [0.02, 0, 0.17], "0 0 0", "rigid")]),
        ("link_4", X, [0.27, 0, 0.175], forearm,
         [(cylinder.format(0.07, 1.0), fo + [0.5, 0, 0], f"0 {0.5 * math.pi!r} 0", "flexible")]),
        ("link_5", Y, [1.0, 0, 0], (12.0, [0.04, 0, 0], box_inertia(12.0, 0.16, 0.14, 0.14)),
         [(cylinder.format(0.075, 0.17), [0, 0, 0], turned, "rigid"), (box.format(0.12, 0.10, 0.10), [0.06, 0, 0], "0 0 0", "rigid")]),
        ("link_6", X, [0.135, 0, 0], tool,
         [(box.format(0.03, 0.1, 0.1), [-0.01, 0, 0], "0 0 0", "rigid"), (box.format(0.2, 0.2, 0.2), [0.12, 0, 0.04], "0 0 0", "load")]),
    ]


def urdf(name, links):
    v = lambda a: " ".join(repr(float(x) + 0.0) for x in a)
    out = ['<?xml version="1.0"?>',
           "<!-- Made-up arm; written by tools/make_reference_arm.py. Units: m, kg, kg m2, rad. -->",
           f'<robot name="{name}">',
           '  <material name="rigid"><color rgba="0.62 0.66 0.70 1"/></material>',
           '  <material name="flexible"><color rgba="0.93 0.53 0.13 1"/></material>',
           '  <material name="load"><color rgba="0.35 0.45 0.60 0.6"/></material>',
           '  <link name="base_link"/>']
    parent = "base_link"
    for i, (link, axis, at, (mass, com, I), visuals) in enumerate(links, 1):
        moments = " ".join(f'i{"xyz"[r]}{"xyz"[c]}="{float(I[r, c])!r}"' for r in range(3) for c in range(r, 3))
        out += [f'  <link name="{link}">', "    <inertial>", f'      <origin xyz="{v(com)}"/>', f'      <mass value="{mass!r}"/>',
                f"      <inertia {moments}/>", "    </inertial>"]
        for shape, xyz, rpy, colour in visuals:
            out.append(f'    <visual><origin xyz="{v(np.round(xyz, 9))}" rpy="{rpy}"/><geometry>{shape}</geometry><material name="{colour}"/></visual>')
        out += ["  </link>", f'  <joint name="joint_{i}" type="revolute">', f'    <parent link="{parent}"/>', f'    <child link="{link}"/>',
                f'    <origin xyz="{v(at)}"/>', f'    <axis xyz="{v(axis)}"/>',
                '    <limit lower="-6.283185307179586" upper="6.283185307179586" effort="20000" velocity="4"/>', "  </joint>"]
        parent = link
    return "\n".join(out + ["</robot>", ""])


def box_numbers():
    """The box as in the reference data: Bredt's torsion, shear only in the walls along the
    force."""
    w, h, t = 0.16, 0.12, 0.01
    E, nu, rho = (ALUMINIUM[k] for k in ("E", "nu", "rho"))
    A = w * h - (w - 2 * t) * (h - 2 * t)
    I_y, I_z = ((a * b**3 - (a - 2 * t) * (b - 2 * t)**3) / 12 for a, b in ((w, h), (h, w)))
    J = 2 * t * ((w - t) * (h - t))**2 / (w + h - 2 * t)
    G = E / (2 * (1 + nu))
    return dict(EA=E * A, EI_y=E * I_y, EI_z=E * I_z, GJ=G * J, kGA_y=2 * t * w * G, kGA_z=2 * t * h * G,
                mass_per_length=rho * A, rotary_y=rho * I_y, rotary_z=rho * I_z)


def toml(name, variant):
    array = lambda a: "[" + ", ".join(repr(float(x)) for x in a) + "]"
    low, up = variant["low"], variant["up"]
    given = ", ".join(f"{k} = {float(x)!r}" for k, x in tube_numbers().items())
    box = ", ".join(f"{k} = {float(x)!r}" for k, x in box_numbers().items())
    place = lambda p: f"split = {p[0]!r}, offset = {array(p[1])}, roll = {p[2]!r}, parts = \"uniform\""
    link = lambda n: (f'[[flexible_link]]\nlink = "link_{n}"\ndistal = "joint_{n + 1}"\nmodel = "lumped"\nsegments = 2\n'
                      f'angles = "euler-zyx"\ndamping = {{ stiffness_beta = {variant["beta"]!r} }}\n')
    return (f"# Written by tools/make_reference_arm.py; see README.md.\nformat = 1\nname = \"{name}\"\nurdf = \"{name}.urdf\"\n"
            "tcp = { link = \"link_6\", xyz = [0.2, 0.0, 0.0], rpy = [0.0, 0.0, 0.0] }\ngravity = [0.0, 0.0, -9.81]\n"
            "default_trajectory = \"../../../trajectories/reference_arm.toml\"\n\n"
            "# aluminium box, 160 x 120 mm, wall 10 mm, shear in the walls along the force alone, as the reference data have it; 60 kg, not rho A l\n"
            + link(2) + f'beam = {{ section = "given", {box}, theory = "timoshenko", y_axis = [1.0, 0.0, 0.0], {place(low)} }}\n\n'
            "# steel tube, 140 mm, wall 6 mm, E 210 GPa, nu 0.3, shear factor 2(1 + nu)/(4 + 3 nu) of a thin tube; 40 kg\n"
            + link(4) + f'beam = {{ section = "given", {given}, theory = "timoshenko", y_axis = [0.0, 1.0, 0.0], {place(up)} }}\n')


if __name__ == "__main__":
    for name, variant in VARIANTS.items():
        folder = ROBOTS / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.urdf").write_text(urdf(name, arm(variant)))
        (folder / "robot.toml").write_text(toml(name, variant))
        print(folder.name)
