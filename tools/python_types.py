#!/usr/bin/env python3
"""Generates the Python types of result dictionaries from the structs behind `--json`.

    python3 tools/python_types.py            writes crates/faces/flexarm-python/python/flexarm/types.py
    python3 tools/python_types.py --check    checks that the file is up to date

It reads the `#[derive(Serialize)]` structs of the library with their documentation and serde
attributes; structs with custom serialisation are described in WRITTEN below. The tests of the
package check results against the types.
"""
import keyword
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TARGET = ROOT / "crates/faces/flexarm-python/python/flexarm/types.py"
CRATES = ["flexarm-run", "flexarm-linkmaker", "flexarm-settings", *(f"flexarm-{study}" for study in (
    "chatter", "compensate", "identify", "map", "new", "sensitivity", "sweep"))]
#: Results: struct, its file, and the name of its type in Python.
ROOTS = [
    ("Summary", "flexarm-run/src/run/summary.rs", "RunSummary"),
    ("Statics", "flexarm-run/src/poses/statics.rs", "StaticsDetails"),
    ("ModeTable", "flexarm-run/src/poses/modes.rs", "ModesSummary"),
    ("Response", "flexarm-run/src/poses/response.rs", "ResponseSummary"),
    ("Map", "flexarm-map/src/lib.rs", "MapSummary"),
    ("Compensation", "flexarm-compensate/src/lib.rs", "Compensation"),
    ("Sensitivity", "flexarm-sensitivity/src/lib.rs", "Sensitivity"),
    ("PoseSensitivity", "flexarm-sensitivity/src/pose.rs", "PoseSensitivity"),
    ("Identification", "flexarm-identify/src/answer.rs", "Identification"),
    ("MeasurementPlan", "flexarm-identify/src/plan_file.rs", "MeasurementPlan"),
    ("Lobes", "flexarm-chatter/src/lib.rs", "Lobes"),
    ("SweepSummary", "flexarm-sweep/src/results.rs", "SweepSummary"),
    ("ReduceSummary", "flexarm-linkmaker/src/reduce/summary.rs", "ReduceSummary"),
    ("ImportSummary", "flexarm-linkmaker/src/import/summary.rs", "ImportSummary"),
    ("ExportSummary", "flexarm-linkmaker/src/export.rs", "ExportSummary"),
    ("Inspection", "flexarm-run/src/poses/inspect.rs", "Inspection"),
    ("Finding", "flexarm-settings/src/finding.rs", "Finding"),
    ("NewRobot", "flexarm-new/src/report.rs", "NewRobot"),
]
#: Python names of structs whose Rust names are ambiguous outside their module.
NAMES = {"Files": "RunFiles"}
#: Hand-written fields: key, type, whether it is always present, description.
WRITTEN = {
    "RecordingFiles": [
        *((key, "str | None", True, f"Recording ({key}), if it was written.") for key in ["csv", "mcap", "rrd", "parquet"]),
    ],
    "StepperSettings": [
        ("rho_inf", "float", False, "Of the generalised-alpha method."),
        ("dispersion_correction", "bool", False, "Of the generalised-alpha method."),
        ("form", "str", False, "Of SPOOK."),
        ("preset", "str", False, "Of SPOOK."),
        ("rtol", "float", False, "Of the reference stepper."),
        ("method", "str", False, "Of the reference stepper."),
    ],
}
#: Fields present in almost all results: otherwise type checkers would require a test each time.
THERE = {("Summary", "tcp")}
PLAIN = {"f64": "float", "f32": "float", "bool": "bool", "String": "str", "str": "str", "PathBuf": "str", "char": "str"}
PLAIN |= {f"{sign}{bits}": "int" for sign in "iu" for bits in ["8", "16", "32", "64", "size"]}
#: Types that serialise as text or as any value.
OPAQUE = {
    "Severity": "Literal['error', 'warning', 'note']",
    "Better": "Literal['lower', 'higher']",
    "Role": "Literal['value', 'factor', 'offset']",
    "ParameterValue": "float | str | bool",
    "Value": "Any",
}


class Struct:
    def __init__(self, name, file, doc, fields):
        self.name, self.file, self.doc, self.fields = name, file, doc, fields


def structs():
    """Returns all serialised structs, by name."""
    found = {}
    for crate in CRATES:
        for file in sorted(ROOT.glob(f"crates/*/{crate}/src/**/*.rs")):
            text = file.read_text()
            pattern = r"((?:^[ \t]*///[^\n]*\n)*)((?:^[ \t]*#\[[^\n]*\n)+)^pub(?:\([a-z]+\))? struct (\w+)(?:<[^>]*>)? \{\n(.*?)^\}"
            for doc, attributes, name, body in re.findall(pattern, text, re.M | re.S):
                if "Serialize" in attributes:
                    fields = list(fields_of(body))
                    found.setdefault(name, []).append(Struct(name, file, comment(doc), fields))
    return found


def comment(text):
    return " ".join(line.strip().removeprefix("///").strip() for line in text.strip().splitlines())


def fields_of(body):
    """Yields key, Rust type, whether it is always present, whether it is flattened, description."""
    pattern = r"((?:^[ \t]*///[^\n]*\n)*)((?:^[ \t]*#\[[^\n]*\n)*)^[ \t]*pub(?:\([a-z]+\))? (\w+): (.*?),\n(?=[ \t]*(?:///|#|pub|$))"
    for doc, attributes, name, kind in re.findall(pattern, body + "\n", re.M | re.S):
        if re.search(r"serde\(skip\)", attributes):
            continue
        renamed = re.search(r'rename = "(\w+)"', attributes)
        always = "skip_serializing_if" not in attributes
        yield renamed[1] if renamed else name, " ".join(kind.split()), always, "flatten" in attributes, comment(doc)


class Types:
    def __init__(self):
        self.known, self.made, self.names, self.order = structs(), {}, {}, []

    def struct(self, name, near):
        """Returns the struct that a name means in a file: its own, of a nearby module, or the only
        one."""
        there = self.known.get(name, [])
        same = [s for s in there if s.file == near] or [s for s in there if s.file.parent == near.parent] or there
        if len(same) != 1:
            sys.exit(f"error: {near}: {name} is {len(same)} structs: {[str(s.file) for s in same]}")
        return same[0]

    def python(self, rust, near):
        """Converts a Rust type to Python."""
        rust = re.sub(r"^&('\w+ )?", "", rust).strip()
        rust = re.sub(r"^(?:\w+::)+(?=\w)", "", rust)
        if rust in PLAIN:
            return PLAIN[rust]
        if rust in OPAQUE:
            return OPAQUE[rust]
        if inner := re.fullmatch(r"(Option|Vec|Box|Arc|BTreeMap|HashMap)<(.*)>", rust):
            kind, argument = inner[1], inner[2]
            if kind.endswith("Map"):
                return f"dict[str, {self.python(argument.split(',', 1)[1].strip(), near)}]"
            of = self.python(argument, near)
            return {"Option": f"{of} | None", "Vec": f"list[{of}]"}.get(kind, of)
        if inner := re.fullmatch(r"\[(.*); *\w+\]", rust) or re.fullmatch(r"\[(.*)\]", rust):
            return f"list[{self.python(inner[1], near)}]"
        if inner := re.fullmatch(r"\((.*)\)", rust):
            parts = sorted({self.python(part.strip(), near) for part in inner[1].split(",")})
            return f"list[{' | '.join(parts)}]"
        return self.typed(self.struct(rust, near))

    def typed(self, struct, name=None):
        """Returns the type name of a struct; creates the type if needed."""
        key = (struct.name, struct.file)
        if key in self.names:
            return self.names[key]
        name = name or NAMES.get(struct.name, struct.name)
        if name in self.names.values():
            name = "".join(part.capitalize() for part in struct.file.parent.name.split("_")) + name
        if name in self.names.values():
            sys.exit(f"error: two types are called {name}")
        self.names[key] = name
        fields = []
        for field, rust, always, flat, doc in struct.fields:
            bare = rust.split("::")[-1]
            if flat and bare in WRITTEN:
                fields += WRITTEN[bare]
            elif flat:
                inner = self.struct(bare, struct.file)
                fields += [(k, self.python(t, inner.file), a, d) for k, t, a, f, d in inner.fields]
            elif (struct.name, field) in THERE:
                kind = self.python(rust, struct.file).removesuffix(" | None")
                fields.append((field, kind, True, doc))
            else:
                fields.append((field, self.python(rust, struct.file), always, doc))
        self.order.append((name, struct.doc, fields))
        return name

    def text(self):
        for struct, file, name in ROOTS:
            path = next(ROOT.glob(f"crates/*/{file}"))
            self.typed(self.struct(struct, path), name)
        out = [HEAD.format(names="\n".join(f'    "{name}",' for name in sorted([*self.names.values(), "CaveatDict"])))]
        for name, doc, fields in self.order:
            named = [f for f in fields if not keyword.iskeyword(f[0])]
            needed, optional = [f for f in named if f[2]], [f for f in named if not f[2]]
            base = "TypedDict"
            # A Python keyword cannot be a field name in a class.
            for key, kind, always, _ in [f for f in fields if f not in named]:
                out.append(f'_{name}{key.capitalize()} = TypedDict("_{name}{key.capitalize()}", {{"{key}": "{kind}"}}, total={always})\n')
                base = f"_{name}{key.capitalize()}"
            if optional:
                # Python 3.10 has no NotRequired.
                out.append(f"class _{name}({base}):\n" + body("What is always there.", needed))
                base, needed = f"_{name}, total=False", optional
            out.append(f"class {name}({base}):\n" + body(doc, needed))
        out.append("#: A finding with a result: a warning or a note.\nCaveatDict = Finding\n")
        return "\n\n".join(out)


HEAD = '''"""Types of the dictionaries that answers are: keys as in ``--json``, SI units.

Written by tools/python_types.py from the library; for annotations, such as ``summary: flexarm.types.RunSummary = run.summary``.
A number that is infinite or none at all is None where the answer was a file of JSON once.
"""

from __future__ import annotations

from typing import Any, Literal, TypedDict

__all__ = [
{names}
]
'''


def body(doc, fields):
    doc = doc.replace("\\", "\\\\").replace('"""', "'''").rstrip(".")
    lines = [f'    """{doc}."""', ""]
    for key, kind, _, meaning in fields:
        meaning = re.sub(r"\[`?([^\]`]*)`?\](\([^)]*\))?", r"\1", meaning).replace("\\", "\\\\")
        lines.append(f"    {key}: {kind}")
        if meaning:
            lines.append(f'    """{meaning}"""')
    return "\n".join(lines) + "\n"


def main():
    text = Types().text()
    if "--check" not in sys.argv[1:]:
        TARGET.write_text(text)
        print(f"{TARGET.relative_to(ROOT)}: {text.count('(TypedDict)')} dictionaries")
    elif not TARGET.exists() or TARGET.read_text() != text:
        sys.exit(f"error: {TARGET.relative_to(ROOT)} is not what the library says: run python3 tools/python_types.py")
    else:
        print(f"{TARGET.relative_to(ROOT)} is what the library says")


if __name__ == "__main__":
    main()
