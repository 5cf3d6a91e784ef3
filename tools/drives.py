"""Arms with elastic gearboxes, read without flexarm: independent truth for the drives.

A drive of kind "gearbox" places a spring and a damper between the motor, which follows the motion
exactly, and the link:

    tau = k (q_motor - q) + d (q_motor' - q')            joint side, q the angle of the link
    M_ff q'' = tau - h_f(q, q', [0, q_p''])              f the geared joints, p those that follow the motion

with h by one RNEA and M from CRBA (Pinocchio). The motor's inertia loads only the motor and does
not enter. No friction.
"""
import numpy as np
import pinocchio as pin
import scipy.linalg as sl
from scipy.integrate import solve_ivp

from robot_file import Arm


class Trapezoid:
    """One move as fast as the limits allow, all joints synchronised, constant accelerations; then a
    rest."""

    def __init__(self, file):
        assert file["profile"] == "trapezoid" and file["rounding"] == 0 and file["unit"] == "rad" and len(file["move"]) == 1
        move, limits = file["move"][0], [file["limits"][j] for j in file["joints"]]
        self.start = np.array(file["start"])
        self.way = np.array(move["to"]) - self.start
        speed = 1 / max(abs(w) / l["velocity"] for w, l in zip(self.way, limits))
        self.acceleration = 1 / max(abs(w) / l["acceleration"] for w, l in zip(self.way, limits))
        self.ramp = speed / self.acceleration
        self.duration = 1 / speed + self.ramp
        assert self.duration >= 2 * self.ramp, "the move is too short for its speed"
        self.t_end = self.duration + move["hold"]
        self.kinks = [0.0, self.ramp, self.duration - self.ramp, self.duration, self.t_end]

    def piece(self, number):
        """The motion between two kinks, continued beyond them: integrators overshoot by a rounding
        error."""
        a, r, T = self.acceleration, self.ramp, self.duration
        s = [lambda t: (a * t * t / 2, a * t, a), lambda t: (a * r * (t - r / 2), a * r, 0.0),
             lambda t: (1 - a * (T - t) ** 2 / 2, a * (T - t), -a), lambda t: (1.0, 0.0, 0.0)][number]
        return lambda t: (self.start + self.way * s(t)[0], *(self.way * x for x in s(t)[1:]))

    def __call__(self, t):
        return self.piece(min(int(np.searchsorted(self.kinks[1:], t, side="left")), 3))(t)


class Quintic:
    """Quintic moves from rest to rest with holds."""

    def __init__(self, file):
        assert file["profile"] == "quintic" and file["unit"] == "deg"
        here, self.t_end, self.moves = np.radians(file["start"]), 0.0, []
        self.start, self.kinks = here, [0.0]
        for move in file["move"]:
            to = np.radians(move["to"])
            self.moves.append((self.t_end, move["duration"], to - here))
            self.t_end += move["duration"]
            self.kinks.append(self.t_end)
            self.t_end += move.get("hold", 0.0)
            self.kinks.append(self.t_end)
            here = to

    def piece(self, number):
        return self

    def __call__(self, t):
        q, v, a = self.start.copy(), np.zeros(len(self.start)), np.zeros(len(self.start))
        for start, T, way in self.moves:
            u = min(max((t - start) / T, 0.0), 1.0)
            q += way * u**3 * (10 - 15 * u + 6 * u * u)
            v += way * 30 * u * u * (1 - u) ** 2 / T
            a += way * 60 * u * (1 - u) * (1 - 2 * u) / T**2
        return q, v, a


class GearedArm:
    """A robot file without flexible links and with gearboxes; `q_m`: motor positions, joint side,
    all joints."""

    def __init__(self, path):
        self.arm = Arm(path, elastic=False)
        drives = {d["joint"]: d for d in self.arm.file["drive"]}
        assert not self.arm.file.get("flexible_link") and all(d["kind"] in ("gearbox", "prescribed") for d in drives.values())
        self.free = [i for i, n in enumerate(self.arm.names) if drives.get(n, {}).get("kind") == "gearbox"]
        gears = [drives[self.arm.names[i]]["gearbox"] for i in self.free]
        self.k, self.d = (np.array([g.get(key, 0.0) for g in gears]) for key in ("stiffness", "damping"))
        self.rotor = np.array([drives[n].get("ratio", 1.0) ** 2 * drives[n].get("motor_inertia", 0.0) if n in drives else 0.0
                               for n in self.arm.names])
        assert self.arm.actuated == list(range(len(self.arm.names)))
        self.model, self.data = self.arm.model, self.arm.data

    def link(self, q_m, windup):
        """Joint angles of the links; windup = link minus motor."""
        q = np.array(q_m, float)
        q[self.free] += windup
        return q

    def mass(self, q):
        return self.arm.mass_matrix(q)[np.ix_(self.free, self.free)]

    def statics(self, q_m):
        """Windup at rest under gravity."""
        w = np.zeros(len(self.free))
        for _ in range(50):
            q = self.link(q_m, w)
            g = pin.computeGeneralizedGravity(self.model, self.data, q)[self.free]
            step = np.linalg.solve(self.tangent(q), self.k * w + g)
            w = w - step
            if np.abs(step).max() < 1e-17:
                break
        return w

    def tangent(self, q):
        dg = pin.computeGeneralizedGravityDerivatives(self.model, self.data, q)[np.ix_(self.free, self.free)]
        return np.diag(self.k) + 0.5 * (dg + dg.T)

    def modes(self, q_m, gravity):
        """Undamped frequencies (Hz), and frequencies (Hz) and damping ratios with the dampers;
        motors held."""
        q = self.link(q_m, self.statics(q_m)) if gravity else np.array(q_m, float)
        M, K, n = self.mass(q), self.tangent(q) if gravity else np.diag(self.k), len(self.free)
        undamped = np.sqrt(sl.eigh(K, M, eigvals_only=True)) / (2 * np.pi)
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, np.diag(self.d))]])
        return undamped, np.array(sorted(np.linalg.eigvals(A), key=lambda s: (abs(s), s.imag)))

    def compliance(self, q):
        """6x6 at the TCP, linear first, world axes."""
        J = self.arm.jacobian(q)[:, self.free]
        return J @ np.diag(1 / self.k) @ J.T

    def integrate(self, motion, times, method="DOP853", rtol=1e-12, atol=1e-15):
        """Returns windup and its rate at the times, from static equilibrium; restarted at kinks of
        the motion."""
        n = len(self.free)
        y = np.concatenate([self.statics(motion(0.0)[0]), np.zeros(n)])
        out, calls = np.empty((len(times), 2 * n)), 0
        for number, (begin, end) in enumerate(zip(motion.kinks[:-1], motion.kinks[1:])):
            follow = motion.piece(number)

            def rates(t, y):
                q_m, v_m, a_m = follow(t)
                q, v, a = self.link(q_m, y[:n]), self.link(v_m, y[n:]), a_m.copy()
                # a = a_m: the acceleration of the windup is the unknown
                bias = pin.rnea(self.model, self.data, q, v, a)[self.free]
                return np.concatenate([y[n:], np.linalg.solve(self.mass(q), -self.k * y[:n] - self.d * y[n:] - bias)])

            # a time on a kink belongs to the preceding piece
            inside = (times > begin) & (times <= end) if number else times <= end
            asked = np.union1d(times[inside], [end])
            run = solve_ivp(rates, (begin, end), y, method=method, rtol=rtol, atol=atol, max_step=0.02, t_eval=asked)
            assert run.success, run.message
            out[inside] = run.y[:, np.searchsorted(asked, times[inside])].T
            y, calls = run.y[:, -1], calls + run.nfev
        return out, calls

    def table(self, motion, times, y):
        """time, rigid and flexible TCP, rotation vector of R_flexible R_rigid^T, windup of each
        gearbox."""
        rows = []
        for t, w in zip(times, y[:, :len(self.free)]):
            q_m = motion(t)[0]
            rigid, soft = self.arm.pose(q_m), self.arm.pose(self.link(q_m, w))
            rows.append([t, *rigid.translation, *soft.translation, *pin.log3(soft.rotation @ rigid.rotation.T), *w])
        return np.array(rows) + 0.0
