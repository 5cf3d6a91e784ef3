"""Regenerates tests/golden/{kane,kane_slow,simo}_spin_up.csv: spin-up of a cantilever.

The cantilever turns about its root, in the plane.

    python tools/golden_kane.py             compare with the stored files; status 1 if they differ by over 1e-8 m
    python tools/golden_kane.py --check     also finer and coarser meshes, tighter tolerance, shear, and Exudyn's ANCF cable
    python tools/golden_kane.py --write     replace the stored files          (pip install numpy scipy exudyn)

The root turns by psi(t), psi' = Omega (t/T - sin(2 pi t/T)/(2 pi)) for t < T = 15 s, then Omega.
Published beams:

    kane       Kane, Ryan and Banerjee 1987, Wu and Haug 1988: thin tube of 8 m, Omega = 6 rad/s; its first bending frequency
               at rest is 2.91 rad/s
    kane_slow  the same with Omega = 4 rad/s
    simo       Simo and Vu-Quoc 1986 (part II): 10 m, Omega = 6 rad/s

Truth: geometrically exact beam (Simo and Reissner: stretch, shear and bending; rotary inertia), in
a frame that rotates with the root. With r = (x, y) and phi there, N the shape functions,
c = cos(phi), s = sin(phi),

    e = c x' + s y' - 1,  g = -s x' + c y',  k = phi'          energy 1/2 (EA e2 + kGA g2 + EI k2)
    rA (r'' + 2 W x r' + W' x r - W2 r), rI (phi'' + W')       inertia forces of the section, W = psi'

Cubic elements, as many Gauss points as the degree for the energy (no locking), one more for the
mass; Radau. Start straight, at rest; no gravity, no damping. For contrast `linear`: the same with
the stiffness of the straight, unstressed beam. It lacks the centrifugal stiffening, has K - W2 M
instead, and diverges once W exceeds the first frequency.
"""
import argparse
import sys
from pathlib import Path

import numpy as np
import scipy
from scipy.integrate import solve_ivp

GOLDEN = Path(__file__).parent.parent / "tests" / "golden"
RISE, END, EVERY = 15.0, 20.0, 0.05                             # s
E, G, A, I, RHO = 6.8952e10, 2.6519e10, 7.2968e-5, 8.2181e-9, 2766.67
# shear factor of a thin tube, about 1/2
TUBE = (8.0, E * A, 0.5 * G * A, E * I, RHO * A, RHO * I)
CASES = {  # Omega (rad/s); length (m), EA, kGA (N), EI (N m2), rA (kg/m), rI (kg m)
    "kane": (6.0, TUBE), "kane_slow": (4.0, TUBE), "simo": (6.0, (10.0, 2.8e7, 1e7, 1.4e4, 1.2, 6e-4)),
}
DEGREE, ELEMENTS, RTOL, ALLOWED = 3, 8, 1e-9, 1e-8
HEADER = """\
# Spin-up of a cantilever of {length} m ("{name}" of tools/golden_kane.py): EA = {EA:.6g} N, kGA = {kGA:.6g} N,
# EI = {EI:.6g} N m2, {rA:.6g} kg/m, rotary inertia {rI:.6g} kg m; root turns at {turn:.0f} rad/s after 15 s, psi' = {turn:.0f} (t/15 - sin(2 pi t/15)/(2 pi)).
# In the axes that turn with the root: tip_u along the undeformed beam, tip_v across (positive in the sense of the turning), tip_angle;
# linear_tip_v: constant stiffness, no centrifugal stiffening, until it exceeds the length, then nan. Units s, rad/s, m, rad.
# Tool: own geometrically exact finite elements, {elements} cubic; scipy {scipy}, Radau at rtol {rtol:.0e}. Regenerate: tools/golden_kane.py.
# Twice the elements: {finer} m; Exudyn 1.13.6, 32 ANCFCable2D, without shear and rotary inertia, whose doing that is: {cable} m.
time,rate,tip_u,tip_v,tip_angle,linear_tip_v
"""
# by --check; tip_v, m
AGREES = {"kane": ("4.1e-8", "5.1e-5"), "kane_slow": ("8.2e-9", "2.8e-5"), "simo": ("1.3e-8", "5.3e-5")}


def spin(turn, t):
    """Angle, rate and acceleration of the root."""
    u, rising = 2 * np.pi * min(t, RISE) / RISE, min(t, RISE)
    psi = turn * (rising**2 / (2 * RISE) + RISE / (4 * np.pi**2) * (np.cos(u) - 1) + max(t - RISE, 0))
    return psi, turn * (rising / RISE - np.sin(u) / (2 * np.pi)), turn / RISE * (1 - np.cos(u))


class Beam:
    """Unknowns q: displacements along and across and rotation phi of every node except the root, in
    rotating axes."""

    def __init__(self, turn, numbers, elements=ELEMENTS, degree=DEGREE):
        length, EA, kGA, EI, rA, rI = numbers
        self.turn, self.length, self.stiffness = turn, length, (EA, kGA, EI)
        h, self.nodes = length / elements, elements * degree + 1
        at = np.linspace(-1, 1, degree + 1)
        lagrange = [np.poly1d(np.poly(np.delete(at, j))) / np.prod(at[j] - np.delete(at, j)) for j in range(degree + 1)]
        shape = lambda points: (np.array([[p(x) for p in lagrange] for x in points]), np.array([[p.deriv()(x) * 2 / h for p in lagrange] for x in points]))
        # nodes of each element
        where = np.arange(elements)[:, None] * degree + np.arange(degree + 1)

        def spread(local):
            """Scatters values at the points of an element to a matrix over all nodes, one row per
            point of each element."""
            out = np.zeros((elements, local.shape[0], self.nodes))
            for e in range(elements):
                out[e][:, where[e]] = local
            return out.reshape(-1, self.nodes)

        points, weights = np.polynomial.legendre.leggauss(degree)
        value, slope = shape(points)
        self.N, self.dN, self.w = spread(value), spread(slope), np.tile(weights * h / 2, elements)
        points, weights = np.polynomial.legendre.leggauss(degree + 1)
        full = spread(shape(points)[0])
        m = full.T @ (np.tile(weights * h / 2, elements)[:, None] * full)
        self.mt, self.mr = rA * m, rI * m
        self.rest = np.zeros((3, self.nodes))
        self.rest[0] = np.linspace(0, length, self.nodes)
        n = self.nodes - 1
        self.M = np.zeros((3 * n, 3 * n))
        for k, block in enumerate((self.mt, self.mt, self.mr)):
            self.M[k * n:(k + 1) * n, k * n:(k + 1) * n] = block[1:, 1:]
        self.inverse = np.linalg.inv(self.M)
        self.K0 = self.tangent(np.zeros(3 * n))

    @staticmethod
    def fields(q):
        return np.hstack([np.zeros((3, 1)), q.reshape(3, -1)])

    def strains(self, z):
        """c, s, e, g, k at the points; e without a difference of numbers near 1, whose rounding
        would be amplified."""
        (du, dy, curvature), phi = z @ self.dN.T, self.N @ z[2]
        c, s = np.cos(phi), np.sin(phi)
        return c, s, c * du + s * dy - 2 * np.sin(phi / 2) ** 2, -s * (1 + du) + c * dy, curvature

    def elastic(self, q):
        """Nodal forces of the elastic energy."""
        EA, kGA, EI = self.stiffness
        c, s, e, g, k = self.strains(self.fields(q))
        n, v, m = EA * e * self.w, kGA * g * self.w, EI * k * self.w
        return np.array([(c * n - s * v) @ self.dN, (s * n + c * v) @ self.dN, (n * g - v * (1 + e)) @ self.N + m @ self.dN])[:, 1:].ravel()

    def tangent(self, q):
        EA, kGA, EI = self.stiffness
        c, s, e, g, _ = self.strains(self.fields(q))
        n, v = EA * e, kGA * g
        dN, N, column = self.dN[:, 1:], self.N[:, 1:], lambda a: a[:, None]
        zero = np.zeros_like(dN)
        B = [np.hstack([column(c) * dN, column(s) * dN, column(g) * N]), np.hstack([column(-s) * dN, column(c) * dN, column(-1 - e) * N]),
             np.hstack([zero, zero, dN])]
        K = sum(b.T @ (column(C * self.w) * b) for b, C in zip(B, (EA, kGA, EI)))
        # second derivatives of e and g
        turn = np.hstack([zero, zero, N])
        cross = np.hstack([column(-s * n - c * v) * dN, column(c * n - s * v) * dN, zero])
        mixed = cross.T @ (column(self.w) * turn)
        return K + mixed + mixed.T - turn.T @ (column(self.w * (n * (1 + e) + v * g)) * turn)

    def inertia(self, t, q, qd):
        """Inertia forces except M q''."""
        _, rate, acceleration = spin(self.turn, t)
        (x, y, _), (vx, vy, _) = self.rest + self.fields(q), self.fields(qd)
        forces = np.array([self.mt @ (-2 * rate * vy - acceleration * y - rate**2 * x), self.mt @ (2 * rate * vx + acceleration * x - rate**2 * y),
                           self.mr @ np.full(self.nodes, acceleration)])
        return forces[:, 1:].ravel()

    def inertia_jacobian(self, t):
        (_, rate, acceleration), n, m = spin(self.turn, t), self.nodes - 1, self.mt[1:, 1:]
        by_q, by_v = np.zeros((3 * n, 3 * n)), np.zeros((3 * n, 3 * n))
        by_q[:n, :n] = by_q[n:2 * n, n:2 * n] = -rate**2 * m
        by_q[:n, n:2 * n], by_q[n:2 * n, :n] = -acceleration * m, acceleration * m
        by_v[:n, n:2 * n], by_v[n:2 * n, :n] = -2 * rate * m, 2 * rate * m
        return by_q, by_v

    def run(self, times, linear=False, rtol=RTOL):
        """Tip (u, v, angle) at the times; nan once |v| exceeds the length (linear only)."""
        n = len(self.M)

        def rates(t, z):
            q, qd = z[:n], z[n:]
            elastic = self.K0 @ q if linear else self.elastic(q)
            return np.concatenate([qd, -self.inverse @ (elastic + self.inertia(t, q, qd))])

        def jacobian(t, z):
            by_q, by_v = self.inertia_jacobian(t)
            K = self.K0 if linear else self.tangent(z[:n])
            return np.block([[np.zeros((n, n)), np.eye(n)], [-self.inverse @ (K + by_q), -self.inverse @ by_v]])

        # m and m/s; rates of the stiff shear waves have rounding errors of 1e-10 m/s
        tolerance = np.repeat([0.01 * rtol, rtol], n)
        far = lambda t, z: abs(z[2 * n // 3 - 1]) - self.length
        far.terminal = True
        z, out = np.zeros(2 * n), np.full((len(times), 3), np.nan)
        out[0] = 0
        for begin, end in ((0.0, RISE), (RISE, times[-1])):
            asked = times[(times > begin) & (times <= end)]
            run = solve_ivp(rates, (begin, end), z, method="Radau", rtol=rtol, atol=tolerance, jac=jacobian, t_eval=asked,
                            events=far if linear else None, max_step=0.05)
            assert run.success, run.message
            got = np.searchsorted(times, asked[:run.y.shape[1]])
            out[got] = run.y[[n // 3 - 1, 2 * n // 3 - 1, n - 1]].T
            if run.status == 1:
                break
            z = run.y[:, -1]
        return out


def exudyn_cable(turn, numbers, elements, step, times):
    """The same by Exudyn's ANCFCable2D (no shear, no rotary inertia), in the inertial frame; tip
    (u, v)."""
    import exudyn as exu
    from exudyn.utilities import CoordinateConstraint, MarkerNodeCoordinate, NodePoint2DSlope1, NodePointGround, Cable2D, SensorNode
    length, EA, _, EI, rA, _ = numbers
    system = exu.SystemContainer().AddSystem()
    h = length / elements
    nodes = [system.AddNode(NodePoint2DSlope1(referenceCoordinates=[i * h, 0, 1, 0])) for i in range(elements + 1)]
    for a, b in zip(nodes, nodes[1:]):
        system.AddObject(Cable2D(length=h, massPerLength=rA, bendingStiffness=EI, axialStiffness=EA, nodeNumbers=[a, b]))
    ground = system.AddMarker(MarkerNodeCoordinate(nodeNumber=system.AddNode(NodePointGround()), coordinate=0))
    # the slope at the root is prescribed in direction and length: a stretch of 1e-4 is suppressed in one point
    motion = [None, None, lambda mbs, t, number, offset: np.cos(spin(turn, t)[0]) - 1,
              lambda mbs, t, number, offset: np.sin(spin(turn, t)[0])]
    for coordinate, offset in enumerate(motion):
        marker = system.AddMarker(MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=coordinate))
        given = dict(offsetUserFunction=offset) if offset else {}
        system.AddObject(CoordinateConstraint(markerNumbers=[ground, marker], **given))
    tip = system.AddSensor(SensorNode(nodeNumber=nodes[-1], storeInternal=True, outputVariableType=exu.OutputVariableType.Position))
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = round(times[-1] / step), times[-1]
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.adaptiveStep, settings.timeIntegration.newton.absoluteTolerance = False, 1e-6
    settings.timeIntegration.verboseMode = 0
    settings.solution.sensors.writePeriod, settings.solution.file.write = times[1], False
    system.SolveDynamic(settings)
    stored = system.GetSensorStoredData(tip)
    assert len(stored) == len(times) and np.abs(stored[:, 0] - times).max() < 1e-9
    c, s = np.array([(np.cos(spin(turn, t)[0]), np.sin(spin(turn, t)[0])) for t in times]).T
    return np.column_stack([c * stored[:, 1] + s * stored[:, 2] - length, -s * stored[:, 1] + c * stored[:, 2]])


def golden(name, args):
    turn, numbers = CASES[name]
    times = np.arange(round(END / EVERY) + 1) * EVERY
    beam = Beam(turn, numbers)
    tip, linear = beam.run(times), beam.run(times, linear=True, rtol=1e-8)
    table = np.column_stack([times, [spin(turn, t)[1] for t in times], tip, linear[:, 1]]) + 0.0
    length, EA, kGA, EI, rA, rI = numbers
    after = times >= RISE
    first = np.sqrt(np.linalg.eigvals(beam.inverse @ beam.K0).real.min())
    k, last = np.abs(tip[:, 1]).argmax(), np.isfinite(linear[:, 1]).sum() - 1
    print(f"{name}: first frequency at rest {first:.6f} rad/s (Euler-Bernoulli {1.8751040687**2 * np.sqrt(EI / rA) / length**2:.6f})")
    print(f"  tip_v: extreme {tip[k, 1]:.8f} m near {times[k]:.2f} s, tip_u there {tip[k, 0]:.8f} m")
    print(f"  after {RISE} s: tip_v {tip[after, 1].min():.3e} to {tip[after, 1].max():.3e} m; mean tip_u {tip[after, 0].mean():.6e} m"
          f" (rA W2 L3 / 3 EA = {rA * turn**2 * length**3 / (3 * EA):.6e})")
    print(f"  linear: reaches the length at {times[last]:.2f} s; at 5 s {linear[100, 1]:.6f} m against {tip[100, 1]:.6f} m")
    if args.check:
        apart = lambda other: " ".join(f"{x:.1e}" for x in np.abs(other - tip[:, :other.shape[1]]).max(axis=0))
        print("  apart (u, v, angle): 4 elements", apart(Beam(turn, numbers, elements=4).run(times)))
        print("    16 elements", apart(Beam(turn, numbers, elements=16).run(times)))
        print("    rtol 1e-8", apart(beam.run(times, rtol=1e-8)))
        print("    shear stiffness doubled", apart(Beam(turn, (length, EA, 2 * kGA, EI, rA, rI)).run(times)))
        print("    no rotary inertia to speak of", apart(Beam(turn, (length, EA, kGA, EI, rA, 1e-3 * rI)).run(times)))
        for elements, step in ((16, 1e-3), (32, 1e-3), (32, 5e-4)):
            print(f"    Exudyn, {elements} cables, {step} s (u, v)", apart(exudyn_cable(turn, numbers, elements, step, times)))

    header = HEADER.format(name=name, turn=turn, length=length, EA=EA, kGA=kGA, EI=EI, rA=rA, rI=rI, elements=ELEMENTS, scipy=scipy.__version__,
                           rtol=RTOL, finer=AGREES[name][0], cable=AGREES[name][1])
    path = GOLDEN / f"{name}_spin_up.csv"
    if args.write:
        path.write_text(header + "".join(",".join(f"{x:.10g}" for x in row) + "\n" for row in table))
        print("  written:", path.name)
    stored = path.read_text()
    body = np.array([[float(x) for x in l.split(",")] for l in stored.splitlines() if l[0] not in "#t"])
    difference = np.nanmax(np.abs(body - table)[:, :5])
    print(f"  stored file, {len(body)} rows: largest difference {difference:.1e}; header {'the same' if stored.startswith(header) else 'DIFFERS'}")
    return difference <= ALLOWED and stored.startswith(header)


if __name__ == "__main__":
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("--check", action="store_true", help="convergence and Exudyn")
    ap.add_argument("--write", action="store_true", help="replace the stored files")
    args = ap.parse_args()
    sys.exit(0 if all([golden(name, args) for name in CASES]) else 1)
