"""What the command line says besides its answer, through ``logging``: the logger is ``"flexarm"``.

Caveats that warn are Python's ``warnings``; here are notes, steps of long work and files that were written (INFO), and runs that
ended (DEBUG).
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from typing import Any

logger = logging.getLogger("flexarm")
# Nothing is printed unless the program that uses the package asks for it.
logger.addHandler(logging.NullHandler())


def notes(caveats: Iterable[Any]) -> None:
    """Caveats that only tell; each is ``record.caveat`` as well."""
    for caveat in caveats:
        logger.info("note: %s", caveat.message, extra={"caveat": caveat})


def step(what: str, number: int, of: int) -> None:
    """A step of long work that begins."""
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
    """Files that an answer names."""
    told = {path: None for key in ("file", "page", "files") for path in _paths(figures.get(key))}
    for path in told:
        logger.info("wrote %s", path)


def doubts(findings: Iterable[dict[str, Any]]) -> None:
    """Findings about a robot that was just made."""
    for finding in findings:
        logger.warning("%s: %s", finding["where"], finding["message"], extra={"finding": finding})


def warnings(sentences: Iterable[str]) -> None:
    """What is doubtful about files that were written for other programs."""
    for sentence in sentences:
        logger.warning("%s", sentence)


def ran(run: str) -> None:
    """A run that ended."""
    logger.debug("ran %s", run)
