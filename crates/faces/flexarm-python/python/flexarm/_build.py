"""Building robots in code: the contents of a URDF and of a robot file."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Optional, Union
from xml.sax.saxutils import quoteattr

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ._flexarm import Robot

_Path = Union[str, "os.PathLike[str]"]


def plain(value: Any, name: str = "") -> Any:
    """Convert to robot file values: arrays to lists, paths to text, without None."""
    if isinstance(value, dict):
        inner = f"{name}." if name else ""
        return {str(key): plain(v, f"{inner}{key}") for key, v in value.items() if v is not None}
    if isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ValueError(f"{name} is {value}: expected a finite number")
        return value
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):  # numpy arrays and scalars
        return plain(value.tolist(), name)
    if isinstance(value, (list, tuple)):
        return [plain(v, f"{name}[{k}]") for k, v in enumerate(value)]
    raise TypeError(f"{name} is {type(value)}: expected numbers, text, lists and dicts as a robot file has them")


def json_of(keys: Any) -> str:
    """The keys as JSON."""
    return json.dumps(plain(keys))


def _numbers(name: str, value: ArrayLike, *shapes: tuple[int, ...]) -> Any:
    """Check numbers against several allowed shapes and return lists; a number for the shape ()."""
    import numpy as np

    try:
        array = np.asarray(value)
        wrong = array.dtype.kind not in "fiu"
    except ValueError:
        wrong = True
    if wrong:
        raise ValueError(f"{name} is {value!r}: expected real numbers")
    if array.shape not in shapes:
        expected = " or ".join(map(str, shapes))
        raise ValueError(f"{name} has the shape {array.shape}, expected {expected}")
    array = array.astype(float)
    if not np.isfinite(array).all():
        raise ValueError(f"{name} is {array.tolist()}: expected finite numbers")
    return array.tolist()


def _number(name: str, value: Any) -> Any:
    return None if value is None else _numbers(name, value, ())


def _inertia(value: Optional[ArrayLike]) -> Optional[list[float]]:
    """Convert a symmetric matrix or ixx iyy izz ixy ixz iyz to the latter."""
    if value is None:
        return None
    found = _numbers("inertia", value, (3, 3), (6,))
    if len(found) == 6:
        return list(found)
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = found
    size = max(abs(x) for row in found for x in row)
    if max(abs(xy - yx), abs(xz - zx), abs(yz - zy)) > 1e-9 * size:
        raise ValueError("inertia is not symmetric")
    return [xx, yy, zz, xy, xz, yz]


class RobotBuilder:
    """Builds a robot from links and joints or a URDF, with tool, payload, flexible links, drives.

    Every method returns the builder, :meth:`build` the robot. Entries of a robot file that have no
    method of their own are added with :meth:`add`; ``flexarm format robot`` lists their keys.

    Parameters
    ----------
    urdf : str or os.PathLike, optional
        A file, or the text, of a URDF or xacro. Without it, use :meth:`link` and :meth:`joint`.
    name : str, default "robot"
        Name for logs and messages.
    folder : path, optional
        Folder to which paths are relative; default: that of the URDF, or the current one.

    Examples
    --------
    A pendulum of 1 m with a flexible rod and an elastic gearbox:

    >>> builder = flexarm.RobotBuilder(name="pendulum")
    >>> builder = builder.link("base").link("rod", 2.0, com=[0, 0, -0.5], inertia=[0.17, 0.17, 0.001, 0, 0, 0]).link("tool0")
    >>> builder = builder.joint("hinge", "base", "rod", axis=[0, 1, 0], lower=-3, upper=3, velocity=2)
    >>> builder = builder.joint("tip", "rod", "tool0", "fixed", xyz=[0, 0, -1])
    >>> builder = builder.beam("rod", "circle", diameter=0.02, material="steel", distal="tip")
    >>> builder = builder.drive("hinge", stiffness=5e3, damping=5.0).payload(1.0)
    >>> arm = builder.build().flexible()
    >>> arm.elements
    ('hinge', 'rod')

    A loaded robot with another payload:

    >>> robot = flexarm.RobotBuilder.of(flexarm.load("kr210")).payload(50.0, com=[0, 0, 0.1]).build()
    """

    def __init__(
        self, urdf: Optional[_Path] = None, *, name: Optional[str] = None, folder: Optional[_Path] = None
    ) -> None:
        self._keys: dict[str, Any] = {}
        self._links: list[str] = []
        self._joints: list[str] = []
        self._text: Optional[str] = None
        self._folder = None if folder is None else Path(folder)
        if urdf is not None:
            if isinstance(urdf, str) and urdf.lstrip().startswith("<"):
                self._text = urdf
            else:
                file = Path(urdf).absolute()
                self._keys["urdf"] = str(file)
                self._folder = self._folder or file.parent
        if name is not None or urdf is None:
            self._keys["name"] = "robot" if name is None else name

    @classmethod
    def of(cls, robot: Robot) -> RobotBuilder:
        """Start from a loaded or built robot.

        Parameters
        ----------
        robot : Robot

        Returns
        -------
        RobotBuilder
        """
        keys, folder, text, choices = robot._made_of()  # type: ignore[attr-defined]
        builder = cls(folder=folder)
        builder._keys, builder._text = plain(keys), text
        builder._loaded_with(**choices)
        return builder

    def _loaded_with(
        self,
        tcp: Optional[str] = None,
        packages: Any = None,
        arguments: Any = None,
        waive_inertia: Any = None,
        **estimates: Optional[float],
    ) -> None:
        """Set options of :func:`flexarm.load` as keys."""
        if tcp is not None:
            self._keys["tcp"] = {"link": tcp}
        for key, more in [("packages", packages), ("args", arguments)]:
            if more:
                self._keys.setdefault(key, {}).update(plain(more))
        if waive_inertia:
            self._keys.setdefault("waive_inertia", []).extend(waive_inertia)
        self._keys.update(plain(estimates))

    def link(
        self,
        name: str,
        mass: float = 0.0,
        com: ArrayLike = (0.0, 0.0, 0.0),
        inertia: Optional[ArrayLike] = None,
    ) -> RobotBuilder:
        """Add a rigid body, or a frame if it has no mass.

        Parameters
        ----------
        name : str
        mass : float, default 0
            kg.
        com : array_like, shape (3,), default (0, 0, 0)
            Centre of mass in link axes (m).
        inertia : array_like, shape (3, 3) or (6,), optional
            About the centre of mass, link axes (kg m²): a matrix, or ixx, iyy, izz, ixy, ixz, iyz.
            Default: zero.

        Returns
        -------
        RobotBuilder
        """
        self._own_tree("link")
        inner = ""
        if _number("mass", mass) != 0.0:
            xyz = _text(_numbers("com", com, (3,)))
            entries = zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), _inertia(inertia) or [0.0] * 6)
            body = " ".join(f'{key}="{value!r}"' for key, value in entries)
            inner = f'<inertial><origin xyz="{xyz}"/><mass value="{float(mass)!r}"/><inertia {body}/></inertial>'
        self._links.append(f"<link name={quoteattr(name)}>{inner}</link>")
        return self

    def joint(
        self,
        name: str,
        parent: str,
        child: str,
        kind: Literal["revolute", "continuous", "prismatic", "fixed"] = "revolute",
        *,
        xyz: ArrayLike = (0.0, 0.0, 0.0),
        rpy: ArrayLike = (0.0, 0.0, 0.0),
        axis: ArrayLike = (0.0, 0.0, 1.0),
        lower: Optional[float] = None,
        upper: Optional[float] = None,
        velocity: float = 0.0,
        effort: float = 0.0,
    ) -> RobotBuilder:
        """Join two links; the frame of the joint is the frame of the child.

        Parameters
        ----------
        name, parent, child : str
        kind : {"revolute", "continuous", "prismatic", "fixed"}, default "revolute"
        xyz, rpy : array_like, shape (3,), default (0, 0, 0)
            Pose of the child in the parent at joint value 0 (m; roll, pitch, yaw in rad).
        axis : array_like, shape (3,), default (0, 0, 1)
            Axis in child axes.
        lower, upper : float, optional
            Limits (rad or m); required for revolute and prismatic joints.
        velocity, effort : float, default 0
            Maximum speed and effort (rad/s or m/s, N m or N); 0 means unknown.

        Returns
        -------
        RobotBuilder
        """
        self._own_tree("joint")
        if kind not in ("revolute", "continuous", "prismatic", "fixed"):
            raise ValueError(f'kind={kind!r}: expected one of "revolute", "continuous", "prismatic", "fixed"')
        limited = kind in ("revolute", "prismatic")
        if limited and (lower is None or upper is None):
            raise ValueError(f"joint {name!r}: a {kind} joint needs lower and upper (rad or m); without limits it is continuous")
        place = f'xyz="{_text(_numbers("xyz", xyz, (3,)))}" rpy="{_text(_numbers("rpy", rpy, (3,)))}"'
        parts = [f"<parent link={quoteattr(parent)}/><child link={quoteattr(child)}/><origin {place}/>"]
        if kind != "fixed":
            parts.append(f'<axis xyz="{_text(_numbers("axis", axis, (3,)))}"/>')
            most = f'effort="{_number("effort", effort)!r}" velocity="{_number("velocity", velocity)!r}"'
            ends = f'lower="{_number("lower", lower)!r}" upper="{_number("upper", upper)!r}" ' if limited else ""
            parts.append(f"<limit {ends}{most}/>")
        self._joints.append(f'<joint name={quoteattr(name)} type="{kind}">{"".join(parts)}</joint>')
        return self

    def tcp(
        self, link: str, xyz: ArrayLike = (0.0, 0.0, 0.0), rpy: ArrayLike = (0.0, 0.0, 0.0)
    ) -> RobotBuilder:
        """Place the TCP on a link; default: on ``tool0``, or at the end of the longest chain.

        Parameters
        ----------
        link : str
        xyz, rpy : array_like, shape (3,), default (0, 0, 0)
            Pose in link axes (m; roll, pitch, yaw in rad).

        Returns
        -------
        RobotBuilder
        """
        self._keys["tcp"] = {"link": link, "xyz": _numbers("xyz", xyz, (3,)), "rpy": _numbers("rpy", rpy, (3,))}
        return self

    def payload(
        self,
        mass: float,
        com: ArrayLike = (0.0, 0.0, 0.0),
        inertia: Optional[ArrayLike] = None,
        link: Optional[str] = None,
    ) -> RobotBuilder:
        """Attach the payload to a link, replacing the previous one.

        Parameters
        ----------
        mass : float
            kg; 0 for none.
        com : array_like, shape (3,), default (0, 0, 0)
            Centre of mass in link axes (m).
        inertia : array_like, shape (3, 3) or (6,), optional
            About the centre of mass (kg m²). Default: a point mass.
        link : str, optional
            Default: the link of the tool.

        Returns
        -------
        RobotBuilder
        """
        self._keys.pop("payload", None)
        if _number("mass", mass) != 0.0:
            body = {"link": link, "mass": _number("mass", mass), "com": _numbers("com", com, (3,)), "inertia": _inertia(inertia)}
            self._keys["payload"] = plain(body)
        return self

    def gravity(self, g: ArrayLike) -> RobotBuilder:
        """Set the acceleration of gravity in base axes, (3,) (m/s²). Default: (0, 0, -9.81)."""
        self._keys["gravity"] = _numbers("g", g, (3,))
        return self

    def beam(
        self,
        link: str,
        section: Literal["box", "rectangle", "tube", "circle", "i_beam", "channel", "given"],
        *,
        material: Union[str, dict[str, float], None] = None,
        y_axis: Optional[ArrayLike] = None,
        distal: Optional[str] = None,
        model: Optional[Literal["lumped", "modal"]] = None,
        segments: Optional[int] = None,
        modes: Optional[int] = None,
        damping: Union[float, dict[str, Any], None] = None,
        geometric_stiffening: Optional[bool] = None,
        mass: Optional[float] = None,
        parts: Optional[Literal["from-link", "uniform"]] = None,
        **dimensions: float,
    ) -> RobotBuilder:
        """Make a link flexible: a beam from its frame to its distal joint.

        Parameters
        ----------
        link : str
        section : {"box", "rectangle", "tube", "circle", "i_beam", "channel", "given"}
        material : str or dict, optional
            ``"steel"``, ``"aluminium"``, ... or ``{"E": Pa, "nu": ratio, "rho": kg/m³}``; required
            except for given sections.
        y_axis : array_like, shape (3,), optional
            Direction of the section's y axis, in link axes.
        distal : str, optional
            Joint at the far end. Default: the only joint after the link.
        model : {"lumped", "modal"}, optional
            Rigid parts joined by springs, or one body with modes. Default: ``"lumped"``.
        segments, modes : int, optional
            Number of parts, or of modes.
        damping : float or dict, optional
            Damping ratio of each mode (0.03), or ``{"stiffness_beta": s}``,
            ``{"rayleigh": [1/s, s]}``.
        geometric_stiffening : bool, optional
            Whether loads and speeds change the stiffness of modal links.
        mass : float, optional
            Mass of the link, overriding its own (kg).
        parts : {"from-link", "uniform"}, optional
            Cut the link's own inertia, or distribute its mass along the beam.
        **dimensions : float
            Dimensions of the section (m): ``width``, ``height``, ``wall``, ``outer_diameter``,
            ``diameter``, ``web``, ``flange``, ``fillet``; for given ones ``EA``, ``EI_y``,
            ``EI_z``, ``GJ``, ``mass_per_length``, ...; also ``roll``, ``split``, ``theory``,
            ``offset``.

        Returns
        -------
        RobotBuilder
        """
        y = None if y_axis is None else _numbers("y_axis", y_axis, (3,))
        beam = {"section": section, "material": material, "y_axis": y, "parts": parts, **dimensions}
        choices = {"distal": distal, "model": model, "segments": segments, "modes": modes, "mass": mass}
        choices |= {"damping": _damping(damping), "geometric_stiffening": geometric_stiffening}
        return self._flexible(link, {"beam": beam, **choices})

    def reduced(
        self,
        link: str,
        file: _Path,
        *,
        distal: Optional[str] = None,
        model: Optional[Literal["lumped", "modal"]] = None,
        segments: Optional[int] = None,
        modes: Optional[int] = None,
        eigenmodes: Optional[int] = None,
        damping: Union[float, dict[str, Any], None] = None,
        geometric_stiffening: Optional[bool] = None,
    ) -> RobotBuilder:
        """Make a link flexible by a ``.flex`` file.

        The file is written by :func:`flexarm.reduce` or :func:`flexarm.import_link`.

        Parameters
        ----------
        link : str
        file : path
        distal : str, optional
            Joint at the far end. Default: the only joint after the link.
        model : {"lumped", "modal"}, optional
            Rigid parts joined by springs, or one body with modes. Default: ``"lumped"``.
        segments, modes, eigenmodes : int, optional
            Number of parts, of fixed-interface modes, or of eigenmodes.
        damping : float or dict, optional
            Damping ratio of each mode (0.03), or ``{"stiffness_beta": s}``,
            ``{"rayleigh": [1/s, s]}``.
        geometric_stiffening : bool, optional
            Whether loads and speeds change the stiffness of modal links.

        Returns
        -------
        RobotBuilder
        """
        choices = {"distal": distal, "model": model, "segments": segments, "modes": modes, "eigenmodes": eigenmodes}
        choices |= {"damping": _damping(damping), "geometric_stiffening": geometric_stiffening}
        return self._flexible(link, {"reduced": os.fspath(file), **choices})

    def drive(
        self,
        joint: str,
        kind: Optional[Literal["prescribed", "gearbox", "torque"]] = None,
        *,
        stiffness: Optional[ArrayLike] = None,
        damping: Optional[ArrayLike] = None,
        backlash: Optional[ArrayLike] = None,
        curve: Optional[ArrayLike] = None,
        ratio: Optional[float] = None,
        motor_inertia: Optional[float] = None,
        torque_limit: Optional[float] = None,
        friction: Optional[dict[str, float]] = None,
        servo: Optional[dict[str, Any]] = None,
        **gearbox: Any,
    ) -> RobotBuilder:
        """Set the drive of a joint, replacing an earlier one.

        Without a drive, a joint follows the motion exactly.

        Parameters
        ----------
        joint : str
        kind : {"prescribed", "gearbox", "torque"}, optional
            The joint follows the motion exactly; the motor follows it and a spring drives the link;
            or a servo drives the motor. Default: ``"gearbox"`` if there is a stiffness or a curve,
            otherwise ``"prescribed"``.
        stiffness : float or array_like, shape (3,), (6,) or (6, 6), optional
            Stiffness of the gearbox about the axis (N m/rad), about x, y, z, or of all directions.
        damping : float or array_like, shape (3,) or (6,), optional
            Damping in the same form (N m s/rad). Default: 3 % modal.
        backlash : float or array_like, shape (3,) or (6,), optional
            Play to each side (rad), in the form of the stiffness.
        curve : array_like, shape (m, 2), optional
            Points (rad, N m), instead of stiffness and backlash.
        ratio : float, optional
            Motor turns per joint turn (1).
        motor_inertia : float, optional
            Rotor inertia on the motor side (kg m²).
        torque_limit : float, optional
            Torque limit of a servo (N m).
        friction, servo : dict, optional
            With the keys of a robot file: ``{"viscous": ..., "coulomb": ...}``,
            ``{"position_gain": ...}``.
        **gearbox
            Further keys of the gearbox: ``transmission_error``, ``hysteresis``.

        Returns
        -------
        RobotBuilder
        """
        gear = {
            "stiffness": None if stiffness is None else _numbers("stiffness", stiffness, (), (3,), (6,), (6, 6)),
            "damping": None if damping is None else _numbers("damping", damping, (), (3,), (6,)),
            "backlash": None if backlash is None else _numbers("backlash", backlash, (), (3,), (6,)),
            "curve": curve,
            **gearbox,
        }
        gear = plain(gear, "gearbox")
        kind = kind or ("gearbox" if "stiffness" in gear or "curve" in gear else "prescribed")
        entry = {"joint": joint, "kind": kind, "ratio": ratio, "motor_inertia": motor_inertia, "gearbox": gear or None}
        entry |= {"torque_limit": torque_limit, "friction": friction, "servo": servo}
        return self._put("drive", "joint", plain(entry, "drive"))

    def add(self, key: str, **values: Any) -> RobotBuilder:
        """Add an entry or a table of a robot file by its keys.

        Parameters
        ----------
        key : str
            Name of the list (``balancer``, ``loop``, ``controller_axis``) or table (``mounting``).
        **values
            Keys of the entry; arrays are converted to lists. ``from`` is written ``from_``.

        Returns
        -------
        RobotBuilder

        Examples
        --------
        >>> spring = {"torque": 1500.0, "zero": 0.0}
        >>> builder = flexarm.RobotBuilder.of(flexarm.load("kr210")).add("balancer", joint="joint_2", sine=spring)
        >>> robot = builder.build()
        """
        entry = plain({name.rstrip("_"): value for name, value in values.items()}, key)
        lists = ("balancer", "loop", "controller_axis", "drive", "flexible_link")
        if key in lists:
            self._keys.setdefault(key, []).append(entry)
        else:
            self._keys.setdefault(key, {}).update(entry)
        return self

    def set(self, **keys: Any) -> RobotBuilder:
        """Set top-level keys of a robot file; None removes a key.

        Parameters
        ----------
        **keys
            For example ``waive_inertia``, ``hold``, ``packages``; arrays are converted to lists.

        Returns
        -------
        RobotBuilder
        """
        for key in keys:
            self._keys.pop(key, None)
        self._keys.update(plain(keys))
        return self

    def default_motion(self, file: _Path) -> RobotBuilder:
        """Set the default motion of the robot, for runs without a motion."""
        self._keys["default_trajectory"] = os.fspath(file)
        return self

    @property
    def keys(self) -> dict[str, Any]:
        """Return the contents of the robot file (dict)."""
        return json.loads(json_of(self._keys))  # type: ignore[no-any-return]

    @property
    def urdf(self) -> Optional[str]:
        """Text of the URDF (str), or None if the URDF is a file."""
        if not self._links:
            return self._text
        name = quoteattr(self._keys.get("name", "robot"))
        return "\n".join([f"<robot name={name}>", *self._links, *self._joints, "</robot>"])

    def build(self) -> Robot:
        """Create the robot.

        Returns
        -------
        Robot

        Raises
        ------
        flexarm.InputError
            If the robot is inconsistent; the message states the cause and how to fix it.
        """
        from ._flexarm import robot

        if self.urdf is None and "urdf" not in self._keys:
            raise ValueError("there are no links: give a urdf, or add links and joints")
        return robot(self.keys, self._folder, urdf=self.urdf)

    def _own_tree(self, what: str) -> None:
        if self._text is not None or "urdf" in self._keys:
            raise ValueError(f"a {what} cannot be added to a URDF: change the URDF, or make the arm of links and joints")

    def _flexible(self, link: str, entry: dict[str, Any]) -> RobotBuilder:
        return self._put("flexible_link", "link", plain({"link": link, **entry}, "flexible_link"))

    def _put(self, key: str, name: str, entry: dict[str, Any]) -> RobotBuilder:
        """Replace the entry of the same link or joint, or append it."""
        entries = self._keys.setdefault(key, [])
        for k, other in enumerate(entries):
            if other.get(name) == entry[name]:
                entries[k] = entry
                return self
        entries.append(entry)
        return self

    def __repr__(self) -> str:
        links, drives = (len(self._keys.get(key, [])) for key in ("flexible_link", "drive"))
        return f"<RobotBuilder {self._keys.get('name', '')!r}: {links} flexible links, {drives} drives>"


def _damping(value: Any) -> Any:
    return {"modal": _number("damping", value)} if value is not None and not isinstance(value, dict) else value


def _text(values: list[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


RobotBuilder.__module__ = "flexarm"
