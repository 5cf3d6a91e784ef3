"""Large deflections of a clamped HEX20 bar under a dead load: CalculiX, and an own program.

Both: linear law between Green strain and second Piola-Kirchhoff stress, 3x3x3 points, far end
rigid, near end held. CalculiX prints seven digits, so it runs twice: in the second run extra nodes
are tied to (requested result) - (result printed in the first run), with the printed number
prescribed on another node, and the small difference is printed to seven digits.
"""
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sl

import fe_common as fe

DIGITS = 1e-9
LENGTH = 0.8


def middle(mesh):
    return np.flatnonzero(np.abs(mesh.x[:, 0] - LENGTH / 2) < 1e-9)


# ----------------------------------------------------------------------------------------------
# CalculiX
def calculix_run(mesh, forces, known):
    """Returns rows of 9 numbers (u_B, rotation_B, u_mid) minus those in `known` (forces x 9), as
    printed."""
    n = len(mesh.x)
    tip, turn = n + 3, n + 4
    asked, constant = n + 10, n + 20                     # three nodes each: u_B, rotation_B, u_mid
    lines = fe.deck(mesh) + fe.rigid_ties(mesh, (np.zeros(3), np.array([LENGTH, 0, 0])))
    lines += ["*NODE"] + [f"{base + k}, 0., 1., {k}." for base in (asked, constant) for k in range(3)]
    lines += fe.numbered("*NSET, NSET=ASKED", range(asked, asked + 3))
    mid = middle(mesh)
    for d in (1, 2, 3):
        for k, terms in enumerate(([(tip, d, -1.0)], [(turn, d, -1.0)], [(int(m) + 1, d, -1 / len(mid)) for m in mid])):
            terms = [(asked + k, d, 1.0), *terms, (constant + k, d, 1.0)]
            lines += ["*EQUATION", str(len(terms))]
            for start in range(0, len(terms), 4):
                lines.append(", ".join(f"{a}, {b}, {c!r}" for a, b, c in terms[start:start + 4]))
    lines += ["*BOUNDARY", f"{n + 1}, 1, 3", f"{n + 2}, 1, 3"]
    for force, values in zip(forces, known):
        lines += ["*STEP, NLGEOM, INC=1000", "*STATIC", "0.25, 1., 1e-6, 0.25",
                  "*CONTROLS, PARAMETERS=FIELD", "1e-10, 1e-9, , , 1., 1e-14, 1e-9, 1e-9",
                  "*CONTROLS, PARAMETERS=TIME INCREMENTATION", "20, 40, 30, 60, 30, 4, , 30"]
        lines += ["*BOUNDARY"] + [f"{constant + k}, {d + 1}, {d + 1}, {float(values[3 * k + d])!r}" for k in range(3) for d in range(3)]
        lines += ["*CLOAD", f"{tip}, 3, {force!r}", "*NODE PRINT, NSET=ASKED, FREQUENCY=1000", "U", "*END STEP"]
    tables = fe.ccx_numbers(fe.run_ccx(lines)[".dat"], "displacements")
    assert len(tables) == len(forces), len(tables)
    return np.array([t[:, 1:].ravel() for t in tables])


def calculix(mesh, forces):
    first = calculix_run(mesh, forces, np.zeros((len(forces), 9)))
    rest = calculix_run(mesh, forces, first)
    print(f"CalculiX, second run: at most {np.abs(rest).max():.1e} left of the first")
    return [{"force_n": force, "u_B": row[:3], "rotation_B": row[3:6], "u_mid": row[6:]} for force, row in zip(forces, first + rest)]


# ------------------------------------------------------------------------------------------- own
# program
class Bar:
    """Residual and tangent of the bar. Unknowns: free nodes, then u_x, u_z of B and its rotation
    about y."""

    def __init__(self, mesh):
        self.mesh = mesh
        p, w = fe.brick_rule(3)
        _, D = fe.hex20(p)
        J = np.einsum("eai,gaj->egij", mesh.x[mesh.cells], D)
        self.weight = np.linalg.det(J) * w
        self.B = np.einsum("gaj,egji->egai", D, np.linalg.inv(J))
        self.lam, self.mu = fe.E * fe.NU / ((1 + fe.NU) * (1 - 2 * fe.NU)), fe.E / (2 * (1 + fe.NU))
        tied = np.zeros(len(mesh.x), bool)
        self.far = mesh.groups["interface_B"]
        tied[self.far] = tied[mesh.groups["interface_A"]] = True
        self.free = np.flatnonzero(np.repeat(~tied, 3))
        self.arm = mesh.x[self.far] - [LENGTH, 0, 0]
        rows = (3 * mesh.cells[:, :, None] + np.arange(3)).reshape(len(mesh.cells), 60)
        self.rows, self.ij = rows, (np.repeat(rows, 60, 1).ravel(), np.tile(rows, (1, 60)).ravel())

    def turned(self, angle):
        """Displacement of the nodes of the far face about B, and its first and second derivative by
        the angle."""
        c, s = np.cos(angle), np.sin(angle)
        R = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        dR = np.array([[-s, 0, c], [0, 0, 0], [-c, 0, -s]])
        ddR = np.array([[-c, 0, -s], [0, 0, 0], [s, 0, -c]])
        return self.arm @ (R - np.eye(3)).T, self.arm @ dR.T, self.arm @ ddR.T

    def displacements(self, q):
        u = np.zeros(3 * len(self.mesh.x))
        u[self.free] = q[:-3]
        u[fe.dofs(self.far)] = (self.turned(q[-1])[0] + [q[-3], 0, q[-2]]).ravel()
        return u

    def solve(self, q, force):
        for iteration in range(40):
            u = self.displacements(q).reshape(-1, 3)[self.mesh.cells]
            H = np.einsum("eai,egaj->egij", u, self.B, optimize=True)
            F = np.eye(3) + H
            strain = (H + H.transpose(0, 1, 3, 2) + np.einsum("egki,egkj->egij", H, H)) / 2
            S = 2 * self.mu * strain + self.lam * np.einsum("egkk->eg", strain)[..., None, None] * np.eye(3)
            P = np.einsum("egik,egkj->egij", F, S)
            r = np.einsum("egij,egaj,eg->eai", P, self.B, self.weight, optimize=True).reshape(-1, 60)
            full = np.zeros(3 * len(self.mesh.x))
            np.add.at(full, self.rows, r)
            # tangent: dE = sym(F^T dH), dS = C dE, dP = dH S + F dS
            G = np.einsum("egij,egaj->egai", np.einsum("egij,egjk->egik", F, F.transpose(0, 1, 3, 2)), self.B, optimize=True)
            FB = np.einsum("egij,egaj->egai", F, self.B, optimize=True)
            BB = np.einsum("egaj,egbj->egab", self.B, self.B, optimize=True)
            w = self.weight
            k = self.lam * np.einsum("egai,egbj,eg->eaibj", FB, FB, w, optimize=True)
            k += self.mu * np.einsum("egaj,egbi,eg->eaibj", FB, FB, w, optimize=True)
            FF = np.einsum("egik,egjk->egij", F, F)
            k += self.mu * np.einsum("egij,egab,eg->eaibj", FF, BB, w, optimize=True)
            geometric = np.einsum("egaj,egjk,egbk,eg->eab", self.B, S, self.B, w, optimize=True)
            k += geometric[:, :, None, :, None] * np.eye(3)[None, None, :, None, :]
            K = sp.coo_matrix((k.ravel(), self.ij), (len(full),) * 2).tocsr()
            _, first, second = self.turned(q[-1])
            n, far = len(q), fe.dofs(self.far)
            way = np.zeros((len(far), 3))
            way[0::3, 0] = way[2::3, 1] = 1
            way[:, 2] = first.ravel()
            r_, c_ = np.nonzero(way)
            T = sp.coo_matrix((np.r_[np.ones(n - 3), way[r_, c_]], (np.r_[self.free, far[r_]], np.r_[np.arange(n - 3), n - 3 + c_])),
                              (len(full), n)).tocsr()
            residual = T.T @ full
            residual[-2] -= force
            A = (T.T @ K @ T).tolil()
            A[-1, -1] += second.ravel() @ full[far]
            step = sl.spsolve(A.tocsc(), residual)
            q = q - step
            if np.abs(step).max() < 1e-12:
                return q
        raise AssertionError(f"no convergence at {force} N: {np.abs(step).max():.1e}")


def own(mesh, forces):
    bar = Bar(mesh)
    q, rows, last = np.zeros(len(bar.free) + 3), [], 0.0
    mid = middle(mesh)
    for force in forces:
        steps = max(1, round((force - last) / 2500))
        for part in np.linspace(last, force, steps + 1)[1:]:
            q = bar.solve(q, part)
        last = force
        u = bar.displacements(q).reshape(-1, 3)
        rows.append({"force_n": force, "u_B": np.array([q[-3], 0, q[-2]]), "rotation_B": np.array([0, q[-1], 0]), "u_mid": u[mid].mean(0)})
    return rows
