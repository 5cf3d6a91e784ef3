"""Baseline without flexarm: Guyan and fixed-interface modes of a TET10 mesh by numpy.

Needs gmsh, scipy, pypardiso.

    OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 python tools/reduction_baseline.py MESH [--unit 1e-3] [--modes 20]

One thread, CPU seconds of each stage, peak memory, first frequencies; faces interface_A and
interface_B are tied rigidly at the mean of their nodes, aluminium, 4-point rule. To be compared, in
one run on one machine, with

    flexarm reduce MESH --units mm-t-s --material aluminium --interface A=interface_A --interface B=interface_B \
        --at A=centroid --at B=centroid --quadrature calculix --modes 20 --json
"""
import argparse
import gzip
import resource
import tempfile
import time

import gmsh
import numpy as np
import pypardiso
import scipy.sparse as sp
import scipy.sparse.linalg as sl

E, NU, RHO = 70e9, 0.33, 2700.0
EDGES = ((0, 1), (1, 2), (2, 0), (3, 0), (3, 2), (3, 1))            # node order of Gmsh


class Stages:
    def __init__(self):
        self.last = time.process_time()

    def end(self, name):
        now = time.process_time()
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        print(f"{name:40s} {now - self.last:8.2f} CPU s   peak {peak:5.2f} GB", flush=True)
        self.last = now


def read(path, unit):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    if path.endswith(".gz"):
        with tempfile.NamedTemporaryFile(suffix=".msh") as plain:
            plain.write(gzip.decompress(open(path, "rb").read()))
            plain.flush()
            gmsh.merge(plain.name)
    else:
        gmsh.merge(path)
    tags, x, _ = gmsh.model.mesh.getNodes()
    index = np.zeros(int(tags.max()) + 1, np.int64)
    index[tags] = np.arange(len(tags))
    groups = {}
    for dim, group in gmsh.model.getPhysicalGroups():
        entities = gmsh.model.getEntitiesForPhysicalGroup(dim, group)
        nodes = np.concatenate([gmsh.model.mesh.getElements(dim, e)[2][0] for e in entities])
        groups[gmsh.model.getPhysicalName(dim, group)] = index[nodes].reshape(-1, 10 if dim == 3 else 6)
    gmsh.finalize()
    return x.reshape(-1, 3) * unit, groups


def shapes(points):
    """Shape functions and their derivatives at reference points: (points, 10), (points, 10, 3)."""
    L = np.column_stack([1 - points.sum(1), points])
    dL = np.vstack([-np.ones(3), np.eye(3)])
    N = np.hstack([L * (2 * L - 1), np.column_stack([4 * L[:, i] * L[:, j] for i, j in EDGES])])
    edges = np.stack([4 * (L[:, i, None] * dL[j] + L[:, j, None] * dL[i]) for i, j in EDGES], 1)
    return N, np.concatenate([(4 * L - 1)[:, :, None] * dL, edges], 1)


def assemble(x, elements, chunk=20_000):
    lam, mu = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
    points = np.full((4, 3), (5 - 5**0.5) / 20) + np.vstack([np.zeros(3), np.eye(3) * 5**0.5 / 5])
    N, D = shapes(points)
    K = sp.csr_matrix((3 * len(x), 3 * len(x)))
    M = sp.csr_matrix((len(x), len(x)))
    for start in range(0, len(elements), chunk):
        t = elements[start:start + chunk]
        J = np.einsum("eai,gaj->egij", x[t], D)
        w = np.linalg.det(J) / 24
        B = np.einsum("gaj,egji->egai", D, np.linalg.inv(J))
        S = np.einsum("egai,egbj,eg->eaibj", B, B, w, optimize=True)
        trace = np.einsum("eaibi->eab", S)
        k = lam * S + mu * S.transpose(0, 1, 4, 3, 2) + mu * trace[:, :, None, :, None] * np.eye(3)[None, None, :, None, :]
        dofs = (3 * t[:, :, None] + np.arange(3)).reshape(len(t), 30).astype(np.int32)
        rows, columns = np.repeat(dofs, 30, 1).ravel(), np.tile(dofs, (1, 30)).ravel()
        K = K + sp.coo_matrix((k.ravel(), (rows, columns)), K.shape).tocsr()
        m = RHO * np.einsum("ga,gb,eg->eab", N, N, w)
        M = M + sp.coo_matrix((m.ravel(), (np.repeat(t, 10, 1).ravel(), np.tile(t, (1, 10)).ravel())), M.shape).tocsr()
    return K, sp.kron(M, sp.eye(3), "csr")


def tie(x, nodes, frame):
    """Displacement of the nodes for the six motions of a frame: u = u_0 + theta x r."""
    R = np.zeros((len(nodes), 3, 6))
    R[:, range(3), range(3)] = 1
    r = x[nodes] - frame
    R[:, 0, 4], R[:, 0, 5], R[:, 1, 3], R[:, 1, 5], R[:, 2, 3], R[:, 2, 4] = r[:, 2], -r[:, 1], -r[:, 2], r[:, 0], r[:, 1], -r[:, 0]
    return R.reshape(-1, 6)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("mesh")
    parser.add_argument("--unit", type=float, default=1e-3, help="unit of length, m")
    parser.add_argument("--modes", type=int, default=20)
    options = parser.parse_args()
    stages = Stages()
    x, groups = read(options.mesh, options.unit)
    stages.end("read (gmsh)")
    K, M = assemble(x, groups["body"])
    stages.end(f"assembly (numpy), {K.shape[0]} DoF")

    sets = [np.unique(groups[name]) for name in ("interface_A", "interface_B")]
    tied = np.zeros(len(x), bool)
    B = np.zeros((K.shape[0], 12))
    for k, nodes in enumerate(sets):
        tied[nodes] = True
        B[(3 * nodes[:, None] + np.arange(3)).ravel(), 6 * k:6 * k + 6] = tie(x, nodes, x[nodes].mean(0))
    free = np.flatnonzero(np.repeat(~tied, 3))
    K_ii, M_ii = K[free][:, free], M[free][:, free]
    solver = pypardiso.PyPardisoSolver(mtype=2)
    upper = sp.triu(K_ii, format="csr")
    solver.factorize(upper)
    solve = lambda b: solver.solve(upper, np.asfortranarray(b))
    stages.end("factor (MKL Pardiso)")
    T = B.copy()
    T[free] = -solve((K @ B)[free])
    K_g = T.T @ (K @ T)
    stages.end("Guyan")
    omega2, _ = sl.eigsh(K_ii, options.modes, M_ii, sigma=0.0, OPinv=sl.LinearOperator(K_ii.shape, matvec=solve, dtype=float))
    stages.end(f"{options.modes} fixed-interface modes (ARPACK)")
    C = np.linalg.inv(K_g[6:, 6:])
    print("diagonal of the compliance", " ".join(f"{c:.9e}" for c in C.diagonal()))
    print("fixed-interface modes (Hz)", " ".join(f"{f:.4f}" for f in np.sqrt(np.sort(omega2)[:6]) / (2 * np.pi)))
    print(f"in all {time.process_time():.1f} CPU s")


if __name__ == "__main__":
    main()
