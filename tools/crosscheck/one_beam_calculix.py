"""The bar of robots/test/one_beam by CalculiX: statics, gravity, frequencies, large deflections.

    python tools/crosscheck/one_beam_calculix.py [--skip-large]

Writes tests/verification/one_beam_calculix.json and prints the differences of CalculiX from
NGSolve, from an own assembly, from CalculiX's own solution with its own ties, and from
robots/test/one_beam/fe/one_beam.flex. Stations: a unit load is distributed over a section of nodes like
an RBE3 with equal weights, and the motion of the section is the mean of its nodes (mean
displacement, least-squares rotation).
"""
import argparse

import numpy as np
from scipy.integrate import solve_bvp

import fe_common as fe
import large_bar

MESH = fe.ROOT / "robots/test/one_beam/fe/one_beam.msh"
LENGTH, EI = 0.8, 70e9 * 0.02 * 0.04**3 / 12
A_AT, B_AT = np.zeros(3), np.array([LENGTH, 0, 0])
STATIONS = (0.2, 0.4, 0.6)
LOADS = {"Fy": 1, "Fz": 2, "My": 4, "Mz": 5}
DIRECTIONS = {"-x": (-1, 0, 0), "-y": (0, -1, 0), "-z": (0, 0, -1)}
FORCES = (100.0, 200.0, 500.0, 1000.0, 2000.0, 3000.0, 5000.0, 10000.0, 20000.0, 30000.0)


def section(mesh, x):
    return np.flatnonzero(np.abs(mesh.x[:, 0] - x) < 1e-9)


def linear(mesh, K, M):
    """Computes all linear cases with the given matrices: a dictionary as it is stored."""
    n = len(mesh.x)
    A, B = mesh.groups["interface_A"], mesh.groups["interface_B"]
    T = fe.tie_matrix(n, 1, [(B, fe.rigid(mesh.x, B, B_AT), 0)], [A])
    solver = fe.Solver(T.T @ K @ T)
    f = np.zeros((T.shape[1], 6))
    f[-6:] = np.eye(6)
    C = solver(f)[-6:]

    means = {x: fe.mean(mesh.x, section(mesh, x), np.array([x, 0, 0])) for x in STATIONS}
    cases = [(x, name) for x in STATIONS for name in LOADS]
    f = np.zeros((3 * n, len(cases)))
    for k, (x, name) in enumerate(cases):
        f[fe.dofs(section(mesh, x)), k] = means[x][LOADS[name]]
    q = solver(T.T @ f)
    u = T @ q
    stations = [{"x": x, "load": name,
                 "at": [{"x": y, "u": means[y] @ u[fe.dofs(section(mesh, y)), k]} for y in STATIONS] + [{"x": LENGTH, "u": q[-6:, k]}]}
                for k, (x, name) in enumerate(cases)]

    weight = M @ np.column_stack([np.tile(d, n) * fe.GRAVITY for d in DIRECTIONS.values()])
    sag = solver(T.T @ weight)[-6:]
    return {"C_BB": (C + C.T) / 2, "station_loads": stations, "gravity": dict(zip(DIRECTIONS, sag.T)),
            "frequencies_hz": solver.frequencies(T.T @ M @ T, 8)}


def by_itself(mesh):
    """C_BB, gravity and frequencies of CalculiX with its own ties and solver: statics to the seven
    printed digits."""
    n = len(mesh.x)
    base = fe.deck(mesh) + fe.rigid_ties(mesh, (A_AT, B_AT)) + ["*BOUNDARY", f"{n + 1}, 1, 3", f"{n + 2}, 1, 3"]
    lines = list(base)
    for k in range(6):
        lines += ["*STEP", "*STATIC", "*CLOAD, OP=NEW", f"{n + 3 + k // 3}, {k % 3 + 1}, 1.", "*NODE PRINT, NSET=TIP", "U", "*END STEP"]
    # a zero load, otherwise the last unit load would remain
    for d in ("-1., 0., 0.", "0., -1., 0.", "0., 0., -1."):
        lines += ["*STEP", "*STATIC", "*CLOAD, OP=NEW", f"{n + 3}, 1, 0.", "*DLOAD, OP=NEW", f"BODY, GRAV, {fe.GRAVITY}, {d}",
                  "*NODE PRINT, NSET=TIP", "U", "*END STEP"]
    tables = fe.ccx_numbers(fe.run_ccx(lines)[".dat"], "displacements")
    u = np.array([t[:, 1:].ravel() for t in tables])
    kept = fe.run_ccx(base + ["*STEP", "*FREQUENCY, STORAGE=YES", "8", "*END STEP"])[".eig"]
    values = np.frombuffer(kept[16:16 + 64], np.float64)
    return u[:6].T, u[6:], np.sqrt(values) / (2 * np.pi)


def elastica(force):
    """Inextensible Euler-Bernoulli bar, dead force: tip (along, up), slope at the tip, middle
    (along, up)."""
    load = force / EI

    def rhs(s, y):                                     # slope, curvature, x, z
        return np.vstack([y[1], -load * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    s = np.linspace(0, LENGTH, 81)
    guess = np.vstack([load * (LENGTH * s - s**2 / 2) / (1 + load * 0.3), load * (LENGTH - s) / (1 + load * 0.3), s, 0 * s])
    found = solve_bvp(rhs, lambda a, b: np.array([a[0], b[1], a[2], a[3]]), s, guess, tol=1e-10, max_nodes=100000)
    assert found.success, force
    tip, mid = found.sol(LENGTH), found.sol(LENGTH / 2)
    return tip[2] - LENGTH, tip[3], tip[0], mid[2] - LENGTH / 2, mid[3]


def compare(name, a, b):
    stations = lambda d: np.array([at["u"] for load in d["station_loads"] for at in load["at"]])
    gravity = lambda d: np.array(list(d["gravity"].values()))
    print(f"{name}: C_BB {fe.apart(a['C_BB'], b['C_BB']):.1e}, stations {by_load(stations(a), stations(b)):.1e}, weight "
          f"{by_load(gravity(a), gravity(b)):.1e}, frequencies {np.abs(a['frequencies_hz'] / b['frequencies_hz'] - 1).max():.1e}")


def by_load(a, b):
    """Maximum error of the loads, each over its own maximum entry; zeros by symmetry over that of
    all loads."""
    worst = 0.0
    for part in (slice(0, 3), slice(3, 6)):                        # displacements, rotations
        u, v = a.reshape(-1, 6)[:, part], b.reshape(-1, 6)[:, part]
        own = np.abs(v).max(1, keepdims=True)
        zero = np.abs(v) < 1e-6 * own
        zero |= own < 1e-6 * np.abs(v).max()
        worst = max(worst, (np.abs(u - v) / np.where(zero, np.abs(v).max(), own)).max())
    return worst


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--skip-large", action="store_true", help="only the linear cases, nothing is written")
    options = parser.parse_args()
    mesh = fe.read_mesh(MESH)
    K, M = fe.ccx_matrices(mesh)
    truth = linear(mesh, K, M)
    own = linear(mesh, *fe.assemble(mesh, 3, np.longdouble))
    compare("CalculiX - own assembly", truth, own)
    compare("NGSolve - own assembly", linear(mesh, *fe.ngsolve_matrices(mesh)), own)
    C, sag, hertz = by_itself(mesh)
    print(f"CalculiX's matrices - CalculiX by itself: C_BB {fe.apart(truth['C_BB'], C):.1e}, weight "
          f"{by_load(sag, np.array(list(truth['gravity'].values()))):.1e}, frequencies {np.abs(hertz / truth['frequencies_hz'] - 1).max():.1e}")
    link = fe.LinkFile(MESH.with_suffix(".flex"))
    sag = np.array([link.gravity(fe.GRAVITY * np.array(d)) for d in DIRECTIONS.values()])
    for name, other in (("CalculiX", truth), ("own assembly", own)):
        print(f"flexarm reduce - {name}: C_BB {fe.apart(link.C_BB, other['C_BB']):.1e}, weight {by_load(sag, np.array(list(other['gravity'].values()))):.1e}, "
              f"frequencies {np.abs(link.frequencies_hz[:8] / other['frequencies_hz'][:len(link.frequencies_hz)] - 1).max():.1e}")
    if options.skip_large:
        return
    rows = large_bar.calculix(mesh, FORCES)
    own = large_bar.own(mesh, FORCES)
    softness = truth["C_BB"][2, 2] / (LENGTH**3 / (3 * EI))
    print("force N, tip x, z (m), turn about y; own program; elastica")
    for row, other in zip(rows, own):
        x, z, turn, _, mid_z = elastica(row["force_n"])
        u = row["u_B"]
        print(f"{row['force_n']:8.0f} {u[0]:+.9f} {u[2]:+.9f} {row['rotation_B'][1]:+.9f}; "
              f"{fe.relative(u, other['u_B']):.1e} {fe.relative(row['rotation_B'], other['rotation_B']):.1e} "
              f"{fe.relative(row['u_mid'], other['u_mid']):.1e}; x {u[0] / x - 1:+.2e} z {u[2] / z - 1:+.2e} turn {-row['rotation_B'][1] / turn - 1:+.2e} "
              f"mid z {row['u_mid'][2] / mid_z - 1:+.2e}; z, elastica as soft as the mesh {u[2] / elastica(row['force_n'] * softness)[1] - 1:+.2e}; "
              f"linear {u[2] / (row['force_n'] * truth['C_BB'][2, 2]) - 1:+.2e}")
    what = ("The bar of robots/test/one_beam as 40 x 2 x 2 HEX20 (C3D20, 3x3x3 points), both ends tied rigidly (RBE2) to the middles of their faces, A held. "
            "C_BB: motion of B (rows) by unit loads on B (columns). station_loads: unit loads on sections, spread over their nodes as an RBE3 with equal "
            "weights does; motions are the means of the nodes, at 0.8 that of B. gravity: motion of B by 9.81 m/s2. large_load: *STATIC with NLGEOM (linear "
            "stress and Green strain), force along z that keeps its direction on B; rotation_B: rotation vector; u_mid: mean displacement at x = 0.4")
    document = fe.head(what, "CalculiX 2.20", __file__, [MESH])
    document["digits"] = {"linear": 3e-9, "frequencies_hz": 1e-9, "large_load": large_bar.DIGITS}
    document["digits_note"] = fe.DIGITS_NOTE + "; large_load: with an own program"
    document |= truth
    document["large_load"] = rows
    fe.store("one_beam_calculix.json", document)


if __name__ == "__main__":
    main()
