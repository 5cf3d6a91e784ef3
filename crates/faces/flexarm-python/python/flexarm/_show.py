"""Output in notebooks and terminals: tables, the viewer, a progress bar."""

from __future__ import annotations

import shutil
import subprocess
import warnings
from html import escape
from typing import Any, Iterable, Optional, Tuple

from .errors import Caveat


def shipped_tools() -> "list[str]":
    """Names of the cutting tools included in the package."""
    from . import _SHARE

    return sorted(file.stem for file in (_SHARE / "robots/tools").glob("*.toml"))


def _table(title: str, rows: Iterable[Tuple[str, str]]) -> str:
    body = "".join(
        f'<tr><th style="text-align:left">{escape(name)}</th><td style="text-align:left">{escape(value)}</td></tr>'
        for name, value in rows
    )
    return f"<table><caption><b>{escape(title)}</b></caption>{body}</table>"


def robot_html(robot: Any) -> str:
    with warnings.catch_warnings():
        # The table says nothing about a pose; those who inspect one are warned.
        warnings.simplefilter("ignore", Caveat)
        found = robot.inspect()
    flexible = ", ".join(link["name"] for link in found["flexible_links"]) or "none"
    return _table(
        f"Robot {robot.name}",
        [
            ("file", str(robot.path)),
            ("joints", ", ".join(robot.joints)),
            ("flexible links", flexible),
            ("tool", robot.tcp_link),
            ("mass", f"{found['mass_kg']:.1f} kg"),
            ("caveats", str(len(robot.caveats))),
        ],
    )


def arm_html(arm: Any) -> str:
    return _table(
        f"Arm {arm.robot.name}",
        [
            ("joints", ", ".join(arm.joints)),
            ("elastic elements", ", ".join(arm.elements)),
            ("elastic coordinates", str(arm.n_elastic)),
        ],
    )


def run_html(run: Any) -> str:
    summary = run.summary
    tcp = summary.get("tcp")
    rows = [
        ("duration", f"{summary['duration_s']:g} s in steps of {1e3 * summary['stepper']['h_s']:g} ms, {len(run)} samples"),
        ("real time factor", f"{summary['real_time_factor']:.0f}"),
    ]
    if tcp:
        rows += [
            ("peak TCP error", f"{1e3 * tcp['peak_m']:.4f} mm"),
            ("RMS", f"{1e3 * tcp['rms_m']:.4f} mm"),
            ("at the end", f"{1e3 * tcp['end_m']:.4f} mm"),
        ]
    rows += [("caveat", caveat.message) for caveat in run.caveats if caveat.severity == "warning"]
    return _table(f"Run {summary['robot']}, {summary['trajectory']}", rows)


def _in_notebook() -> bool:
    try:
        from IPython import get_ipython  # type: ignore[import-not-found,unused-ignore,attr-defined]
    except ImportError:
        return False
    shell = get_ipython()
    return shell is not None and "IPKernelApp" in shell.config


def run(run: Any) -> Optional[Any]:
    """Show the recording of a run in the notebook, or in the viewer."""
    file = run.files.get("rrd")
    if not file:
        raise ValueError("the run has no recording to show: simulate(..., output='folder') writes one")
    if _in_notebook():
        try:
            import rerun as rr  # type: ignore[import-not-found,unused-ignore]
            from rerun.notebook import Viewer  # type: ignore[import-not-found,unused-ignore]
        except ImportError as error:
            raise ModuleNotFoundError("this needs rerun: pip install 'rerun-sdk[notebook]'", name="rerun") from error
        recording = rr.RecordingStream("flexarm")
        viewer = Viewer(recording=recording)
        recording.log_file_from_path(file)
        return viewer
    program = shutil.which("rerun")
    if program is None:
        raise ModuleNotFoundError("this needs the Rerun viewer: pip install rerun-sdk", name="rerun")
    subprocess.Popen([program, file], start_new_session=True)
    return None


class _Bar:
    """A tqdm bar that is called with simulated and total time."""

    def __init__(self, tqdm: Any) -> None:
        self._tqdm = tqdm
        self._bar: Any = None
        self._at = 0.0

    def __call__(self, done: float, total: float) -> None:
        if self._bar is None:
            form = "{l_bar}{bar}| {n:.2f}/{total:.2f} s [{elapsed}<{remaining}]"
            self._bar = self._tqdm(total=total, bar_format=form)
        self._bar.update(done - self._at)
        self._at = done

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()


def progress_bar() -> Optional[_Bar]:
    """Return a progress bar if tqdm is installed."""
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped,unused-ignore]
    except ImportError:
        return None
    return _Bar(tqdm)
