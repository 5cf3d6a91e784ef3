"""The meshed arm of robots/test/three_beams by CalculiX and NGSolve: compliance, sag, frequencies.

    python tools/crosscheck/three_beams_calculix.py

Writes tests/verification/three_beams_calculix.json and three_beams_ngsolve.json and prints their
differences from each other, from an own assembly, from CalculiX's own solution of the whole with
its own ties, and from the link files. At a corner both faces are tied rigidly to one node. The tube
is curved: CalculiX uses 3x3x3 points there, which do not integrate curved elements exactly;
NGSolve's rule does to rounding. Box and rectangle are the same in both.
"""
import numpy as np
import scipy.linalg
import scipy.sparse as sp

import fe_common as fe

FOLDER = fe.ROOT / "robots/test/three_beams/fe"
FILES = [FOLDER / f"beam_{k}.msh.gz" for k in (1, 2, 3)]
TURN = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])              # frame of beam_3 in world axes
PLACES = [(np.eye(3), np.zeros(3)), (np.eye(3), np.array([0, 0, 0.8])), (TURN, np.array([0.6, 0, 0.8]))]
# corners, tip
FRAMES = [np.array([0, 0, 0.8]), np.array([0.6, 0, 0.8]), np.array([0.6, 0.4, 0.8])]
TIP_MASS, TIP_INERTIA = 1.0, 0.00036


def meshes():
    out = []
    for path, (R, p) in zip(FILES, PLACES):
        mesh = fe.read_mesh(path)
        out.append(mesh._replace(x=mesh.x @ R.T + p))
    return out


def solve(parts, matrices):
    K = sp.block_diag([m[0] for m in matrices], "csr")
    M = sp.block_diag([m[1] for m in matrices], "csr")
    starts = np.cumsum([0] + [len(m.x) for m in parts])
    x = np.vstack([m.x for m in parts])
    A = [m.groups["interface_A"] + s for m, s in zip(parts, starts)]
    B = [m.groups["interface_B"] + s for m, s in zip(parts, starts)]
    pieces = [(nodes, fe.rigid(x, nodes, FRAMES[k]), k) for k in range(3) for nodes in [B[k]] + ([A[k + 1]] if k < 2 else [])]
    T = fe.tie_matrix(len(x), 3, pieces, [A[0]])
    solver = fe.Solver(T.T @ K @ T)
    n = T.shape[1]
    f = np.zeros((n, 7))
    f[-6:, :6] = np.eye(6)
    f[:, 6] = T.T @ (M @ np.tile([0, 0, -fe.GRAVITY], len(x)))
    f[-4, 6] -= TIP_MASS * fe.GRAVITY
    u = solver(f)[-6:]
    ball = np.zeros(n)
    ball[-6:] = [TIP_MASS] * 3 + [TIP_INERTIA] * 3
    C = u[:, :6]
    return {"C_tip": (C + C.T) / 2, "sag": u[:, 6], "frequencies_hz": solver.frequencies(T.T @ M @ T + sp.diags(ball), 8)}


def by_itself(parts):
    lines, first, cell = [], 0, 0
    for k, mesh in enumerate(parts):
        lines += fe.deck(mesh, first, cell, str(k + 1))
        first, cell = first + len(mesh.x), cell + len(mesh.cells)
    n = first
    frames = [np.zeros(3), *FRAMES]
    numbered = [(n + 2 * k + j + 1, place) for k, place in enumerate(frames) for j in (0, 1)]
    lines += ["*NODE"] + [f"{node}, " + ", ".join(fe.short(v) for v in place) for node, place in numbered]
    lines += ["*NSET, NSET=TIE0", "INTERFACE_A1", "*NSET, NSET=TIE1", "INTERFACE_B1, INTERFACE_A2", "*NSET, NSET=TIE2", "INTERFACE_B2, INTERFACE_A3",
              "*NSET, NSET=TIE3", "INTERFACE_B3"]
    lines += [f"*RIGID BODY, NSET=TIE{k}, REF NODE={n + 2 * k + 1}, ROT NODE={n + 2 * k + 2}" for k in range(4)]
    tip, turn = n + 7, n + 8
    # the rotation node has the rotations as its displacements: a mass on it is a rotary inertia
    lines += ["*ELEMENT, TYPE=MASS, ELSET=BALL", f"{cell + 1}, {tip}", "*ELEMENT, TYPE=MASS, ELSET=SPIN", f"{cell + 2}, {turn}",
              "*MASS, ELSET=BALL", f"{TIP_MASS}", "*MASS, ELSET=SPIN", f"{TIP_INERTIA}"]
    lines += fe.numbered("*NSET, NSET=TIP", [tip, turn]) + ["*ELSET, ELSET=SOLID", "BODY1, BODY2, BODY3"]
    lines += ["*BOUNDARY", f"{n + 1}, 1, 3", f"{n + 2}, 1, 3"]
    base = list(lines)
    for k in range(6):
        lines += ["*STEP", "*STATIC", "*CLOAD, OP=NEW", f"{tip + k // 3}, {k % 3 + 1}, 1.", "*NODE PRINT, NSET=TIP", "U", "*END STEP"]
    lines += ["*STEP", "*STATIC", "*CLOAD, OP=NEW", f"{tip}, 3, {-TIP_MASS * fe.GRAVITY}", "*DLOAD, OP=NEW", f"SOLID, GRAV, {fe.GRAVITY}, 0., 0., -1.",
              "*NODE PRINT, NSET=TIP", "U", "*END STEP"]
    u = np.array([t[:, 1:].ravel() for t in fe.ccx_numbers(fe.run_ccx(lines)[".dat"], "displacements")])
    kept = fe.run_ccx(base + ["*STEP", "*FREQUENCY, STORAGE=YES", "8", "*END STEP"])[".eig"]
    return {"C_tip": u[:6].T, "sag": u[6], "frequencies_hz": np.sqrt(np.frombuffer(kept[16:80], np.float64)) / (2 * np.pi)}


def from_link_files():
    """The same from the Craig-Bampton models of the three .flex files: statics exact, frequencies
    slightly high."""
    links = [fe.LinkFile(FOLDER / f"beam_{k}.flex") for k in (1, 2, 3)]
    n = 24 + sum(len(link.K) - 12 for link in links)
    K, M, f, first = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n), 24
    for k, (link, (R, _)) in enumerate(zip(links, PLACES)):
        modes = len(link.K) - 12
        turn = np.eye(12 + modes)
        turn[:12, :12] = np.kron(np.eye(4), R)
        place = np.r_[6 * k:6 * k + 12, first:first + modes]
        first += modes
        K[np.ix_(place, place)] += turn @ link.K @ turn.T
        M[np.ix_(place, place)] += turn @ link.M @ turn.T
        f[6 * k:6 * k + 12] += turn[:12, :12] @ link.weight(R.T @ [0, 0, -fe.GRAVITY])
    f[20] -= TIP_MASS * fe.GRAVITY
    M[range(18, 24), range(18, 24)] += [TIP_MASS] * 3 + [TIP_INERTIA] * 3
    C = np.linalg.inv(K[6:24, 6:24])
    values = scipy.linalg.eigh(K[6:, 6:], M[6:, 6:], eigvals_only=True)[:8]
    return {"C_tip": C[12:, 12:], "sag": (C @ f[6:24])[12:], "frequencies_hz": np.sqrt(values) / (2 * np.pi)}


def differences(name, a, b):
    print(f"{name}: C_tip {fe.apart(a['C_tip'], b['C_tip']):.1e}, sag {fe.relative(a['sag'], b['sag']):.1e}, "
          f"frequencies {np.abs(a['frequencies_hz'] / b['frequencies_hz'] - 1).max():.1e}", flush=True)


def main():
    parts = meshes()
    results = {}
    routes = {"CalculiX": fe.ccx_matrices, "NGSolve": fe.ngsolve_matrices,
              "own, 3x3x3": lambda m: fe.assemble(m, 3, np.longdouble), "own, 6x6x6": lambda m: fe.assemble(m, 6, np.longdouble)}
    for name, matrices in routes.items():
        found = [matrices(m) for m in parts]
        results[name] = solve(parts, found)
        print(f"{name}: masses {' '.join(f'{M.sum() / 3:.12g}' for _, M in found)} kg", flush=True)
    for a, b in (("CalculiX", "own, 3x3x3"), ("NGSolve", "own, 6x6x6"), ("CalculiX", "NGSolve"), ("own, 3x3x3", "own, 6x6x6")):
        differences(f"{a} - {b}", results[a], results[b])
    differences("CalculiX's matrices - CalculiX by itself", results["CalculiX"], by_itself(parts))
    links = from_link_files()
    for name, other in results.items():
        differences(f"flexarm reduce (ten modes) - {name}", links, other)
    what = ("The three beams of robots/test/three_beams at q = 0 as one mesh of HEX20, axes of the world. Both faces at a corner tied rigidly (RBE2) to one node at the "
            "joint, near end of beam_1 held, far end of beam_3 tied to the tip, (0.6, 0.4, 0.8) m. C_tip: motion of the tip (rows) by unit loads on it "
            "(columns). sag: motion of the tip by 9.81 m/s2 along -z on the beams and on a point mass of 1 kg at the tip. frequencies_hz: with that mass and "
            "0.00036 kg m2 about each axis. ")
    for key, program, digits, rule in (
            ("CalculiX", "CalculiX 2.20", (1e-8, 3e-9, 3e-9), "C3D20 takes 3x3x3 points: in the curved elements of the tube not exact, 1.2e-8 of C_tip. "),
            ("NGSolve", "NGSolve 6.2.2608", (2e-8, 2e-9, 5e-9), "Serendipity functions, integrated to rounding in the curved elements too. ")):
        document = fe.head(what + rule + "Ties and solution with refinement by numpy and pardiso from the program's own K and M.", program, __file__, FILES)
        document["digits"] = dict(zip(("C_tip", "sag", "frequencies_hz"), digits))
        document["digits_note"] = fe.DIGITS_NOTE
        fe.store(f"three_beams_{key.lower()}.json", document | results[key])


if __name__ == "__main__":
    main()
