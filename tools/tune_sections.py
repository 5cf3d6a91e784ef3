"""Compares the beam sections of robots/kr210 with published joint stiffness. Needs Pinocchio.

    python tools/tune_sections.py            the shipped sections: cut parts, frequencies, compliance, sag
    python tools/tune_sections.py --scan     neighbouring wall thicknesses too

"links": the two flexible links, joints held. "joints": rigid links with the published joint
stiffness of a KR 210 (identified by modal analysis; see robots/kr210/README.md). "both": the two in
series.
"""
import argparse
from pathlib import Path

import numpy as np

from robot_file import Arm

ROBOT = Path(__file__).parent.parent / "robots" / "kr210" / "beams.toml"
JOINT_STIFFNESS = [2.207e6, 3.377e6, 2.776e6, 2.350e6, 2.157e6, 4.671e5]   # N m/rad
POSES = {"upright": [0, -90, 90, 0, 45, 0], "typical": [0, -60, 60, 0, 60, 0], "reaching": [0, -40, 40, 0, 0, 0]}


def cut_parts(arm):
    print("cut parts: mass kg | com m (link axes) | principal inertia kg m2")
    for link, parts in arm.parts.items():
        for name, (mass, com, inertia) in zip(("proximal", "distal"), parts):
            principal = np.linalg.eigvalsh(inertia)
            assert principal[0] > 0 and principal[0] + principal[1] >= principal[2], (link, name, principal)
            print(f"  {link} {name:8} {mass:8.3f} | {com.round(4)} | {principal.round(3)}")


def table(change=None):
    for payload in (False, True):
        arm = Arm(ROBOT, payload=payload, change=change)
        print("with payload" if payload else "no payload")
        for name, deg in POSES.items():
            q = np.radians(deg)
            sag = (arm.pose(q, arm.statics(q)).translation - arm.pose(q).translation) * 1e3
            f = arm.modes(q)[:4], arm.modes(q, JOINT_STIFFNESS, links=False)[:2], arm.modes(q, JOINT_STIFFNESS)[:2]
            print(f"  {name:9} {deg}: f links {f[0].round(2)}, joints {f[1].round(2)}, both {f[2].round(2)} Hz;"
                  f" TCP sag {sag.round(3)} mm, norm {np.linalg.norm(sag):.3f}")
    print("compliance in x, y, z, um/N")
    for name, deg in POSES.items():
        q = np.radians(deg)
        for frame, label in (("tcp_link", "flange"), ("tcp", "TCP")):
            c = [np.diag(arm.compliance(q, k, links, frame))[:3] * 1e6
                 for k, links in ((None, True), (JOINT_STIFFNESS, False), (JOINT_STIFFNESS, True))]
            print(f"  {name:9} {label:6}: links {c[0].round(3)}, joints {c[1].round(3)}, both {c[2].round(3)}")


if __name__ == "__main__":
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("--scan", action="store_true", help="neighbouring wall thicknesses")
    args = ap.parse_args()
    arm = Arm(ROBOT)
    print(f"mass of the arm {sum(b[0] for b in arm.links.values() if b):.2f} kg, payload {arm.file['payload']['mass']} kg")
    cut_parts(arm)
    table()
    if args.scan:
        for walls in ((0.012, 0.008), (0.016, 0.012), (0.020, 0.014)):
            print(f"\nwalls of link_2, link_3: {walls} m")

            def change(file, walls=walls):
                for link, wall in zip(file["flexible_link"], walls):
                    link["beam"]["wall"] = wall
            table(change)
