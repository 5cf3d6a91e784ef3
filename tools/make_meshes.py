"""Draws the meshes of robots/kr210: closed solids from lofted rings, as binary STL. Needs no
third-party packages.

    python tools/make_meshes.py [FOLDER]

Own designs in the link frames of kr210.urdf: they show the positions of the joints and the
load-bearing parts and have roughly the outer size of the real arm, no more. Metres. Every solid is
closed, normals outward; the solids of one link overlap at their contacts.
"""
import math
import struct
import sys
from pathlib import Path

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
N = 24  # points per ring
ANGLES = [2 * math.pi * (i + 0.5) / N for i in range(N)]


def ring(centre, u, v, a, b, power=2.0):
    """Superellipse with half axes a, b along u, v: power 2 gives an ellipse, 5 to 8 a rounded
    rectangle."""
    points = []
    for angle in ANGLES:
        c, s = math.cos(angle), math.sin(angle)
        r = (abs(c)**power + abs(s)**power)**(-1 / power)
        points.append([x + a * r * c * y + b * r * s * z for x, y, z in zip(centre, u, v)])
    return points


def loft(rings):
    """Closed solid through rings of N points, flat ends."""
    triangles = []
    for p, q in zip(rings, rings[1:]):
        for i in range(N):
            j = (i + 1) % N
            triangles += [(p[i], p[j], q[j]), (p[i], q[j], q[i])]
    for end, flip in ((rings[0], True), (rings[-1], False)):
        for i in range(1, N - 1):
            fan = (end[0], end[i], end[i + 1])
            triangles.append(fan[::-1] if flip else fan)
    return triangles if volume(triangles) > 0 else [triangle[::-1] for triangle in triangles]


def cross(u, v):
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def volume(solid):
    return sum(dot(a, cross(b, c)) for a, b, c in solid) / 6


def dot(u, v):
    return sum(x * y for x, y in zip(u, v))


def difference(u, v):
    return [x - y for x, y in zip(u, v)]


def unit(u):
    return [x / math.hypot(*u) for x in u]


def across(axis):
    """Two directions across a coordinate axis."""
    i = axis.index(1.0)
    return (X, Y, Z)[(i + 1) % 3], (X, Y, Z)[(i + 2) % 3]


def cylinder(centre, axis, radius, start, end, chamfer=0.008):
    """Cylinder along `axis` from centre + start to centre + end, with chamfered edges."""
    start, end = min(start, end), max(start, end)
    at = ((start, radius - chamfer), (start + chamfer, radius), (end - chamfer, radius), (end, radius - chamfer))
    return loft([ring([x + s * y for x, y in zip(centre, axis)], *across(axis), r, r) for s, r in at])


def body(axis, stations, power=5.0):
    """Tapered body: stations (centre, half size along u, half size along v), u and v as in
    `across`."""
    return loft([ring(centre, *across(axis), a, b, power) for centre, a, b in stations])


def pipe(stations):
    """Round pipe along a line through stations (centre, radius), with rings across the line."""
    rings, u = [], X
    for k, (*centre, radius) in enumerate(stations):
        along = unit(difference(stations[min(k + 1, len(stations) - 1)][:3], stations[max(k - 1, 0)][:3]))
        if k == 0 and abs(along[0]) > 0.7:
            u = Y
        u = unit([x - dot(u, along) * y for x, y in zip(u, along)])
        rings.append(ring(centre, u, cross(along, u), radius, radius))
    return loft(rings)


def links():
    o = (0, 0, 0)
    yield "base_link", [
        body(Z, [((0, 0, 0), 0.37, 0.37), ((0, 0, 0.045), 0.37, 0.37)], 8),
        body(Z, [((0, 0, 0.04), 0.33, 0.33), ((0, 0, 0.20), 0.29, 0.29), ((0, 0, 0.24), 0.285, 0.285)], 3.5),
        cylinder(o, Z, 0.29, 0.22, 0.30),
        # connector box
        body(X, [((-0.60, 0, 0.13), 0.14, 0.09), ((-0.25, 0, 0.13), 0.16, 0.09)], 8),
    ]
    shoulder = (0.33, 0.0, -0.3394)
    # z down
    yield "link_1", [
        cylinder(o, Z, 0.285, -0.10, 0.0),
        body(Z, [((0.02, 0, -0.08), 0.29, 0.25), ((0.10, -0.06, -0.20), 0.31, 0.20), ((0.22, -0.08, -0.36), 0.26, 0.15),
                 ((0.27, -0.08, -0.46), 0.16, 0.13)], 4),
        # joint 2 housing
        cylinder(shoulder, Y, 0.205, -0.24, 0.005),
        # drive 2
        cylinder(shoulder, Y, 0.115, -0.42, -0.23),
        # drive 1
        cylinder((-0.27, 0.06, 0), Z, 0.10, -0.48, -0.06),
    ]
    # x along, z lateral
    yield "link_2", [
        cylinder(o, Z, 0.20, -0.14, 0.064),
        cylinder(o, Z, 0.185, -0.32, -0.12),
        body(X, [((-0.06, 0, -0.20), 0.165, 0.115), ((0.25, 0, -0.215), 0.155, 0.120), ((0.70, 0, -0.225), 0.138, 0.115),
                 ((1.15, 0, -0.215), 0.128, 0.10)], 6),
        cylinder((1.15, 0, 0), Z, 0.165, -0.315, -0.105),
    ]
    # axis 4 in link_3
    y, z = -0.115, 0.175
    # x along the forearm
    yield "link_3", [
        cylinder(o, Z, 0.17, 0.002, 0.10),
        body(Z, [((0, -0.02, 0.06), 0.16, 0.16), ((0.01, -0.06, 0.175), 0.17, 0.19), ((0.01, -0.08, 0.30), 0.14, 0.15)], 3.5),
        body(X, [((-0.20, y, z), 0.135, 0.145), ((0.12, y, z), 0.145, 0.145), ((0.36, y, z), 0.122, 0.125),
                 ((0.74, y, z), 0.105, 0.105)], 6),
        # joint 4 housing
        cylinder((0, y, z), X, 0.118, 0.72, 0.828),
        # drives 4, 5, 6
        cylinder((0, y + 0.085, z - 0.075), X, 0.058, -0.40, -0.18),
        cylinder((0, y + 0.085, z + 0.075), X, 0.058, -0.40, -0.18),
        cylinder((0, y - 0.075, z), X, 0.058, -0.40, -0.18),
        # drive 3
        cylinder(o, Z, 0.115, 0.29, 0.42),
    ]
    # -z along the forearm
    yield "link_4", [
        cylinder(o, Z, 0.100, -0.075, 0.0),
        body(Z, [((0, 0, -0.06), 0.098, 0.098), ((0, 0, -0.13), 0.072, 0.075), ((0, 0, -0.30), 0.058, 0.056),
                 ((0, 0, -0.40), 0.062, 0.050)], 3),
        cylinder((0, 0, -0.392), Y, 0.084, -0.055, 0.055),
    ]
    # x forward, z lateral
    yield "link_5", [
        cylinder(o, Z, 0.098, -0.040, 0.025),
        cylinder(o, Z, 0.098, -0.205, -0.152),
        body(X, [((-0.02, 0, -0.010), 0.085, 0.026), ((0.14, 0, -0.014), 0.075, 0.026)], 5),
        body(X, [((-0.02, 0, -0.179), 0.085, 0.024), ((0.14, 0, -0.176), 0.075, 0.026)], 5),
        body(X, [((0.098, 0, -0.096), 0.078, 0.100), ((0.15, 0, -0.096), 0.078, 0.085)], 4),
        cylinder((0, 0, -0.096), X, 0.078, 0.14, 0.1665),
    ]
    # -z out of the flange
    yield "link_6", [
        cylinder(o, Z, 0.072, -0.034, 0.0, 0.004),
        cylinder(o, Z, 0.050, -0.0485, -0.030, 0.003),
    ]


def check_closed(solid):
    """Checks that each edge belongs to exactly two triangles, once in each direction."""
    corners = [[tuple(round(x, 9) for x in point) for point in triangle] for triangle in solid]
    edges = [(t[k], t[k - 1]) for t in corners for k in range(3)]
    assert len(set(edges)) == len(edges) and set(edges) == {edge[::-1] for edge in edges}
    assert volume(solid) > 0


def stl(solids):
    """Binary STL of closed solids."""
    triangles = []
    for solid in solids:
        check_closed(solid)
        triangles += solid
    out = [b"flexarm tools/make_meshes.py, metres".ljust(80), struct.pack("<I", len(triangles))]
    for a, b, c in triangles:
        out.append(struct.pack("<12fH", *unit(cross(difference(b, a), difference(c, a))), *a, *b, *c, 0))
    return b"".join(out)


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent.parent / "robots" / "kr210" / "meshes"
    folder.mkdir(parents=True, exist_ok=True)
    for name, solids in links():
        (folder / f"{name}.stl").write_bytes(stl(solids))
