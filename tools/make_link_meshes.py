"""Draws and meshes the castings of robots/test/lower_arm and robots/kr210/fe.

Needs gmsh and numpy (`pip install gmsh numpy`).

    python tools/make_link_meshes.py                                      # all meshes and the skin, to their places
    python tools/make_link_meshes.py lower_arm --size-mm 12 --out FILE    # one, finer; .msh is binary, .msh.gz text

Own designs. A casting is a shell between an outer and an inner solid (a loft between two drums),
with a thick bearing seat in the front of each drum, a hole in its back, ribs and core holes. It is
given in the link frame of its URDF, so that the seats are around the joint axes. Volume group
`body`, surface groups `interface_A` (proximal seat, at the link's own joint) and `interface_B`
(distal seat).

Elements are TET10 with straight edges: corners are rounded to 2 um and mid-edge nodes are their
exact means (so the text needs three decimals). The Jacobian is then constant in each element, cuts
at a plane are exact and every quadrature of order 2 is exact for the stiffness. Written files are
read back and checked. At some coarse sizes gmsh cannot fill the thin walls ("PLC Error") or leaves
slivers: a size a few per cent different helps.
"""
import argparse
import gzip
import re
from collections import namedtuple
from pathlib import Path

import gmsh
import numpy as np

ROBOTS = Path(__file__).parent.parent / "robots"
BIG = 4.0                                         # longer than any casting, m
occ = gmsh.model.occ

# A casting: its solid and the planes of its seats. Lengths in m until `mesh_casting` scales them.
#   build   draws it and returns the volume's tag
#   seats   for A and B: centre, direction that the seat faces, outer and inner radius
#   unit    length unit of the file in m; size: maximum element edge in m
Casting = namedtuple("Casting", "folder stem build seats unit size density")
Seat = namedtuple("Seat", "centre facing outer inner")


# Solids

def cylinder(centre, axis, start, end, radius):
    """Cylinder from centre + start * axis to centre + end * axis."""
    p, d = np.asarray(centre) + start * np.asarray(axis), (end - start) * np.asarray(axis)
    return [(3, occ.addCylinder(*p, *d, radius))]


def box(low, high):
    return [(3, occ.addBox(*low, *(np.asarray(high) - low)))]


def loft(stations, u, v, power, shrink=0.0):
    """Loft through superellipses (centre, half size along u, along v, wall), each reduced by shrink
    * wall."""
    loops = []
    for centre, a, b, wall in stations:
        angle = 2 * np.pi * np.arange(24) / 24
        c, s = np.cos(angle), np.sin(angle)
        r = (np.abs(c)**power + np.abs(s)**power)**(-1 / power)
        ring = np.outer((a - shrink * wall) * r * c, u) + np.outer((b - shrink * wall) * r * s, v) + centre
        points = [occ.addPoint(*p) for p in ring]
        loops.append(occ.addWire([occ.addSpline(points + points[:1])]))
    return [d for d in occ.addThruSections(loops, makeSolid=True, maxDegree=3) if d[0] == 3]


def fuse(*solids):
    solids = [s for s in solids if s]
    return solids[0] if len(solids) == 1 else occ.fuse(solids[0], sum(solids[1:], []))[0]


def cut(solid, *tools):
    return occ.cut(solid, sum(tools, []))[0]


def common(a, b):
    return occ.intersect(a, b)[0]


class Drum:
    """A joint's housing: cylinder with a thick front (the bearing seat) and a back with a hole.

    `depth` is measured from the seat's face, against the direction it faces.
    """

    def __init__(self, seat, depth, wall, seat_thickness, back_hole):
        self.seat, self.depth, self.wall, self.thick, self.hole = seat, depth, wall, seat_thickness, back_hole
        self.inward = -np.asarray(seat.facing, float)

    def outer(self):
        return cylinder(self.seat.centre, self.inward, 0.0, self.depth, self.seat.outer)

    def inner(self, shrink=1.0):
        wall = shrink * self.wall
        return cylinder(self.seat.centre, self.inward, shrink * self.thick, self.depth - wall, self.seat.outer - wall)

    def bores(self):
        return (cylinder(self.seat.centre, self.inward, -0.01, self.thick + 0.001, self.seat.inner)
                + cylinder(self.seat.centre, self.inward, self.depth - self.wall - 0.001, self.depth + 0.01, self.hole))

    def gussets(self, angles, wall, height):
        """Radial ribs behind the seat: plates from the bore to the drum's wall."""
        i = int(np.argmax(np.abs(self.inward)))
        plates = []
        for angle in np.deg2rad(angles):
            r0, r1 = self.seat.inner + 0.008, self.seat.outer
            low, high = np.array([r0, -wall / 2, -wall / 2]), np.array([r1, wall / 2, wall / 2])
            axis = np.array([0.0, 0.0, 1.0])
            span = sorted((0.6 * self.thick * self.inward[i], (self.thick + height) * self.inward[i]))
            # drawn about z, then turned onto the drum's axis
            low[2], high[2] = span
            plate = box(low, high)
            occ.rotate(plate, 0, 0, 0, *axis, angle)
            if i == 1:                                               # z to y: about x by -90 deg
                occ.rotate(plate, 0, 0, 0, 1, 0, 0, -np.pi / 2)
            elif i == 0:                                             # z to x: about y by +90 deg
                occ.rotate(plate, 0, 0, 0, 0, 1, 0, np.pi / 2)
            occ.translate(plate, *self.seat.centre)
            plates += plate
        return plates


def shell(lofts, drums, ribs, holes, gussets=()):
    """Outer minus inner solid, plus the ribs within the cavity, minus bores and holes."""
    outer = fuse(*[f(0.0) for f in lofts], *[d.outer() for d in drums])
    inner = fuse(*[f(1.0) for f in lofts], *[d.inner() for d in drums])
    # ribs end in the middle of the wall: they join it over an area and are not visible outside
    middle = fuse(*[f(0.5) for f in lofts], *[d.inner(0.5) for d in drums])
    ribs = common(sum(ribs, []) + list(gussets), middle)
    solid = fuse(cut(outer, inner), ribs)
    solid = cut(solid, *holes, *[d.bores() for d in drums])
    assert len(solid) == 1, f"{len(solid)} solids instead of one"
    return solid[0][1]


# The castings

def rib(axis, at, wall, hole_centre, hole):
    """Plate perpendicular to `axis` with a round hole (hole_centre: the two other coordinates)."""
    low, high = np.full(3, -BIG / 2), np.full(3, BIG / 2)
    low[axis], high[axis] = at - wall / 2, at + wall / 2
    centre = np.insert(np.asarray(hole_centre, float), axis, at)
    return cut(box(low, high), cylinder(centre, np.eye(3)[axis], -wall, wall, hole))


LOWER_SEATS = (Seat((0.0, 0.0, 0.0), (0, -1, 0), 0.160, 0.108), Seat((0.060, 0.150, 1.100), (0, 1, 0), 0.115, 0.070))


def lower_arm():
    """Upright on joint 1 (axis y), bowed forward and leaning sideways: no symmetry plane, no zero
    coupling."""
    a, b = LOWER_SEATS
    drums = [Drum(a, 0.126, 0.011, 0.026, 0.062), Drum(b, 0.116, 0.009, 0.020, 0.046)]
    stations = [((-0.010, 0.068, 0.00), 0.126, 0.044, 0.011), ((-0.030, 0.070, 0.28), 0.112, 0.047, 0.010),
                ((-0.020, 0.077, 0.65), 0.090, 0.047, 0.0095), ((0.028, 0.086, 0.95), 0.077, 0.042, 0.009),
                ((0.060, 0.088, 1.10), 0.074, 0.040, 0.009)]
    body = lambda shrink: loft([(np.array(c), p, q, w) for c, p, q, w in stations], [1, 0, 0], [0, 1, 0], 4.0, shrink)
    ribs = [rib(2, 0.330, 0.009, (-0.030, 0.069), 0.026), rib(2, 0.690, 0.009, (-0.014, 0.078), 0.024)]
    # core holes, in the back
    holes = [cylinder((-0.02, 0.0745, 0.500), (1, 0, 0), -0.30, 0.0, 0.025),
             cylinder((0.0, 0.082, 0.820), (1, 0, 0), -0.30, 0.0, 0.022),
             cylinder((-0.018, 0.07, 0.200), (0, 1, 0), 0.0, 0.20, 0.040)]     # and the side
    gussets = drums[0].gussets((20, 80, 145), 0.010, 0.050) + drums[1].gussets((-30, -100, 210), 0.009, 0.040)
    return shell([body], drums, ribs, holes, gussets)


LINK_2_SEATS = (Seat((0.0, 0.0, 0.064), (0, 0, 1), 0.195, 0.130), Seat((1.150, 0.0, -0.103), (0, 0, 1), 0.165, 0.105))


def link_2():
    """Link arm of the KR 210 class: next to both bearings (axes z), seats on the same side."""
    a, b = LINK_2_SEATS
    drums = [Drum(a, 0.386, 0.011, 0.032, 0.100), Drum(b, 0.214, 0.010, 0.030, 0.085)]
    stations = [((0.00, 0, -0.196), 0.166, 0.102, 0.011), ((0.30, 0, -0.204), 0.154, 0.100, 0.011),
                ((0.72, 0, -0.212), 0.138, 0.088, 0.010), ((1.15, 0, -0.214), 0.126, 0.078, 0.010)]
    body = lambda shrink: loft([(np.array(c), p, q, w) for c, p, q, w in stations], [0, 1, 0], [0, 0, 1], 4.0, shrink)
    ribs = [rib(0, 0.420, 0.010, (0, -0.205), 0.055), rib(0, 0.790, 0.010, (0, -0.208), 0.050)]
    holes = [cylinder((0.60, 0.0, -0.21), (0, 0, 1), -0.20, 0.0, 0.050), cylinder((0.60, 0.0, -0.21), (0, 1, 0), 0.0, 0.30, 0.035)]
    gussets = drums[0].gussets((90, 180, 270), 0.011, 0.080) + drums[1].gussets((-70, 70), 0.010, 0.060)
    return shell([body], drums, ribs, holes, gussets)


# axis of joint 4 in link_3: along x through this point
AXIS_4 = np.array([0.0, -0.115, 0.175])
LINK_3_SEATS = (Seat((0.0, 0.0, 0.0), (0, 0, -1), 0.168, 0.100), Seat((0.828, *AXIS_4[1:]), (1, 0, 0), 0.118, 0.078))


def link_3():
    """Forearm: drum about joint 3 (axis z), box with three holes for the wrist drives, tube up to
    joint 4 (axis x)."""
    a, b = LINK_3_SEATS
    drums = [Drum(a, 0.326, 0.010, 0.028, 0.085), Drum(b, 0.150, 0.010, 0.026, 0.070)]
    stations = [(-0.200, 0.124, 0.124, 0.010), (0.080, 0.138, 0.128, 0.010), (0.380, 0.120, 0.116, 0.0095),
                (0.705, 0.092, 0.092, 0.009)]
    place = lambda x: AXIS_4 + [x, 0, 0]
    # the cavity leaves a rear wall
    rear = lambda shrink, x, wall: shrink * wall if x < 0 else 0.0
    body = lambda shrink: loft([(place(x + rear(shrink, x, w)), p, q, w) for x, p, q, w in stations], [0, 1, 0], [0, 0, 1], 4.0, shrink)
    ribs = [rib(0, 0.300, 0.009, AXIS_4[1:], 0.060), rib(0, 0.560, 0.009, AXIS_4[1:], 0.055)]
    drives = [cylinder(AXIS_4 + [0, dy, dz], (1, 0, 0), -0.25, -0.15, 0.038) for dy, dz in ((0.050, -0.050), (0.050, 0.050), (-0.055, 0))]
    holes = drives + [cylinder((0.430, *AXIS_4[1:]), (0, 1, 0), -0.30, 0.0, 0.045)]
    gussets = drums[0].gussets((-60, 60, 135, 225), 0.010, 0.060)
    return shell([body], drums, ribs, holes, gussets)


CASTINGS = {
    "lower_arm": Casting("test/lower_arm", "lower_arm", lower_arm, LOWER_SEATS, 1e-3, 0.041, 2700.0),
    "link_2": Casting("kr210/fe", "link_2", link_2, LINK_2_SEATS, 1.0, 0.0588, 7100.0),
    "link_3": Casting("kr210/fe", "link_3", link_3, LINK_3_SEATS, 1.0, 0.050, 7100.0),
}


# Meshing

def interface_faces(volume, seat):
    """Returns the faces of the volume in the seat's plane, within its outer radius."""
    found = []
    for _, face in gmsh.model.getBoundary([(3, volume)], oriented=False):
        low, high = np.array(gmsh.model.getBoundingBox(2, face)).reshape(2, 3)
        along = np.abs(np.asarray(seat.facing)) > 0.5
        flat = np.all(np.abs(low - seat.centre)[along] < 1e-5) and np.all(np.abs(high - seat.centre)[along] < 1e-5)
        if flat and np.all(low[~along] > (np.asarray(seat.centre) - seat.outer - 1e-5)[~along]) \
                and np.all(high[~along] < (np.asarray(seat.centre) + seat.outer + 1e-5)[~along]):
            found.append(face)
    area = sum(occ.getMass(2, face) for face in found)
    assert abs(area / (np.pi * (seat.outer**2 - seat.inner**2)) - 1) < 1e-6, (found, area)
    return found


def mesh_casting(casting, size):
    """Meshes in the unit of the file, straight TET10, nodes on a decimal grid. The mesh stays the
    gmsh model."""
    gmsh.clear()
    gmsh.model.add(casting.stem)
    volume = casting.build()
    occ.removeAllDuplicates()
    occ.synchronize()
    (_, volume), = gmsh.model.getEntities(3)
    groups = [(3, [volume], "body")] + [(2, interface_faces(volume, s), f"interface_{n}") for n, s in zip("AB", casting.seats)]
    for dim, tags, name in groups:
        gmsh.model.addPhysicalGroup(dim, tags, name=name)

    option = gmsh.option.setNumber
    option("Mesh.MeshSizeMax", size)
    option("Mesh.MeshSizeMin", 0.25 * size)
    option("Mesh.MeshSizeFromCurvature", 5)
    option("Mesh.Algorithm", 6)
    option("Mesh.Algorithm3D", 1)
    option("Mesh.Optimize", 1)
    option("Mesh.OptimizeThreshold", 0.4)
    option("Mesh.SecondOrderLinear", 1)
    option("Mesh.RandomSeed", 1)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.optimize("Netgen")
    gmsh.model.mesh.optimize("")
    gmsh.model.mesh.setOrder(2)
    gmsh.model.mesh.renumberNodes(*gmsh.model.mesh.computeRenumbering('RCMK'))

    # Nodes to the file's unit: corners to multiples of 2e-6 m, mid-edge nodes to their means.
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    points = np.zeros((int(tags.max()) + 1, 3))
    points[tags] = coordinates.reshape(-1, 3)
    grid = np.round(points / 2e-6) * 2                                # whole numbers of um, even
    (kind,), _, (cells,) = gmsh.model.mesh.getElements(3)
    assert kind == 11
    cells = cells.reshape(-1, 10)
    middle = grid.copy()
    for k, (i, j) in enumerate(EDGES):
        middle[cells[:, 4 + k]] = (grid[cells[:, i]] + grid[cells[:, j]]) / 2
    per_unit = round(casting.unit / 1e-6)
    used = np.unique(cells)
    for tag in used:
        gmsh.model.mesh.setNode(tag, middle[tag] / per_unit + 0.0, [])            # + 0.0: no -0


def write(path):
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.option.setNumber("Mesh.SaveAll", 0)
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix != ".gz":
        gmsh.option.setNumber("Mesh.Binary", 1)
        gmsh.write(str(path))
        return
    plain = path.with_suffix("")
    gmsh.option.setNumber("Mesh.Binary", 0)
    gmsh.write(str(plain))
    # gmsh prints 99.332 with 16 digits as 99.33199999999999: print the intended value
    head, nodes, rest = re.split(r"(?s)(\$Nodes.*?\$EndNodes)", plain.read_text())
    nodes = re.sub(r"-?\d+\.\d+(e-?\d+)?", lambda m: f"{float(m[0]):.10g}", nodes)
    # no timestamp: same bytes in each run
    path.write_bytes(gzip.compress((head + nodes + rest).encode(), 9, mtime=0))
    plain.unlink()


# Checks, from the written file

# Mid-edge nodes 4 to 9 of gmsh's TET10: its corners.
EDGES = ((0, 1), (1, 2), (2, 0), (3, 0), (3, 2), (3, 1))
CORNERS = np.vstack([np.zeros(3), np.eye(3)])
GAUSS = (5 - 5**0.5) / 20 + CORNERS * 5**0.5 / 5
NODES = np.vstack([CORNERS, [(CORNERS[i] + CORNERS[j]) / 2 for i, j in EDGES]])


def shape(r):
    """TET10 shape functions at the points r (n x 3): values n x 10, derivatives n x 10 x 3."""
    r = np.atleast_2d(r)
    L = np.column_stack([1 - r.sum(1), r])
    dL = np.vstack([-np.ones(3), np.eye(3)])
    N = np.hstack([L * (2 * L - 1), np.column_stack([4 * L[:, i] * L[:, j] for i, j in EDGES])])
    corner = (4 * L - 1)[:, :, None] * dL
    edge = np.stack([4 * (L[:, i, None] * dL[j] + L[:, j, None] * dL[i]) for i, j in EDGES], axis=1)
    return N, np.concatenate([corner, edge], axis=1)


def read(path):
    """Reads points (m in the file's unit), TET10, faces of A and B from a file."""
    gmsh.clear()
    if str(path).endswith(".gz"):
        plain = Path(str(path)[:-3] + ".check.msh")
        plain.write_bytes(gzip.decompress(Path(path).read_bytes()))
        gmsh.merge(str(plain))
        plain.unlink()
    else:
        gmsh.merge(str(path))
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    index = np.zeros(int(tags.max()) + 1, int)
    index[tags] = np.arange(len(tags))
    names = {gmsh.model.getPhysicalName(d, t): (d, t) for d, t in gmsh.model.getPhysicalGroups()}
    cells = {}
    for name, (dim, group) in names.items():
        parts = [gmsh.model.mesh.getElements(dim, e) for e in gmsh.model.getEntitiesForPhysicalGroup(dim, group)]
        kind, width = {3: (11, 10), 2: (9, 6)}[dim]
        assert all(list(kinds) == [kind] for kinds, _, _ in parts), "only TET10 and TRI6"
        cells[name] = index[np.concatenate([n[0] for _, _, n in parts])].reshape(-1, width)
    return coordinates.reshape(-1, 3), cells


def jacobians(points, cells, at):
    """Returns det J of each element at the points `at`."""
    return np.linalg.det(np.einsum("eai,gaj->egij", points[cells], shape(at)[1]))


def mass_properties(points, cells, density):
    """Mass, centre of mass, inertia about it. Exact for straight-sided elements (4 points integrate
    order 2)."""
    weight = jacobians(points, cells, GAUSS) / 24 * density
    x = np.einsum("ga,eai->egi", shape(GAUSS)[0], points[cells])
    mass = weight.sum()
    com = np.einsum("eg,egi->i", weight, x) / mass
    second = np.einsum("eg,egi,egj->ij", weight, x - com, x - com)
    return mass, com, np.trace(second) * np.eye(3) - second


def quality(points, cells):
    """Returns 3 x inradius / circumradius of the corner tetrahedra: 1 is regular."""
    p = points[cells[:, :4]]
    a, b, c = (p[:, k] - p[:, 0] for k in (1, 2, 3))
    six = np.abs(np.einsum("ei,ei->e", a, np.cross(b, c)))
    area = sum(np.linalg.norm(np.cross(u, v), axis=1) / 2 for u, v in ((a, b), (b, c), (c, a), (b - a, c - a)))
    inner = six / 2 / area
    aa, bb, cc = (np.einsum("ei,ei->e", v, v)[:, None] for v in (a, b, c))
    outer = np.linalg.norm(aa * np.cross(b, c) + bb * np.cross(c, a) + cc * np.cross(a, b), axis=1) / (2 * six)
    return 3 * inner / outer


def check(path, casting, verbose=True):
    points, cells = read(path)
    points = points * casting.unit
    body = cells["body"]
    assert len(np.unique(body)) == len(points), "nodes without a volume element"
    corners, inside = points[body[:, :4]], points[body[:, 4:]]
    bent = max(np.abs(inside[:, k] - (corners[:, i] + corners[:, j]) / 2).max() for k, (i, j) in enumerate(EDGES))
    assert bent < 1e-12, f"a mid-edge node is {bent} m off its edge"
    at_gauss, at_nodes = jacobians(points, body, GAUSS), jacobians(points, body, NODES)
    assert at_gauss.min() > 0 and at_nodes.min() > 0, "an element is inside out"
    for name, seat in zip("AB", casting.seats):
        p = points[np.unique(cells[f"interface_{name}"])] - seat.centre
        along = p @ np.asarray(seat.facing, float)
        radius = np.linalg.norm(p - np.outer(along, seat.facing), axis=1)
        assert np.abs(along).max() < 2e-6 and radius.max() < seat.outer + 3e-6, name
    if verbose:
        q, (mass, com, inertia) = quality(points, body), mass_properties(points, body, casting.density)
        print(f"{path}: {Path(path).stat().st_size} bytes, {len(points)} nodes, {len(body)} TET10, seats "
              f"{len(np.unique(cells['interface_A']))} and {len(np.unique(cells['interface_B']))} nodes")
        print(f"  det J at nodes {at_nodes.min():.2e} to {at_nodes.max():.2e} m3; quality 3r/R: least {q.min():.3f}, "
              f"{(q < 0.1).sum()} below 0.1, mean {q.mean():.2f}")
        print(f"  at {casting.density:.0f} kg/m3: {mass:.3f} kg, centre of mass {np.round(com, 5)} m, inertia about it "
              f"{np.round(inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]], 5)} kg m2 (xx yy zz xy xz yz)")
    return points, cells


def skin(cells):
    """Outer triangles of the TET10 (corner nodes, normals outward)."""
    faces = np.vstack([cells[:, f] for f in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


def write_stl(path, triangles):
    """Binary STL, as tools/make_meshes.py writes it."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    record = np.zeros(len(triangles), dtype=[("normal", "<3f4"), ("corner", "<9f4"), ("attribute", "<u2")])
    record["normal"], record["corner"] = normal, triangles.reshape(-1, 9)
    header = b"flexarm tools/make_link_meshes.py, metres".ljust(80, b" ")
    path.write_bytes(header + np.uint32(len(triangles)).astype("<u4").tobytes() + record.tobytes())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="?", choices=CASTINGS, help="all if not given")
    parser.add_argument("--size-mm", type=float, help="largest element edge")
    parser.add_argument("--out", type=Path, help="another place for the mesh; .msh: binary, .msh.gz: text")
    arguments = parser.parse_args()
    if arguments.out and not arguments.name:
        parser.error("--out needs the name of one casting")

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    for name in [arguments.name] if arguments.name else CASTINGS:
        casting = CASTINGS[name]
        path = arguments.out or ROBOTS / casting.folder / f"{casting.stem}.msh.gz"
        mesh_casting(casting, arguments.size_mm / 1000 if arguments.size_mm else casting.size)
        write(path)
        points, cells = check(path, casting)
        if name == "lower_arm" and not arguments.out:
            stl = path.with_name("lower_arm.stl")
            triangles = points[skin(cells["body"])]
            write_stl(stl, triangles)
            print(f"{stl}: {stl.stat().st_size} bytes, {len(triangles)} triangles")
    gmsh.finalize()


if __name__ == "__main__":
    main()
