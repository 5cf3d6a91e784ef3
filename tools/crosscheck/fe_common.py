"""Shared code of the finite element cross-checks.

Meshes, CalculiX, NGSolve, an own assembly, ties, solving, JSON.

CalculiX prints few digits. `*FREQUENCY, STORAGE=YES` keeps its stiffness and mass in `job.eig`, in
binary double precision but without their pattern; `SOLVER=MATRIXSTORAGE` prints the pattern (and 14
digits, used here to check that the two were combined correctly). Ties, loads and condensation
follow in double precision; the output of CalculiX for the same case, with its own ties, is compared
to its seven digits.
"""
import gzip
import hashlib
import json
import os
import re
import shutil
import subprocess
import tempfile
import tomllib
from collections import namedtuple
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import gmsh
import numpy as np
import pypardiso
import scipy.sparse as sp
import scipy.sparse.linalg as sl

ROOT = Path(__file__).resolve().parents[2]
STORE = ROOT / "tests" / "verification"
DATE = "2026-11-21"
E, NU, RHO = 70e9, 0.33, 2700.0                          # aluminium
GRAVITY = 9.81

DIGITS_NOTE = "digits: relative, from comparison with an own assembly in extended precision; it is rounding of the program's K in double precision"

# kind: "HEX20" or "TET10", nodes in the order of gmsh; m
Mesh = namedtuple("Mesh", "path x kind cells groups")
HEX_CORNERS = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)])
EDGES = {"HEX20": ((0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)),
         "TET10": ((0, 1), (1, 2), (2, 0), (3, 0), (3, 2), (3, 1))}
# Mid-edge nodes of C3D20 and C3D10: the first is 0-1, then 1-2, ...
CCX_EDGES = {"HEX20": ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
             "TET10": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))}


# ------------------------------------------------------------------------------------------------
# meshes
def read_mesh(path, unit=1.0):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    path = Path(path)
    if path.suffix == ".gz":
        with tempfile.NamedTemporaryFile(suffix=".msh") as plain:
            plain.write(gzip.decompress(path.read_bytes()))
            plain.flush()
            gmsh.merge(plain.name)
    else:
        gmsh.merge(str(path))
    tags, x, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    index = np.zeros(int(tags.max()) + 1, np.int64)
    index[tags[order]] = np.arange(len(tags))
    groups, cells, kind = {}, None, None
    for dim, group in gmsh.model.getPhysicalGroups():
        found = [gmsh.model.mesh.getElements(dim, e) for e in gmsh.model.getEntitiesForPhysicalGroup(dim, group)]
        kinds = {int(k) for f in found for k in f[0]}
        nodes = index[np.concatenate([n for f in found for n in f[2]])]
        if dim == 3:
            kind = {11: "TET10", 17: "HEX20"}[kinds.pop()]
            cells = nodes.reshape(-1, int(kind[3:]))
        else:
            groups[gmsh.model.getPhysicalName(dim, group)] = np.unique(nodes)
    gmsh.finalize()
    # 29.5 / 1000 is 0.0295
    return Mesh(path, x.reshape(-1, 3)[order] / round(1 / unit), kind, cells, groups)


def dofs(nodes):
    return (3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel()


# ----------------------------------------------------------------------------------------------
# CalculiX
def ccx_cells(mesh):
    """Node numbers (from 0) in the order of C3D20 or C3D10."""
    corners = 8 if mesh.kind == "HEX20" else 4
    find = {frozenset(e): corners + k for k, e in enumerate(EDGES[mesh.kind])}
    return mesh.cells[:, list(range(corners)) + [find[frozenset(e)] for e in CCX_EDGES[mesh.kind]]]


def numbered(name, numbers):
    numbers = [str(n) for n in numbers]
    return [name] + [", ".join(numbers[k:k + 12]) for k in range(0, len(numbers), 12)]


def short(v):
    """Formats a number for CalculiX, which reads up to 20 characters."""
    text = repr(float(v))
    return text if len(text) <= 20 else f"{v:.13e}"


def deck(mesh, first_node=0, first_cell=0, label=""):
    """Returns nodes, elements, sets and material; nodes are numbered from 1 (plus `first_node`)."""
    out = ["*NODE"]
    out += [f"{first_node + k + 1}, " + ", ".join(short(v) for v in p) for k, p in enumerate(mesh.x.tolist())]
    out.append(f"*ELEMENT, TYPE={'C3D20' if mesh.kind == 'HEX20' else 'C3D10'}, ELSET=BODY{label}")
    for k, cell in enumerate(ccx_cells(mesh) + first_node + 1):
        numbers = [str(first_cell + k + 1)] + [str(n) for n in cell]
        out.append(", ".join(numbers[:11]) + ("," if len(numbers) > 11 else ""))
        if len(numbers) > 11:
            out.append(", ".join(numbers[11:]))
    for name, nodes in mesh.groups.items():
        out += numbered(f"*NSET, NSET={name.upper()}{label}", nodes + first_node + 1)
    out += [f"*MATERIAL, NAME=M{label}", "*ELASTIC", f"{E!r}, {NU!r}", "*DENSITY", f"{RHO!r}",
            f"*SOLID SECTION, ELSET=BODY{label}, MATERIAL=M{label}"]
    return out


def rigid_ties(mesh, places):
    """Ties both ends rigidly; reference nodes n+1 (A), n+2 (its rotation), n+3 (B), n+4."""
    n = len(mesh.x)
    out = ["*NODE"]
    for k, place in enumerate(places):
        out += [f"{n + 2 * k + j + 1}, " + ", ".join(short(v) for v in place) for j in (0, 1)]
    for k, name in enumerate("AB"):
        out.append(f"*RIGID BODY, NSET=INTERFACE_{name}, REF NODE={n + 2 * k + 1}, ROT NODE={n + 2 * k + 2}")
    return out + numbered("*NSET, NSET=TIP", [n + 3, n + 4])


def run_ccx(lines):
    """Runs a deck in a separate folder; returns its files by extension."""
    folder = Path(tempfile.mkdtemp(prefix="ccx_"))
    try:
        (folder / "job.inp").write_text("\n".join(lines) + "\n")
        done = subprocess.run(["ccx", "job"], cwd=folder, capture_output=True, text=True, check=False)
        assert "Job finished" in done.stdout and "*ERROR" not in done.stdout, done.stdout[-3000:]
        return {p.suffix: p.read_bytes() for p in folder.iterdir()}
    finally:
        shutil.rmtree(folder)


def ccx_matrices(mesh):
    """Returns CalculiX's own K and M of the mesh, free and untied, in double precision."""
    base = deck(mesh) + ["*STEP"]
    text = run_ccx(base + ["*FREQUENCY, SOLVER=MATRIXSTORAGE", "1", "*END STEP"])
    kept = run_ccx(base + ["*FREQUENCY, STORAGE=YES", "8", "*END STEP"])[".eig"]
    place = np.array([[int(v) for v in line.split(".")] for line in text[".dof"].decode().split()])
    equation = 3 * (place[:, 0] - 1) + place[:, 1] - 1
    n = len(equation)
    assert n == 3 * len(mesh.x)
    found = {}
    nev = int(np.frombuffer(kept, np.int32, 4)[3])
    # after four integers and the eigenvalues
    values = np.frombuffer(kept[16:], np.float64, (len(kept) - 16) // 8)[nev:]
    for name in (".sti", ".mas"):
        table = np.array(text[name].split(), dtype=object).reshape(-1, 3)
        i, j, printed = table[:, 0].astype(np.int64) - 1, table[:, 1].astype(np.int64) - 1, table[:, 2].astype(float)
        # printed by columns, stored by rows of the upper triangle
        order = np.lexsort((j, i))
        i, j, printed = i[order], j[order], printed[order]
        off = i != j
        diagonal, above = values[:n], values[n:n + off.sum()]
        values = values[n + off.sum():]
        exact = np.empty(len(i))
        exact[~off], exact[off] = diagonal[j[~off]], above
        assert np.abs(exact - printed).max() < 1e-12 * np.abs(printed).max(), "the pattern does not belong to the values"
        i, j = equation[i], equation[j]
        half = sp.coo_matrix((exact, (i, j)), (n, n)).tocsr()
        found[name] = (half + half.T - sp.diags(half.diagonal())).tocsr()
    return found[".sti"], found[".mas"]


def ccx_numbers(dat, title):
    """Returns the tables of a .dat file under a title: one array of rows (node, values) per
    occurrence."""
    tables, rows = [], None
    for line in dat.decode().splitlines():
        if line.strip().startswith(title):
            rows = []
            tables.append(rows)
        elif rows is not None and re.match(r"^\s*\d+\s+-?\d\.\d+E", line):
            rows.append([float(v) for v in line.split()])
        elif line.strip() and rows:
            rows = None
    return [np.array(t) for t in tables]


# ------------------------------------------------------------------------------- own assembly,
# NGSolve
def hex20(p):
    """Shape functions and derivatives at reference points (gmsh's order): (points, 20), (points,
    20, 3)."""
    N, D = np.zeros((len(p), 20)), np.zeros((len(p), 20, 3))
    edges = [(HEX_CORNERS[i] + HEX_CORNERS[j]) // 2 for i, j in EDGES["HEX20"]]
    for k, c in enumerate([*HEX_CORNERS, *edges]):
        one = 1 + p * c                                            # 1 + r r_k, ...
        if k < 8:
            s = (p * c).sum(1) - 2
            N[:, k] = one.prod(1) * s / 8
            for d in range(3):
                others = one[:, [e for e in range(3) if e != d]].prod(1)
                D[:, k, d] = c[d] * others * (s + one[:, d]) / 8
        else:
            m = int(np.flatnonzero(c == 0)[0])
            factor = one.copy()
            factor[:, m] = 1 - p[:, m]**2
            slope = np.broadcast_to(c.astype(float), p.shape).copy()
            slope[:, m] = -2 * p[:, m]
            N[:, k] = factor.prod(1) / 4
            for d in range(3):
                D[:, k, d] = slope[:, d] * factor[:, [e for e in range(3) if e != d]].prod(1) / 4
    return N, D


def tet10(p):
    L = np.column_stack([1 - p.sum(1), p])
    dL = np.vstack([-np.ones(3), np.eye(3)])
    edges = EDGES["TET10"]
    N = np.hstack([L * (2 * L - 1), np.column_stack([4 * L[:, i] * L[:, j] for i, j in edges])])
    mid = np.stack([4 * (L[:, i, None] * dL[j] + L[:, j, None] * dL[i]) for i, j in edges], 1)
    return N, np.concatenate([(4 * L - 1)[:, :, None] * dL, mid], 1)


def brick_rule(n):
    g, w = np.polynomial.legendre.leggauss(n)
    p = np.stack(np.meshgrid(g, g, g, indexing="ij"), -1).reshape(-1, 3)
    return p, np.einsum("i,j,k->ijk", w, w, w).ravel()


def tet_rule(n):
    """Gauss points of a brick collapsed to a tetrahedron: exact to order 2 n - 3. n = 0: the 4
    points of C3D10."""
    if n == 0:
        return (5 - 5**0.5) / 20 + np.vstack([np.zeros(3), np.eye(3)]) * 5**0.5 / 5, np.full(4, 1 / 24)
    p, w = brick_rule(n)
    a, b, c = ((1 + p) / 2).T
    return np.column_stack([a, b * (1 - a), c * (1 - a) * (1 - b)]), w / 8 * (1 - a)**2 * (1 - b)


def inverse(J):
    """Determinants and inverses of 3 x 3 matrices, in any precision."""
    r = np.stack([np.cross(J[..., 1, :], J[..., 2, :]), np.cross(J[..., 2, :], J[..., 0, :]), np.cross(J[..., 0, :], J[..., 1, :])], -1)
    det = (J[..., 0, :] * r[..., 0]).sum(-1)
    return det, r / det[..., None, None]


def assemble(mesh, points, real=np.float64, chunk=400):
    """Computes K and M by an own assembly. `points`: per direction; 0 for the 4 points of C3D10.

    real=np.longdouble keeps slender links accurate: rounding of K in double precision, 1e-16 of its
    entries, acts against rigid motions and gives errors of 1e-9 to 1e-7 in the compliance.
    """
    lam, mu = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
    p, w = (brick_rule if mesh.kind == "HEX20" else tet_rule)(points)
    N, D = (hex20 if mesh.kind == "HEX20" else tet10)(p.astype(real))
    w = w.astype(real)
    n, sizes = mesh.cells.shape[1], (3 * len(mesh.x),) * 2
    K = sp.csr_matrix(sizes, dtype=real)
    M = sp.csr_matrix((len(mesh.x),) * 2, dtype=real)
    for start in range(0, len(mesh.cells), chunk):
        t = mesh.cells[start:start + chunk]
        det, inv = inverse(np.einsum("eai,gaj->egij", mesh.x[t].astype(real), D))
        weight = det * w
        B = np.einsum("gaj,egji->egai", D, inv)
        flat = B.reshape(len(t), len(w), 3 * n)
        S = np.matmul((flat * weight[..., None]).transpose(0, 2, 1), flat).reshape(len(t), n, 3, n, 3)
        trace = np.einsum("eaibi->eab", S)
        k = lam * S + mu * S.transpose(0, 1, 4, 3, 2) + mu * trace[:, :, None, :, None] * np.eye(3)[None, None, :, None, :]
        rows = (3 * t[:, :, None] + np.arange(3)).reshape(len(t), 3 * n)
        K = K + sp.coo_matrix((k.ravel(), (np.repeat(rows, 3 * n, 1).ravel(), np.tile(rows, (1, 3 * n)).ravel())), sizes).tocsr()
        m = RHO * np.matmul((N * weight[..., None]).transpose(0, 2, 1), N)
        M = M + sp.coo_matrix((m.ravel(), (np.repeat(t, n, 1).ravel(), np.tile(t, (1, n)).ravel())), M.shape).tocsr()
    return (K + K.T) / 2, sp.kron((M + M.T) / 2, sp.eye(3), "csr")


def ngsolve_matrices(mesh, bonus=4):
    """Computes K and M with NGSolve, transformed from its hierarchical functions to nodal
    displacements.

    Its functions of second order on a brick are those of HEX20 and bubbles on faces and inside: the
    bubbles are left out. Nodes off the middle of a straight edge enter as a deformation in the same
    functions. `bonus`: orders of integration beyond NGSolve's default.
    """
    import ngsolve
    from netgen import meshing

    corners = 8 if mesh.kind == "HEX20" else 4
    vertices = np.unique(mesh.cells[:, :corners])
    number = np.zeros(len(mesh.x), int)
    number[vertices] = np.arange(len(vertices))
    net = meshing.Mesh(dim=3)
    for p in mesh.x[vertices].tolist():
        net.Add(meshing.MeshPoint(meshing.Pnt(*p)))
    net.Add(meshing.FaceDescriptor(surfnr=1, domin=1, bc=1))
    net.SetMaterial(1, "body")
    for cell in number[mesh.cells[:, :corners]] + 1:
        # a tetrahedron of netgen is the mirror image of one of gmsh
        net.Add(meshing.Element3D(1, [int(v) for v in (cell if corners == 8 else cell[[1, 0, 2, 3]])]))
    net.Update()
    ng = ngsolve.Mesh(net)

    space = ngsolve.VectorH1(ng, order=2)
    one = ngsolve.H1(ng, order=2)
    keys = {tuple(sorted((c[i], c[j]))): c[corners + k] for c in mesh.cells.tolist() for k, (i, j) in enumerate(EDGES[mesh.kind])}
    # `at`: NGSolve's function of each node
    n, at = one.ndof, np.full(len(mesh.x), -1)
    at[vertices] = np.arange(len(vertices))
    # of the function of the edge, in the middle of the edge
    height = np.zeros(len(mesh.x))
    ends = np.zeros((len(mesh.x), 2), int)
    points = {v.nr: np.array(v.point) for v in ng.vertices}
    for edge in ng.edges:
        a, b = (v.nr for v in edge.vertices)
        node = keys[tuple(sorted((int(vertices[a]), int(vertices[b]))))]
        dof, = one.GetDofNrs(ngsolve.NodeId(ngsolve.EDGE, edge.nr))
        at[node], ends[node] = dof, (vertices[a], vertices[b])
        assert np.allclose(points[a], mesh.x[vertices[a]], atol=1e-15)
    # the height is the same on all edges except for the sign: measured on each element
    for element in ng.Elements(ngsolve.VOL):
        fel = one.GetFE(element)
        nrs = list(one.GetDofNrs(element))
        vs = [v.nr for v in element.vertices]
        reference = REFERENCE[corners]
        for i in range(corners):
            for j in range(i):
                node = keys.get(tuple(sorted((int(vertices[vs[i]]), int(vertices[vs[j]])))))
                if node is not None and not height[node]:
                    shape = np.array(fel.CalcShape(*(reference[i] + reference[j]) / 2))
                    height[node] = shape[nrs.index(at[node])]
    assert (at >= 0).all() and (height[at >= len(vertices)] != 0).all()

    mids = np.flatnonzero(height)
    straight = mesh.x.copy()
    straight[mids] = mesh.x[ends[mids]].mean(1)
    bent = mesh.x - straight
    if np.abs(bent).max() > 1e-12:
        field = ngsolve.GridFunction(space)
        coefficients = np.zeros((3, n))
        coefficients[:, at[mids]] = (bent[mids] / height[mids, None]).T
        field.vec.FV().NumPy()[:] = coefficients.ravel()
        ng.SetDeformation(field)
    u, v = space.TnT()
    lam, mu = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
    strain = lambda w: ngsolve.Sym(ngsolve.Grad(w))
    dx = ngsolve.dx(bonus_intorder=bonus)
    work = lam * ngsolve.Trace(strain(u)) * ngsolve.Trace(strain(v)) + 2 * mu * ngsolve.InnerProduct(strain(u), strain(v))
    out = []
    # From nodal values to coefficients: for an edge (middle - mean of its ends) / height
    rows, columns, values = [at[vertices]], [vertices], [np.ones(len(vertices))]
    for column, value in ((mids, 1.0), (ends[mids, 0], -0.5), (ends[mids, 1], -0.5)):
        rows.append(at[mids])
        columns.append(column)
        values.append(value / height[mids])
    P = sp.coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), (n, len(mesh.x)))
    P = sp.kron(P, sp.eye(3), "csr")                              # columns: three per node
    P = P[np.arange(3 * n).reshape(n, 3).T.ravel()]               # rows: blocks of x, y, z
    for form in (work, RHO * ngsolve.InnerProduct(u, v)):
        a = ngsolve.BilinearForm(space, symmetric=False)
        a += form * dx
        a.Assemble()
        r, c, value = (np.array(part) for part in a.mat.COO())
        A = P.T @ sp.coo_matrix((value, (r, c)), (3 * n, 3 * n)).tocsr() @ P
        out.append(((A + A.T) / 2).tocsr())
    return out


# Corners of NGSolve's reference elements
REFERENCE = {4: np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0)], float),
             8: (HEX_CORNERS + 1) / 2}


# ------------------------------------------------------------------------------------------ ties,
# solving
def cross(r):
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0.0]])


def rigid(x, nodes, place):
    """RBE2: displacement of the nodes (3 n) for the six motions of a frame, u = u_0 + theta x r."""
    R = np.zeros((len(nodes), 3, 6))
    R[:, :, :3] = np.eye(3)
    R[:, :, 3:] = [-cross(r) for r in x[nodes] - place]
    return R.reshape(-1, 6)


def mean(x, nodes, place):
    """RBE3 with equal weights: the motion (6) of a frame from the displacements of the nodes (3
    n)."""
    R = rigid(x, nodes, place)
    # Equal weights: least squares of the rigid motion, which is the mean displacement and the
    # least-squares rotation
    return np.linalg.solve(R.T @ R, R.T)


def tie_matrix(n_nodes, n_columns, pieces, held=()):
    """T with u = T q: free nodes one to one, then the six columns of each frame. pieces: (nodes,
    matrix (3 n x 6), frame number)."""
    tied = np.zeros(n_nodes, bool)
    for nodes in [p[0] for p in pieces] + list(held):
        tied[nodes] = True
    free = np.flatnonzero(np.repeat(~tied, 3))
    rows, columns, values = [free], [np.arange(len(free))], [np.ones(len(free))]
    for nodes, R, frame in pieces:
        r, c = np.nonzero(R)
        rows.append(dofs(nodes)[r])
        columns.append(len(free) + 6 * frame + c)
        values.append(R[r, c])
    shape = (3 * n_nodes, len(free) + 6 * n_columns)
    return sp.coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape).tocsr()


class Solver:
    """Factorisation of a symmetric positive matrix; solutions are refined with extended-precision
    residuals."""

    def __init__(self, K):
        self.long = sp.csr_matrix(K).astype(np.longdouble)
        self.long.sort_indices()
        self.K = self.long.astype(float)
        self.scale = 1 / np.sqrt(self.K.diagonal())
        D = sp.diags(self.scale)
        self.upper = sp.triu(D @ self.K @ D, format="csr")
        self.pardiso = pypardiso.PyPardisoSolver(mtype=2)
        self.pardiso.factorize(self.upper)

    def raw(self, f):
        scale = self.scale if f.ndim == 1 else self.scale[:, None]
        return scale * self.pardiso.solve(self.upper, np.asfortranarray(scale * f)).reshape(f.shape)

    def __call__(self, f, steps=3):
        f = np.asarray(f, float)
        u = self.raw(f).astype(np.longdouble)
        for _ in range(steps):
            u = u + self.raw(np.asarray(f - self.long @ u, float))
        return np.asarray(u, float)

    def frequencies(self, M, count):
        """Hz, by ARPACK on K^-1 M, then Rayleigh quotients."""
        operator = sl.LinearOperator(self.K.shape, matvec=lambda b: self.raw(np.asarray(b, float).ravel()), dtype=float)
        _, V = sl.eigsh(self.K, count, M.astype(float), sigma=0.0, OPinv=operator, tol=1e-13)
        value = np.array([v @ (self.long @ v) / (v @ (M @ v)) for v in V.T.astype(np.longdouble)], float)
        return np.sqrt(np.sort(value)) / (2 * np.pi)


# ----------------------------------------------------------------------------------------------
# comparing
def apart(a, b):
    """Maximum difference of two symmetric 6 x 6 matrices, entries over sqrt(d_i d_j)."""
    d = np.sqrt(np.abs(np.diag(b)))
    return float(np.abs((np.asarray(a) - b) / np.outer(d, d)).max())


def relative(a, b):
    """Maximum difference over the maximum entry of b, separately for displacements and rotations
    (..., 6)."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    if b.shape[-1] == 6:
        return max(relative(a[..., :3], b[..., :3]), relative(a[..., 3:], b[..., 3:]))
    return float(np.abs(a - b).max() / np.abs(b).max())


class LinkFile:
    """The same quantities from a .flex file."""

    def __init__(self, path):
        flex = tomllib.loads(Path(path).read_text())
        self.C_BB = np.linalg.inv(np.array(flex["stiffness"]["matrix"]))
        # A, B, modes
        self.K, self.M = (np.array(flex["superelement"][k]) for k in ("stiffness", "mass"))
        self.frequencies_hz = np.array([m["mesh_hz"] for m in flex["gate"]["modes"]])
        self.fixed_hz = np.array(flex["gate"]["fixed_frequencies_hz"])

    def weight(self, acceleration):
        """Load on A and B: rigid-body accelerations are among the shapes of the link, so this is
        exact."""
        return self.M[:12, :12] @ np.tile([*acceleration, 0, 0, 0], 2)

    def gravity(self, acceleration):
        return self.C_BB @ self.weight(acceleration)[6:]


def reduce(program, job, *flags):
    """Returns the link file that `flexarm reduce` currently writes, with settings different from
    the job's."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "link.flex"
        subprocess.run([program, "reduce", str(job), "--flex", str(path), "--quiet", *flags], check=True, capture_output=True)
        return LinkFile(path)


# ---------------------------------------------------------------------------------------------------
# JSON
def sha256(path):
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def head(what, program, script, meshes):
    return {"what": what, "program": program, "script": f"tools/crosscheck/{Path(script).name}", "date": DATE,
            "meshes": [{"file": str(Path(p).relative_to(ROOT)), "sha256": sha256(p)} for p in meshes],
            "units": "SI", "order": "ux uy uz rx ry rz"}


def listed(value, digits=12):
    """Converts to lists of floats with 12 digits. Round-off of zeros by symmetry is kept to show
    its size."""
    if isinstance(value, (np.ndarray, list, tuple)):
        return [listed(v, digits) for v in value]
    if isinstance(value, dict):
        return {k: listed(v, digits) for k, v in value.items()}
    if isinstance(value, (float, np.floating)):
        return float(f"{value:.{digits}g}")
    return value


def store(name, document):
    text = json.dumps(listed(document), indent=1)
    # innermost lists of numbers on one line
    text = re.sub(r"\[\s+(-?[\d.][^\[\]{}\"]*?)\s+\]", lambda m: "[" + re.sub(r"\s+", " ", m[1]) + "]", text)
    STORE.mkdir(parents=True, exist_ok=True)
    (STORE / name).write_text(text + "\n")
    print(f"wrote tests/verification/{name}: {len(text)} bytes")
