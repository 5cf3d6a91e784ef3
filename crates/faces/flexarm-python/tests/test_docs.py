"""The examples in docstrings run, and everything public has a docstring."""

import doctest
import inspect
import re
from pathlib import Path

import pytest

import flexarm


def held() -> "list[tuple[str, object]]":
    found: "list[tuple[str, object]]" = [("flexarm", flexarm)]
    for name in flexarm.__all__:
        thing = getattr(flexarm, name)
        if isinstance(thing, str):
            continue
        found.append((name, thing))
        if inspect.isclass(thing) and thing.__module__.startswith("flexarm"):
            members = {k: v for k, v in vars(thing).items() if not k.startswith("_")}
            found += [(f"{name}.{k}", v) for k, v in members.items()]
    return found


@pytest.mark.parametrize("name, thing", held(), ids=[name for name, _ in held()])
def test_everything_has_a_docstring_whose_examples_run(name: str, thing: object) -> None:
    doc = inspect.getdoc(thing)
    assert doc, name
    example = doctest.DocTestParser().get_doctest(doc, {"flexarm": flexarm}, name, None, None)
    result = doctest.DocTestRunner(verbose=False, optionflags=doctest.ELLIPSIS).run(example)
    assert result.failed == 0


PAGE = Path(__file__).parents[4] / "docs/python.md"


@pytest.mark.filterwarnings("ignore")
def test_the_code_of_the_page_runs_from_top_to_bottom(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S)
    assert len(blocks) >= 3
    names: "dict[str, object]" = {}
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), names)
    assert names["found"].peak.shape == (1000,)  # type: ignore[attr-defined]
    assert 1e-4 < float(str(names["sag"])) < 2e-2
