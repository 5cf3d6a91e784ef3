#!/usr/bin/env python3
"""Checks that the crates depend on each other as ARCHITECTURE.md says. Plain Python 3, needs cargo.

    python3 tools/check_dependencies.py                status 1 and one line per violation
    python3 tools/check_dependencies.py --self-test    feeds made-up workspaces to every rule

Rules:
 * a crate uses crates of lower lines of the table only; the line "tests" is for dev-dependencies; flexarm-testkit uses
   the base line and below, flexarm-tests whatever it likes;
 * outside crates that belong to one crate or line (OWNERS) are named nowhere else, dev-dependencies included;
 * no source file but the faces' prints, and none from base to results reads a clock or the environment;
 * every crate takes the workspace's lints;
 * ARCHITECTURE.md mentions every crate there is, in both tables, and no other.
"""
import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = "ARCHITECTURE.md"
LINES = ["faces", "proof", "facade", "edges", "results", "motion", "links", "base", "algebra"]       # top to bottom
INNER = ["results", "motion", "links", "base", "algebra"]
OWNERS = {  # outside crate: crates or lines that may name it
    "rerun": ["flexarm-log"], "re_chunk": ["flexarm-log"], "re_log_encoding": ["flexarm-log"], "re_log_types": ["flexarm-log"],
    "re_sdk_types": ["flexarm-log"], "re_tuid": ["flexarm-log"], "mcap": ["flexarm-log"], "parquet": ["flexarm-log"], "zstd": ["flexarm-log"],
    "arrow-array": ["flexarm-log"], "arrow-ipc": ["flexarm-log"], "arrow-schema": ["flexarm-log"],
    "png": ["flexarm-draw"], "plotters": ["flexarm-draw"], "hdf5-pure": ["flexarm-fe-io"],
    "faer": ["flexarm-fem"], "diffsol": ["flexarm-stepping"], "metis-sys": ["flexarm-fem"], "urdf-rs": ["flexarm-urdf"], "saphyr-parser": ["flexarm-urdf"],
    "rustix": ["flexarm-log"], "signal-hook": ["faces"],
    "clap": ["faces"], "clap_complete": ["faces"], "clap_mangen": ["faces"], "indicatif": ["faces"],
}
PRINTS = re.compile(r"\b(?:e?print(?:ln)?|dbg)!\s*[(\[{]|\bstd::io::(?:stdout|stderr)\b")
OUTSIDE_WORLD = re.compile(r"\b(?:Instant|SystemTime)::now\b|\bstd::env::|\benv::(?:var|args|current)")
CRATE_NAME = re.compile(r"(?<![\w/-])flexarm(?:-[a-z0-9]+)+(?![\w-])")


def table_rows(page, heading):
    """Cells of the first table under a heading, without its head."""
    part = page.split(f"\n## {heading}\n", 1)
    if len(part) < 2:
        return None
    body = part[1].split("\n## ", 1)[0]
    rows = [[c.strip() for c in l.strip().strip("|").split("|")] for l in body.splitlines() if l.startswith("|")]
    return rows[2:]


def crates_in(text):
    return [w for w in re.findall(r"`([^`]+)`", text) if w == "flexarm" or w.startswith("flexarm-")]


def check_page(page, packages):
    """Problems of the page, and the line of each crate."""
    problems, line_of = [], {}
    rows = table_rows(page, "Dependency lines")
    if rows is None:
        return [f'{PAGE}: there is no section "Dependency lines" with the table of lines'], {}
    names = [row[0] for row in rows]
    if names != LINES + ["tests"]:
        problems.append(f"{PAGE}: the lines are {names}, expected {LINES + ['tests']}")
    for row in rows:
        for crate in crates_in(row[1]):
            if crate in line_of:
                problems.append(f"{PAGE}: {crate} stands on two lines, {line_of[crate]} and {row[0]}")
            line_of[crate] = row[0]
    described = [c for row in table_rows(page, "Crates") or [] for c in crates_in(row[0])]
    existing = {p["name"] for p in packages}
    for crate in sorted(existing - set(line_of)):
        problems.append(f"{PAGE}: crate {crate} is missing from the table of lines: put it on one")
    for crate in sorted(existing - set(described)):
        problems.append(f"{PAGE}: crate {crate} is missing from the table of crates: say what it is and must not know")
    for crate in sorted((set(CRATE_NAME.findall(page)) | set(line_of) | set(described)) - existing):
        problems.append(f"{PAGE}: mentions {crate}, which is not a crate of the workspace")
    return problems, line_of


def check_packages(packages, line_of):
    problems = []
    for package in packages:
        crate, line = package["name"], line_of.get(package["name"])
        if line is None:
            continue                                                     # reported with the page
        for dependency in package["dependencies"]:
            other, kind = dependency["name"], dependency["kind"] or "normal"
            where = f"{crate} ({line}): {'' if kind == 'normal' else kind + '-'}dependency on {other}"
            owners = OWNERS.get(other)
            if owners and crate not in owners and line not in owners:
                problems.append(f"{where}: only {' and '.join(owners)} may name it")
            if other not in line_of or crate == "flexarm-tests":
                continue
            below = line_of[other]
            if below == "tests":
                if kind != "dev":
                    problems.append(f"{where}: crates for tests are for dev-dependencies only")
                elif other == "flexarm-tests":
                    problems.append(f"{where}: nothing depends on the tests")
            elif line == "tests":
                if below not in ("base", "algebra"):
                    problems.append(f"{where} ({below}): the testkit uses the base line and below only, or its users go round in circles")
            elif LINES.index(below) <= LINES.index(line):
                problems.append(f"{where} ({below}): a crate uses lower lines only; turn the dependency round or move the code")
    return problems


def code_of(text):
    """Source without comments and without the unit tests at its end; line breaks stay."""
    text = text.split("\n#[cfg(test)]\nmod ", 1)[0]
    return re.sub(r"//[^\n]*", "", text)


def check_source(crate, line, path, text):
    problems = []
    if str(path).endswith("/tests.rs"):  # a module of unit tests
        return problems
    for number, code in enumerate(code_of(text).splitlines(), 1):
        if line not in ("faces", "tests") and PRINTS.search(code):
            problems.append(f"{path}:{number}: {crate} prints; only the faces do: return what is to be said")
        if line in INNER and OUTSIDE_WORLD.search(code):
            problems.append(f"{path}:{number}: {crate} ({line}) reads a clock or the environment: pass the value in")
    return problems


def check_manifest(crate, path, text):
    if re.search(r"^\[lints\]\s*\nworkspace\s*=\s*true", text, re.M):
        return []
    return [f"{path}: {crate} does not take the workspace's lints: add [lints] workspace = true"]


def check_workspace():
    command = ["cargo", "metadata", "--format-version", "1", "--no-deps"]
    packages = json.loads(subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout)["packages"]
    problems, line_of = check_page((ROOT / PAGE).read_text(encoding="utf-8"), packages)
    problems += check_packages(packages, line_of)
    sources = 0
    for package in packages:
        crate, manifest = package["name"], Path(package["manifest_path"])
        name = lambda path: path.relative_to(ROOT).as_posix()
        problems += check_manifest(crate, name(manifest), manifest.read_text(encoding="utf-8"))
        for path in sorted((manifest.parent / "src").rglob("*.rs")):
            sources += 1
            problems += check_source(crate, line_of.get(crate), name(path), path.read_text(encoding="utf-8"))
    return problems, f"{len(packages)} crates, {sources} source files"


# ------------------------------------------------------------------------------------------ self-test
def self_test():
    """Every rule must speak on a workspace that breaks it, and keep silent on one that does not."""
    def page(lines, extra=""):
        rows = "\n".join(f"| {l} | {' '.join(f'`{c}`' for c in lines.get(l, []))} |" for l in LINES + ["tests"])
        crates = "\n".join(f"| `{c}` | x | y |" for cs in lines.values() for c in cs)
        return f"# A\n\n## Dependency lines\n\n| line | crates |\n| - | - |\n{rows}\n\n## Crates\n\n| c | w | n |\n| - | - | - |\n{crates}\n\n## End\n{extra}\n"

    def package(name, *dependencies):
        split = [d.split(":") for d in dependencies]
        return {"name": name, "dependencies": [{"name": d[-1], "kind": d[0] if len(d) > 1 else None} for d in split]}

    lines = {"faces": ["flexarm-cli"], "facade": ["flexarm"], "edges": ["flexarm-log"], "motion": ["flexarm-stepping"],
             "base": ["flexarm-fem", "flexarm-kinematics"], "tests": ["flexarm-testkit", "flexarm-tests"]}
    good = {
        "flexarm-cli": ["flexarm", "clap"], "flexarm": ["flexarm-log", "flexarm-stepping"], "flexarm-log": ["rerun", "mcap"],
        "flexarm-stepping": ["flexarm-kinematics", "diffsol", "dev:flexarm-testkit"], "flexarm-fem": ["faer"],
        "flexarm-kinematics": ["dev:flexarm-testkit"], "flexarm-testkit": ["flexarm-kinematics"], "flexarm-tests": ["dev:flexarm"],
    }

    def found(change=None, lines=lines, extra=""):
        packages = [package(n, *d) for n, d in {**good, **(change or {})}.items()]
        problems, line_of = check_page(page(lines, extra), packages)
        return problems + check_packages(packages, line_of)

    source = lambda line, text: check_source("c", line, "c.rs", text)
    cases = [  # what is wrong, what is found, words the message must have; None: nothing may be found
        ("a sound workspace", found(), None),
        ("upwards", found({"flexarm-kinematics": ["flexarm-stepping"]}), "flexarm-kinematics (base): dependency on flexarm-stepping (motion)"),
        ("same line", found({"flexarm-fem": ["flexarm-kinematics"]}), "lower lines only"),
        ("upwards in tests", found({"flexarm-kinematics": ["dev:flexarm"]}), "dev-dependency on flexarm (facade)"),
        ("on a face", found({"flexarm": ["flexarm-cli"]}), "flexarm (facade): dependency on flexarm-cli (faces)"),
        ("testkit in the product", found({"flexarm-stepping": ["flexarm-testkit"]}), "dev-dependencies only"),
        ("on the tests", found({"flexarm": ["dev:flexarm-tests"]}), "nothing depends on the tests"),
        ("testkit too high", found({"flexarm-testkit": ["flexarm-stepping"]}), "base line and below only"),
        ("mcap below", found({"flexarm-stepping": ["mcap"]}), "dependency on mcap: only flexarm-log may name it"),
        ("rerun in a face", found({"flexarm-cli": ["flexarm", "rerun"]}), "dependency on rerun: only flexarm-log"),
        ("faer elsewhere", found({"flexarm-stepping": ["dev:faer"]}), "dev-dependency on faer: only flexarm-fem"),
        ("diffsol elsewhere", found({"flexarm": ["diffsol"]}), "only flexarm-stepping may name it"),
        ("clap in the facade", found({"flexarm": ["clap"]}), "only faces may name it"),
        ("urdf-rs below", found({"flexarm-kinematics": ["urdf-rs"]}), "only flexarm-urdf may name it"),
        ("a crate the page forgot", found({"flexarm-new": []}), "flexarm-new is missing from the table of lines"),
        ("a crate that is gone", found(lines={**lines, "results": ["flexarm-analysis"]}), "mentions flexarm-analysis, which is not"),
        ("a crate that is gone, in the text", found(extra="see flexarm-gone/src/lib.rs"), "mentions flexarm-gone, which is not"),
        ("two lines", found(lines={**lines, "links": ["flexarm-fem"]}), "flexarm-fem stands on two lines, links and base"),
        ("no table", check_page("# A\n", [])[0], "no section"),
        ("printing", source("facade", 'fn f() {\n    println!("x");\n}\n'), "c.rs:2: c prints"),
        ("printing to stderr", source("base", 'eprint!("x");'), "prints"),
        ("a module of tests prints", check_source("c", "base", "src/x/tests.rs", 'eprintln!("x");'), None),
        ("a face prints", source("faces", 'println!("x");'), None),
        ("printing in docs and tests", source("base", '/// println!("x");\n#[cfg(test)]\nmod tests { fn f() { println!("x"); } }'), None),
        ("a clock inside", source("motion", "let t = Instant::now();"), "clock"),
        ("the environment inside", source("base", 'std::env::var("X")'), "environment"),
        ("a clock in the facade", source("facade", "let t = Instant::now();"), None),
        ("no lints", check_manifest("c", "c/Cargo.toml", "[package]\n"), "lints"),
        ("lints", check_manifest("c", "c/Cargo.toml", "[lints]\nworkspace = true\n"), None),
    ]
    failed = 0
    for what, problems, words in cases:
        good_answer = not problems if words is None else any(words in p for p in problems)
        if not good_answer:
            failed += 1
            print(f"self-test: {what}: expected {'nothing' if words is None else repr(words)}, found {problems}", file=sys.stderr)
    print(f"self-test: {len(cases) - failed} of {len(cases)} cases right")
    return failed


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        sys.exit(1 if self_test() else 0)
    if sys.argv[1:]:
        sys.exit(__doc__)
    problems, seen = check_workspace()
    for problem in problems:
        print(f"error: {problem}", file=sys.stderr)
    print(f"dependencies: {seen}, {len(problems)} problems")
    sys.exit(1 if problems else 0)
