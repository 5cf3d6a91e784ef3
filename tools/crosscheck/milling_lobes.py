#!/usr/bin/env python3
"""Limits of milling depth from an exported frequency response (multi-frequency solution).

    python3 tools/crosscheck/milling_lobes.py FLEXARM OUT.json

FLEXARM: the built program. For each case it runs `flexarm response` (forces on the TCP to
displacements, world axes), `flexarm inspect` and `flexarm statics` (axes of the TCP, with sag),
reads the tool's file, and solves [Budak and Altintas 1998]

    det(1 + b (1 - e^{-i w T}) [G(i (w + p W)) H_{p-q}]) = 0        p, q = -n .. n

with the Fourier coefficients H_k of the directional matrix over a tooth period (W = 2 pi / T) and
the response G interpolated in the table, with tool modes added in closed form. Straight teeth only.
Limits: eigenvalues followed over 0 <= w <= W/2, b real and positive, refined; n is doubled until
the lowest limit changes by less than 0.02 %. No robot modes, no time steps: only the response and
the tool's file are shared with the program. Needs numpy and scipy.
"""
import csv, json, subprocess, sys, tempfile, tomllib
from pathlib import Path
import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

ROOT = Path(__file__).resolve().parent.parent.parent
CASES = [  # robot, pose (rad), tool, speeds
    ("kr210", [0.0, -1.0, 1.6, 0.0, 0.9, 0.0], "face_mill_63mm", [1000, 1250, 1500, 1750, 2600, 6500]),
    ("kr210", [0.3, -0.5, 0.9, 0.2, 1.1, 0.4], "face_mill_63mm", [1000, 1250, 1500, 1750, 2600, 6500]),
    ("kr210", [-0.6, -1.7, 2.3, -0.3, 0.8, 0.0], "face_mill_63mm", [1000, 1250, 1500, 1750, 2600, 6500]),
]
HIGHEST_HZ = 4000.0


def run(program, *words):
    return json.loads(subprocess.run([program, *words, "--json", "--quiet"], check=True, capture_output=True, text=True).stdout)


def response(program, robot, pose, folder):
    """Interpolated 3x3 response of the TCP in world axes, as a function of positive or negative
    w."""
    at = ",".join(map(repr, pose))
    run(program, "response", robot, f"--at={at}", "--from", "0.02", "--to", str(HIGHEST_HZ), "--points", "20000", "-o", str(folder), "--force")
    with open(folder / "response.csv") as text:
        rows = list(csv.DictReader(line for line in text if not line.startswith("#")))
    f = np.array([float(r["frequency_hz"]) for r in rows])
    G = np.zeros((len(f), 3, 3), complex)
    for j, force in enumerate(("force-x", "force-y", "force-z")):
        for i, out in enumerate("xyz"):
            magnitude, phase = f"{force}_to_{out}_m_per_N", f"{force}_to_{out}_phase_rad"
            G[:, i, j] = [float(r[magnitude]) * np.exp(1j * float(r[phase])) for r in rows]
    spline = CubicSpline(2 * np.pi * f, G)

    def at_frequency(w):
        w = np.asarray(w, float)
        inside = np.clip(np.abs(w), 2 * np.pi * f[0], 2 * np.pi * f[-1])
        g = spline(inside)
        g = np.where((w < 0)[..., None, None], g.conj(), g)
        return np.where((np.abs(w) > 2 * np.pi * f[-1])[..., None, None], 0.0, g)
    return at_frequency


class Tool:
    def __init__(self, path):
        t = tomllib.loads(path.read_text())
        length = {"mm": 1e-3, "m": 1.0}[t.get("lengths", "m")]
        angle = {"deg": np.pi / 180, "rad": 1.0}[t.get("angles", "rad")]
        pressure = {"N/mm2": 1e6, "N/m2": 1.0}[t.get("pressures", "N/m2")]
        c = t["cutter"]
        assert c.get("helix", 0.0) == 0.0, "straight teeth only"
        self.N, self.D = c["teeth"], c["diameter"] * length
        self.lead = c["lead"] * angle if "lead" in c else np.pi / 2
        k = c["coefficients"]
        self.Kt, self.Kr, self.Ka = (k.get(n, 0.0) * pressure for n in ("tangential", "radial", "axial"))
        e = t["engagement"]
        part = e["ae"] * length / self.D
        self.st, self.ex = (np.arccos(2 * part - 1), np.pi) if e["kind"] == "down" else (0.0, np.arccos(1 - 2 * part))
        tool = t.get("tool", {})
        self.axis, self.feed = np.array(tool.get("axis", [0, 0, 1.0])), np.array(tool.get("feed", [1.0, 0, 0]))
        self.modes = [(m["direction"], 2 * np.pi * m["frequency"], m["damping"], m["stiffness"]) for m in t.get("mode", [])]
        self.deepest = t["deepest"] * length

    def own(self, w):
        """Response of the tool's own modes in the axes of the cut."""
        w = np.asarray(w, float)
        G = np.zeros(w.shape + (3, 3), complex)
        for direction, w0, zeta, k in self.modes:
            g = 1 / (k * (1 - (w / w0) ** 2 + 2j * zeta * w / w0))
            for axis in {"radial": (0, 1), "axial": (2,)}[direction]:
                G[..., axis, axis] += g
        return G

    def directional(self, phi):
        """Force on the tool per displacement and depth, with opposite sign, of a cutting tooth at
        phi."""
        s, c, sk, ck = np.sin(phi), np.cos(phi), np.sin(self.lead), np.cos(self.lead)
        n = np.array([sk * s, sk * c, -ck])
        force = self.Kt * np.array([c, -s, 0.0]) + self.Kr * n + self.Ka * np.array([ck * s, ck * c, sk])
        return np.outer(force, n) / sk

    def fourier(self, n):
        """H_k, k = -n .. n, of the sum over the teeth: H(t) = sum H_k e^{i k W t}, by Gauss
        quadrature over the engagement."""
        x, weight = np.polynomial.legendre.leggauss(400)
        phi = self.st + (x + 1) / 2 * (self.ex - self.st)
        H = np.array([self.directional(p) for p in phi])
        scale = weight * (self.ex - self.st) / 2 * self.N / (2 * np.pi)
        return {k: np.einsum("a,aij->ij", scale * np.exp(-1j * k * self.N * phi), H) for k in range(-n, n + 1)}


def limits(G, tool, rpm, n, near=None):
    """Lowest real positive b, and its w; near: only about this w."""
    T = 60 / rpm / tool.N
    W = 2 * np.pi / T
    H = tool.fourier(2 * n)
    p = np.arange(-n, n + 1)
    HH = np.array([[H[a - b] for b in p] for a in p])

    def eigenvalues(w):
        g = G(w + p * W)
        M = np.einsum("pij,pqjk->piqk", g, HH).reshape(3 * len(p), 3 * len(p))
        e = np.linalg.eigvals(M)
        return e[np.argsort(-abs(e))][:12]
    product = lambda w, e: -(1 / e) * (1 - np.exp(1j * w * T))   # b |1 - e^{-i w T}|^2
    best = (np.inf, None)
    # Fine enough for the sharpest mode of the arm: a grid of 0.1 Hz, and 400 points for the rest.
    grid = np.linspace(1e-3 * W, W / 2, max(400, int(W / 2 / 2 / np.pi / 0.1)))
    if near is not None:
        grid = np.linspace(max(grid[0], near - 0.03 * W), min(W / 2, near + 0.03 * W), 25)
    last = eigenvalues(grid[0])
    for w0, w1 in zip(grid[:-1], grid[1:]):
        here = eigenvalues(w1)
        rows, columns = linear_sum_assignment(abs(last[:, None] - here[None, :]))
        here = here[columns[np.argsort(rows)]]
        a, b = product(w0, last), product(w1, here)
        for k in np.nonzero((a.imag > 0) != (b.imag > 0))[0]:
            low, high, e_low, e_high = w0, w1, last[k], here[k]
            for _ in range(40):
                w = (low + high) / 2
                e = eigenvalues(w)
                e = e[np.argmin(abs(e - (e_low + e_high) / 2))]
                if (product(w, e).imag > 0) == (product(low, e_low).imag > 0):
                    low, e_low = w, e
                else:
                    high, e_high = w, e
            z = product(low, e_low)
            depth = z.real / abs(1 - np.exp(-1j * low * T)) ** 2
            if depth > 0 and abs(z.imag) < 1e-3 * abs(z.real) and depth < best[0]:
                best = (depth, low)
        last = here
    # Period doubling: w = W/2 exactly, real eigenvalues.
    e = eigenvalues(W / 2)
    for x in e[abs(e.imag) < 1e-6 * abs(e)]:
        depth = (-1 / x / 2).real
        if 0 < depth < best[0]:
            best = (depth, W / 2)
    return best


def main(program, out):
    cases = []
    with tempfile.TemporaryDirectory() as folder:
        for robot, pose, name, speeds in CASES:
            tool = Tool(ROOT / "robots" / "tools" / f"{name}.toml")
            world = response(program, robot, pose, Path(folder) / "response")
            seen = run(program, "inspect", robot, "--at=" + ",".join(map(repr, pose)))
            R = Rotation.from_quat(np.roll(seen["tcp"]["quaternion_wxyz"], -1)).as_matrix()
            # The tool pose under the arm's weight.
            R = Rotation.from_rotvec(run(program, "statics", robot, "--at=" + ",".join(map(repr, pose)))["sag_rad"]).as_matrix() @ R
            z = -R @ tool.axis
            x = R @ tool.feed - z * (z @ (R @ tool.feed))
            x /= np.linalg.norm(x)
            C = np.array([x, np.cross(z, x), z])              # world to the axes of the cut
            G = lambda w: C @ world(w) @ C.T + tool.own(w)
            rows = []
            for rpm in speeds:
                n, (depth, w) = 8, limits(G, tool, rpm, 8)
                while True:
                    n *= 2
                    finer, w = limits(G, tool, rpm, n, near=w)
                    change, depth = abs(finer - depth) / finer, finer
                    if change < 2e-4 or n >= 64:
                        break
                rows.append([rpm, depth, w / 2 / np.pi, n, change])
                print(f"{robot} {rpm} 1/min: {1e3 * depth:.4f} mm, {w / 2 / np.pi:.2f} Hz, {n} harmonics, change {change:.1e}", flush=True)
            cases.append({"robot": robot, "at": pose, "tool": name, "rows": rows})
    result = {"provenance": {
        "tool": "multi-frequency solution of the exported frequency response", "version": f"numpy {np.__version__}",
        "script": "tools/crosscheck/milling_lobes.py", "units": "spindle_rpm in 1/min, depth in m, frequency in Hz",
        "columns": "spindle_rpm, critical_depth_m, multiplier_frequency_hz, harmonics to each side, relative change when they were doubled last",
    }, "cases": cases}
    Path(out).write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
