"""Draws the meshes of robots/kr210: closed solids from lofted rings, as binary STL. Needs numpy
only.

    python tools/make_meshes.py [FOLDER]

Own designs in the link frames of kr210.urdf: they show the positions of the joints and the
load-bearing parts and have roughly the outer size of the real arm, no more. Metres. Every solid is
closed, normals outward; the solids of one link overlap at their contacts.
"""
import sys
from pathlib import Path

import numpy as np

X, Y, Z = np.eye(3)
N = 24                                            # points per ring
ANGLE = 2 * np.pi * (np.arange(N) + 0.5) / N


def ring(centre, u, v, a, b, power=2.0):
    """Superellipse with half axes a, b along u, v: power 2 gives an ellipse, 5 to 8 a rounded
    rectangle."""
    c, s = np.cos(ANGLE), np.sin(ANGLE)
    r = (np.abs(c)**power + np.abs(s)**power)**(-1 / power)
    return np.asarray(centre, float) + np.outer(a * r * c, u) + np.outer(b * r * s, v)


def loft(rings):
    """Closed solid through rings of N points, flat ends."""
    triangles = []
    for p, q in zip(rings[:-1], rings[1:]):
        for i in range(N):
            j = (i + 1) % N
            triangles += [(p[i], p[j], q[j]), (p[i], q[j], q[i])]
    for end, flip in ((rings[0], True), (rings[-1], False)):
        for i in range(1, N - 1):
            fan = (end[0], end[i], end[i + 1])
            triangles.append(fan[::-1] if flip else fan)
    solid = np.array(triangles)
    return solid if volume(solid) > 0 else solid[:, ::-1]


def volume(solid):
    return np.einsum("ij,ij->", solid[:, 0], np.cross(solid[:, 1], solid[:, 2])) / 6


def across(axis):
    """Two directions across a coordinate axis."""
    i = int(np.argmax(np.abs(axis)))
    return np.eye(3)[(i + 1) % 3], np.eye(3)[(i + 2) % 3]


def cylinder(centre, axis, radius, start, end, chamfer=0.008):
    """Cylinder along `axis` from centre + start to centre + end, with chamfered edges."""
    u, v = across(axis)
    start, end = min(start, end), max(start, end)
    at = ((start, radius - chamfer), (start + chamfer, radius), (end - chamfer, radius), (end, radius - chamfer))
    return loft([ring(centre + s * axis, u, v, r, r) for s, r in at])


def body(axis, stations, power=5.0):
    """Tapered body: stations (centre, half size along u, half size along v), u and v as in
    `across`."""
    u, v = across(axis)
    return loft([ring(c, u, v, a, b, power) for c, a, b in stations])


def links():
    p = lambda *xyz: np.array(xyz, float)
    o = p(0, 0, 0)
    yield "base_link", [
        body(Z, [(p(0, 0, 0), 0.37, 0.37), (p(0, 0, 0.045), 0.37, 0.37)], 8),
        body(Z, [(p(0, 0, 0.04), 0.33, 0.33), (p(0, 0, 0.20), 0.29, 0.29), (p(0, 0, 0.24), 0.285, 0.285)], 3.5),
        cylinder(o, Z, 0.29, 0.22, 0.30),
        # connector box
        body(X, [(p(-0.60, 0, 0.13), 0.14, 0.09), (p(-0.25, 0, 0.13), 0.16, 0.09)], 8),
    ]
    shoulder = p(0.33, 0.0, -0.3394)
    # z down
    yield "link_1", [
        cylinder(o, Z, 0.285, -0.10, 0.0),
        body(Z, [(p(0.02, 0, -0.08), 0.29, 0.25), (p(0.10, -0.06, -0.20), 0.31, 0.20), (p(0.22, -0.08, -0.36), 0.26, 0.15),
                 (p(0.27, -0.08, -0.46), 0.16, 0.13)], 4),
        # joint 2 housing
        cylinder(shoulder, Y, 0.205, -0.24, 0.005),
        # drive 2
        cylinder(shoulder, Y, 0.115, -0.42, -0.23),
        # drive 1
        cylinder(p(-0.27, 0.06, 0), Z, 0.10, -0.48, -0.06),
    ]
    # x along, z lateral
    yield "link_2", [
        cylinder(o, Z, 0.20, -0.14, 0.064),
        cylinder(o, Z, 0.185, -0.32, -0.12),
        body(X, [(p(-0.06, 0, -0.20), 0.165, 0.115), (p(0.25, 0, -0.215), 0.155, 0.120), (p(0.70, 0, -0.225), 0.138, 0.115),
                 (p(1.15, 0, -0.215), 0.128, 0.10)], 6),
        cylinder(p(1.15, 0, 0), Z, 0.165, -0.315, -0.105),
    ]
    # axis 4 in link_3
    y, z = -0.115, 0.175
    # x along the forearm
    yield "link_3", [
        cylinder(o, Z, 0.17, 0.002, 0.10),
        body(Z, [(p(0, -0.02, 0.06), 0.16, 0.16), (p(0.01, -0.06, 0.175), 0.17, 0.19), (p(0.01, -0.08, 0.30), 0.14, 0.15)], 3.5),
        body(X, [(p(-0.20, y, z), 0.135, 0.145), (p(0.12, y, z), 0.145, 0.145), (p(0.36, y, z), 0.122, 0.125),
                 (p(0.74, y, z), 0.105, 0.105)], 6),
        # joint 4 housing
        cylinder(p(0, y, z), X, 0.118, 0.72, 0.828),
        # drives 4, 5, 6
        cylinder(p(0, y + 0.085, z - 0.075), X, 0.058, -0.40, -0.18),
        cylinder(p(0, y + 0.085, z + 0.075), X, 0.058, -0.40, -0.18),
        cylinder(p(0, y - 0.075, z), X, 0.058, -0.40, -0.18),
        # drive 3
        cylinder(o, Z, 0.115, 0.29, 0.42),
    ]
    # -z along the forearm
    yield "link_4", [
        cylinder(o, Z, 0.100, -0.075, 0.0),
        body(Z, [(p(0, 0, -0.06), 0.098, 0.098), (p(0, 0, -0.13), 0.072, 0.075), (p(0, 0, -0.30), 0.058, 0.056),
                 (p(0, 0, -0.40), 0.062, 0.050)], 3),
        cylinder(p(0, 0, -0.392), Y, 0.084, -0.055, 0.055),
    ]
    # x forward, z lateral
    yield "link_5", [
        cylinder(o, Z, 0.098, -0.040, 0.025),
        cylinder(o, Z, 0.098, -0.205, -0.152),
        body(X, [(p(-0.02, 0, -0.010), 0.085, 0.026), (p(0.14, 0, -0.014), 0.075, 0.026)], 5),
        body(X, [(p(-0.02, 0, -0.179), 0.085, 0.024), (p(0.14, 0, -0.176), 0.075, 0.026)], 5),
        body(X, [(p(0.098, 0, -0.096), 0.078, 0.100), (p(0.15, 0, -0.096), 0.078, 0.085)], 4),
        cylinder(p(0, 0, -0.096), X, 0.078, 0.14, 0.1665),
    ]
    # -z out of the flange
    yield "link_6", [
        cylinder(o, Z, 0.072, -0.034, 0.0, 0.004),
        cylinder(o, Z, 0.050, -0.0485, -0.030, 0.003),
    ]


def check_closed(solid):
    """Checks that each edge belongs to exactly two triangles, once in each direction."""
    points, index = np.unique(solid.reshape(-1, 3).round(9), axis=0, return_inverse=True)
    t = index.reshape(-1, 3)
    edges = np.vstack([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    assert len({tuple(e) for e in edges}) == len(edges) and {tuple(e) for e in edges} == {tuple(e[::-1]) for e in edges}
    assert volume(solid) > 0


def write_stl(path, triangles):
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    record = np.zeros(len(triangles), dtype=[("normal", "<3f4"), ("corner", "<9f4"), ("attribute", "<u2")])
    record["normal"], record["corner"] = normal, triangles.reshape(-1, 9)
    header = b"flexarm tools/make_meshes.py, metres".ljust(80, b" ")
    path.write_bytes(header + np.uint32(len(triangles)).astype("<u4").tobytes() + record.tobytes())


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent.parent / "robots" / "kr210" / "meshes"
    folder.mkdir(parents=True, exist_ok=True)
    total = 0
    for name, solids in links():
        for solid in solids:
            check_closed(solid)
        path = folder / f"{name}.stl"
        write_stl(path, np.vstack(solids))
        total += path.stat().st_size
        print(f"{name}: {len(solids)} solids, {sum(map(len, solids))} triangles")
    print(f"{total} bytes")
