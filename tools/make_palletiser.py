#!/usr/bin/env python3
"""Writes robots/palletiser/palletiser.urdf: a generic four-axis palletiser with closed loops.
Usage: make_palletiser.py [-o FILE]

All dimensions and masses are assumptions for the class (see robots/palletiser/README.md). Inertias
are those of the drawn boxes and cylinders with the mass of the link distributed evenly over their
volume. Needs no third-party packages.
"""
import argparse
import math
from pathlib import Path

# Positions in the plane of the loops, x forward, z up (m), at rest: lower arm upright, upper arm
# horizontal.
SHOULDER = (0.30, 0.81)                 # joint_2 in the column
LOWER, UPPER = 1.28, 1.35               # lower arm, upper arm from elbow to wrist
HAND = (0.22, -0.25)                    # flange from the wrist
LEVER = 0.40                            # crank, and lever behind the elbow
# its direction from x to z: perpendicular to the lower arm with the elbow at 35 deg
LEVER_AT = math.radians(215.0)
PLATE = 0.28                            # levers that keep the hand level
# perpendicular to the lower arm when that leans 21 deg forward
BRACKET_AT = math.radians(159.0)
# perpendicular to the upper arm when that points 50 deg down
ARM_AT = math.radians(40.0)
# Rods are next to the arm (m).
DRIVE_Y, LEVEL_Y = 0.24, -0.24


def polar(r, angle):
    return (r * math.cos(angle), r * math.sin(angle))


def number(x):
    text = f"{x:.9f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def triple(v):
    return " ".join(number(x) for x in v)


class Solid:
    """A box or a cylinder (axis z before pitch) at a position, rotated by pitch about y or roll
    about x."""

    def __init__(self, kind, size, at, pitch=0.0, roll=0.0):
        self.kind, self.size, self.at, self.pitch, self.roll = kind, size, at, pitch, roll

    def volume(self):
        if self.kind == "box":
            return self.size[0] * self.size[1] * self.size[2]
        return math.pi * self.size[0] ** 2 * self.size[1]

    def moments(self, m):
        """Returns the 3x3 inertia about its own centre, in link axes."""
        if self.kind == "box":
            x, y, z = (s * s for s in self.size)
            d = [m * (y + z) / 12, m * (x + z) / 12, m * (x + y) / 12]
        else:
            r, l = self.size
            side = m * (3 * r * r + l * l) / 12
            d = [side, side, m * r * r / 2]
        c, s = math.cos(self.pitch), math.sin(self.pitch)
        R = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
        if self.roll:
            c, s = math.cos(self.roll), math.sin(self.roll)
            R = [[1, 0, 0], [0, c, -s], [0, s, c]]
        return [[sum(R[i][k] * d[k] * R[j][k] for k in range(3)) for j in range(3)] for i in range(3)]

    def visual(self, material):
        g = (f'<box size="{triple(self.size)}"/>' if self.kind == "box"
             else f'<cylinder radius="{number(self.size[0])}" length="{number(self.size[1])}"/>')
        return (f'    <visual><origin xyz="{triple(self.at)}" rpy="{triple((self.roll, self.pitch, 0))}"/>'
                f'<geometry>{g}</geometry><material name="{material}"/></visual>')


def bar(start, end, width, y, depth=None):
    """Returns a box from one point of the plane to another."""
    dx, dz = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dz)
    at = ((start[0] + end[0]) / 2, y, (start[1] + end[1]) / 2)
    return Solid("box", (width, depth or width, length), at, math.atan2(dx, dz))


def hub(at, radius, length, y=0.0):
    return Solid("cylinder", (radius, length), (at[0], y, at[1]), roll=math.pi / 2)


def link(name, mass, solids, material="rigid"):
    lines = [f'  <link name="{name}">']
    if mass:
        total = sum(s.volume() for s in solids)
        parts = [(mass * s.volume() / total, s) for s in solids]
        c = [sum(m * s.at[k] for m, s in parts) / mass for k in range(3)]
        I = [[0.0] * 3 for _ in range(3)]
        for m, s in parts:
            own, r = s.moments(m), [s.at[k] - c[k] for k in range(3)]
            r2 = sum(x * x for x in r)
            for i in range(3):
                for j in range(3):
                    I[i][j] += own[i][j] + m * ((r2 if i == j else 0.0) - r[i] * r[j])
        lines += ["    <inertial>", f'      <origin xyz="{triple(c)}"/>', f'      <mass value="{number(mass)}"/>',
                  f'      <inertia ixx="{number(I[0][0])}" ixy="{number(I[0][1])}" ixz="{number(I[0][2])}" '
                  f'iyy="{number(I[1][1])}" iyz="{number(I[1][2])}" izz="{number(I[2][2])}"/>', "    </inertial>"]
    lines += [s.visual(material) for s in solids] + ["  </link>"]
    return lines


def joint(name, kind, parent, child, at, axis="0 1 0", limit=None):
    lines = [f'  <joint name="{name}" type="{kind}">', f'    <parent link="{parent}"/>', f'    <child link="{child}"/>',
             f'    <origin xyz="{triple(at)}"/>']
    if kind != "fixed":
        lines.append(f'    <axis xyz="{axis}"/>')
    if limit:
        low, high, effort, speed = limit
        lines.append(f'    <limit lower="{number(math.radians(low))}" upper="{number(math.radians(high))}" '
                     f'effort="{number(effort)}" velocity="{number(math.radians(speed))}"/>')
    return lines + ["  </joint>"]


def urdf():
    lever, bracket, arm = polar(LEVER, LEVER_AT), polar(PLATE, BRACKET_AT), polar(PLATE, ARM_AT)
    o = (0.0, 0.0)
    # Passive joints carry no torque; their limits are those of the machine.
    passive = lambda low, high: (low, high, 0, 360)
    out = ['<?xml version="1.0"?>', "<!--", "  A generic four-axis palletiser with three closed loops; written by tools/make_palletiser.py.",
           "  The bars that close the loops end in the air here: robot.toml has the pins. Units: m, kg, kg m2, rad. See README.md.", "-->",
           '<robot name="palletiser">',
           '  <material name="rigid"><color rgba="0.62 0.66 0.70 1"/></material>',
           '  <material name="flexible"><color rgba="0.93 0.53 0.13 1"/></material>',
           '  <material name="rods"><color rgba="0.25 0.45 0.70 1"/></material>']
    out += link("base_link", 420, [Solid("cylinder", (0.38, 0.36), (0, 0, 0.18))])
    out += joint("joint_1", "revolute", "base_link", "column", (0, 0, 0.36), "0 0 1", (-180, 180, 9000, 95))
    s = (SHOULDER[0], SHOULDER[1] - 0.36)
    out += link("column", 480, [Solid("cylinder", (0.34, 0.20), (0, 0, 0.10)), bar((0.05, 0.15), s, 0.34, 0, 0.36),
                                bar(s, (s[0] + bracket[0], s[1] + bracket[1]), 0.08, LEVEL_Y, 0.06)])
    out += joint("joint_2", "revolute", "column", "lower_arm", (s[0], 0, s[1]), limit=(-42, 85, 9500, 95))
    out += link("lower_arm", 160, [bar(o, (0, LOWER), 0.22, 0, 0.20), hub(o, 0.18, 0.24), hub((0, LOWER), 0.14, 0.24)])
    out += joint("elbow", "revolute", "lower_arm", "upper_arm", (0, 0, LOWER), limit=passive(-20, 90))
    out += link("upper_arm", 150, [bar(o, (UPPER, 0), 0.20, 0, 0.18), bar(o, lever, 0.16, 0, 0.12)], "flexible")
    out += joint("wrist", "revolute", "upper_arm", "hand", (UPPER, 0, 0), limit=passive(-120, 20))
    out += link("hand", 60, [bar(o, (HAND[0], 0), 0.14, 0), Solid("cylinder", (0.09, 0.20), (HAND[0], 0, HAND[1] + 0.13)),
                             bar(o, arm, 0.06, LEVEL_Y, 0.05)])
    out += joint("joint_4", "revolute", "hand", "flange", (HAND[0], 0, HAND[1]), "0 0 -1", (-300, 300, 1500, 240))
    out += link("flange", 15, [Solid("cylinder", (0.10, 0.06), (0, 0, 0.0))])
    out += joint("tool_joint", "fixed", "flange", "tool0", (0, 0, -0.03))
    out += ['  <link name="tool0"/>']
    # Drive of the upper arm.
    out += joint("joint_3", "revolute", "column", "crank", (s[0], 0, s[1]), limit=(-20, 120, 9500, 95))
    out += link("crank", 35, [bar(o, lever, 0.14, DRIVE_Y - 0.06, 0.05), hub(o, 0.15, 0.05, DRIVE_Y - 0.06)], "rods")
    out += joint("drive_rod", "revolute", "crank", "drive_rod_bar", (lever[0], 0, lever[1]), limit=passive(-90, 20))
    out += link("drive_rod_bar", 22, [bar(o, (0, LOWER), 0.07, DRIVE_Y, 0.05)], "rods")
    # A frame at the pin, so that the rod can be a flexible link.
    out += joint("drive_rod_end_joint", "fixed", "drive_rod_bar", "drive_rod_end", (0, 0, LOWER)) + ['  <link name="drive_rod_end"/>']
    # Linkage that keeps the hand level.
    out += joint("level_rod", "revolute", "column", "level_rod_bar", (s[0] + bracket[0], 0, s[1] + bracket[1]), limit=passive(-42, 85))
    out += link("level_rod_bar", 14, [bar(o, (0, LOWER), 0.05, LEVEL_Y - 0.07, 0.04)], "rods")
    out += joint("plate", "revolute", "lower_arm", "plate_body", (0, 0, LOWER), limit=passive(-85, 42))
    out += link("plate_body", 18, [bar(o, bracket, 0.07, LEVEL_Y, 0.05), bar(o, arm, 0.07, LEVEL_Y, 0.05)], "rods")
    out += joint("hand_rod", "revolute", "plate_body", "hand_rod_bar", (arm[0], 0, arm[1]), limit=passive(-20, 120))
    out += link("hand_rod_bar", 14, [bar(o, (UPPER, 0), 0.05, LEVEL_Y - 0.07, 0.04)], "rods")
    return "\n".join(out + ["</robot>"]) + "\n", lever, bracket, arm


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", type=Path, default=Path(__file__).resolve().parent.parent / "robots/palletiser/palletiser.urdf")
    out = parser.parse_args().o
    text, lever, bracket, arm = urdf()
    out.write_text(text)
    print(f"{out}\nlever {triple(lever)}  bracket {triple(bracket)}  arm {triple(arm)}")


if __name__ == "__main__":
    main()
