"""A new user in a notebook: the first ten lines in an empty folder, completion, help,
tracebacks."""

import re
from pathlib import Path
from typing import Any, Iterator

import pytest

manager = pytest.importorskip("jupyter_client.manager")
pytest.importorskip("ipykernel")

TEN_LINES = """
import flexarm, numpy as np
t = np.linspace(0.0, 1.0, 51)
q = np.outer(0.1 * (1 - np.cos(np.pi * t)), np.ones(6)) + [0, -1.2, 1.5, 0, 0.4, 0]
wrench = [0, 0, -100]
arm = flexarm.load("robots/kr210").flexible(links="modal", drives="elastic")
run = arm.simulate(flexarm.Motion(t, q), step=1e-3)
run.time.shape, run.error.shape, arm.statics(q[0], wrench).compliance.shape, arm.statics(q, wrench).compliance.shape
"""


class Notebook:
    def __init__(self, folder: Path) -> None:
        self.kernel, self.client = manager.start_new_kernel(kernel_name="python3", cwd=str(folder))

    def run(self, code: str) -> str:
        """Return the output of a cell."""
        shown: "list[str]" = []

        def look(message: "dict[str, Any]") -> None:
            content = message["content"]
            kind = message["msg_type"]
            if kind == "error":
                shown.extend(content["traceback"])
            elif kind == "stream":
                shown.append(content["text"])
            elif kind in ("execute_result", "display_data"):
                shown.extend(content["data"].get(form, "") for form in ["text/plain", "text/html"])

        self.client.execute_interactive(code, output_hook=look, timeout=120)
        return re.sub("\x1b[^m]*m", "", "\n".join(shown))

    def complete(self, code: str) -> "list[str]":
        found: "list[str]" = self.client.complete(code, reply=True, timeout=60)["content"]["matches"]
        return found

    def help(self, name: str) -> str:
        told = self.client.inspect(name, reply=True, timeout=60)["content"]["data"].get("text/plain", "")
        return re.sub("\x1b[^m]*m", "", told)


@pytest.fixture(scope="module")
def notebook(tmp_path_factory: pytest.TempPathFactory) -> "Iterator[Notebook]":
    notebook = Notebook(tmp_path_factory.mktemp("empty"))
    notebook.run(TEN_LINES)
    yield notebook
    notebook.client.stop_channels()
    notebook.kernel.shutdown_kernel(now=True)


def test_the_first_ten_lines_work_in_an_empty_folder(notebook: Notebook) -> None:
    assert "((501,), (501, 3), (6, 6), (51, 6, 6))" in notebook.run(TEN_LINES)
    assert "peak TCP error" in notebook.run("display(run)") and "joint_6" in notebook.run("display(arm.robot)")


@pytest.mark.parametrize(
    "typed, expected",
    [
        ("arm.sim", {"simulate", "simulate_batch"}),
        ("arm.simulate(st", {"step=", "stepper=", "start="}),
        ("flexarm.lo", {"load", "lobes"}),
        ("run.summary['t", {"tcp", "trajectory"}),
        ("run.err", {"error", "error_path", "error_static"}),
        ("flexarm.RobotBuilder().be", {"beam"}),
    ],
)
def test_what_is_typed_is_completed(notebook: Notebook, typed: str, expected: "set[str]") -> None:
    assert expected <= set(notebook.complete(typed)), notebook.complete(typed)


@pytest.mark.parametrize("name", ["arm.simulate", "arm.deflections", "flexarm.RobotBuilder.beam", "flexarm.load", "flexarm.identify"])
def test_help_has_signature_and_parameters(notebook: Notebook, name: str) -> None:
    told = notebook.help(name)
    assert "Signature" in told and "Parameters\n" in told and "Returns\n" in told, told


WRONG = ["arm.statics([1, 2])", "arm.simulate(step=-1)", "flexarm.load('kr21')", "arm.response(outputs=['q'])", "arm.modes(count=-1)"]


@pytest.mark.parametrize("wrong", WRONG)
def test_tracebacks_end_at_the_users_line(notebook: Notebook, wrong: str) -> None:
    told = notebook.run(wrong)
    assert told.count("Cell In[") == 1 and "Error: " in told, told
    assert not any(word in told for word in [".rs", "panicked", "Vec", "pyo3", "site-packages/flexarm"]), told
