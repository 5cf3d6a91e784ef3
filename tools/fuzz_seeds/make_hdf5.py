#!/usr/bin/env python3
"""Writes exudyn.hdf5: a small braced frame of springs in the layout of Exudyn's
FEMinterface.SaveToFile. Needs h5py, numpy."""

import itertools
from pathlib import Path

import h5py
import numpy as np

nodes = np.array([(x, y, z) for x in (0.0, 0.4, 0.8) for y in (-0.02, 0.02) for z in (-0.01, 0.01)])
n = len(nodes)
K, M = np.zeros((3 * n, 3 * n)), np.eye(3 * n) * 0.144
for a, b in itertools.combinations(range(n), 2):
    axis = nodes[b] - nodes[a]
    length = np.linalg.norm(axis)
    if length > 0.45:
        continue
    block = 1e6 / length * np.outer(axis, axis) / length**2
    for i, j, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
        K[3 * i:3 * i + 3, 3 * j:3 * j + 3] += sign * block

with h5py.File(Path(__file__).with_name("exudyn.hdf5"), "w") as file:
    file["nodes/Position"] = nodes
    for name, A in (("stiffnessMatrix", K), ("massMatrix", M)):
        rows, columns = np.nonzero(A)
        starts = np.searchsorted(rows, np.arange(3 * n + 1))
        group = file.create_group(name)
        group.create_dataset("data", data=A[rows, columns], chunks=(32,), compression="gzip")
        group["indices"], group["indptr"] = columns.astype(np.int32), starts.astype(np.int32)
    for i, x in enumerate((0.0, 0.8)):
        group = file.create_group(f"nodeSets/item_{i}")
        group["NodeNumbers"] = np.nonzero(nodes[:, 0] == x)[0].astype(np.int64)
        group["Name"] = f"seat_{i}"
