"""Writes tests/benchmarks/moberg: poles, frequency responses and two runs of the four-mass arm of
Moberg and Oehr.

    python tools/golden_moberg.py                 (pip install numpy scipy)

    J q'' + (D + F) q' + gear(q0 - q1) [1 -1 0 0]' + K q = [u 0 0 w]'        P = (l1 q1 + l2 q2 + l3 q3) / n

q0 motor, q1 to q3 arm masses; angles and torques as the motor sees them. D holds the dampers between
neighbours, F the friction to ground: `friction="all"` is the published model, `friction="motor"` has
no friction of the arm masses, as robot.toml and torque.toml of robots/test/moberg_arm. The numbers are
those of the publication and not read from the robot's files, so a wrong number there shows in
tools/check_moberg.py, which compares flexarm with these functions.

The runs are DOP853 at 1e-12, stopped by an event at each corner of the gear's curve. The pulse is
also solved with matrix exponentials, as it is linear between the corners. The poles are checked
against det(J s^2 + (D + F) s + K) = 0.
"""
import json
from pathlib import Path

import numpy as np
import scipy
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

FOLDER = Path(__file__).parent.parent / "tests" / "benchmarks" / "moberg"
J = np.diag([5e-3, 2e-3, 0.02, 0.02])
SOFT, STIFF, CORNER = 16.7, 100.0, 0.064
K2, K3 = 110.0, 80.0
DAMPERS = (0.08, 0.06, 0.08)
MOTOR_FRICTION, ARM_FRICTION = 6e-3, 1e-3
RATIO = 220.0
LEVERS = np.array([0.0, 0.02, 0.6, 1.53]) / RATIO
SECONDS = 2.0
JUMPS = (0.0, 0.3, 0.6, SECONDS)
HEADER = """\
# robots/test/moberg_arm: {what}. Tool: numpy {numpy}, scipy {scipy}; script: tools/golden_moberg.py.
# {columns}
"""


def chain(a, b, c):
    """Matrix of three springs or dampers between four neighbours."""
    return np.array([[a, -a, 0, 0], [-a, a + b, -b, 0], [0, -b, b + c, -c], [0, 0, -c, c]], dtype=float)


def damping(friction):
    """D + F with the friction of the motor or of all masses."""
    arm = {"motor": 0.0, "all": ARM_FRICTION}[friction]
    return chain(*DAMPERS) + np.diag([MOTOR_FRICTION, arm, arm, arm])


def poles(k1, friction, held):
    """Poles by magnitude, with one gear stiffness; the motor held or free."""
    part = slice(1 if held else 0, 4)
    M, D, K = J[part, part], damping(friction)[part, part], chain(k1, K2, K3)[part, part]
    n = len(M)
    s = np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]]))
    for x in s[np.abs(s) > 1.0]:
        smallest = np.linalg.svd(M * x * x + D * x + K, compute_uv=False)
        assert smallest[-1] < 1e-11 * smallest[0], (x, smallest)
    return s[np.lexsort((s.imag, np.abs(s)))]


def modes(k1, friction, held):
    """Frequencies (Hz) and damping ratios of the pairs of poles."""
    pairs = [s for s in poles(k1, friction, held) if s.imag > 1e-6]
    return [abs(s) / (2 * np.pi) for s in pairs], [-s.real / abs(s) for s in pairs]


def responses(hz, k1, friction):
    """Tool (m) per motor angle with the motor prescribed, per torque w with the motor held, per w and
    per u with the motor free."""
    rows = []
    for s in 2j * np.pi * np.atleast_1d(hz):
        Z = J * s * s + damping(friction) * s + chain(k1, K2, K3)
        held = np.linalg.solve(Z[1:, 1:], np.stack([-Z[1:, 0], [0, 0, 1]], axis=1))
        free = np.linalg.solve(Z, np.eye(4)[:, [3, 0]])
        rows.append(np.r_[LEVERS[1:] @ held, LEVERS @ free])
    return np.array(rows)


def coupled_friction():
    """Coupling C (q_joints = C q_motors) and friction b of the motors, at the joint, with which
    C^-T diag(b) C^-1 is the damping of the published model over the joints motor, 1, 2, 3."""
    absolute = np.tril(np.ones((4, 4)))
    L = np.linalg.cholesky(absolute.T @ damping("all") @ absolute * RATIO**2)
    return np.linalg.inv((L / np.diag(L)).T), np.diag(L) ** 2


def gear(deflection):
    """Torque of the gear, two slopes."""
    beyond = np.maximum(np.abs(deflection) - CORNER, 0.0)
    return SOFT * deflection + (STIFF - SOFT) * np.sign(deflection) * beyond


def pulse(t):
    return 5.0 if t < 0.3 else -5.0 if t < 0.6 else 0.0


def chirp(t):
    return 3.0 * np.sin(2 * np.pi * (0.5 * t + 3.625 * t * t))


def run(torque, jumps, friction, every):
    """Times, angles (rows of four) and rates from rest."""
    D, Ji, links = damping(friction), np.linalg.inv(J), chain(0.0, K2, K3)

    def rates(t, y, between):
        torque_of_gear = gear(y[0] - y[1])
        load = np.array([torque(between(t)) - torque_of_gear, torque_of_gear, 0.0, 0.0])
        return np.r_[y[4:], Ji @ (load - links @ y[:4] - D @ y[4:])]

    corner = lambda sign: lambda t, y, _: y[0] - y[1] - sign * CORNER
    events = [corner(1.0), corner(-1.0)]
    for event in events:
        event.terminal = True
    times, states, t, y = [0.0], [np.zeros(8)], 0.0, np.zeros(8)
    wanted = np.linspace(0.0, SECONDS, round(SECONDS / every) + 1)
    for end in jumps[1:]:
        # The torque keeps its value up to the jump.
        between = (lambda t, end=end: min(t, end - 1e-9)) if torque is pulse else (lambda t: t)
        while t < end - 1e-12:
            inside = wanted[(wanted > t + 1e-12) & (wanted <= end + 1e-12)]
            part = solve_ivp(rates, (t, end), y, "DOP853", np.unique(np.r_[inside, end]), events=events,
                             args=(between,), rtol=1e-12, atol=1e-14, max_step=2e-3)
            found = [(e[0], s[0]) for e, s in zip(part.t_events, part.y_events) if len(e)]
            stop = min(found, key=lambda f: f[0]) if found else (end, part.y[:, -1])
            take = [(a, b) for a, b in zip(part.t, part.y.T) if a <= stop[0] + 1e-13 and np.abs(inside - a).min(initial=1.0) < 1e-12]
            times += [a for a, _ in take]
            states += [b for _, b in take]
            t, y = stop
            if found:
                # A short step leaves the corner, where the event would be found again.
                step = solve_ivp(rates, (t, min(t + 1e-7, end)), y, "DOP853", args=(between,), rtol=1e-12, atol=1e-14)
                t, y = step.t[-1], step.y[:, -1]
    states = np.array(states)
    assert np.allclose(times, wanted, rtol=0, atol=1e-12), len(times)
    return wanted, states[:, :4], states[:, 4:]


def exact_pulse(friction, every):
    """Angles of the pulse by matrix exponentials between the corners of the gear and the jumps."""
    D, Ji = damping(friction), np.linalg.inv(J)

    def matrix(side, u):
        """Generator of (q, q', 1) in a part of the curve: side -1, 0 or 1."""
        k = STIFF if side else SOFT
        offset = side * (SOFT - STIFF) * CORNER
        A = np.zeros((9, 9))
        A[:4, 4:8] = np.eye(4)
        A[4:8, :4], A[4:8, 4:8] = -Ji @ chain(k, K2, K3), -Ji @ D
        A[4:8, 8] = Ji @ np.array([u - offset, offset, 0.0, 0.0])
        return A

    deflection = lambda y: y[0] - y[1]
    side_of = lambda y: 0 if abs(deflection(y)) < CORNER else int(np.sign(deflection(y)))
    t, y, rows = 0.0, np.r_[np.zeros(8), 1.0], [np.zeros(4)]
    fine = 1e-3
    for k in range(round(SECONDS / fine)):
        u, left = pulse((k + 0.5) * fine), fine
        while left > 0.0:
            # Nearly at a corner the side is that of the next moment.
            side = side_of(y + 1e-9 * (matrix(side_of(y), u) @ y))
            A = matrix(side, u)
            low, high = (-CORNER, CORNER) if side == 0 else ((CORNER, np.inf) if side > 0 else (-np.inf, -CORNER))
            after = expm(A * left) @ y
            if low - 1e-15 <= deflection(after) <= high + 1e-15:
                y, left = after, 0.0
                break
            edge = low if deflection(after) < low else high
            at = brentq(lambda h: deflection(expm(A * h) @ y) - edge, 0.0 if abs(deflection(y) - edge) > 1e-12 else 1e-8, left, xtol=1e-16)
            y, left = expm(A * at) @ y, left - at
        t += fine
        if (k + 1) % round(every / fine) == 0:
            rows.append(y[:4].copy())
    return np.array(rows)


def write(name, what, columns, head, rows):
    text = "".join(",".join(f"{x:.12g}" for x in row) + "\n" for row in rows)
    header = HEADER.format(what=what, columns=columns, numpy=np.__version__, scipy=scipy.__version__)
    (FOLDER / name).write_text(header + ",".join(head) + "\n" + text)


def main():
    FOLDER.mkdir(exist_ok=True)
    pairs = lambda s: [[float(x.real), float(x.imag)] for x in s]
    cases = []
    for k1 in (SOFT, 58.35, STIFF):
        for held in (True, False):
            for friction in ("motor", "all"):
                hz, ratio = modes(k1, friction, held)
                cases.append({"k1": k1, "motor": "held" if held else "free", "friction": friction, "frequencies_hz": hz,
                              "damping_ratios": ratio, "poles": pairs(poles(k1, friction, held))})
                print(f"k1 {k1:6.2f} motor {cases[-1]['motor']}, friction {friction:5}: {np.round(hz, 6)} Hz, damping {np.round(ratio, 6)}")
    golden = {"provenance": {
        "tool": "numpy eigenvalues", "version": f"numpy {np.__version__}", "script": "tools/golden_moberg.py",
        "units": "kg m2, N m/rad, N m s/rad as the motor sees them; Hz; 1/s",
        "fields": {"frequencies_hz": "magnitude of a pair of poles over 2 pi", "damping_ratios": "of the same pairs",
                   "poles": "real and imaginary part, by magnitude",
                   "motor": "held: its angle is fixed; free: driven by torque",
                   "friction": "to ground: of the motor alone, or of all masses as published"}},
        "J": np.diag(J).tolist(), "k1": [SOFT, STIFF], "corner_rad": CORNER, "k2": K2, "k3": K3, "d": DAMPERS,
        "friction": [MOTOR_FRICTION] + 3 * [ARM_FRICTION], "n": RATIO, "levers_m": (LEVERS * RATIO).tolist()[1:], "cases": cases}
    (FOLDER / "poles.json").write_text(json.dumps(golden, indent=1) + "\n")

    hz = np.geomspace(0.1, 300.0, 200)
    names = ["tool_per_motor", "tool_per_w_held", "tool_per_w_free", "tool_per_u_free"]
    head, columns = ["frequency_hz"], [hz]
    for friction in ("motor", "all"):
        for k1 in (SOFT, STIFF):
            table = responses(hz, k1, friction)
            for name, column in zip(names, table.T):
                head += [f"{name}_k{k1:g}_{friction}_{part}" for part in ("re", "im")]
                columns += [column.real, column.imag]
    write("response.csv", "frequency responses of the tool, linear",
          "Real and imaginary parts, m per rad of the motor or per N m at the motor's side; u torque of the motor, w torque on arm mass 3; motor"
          "\n# prescribed, held, free; k16.7 and k100: stiffness of the gear; friction of the motor or of all masses. exp(+i w t).",
          head, np.array(columns).T)

    for name, torque, jumps in (("pulse", pulse, JUMPS), ("chirp", chirp, (0.0, SECONDS))):
        t, q, _ = run(torque, jumps, "all", 5e-3)
        tool, motor_alone = q @ LEVERS, run(torque, jumps, "motor", 5e-3)[1] @ LEVERS
        if name == "pulse":
            apart = np.abs(exact_pulse("all", 5e-3) - q).max()
            print(f"pulse: matrix exponentials and DOP853 differ by {apart:.1e} rad of {np.abs(q).max():.3f} rad")
            assert apart < 1e-9
        u = [torque(x + 1e-9 if torque is pulse else x) for x in t]
        write(f"{name}.csv", f"run from rest under the torque of the {name}",
              "Angles of motor and arm masses in rad as the motor sees them and tool_m = (l1 q1 + l2 q2 + l3 q3)/n: published model;"
              "\n# tool_motor_friction_m without friction of the arm masses. torque_nm acts from the time of its row on.",
              ["time_s", "torque_nm", "q_motor", "q_arm_1", "q_arm_2", "q_arm_3", "tool_m", "tool_motor_friction_m"],
              np.column_stack([t, u, q, tool, motor_alone]))
        print(f"{name}: gear deflection up to {np.abs(q[:, 0] - q[:, 1]).max():.6f} rad, tool up to {np.abs(tool).max():.9f} m, at the end"
              f" {tool[-1]:.9f} m; without friction of the arm {motor_alone[-1]:.9f} m, apart by up to {np.abs(motor_alone - tool).max():.9f} m")
    print(f"written: {FOLDER.relative_to(FOLDER.parents[2])}")


if __name__ == "__main__":
    main()
