"""The casting of robots/test/lower_arm by CalculiX and NGSolve: statics, gravity, frequencies.

    python tools/crosscheck/lower_arm.py [--program target/release/flexarm]

Statics use two kinds of ties. Writes tests/verification/lower_arm_calculix.json and
lower_arm_ngsolve.json and prints their differences from each other, from an own assembly, from
CalculiX's own solution with its own ties, and from robots/test/lower_arm/lower_arm.flex. The edges are
straight, so that the 4 points of C3D10 are exact for the stiffness, but not for the mass: gravity
loads are exact, frequencies have errors of 3e-5 and 6e-5.
"""
import argparse

import numpy as np
import scipy.sparse as sp

import fe_common as fe

FOLDER = fe.ROOT / "robots/test/lower_arm"
MESH = FOLDER / "lower_arm.msh.gz"
A_AT, B_AT = np.zeros(3), np.array([0.060, 0.150, 1.100])
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def rigid_ties(mesh, K, M):
    n = len(mesh.x)
    A, B = mesh.groups["interface_A"], mesh.groups["interface_B"]
    T = fe.tie_matrix(n, 1, [(B, fe.rigid(mesh.x, B, B_AT), 0)], [A])
    solver, M_held = fe.Solver(T.T @ K @ T), T.T @ M @ T
    f = np.zeros((T.shape[1], 6))
    f[-6:] = np.eye(6)
    C = solver(f)[-6:]
    weight = M @ np.column_stack([np.tile(d, n) * fe.GRAVITY for d in AXES.values()])
    sag = solver(T.T @ weight)[-6:]
    free = solver.frequencies(M_held, 10)
    fixed = fe.Solver(solver.long[:-6, :-6]).frequencies(M_held[:-6, :-6], 6)
    return {"C_BB": (C + C.T) / 2, "gravity": dict(zip(AXES, sag.T)), "frequencies_hz": free, "fixed_hz": fixed}


def distributing(mesh, K):
    """Returns C_BB with both seats tied by the mean of their nodes.

    Three nodes are held to make the problem determinate: loads on B and the reactions of A,
    distributed over their nodes, are in equilibrium and leave the held nodes without force. Then
    the whole body is moved rigidly so that the mean of A has no displacement.
    """
    n = len(mesh.x)
    A, B = mesh.groups["interface_A"], mesh.groups["interface_B"]
    G = []
    for nodes, place in ((A, A_AT), (B, B_AT)):
        g = np.zeros((6, 3 * n))
        g[:, fe.dofs(nodes)] = fe.mean(mesh.x, nodes, place)
        G.append(g)
    everywhere = fe.rigid(mesh.x, np.arange(n), A_AT)
    balance = (G[1] @ everywhere).T                             # wrench on B, seen from A
    f = G[1].T - G[0].T @ balance
    assert np.abs(everywhere.T @ f).max() < 1e-11
    far = np.argmax(np.linalg.norm(mesh.x - mesh.x[0], axis=1))
    line = mesh.x[far] - mesh.x[0]
    aside = np.argmax(np.linalg.norm(np.cross(mesh.x - mesh.x[0], line), axis=1))
    # on the distant node, the two directions most nearly across the line; on the third, the
    # direction out of their plane
    out = int(np.argmax(np.abs(np.cross(line, mesh.x[aside] - mesh.x[0]))))
    along = int(np.argmax(np.abs(line)))
    held = {0, 1, 2} | {3 * int(far) + d for d in range(3) if d != along} | {3 * int(aside) + out}
    keep = np.setdiff1d(np.arange(3 * n), list(held))
    u = np.zeros((3 * n, 6))
    u[keep] = fe.Solver(sp.csr_matrix(K)[keep][:, keep])(f[keep])
    C = G[1] @ (u - everywhere @ (G[0] @ u))
    assert fe.apart(C, C.T) < 1e-8
    return (C + C.T) / 2


def by_itself(mesh):
    n = len(mesh.x)
    base = fe.deck(mesh) + fe.rigid_ties(mesh, (A_AT, B_AT)) + ["*BOUNDARY", f"{n + 1}, 1, 3", f"{n + 2}, 1, 3"]
    lines = list(base)
    for k in range(6):
        lines += ["*STEP", "*STATIC", "*CLOAD, OP=NEW", f"{n + 3 + k // 3}, {k % 3 + 1}, 1.", "*NODE PRINT, NSET=TIP", "U", "*END STEP"]
    for d in AXES.values():
        lines += ["*STEP", "*STATIC", "*CLOAD, OP=NEW", f"{n + 3}, 1, 0.", "*DLOAD, OP=NEW",
                  f"BODY, GRAV, {fe.GRAVITY}, {d[0]}., {d[1]}., {d[2]}.", "*NODE PRINT, NSET=TIP", "U", "*END STEP"]
    u = np.array([t[:, 1:].ravel() for t in fe.ccx_numbers(fe.run_ccx(lines)[".dat"], "displacements")])
    kept = fe.run_ccx(base + ["*STEP", "*FREQUENCY, STORAGE=YES", "10", "*END STEP"])[".eig"]
    return u[:6].T, u[6:], np.sqrt(np.frombuffer(kept[16:96], np.float64)) / (2 * np.pi)


def differences(name, a, b):
    gravity = max(fe.relative(a["gravity"][d], b["gravity"][d]) for d in AXES)
    print(f"{name}: C_BB {fe.apart(a['C_BB'], b['C_BB']):.1e}, distributing {fe.apart(a['C_BB_distributing'], b['C_BB_distributing']):.1e}, "
          f"weight {gravity:.1e}, frequencies {np.abs(a['frequencies_hz'] / b['frequencies_hz'] - 1).max():.1e}, "
          f"fixed {np.abs(a['fixed_hz'] / b['fixed_hz'] - 1).max():.1e}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", help="flexarm, to reduce with the other tie and with CalculiX's points too")
    options = parser.parse_args()
    mesh = fe.read_mesh(MESH, 1e-3)
    results = {}
    for name, matrices in (("CalculiX", lambda: fe.ccx_matrices(mesh)), ("NGSolve", lambda: fe.ngsolve_matrices(mesh)),
                           ("own, 4 points", lambda: fe.assemble(mesh, 0, np.longdouble)), ("own, exact mass", lambda: fe.assemble(mesh, 4, np.longdouble))):
        K, M = matrices()
        results[name] = rigid_ties(mesh, K, M) | {"C_BB_distributing": distributing(mesh, K)}
        print(f"{name}: done", flush=True)
    for a, b in (("CalculiX", "own, 4 points"), ("NGSolve", "own, exact mass"), ("CalculiX", "NGSolve")):
        differences(f"{a} - {b}", results[a], results[b])
    job = FOLDER / "lower_arm.reduce.toml"
    links = {"exact": (fe.LinkFile(FOLDER / "lower_arm.flex"), "NGSolve")}
    if options.program:
        links["4 points"] = (fe.reduce(options.program, job, "--quadrature", "calculix"), "CalculiX")
        soft = fe.reduce(options.program, job, "--tie", "distributing").C_BB
        for name in ("NGSolve", "CalculiX"):
            print(f"flexarm reduce - {name}: distributing {fe.apart(soft, results[name]['C_BB_distributing']):.1e}")
    for rule, (link, name) in links.items():
        other = results[name]
        gravity = max(fe.relative(link.gravity(fe.GRAVITY * np.array(d)), other["gravity"][k]) for k, d in AXES.items())
        hertz = [np.abs(a[:n] / b[:n] - 1).max() for a, b in ((link.frequencies_hz, other["frequencies_hz"]), (link.fixed_hz, other["fixed_hz"]))
                 for n in [min(len(a), len(b))]]
        print(f"flexarm reduce ({rule}) - {name}: C_BB {fe.apart(link.C_BB, other['C_BB']):.1e}, weight {gravity:.1e}, frequencies {hertz[0]:.1e}, "
              f"fixed {hertz[1]:.1e}")

    common = ("The casting of robots/test/lower_arm (TET10, straight edges, 4 points integrate the stiffness exactly). Seats interface_A and interface_B tied to (0, 0, 0) "
              "and (0.06, 0.15, 1.1) m. C_BB: motion of B (rows) by unit loads on B (columns), A held, rigid ties (RBE2); C_BB_distributing: both ties by the "
              "mean of the nodes with equal weights (RBE3). gravity: motion of B under 9.81 m/s2 along +x, +y, +z, A held, casting alone, rigid ties. "
              "frequencies_hz: A held, B free; fixed_hz: both held; rigid ties. ")
    ties = "Ties, condensation of the program's own K and M and solution with refinement by numpy and pardiso."
    for key, program, mass in (("CalculiX", "CalculiX 2.20", "C3D10 integrates the mass with 4 points: exact for weight, not for frequencies "
                                "(3e-5 held at A, 6e-5 held at both). "), ("NGSolve", "NGSolve 6.2.2608", "Stiffness and mass integrated exactly. ")):
        document = fe.head(common + mass + ties, program, __file__, [MESH])
        document["digits"] = {"C_BB": 1e-9, "C_BB_distributing": 1e-9, "gravity": 1e-9, "frequencies_hz": 1e-9, "fixed_hz": 1e-9}
        document["digits_note"] = fe.DIGITS_NOTE
        fe.store(f"lower_arm_{key.lower()}.json", document | results[key])

    C, sag, hertz = by_itself(mesh)
    truth = results["CalculiX"]
    print(f"CalculiX's matrices - CalculiX by itself: C_BB {fe.apart(truth['C_BB'], C):.1e}, weight "
          f"{max(fe.relative(s, truth['gravity'][d]) for s, d in zip(sag, AXES)):.1e}, frequencies {np.abs(hertz / truth['frequencies_hz'] - 1).max():.1e}")


if __name__ == "__main__":
    main()
