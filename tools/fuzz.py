#!/usr/bin/env python3
"""Runs the built program on corrupted input of every format, and on odd command lines.

    python3 tools/fuzz.py                      # 300 runs with the release build, two at a time
    python3 tools/fuzz.py --runs 5000 --seed 7 # as a nightly job
    python3 tools/fuzz.py --only urdf,mesh-inp --runs 1000
    python3 tools/fuzz.py --first 1234 --runs 1 --keep found   # one run again

Every run changes one valid file (bytes, lines, numbers, counts, nesting) and passes it to a
command. A run fails if it ends by a signal or with an exit code other than 0, 1 or 2, if it panics,
takes too much time or memory, fails without a message, or succeeds with NaN or infinity. Runs that
step through time may be long: they must stop when asked to.

The same seed gives the same runs. Failing inputs are written to the folder --keep with the command
line and the output. Needs only Python; the valid files are in this repository, are written here, or
by the program itself. Formats that the build does not support (Arrow and SQLite bags of the default build)
are left out, with a message.
"""

import argparse
import collections
import concurrent.futures
import functools
import gzip
import json
import math
import os
import random
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# ----------------------------------------------------------------------------------------------------------------
# sound files

URDF = """<?xml version="1.0"?>
<robot name="beam">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <link name="base"/>
  <joint name="swing" type="revolute">
    <parent link="base"/>
    <child link="bar"/>
    <origin xyz="0 0 0.1" rpy="0 0 0"/>
    <axis xyz="0 0 1"/>
    <limit lower="-3.0" upper="3.0" effort="500" velocity="4"/>
    <dynamics damping="0.1" friction="0.2"/>
  </joint>
  <link name="bar">
    <inertial>
      <origin xyz="0.4 0 0" rpy="0 0 0"/>
      <mass value="1.728"/>
      <inertia ixx="0.000288" ixy="0" ixz="0" iyy="0.0923904" iyz="0" izz="0.0922176"/>
    </inertial>
    <visual>
      <origin xyz="0.4 0 0"/>
      <geometry><VISUAL/></geometry>
      <material name="grey"/>
    </visual>
  </link>
  <joint name="elbow" type="revolute">
    <parent link="bar"/>
    <child link="ball"/>
    <origin xyz="0.8 0 0"/>
    <axis xyz="0 1 0"/>
    <limit lower="-2.0" upper="2.0" effort="100" velocity="4"/>
  </joint>
  <link name="ball">
    <inertial>
      <origin xyz="0.1 0 0"/>
      <mass value="0.5"/>
      <inertia ixx="0.000125" ixy="0" ixz="0" iyy="0.000325" iyz="0" izz="0.000325"/>
    </inertial>
  </link>
  <joint name="finger" type="prismatic">
    <parent link="ball"/>
    <child link="tip"/>
    <origin xyz="0.2 0 0"/>
    <axis xyz="1 0 0"/>
    <limit lower="-0.1" upper="0.1" effort="10" velocity="1"/>
    <mimic joint="elbow" multiplier="0.01" offset="0.0"/>
  </joint>
  <link name="tip">
    <inertial>
      <mass value="0.05"/>
      <inertia ixx="0.00001" ixy="0" ixz="0" iyy="0.00001" iyz="0" izz="0.00001"/>
    </inertial>
  </link>
  <transmission name="t1"><joint name="swing"/><actuator name="m"><mechanicalReduction>100</mechanicalReduction></actuator></transmission>
</robot>
"""

SWEEP = """format = 1
name = "fuzzed"
robot = "robot.toml"
motion = "motion.toml"
metrics = ["peak_mm = 1e3 * tcp.peak_m", "links.bar.peak_contribution_m", "mass = robot.mass_kg"]
best = "peak_mm"
pareto = ["mass", "peak_mm"]

[options]
step = 0.01
links = "lumped"

[[parameter]]
path = "payload.mass"
from = 1.0
to = 2.0
count = 2

[[parameter]]
name = "height"
path = "link.bar.beam.height"
distribution = "uniform"
low = 0.03
high = 0.05

[[parameter]]
paths = ["link.bar.damping.modal"]
expression = "0.5 * height + 0.001 * payload.mass"

[sample]
method = "saltelli"
count = 2
seed = 3
"""

SWEEP_TABLE = """format = 1
robot = "robot.toml"
motion = "motion.toml"
runs = "table.csv"
[options]
step = 0.01
"""

XACRO = """<?xml version="1.0"?>
<robot name="beam" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:property name="length" value="0.8"/>
  <xacro:property name="mass" value="${2 * 0.864}"/>
  <xacro:arg name="prefix" default=""/>
  <xacro:macro name="rod" params="name mass:=1 *origin">
    <link name="${name}">
      <inertial>
        <xacro:insert_block name="origin"/>
        <mass value="${mass}"/>
        <inertia ixx="0.0003" ixy="0" ixz="0" iyy="${mass * length**2 / 12}" iyz="0" izz="${mass * length**2 / 12}"/>
      </inertial>
    </link>
  </xacro:macro>
  <link name="$(arg prefix)base"/>
  <xacro:if value="${length > 0.5}">
    <joint name="swing" type="revolute">
      <parent link="$(arg prefix)base"/>
      <child link="bar"/>
      <axis xyz="0 0 1"/>
      <limit lower="${-radians(170)}" upper="${radians(170)}" effort="500" velocity="4"/>
    </joint>
  </xacro:if>
  <xacro:rod name="bar" mass="${mass}"><origin xyz="${length / 2} 0 0"/></xacro:rod>
</robot>
"""

ROBOT = """format = 1
name = "beam"
urdf = "beam.urdf"
tcp = { link = "ball", xyz = [0.2, 0.0, 0.0], rpy = [0.0, 0.1, 0.0] }
payload = { link = "ball", mass = 1.5, com = [0.2, 0.0, 0.0], inertia = [0.01, 0.01, 0.01, 0.0, 0.0, 0.0] }
gravity = [0.0, 0.0, -9.81]

[[flexible_link]]
link = "bar"
distal = "elbow"
damping = { modal = 0.03 }
model = "lumped"
segments = 3
angles = "rotation-vector"
beam = { section = "rectangle", width = 0.02, height = 0.04, material = "aluminium", y_axis = [0.0, 1.0, 0.0], parts = "uniform" }

[[drive]]
joint = "swing"
kind = "gearbox"
ratio = 100.0
motor_inertia = 1e-5
gearbox = { stiffness = 2.2e4, damping = 4.0, backlash = 1e-4 }
friction = { viscous = 0.5, coulomb = 0.3, stribeck = 0.1, stribeck_velocity = 0.1, regularisation = 0.01 }

[[drive]]
joint = "elbow"
kind = "torque"
ratio = 50.0
motor_inertia = 1e-5
gearbox = { curve = [[-2e-2, -60.0], [0.0, 0.0], [2e-2, 60.0]], damping = 0.5 }
torque_limit = 100.0
servo = { position_gain = 15.0, sample_s = 0.002 }
"""

BALANCERS = """
[[balancer]]
name = "strut"
from = { link = "base", xyz = [0.0, -0.3, 0.4] }
to = { link = "bar", xyz = [0.7, 0.0, 0.0] }
spring = { rate = 50.0, free_length = 0.4, preload = 3.0 }

[[balancer]]
from = { link = "base", xyz = [-0.2, 0.1, 0.1] }
to = { link = "bar", xyz = [0.2, 0.0, 0.05] }
gas = { acts = "pull", pressure = 2e5, volume = 1e-3, piston_diameter = 0.03, rod_diameter = 0.01, length = 0.4, exponent = 1.3, ambient_pressure = 1e5 }

[[balancer]]
from = { link = "bar", xyz = [0.5, 0.0, 0.2] }
to = { link = "ball", xyz = [0.1, 0.0, 0.0] }
gas_spring = { force = 20.0, length = 0.6, stroke = 0.5, progression = 1.4 }

[[balancer]]
joint = "elbow"
sine = { torque = 2.0, zero = 0.1 }

[[balancer]]
joint = "finger"
curve = [[-0.1, 4.0], [0.0, 0.0], [0.1, -4.0]]
"""

MOUNTING = """
[mounting]
name = "foot"
stiffness = [2e7, 2e7, 4e7, 1e6, 1e6, 2e6]
xyz = [0.0, 0.0, -0.3]
rpy = [0.0, 0.1, 0.2]
mass = 12.0
com = [0.0, 0.0, 0.1]
inertia = [0.2, 0.2, 0.1, 0.0, 0.0, 0.0]
damping = { rayleigh = [0.5, 1e-4] }
"""

GEAR_KEYS = "transmission_error = [{ amplitude_arcsec = 20.0, per_motor_turn = 2, phase = 0.3 }, { amplitude = 1e-5, per_joint_turn = 39 }], hysteresis = { loss_arcmin = 2.0, lost_motion_arcmin = 3.0, rated_torque = 40.0, reach = 1e-4, sliders = 5 }"

COLUMN = """
[mounting]
xyz = [0.0, 0.1, -0.5]
model = "lumped"
segments = 2
beam = { section = "tube", outer_diameter = 0.1, wall = 0.005, material = "steel" }
"""

FOUR_BAR = """<?xml version="1.0"?>
<robot name="four_bar">
  <link name="base"/>
  <joint name="crank" type="revolute"><parent link="base"/><child link="crank_bar"/><axis xyz="0 1 0"/>
    <limit lower="-0.6" upper="0.6" effort="500" velocity="4"/></joint>
  <link name="crank_bar"><inertial><origin xyz="0 0 0.2"/><mass value="2"/><inertia ixx="0.03" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.01"/></inertial></link>
  <joint name="rod" type="continuous"><parent link="crank_bar"/><child link="rod_bar"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/></joint>
  <link name="rod_bar"><inertial><origin xyz="0.35 0 0"/><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.04" iyz="0" izz="0.04"/></inertial></link>
  <joint name="rocker" type="continuous"><parent link="base"/><child link="rocker_bar"/><origin xyz="0.7 0 0"/><axis xyz="0 1 0"/></joint>
  <link name="rocker_bar"><inertial><origin xyz="0 0 0.3"/><mass value="3"/><inertia ixx="0.06" ixy="0" ixz="0" iyy="0.06" iyz="0" izz="0.01"/></inertial></link>
</robot>
"""

LOOPS = """format = 1
name = "four_bar"
urdf = "beam.urdf"
tcp = { link = "rocker_bar", xyz = [0.0, 0.0, 0.6] }

[[loop]]
name = "four bars"
pin = { link = "rocker_bar", xyz = [0.0, 0.0, 0.5] }
axis = [0.0, 1.0, 0.0]
eye = { link = "rod_bar", xyz = [0.71, 0.0, 0.0] }
dependent = ["rod", "rocker"]
at = { rod = -0.14, rocker = 0.02, crank = 0.01 }

[[drive]]
joint = "crank"
kind = "gearbox"
gearbox = { stiffness = 2e4, damping = 30.0 }
"""

FOUR_BAR_MOTION = """format = 1
unit = "deg"
joints = ["crank"]
start = [0.0]

[[move]]
to = [20.0]
duration = 0.4
"""

MEASUREMENTS = """format = 1
length = "mm"
angle = "deg"
force = "N"
loss = "huber"
fit = ["drive.*", "link.bar.stiffness_factor", "payload.mass"]
uncertainty = 2.0

[[parameter]]
name = "payload.mass"
uncertainty = 0.5

[instrument.tracker]

[target.ball]
xyz = [0.0, 5.0, 3.0]
unknown = true

[[displacement]]
joints = [0.0, 0.0]
load = { force = [0.0, 0.0, -100.0], torque = [0.0, 10.0, 0.0], at = [10.0, 0.0, 0.0], mass = 1.0, com = [0.0, 0.0, 1.0] }
before = { mass = 0.5 }
point = [10.0, 0.0, 0.0]
value = [0.1, 0.0, -4.0]
rotation = [0.0, 0.1, 0.0]
std = 0.03
std_rotation = 0.01

[[displacement]]
file = "pulls.csv"
direction = [0.0, 0.0, 1.0]
std = 0.03

[[frequency]]
joints = { swing = 10.0, elbow = 20.0 }
hz = [4.0, 9.0]
modes = [1, 2]
std = 0.1
"""

PULLS = """swing,elbow,fx,fy,fz,mass,d
0,10,0,0,-100,0,-4.1
20,-10,0,0,-50,1.0,-2.5
-20,30,0,20,-50,1.0,-2.2
"""

ROBOT_FLEX = """format = 1
name = "beam"
urdf = "beam.urdf"
tcp = { link = "ball" }

[[flexible_link]]
link = "bar"
distal = "elbow"
reduced = "bar.flex"
model = "MODEL"
"""

PROGRAMS = {
    "part.src": """DEF part()
DECL INT k
BAS(#INITMOV, 0)
$VEL.CP = 0.25
$ACC.CP = 2.0
$APO.CDIS = 5.0
PTP {A1 0, A2 -60, A3 90, A4 0, A5 60, A6 0}
FOR k = 1 TO 2
  LIN {X 1700, Y 0, Z 1400, A 0, B 90, C 0} C_DIS
  LIN {X 1700, Y 100, Z 1400, A 0, B 90, C 0} C_DIS
ENDFOR
CIRC {X 1750, Y 50, Z 1400}, {X 1700, Y 0, Z 1400, A 0, B 90, C 0}
$OUT[3] = TRUE
WAIT SEC 0.1
END
""",
    "part.mod": """MODULE part
  CONST jointtarget home := [[0, -60, 90, 0, 60, 0], [9E9, 9E9, 9E9, 9E9, 9E9, 9E9]];
  CONST robtarget p1 := [[1700, 0, 1400], [0.70710678, 0, 0.70710678, 0], [0, 0, 0, 0], [9E9, 9E9, 9E9, 9E9, 9E9, 9E9]];
  PROC main()
    VAR num i;
    MoveAbsJ home, v500, fine, tool0;
    FOR i FROM 1 TO 2 DO
      MoveL p1, v200, z10, tool0;
      MoveL Offs(p1, 0, 100, 0), v200, fine, tool0;
    ENDFOR
    SetDO do1, 1;
    WaitTime 0.1;
  ENDPROC
ENDMODULE
""",
    "part.script": """def part():
  a = 1.2
  movej([0, -1.0472, 1.5708, 0, 1.0472, 0], a=a, v=0.8)
  movel(p[1.7, 0, 1.4, 0, d2r(90), 0], a=a, v=0.25, r=0.01)
  movel(p[1.7, 0.1, 1.4, 0, d2r(90), 0], a=a, v=0.25)
  i = 0
  while i < 2:
    movel(p[1.7, 0.1 * i, 1.4, 0, d2r(90), 0], a=a, v=0.25)
    i = i + 1
  end
  sleep(0.1)
end
part()
""",
}
GCODE = """%
G21 G90 G17
G0 X0 Y0 Z20
G1 Z0 F3000
G64 P0.5
G1 X50 Y0
G2 X50 Y50 I0 J25
G1 X0 (back) Y50
G91 G1 X0 Y-50
M30
%
"""
PART = """format = 1
[path]
lengths = "mm"
angles = "deg"
base = { xyz = [1650.0, 0.0, 1300.0], rpy = [0.0, 90.0, 0.0] }
acceleration = 2000.0
[program]
file = "part.nc"
start = [0, -60, 90, 0, 60, 0]
rpy = [0.0, 0.0, 0.0]
"""

PATH_FILE = """format = 1
[path]
lengths = "mm"
angles = "deg"
base = { xyz = [0.0, 0.0, 100.0], rpy = [0.0, 0.0, 0.0] }
speed = 250.0
acceleration = 2000.0
jerk = 40000.0
blend = 8.0
[limits]
joint_1 = { acceleration = 200.0 }
[[move]]
joints = [0, -60, 90, 0, 60, 0]
[[move]]
line = [1700, 0, 1300]
rpy = [0, 90, 0]
[[move]]
arc = [1700, 100, 1300]
via = [1750, 50, 1300]
[[move]]
spline = [[1650, 100, 1350], [1650, 0, 1350]]
[[move]]
dwell = 0.1
"""

MOTION = """format = 1
unit = "deg"
metres = []
joints = ["swing", "elbow"]
start = [0.0, 0.0]
profile = "quintic"
synchronised = true
speed = 0.8
acceleration = [200.0, 200.0]
jerk = 2000.0

[limits]
swing = { velocity = 200.0, acceleration = 400.0, jerk = 9000.0 }

[[move]]
to = [20.0, -30.0]
via = [[5.0, -10.0]]
duration = 0.3
hold = 0.05

[[move]]
to = { elbow = 10.0 }
profile = "trapezoid"
rounding = 0.2
hold = 0.05

[[move]]
to = [0.0, 0.0]
profile = "s-curve"
synchronised = false
"""

LOADS = """format = 1

[[load]]
kind = "step"
start = 0.1
end = 0.2
force = [0.0, 0.0, -20.0]

[[load]]
frame = "bar"
axes = "frame"
kind = "impulse"
start = 0.1
duration = 0.02
force = [0.0, 0.5, 0.0]

[[load]]
kind = "sweep"
from = 1.0
to = 20.0
torque = [0.0, 2.0, 0.0]

[[load]]
kind = "sine"
frequency = 12.0
phase = 1.57
force = [1.0, 0.0, 0.0]

[[load]]
kind = "milling"
teeth = 4
spindle_rpm = 600.0
harmonics = 2
force = [1.2, 0.8, -0.4]

[[load]]
kind = "table"
file = "force.csv"

[[load]]
kind = "expression"
fx = "10*sin(2*PI*3*t)*exp(-t)"
ty = "5"

[[payload]]
at = 0.15
mass = 2.0
com = [0.2, 0.0, 0.0]
inertia = [0.01, 0.01, 0.012, 0.0, 0.0, 0.0]
"""

TABLE = "time,fx,fz\n0.0,0.0,0.0\n0.2,5.0,-2.0\n0.4,0.0,0.0\n"

JOB = """mesh = "bar.inp"
link = "bar"
units = "mm-t-s"
material = "aluminium"
modes = 4
split = "mid"
tie = "rigid"

[[interface]]
name = "A"
select = "SEAT_A"
xyz = [0.0, 0.0, 0.0]

[[interface]]
name = "B"
select = "plane(800,0,0; 1,0,0)"
at = "centroid"
"""


TRACE = """# trace of a controller
Time[ms];swing[deg];elbow (deg);state;A1
0;0,0;10,0;idle;0,0
100;1,5;9,5;moving;1,0
200;4,5;8,0;moving;2,0
300;8,0;6,0;moving;3,0
400;9,5;5,5;moving;4,0
500;9,5;5,5;idle;5,0
"""


RESPONSES = """format = 1
angle = "deg"
length = "mm"
fit = ["link.bar.stiffness_factor", "link.bar.damping", "drive.swing.gearbox.damping"]

[node.3]
link = "ball"
xyz = [100.0, 0.0, 5.0]
axes = "frame"

[node.4]

[[response]]
file = "hammer.uff"
joints = [0.0, 0.0]
load = { mass = 0.2, com = [10.0, 0.0, 0.0] }
from = 1.0
to = 60.0
every = 1
std = 0.05

[[response]]
file = "hammer.csv"
joints = { swing = 0.0, elbow = 10.0 }
watched = "3"
watched_direction = "z"
hit = "4"
hit_direction = [0.0, 0.1, -1.0]
unit = "mm/s2/N"
form = "complex"
std = 1.0

[[shape]]
joints = [0.0, 0.0]
nodes = ["3", "4", "4"]
directions = ["z", "-z", "x"]
amplitudes = [0.3, -1.0, 0.01]
std = 0.05
"""
IDENTIFY_RESPONSES = ["identify", "robot.toml", "job.toml", "-o", "made", "--force", "--json"]
COMPENSATED_PROGRAM = """&ACCESS RVP
DEF part()
$VEL.CP = 0.5
PTP {A1 10, A2 -80, A3 95, A4 5, A5 50, A6 -10}
PTP {X 1650, Y 0, Z 1200, A 0, B 85, C 0, S 2, T 2}
LIN {X 1620, Y 50} C_DIS
CIRC {X 1640, Y 30, Z 1150}, {X 1600, Y 50, Z 1100, A 0, B 85, C 0}
END
"""
HAMMER = "hz,re,im\n5.0,-120.0,-3.5\n12.0,900.0,-210.0\n22.5,-340.0,-55.0\n"
MOTION_SAMPLES = """format = 1
unit = "deg"
metres = []
joints = ["swing", "elbow"]

[samples]
time = [0.0, 0.1, 0.2, 0.3]
position = [[0.0, 0.0], [1.0, -2.0], [2.0, -3.0], [2.0, -3.0]]
velocity = [[0.0, 0.0], [12.0, -20.0], [5.0, -4.0], [0.0, 0.0]]
acceleration = [[0.0, 0.0], [10.0, 0.0], [-90.0, 80.0], [0.0, 0.0]]
"""


def universal(binary):
    """Returns a universal file with two frequency responses and units (datasets 58 and 164)."""
    out = b"    -1\n   164\n         1SI                           2\n 1.0D+00 1.0D+00 1.0D+00\n-2.7D+02\n    -1\n"
    for direction in (3, -3):
        values = [(5.0, -0.12, -0.0035), (12.0, 0.9, -0.21), (22.5, -0.34, -0.055)]
        kind = f"58b     1     2          11  {24 * len(values):10d}     0     0           0           0" if binary else "58"
        head = [f"    -1\n    {kind}", "blow", "NONE", "NONE", "NONE", "NONE",
                f"{4:5d}{0:10d}{0:5d}{0:10d} {'NONE':10}{3:10d}{direction:4d} {'NONE':10}{4:10d}{3:4d}",
                f"{6:10d}{len(values):10d}{0:10d}{0:13.5E}{0:13.5E}{0:13.5E}",
                f"{18:10d}{0:5d}{0:5d}{0:5d} {'Frequency':20} {'Hz':20}",
                f"{12:10d}{0:5d}{0:5d}{0:5d} {'Acceleration':20} {'m/s^2':20}",
                f"{13:10d}{0:5d}{0:5d}{0:5d} {'Force':20} {'N':20}",
                f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20} {'NONE':20}", ""]
        out += "\n".join(head).encode()
        for row in values:
            out += struct.pack("<3d", *row) if binary else ("".join(f"{x:20.11E}" for x in row) + "\n").encode()
        out += b"\n    -1\n"
    return out


def motion_csv():
    rows = [f"{0.01 * k:.2f},{0.3 * (1 - (k / 20 - 1) ** 2):.6f},{-0.2 * k / 40:.6f}" for k in range(41)]
    return "# unit: rad\n# time: s\ntime,swing,elbow\n" + "\n".join(rows) + "\n"


def bar_inp():
    """A bar of 800 x 40 x 20 mm, 8 HEX20 elements along x."""
    corners = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
    middles = [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)]
    middles += [(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]
    number = lambda i, j, k: 1 + i + 100 * j + 1000 * k
    text = "*HEADING\n bar\n*NODE, NSET=NALL\n"
    for i in range(17):
        for j in range(3):
            for k in range(3):
                if i % 2 + j % 2 + k % 2 <= 1:
                    text += f"{number(i, j, k)}, {50.0 * i}, {20.0 * j - 20.0}, {10.0 * k - 10.0}\n"
    text += "*ELEMENT, TYPE=C3D20, ELSET=BODY\n"
    for e in range(8):
        ids = [str(number(i + 2 * e, j, k)) for i, j, k in corners + middles]
        text += f"{e + 1}, {', '.join(ids[:12])},\n{', '.join(ids[12:])}\n"
    ends = [[number(i, j, k) for j in range(3) for k in range(3) if j % 2 + k % 2 <= 1] for i in (0, 16)]
    for name, ids in zip(("SEAT_A", "SEAT_B"), ends):
        text += f"*NSET, NSET={name}\n{', '.join(map(str, ids))}\n"
    return text + "*MATERIAL, NAME=ALU\n*ELASTIC\n70000., 0.33\n*DENSITY\n2.7e-9\n*SOLID SECTION, ELSET=BODY, MATERIAL=ALU\n"


TETRA = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]


def stl_binary():
    out = b"mesh".ljust(80) + struct.pack("<I", len(FACES))
    for face in FACES:
        out += struct.pack("<3f", 0, 0, 1) + b"".join(struct.pack("<3f", *TETRA[i]) for i in face) + b"\0\0"
    return out


def stl_text():
    out = "solid mesh\n"
    for face in FACES:
        corners = "".join("      vertex %g %g %g\n" % TETRA[i] for i in face)
        out += f"  facet normal 0 0 1\n    outer loop\n{corners}    endloop\n  endfacet\n"
    return out + "endsolid mesh\n"


def obj():
    return "o mesh\n" + "".join("v %g %g %g\n" % p for p in TETRA) + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES)


def collada():
    points = " ".join("%g %g %g" % p for p in TETRA)
    indices = " ".join(str(i) for face in FACES for i in face)
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="pa" count="12">{points}</float_array>
      <technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common>
    </source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>{indices}</p></triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="s"><node id="n"><matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
"""


def gltf_parts():
    blob = b"".join(struct.pack("<3f", *p) for p in TETRA) + b"".join(struct.pack("<3H", *f) for f in FACES)
    views = [{"buffer": 0, "byteOffset": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [0.1, 0.1, 0.1]},
        {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
    ]
    root = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "scale": [1, 1, 1]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "bufferViews": views, "accessors": accessors, "buffers": [{"byteLength": len(blob)}],
    }
    return root, blob


def gltf():
    import base64
    root, blob = gltf_parts()
    root["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(blob).decode()
    return json.dumps(root, indent=1)


def glb():
    root, blob = gltf_parts()
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    blob += b"\0" * (-len(blob) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(blob), 0x004E4942) + blob
    return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body


def stiffness12():
    """Free-free stiffness of an Euler-Bernoulli beam of 0.8 m, and its mass as two halves: rows of
    12 numbers."""
    e, g, l, w, h = 70e9, 26e9, 0.8, 0.02, 0.04
    iy, iz, k = w * h**3 / 12, h * w**3 / 12, [[0.0] * 6 for _ in range(6)]
    k[0][0], k[3][3] = e * w * h / l, g * 0.229 * h * w**3 / l
    k[1][1], k[2][2], k[4][4], k[5][5] = 12 * e * iz / l**3, 12 * e * iy / l**3, 4 * e * iy / l, 4 * e * iz / l
    k[1][5] = k[5][1] = -6 * e * iz / l**2
    k[2][4] = k[4][2] = 6 * e * iy / l**2
    ad = [[float(i == j) for j in range(6)] for i in range(6)]
    ad[1][5], ad[2][4] = l, -l
    product = lambda a, b: [[sum(a[i][n] * b[n][j] for n in range(6)) for j in range(6)] for i in range(6)]
    turned = [[ad[j][i] for j in range(6)] for i in range(6)]
    k_ad = product(k, ad)
    aa, ab = product(turned, k_ad), product(turned, k)
    rows = [aa[i] + [-x for x in ab[i]] for i in range(6)] + [[-x for x in k_ad[i]] + k[i] for i in range(6)]
    mass = [0.864] * 3 + [1.4e-4, 1.2e-2, 1.2e-2]
    return rows, [[mass[i % 6] if i == j else 0.0 for j in range(12)] for i in range(12)]


def op4_binary(matrices):
    record = lambda body: struct.pack("<i", len(body)) + body + struct.pack("<i", len(body))
    out = b""
    for name, rows in matrices:
        n = len(rows)
        out += record(struct.pack("<4i", n, n, 6, 2) + name.encode().ljust(8))
        for j in range(n):
            out += record(struct.pack("<3i", j + 1, 1, 2 * n) + struct.pack(f"<{n}d", *(rows[i][j] for i in range(n))))
        out += record(struct.pack("<3i", n + 1, 1, 2) + struct.pack("<d", 1.0))
    return out


def harwell_boeing(rows):
    n, entries, starts = len(rows), [], [1]
    for j in range(n):
        entries += [(i + 1, rows[i][j]) for i in range(j, n) if rows[i][j] != 0.0]
        starts.append(len(entries) + 1)
    lines = lambda items, per, form: ["".join(form % x for x in items[i:i + per]) for i in range(0, len(items), per)]
    pointers, indices = lines(starts, 8, "%10d"), lines([i for i, _ in entries], 8, "%10d")
    values = lines([x for _, x in entries], 3, "%25.16e")
    head = [f"{'stiffness':72}{'KEY':8}"]
    head += ["%14d%14d%14d%14d%14d" % (len(pointers) + len(indices) + len(values), len(pointers), len(indices), len(values), 0)]
    head += ["%-14s%14d%14d%14d%14d" % ("RSA", n, n, len(entries), 0)]
    head += ["%-16s%-16s%-20s%-20s" % ("(8I10)", "(8I10)", "(3E25.16)", "")]
    mapping = "Matrix Eqn   Node   DOF\n"
    dofs = ["UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ"]
    mapping += "".join(f" {i + 1} {1001 + i // 6} {dofs[i % 6]}\n" for i in range(n))
    return "\n".join(head + pointers + indices + values) + "\n", mapping


def labelled(rows):
    n = len(rows)
    text = ""
    for i in range(n):
        for j in range(i + 1):
            if rows[i][j] != 0.0:
                text += f"{1001 + i // 6},{i % 6 + 1},{1001 + j // 6},{j % 6 + 1},{rows[i][j]:.15e}\n"
    return text


def coordinate(rows):
    n = len(rows)
    return "".join(f"{i + 1} {j + 1} {rows[i][j]:.15e}\n" for i in range(n) for j in range(i + 1) if rows[i][j] != 0.0)


# -------------------------------------------------------------------------------------------------------------------
# targets

NEW_ARM = """<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <inertial><origin xyz="0.3 0 0"/><mass value="9.0"/><inertia ixx="0.03" iyy="0.3" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><mesh filename="link.stl"/></geometry></visual>
  </link>
  <link name="fore">
    <inertial><origin xyz="0.2 0 0"/><mass value="4.0"/><inertia ixx="0.01" iyy="0.08" izz="0.08" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.25 0 0" rpy="0 1.5708 0"/><geometry><cylinder radius="0.05" length="0.5"/></geometry></collision>
  </link>
  <link name="tool0"/>
  <link name="finger"/>
  <joint name="a1" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/>
    <limit lower="-2.5" upper="1.5" effort="300" velocity="2"/></joint>
  <joint name="a2" type="continuous"><parent link="upper"/><child link="fore"/><origin xyz="0.6 0 0"/><axis xyz="0 1 0"/></joint>
  <joint name="flange" type="fixed"><parent link="fore"/><child link="tool0"/><origin xyz="0.5 0 0"/></joint>
  <joint name="grip" type="prismatic"><parent link="tool0"/><child link="finger"/><axis xyz="0 1 0"/>
    <limit lower="0.01" upper="0.04" effort="20" velocity="0.1"/></joint>
</robot>
"""


def box_stl(length, width, height):
    """Returns a box starting at x = 0, as binary STL."""
    corner = lambda k: (length * (k & 1), width * ((k >> 1 & 1) - 0.5), height * ((k >> 2 & 1) - 0.5))
    faces = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    pack = lambda t: struct.pack("<12fH", 0.0, 0.0, 0.0, *(x for k in t for x in corner(k)), 0)
    return b"box".ljust(80) + struct.pack("<I", len(triangles)) + b"".join(map(pack, triangles))


CUTTING_TOOL = """format = 1
lengths = "mm"
angles = "deg"
pressures = "N/mm2"
deepest = 5.0
[cutter]
teeth = 2
diameter = 10.0
helix = 30.0
lead = 90.0
coefficients = { tangential = 800.0, radial = 250.0, axial = 100.0 }
[engagement]
kind = "down"
ae = 3.0
[spindle]
rpm = [3000.0, 6000.0]
[tool]
axis = [0.0, 0.0, 1.0]
feed = [1.0, 0.0, 0.0]
tip = [0.0, 0.0, 50.0]
[[mode]]
direction = "radial"
frequency = 700.0
damping = 0.03
stiffness = 1e7
"""


class Target:
    """A valid file to change, the files it needs, and the commands that read it."""

    def __init__(self, name, change, files, commands, steps=False):
        self.name, self.change, self.files, self.commands, self.steps = name, change, files, commands, steps


def with_visual(shape):
    return URDF.replace("<VISUAL/>", shape)


BOX = with_visual('<box size="0.8 0.02 0.04"/>')
TELESCOPE = (ROOT / "crates/run/flexarm-run/tests/data/lift.urdf").read_text()

TELESCOPE_ROBOT = """format = 1
urdf = "beam.urdf"
tcp = { link = "tcp" }
[[calibration]]
joint = "turn"
xyz = [0.001, 0.0, -0.002]
rpy = [0.0, 0.003, 0.0]
zero = 0.01
[[drive]]
joint = "lower"
kind = "gearbox"
gearbox = { guide = { outer_end = 1.4, x = { compliance = [1e-6, 4e-7, 3e-7] }, y = { compliance = [0, 0, 3e-7], play = { gap = 4e-4, centre = 3, width = 20 } } }, damping = [10.0, 10.0] }
[[drive]]
joint = "lift"
kind = "gearbox"
gearbox = { guide = { outer_end = 2.5, inner_end = 0.0, y = { compliance = [1e-6, 4e-7, 3e-7] } } }
[[drive]]
joint = "foot"
kind = "gearbox"
gearbox = { stiffness = [2e5, 2e5, 1e6] }
"""

TELESCOPE_MOTION = """format = 1
unit = "rad"
joints = ["lift", "turn", "wrist"]
start = [0.3, 0.0, 0.0]
[[move]]
to = [0.5, 0.2, 0.1]
duration = 0.4
"""

TELESCOPE_MEASUREMENTS = """format = 1
fit = ["drive.*stiffness*", "drive.*guide*", "joint.turn.*"]
keep = ["*.centre"]
tie = ["drive.*.guide.y.compliance[2]"]
[instrument.station]
[target.prism]
xyz = [0, 0, 0]
unknown = true
[[place]]
file = "places.csv"
std = 0.001
"""

TELESCOPE_PLACES = "lift,turn,wrist,x,y,z\n" + "".join(
    f"{0.2 + 0.15 * k},{0.5 * k - 2.5},{0.3 * k - 1.5},{1.2 * math.cos(0.5 * k - 2.5):.4f},{1.2 * math.sin(0.5 * k - 2.5):.4f},{0.6 + 0.2 * k:.4f}\n" for k in range(10)
)

COMPARE = ["compare", "robot.toml", "motion.toml", "--no-files", "--step", "1e-3", "--json"]


def own_targets():
    """Targets with files that are written here or are in the repository."""
    base = {"beam.urdf": BOX, "robot.toml": ROBOT, "motion.toml": MOTION, "motion.csv": motion_csv()}
    check = ["check", "robot.toml", "motion.toml", "--json"]
    stiffness, mass = stiffness12()
    rigid = ["--mass", "1.728", "--com", "0.4,0,0", "--inertia", "0.0003,0.0924,0.0922,0,0,0"]
    importing = lambda *words: ["import", *words, "--units", "m-kg-s", "--at", "A=0,0,0", "--at", "B=0.8,0,0", "--no-files", "--json"]
    by_node, by_row = ["--map", "A=1001,B=1002"], ["--map", "A=#1-6,B=#7-12"]
    hb, mapping = harwell_boeing(stiffness)
    deck = bar_inp()
    reduce = ["--units", "mm-t-s", "--no-files", "--json", "--modes", "4"]
    seats = ["--interface", "SEAT_A", "--interface", "SEAT_B", "--at", "A=0,0,0", "--at", "B=800,0,0", "--material", "aluminium"]
    hammer = {**base, "job.toml": RESPONSES, "hammer.csv": HAMMER, "hammer.uff": universal(False)}
    targets = [
        Target("robot", "robot.toml", base, [check, COMPARE, ["statics", "robot.toml", "--json"], ["modes", "robot.toml", "--json"]], True),
        Target("robot-loops", "robot.toml", {"beam.urdf": FOUR_BAR, "robot.toml": LOOPS, "motion.toml": FOUR_BAR_MOTION}, [check, COMPARE, ["statics", "robot.toml", "--json"], ["inspect", "robot.toml", "--json"]], True),
        Target("robot-balancers", "robot.toml", {**base, "robot.toml": ROBOT + BALANCERS}, [check, COMPARE, ["statics", "robot.toml", "--json"], ["inspect", "robot.toml", "--json"]], True),
        Target("robot-mounting", "robot.toml", {**base, "robot.toml": ROBOT + MOUNTING}, [check, COMPARE, ["statics", "robot.toml", "--json"], ["inspect", "robot.toml", "--json"]], True),
        Target("robot-gears", "robot.toml", {**base, "robot.toml": ROBOT.replace("backlash = 1e-4", GEAR_KEYS).replace("viscous = 0.5,", "viscous = 0.5, load = 0.05,")}, [check, COMPARE, ["statics", "robot.toml", "--json"], ["modes", "robot.toml", "--json"]], True),
        Target("robot-telescope", "robot.toml", {"beam.urdf": TELESCOPE, "robot.toml": TELESCOPE_ROBOT, "motion.toml": TELESCOPE_MOTION}, [check, COMPARE, ["statics", "robot.toml", "--json"], ["modes", "robot.toml", "--json"]], True),
        Target("measurements-telescope", "job.toml", {"beam.urdf": TELESCOPE, "robot.toml": TELESCOPE_ROBOT, "job.toml": TELESCOPE_MEASUREMENTS, "places.csv": TELESCOPE_PLACES}, [["identify", "robot.toml", "job.toml", "-o", "made", "--force", "--json"]]),
        Target("robot-column", "robot.toml", {**base, "robot.toml": ROBOT + COLUMN}, [check, ["statics", "robot.toml", "--json"], ["modes", "robot.toml", "--json"]], True),
        Target("urdf", "beam.urdf", base, [["check", "beam.urdf", "--json"], ["inspect", "beam.urdf", "--json"], check, COMPARE], True),
        Target("xacro", "arm.xacro", {"arm.xacro": XACRO}, [["check", "arm.xacro", "--json"], ["inspect", "arm.xacro", "--json"]]),
        Target("new-urdf", "arm.urdf", {"arm.urdf": NEW_ARM, "link.stl": box_stl(0.6, 0.12, 0.1)}, [["new", "arm.urdf", "-o", "made", "--force", "--no-run", "--json"], ["new", "arm.urdf", "-o", "made", "--force", "--no-run", "--payload", "5", "--json"]]),
        Target("new-mesh", "link.stl", {"arm.urdf": NEW_ARM, "link.stl": box_stl(0.6, 0.12, 0.1)}, [["new", "arm.urdf", "-o", "made", "--force", "--no-run", "--json"]]),
        Target("new-xacro", "arm.xacro", {"arm.xacro": XACRO}, [["new", "arm.xacro", "-o", "made", "--force", "--no-run", "--mass", "20", "--json"]]),
        Target("measurements", "job.toml", {**base, "job.toml": MEASUREMENTS, "pulls.csv": PULLS}, [["identify", "robot.toml", "job.toml", "--no-files", "--json"]]),
        Target("measurement-table", "pulls.csv", {**base, "job.toml": MEASUREMENTS, "pulls.csv": PULLS}, [["identify", "robot.toml", "job.toml", "-o", "made", "--force", "--json"]]),
        Target("responses", "job.toml", hammer, [IDENTIFY_RESPONSES]),
        Target("response-universal", "hammer.uff", hammer, [IDENTIFY_RESPONSES]),
        Target("response-universal-binary", "hammer.uff", {**hammer, "hammer.uff": universal(True)}, [IDENTIFY_RESPONSES]),
        Target("response-table", "hammer.csv", hammer, [IDENTIFY_RESPONSES]),
        Target("motion-samples", "motion.toml", {**base, "motion.toml": MOTION_SAMPLES}, [check, COMPARE], True),
        Target("compensate-program", "part.src", {"part.src": COMPENSATED_PROGRAM}, [["compensate", str(ROOT / "robots/kr210"), "part.src", "--method", "static", "--limits", "tell", "-o", "made", "--force", "--no-recording", "--no-sweep", "--json"]]),
        Target("compensate-loads", "loads.toml", {**base, "loads.toml": LOADS, "force.csv": TABLE}, [["compensate", "robot.toml", "motion.toml", "--loads", "loads.toml", "--no-files", "--no-sweep", "--iterations", "1", "--components", "z", "--limits", "tell", "--json"]], True),
        Target("plan-poses", "poses.csv", {**base, "poses.csv": "swing,elbow,finger\n0.1,0.2,0.01\n-0.3,0.5,0.0\n0.4,-0.2,0.02\n"}, [["identify", "robot.toml", "--plan", "2", "--poses", "poses.csv", "--no-files", "--json"]]),
        Target("sweep", "study.toml", {**base, "study.toml": SWEEP, "table.csv": "payload.mass,motion.speed\n1.0,1.0\n1.5,0.9\n"}, [["sweep", "study.toml", "-o", "made", "--force", "--threads", "1", "--json"]], True),
        Target("sweep-table", "table.csv", {**base, "study.toml": SWEEP_TABLE, "table.csv": "payload.mass,motion.speed\n1.0,1.0\n1.5,0.9\n"}, [["sweep", "study.toml", "-o", "made", "--force", "--threads", "1", "--json"]], True),
        Target("compensate", "motion.toml", base, [["compensate", "robot.toml", "motion.toml", "--no-files", "--no-sweep", "--iterations", "1", "--components", "z", "--json"]], True),
        Target("map", "robot.toml", base, [["map", "robot.toml", "--over", "swing=-0.5:0.5:5", "--wrench", "1,2,3", "--no-files", "--json"]]),
        Target("cutting-tool", "tool.toml", {**base, "tool.toml": CUTTING_TOOL}, [["lobes", "robot.toml", "--tool", "tool.toml", "--no-files", "--json"], ["lobes", "robot.toml", "--tool", "tool.toml", "--deepest", "1e-6", "--no-files", "--json"]], True),
        Target("motion-toml", "motion.toml", base, [check, COMPARE], True),
        Target("motion-csv", "motion.csv", base, [["check", "robot.toml", "motion.csv", "--json"], [w if w != "motion.toml" else "motion.csv" for w in COMPARE]], True),
        Target("motion-table", "trace.txt", {**base, "trace.txt": TRACE}, [["motion", "trace.txt", "robot.toml", "--json"], ["motion", "trace.txt", "--columns", "t=#1[ms],swing=A1[deg]", "--json"]]),
        Target("loads", "loads.toml", {**base, "loads.toml": LOADS, "force.csv": TABLE}, [COMPARE + ["--loads", "loads.toml"]], True),
        Target("loads-table", "force.csv", {**base, "loads.toml": LOADS, "force.csv": TABLE}, [COMPARE + ["--loads", "loads.toml"]], True),
        Target("matrix-op4-binary", "k.op4", {"k.op4": op4_binary([("K", stiffness), ("M", mass)])}, [importing("k.op4", *by_row)]),
        Target("matrix-harwell-boeing", "k.matrix", {"k.matrix": hb, "k.mapping": mapping}, [importing("k.matrix", *by_node, *rigid)]),
        Target("matrix-mapping", "k.mapping", {"k.matrix": hb, "k.mapping": mapping}, [importing("k.matrix", *by_node, *rigid)]),
        Target("matrix-labelled", "job_STIF1.mtx", {"job_STIF1.mtx": labelled(stiffness)}, [importing("job_STIF1.mtx", *by_node, *rigid)]),
        Target("matrix-gz", "job_STIF1.mtx.gz", {"job_STIF1.mtx.gz": gzip.compress(labelled(stiffness).encode(), mtime=0)}, [importing("job_STIF1.mtx.gz", *by_node, *rigid)]),
        Target("matrix-coordinate", "job.sti", {"job.sti": coordinate(stiffness), "job.mas": coordinate(mass)}, [importing("job.sti", *by_row)]),
        Target("reduce-job", "job.toml", {"job.toml": JOB, "bar.inp": deck}, [["reduce", "job.toml", "--no-files", "--json"], ["reduce", "job.toml", "--list", "--json"]]),
        Target("mesh-inp", "bar.inp", {"bar.inp": deck}, [["reduce", "bar.inp", *seats, *reduce], ["reduce", "bar.inp", "--list", "--json"]]),
        Target("mesh-gz", "bar.inp.gz", {"bar.inp.gz": gzip.compress(deck.encode(), mtime=0)}, [["reduce", "bar.inp.gz", *seats, *reduce]]),
    ]
    data = ROOT / "crates/links/flexarm-fe-io/tests/data"
    for kind in ("v22_ascii", "v22_binary", "v41_ascii", "v41_binary"):
        name = f"three_blocks_{kind}.msh"
        targets.append(Target(f"mesh-msh-{kind}", name, {name: (data / name).read_bytes()}, [["reduce", name, "--list", "--json"]]))
    beam = (ROOT / "robots/test/one_beam/fe/one_beam.msh").read_bytes()
    seats = ["--interface", "interface_A", "--interface", "interface_B", "--at", "A=centroid", "--at", "B=centroid"]
    line = ["reduce", "one_beam.msh", "--units", "m-kg-s", "--material", "steel", *seats, "--modes", "2", "--no-files", "--json"]
    targets.append(Target("mesh-msh-one_beam", "one_beam.msh", {"one_beam.msh": beam}, [line]))
    for name, content in (("mesh.stl", stl_binary()), ("text.stl", stl_text()), ("mesh.obj", obj()), ("mesh.dae", collada()), ("mesh.gltf", gltf()), ("mesh.glb", glb())):
        files = {"beam.urdf": with_visual(f'<mesh filename="{name}"/>'), name: content}
        targets.append(Target(f"visual-{name}", name, files, [["check", "beam.urdf", "--json"], ["inspect", "beam.urdf", "--json", "--inertia-from-density", "1000"]]))
    motions = ROOT / "crates/motion/flexarm-motion-io/tests/data"
    for name in ("plan.yaml", "display.yaml", "echo.yaml", "plan.json", "states_plain.mcap", "states_lz4.mcap", "states_zstd.mcap", "states_ros1.mcap", "nested_plan.mcap", "old.db3",
                 "bag_messages_packed/bag_messages_packed.db3", "bag_file_packed/bag_file_packed.db3.zstd"):
        own = Path(name).name
        targets.append(Target(f"motion-{own}", own, {own: (motions / name).read_bytes()}, [["motion", own, "--json"], ["motion", own, "--json", "-o", "other.csv", "--force"]]))
    arm = str(ROOT / "robots/kr210_identified")
    targets.append(Target("path-toml", "path.toml", {"path.toml": PATH_FILE}, [["motion", "path.toml", arm, "--json"]], True))
    for name, content in PROGRAMS.items():
        targets.append(Target(f"program-{name}", name, {name: content}, [["motion", name, arm, "--json"]]))
    beside = {"part.nc": GCODE, "part.toml": PART}
    targets.append(Target("program-part.nc", "part.nc", beside, [["motion", "part.toml", arm, "--json"]]))
    return targets


def made_targets(run, folder):
    """Targets with files written by the program: link files, exported matrices, recordings."""
    for name, content in {"beam.urdf": BOX, "robot.toml": ROBOT, "motion.toml": MOTION, "bar.inp": bar_inp(), "job.toml": JOB}.items():
        write(folder / name, content)
    run(["reduce", "job.toml", "--flex", "bar.flex", "--stress", "--quiet"])
    flex, stress = [(folder / name).read_bytes() for name in ("bar.flex", "bar.stress")]
    export = lambda word: ["export", "bar.flex", "--format", word, "--units", "mm-t-s", "-o", "matrices"]
    targets = []
    for model in ("lumped", "modal"):
        files = {"beam.urdf": BOX, "motion.toml": MOTION, "bar.flex": flex, "robot.toml": ROBOT_FLEX.replace("MODEL", model)}
        commands = [["statics", "robot.toml", "--json"], COMPARE, ["export", "bar.flex", "--format", "simscape", "--units", "mm-t-s", "-o", "out", "--force", "--json"]]
        targets.append(Target(f"flex-{model}", "bar.flex", files, commands, True))
        targets.append(Target(f"stress-{model}", "bar.stress", {**files, "bar.stress": stress}, [COMPARE], True))
    nodes, at = ["--map", "A=1001,B=1002"], ["--at", "A=0,0,0", "--at", "B=800,0,0"]
    rows = ["--map", "A=#1-6,B=#7-12,modal=#13-16"]
    for word, change, words in (
        ("matrix-market", "bar_K.mtx", []), ("matrix-market", "bar.toml", []), ("user-element", "bar.mtx", [*nodes, *at]),
        ("simscape", "bar_K.csv", [*rows, *at]), ("simscape", "bar_frames.csv", [*rows]),
    ):
        shutil.rmtree(folder / "matrices", ignore_errors=True)
        run(export(word))
        files = {path.name: path.read_bytes() for path in sorted((folder / "matrices").iterdir()) if path.is_file()}
        if change not in files:
            print(f"left out: {change} is not among what export writes as {word}: {sorted(files)}")
            continue
        first = {"bar.toml": "bar_K.mtx", "bar_frames.csv": "bar_K.csv"}.get(change, change)
        given = [first] + [name for name in files if word == "simscape" and name.endswith(".csv") and name != first]
        units = [] if word == "matrix-market" else ["--units", "mm-t-s"]
        command = ["import", *given, *units, *words, "--no-files", "--json"]
        targets.append(Target(f"matrix-{change}", change, files, [command]))
    stored = ROOT / "crates/faces/flexarm-cli/tests/data"
    for name, words in (("bar.pch", nodes), ("bar.op4", ["--map", "A=#1-6,B=#7-12,modal=#13", *at]), ("bar.SID_FEM", ["--map", "A=1,B=2"])):
        command = ["import", name, "--units", "mm-t-s", *words, "--no-files", "--json"]
        targets.append(Target(f"matrix-{name}", name, {name: (stored / name).read_bytes()}, [command]))
    run(["compare", "robot.toml", "motion.toml", "-o", "run", "--log-rate", "50", "--parquet", "--quiet"],
        ["compare", "robot.toml", "motion.toml", "-o", "run", "--log-rate", "50", "--quiet"])
    for name in ("run.csv", "run.mcap", "run.parquet"):
        path = folder / "run" / name
        if not path.exists():
            print(f"left out: recordings {name} (this build writes none)")
            continue
        commands = [["convert", name, "other.csv", "--force", "--json"], ["report", name, "-o", "page.html", "--force", "--json"]]
        targets.append(Target(f"recording-{name}", name, {name: path.read_bytes()}, commands))
    return targets


# -----------------------------------------------------------------------------------------------------------------
# mutations

NUMBERS = ["nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "1e400", "-1", "0", "-0.0", "1e9", "1e-9", "1e30", "2147483647", "2147483648",
           "4294967295", "4294967296", "9223372036854775807", "9223372036854775808", "-9223372036854775808", "18446744073709551615", "0x10", "1,5", "1" * 400, ".", "1e", "true", '""']
NUMBER = re.compile(rb"(?<![A-Za-z_\d.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?(?![A-Za-z_])")
COUNTS = [2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**63, 2**64 - 1, 0, 1 << 40]
FLOATS = [float("nan"), float("inf"), 1e308, -1e308, 0.0, -1.0, 5e-324]


def mutate(data, rng):
    """Returns the bytes changed in one to three ways, and the names of the ways."""
    ways = []
    binary = b"\0" in data[:4000]
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        # Well-formed files get farthest.
        kinds, weights = [VALUES, LINES_OF_TEXT, BYTES, TRAPS], [1, 1, 16, 1] if binary else [14, 3, 2, 1]
        way = rng.choice(rng.choices(kinds, weights)[0])
        data = way(data, rng)
        ways.append(way.__name__)
        if len(data) > 4 << 20:
            break
    return data, ways


def place(data, rng):
    return rng.randrange(len(data) + 1)


def flip_bytes(data, rng):
    data = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 8])):
        if data:
            data[rng.randrange(len(data))] ^= rng.choice([0xFF, 1 << rng.randrange(8), rng.randrange(1, 256)])
    return bytes(data)


def truncate(data, rng):
    return data[:place(data, rng)]


def remove_span(data, rng):
    at = place(data, rng)
    return data[:at] + data[at + rng.choice([1, 4, 16, 200]):]


def insert_bytes(data, rng):
    at = place(data, rng)
    return data[:at] + bytes(rng.randrange(256) for _ in range(rng.choice([1, 2, 8, 40]))) + data[at:]


def repeat_span(data, rng):
    at, length, times = place(data, rng), rng.choice([1, 3, 10, 100]), rng.choice([1, 5, 1000])
    return data[:at + length] + data[at:at + length] * times + data[at + length:]


def split(data):
    return data.split(b"\n")


def double_line(data, rng):
    lines = split(data)
    at = rng.randrange(len(lines))
    return b"\n".join(lines[:at] + [lines[at]] * rng.choice([2, 2, 3, 500]) + lines[at + 1:])


def drop_line(data, rng):
    lines = split(data)
    at = rng.randrange(len(lines))
    return b"\n".join(lines[:at] + lines[at + rng.choice([1, 1, 3]):])


def swap_lines(data, rng):
    lines = split(data)
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return b"\n".join(lines)


def change_number(data, rng):
    found = list(NUMBER.finditer(data))
    if not found:
        return flip_bytes(data, rng)
    for match in sorted(rng.sample(found, min(len(found), rng.choice([1, 1, 1, 3]))), key=lambda m: -m.start()):
        data = data[:match.start()] + rng.choice(NUMBERS).encode() + data[match.end():]
    return data


def scale_number(data, rng):
    found = list(NUMBER.finditer(data))
    if not found:
        return flip_bytes(data, rng)
    match = rng.choice(found)
    try:
        value = float(match.group().replace(b"d", b"e").replace(b"D", b"e"))
    except ValueError:
        return data
    other = rng.choice([-value, 10 * value, 1000 * value, value / 1000, 57.3 * value, value + 1, 1e6 * value])
    text = str(int(other)) if rng.random() < 0.5 and abs(other) < 1e15 else repr(other)
    return data[:match.start()] + text.encode() + data[match.end():]


def swap_words(data, rng):
    found = list(re.finditer(rb"[A-Za-z_][A-Za-z_0-9.]*", data))
    if len(found) < 2:
        return flip_bytes(data, rng)
    a, b = sorted(rng.sample(found, 2), key=lambda m: m.start())
    return data[:a.start()] + b.group() + data[a.end():b.start()] + a.group() + data[b.end():]


def nest(data, rng):
    at, depth = place(data, rng), rng.choice([200, 10_000, 100_000])
    opening, closing = rng.choice([(b"[", b"]"), (b"(", b")"), (b"{a=", b"}"), (b"{\"a\":", b"}"), (b"<a>", b"</a>"), (b"-", b""), (b"a.", b""), (b"sin(", b")")])
    return data[:at] + opening * depth + closing * rng.choice([0, depth]) + data[at:]


def long_word(data, rng):
    at, word = place(data, rng), rng.choice([b"a", b"9", b" ", b"\n", b"1,", b"1+", "é".encode(), b"\0", b"#"])
    return data[:at] + word * rng.choice([3000, 100_000, 1_000_000]) + data[at:]


def change_count(data, rng):
    size, value = rng.choice([4, 4, 8]), rng.choice(COUNTS)
    if len(data) < size:
        return data
    at = rng.randrange(len(data) - size + 1)
    at -= at % rng.choice([1, 4])
    raw = (value % (1 << 8 * size)).to_bytes(size, rng.choice(["little", "little", "big"]))
    return data[:at] + raw + data[at + size:]


def change_float(data, rng):
    if len(data) < 8:
        return data
    at = rng.randrange(len(data) - 7)
    value = rng.choice(FLOATS)
    raw = struct.pack("<d", value) if rng.random() < 0.6 else struct.pack("<f", value if abs(value) < 1e38 else float("inf"))
    return data[:at] + raw + data[at + len(raw):]


def pack(data, rng):
    return gzip.compress(data, 1, mtime=0)


@functools.cache
def packed_run(byte):
    """Returns 300 MB of one byte, packed to 300 kB without ever being in memory."""
    packer = zlib.compressobj(1, wbits=31)
    return b"".join(packer.compress(byte * (1 << 20)) for _ in range(300)) + packer.flush()


def bomb(data, rng):
    """Returns a packed file with a valid start that continues for 300 MB."""
    return gzip.compress(data, 1, mtime=0) + packed_run(rng.choice([b"\0", b"\n"]))


def empty(data, rng):
    return rng.choice([b"", b"\n", b"\0" * 100, b"\xef\xbb\xbf", b"\xff\xfe"])


VALUES = [scale_number, scale_number, change_number, swap_words]
LINES_OF_TEXT = [double_line, drop_line, swap_lines]
BYTES = [flip_bytes, truncate, remove_span, insert_bytes, repeat_span, change_count, change_count, change_float]
TRAPS = [nest, long_word, pack, bomb, empty]

WORDS = ["", " ", ",,", "nan", "inf", "-inf", "1e308", "-1", "0", "1e-12", "1e9", "1e300", "2147483648", "18446744073709551616", "=", "a=b", "a=", "=b", "--", "-", "é", "名前", "a\nb", "\x1b[31m",
         "x" * 5000, "../..", "/dev/null", "/dev/zero", "/", ".", "folder", "pipe", "secret", "robot.toml", "beam.urdf", "motion.toml", "run.csv", b"\xff\xfe", "1,2,3", "1,2,3,4,5,6,7", "30deg", "swing=1", "swing=nan",
         "force-x", "joint:", "plane(0,0,0;0,0,0)", "rigid", "modal", "spook", "--stepper", "65535", "400", "1000000"]
LINES = [
    COMPARE, ["check", "robot.toml", "motion.toml", "--json"], ["inspect", "robot.toml", "--at", "0.1,0.2", "--velocity", "1,2", "--json"],
    ["statics", "robot.toml", "--at", "0,0", "--wrench", "0,0,-10", "--json"], ["modes", "robot.toml", "--count", "3", "--json"],
    ["modes", "robot.toml", "--count", "2", "-o", "movie", "--force", "--seconds", "0.5", "--tool-motion", "0.1", "--json"],
    ["map", "robot.toml", "--over", "swing=-0.5:0.5:7", "--at", "0.1,0.2", "--wrench", "0,0,-10", "--no-files", "--json"],
    ["map", "robot.toml", "--along", "motion.toml", "--points", "20", "--keep", "all", "-o", "map", "--force", "--json"],
    ["response", "robot.toml", "--input", "force-x,swing", "--output", "x,rz", "--points", "20", "--from", "1", "--to", "100", "--no-files", "--json"],
    COMPARE + ["--stepper", "rk4", "--links", "rigid", "--drives", "rigid"], COMPARE + ["--stepper", "reference", "--rtol", "1e-6", "--drives", "rigid"],
    COMPARE + ["--links", "modal", "--modes", "3", "--log-rate", "100", "--settling-band", "1e-4", "--magnify", "10"], COMPARE + ["--segments", "4", "--rho-inf", "0.5"],
    COMPARE + ["--with", "links=modal,name=b", "--with", "drives=rigid"], ["run", "robot.toml", "motion.toml", "-o", "out", "--force", "--log-rate", "20", "--json"],
    ["reduce", "bar.inp", "--units", "mm-t-s", "--material", "steel", "--interface", "SEAT_A", "--interface", "SEAT_B", "--at", "A=0,0,0", "--at", "B=800,0,0", "--modes", "4", "--no-files", "--json"],
    ["report", "run.csv", "-o", "page.html", "--force", "--json"], ["convert", "run.csv", "b.csv", "--force", "--json"], ["completions", "bash"], ["man"], ["help", "compare"],
]


def mutate_line(rng):
    line = list(rng.choice(LINES))
    for _ in range(rng.choice([1, 1, 2, 3])):
        at = rng.randrange(1, len(line) + 1)
        kind = rng.randrange(5)
        if kind <= 2 and at < len(line):
            line[at] = rng.choice(WORDS)
        elif kind == 3:
            line.insert(at, rng.choice(WORDS))
        elif at < len(line):
            del line[at]
    return line


# ---------------------------------------------------------------------------------------------------------------
# one run

Result = collections.namedtuple("Result", "code signal out err seconds megabytes late stopped")


class Runner:
    def __init__(self, program, seconds, megabytes):
        self.program, self.seconds, self.megabytes = str(program), seconds, megabytes
        self.environment = {"PATH": "/nonexistent", "HOME": "/nonexistent", "LANG": "C.UTF-8", "RUST_BACKTRACE": "0"}

    def run(self, line, folder):
        """Runs a command with limits on memory and time; a late one is asked to stop, then
        killed."""
        # The limit on the address space is generous (threads reserve much and use little); the
        # memory used is measured.
        words = ["/bin/sh", "-c", 'ulimit -v "$0"; ulimit -c 0; ulimit -f 2000000; exec "$@"', str(4096 * self.megabytes), self.program, *line]
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            begin = time.monotonic()
            try:
                child = subprocess.Popen(words, cwd=folder, stdin=subprocess.DEVNULL, stdout=out, stderr=err, env=self.environment)
            except (ValueError, OSError) as error:
                return Result(2, 0, b"", str(error).encode(), 0.0, 0, False, False)
            late = stopped = False
            deadline, pause = begin + self.seconds, 0.002
            while True:
                pid, status, usage = os.wait4(child.pid, os.WNOHANG)
                if pid:
                    break
                if time.monotonic() > deadline:
                    if not late:
                        late, deadline = True, time.monotonic() + self.seconds
                        child.send_signal(signal.SIGTERM)
                    else:
                        child.kill()
                time.sleep(pause)
                pause = min(0.02, 1.3 * pause)
            seconds = time.monotonic() - begin
            code, by = os.waitstatus_to_exitcode(status), 0
            if code < 0:
                code, by = -1, -code
            child.returncode = code
            stopped = late and (by == signal.SIGTERM or code in (0, 1))
            out.seek(0)
            err.seek(0)
            return Result(code, by, out.read(64 << 20), err.read(4 << 20), seconds, usage.ru_maxrss / 1024, late, stopped)


def nulls(value, key=""):
    """Yields the keys of a JSON value that are null, which is how NaN and infinity are written."""
    if value is None:
        yield key
    elif isinstance(value, dict):
        for name, inner in value.items():
            yield from nulls(inner, name)
    elif isinstance(value, list):
        for inner in value:
            yield from nulls(inner, key + "[]")


# Keys that may be null for a reason given in docs or comments of the summary.
MAY_BE_NULL = {"settling_s", "frequency_hz", "at_rest", "compliance_share[]", "effective_mass[]", "static_at_peak_m", "dynamic_at_peak_m", "peak_dynamic_m", "overshoot", "damping", "duration_s", "first_frequency_hz", "misfit"}
# For new: links without a section, quantities that a description does not limit, a skipped run
# (docs/new_robot.md).
NEW_MAY_BE_NULL = {"section", "width", "height", "wall", "wall_of_half_mass", "material", "y_axis", "offset", "taper", "open_cuts", "reason", "mass", "lower", "upper", "velocity", "effort", "effort_fault", "summary", "lower_limit", "upper_limit", "speed_limit", "torque_limit"}


# For sweep: results that no run gave, and results not requested (docs/sweep.md).
SWEEP_MAY_BE_NULL = {"min", "max", "mean", "std", "quantiles", "best", "pareto", "shard", "page", "motion", "loads", "files", "command", "start", "range", "progress", "value"}


def without_shares(answer):
    """Returns the answer of sweep without nulls under the names of parameters and metrics."""
    for metric in answer.get("metrics", []):
        metric.pop("shares", None)
    (answer.get("best") or {}).pop("metrics", None)
    return answer


def judge(line, result, steps, known_nulls):
    """Classifies a run: a word, and whether it failed."""
    text = result.err.decode("utf-8", "replace")
    if "panicked at" in text:
        return "panic", True
    if "stack overflow" in text or "has overflowed its stack" in text:
        return "stack", True
    if "memory allocation of" in text:
        return "allocation", True
    if result.late:
        if steps and result.stopped:
            return "long, stopped when asked", False
        return ("hang" if not result.stopped else "slow"), True
    if result.signal:
        return f"signal {result.signal}", True
    if result.code not in (0, 1, 2):
        return f"exit code {result.code}", True
    if result.megabytes > LIMIT_MB:
        return "memory", True
    if result.code != 0:
        said = text.strip() or result.out.strip()
        if not said or text.strip() in ("error:", "error: "):
            return "silent", True
        return ("refused" if result.code == 2 else "failed"), False
    if "--json" in line:
        # There are no options after --.
        if "--" in line:
            return "done", False
        try:
            answer = json.loads(result.out, parse_constant=lambda word: (_ for _ in ()).throw(ValueError(word)))
        except ValueError:
            # --help and --version override --json.
            if any(word in ("--help", "-h", "--version", "-V") for word in line):
                return "done", False
            return "not JSON", True
        known_nulls = known_nulls | NEW_MAY_BE_NULL if "new" in line[:2] else known_nulls
        if "sweep" in line[:2] and isinstance(answer, dict):
            answer, known_nulls = without_shares(answer), known_nulls | SWEEP_MAY_BE_NULL
        wrong = [key for key in nulls(answer) if key.rstrip("[]") not in known_nulls and key not in known_nulls]
        if wrong:
            return f"no number in {wrong[0]}", True
    return "done", False


LIMIT_MB = 600


def write(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())


def shown(line):
    return " ".join(repr(w)[:80] if isinstance(w, bytes) else (w if re.fullmatch(r"[-\w.,=:/]+", w) else repr(w)[:80]) for w in line)


class Fuzzer:
    def __init__(self, args):
        self.args = args
        self.runner = Runner(args.program, args.seconds, LIMIT_MB)
        self.scratch = Path(tempfile.mkdtemp(prefix="flexarm-fuzz-"))
        self.known_nulls = set(MAY_BE_NULL)
        self.counts = collections.Counter()
        self.by_target = collections.Counter()
        self.wrong = []

    def prepare(self):
        """Prepares all targets; runs each command once on the valid files."""
        made = self.scratch / "made"
        made.mkdir()

        def run(*lines):
            for line in lines:
                result = self.runner.run(line, made)
                if result.code == 0:
                    return
            raise SystemExit(f"a sound command fails: {shown(line)}\n{result.err.decode()}")

        targets = own_targets() + made_targets(run, made)
        self.line_files = {"beam.urdf": BOX, "robot.toml": ROBOT, "motion.toml": MOTION, "bar.inp": bar_inp(), "run.csv": (made / "run/run.csv").read_bytes()}
        targets.append(Target("command-line", None, self.line_files, LINES, True))
        if self.args.only:
            names = self.args.only.split(",")
            unknown = [name for name in names if not any(t.name.startswith(name) for t in targets)]
            if unknown:
                raise SystemExit(f"no target {unknown[0]}; there are {', '.join(t.name for t in targets)}")
            targets = [t for t in targets if any(t.name.startswith(name) for name in names)]
        for target in list(targets):
            for line in target.commands:
                folder = self.fresh(target, "sound")
                result = self.runner.run(line, folder)
                if result.code == 2 and (feature := re.search(rb"build flexarm with the feature (\w+)", result.err)):
                    print(f"left out: {target.name} (this build lacks {feature[1].decode()})")
                    targets.remove(target)
                    break
                try:
                    self.known_nulls.update(nulls(json.loads(result.out)))
                except ValueError:
                    pass
                word, wrong = judge(line, result, target.steps, self.known_nulls)
                # A missing program is not a failure (xacro).
                if wrong or result.code != 0 and target.name != "xacro":
                    raise SystemExit(f"{target.name}: the sound file is not taken ({word}): {shown(line)}\n{result.err.decode()}{result.out.decode()[:500]}")
        return targets

    def fresh(self, target, name):
        folder = self.scratch / name
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for file, content in target.files.items():
            write(folder / file, content)
        if target.change is None:
            (folder / "folder").mkdir()
            os.mkfifo(folder / "pipe")
            write(folder / "secret", "x")
            (folder / "secret").chmod(0)
        return folder

    def one(self, index, targets):
        rng = random.Random(f"{self.args.seed}:{index}")
        target = targets[index % len(targets)]
        folder = self.fresh(target, f"case-{index}")
        if target.change is None:
            line, data, ways = mutate_line(rng), b"", ["words"]
        else:
            sound = target.files[target.change]
            # For packed files mostly the content is changed: changes of packed bytes are found by
            # the checksum.
            packed = target.change.endswith(".gz") and rng.random() < 0.7
            sound = gzip.decompress(sound) if packed else sound
            data, ways = mutate(sound if isinstance(sound, bytes) else sound.encode(), rng)
            data = gzip.compress(data, 1, mtime=0) if packed else data
            line = list(rng.choice(target.commands))
            write(folder / target.change, data)
        result = self.runner.run(line, folder)
        word, wrong = judge(line, result, target.steps, self.known_nulls)
        shutil.rmtree(folder, ignore_errors=True)
        return index, target, line, data, ways, result, word, wrong

    def record(self, outcome):
        index, target, line, data, ways, result, word, wrong = outcome
        self.counts[word] += 1
        self.by_target[target.name, word] += 1
        if not wrong:
            return
        said = result.err.decode("utf-8", "replace").strip().splitlines()
        self.wrong.append((index, target.name, word))
        print(f"WRONG {index} {target.name} ({', '.join(ways)}): {word}, {result.seconds:.1f} s, {result.megabytes:.0f} MB: {shown(line)}")
        for text in said[:3]:
            print(f"      {text[:200]}")
        folder = Path(self.args.keep) / f"{index}-{target.name}"
        folder.mkdir(parents=True, exist_ok=True)
        for file, content in target.files.items():
            write(folder / file, content)
        if target.change is not None:
            write(folder / target.change, data)
        write(folder / "COMMAND.txt", shown(line) + "\n\n" + word + "\n\n" + "\n".join(said[:40]) + "\n")

    def go(self):
        begin = time.monotonic()
        try:
            targets = self.prepare()
            ready = time.monotonic()
            indices = range(self.args.first, self.args.first + self.args.runs)
            with concurrent.futures.ThreadPoolExecutor(self.args.jobs) as pool:
                for outcome in pool.map(lambda index: self.one(index, targets), indices):
                    self.record(outcome)
        finally:
            shutil.rmtree(self.scratch, ignore_errors=True)
        print(f"{self.args.runs} runs over {len(targets)} targets, seed {self.args.seed}, {time.monotonic() - begin:.0f} s ({ready - begin:.0f} s of it to make the sound files)")
        for word, count in self.counts.most_common():
            print(f"{count:7} {word}")
        if self.args.table:
            for target in targets:
                print(f"{target.name:28}", ", ".join(f"{n} {word}" for (name, word), n in sorted(self.by_target.items()) if name == target.name))
        if self.wrong:
            print(f"{len(self.wrong)} WRONG, kept in {self.args.keep}")
            return 1
        print("nothing wrong")
        return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--first", type=int, default=0, help="number of the first run")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/flexarm")
    parser.add_argument("--seconds", type=float, default=20.0, help="limit of one run")
    parser.add_argument("--only", help="targets whose names begin so, with commas between them")
    parser.add_argument("--keep", default="fuzz-found", help="folder for inputs that went wrong")
    parser.add_argument("--table", action="store_true", help="outcomes of each target")
    args = parser.parse_args()
    if not args.program.exists():
        raise SystemExit(f"there is no {args.program}: cargo build --release, or --program")
    args.program = args.program.resolve()
    return Fuzzer(args).go()


if __name__ == "__main__":
    sys.exit(main())
