"""Conversion of tables to pyarrow, pandas and polars."""

from __future__ import annotations

from typing import Any


def _module(name: str) -> Any:
    import importlib

    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        package = name.partition(".")[0]
        raise ModuleNotFoundError(f"this needs {name}: pip install {package}", name=name) from error


def to_arrow(run: Any) -> Any:
    return _module("pyarrow").table(run)


def to_pandas(run: Any) -> Any:
    return _module("pandas").DataFrame(run.table()).set_index("time")


def to_polars(run: Any) -> Any:
    return _module("polars").DataFrame(run)
