"""Writes the structured HEX20 meshes of robots/test/one_beam/fe and robots/test/three_beams/fe. Needs numpy.

    python tools/crosscheck/make_beam_meshes.py

A section of quadrilaterals, swept along the link. Volume group `body`, surface groups `interface_A`
(near end) and `interface_B` (far end); m; Gmsh 4.1 text, the same bytes in each run. No mesher is
used, so that planes of nodes are at the wanted stations; coordinates are written so that they are
read back exactly.

A tube of second-order elements has parabolic arcs: its two radii are chosen so that area and second
moment equal those of the true tube, 60 mm and wall 3 mm. They differ from 30 and 27 mm by less than
1 um.
"""
import gzip
from pathlib import Path

import numpy as np

ROBOTS = Path(__file__).resolve().parents[2] / "robots"
QUAD = ((-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0))
# Mid-edge nodes 8 to 19 of gmsh's HEX20: its corners
HEX_EDGES = ((0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7))
CORNERS = ((-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1))


# Sections: arrays (quadrilaterals, 8 nodes, 2), corners counterclockwise, then the mid-side nodes

def grid(first, second, keep=lambda p, q: True):
    """Rectangles between the lines; `keep` selects them by their centre."""
    quads = []
    for a0, a1 in zip(first, first[1:]):
        for b0, b1 in zip(second, second[1:]):
            if keep((a0 + a1) / 2, (b0 + b1) / 2):
                quads.append([[(a0 + a1) / 2 + r * (a1 - a0) / 2, (b0 + b1) / 2 + s * (b1 - b0) / 2] for r, s in QUAD])
    return np.array(quads)


def ring(inner, outer, around):
    step = 2 * np.pi / around
    quads = []
    for k in range(around):
        quads.append([[(inner + outer) / 2 + r * (outer - inner) / 2, (k + 0.5 + s / 2) * step] for r, s in QUAD])
    polar = np.array(quads)
    return polar[..., :1] * np.stack([np.cos(polar[..., 1]), np.sin(polar[..., 1])], -1)


def section_moments(quads):
    """Area and integral of y^2 + z^2, exact for parabolic edges."""
    g, w = np.polynomial.legendre.leggauss(6)
    (R, S), W = np.meshgrid(g, g), np.outer(w, w)
    r, s, w = R.ravel(), S.ravel(), W.ravel()
    N, dr, ds = [], [], []
    for a, b in QUAD:                              # serendipity functions and their derivatives
        if a and b:
            N.append((1 + a * r) * (1 + b * s) * (a * r + b * s - 1) / 4)
            dr.append(a * (1 + b * s) * (2 * a * r + b * s) / 4)
            ds.append(b * (1 + a * r) * (2 * b * s + a * r) / 4)
        elif a == 0:
            N.append((1 - r**2) * (1 + b * s) / 2)
            dr.append(-r * (1 + b * s))
            ds.append(b * (1 - r**2) / 2)
        else:
            N.append((1 - s**2) * (1 + a * r) / 2)
            dr.append(a * (1 - s**2) / 2)
            ds.append(-s * (1 + a * r))
    p, pr, ps = (np.einsum("qai,ag->qgi", quads, np.array(f)) for f in (N, dr, ds))
    J = (pr[..., 0] * ps[..., 1] - pr[..., 1] * ps[..., 0]) * w
    return J.sum(), (J * (p**2).sum(-1)).sum()


def tube(outer, wall, around):
    """Ring with the area and second moment of the true tube, by Newton's method on the two
    radii."""
    a, b = outer, outer - wall
    wanted = np.pi * np.array([a**2 - b**2, (a**4 - b**4) / 2])
    radii = np.array([b, a])
    for _ in range(6):
        value = np.array(section_moments(ring(*radii, around)))
        slope = np.column_stack([(np.array(section_moments(ring(*(radii + d), around))) - value) / 1e-7 for d in 1e-7 * np.eye(2)])
        radii = radii - np.linalg.solve(slope, value - wanted)
    print(f"  tube: radii {radii[0] * 1e3:.7f} and {radii[1] * 1e3:.7f} mm")
    return ring(*radii, around)


# The mesh

def sweep(quads, length, layers, axis):
    """Nodes, HEX20 in gmsh's order, QUAD8 of both ends. `axis` 0: section in y, z; 2: section in x,
    y."""
    place = {}
    points = []

    def node(p, level):
        key = (level, *np.round(p / 1e-9).astype(int).tolist())
        if key not in place:
            along = length * level / (2 * layers)
            place[key] = len(points)
            points.append([along, p[0], p[1]] if axis == 0 else [p[0], p[1], along])
        return place[key]

    at = {offset: k for k, offset in enumerate(QUAD)}
    offsets = list(CORNERS) + [tuple((np.add(CORNERS[i], CORNERS[j]) // 2).tolist()) for i, j in HEX_EDGES]
    cells = []
    for layer in range(layers):
        for quad in quads:
            cells.append([node(quad[at[o[:2]]], 2 * layer + 1 + o[2]) for o in offsets])
    faces = []
    for level in (0, 2 * layers):
        order = range(8) if level else (0, 3, 2, 1, 7, 6, 5, 4)              # normals outwards
        faces.append(np.array([[node(quad[k], level) for k in order] for quad in quads]))
    # sorted by level, so that the file compresses well and the matrices have a small bandwidth
    points, cells = np.array(points) + 0.0, np.array(cells)
    order = np.lexsort((np.arange(len(points)), np.round(points[:, axis] / 1e-9)))
    new = np.empty(len(points), int)
    new[order] = np.arange(len(points))
    return points[order], new[cells], [new[f] for f in faces]


def number(v):
    """Formats with the fewest digits that restore the value, without digits due to rounding
    (0.30000000000000004)."""
    short = f"{v:.12g}"
    return short if abs(float(short) - v) < 1e-16 else repr(float(v))


def write(path, points, cells, faces):
    low, high = points.min(0), points.max(0)
    corner = lambda a, b: " ".join(number(v) for v in (*a, *b))
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", "3", '2 1 "interface_A"', '2 2 "interface_B"', '3 3 "body"',
             "$EndPhysicalNames", "$Entities", "0 0 2 1"]
    for k, face in enumerate(faces):
        p = points[np.unique(face)]
        lines.append(f"{k + 1} {corner(p.min(0), p.max(0))} 1 {k + 1} 0")
    lines += [f"1 {corner(low, high)} 1 3 2 1 2", "$EndEntities"]
    n = len(points)
    lines += ["$Nodes", f"1 {n} 1 {n}", f"3 1 0 {n}", *(str(k + 1) for k in range(n))]
    lines += [" ".join(number(v) for v in p) for p in points.tolist()] + ["$EndNodes"]
    total = len(cells) + sum(len(f) for f in faces)
    lines += ["$Elements", f"3 {total} 1 {total}"]
    tag = 0
    for dim, entity, kind, block in ((2, 1, 16, faces[0]), (2, 2, 16, faces[1]), (3, 1, 17, cells)):
        lines.append(f"{dim} {entity} {kind} {len(block)}")
        for cell in block:
            tag += 1
            lines.append(f"{tag} " + " ".join(str(c + 1) for c in cell))
    text = ("\n".join(lines + ["$EndElements"]) + "\n").encode()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(text, 9, mtime=0) if path.suffix == ".gz" else text)
    print(f"{path.relative_to(ROBOTS.parent)}: {path.stat().st_size} bytes, {n} nodes, {len(cells)} HEX20")


def lines(*mm):
    return np.array(mm) * 1e-3


def main():
    bar = grid(np.linspace(-0.010, 0.010, 3), np.linspace(-0.020, 0.020, 3))
    write(ROBOTS / "test/one_beam/fe/one_beam.msh", *sweep(bar, 0.8, 40, 0))

    write(ROBOTS / "test/three_beams/fe/beam_1.msh.gz", *sweep(tube(0.030, 0.003, 24), 0.8, 20, 2))
    wall = lambda y, z: abs(y) > 0.012 or abs(z) > 0.022
    box = grid(lines(-15, -12, -4, 4, 12, 15), lines(-25, -22, -11, 0, 11, 22, 25), wall)
    write(ROBOTS / "test/three_beams/fe/beam_2.msh.gz", *sweep(box, 0.6, 20, 0))
    bar = grid(lines(-15, -5, 5, 15), lines(-10, 0, 10))
    write(ROBOTS / "test/three_beams/fe/beam_3.msh.gz", *sweep(bar, 0.4, 20, 0))


if __name__ == "__main__":
    main()
