"""Messages to the logger ``"flexarm"``.

Notes, steps of long calls and written files are logged at INFO, finished runs at DEBUG, findings
about a new robot at WARNING. Caveats of severity warning are Python warnings instead.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from typing import Any

logger = logging.getLogger("flexarm")
# Nothing is printed unless the application configures logging.
logger.addHandler(logging.NullHandler())


def notes(caveats: Iterable[Any]) -> None:
    """Log caveats of severity note; each is also available as ``record.caveat``."""
    for caveat in caveats:
        logger.info("note: %s", caveat.message, extra={"caveat": caveat})


def step(what: str, number: int, of: int) -> None:
    """Log the start of a step of a long call."""
    logger.info("%s (%d of %d)", what, number, of)


def _paths(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for part in value.values():
            yield from _paths(part)
    elif isinstance(value, list):
        for part in value:
            yield from _paths(part)


def wrote(figures: dict[str, Any]) -> None:
    """Log the files listed in a result."""
    paths = {path: None for key in ("file", "page", "files") for path in _paths(figures.get(key))}
    for path in paths:
        logger.info("wrote %s", path)


def doubts(findings: Iterable[dict[str, Any]]) -> None:
    """Log findings about a newly created robot."""
    for finding in findings:
        logger.warning("%s: %s", finding["where"], finding["message"], extra={"finding": finding})


def warnings(sentences: Iterable[str]) -> None:
    """Log warnings about files written for other programs."""
    for sentence in sentences:
        logger.warning("%s", sentence)


def ran(run: str) -> None:
    """Log the end of a run."""
    logger.debug("ran %s", run)
