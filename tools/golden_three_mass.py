"""Writes tests/golden/three_mass.json and three_mass_frf.csv: frequencies and frequency response of
robots/abb_three_mass.

    python tools/golden_three_mass.py             (pip install numpy)

    Jm q_m'' = u   - dg (q_m' - q_g') - kg (q_m - q_g)          m motor, g gear, a arm
    Jg q_g'' =       dg (q_m' - q_g') + kg (q_m - q_g) - da (q_g' - q_a') - ka (q_g - q_a)
    Ja q_a'' = t_a + da (q_g' - q_a') + ka (q_g - q_a)

linear: without motor friction. The numbers are read from the robot's files. The frequencies come
from the quadratic in w2 and, as a check, from an eigensolver; the response from one complex solve
at each frequency.
"""
import json
import math
import tomllib
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parent.parent
FOLDER, GOLDEN = ROOT / "robots" / "abb_three_mass", ROOT / "tests" / "golden"
HEADER = """\
# robots/abb_three_mass: frequency response, linear, without friction. Tool: numpy {numpy}; script: tools/golden_three_mass.py.
# Columns, real and imaginary part each: motor_per_torque = q_m''/u and arm_per_torque = q_a''/u, motor free, u its torque
# (rad/s2 per N m); arm_per_motor = q_a/q_m, motor prescribed (-); arm_compliance = q_a/t_a, motor held, t_a torque on the
# arm (rad per N m). Frequency in Hz; exp(+i w t).
"""


def numbers():
    drives = tomllib.loads((FOLDER / "robot.toml").read_text())["drive"]
    links = {l.get("name"): l for l in ET.parse(FOLDER / "abb_three_mass.urdf").getroot().findall("link")}
    izz = lambda name: float(links[name].find("inertial/inertia").get("izz"))
    (kg, dg), (ka, da) = ((d["gearbox"]["stiffness"], d["gearbox"]["damping"]) for d in drives)
    return drives[0]["motor_inertia"], izz("gear"), izz("arm"), kg, dg, ka, da


def matrices(Jm, Jg, Ja, g, a):
    return np.diag([Jm, Jg, Ja]), np.array([[g, -g, 0], [-g, g + a, -a], [0, -a, a]])


def roots(b, c):
    """w2^2 - b w2 + c = 0, as frequencies in Hz."""
    root = math.sqrt(b * b / 4 - c)
    return [math.sqrt(b / 2 + s * root) / (2 * math.pi) for s in (-1, 1)]


if __name__ == "__main__":
    Jm, Jg, Ja, kg, dg, ka, da = numbers()
    held = roots((kg + ka) / Jg + ka / Ja, kg * ka / (Jg * Ja))
    free = roots(kg / Jm + (kg + ka) / Jg + ka / Ja, kg * ka * (Jm + Jg + Ja) / (Jm * Jg * Ja))
    M, K = matrices(Jm, Jg, Ja, kg, ka)
    D = matrices(Jm, Jg, Ja, dg, da)[1]

    def poles(M, D, K):
        n = len(M)
        s = np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]]))
        return [[float(x.real), float(x.imag)] for x in sorted(s, key=abs) if x.imag > 1e-3]

    for hz, part in ((held, slice(1, 3)), (free, slice(0, 3))):
        w = np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(M[part, part], K[part, part])))) / (2 * np.pi)
        assert np.allclose(sorted(w)[-2:], hz, rtol=1e-12, atol=0), (w, hz)
    golden = {"provenance": {
        "tool": "closed form; numpy for the poles", "version": f"numpy {np.__version__}", "script": "tools/golden_three_mass.py",
        "units": "kg m2, N m/rad, N m s/rad, Hz, 1/s",
        "fields": {"held": "motor held, undamped: Jg Ja w4 - (Ja (kg + ka) + Jg ka) w2 + kg ka = 0",
                   "free": "motor free, undamped, beside the free rotation",
                   "poles": "with the dampers: real and imaginary part, upper half plane"}},
        "Jm": Jm, "Jg": Jg, "Ja": Ja, "kg": kg, "dg": dg, "ka": ka, "da": da,
        "held": {"frequencies_hz": held, "poles": poles(M[1:, 1:], D[1:, 1:], K[1:, 1:])},
        "free": {"frequencies_hz": free, "poles": poles(M, D, K)}}
    (GOLDEN / "three_mass.json").write_text(json.dumps(golden, indent=1) + "\n")

    rows = []
    for k in range(1, 601):
        f = 0.05 * k
        s = 2j * math.pi * f
        Z = s * s * M + s * D + K
        q = np.linalg.solve(Z, [1, 0, 0])
        by_motor, by_torque = np.linalg.solve(Z[1:, 1:], -Z[1:, 0])[1], np.linalg.solve(Z[1:, 1:], [0, 1])[1]
        rows.append([f, *(part for x in (s * s * q[0], s * s * q[2], by_motor, by_torque) for part in (x.real, x.imag))])
    names = ["motor_per_torque", "arm_per_torque", "arm_per_motor", "arm_compliance"]
    columns = ",".join(["frequency_hz", *(f"{n}_{p}" for n in names for p in ("re", "im"))])
    body = "".join(",".join(f"{x:.12g}" for x in row) + "\n" for row in rows)
    (GOLDEN / "three_mass_frf.csv").write_text(HEADER.format(numpy=np.__version__) + columns + "\n" + body)

    ratio = lambda p: [-r / math.hypot(r, i) for r, i in p]
    print("held", held, "damping", ratio(golden["held"]["poles"]), "\nfree", free, "damping", ratio(golden["free"]["poles"]))
    table = np.array(rows)
    for n, j in zip(names, (1, 3, 5, 7)):
        size = np.hypot(table[:, j], table[:, j + 1])
        print(f"{n}: peak {size.max():.6f} at {table[size.argmax(), 0]:.2f} Hz; at 0.05 Hz {size[0]:.6f}")
    print("written: tests/golden/three_mass.json, three_mass_frf.csv")
