"""Reads robot files without flexarm: URDF + robot.toml to a Pinocchio model with elastic joints.

An independent implementation of the format, for choosing numbers and for checking the simulator
against another tool. Needs Python 3.11 or newer, numpy, scipy and Pinocchio
(`pip install pin scipy`).

Six-vectors are ordered (linear, angular). An elastic joint has e = (x, y, z, rx, ry, rz) in the
axes of its link, R = Rz(rz) Ry(ry) Rx(rx), stiffness K_S. Letters: L link, A proximal and B distal
interface, S split, E beam frame (x along the beam, y and z the axes of the section).
"""
import math
import tomllib
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pinocchio as pin
import scipy.linalg as sl

MATERIALS = {  # E in Pa, nu, rho in kg/m3
    "steel": (210e9, 0.30, 7850.0),
    "aluminium": (70e9, 0.33, 2700.0),
    "cast_iron": (110e9, 0.26, 7200.0),
    "ductile_iron": (169e9, 0.275, 7100.0),
}


# -------------------------------------------------------------------------------------------
# algebra
def skew(r):
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0.0]])


def transport(p_AB):
    """Ad with u_B = Ad u_A for a rigid body, same axes at A and B."""
    Ad = np.eye(6)
    Ad[:3, 3:] = -skew(p_AB)
    return Ad


def rpy_matrix(rpy):
    """URDF: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    return pin.rpy.rpyToMatrix(*map(float, rpy))


def about_point(mass, offset):
    """Inertia of a point mass at `offset` about the origin."""
    return mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))


def merge(bodies):
    """One body (mass, com, inertia about com) from several."""
    mass = sum(b[0] for b in bodies)
    com = sum(b[0] * np.asarray(b[1]) for b in bodies) / mass
    return mass, com, sum(b[2] + about_point(b[0], b[1] - com) for b in bodies)


# ----------------------------------------------------------------------------------------------
# URDF
def vector(text, default="0 0 0"):
    return np.array([float(x) for x in (text or default).split()])


def origin(element):
    o = element.find("origin") if element is not None else None
    xyz, rpy = (o.get("xyz"), o.get("rpy")) if o is not None else (None, None)
    return pin.SE3(rpy_matrix(vector(rpy)), vector(xyz))


def read_urdf(path):
    """links: name -> (mass, com, inertia about com, link axes) or None; joints: list in file
    order."""
    root = ET.parse(path).getroot()
    links, joints = {}, []
    for link in root.findall("link"):
        inertial = link.find("inertial")
        if inertial is None:
            links[link.get("name")] = None
            continue
        X, i = origin(inertial), inertial.find("inertia")
        g = lambda k: float(i.get(k))
        I = np.array([[g("ixx"), g("ixy"), g("ixz")], [g("ixy"), g("iyy"), g("iyz")], [g("ixz"), g("iyz"), g("izz")]])
        links[link.get("name")] = (float(inertial.find("mass").get("value")), X.translation, X.rotation @ I @ X.rotation.T)
    for j in root.findall("joint"):
        axis, limit = j.find("axis"), j.find("limit")
        joints.append(dict(
            name=j.get("name"), type=j.get("type"), X=origin(j),
            parent=j.find("parent").get("link"), child=j.find("child").get("link"),
            axis=vector(axis.get("xyz") if axis is not None else None, "1 0 0"),
            limit={k: float(limit.get(k)) for k in limit.keys()} if limit is not None else {}))
    return links, joints


# ----------------------------------------------------------------------------------------------
# beam
def box_shear_factor(along, across, nu):
    """Cowper 1966, thin-walled box with uniform wall; midline lengths along and across the
    force."""
    m = n = across / along
    return (10 * (1 + nu) * (1 + 3 * m)**2
            / (12 + 72 * m + 150 * m**2 + 90 * m**3 + nu * (11 + 66 * m + 135 * m**2 + 90 * m**3)
               + 10 * n**2 * ((3 + nu) * m + 3 * m**2)))


def section_stiffness(beam):
    """EA, EI_y, EI_z, GJ, kGA_y, kGA_z and the squared section radii i_y2, i_z2 (rotary inertia
    over mass)."""
    kind = beam["section"]
    if kind == "given":
        s = {k: beam[k] for k in ("EA", "EI_y", "EI_z", "GJ")}
        s |= {k: beam.get(k, math.inf) for k in ("kGA_y", "kGA_z")}
        s["i_y2"], s["i_z2"] = (beam[k] / beam["mass_per_length"] for k in ("rotary_y", "rotary_z"))
        return s
    m = beam["material"]
    E, nu, _ = MATERIALS[m] if isinstance(m, str) else (m["E"], m["nu"], m["rho"])
    G = E / (2 * (1 + nu))
    if kind == "box":
        w, h, t = beam["width"], beam["height"], beam["wall"]
        wi, hi = w - 2 * t, h - 2 * t
        A, I_y, I_z = w * h - wi * hi, (w * h**3 - wi * hi**3) / 12, (h * w**3 - hi * wi**3) / 12
        J = 4 * ((w - t) * (h - t))**2 * t / (2 * (w - t) + 2 * (h - t))          # Bredt
        k_y, k_z = box_shear_factor(w - t, h - t, nu), box_shear_factor(h - t, w - t, nu)
    elif kind == "rectangle":
        w, h = beam["width"], beam["height"]
        A, I_y, I_z = w * h, w * h**3 / 12, h * w**3 / 12
        a, b = max(w, h), min(w, h)
        J = a * b**3 * (1 / 3 - 64 / math.pi**5 * b / a
                        * sum(math.tanh(n * math.pi * a / (2 * b)) / n**5 for n in range(1, 40, 2)))
        k_y = k_z = 10 * (1 + nu) / (12 + 11 * nu)                                # Cowper 1966
    elif kind in ("tube", "circle"):
        ro = beam.get("outer_diameter", beam.get("diameter")) / 2
        ri = ro - beam["wall"] if kind == "tube" else 0.0
        A, I_y = math.pi * (ro**2 - ri**2), math.pi / 4 * (ro**4 - ri**4)
        I_z, J = I_y, 2 * I_y
        m2 = (ri / ro)**2
        q = (1 + m2)**2
        # Cowper 1966, hollow circle
        k_y = k_z = 6 * (1 + nu) * q / ((7 + 6 * nu) * q + (20 + 12 * nu) * m2)
    else:
        raise ValueError(f"section {kind!r}")
    return dict(EA=E * A, EI_y=E * I_y, EI_z=E * I_z, GJ=G * J, kGA_y=k_y * G * A, kGA_z=k_z * G * A,
                i_y2=I_y / A, i_z2=I_z / A)


def tip_compliance(s, length, timoshenko=True):
    """C at the end of a cantilever, beam axes."""
    C = np.zeros((6, 6))
    C[0, 0], C[3, 3] = length / s["EA"], length / s["GJ"]
    for w, th, sign, EI, kGA in ((1, 5, 1, s["EI_z"], s["kGA_y"]), (2, 4, -1, s["EI_y"], s["kGA_z"])):
        C[w, w] = length**3 / (3 * EI) + (length / kGA if timoshenko else 0.0)
        C[th, th] = length / EI
        C[w, th] = C[th, w] = sign * length**2 / (2 * EI)
    return C


def beam_link(beam, p_AB, body):
    """K_S and p_AS of a flexible link, and its two parts (mass, com, inertia about com, link
    axes)."""
    length = np.linalg.norm(p_AB)
    x = p_AB / length
    offset, split = np.asarray(beam.get("offset", [0, 0, 0]), float), beam.get("split", 0.5)
    y = np.asarray(beam["y_axis"], float)
    y = y - x * (x @ y)
    y /= np.linalg.norm(y)
    c, sn = math.cos(beam.get("roll", 0.0)), math.sin(beam.get("roll", 0.0))
    y = c * y + sn * np.cross(x, y)
    R = np.column_stack([x, y, np.cross(x, y)])
    s = section_stiffness(beam)

    # rigid arms from the beam's end E2 = B + offset to B, and from S to B
    R6 = np.kron(np.eye(2), R)
    K_E2 = R6 @ np.linalg.inv(tip_compliance(s, length, beam.get("theory", "timoshenko") == "timoshenko")) @ R6.T
    Ad_E2S = transport(p_AB + offset - split * p_AB)
    K_S = Ad_E2S.T @ K_E2 @ Ad_E2S
    K_S = 0.5 * (K_S + K_S.T)

    mass, com, inertia = body
    parts = []
    if beam.get("parts", "from-link") == "uniform":
        for a, b in ((0.0, split), (split, 1.0)):
            m, l = mass * (b - a), (b - a) * length
            I = m * np.diag([s["i_y2"] + s["i_z2"], l * l / 12 + s["i_y2"], l * l / 12 + s["i_z2"]])
            parts.append((m, offset + 0.5 * (a + b) * p_AB, R @ I @ R.T))
    else:
        along = com @ x
        lateral = com - along * x
        c1, c2 = 0.5 * split * length, 0.5 * (1 + split) * length
        m2 = mass * (along - c1) / (c2 - c1)
        pieces = [(mass - m2, c1 * x + lateral), (m2, c2 * x + lateral)]
        rest = inertia - sum(about_point(m, p - com) for m, p in pieces)
        parts = [(m, p, rest * m / mass) for m, p in pieces]
    return K_S, split * p_AB, parts


# -----------------------------------------------------------------------------------------------
# arm
class Arm:
    """A robot file as a Pinocchio model; `elastic=False` gives the rigid twin."""

    def __init__(self, path, elastic=True, payload=True, change=None):
        """change: function that edits the parsed file before it is used."""
        path = Path(path)
        path = path / "robot.toml" if path.is_dir() else path
        self.file = tomllib.loads(path.read_text())
        if change:
            change(self.file)
        self.links, self.joints = read_urdf(path.parent / self.file["urdf"])
        flexible = {f["link"]: f for f in self.file.get("flexible_link", [])} if elastic else {}
        tcp = self.file["tcp"]
        self.model = pin.Model()
        self.model.gravity.linear = np.array(self.file.get("gravity", [0, 0, -9.81]))
        self.actuated, self.elastic, blocks, self.parts = [], [], [], {}
        load = self.file.get("payload") if payload else None

        def visit(link, parent, X):
            body = self.links[link]
            if load and load.get("link", tcp["link"]) == link:
                xx, yy, zz, xy, xz, yz = load.get("inertia", [0.0] * 6)
                I = pin.Inertia(load["mass"], np.array(load["com"], float), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
                self.model.appendBodyToJoint(parent, I, X)
            if link in flexible:
                f = flexible[link]
                assert f.get("segments", 2) == 2 and f.get("model", "lumped") == "lumped"
                on = [j for j in self.joints if j["parent"] == link]
                distal = next(j for j in on if j["name"] == f.get("distal", on[0]["name"]))
                K_S, p_S, parts = beam_link(f["beam"], distal["X"].translation, body)
                self.parts[link] = parts
                blocks.append(K_S)
                append(parent, X, *parts[0])
                S = pin.SE3(np.eye(3), p_S)
                parent = self.model.addJoint(parent, pin.JointModelTranslation(), X * S, f"elt_{link}")
                parent = self.model.addJoint(parent, pin.JointModelSphericalZYX(), pin.SE3.Identity(), f"elr_{link}")
                X = S.inverse()
                append(parent, X, *parts[1])
            elif body:
                append(parent, X, *body)
            if link == tcp["link"]:
                here = X * pin.SE3(rpy_matrix(tcp.get("rpy", [0, 0, 0])), np.array(tcp.get("xyz", [0, 0, 0]), float))
                self.model.addFrame(pin.Frame("tcp", parent, 0, here, pin.FrameType.OP_FRAME))
                self.model.addFrame(pin.Frame("tcp_link", parent, 0, X, pin.FrameType.OP_FRAME))
            for j in self.joints:
                if j["parent"] == link:
                    at = X * j["X"]
                    if j["type"] == "fixed":
                        visit(j["child"], parent, at)
                    else:
                        unaligned = pin.JointModelPrismaticUnaligned if j["type"] == "prismatic" else pin.JointModelRevoluteUnaligned
                        axis = j["axis"] / np.linalg.norm(j["axis"])
                        visit(j["child"], self.model.addJoint(parent, unaligned(axis), at, j["name"]), pin.SE3.Identity())

        def append(parent, X, mass, com, inertia):
            self.model.appendBodyToJoint(parent, pin.Inertia(mass, np.asarray(com, float), inertia), X)

        children = {j["child"] for j in self.joints}
        visit(next(l for l in self.links if l not in children), 0, pin.SE3.Identity())

        for i in range(1, self.model.njoints):
            idx, name = self.model.joints[i].idx_q, self.model.names[i]
            if name.startswith("elt_"):
                self.elastic += [idx, idx + 1, idx + 2]
            elif name.startswith("elr_"):
                self.elastic += [idx + 2, idx + 1, idx]           # Pinocchio: z, y, x
            else:
                self.actuated.append(idx)
        self.names = [j["name"] for j in self.joints if j["type"] != "fixed"]
        self.limits = [j["limit"] for j in self.joints if j["type"] != "fixed"]
        self.data = self.model.createData()
        self.tcp = self.model.getFrameId("tcp")
        self.K = sl.block_diag(*blocks) if blocks else np.zeros((0, 0))

    def full(self, q_a, e=0.0):
        q = np.zeros(self.model.nq)
        q[self.actuated] = q_a
        q[self.elastic] = e
        return q

    def pose(self, q_a, e=0.0):
        pin.framesForwardKinematics(self.model, self.data, self.full(q_a, e))
        return self.data.oMf[self.tcp].copy()

    def jacobian(self, q_a, e=0.0, frame="tcp"):
        """6 x n, linear first, at the frame's origin, world axes; frame: tcp or tcp_link."""
        at = self.model.getFrameId(frame)
        return pin.computeFrameJacobian(self.model, self.data, self.full(q_a, e), at, pin.LOCAL_WORLD_ALIGNED)

    def mass_matrix(self, q_a, e=0.0):
        M = np.triu(pin.crba(self.model, self.data, self.full(q_a, e)))
        return M + np.triu(M, 1).T

    def gravity_stiffness(self, q, step=1e-5):
        """dg/dq of all coordinates, by central differences of the gravity forces; symmetric up to
        rounding.

        Not pin.computeGeneralizedGravityDerivatives: it omits dS/dq of the ZYX joint (Pinocchio
        4.1).
        """
        gravity = lambda x: pin.computeGeneralizedGravity(self.model, self.data, x).copy()
        return np.column_stack([(gravity(q + d) - gravity(q - d)) / (2 * step) for d in step * np.eye(self.model.nv)])

    def statics(self, q_a):
        """Elastic coordinates at rest under gravity, actuated joints held."""
        e, sub = np.zeros(len(self.elastic)), np.ix_(self.elastic, self.elastic)
        for _ in range(30):
            q = self.full(q_a, e)
            g = pin.computeGeneralizedGravity(self.model, self.data, q)[self.elastic]
            de = -np.linalg.solve(self.K + self.gravity_stiffness(q)[sub], self.K @ e + g)
            e = e + de
            if np.abs(de).max(initial=0) < 1e-16:
                break
        return e

    def modes(self, q_a, joint_stiffness=None, links=True):
        """Undamped frequencies in Hz about rest: elastic links, and joints if their stiffness is
        given."""
        e = self.statics(q_a)
        free, K = (list(self.elastic), self.K) if links else ([], np.zeros((0, 0)))
        if joint_stiffness is not None:
            free, K = free + self.actuated, sl.block_diag(K, np.diag(joint_stiffness))
        sub = np.ix_(free, free)
        dg = self.gravity_stiffness(self.full(q_a, e))[sub]
        Kt = K + 0.5 * (dg + dg.T)
        return np.sqrt(sl.eigh(Kt, self.mass_matrix(q_a, e)[sub], eigvals_only=True)) / (2 * np.pi)

    def compliance(self, q_a, joint_stiffness=None, links=True, frame="tcp"):
        """6x6 at the TCP, world axes, m/N ... rad/(N m); without the small softening by gravity."""
        J, C = self.jacobian(q_a, frame=frame), np.zeros((6, 6))
        if links:
            C += J[:, self.elastic] @ np.linalg.solve(self.K, J[:, self.elastic].T)
        if joint_stiffness is not None:
            C += J[:, self.actuated] @ np.diag(1 / np.asarray(joint_stiffness)) @ J[:, self.actuated].T
        return C
