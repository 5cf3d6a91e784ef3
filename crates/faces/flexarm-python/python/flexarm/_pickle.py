"""Functions that recreate pickled objects in another process."""

from __future__ import annotations

from typing import Any, Dict, Optional, Tuple

from . import _flexarm
from ._flexarm import Arm, Motion, Robot, Scenario
from ._flexarm import load as _load
from ._flexarm import robot as _robot


def load(path: Any, choices: Dict[str, Any]) -> Robot:
    return _load(path, **choices)


def robot(keys: Dict[str, Any], folder: Any, urdf: Optional[str] = None) -> Robot:
    return _robot(keys, folder, urdf=urdf)


def arm(robot: Robot, choices: Tuple[Optional[str], Optional[str], Optional[int], Optional[int]]) -> Arm:
    links, drives, segments, modes = choices
    return robot.flexible(links=links, drives=drives, segments=segments, modes=modes)  # type: ignore[arg-type]


def motion_of_samples(t: Any, q: Any, name: str) -> Motion:
    return Motion(t, q, name=name)


def motion_again(robot: Robot, source: Any, *read: Any) -> Motion:
    if isinstance(source, Motion):
        return source.on(robot)
    topic, columns, round_corners = read
    return robot.motion(source, topic=topic, columns=columns, round_corners=round_corners)


def scenario(motion: Any, loads: Any, payloads: Any, start: Any) -> Scenario:
    return Scenario(motion, loads=loads, payloads=payloads, start=start)


def motion_of_pieces(robot: Robot, name: str, duration: float, curves: Any) -> Motion:
    return _flexarm._motion_of_pieces(robot, name, duration, curves)


def result(kind: type, parts: Dict[str, Any]) -> Any:
    return _flexarm._restore(kind, parts)
