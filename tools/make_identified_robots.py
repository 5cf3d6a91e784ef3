"""Writes robots/kr210_identified and robots/kr500_identified: arms with identified joints.

    python tools/make_identified_robots.py

Joint stiffness and damping are identified values. Numbers: `Robot_Model.m` and `Robot_DK_28N6.mat`
of GBT-ADL/Interactive-Coupling-Simulation-for-Robotic-Milling (see the READMEs of the robots).
Denavit-Hartenberg, standard: frame i is at the far end of link i,

    X_(i-1)(i) = Rz(q + offset) Tz(d) Tx(a) Rx(alpha)

and centre of mass and inertia (about it) are given in that frame. The frame of the URDF's link i is
on the axis of joint i instead, rotated only by q; the remaining transform, C = Rz(offset) Tz(d)
Tx(a) Rx(alpha), is the origin of the next joint and of the inertia, so the URDF contains the
moments of inertia as published. Needs numpy.
"""
import math
from pathlib import Path

import numpy as np

ROBOTS = Path(__file__).parent.parent / "robots"

ARMS = {
    "kr210_identified": dict(
        title="KR 210", base=0.2256, load=210.0,
        # d, a (m), alpha, offset (deg)
        dh=[(0.4494, 0.350, -90, 0), (0, 1.150, 0, -90), (0, 0.041, -90, 180), (-1.2, 0, 90, 0), (0, 0, -90, 0), (-0.42, 0, 180, 180)],
        mass=[259.85, 334.71, 217.46, 12.17, 29.53, 46.50],
        com=[(-0.36493, 0.22028, 0.00434), (-0.71793, 0.02787, -0.23573), (-0.02558, 0.02189, -0.31108),
             (0, 0.12343, 0.00135), (0.00005, -0.02400, -0.04670), (0.13734, 0, -0.09334)],
        # xx, yy, zz, xy, xz, yz
        inertia=[(8.8821, 13.7205, 16.2660, -0.4015, 1.0397, -0.3202), (6.1923, 55.8635, 55.1699, -1.6859, -6.1251, 0.2354),
                 (25.4402, 25.9246, 2.3116, -0.0781, 0.0171, 1.1022), (0.1285, 0.0298, 0.1302, 0, 0, -0.0028),
                 (0.4021, 0.2383, 0.2879, -0.0001, -0.0001, -0.0463), (0.2591, 1.1944, 1.1005, 0, 0.0621, 0)],
        # run 28N6; damping of axis 3 from run 38M3
        stiffness=[2207197.5, 3376721.9, 2775692.4, 2350164.6, 2157458.9, 467055.9],
        damping=[4706.2, 4481.0, 1232.3, 3065.7, 3506.0, 728.3],
        # from robots/kr210
        speed=[2.0384, 1.9451, 1.9547687622336491, 3.12413936106985, 3.001966313430247, 3.839724354387525],
        effort=[7290, 8910, 6988.84717, 2274.29199, 1398.30298, 781.554626]),
    "kr500_identified": dict(
        title="KR 500", base=0.566, load=500.0,
        dh=[(0.479, 0.500, -90, 0), (0, 1.300, 0, -90), (0, 0.055, -90, 180), (-1.025, 0, 90, 0), (0, 0, -90, 0), (-0.377, 0, 180, 180)],
        mass=[558.0, 485.0, 311.0, 86.0, 48.0, 7.0],
        com=[(-0.409, 0.205, 0.035), (-0.847, 0, -0.310), (-0.033, -0.010, 0.043), (0, 0.266, -0.011), (0, -0.038, -0.052), (0, 0, -0.027)],
        inertia=[(31.479, 59.845, 65.161, -11.062, 9.269, 1.849), (13.322, 113.722, 112.739, 11.567, -0.293, -0.251),
                 (27.449, 25.058, 10.561, -0.109, -0.301, 0.980), (2.783, 3.471, 1.423, 0, 0.172, 0),
                 (0.700, 0.684, 0.438, 0, 0, 0.112), (0.018, 0.018, 0.034, 0, 0, 0)],
        stiffness=[2.3e6, 8.6e6, 2.8e6, 3.0e6, 0.2e6, 0.9e6],
        damping=[1.9e3, 1.4e3, 0.6e3, 1.9e3, 1.4e3, 1.4e3],
        # from KR 500 R2800-2 of kroshu/kuka_robot_descriptions
        speed=[1.74532925199433, 1.38831658329915, 1.5707963267949, 1.5707963267949, 1.74532925199433, 2.84488668075076],
        effort=[13440, 18360, 11026.993040108, 5359.09461871641, 5363.94964557179, 3112.65024319794]),
}
RANGE_DEG = [(-185, 185), (-130, 20), (-100, 144), (-350, 350), (-120, 120), (-350, 350)]
# radius, length (m)
HUB = [(0.24, 0.30), (0.19, 0.36), (0.16, 0.34), (0.12, 0.24), (0.10, 0.22), (0.08, 0.06)]


def tensor(xx, yy, zz, xy, xz, yz):
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], float)


def turn(offset_deg, alpha_deg):
    """Rz(offset) Rx(alpha); both are multiples of 90 degrees, so the entries are -1, 0 and 1."""
    cos, sin = (lambda deg: round(math.cos(math.radians(deg)))), (lambda deg: round(math.sin(math.radians(deg))))
    c, s, ca, sa = cos(offset_deg), sin(offset_deg), cos(alpha_deg), sin(alpha_deg)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]], float) @ np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]], float)


def constants(row):
    """Position and rotation of C, and its roll, pitch, yaw as text."""
    d, a, alpha, offset = row
    return turn(offset, 0) @ [a, 0, d], turn(offset, alpha), f"{math.radians(alpha)!r} 0 {math.radians(offset)!r}"


def equal_inertia_box(mass, inertia):
    """Edges of the box with the same mass and principal moments, and its axes (rotation) in inertia
    axes."""
    moments, axes = np.linalg.eigh(inertia)
    if np.linalg.det(axes) < 0:
        axes[:, 2] *= -1
    return np.sqrt(6 / mass * (moments.sum() - 2 * moments)), axes


def roll_pitch_yaw(R):
    return math.atan2(R[2, 1], R[2, 2]), math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0])), math.atan2(R[1, 0], R[0, 0])


def urdf(name, arm):
    v = lambda a: " ".join(repr(round(float(x), 9) + 0.0) for x in a)
    visual = lambda xyz, rpy, shape, colour: (f'    <visual><origin xyz="{v(xyz)}" rpy="{v(rpy)}"/><geometry>{shape}</geometry>'
                                              f'<material name="{colour}"/></visual>')
    out = ['<?xml version="1.0"?>',
           f"<!-- {arm['title']}, identified inertia; written by tools/make_identified_robots.py. Units: m, kg, kg m2, rad. -->",
           f'<robot name="{name}">',
           '  <material name="body"><color rgba="0.62 0.66 0.70 1"/></material>',
           '  <material name="hub"><color rgba="0.93 0.53 0.13 1"/></material>',
           '  <link name="base_link">',
           visual([0, 0, arm["base"] / 2], [0, 0, 0], f'<cylinder radius="0.3" length="{arm["base"]!r}"/>', "body"),
           "  </link>"]
    parent, at, rpy = "base_link", [0, 0, arm["base"]], "0 0 0"
    for i in range(6):
        (low, high), inertia = RANGE_DEG[i], tensor(*arm["inertia"][i])
        moments = " ".join(f'{k}="{float(x)!r}"' for k, x in zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), arm["inertia"][i]))
        p, R, rpy_next = constants(arm["dh"][i])
        com = p + R @ arm["com"][i]
        edges, axes = equal_inertia_box(arm["mass"][i], inertia)
        radius, length = HUB[i]
        out += [f'  <link name="link_{i + 1}">', "    <inertial>", f'      <origin xyz="{v(com)}" rpy="{rpy_next}"/>',
                f'      <mass value="{arm["mass"][i]!r}"/>', f"      <inertia {moments}/>", "    </inertial>",
                visual([0, 0, 0], [0, 0, 0], f'<cylinder radius="{radius}" length="{length}"/>', "hub"),
                visual(com, roll_pitch_yaw(R @ axes), f'<box size="{" ".join(f"{x:.4f}" for x in edges)}"/>', "body"),
                "  </link>", f'  <joint name="joint_{i + 1}" type="revolute">', f'    <parent link="{parent}"/>',
                f'    <child link="link_{i + 1}"/>', f'    <origin xyz="{v(at)}" rpy="{rpy}"/>', '    <axis xyz="0 0 1"/>',
                f'    <limit lower="{math.radians(low)!r}" upper="{math.radians(high)!r}" effort="{arm["effort"][i]!r}"'
                f' velocity="{arm["speed"][i]!r}"/>', "  </joint>"]
        parent, at, rpy = f"link_{i + 1}", p, rpy_next
    out += ['  <link name="tool0"/>', '  <joint name="link_6-tool0" type="fixed">', '    <parent link="link_6"/>', '    <child link="tool0"/>',
            f'    <origin xyz="{v(at)}" rpy="{rpy}"/>', "  </joint>", "</robot>", ""]
    return "\n".join(out)


def toml(name, arm, load=None):
    out = [f"# {arm['title']} with identified gearboxes; written by tools/make_identified_robots.py, numbers in README.md.", "format = 1",
           f'name = "{name}"', f'urdf = "{name}.urdf"', "gravity = [0.0, 0.0, -9.81]",
           'default_trajectory = "../../trajectories/identified_arms.toml"', "", "# frame 6 of the model, z out of the flange",
           'tcp = { link = "tool0", xyz = [0.0, 0.0, 0.0], rpy = [0.0, 0.0, 0.0] }']
    if load:
        out += ["", "# a point at the flange", f'payload = {{ link = "tool0", mass = {load!r}, com = [0.0, 0.0, 0.0] }}']
    for i in range(6):
        out += ["", "[[drive]]", f'joint = "joint_{i + 1}"', 'kind = "gearbox"',
                f'gearbox = {{ stiffness = {arm["stiffness"][i]!r}, damping = {arm["damping"][i]!r} }}']
    return "\n".join(out + [""])


if __name__ == "__main__":
    for name, arm in ARMS.items():
        folder = ROBOTS / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.urdf").write_text(urdf(name, arm))
        (folder / "robot.toml").write_text(toml(name, arm))
        (folder / "loaded.toml").write_text(toml(name, arm, arm["load"]).replace(f'name = "{name}"', f'name = "{name}_loaded"'))
        print(folder.name)
