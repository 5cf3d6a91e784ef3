"""Writes the folder that measured_arm.py reads from the published data set.

    git clone https://github.com/Hilti-Research/construction_robot_stationing_datasets DATA    (commit f26546d)
    python tools/crosscheck/measured_arm_data.py DATA FOLDER        (pip install pyyaml)

The data are those of Hilti's construction robot (CC BY-NC-SA 3.0); copy none of them into this project.
Written are a table of each floor (of `flat` every second pose: the others are held back), the
published URDF, and two files of figures: the
direction of gravity on each floor and the springs of the method test. Both come from a fit of all
kinematic and elastic numbers by an independent model in numpy.
"""
import argparse
import csv
import gzip
import json
import sys
from pathlib import Path

import yaml

COMMIT = "f26546d"
FLOORS = {"flat": ("flat_train", 2), "outdoor": ("outdoor", 1), "pallet": ("pallet", 1)}
# Unit vectors in axes of the base.
GRAVITY = {
    "flat": [-0.003359964, 0.006928198, -0.999970355],
    "outdoor": [0.006341138, 0.008931309, -0.999940009],
    "pallet": [-0.002154747, 0.013437169, -0.999907395],
}
# Compliances (rad/(N m)) of the gears and, about x and then y, of foot, 1/l and 1/l^2 (l: overlap, m); play: gap (m), centre, width (N m).
SPRINGS = {
    "gear": [3.4314e-05, 2.1028e-05, 6.6009e-05, 3.693e-05, 0.000133082, -0.0],
    "play_x": [4.66948e-05, -11.3301, 31.9412],
    "play_y": [0.000409025, 5.8385, 24.1385],
    "without_play": {"col": [5.0038e-06, 5.324e-07, 2.016e-07, 6.1969e-06, 4.036e-07, 3.245e-07]},
}
VECTORS = {
    "joint_states": ["column_prismatic_joint", *(f"dsr_joint{k}" for k in range(1, 7))],
    "prism_position": ["prism_x", "prism_y", "prism_z"],
    "tilt_sensor_base_accel": ["base_ax", "base_ay", "base_az"],
    "tilt_sensor_column_accel": ["tip_ax", "tip_ay", "tip_az"],
    "doosan_cmd": ["doosan_cmd_x", "doosan_cmd_y", "doosan_cmd_z"],
}


def poses(file):
    """The poses of a floor, in the order of the file, as rows of a table."""
    heights = yaml.load(file.read_text(), Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))["column_heights"]
    for height, branches in heights.items():
        for solution, station in branches["solution_spaces"].items():
            for kind in ("stationing", "evaluation"):
                for pose in station[f"{kind}_measurements"]:
                    row = {"id": pose["id"], "time_unix_s": pose["time"], "height_m": height, "solution": solution, "kind": kind, "upside_down": int(pose["upside_down"])}
                    for key, columns in VECTORS.items():
                        row |= zip(columns, pose[key])
                    yield row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="clone of the published repository")
    parser.add_argument("folder", type=Path, help="folder to write; must not exist")
    arguments = parser.parse_args()
    if not (arguments.data / "data/datasets/flat.yaml").is_file():
        sys.exit(f"{arguments.data} has no data/datasets/flat.yaml: clone the repository that --help names")
    arguments.folder.mkdir(parents=True)
    for floor, (name, every) in FLOORS.items():
        rows = list(poses(arguments.data / f"data/datasets/{floor}.yaml"))[::every]
        with gzip.open(arguments.folder / f"{name}.csv.gz", "wt", newline="") as file:
            file.write(f"# Hilti construction_robot_stationing_datasets@{COMMIT}, data/datasets/{floor}.yaml, CC BY-NC-SA 3.0\n")
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)
        print(f"{name}.csv.gz: {len(rows)} poses")
    (arguments.folder / "trailblazer.urdf").write_bytes((arguments.data / "data/trailblazer.urdf").read_bytes())
    (arguments.folder / "poses.json").write_text(json.dumps({floor: {"gravity_in_base": g} for floor, g in GRAVITY.items()}, indent=1))
    (arguments.folder / "compliances.json").write_text(json.dumps(SPRINGS, indent=1))


if __name__ == "__main__":
    main()
