"""What goes wrong, by cause, and what is doubtful.

``Error`` is above all; ``InputError`` means that the same call would fail again (it is a ``ValueError``), ``RunError`` that a run
stopped or a result could not be written (a ``RuntimeError``). Messages say what was found, where, what is expected and how to mend it.
"""

from __future__ import annotations

from typing import Optional


class Error(Exception):
    """Anything that keeps an answer from being given."""


class InputError(Error, ValueError):
    """What was given makes no sense: files, values, places of results."""


class RunError(Error, RuntimeError):
    """A run stopped on its way, or its results could not be written."""


class FileError(InputError):
    """A file or folder is not there, not readable, or taken."""


class RobotError(InputError):
    """Something in a robot file, a file of loads, a job or a link file; with line and column."""


class UrdfError(InputError):
    """Something in the URDF, or links and joints that make no tree."""


class MotionError(InputError):
    """Something in a motion, a robot program or a path of the tool."""


class LimitsError(MotionError):
    """The motion asks for more than the joints can do."""


class SettingError(InputError):
    """A number or a word of a keyword argument that makes no sense."""


class ModellingError(InputError):
    """Links, drives or balancers that cannot be modelled as asked for."""


class PoseError(InputError):
    """Joint values that do not fit the robot, and poses without an answer."""


class LoadError(InputError):
    """A load or a payload that does not fit the robot."""


class IdentifyError(InputError):
    """Measurements that tell nothing of the robot, or cannot be of it."""


class CompensateError(InputError):
    """A motion that cannot be compensated."""


class MapError(InputError):
    """A map that cannot be taken."""


class RecordingError(InputError):
    """A recording that cannot be read, written or reported as asked for."""


class LinkError(InputError):
    """A link that could not be made of a mesh or of matrices."""


class StepError(RunError):
    """The simulation could not go on."""


class WriteError(RunError):
    """A result could not be written."""


class Stopped(RunError):
    """An observer ended the run."""


class Caveat(UserWarning):
    """What is probably wrong with an input, or limits the worth of a result.

    Attributes
    ----------
    message : str
        All of it in one sentence.
    severity : str
        ``"warning"`` or ``"note"``; notes are not warned of.
    code : str
        Short, stable name of its kind.
    where : str
        What it is about: a link, a joint, the payload, a file.
    value, yardstick : float or None
        What was found, and what it is compared with, in ``unit``.
    unit : str
    likely : str
        The slip that would explain it.
    help : str
        What to look at, or how to mend it.
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
