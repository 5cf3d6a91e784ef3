"""Plots with matplotlib; the axes are returned."""

from __future__ import annotations

from typing import Any

from ._tables import _module


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    _, ax = _module("matplotlib.pyplot").subplots(layout="constrained")
    return ax


def run(run: Any, ax: Any, parts: bool) -> Any:
    """Plot the TCP error over time."""
    import numpy as np

    ax = _axes(ax)
    e = run.error
    ax.plot(run.time, 1e3 * np.linalg.norm(e, axis=1), label="TCP error", color="#b3261e", linewidth=1.4)
    if parts:
        static = run.error_static
        ax.plot(run.time, 1e3 * np.linalg.norm(static, axis=1), label="static", color="#1f5fa8", linewidth=1.0)
        motion = np.linalg.norm(e - static, axis=1)
        ax.plot(run.time, 1e3 * motion, label="dynamic", color="#7a7a7a", linewidth=0.8)
        ax.legend(frameon=False)
    ax.set(xlabel="time (s)", ylabel="distance (mm)", title=f"{run.summary['robot']}: {run.summary['trajectory']}")
    ax.margins(x=0)
    ax.grid(alpha=0.25)
    return ax


def response(response: Any, ax: Any) -> Any:
    """Plot magnitudes over frequency."""
    ax = _axes(ax)
    magnitude = response.magnitude
    for i, source in enumerate(response.inputs):
        for j, output in enumerate(response.outputs):
            ax.loglog(response.frequency, magnitude[i, j], label=f"{output} per {source}", linewidth=1.0)
    ax.set(xlabel="frequency (Hz)", ylabel="magnitude (SI)")
    ax.legend(frameon=False, fontsize="small")
    ax.grid(alpha=0.25, which="both")
    return ax
