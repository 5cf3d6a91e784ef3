"""Stress of a swung beam by a full dynamic run of CalculiX, with large rotations.

    python tools/crosscheck/swing_stress_calculix.py

Writes tests/verification/swing_stress_calculix.json: von Mises stress at nodes of the mesh of beam_3 of
robots/test/three_beams over time. Its near face turns about z as prescribed, its far face carries 1 kg.
Needs ccx, gmsh, numpy, scipy and pypardiso; twelve minutes.
"""
import numpy as np

import fe_common as fe

MESH = fe.ROOT / "robots/test/three_beams/fe/beam_3.msh.gz"
LENGTH, ANGLE, TURN, END = 0.4, 0.3, 0.08, 0.1                    # m, rad, s, s
TIP_MASS, TIP_INERTIA = 1.0, 0.00036                              # kg, kg m2
ALPHA = 0.0                                                       # no numerical damping
STEPS = (4e-4, 2e-4)                                              # s
EVERY = 8e-4                                                      # s, samples that are stored
STATIONS = (0.1, 0.2, 0.3)                                      # m


def angle(t):
    """Returns the prescribed angle: from rest to rest, with continuous acceleration."""
    s = np.clip(np.asarray(t) / TURN, 0, 1)
    return ANGLE * (s - np.sin(2 * np.pi * s) / (2 * np.pi))


def corners(mesh):
    """Returns the outer corners of the rectangle at each station, as indices of nodes."""
    found = []
    for x in STATIONS:
        for y in (-1, 1):
            place = np.array([x, y * mesh.x[:, 1].max(), mesh.x[:, 2].max()])
            found.append(int(np.argmin(np.linalg.norm(mesh.x - place, axis=1))))
    return found


def stresses(frd):
    """Returns the blocks of a .frd file with stresses: time, and six components by node number."""
    blocks, t, rows = [], None, None
    for line in frd.decode(errors="replace").splitlines():
        if line.startswith("  100CL"):
            t = float(line[12:24])
        elif line.startswith(" -4  STRESS"):
            rows = {}
        elif rows is not None and line.startswith(" -1"):
            rows[int(line[3:13])] = np.array([float(line[13 + 12 * k:25 + 12 * k]) for k in range(6)])
        elif rows is not None and line.startswith(" -3"):
            blocks.append((t, rows))
            rows = None
    return blocks


def von_mises(s):
    xx, yy, zz, xy, yz, zx = s
    return np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * (xy ** 2 + yz ** 2 + zx ** 2))


def swing(mesh, nodes, step):
    """Returns times (s) and von Mises stress (Pa; times x nodes)."""
    n, cell = len(mesh.x), len(mesh.cells)
    lines = fe.deck(mesh) + fe.rigid_ties(mesh, [np.zeros(3), np.array([LENGTH, 0, 0])])
    # The rotation node has the rotations as its displacements: a mass on it is a rotary inertia.
    lines += ["*ELEMENT, TYPE=MASS, ELSET=BALL", f"{cell + 1}, {n + 3}", "*ELEMENT, TYPE=MASS, ELSET=SPIN", f"{cell + 2}, {n + 4}",
              "*MASS, ELSET=BALL", f"{TIP_MASS}", "*MASS, ELSET=SPIN", f"{TIP_INERTIA}"]
    lines += fe.numbered("*NSET, NSET=SEEN", [k + 1 for k in nodes])
    times = np.linspace(0, END, round(END / step) + 1)
    lines.append("*AMPLITUDE, NAME=ANGLE")
    lines += [f"{fe.short(t)}, {fe.short(a)}" for t, a in zip(times, angle(times))]
    lines += ["*BOUNDARY", f"{n + 1}, 1, 3", f"{n + 2}, 1, 2"]
    count = round(EVERY / step)
    lines += [f"*STEP, NLGEOM, INC={2 * len(times)}", f"*DYNAMIC, DIRECT, ALPHA={ALPHA}", f"{step!r}, {END!r}",
              "*BOUNDARY, AMPLITUDE=ANGLE", f"{n + 2}, 3, 3, 1.",
              f"*EL FILE, NSET=SEEN, FREQUENCY={count}", "S", "*END STEP"]
    blocks = stresses(fe.run_ccx(lines)[".frd"])
    return np.array([t for t, _ in blocks]), np.array([[von_mises(rows[k + 1]) for k in nodes] for _, rows in blocks])


def main():
    mesh = fe.read_mesh(MESH)
    nodes = corners(mesh)
    runs = []
    for step in STEPS:
        runs.append(swing(mesh, nodes, step))
        print(f"step {step:g} s: peak {runs[-1][1].max() / 1e6:.4f} MPa", flush=True)
    (t, coarse), (_, fine) = runs
    print(f"steps differ by {np.abs(coarse - fine).max() / fine.max():.1e} of the peak")
    # The average acceleration is of second order in the step.
    stress = fine + (fine - coarse) / 3
    what = ("Von Mises stress (Pa) of nodal averages at the outer corners of the rectangle of beam_3, HEX20, over time. Near face tied rigidly and turned about z by angle "
            "(s - sin(2 pi s)/(2 pi)), s = t/turn_s up to 1, about the origin; far face tied rigidly to 1 kg with 0.00036 kg m2 about each axis at its middle. No gravity, "
            "no damping; large rotations. C3D20, average acceleration, extrapolated from two steps. ")
    document = fe.head(what, "CalculiX 2.20", __file__, [MESH])
    fe.store("swing_stress_calculix.json", document | {
        "angle_rad": ANGLE, "turn_s": TURN, "tip_mass_kg": TIP_MASS, "tip_inertia_kg_m2": TIP_INERTIA, "steps_s": list(STEPS),
        "steps_differ_by": float(f"{np.abs(coarse - fine).max() / fine.max():.2g}"),
        "positions_m": mesh.x[nodes], "nodes": [k + 1 for k in nodes], "t_s": t, "von_mises_pa": [[float(f"{v:.6g}") for v in row] for row in stress]})


if __name__ == "__main__":
    main()
