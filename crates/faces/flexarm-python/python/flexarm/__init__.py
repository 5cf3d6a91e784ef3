"""Robot arms with flexible links.

>>> import flexarm
>>> arm = flexarm.load("kr210").flexible(links="modal", drives="elastic")
>>> run = arm.simulate()
>>> run.error.shape[1]
3

:func:`load` reads a robot, :meth:`Robot.flexible` adds flexible links and drives. The methods of
the resulting :class:`Arm` take and return numpy arrays: :meth:`Arm.simulate`, :meth:`Arm.statics`,
:meth:`Arm.modes`, :meth:`Arm.response`, :meth:`Arm.linearise`. Quantities are in SI units;
six-vectors have the linear part first. Errors derive from :class:`flexarm.Error`. Probable mistakes
in an input and limits of a result are warnings of the class :class:`flexarm.Caveat`.
"""

from pathlib import Path as _Path
from typing import TYPE_CHECKING as _TYPE_CHECKING
from typing import Any as _Any

from . import _flexarm
from ._flexarm import (
    Arm,
    Compensated,
    Deflections,
    Linear,
    Live,
    LiveState,
    Load,
    Map,
    Model,
    Modes,
    Motion,
    OperatingPoint,
    Payload,
    Response,
    Robot,
    Run,
    Sample,
    Scenario,
    Statics,
    __version__,
    check,
    compensate,
    export_link,
    identify,
    import_link,
    load,
    lobes,
    map,
    new_robot,
    plan_measurements,
    reduce,
    robot,
    sensitivity,
    sweep,
)
from ._build import RobotBuilder
from ._web import WebPage, web
from .errors import (
    Caveat,
    CompensateError,
    Error,
    FileError,
    IdentifyError,
    InputError,
    LimitsError,
    LinkError,
    LoadError,
    MapError,
    ModellingError,
    MotionError,
    PoseError,
    RecordingError,
    RobotError,
    RunError,
    SettingError,
    StepError,
    Stopped,
    UrdfError,
    WriteError,
)

Arm.linearize = Arm.linearise

__all__ = [
    "Arm",
    "Caveat",
    "CompensateError",
    "Compensated",
    "Deflections",
    "Error",
    "FileError",
    "IdentifyError",
    "InputError",
    "LimitsError",
    "Linear",
    "LinkError",
    "Live",
    "LiveState",
    "Load",
    "LoadError",
    "Map",
    "MapError",
    "Model",
    "ModellingError",
    "Modes",
    "Motion",
    "MotionError",
    "OperatingPoint",
    "Payload",
    "PoseError",
    "RecordingError",
    "Response",
    "Robot",
    "RobotBuilder",
    "RobotError",
    "Run",
    "RunError",
    "Sample",
    "Scenario",
    "SettingError",
    "Statics",
    "StepError",
    "Stopped",
    "UrdfError",
    "WebPage",
    "WriteError",
    "__version__",
    "check",
    "compensate",
    "export_link",
    "identify",
    "import_link",
    "load",
    "lobes",
    "map",
    "new_robot",
    "plan_measurements",
    "reduce",
    "robot",
    "sensitivity",
    "sweep",
    "web",
]

#: Robots and motions included in the package.
_SHARE = _Path(__file__).parent / "share"

_flexarm.ship_from(_SHARE)

if _TYPE_CHECKING:
    from . import types as types


def __getattr__(name: str) -> _Any:
    # Used only by annotations, hence imported on first use.
    if name == "types":
        import importlib

        return importlib.import_module("flexarm.types")
    raise AttributeError(f"module 'flexarm' has no attribute {name!r}")
