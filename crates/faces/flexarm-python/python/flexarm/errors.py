"""Errors by cause, and caveats.

``Error`` is the base class. ``InputError`` means that the same call would fail again (it is a
``ValueError``), ``RunError`` that a run stopped or a result could not be written (a
``RuntimeError``). Messages state what was found, where, what is expected and how to fix it.
"""

from __future__ import annotations

from typing import Optional


class Error(Exception):
    """Base class of all errors of flexarm."""


class InputError(Error, ValueError):
    """Invalid input: files, values, output locations."""


class RunError(Error, RuntimeError):
    """A run stopped early, or its results could not be written."""


class FileError(InputError):
    """A file or folder is missing, unreadable, or already exists; the content of a table is wrong."""


class RobotError(InputError):
    """An error in a robot file, a file of loads, a job or a link file; with line and column."""


class UrdfError(InputError):
    """An error in the URDF, or links and joints that do not form a tree."""


class MotionError(InputError):
    """An error in a motion, a robot program or a TCP path."""


class LimitsError(MotionError):
    """The motion exceeds joint limits."""


class SettingError(InputError):
    """An invalid number or word in a keyword argument."""


class ModellingError(InputError):
    """Links, drives or balancers that cannot be modelled as requested."""


class PoseError(InputError):
    """Joint values that do not fit the robot, and poses without a solution."""


class LoadError(InputError):
    """A load or a payload that does not fit the robot."""


class IdentifyError(InputError):
    """Measurements that contain no information on the robot, or contradict it."""


class CompensateError(InputError):
    """A motion that cannot be compensated."""


class MapError(InputError):
    """A map that cannot be computed."""


class RecordingError(InputError):
    """A recording that cannot be read, written or reported as requested."""


class LinkError(InputError):
    """A link that could not be created from a mesh or from matrices."""


class StepError(RunError):
    """The simulation could not continue."""


class WriteError(RunError):
    """A result could not be written."""


class Stopped(RunError):
    """An observer stopped the run."""


class Caveat(UserWarning):
    """A probable mistake in an input, or a limit of the validity of a result.

    Attributes
    ----------
    message : str
        The whole message in one sentence.
    severity : str
        ``"warning"`` or ``"note"``; notes are not issued as warnings.
    code : str
        Short, stable name of the kind of caveat.
    where : str
        Subject: a link, a joint, the payload, a file.
    value, yardstick : float or None
        Found value, and the value it is compared with, in ``unit``.
    unit : str
    likely : str
        Mistake that would explain it.
    help : str
        What to check, or how to fix it.
    """

    def __init__(
        self,
        message: str,
        *,
        severity: str = "warning",
        code: str = "",
        where: str = "",
        value: Optional[float] = None,
        yardstick: Optional[float] = None,
        unit: str = "",
        likely: str = "",
        help: str = "",
    ) -> None:
        super().__init__(message)
        self.message = message
        self.severity = severity
        self.code = code
        self.where = where
        self.value = value
        self.yardstick = yardstick
        self.unit = unit
        self.likely = likely
        self.help = help

    def __repr__(self) -> str:
        return f"<Caveat {self.code}: {self.message}>"


for _class in [c for c in list(globals().values()) if isinstance(c, type) and issubclass(c, (Error, Caveat))]:
    _class.__module__ = "flexarm"
