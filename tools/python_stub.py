#!/usr/bin/env python3
"""Prints the stub of the Python package with the docstrings of the installed module, for editors.

    python3 tools/python_stub.py > _flexarm.pyi

Docstrings are written once, in the Rust sources; `tools/build_wheel.py` puts this stub into wheels.
"""
import ast
import inspect
import sys
from pathlib import Path

STUB = Path(__file__).resolve().parent.parent / "crates/faces/flexarm-python/python/flexarm/_flexarm.pyi"


def documented(text, module):
    """Returns the text of a stub with the docstrings of a module."""
    lines = text.splitlines()
    places = []

    def visit(nodes, owner):
        for node in nodes:
            if not isinstance(node, (ast.ClassDef, ast.FunctionDef)):
                continue
            thing = getattr(owner, node.name, None)
            doc = inspect.getdoc(thing) if thing is not None and not node.name.startswith("__") else None
            if doc and ast.get_docstring(node) is None:
                places.append((node.body[0], node.col_offset + 4, doc))
            if isinstance(node, ast.ClassDef):
                visit(node.body, thing)

    visit(ast.parse(text).body, module)
    for body, indent, doc in reversed(places):
        quoted = doc.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
        blanks = "\n" + " " * indent
        end = blanks if "\n" in doc or doc.endswith('"') else ""
        string = f'{blanks}"""{quoted.replace(chr(10), blanks)}{end}"""'
        first = min([body, *getattr(body, "decorator_list", [])], key=lambda node: node.lineno)
        row, column = first.lineno - 1, first.col_offset - (first is not body)
        is_dots = isinstance(body, ast.Expr) and isinstance(body.value, ast.Constant) and body.value.value is ...
        before, after = lines[row][:column].rstrip(), lines[row][column:]
        lines[row] = before + string + ("" if is_dots else blanks + after)
    return "\n".join(line.rstrip() for line in "\n".join(lines).splitlines()) + "\n"


if __name__ == "__main__":
    from flexarm import _flexarm

    sys.stdout.write(documented(STUB.read_text(), _flexarm))
