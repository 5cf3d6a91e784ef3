#!/usr/bin/env python3
"""Checks the dependencies between crates against ARCHITECTURE.md. Plain Python 3, needs cargo.

    python3 tools/check_dependencies.py                status 1 and one line per violation
    python3 tools/check_dependencies.py --self-test    tests every rule on artificial workspaces

Rules:
  * a crate uses crates of its own folder and of folders below (FOLDERS), except dev-dependencies;
  * the faces use only the facade and each other (ONLY);
  * an outside crate that belongs to some folders (OWNERS) is used in no other;
  * the files of a crate import each other in cycles of at most three;
  * only programs print; from base to results only the writers of recordings read a clock;
  * no library crate refers to a command line: flags, environment, exit (exceptions: ALLOWED);
  * purely numerical crates (NUMBERS) do not access files;
  * every crate uses the workspace's lints and is named in ARCHITECTURE.md, which names no other;
  * a tests/main.rs names every file of its folder.
"""
import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = "ARCHITECTURE.md"
# bottom to top
FOLDERS = ["base", "dynamics", "links", "robot", "motion", "results", "run", "studies", "faces", "proof"]
TESTS = "tests"  # flexarm-tests and flexarm-testkit, only for dev-dependencies
ONLY = {
    "flexarm-cli": ["flexarm", "flexarm-fmu", "flexarm-rerun"], "flexarm-fmu": ["flexarm"],
    "flexarm-python": ["flexarm", "flexarm-cli", "flexarm-rerun"], "flexarm-rerun": ["flexarm-log", "flexarm-draw", "flexarm-kinematics"],
}
OWNERS = {  # outside crate: folders that may name it
    **dict.fromkeys(["re_cdr", "parquet", "rustix"], ["results"]),
    **dict.fromkeys(["mcap", "zstd", "lz4_flex"], ["motion", "results"]), "rusqlite": ["motion"],
    "urdf-rs": ["robot"], "saphyr-parser": ["base"], "diffsol": ["dynamics"], "toml_edit": ["studies", "faces"],
    **dict.fromkeys(["faer", "safetensors"], ["links"]), "clap": ["faces", "proof"],
    **dict.fromkeys(["png", "plotters", "noto-sans-mono-bitmap", "clarabel"], ["results"]),
    **dict.fromkeys(["rand", "sobol_burley", "statrs"], ["studies"]),
    **dict.fromkeys(["arrow-array", "clap_complete", "clap_mangen", "indicatif", "numpy", "pyo3", "pyo3-build-config", "quick-xml", "rerun", "signal-hook", "twox-hash", "zip"], ["faces"]),
}
LARGEST_CYCLE = 3
PRINTS = re.compile(r"\b(?:e?print(?:ln)?|dbg)!\s*[(\[{]|\bstd::io::(?:stdout|stderr)\b")
CLOCK = re.compile(r"\b(?:Instant|SystemTime)::now\b")
ENVIRONMENT = re.compile(r"\bstd::env\b|\benv::(?:var|args|current)")
EXIT = re.compile(r"\bprocess::(?:exit|abort|ExitCode)\b|\bExitCode\b|\bexit_code\b")
FLAG = re.compile(r"(?<![\w-])--[a-z][a-z-]*|(?<![\w/-])-o(?![\w-])")
FACE_WORDS = re.compile(r"\b(?:command line|exit code|terminal|stdout|stderr)\b")
FILES = re.compile(r"\bstd::(?:fs|path)\b|\bPathBuf\b|\bFile::open\b")
NUMBERS = ["flexarm-spatial", "flexarm-settings", "flexarm-kinematics", "flexarm-stepping", "flexarm-flexlink", "flexarm-path", "flexarm-analysis"]
ALLOWED = {  # file: allowed hit (a pattern), and the reason
    "crates/links/flexarm-fe-io/src/mesh/read.rs": (r"-o", "how to call another program, Gmsh"),
    "crates/motion/flexarm-motion-io/src/error.rs": (r"--full-length|--no-arr", "how to call another program, ROS 2"),
    "crates/robot/flexarm-urdf/src/resolve.rs": (r"std::env", "search_paths_from_environment, which the caller may use or not"),
    "crates/robot/flexarm-urdf/src/xacro/substitution.rs": (r"std::env|env::var|env::current", "xacro's own $(env NAME), $(optenv NAME), $(cwd)"),
    "crates/run/flexarm-run/src/motions/motion_formats.rs": (r"--src|--dst|--dst-storage", "how to call another program, rosbags-convert"),
    "crates/run/flexarm-run/src/report/html/figures.rs": (r"--c", "a custom property of a style sheet"),
    **dict.fromkeys(["crates/proof/flexarm-verify/src/" + file for file in (
        "files.rs", "one_beam/page.rs", "three_beams/page.rs", "lower_arm/page.rs", "manipulator/page.rs")],
        (r"--[a-z-]+|-o", "the page says how a figure is made by hand")),
}
CRATE_NAME = re.compile(r"(?<![\w/-])flexarm(?:-[a-z0-9]+)+(?![\w-])")


def check_page(page, folder_of):
    """Returns the problems of the page."""
    named = set(CRATE_NAME.findall(page)) | {"flexarm"}
    return [f"{PAGE}: crate {crate} is not on it: say what it is" for crate in sorted(set(folder_of) - named)] + [
        f"{PAGE}: names {crate}, which is not a crate of the workspace" for crate in sorted(named - set(folder_of))]


def check_packages(packages, folder_of):
    problems = []
    rank = lambda folder: FOLDERS.index(folder) if folder in FOLDERS else -1
    for package in packages:
        crate, folder = package["name"], folder_of[package["name"]]
        if folder not in (*FOLDERS, TESTS):
            problems.append(f"{crate}: {folder} is not a folder of crates; they are {', '.join(FOLDERS)}")
            continue
        for dependency in package["dependencies"]:
            other, kind = dependency["name"], dependency["kind"] or "normal"
            where = f"{crate} ({folder}): {'' if kind == 'normal' else kind + '-'}dependency on {other}"
            if other in OWNERS and folder not in (*OWNERS[other], TESTS):
                problems.append(f"{where}: only {' and '.join(OWNERS[other])} may name it")
            below = folder_of.get(other)
            if below is None or folder == TESTS:
                continue
            if below == TESTS:
                if kind != "dev":
                    problems.append(f"{where}: crates for tests are for dev-dependencies only")
            elif kind == "normal" and crate in ONLY and other not in ONLY[crate]:
                problems.append(f"{where}: it uses {' and '.join(ONLY[crate])} alone")
            elif kind == "normal" and rank(below) > rank(folder):
                problems.append(f"{where} ({below}): a crate uses its own folder and those below; turn it round or move the code")
    return problems


def imports(path, text, files):
    """Returns the files of the crate that a file imports by `crate::`, `super::` or `self::`."""
    module = list(Path(path).with_suffix("").parts)
    module = module[:-1] if module[-1] in ("lib", "mod") else module
    found = set()

    def resolve(parts):
        for length in range(len(parts), 0, -1):
            for name in ("/".join(parts[:length]) + ".rs", "/".join([*parts[:length], "mod.rs"])):
                if name in files:
                    return name
        return None

    def add(tree, base):
        depth, piece, pieces = 0, "", []
        for char in tree + ",":
            if char == "," and depth == 0:
                pieces.append(piece.strip())
                piece = ""
                continue
            depth += (char == "{") - (char == "}")
            piece += char
        for piece in filter(None, pieces):
            start, brace, rest = piece.partition("{")
            parts = [p for p in re.sub(r"\s+as\s+\w+", "", start).split("::") if p.strip()]
            parts = [p.strip() for p in parts]
            here = list(base)
            while parts and parts[0] in ("crate", "super", "self"):
                here = {"crate": [], "super": here[:-1], "self": here}[parts.pop(0)]
            if brace:
                add(rest.rsplit("}", 1)[0], here + parts)
            else:
                target = resolve(here + parts)
                if target and target != path:
                    found.add(target)

    code = without_literals(text.split("\n#[cfg(test)]\nmod ", 1)[0])
    for hit in re.finditer(r"\buse\s+((?:crate|super|self)::[^;]*);", code):
        if not re.search(r"\bpub(?:\([^)]*\))?\s+$", code[:hit.start()]):
            add(hit[1], module)
    code = re.sub(r"\buse\s+[^;]*;", "", code)
    for hit in re.finditer(r"(?<![\w:])(?:crate|super|self)(?:::\w+)+", code):
        add(hit[0], module)
    return found


def largest_cycle(graph):
    """Returns the files of the largest strongly connected component of a graph (Tarjan), sorted."""
    order, low, stack, best, count = {}, {}, [], [], 0
    for root in graph:
        if root in order:
            continue
        work = [(root, iter(graph[root]))]
        order[root] = low[root] = count
        count += 1
        stack.append(root)
        while work:
            node, rest = work[-1]
            for other in rest:
                if other not in order:
                    order[other] = low[other] = count
                    count += 1
                    stack.append(other)
                    work.append((other, iter(graph.get(other, ()))))
                    break
                if other in stack:
                    low[node] = min(low[node], order[other])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == order[node]:
                    part = stack[stack.index(node):]
                    del stack[stack.index(node):]
                    best = max(best, part, key=len)
    return sorted(best)


def check_cycles(crate, texts):
    graph = {path: imports(path, text, texts) for path, text in texts.items()}
    cycle = largest_cycle(graph)
    if len(cycle) > LARGEST_CYCLE:
        return [f"{crate}: {len(cycle)} files import each other in a cycle, at most {LARGEST_CYCLE}: {', '.join(cycle)}"]
    return []


def code_of(text):
    """Returns source without comments and without the unit tests at its end; keeps line breaks."""
    text = text.split("\n#[cfg(test)]\nmod ", 1)[0]
    return re.sub(r"//[^\n]*", "", text)


def scan(text):
    """Splits Rust source into (kind, start, end), kind "code", "comment" or "literal" (without
    quotes)."""
    at, done, end = 0, 0, len(text)
    while at < end:
        char, stop, inner = text[at], None, None
        if text.startswith("//", at):
            stop = text.find("\n", at)
        elif text.startswith("/*", at):
            stop = text.find("*/", at) + 2
        elif char == '"' or (char in "br" and not (at and (text[at - 1].isalnum() or text[at - 1] == "_"))):
            opened = re.compile(r'b?(?:r(#*))?"').match(text, at)
            if opened:
                raw = opened.group(1)
                closed = re.compile(r'"' if raw is None else '"' + raw)
                quote = opened.end()
                while raw is None and text[quote:quote + 1] not in ('"', ""):
                    quote += 2 if text[quote] == "\\" else 1
                found = closed.search(text, quote)
                inner, stop = (opened.end(), found.start() if found else end), found.end() if found else end
        elif char == "'":
            quoted = re.compile(r"'(?:\\[^']+|[^\\'])'").match(text, at)
            if quoted:
                at = quoted.end()
                continue
        if stop is None:
            at += 1
            continue
        stop = end if stop <= at else stop
        if done < at:
            yield "code", done, at
        yield ("comment", at, stop) if inner is None else ("literal", *inner)
        at = done = stop
    if done < end:
        yield "code", done, end


def literals(text):
    """Yields line and text of each string literal."""
    return [(text.count("\n", 0, start) + 1, text[start:end]) for kind, start, end in scan(text) if kind == "literal"]


def without_literals(text):
    """Returns the code without literals; keeps line breaks."""
    kept = list(re.sub(r"[^\n]", " ", text))
    for kind, start, end in scan(text):
        if kind == "code":
            kept[start:end] = text[start:end]
    return "".join(kept)


def check_source(crate, folder, path, text):
    problems = []
    if re.search(r"/tests/|/(?:tests|test_\w+)\.rs$", str(path)):  # a module of unit tests
        return problems
    pattern, _ = ALLOWED.get(str(path), (r"(?!)", ""))
    may = lambda hit: re.fullmatch(pattern, hit.group())
    is_library = folder not in ("faces", TESTS) and not str(path).endswith("/src/main.rs") or crate == "flexarm"
    before_tests = text.split("\n#[cfg(test)]\nmod ", 1)[0]
    for number, literal in literals(before_tests) if is_library else []:
        for hit in [h for h in FLAG.finditer(literal) if not may(h)][:1]:
            problems.append(f"{path}:{number}: {crate} names the flag {hit.group()}: name a Setting, each face has its own words for it")
        for hit in [h for h in FACE_WORDS.finditer(literal) if not may(h)][:1]:
            problems.append(f"{path}:{number}: {crate} speaks of the {hit.group()}, which only a face has")
    for number, code in enumerate(without_literals(before_tests).splitlines(), 1):
        if is_library and EXIT.search(code):
            problems.append(f"{path}:{number}: {crate} ends the process or knows its exit code: return an error, the face ends")
        if crate in NUMBERS and FILES.search(code):
            problems.append(f"{path}:{number}: {crate} names files: it works on numbers alone")
    for number, code in enumerate(code_of(text).splitlines(), 1):
        if is_library and PRINTS.search(code):
            problems.append(f"{path}:{number}: {crate} prints; only the faces do: return what is to be said")
        if folder in FOLDERS[:FOLDERS.index("run")] and crate != "flexarm-log" and CLOCK.search(code):
            problems.append(f"{path}:{number}: {crate} ({folder}) reads a clock: pass the value in")
        if is_library and any(not may(hit) for hit in ENVIRONMENT.finditer(code)):
            problems.append(f"{path}:{number}: {crate} ({folder}) reads the environment: pass the value in")
    return problems


def check_manifest(crate, path, text):
    if re.search(r"^\[lints\]\s*\nworkspace\s*=\s*true", text, re.M):
        return []
    return [f"{path}: {crate} does not take the workspace's lints: add [lints] workspace = true"]


def check_suite(crate, main, files):
    """A file that tests/main.rs does not name is not compiled."""
    return [f"{crate}: tests/main.rs has no line \"mod {name};\"" for name in files if not re.search(rf"^mod {name};", main, re.M)]


def check_workspace():
    command = ["cargo", "metadata", "--format-version", "1", "--no-deps"]
    packages = json.loads(subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout)["packages"]
    place = {p["name"]: Path(p["manifest_path"]).relative_to(ROOT) for p in packages}
    folder_of = {crate: path.parts[1] if path.parts[0] == "crates" else TESTS for crate, path in place.items()}
    problems = check_page((ROOT / PAGE).read_text(encoding="utf-8"), folder_of) + check_packages(packages, folder_of)
    sources = 0
    for crate, manifest in place.items():
        problems += check_manifest(crate, manifest.as_posix(), (ROOT / manifest).read_text(encoding="utf-8"))
        suite = ROOT / manifest.parent / "tests" / "main.rs"
        if suite.exists():
            files = sorted(path.stem for path in suite.parent.glob("*.rs") if path != suite)
            problems += check_suite(crate, suite.read_text(encoding="utf-8"), files)
        base = ROOT / manifest.parent / "src"
        texts = {path.relative_to(base).as_posix(): path.read_text(encoding="utf-8") for path in sorted(base.rglob("*.rs"))}
        sources += len(texts)
        problems += check_cycles(crate, texts)
        for path, text in texts.items():
            problems += check_source(crate, folder_of[crate], (manifest.parent / "src" / path).as_posix(), text)
    return problems, f"{len(packages)} crates, {sources} source files"


# ------------------------------------------------------------------------------------------
# self-test
def self_test():
    """Checks that every rule reports a workspace that violates it, and no other."""
    def package(name, *dependencies):
        split = [d.split(":") for d in dependencies]
        return {"name": name, "dependencies": [{"name": d[-1], "kind": d[0] if len(d) > 1 else None} for d in split]}

    folders = {"flexarm-cli": "faces", "flexarm": "faces", "flexarm-verify": "proof", "flexarm-map": "studies", "flexarm-log": "results",
               "flexarm-stepping": "dynamics", "flexarm-kinematics": "dynamics", "flexarm-fem": "links", "flexarm-testkit": "tests"}
    good = {
        "flexarm-cli": ["flexarm", "clap"], "flexarm": ["flexarm-map", "flexarm-log"], "flexarm-verify": ["flexarm", "flexarm-fem"],
        "flexarm-map": ["flexarm-log"], "flexarm-log": ["mcap"], "flexarm-fem": ["faer"],
        "flexarm-stepping": ["flexarm-kinematics", "diffsol", "dev:flexarm-testkit", "dev:flexarm-fem"],
        "flexarm-kinematics": ["dev:flexarm-testkit"], "flexarm-testkit": ["flexarm-kinematics"],
    }

    def found(change=None, extra="", **other):
        place = {**folders, **other}
        page = " ".join(f"`{crate}`" for crate in folders) + extra
        return check_page(page, place) + check_packages([package(n, *d) for n, d in {**good, **(change or {})}.items()], place)

    source = lambda folder, text: check_source("c", folder, "c.rs", text)
    chain = {f"{a}.rs": f"use crate::{b}::X;" for a, b in zip("abcd", "bcda")}
    cases = [  # mistake, findings, words of the message; None: no finding allowed
        ("a sound workspace", found(), None),
        ("upwards", found({"flexarm-kinematics": ["flexarm-fem"]}), "flexarm-kinematics (dynamics): dependency on flexarm-fem (links)"),
        ("upwards in tests", found({"flexarm-kinematics": ["dev:flexarm"]}), None),
        ("a study on the facade", found({"flexarm-map": ["flexarm"]}), "flexarm-map (studies): dependency on flexarm (faces)"),
        ("a face below the facade", found({"flexarm-cli": ["flexarm-log"]}), "it uses flexarm and flexarm-fmu and flexarm-rerun alone"),
        ("a face on the case studies", found({"flexarm": ["flexarm-verify"]}), "flexarm (faces): dependency on flexarm-verify (proof)"),
        ("testkit in the product", found({"flexarm-stepping": ["flexarm-testkit"]}), "dev-dependencies only"),
        ("mcap below", found({"flexarm-stepping": ["mcap"]}), "dependency on mcap: only motion and results may name it"),
        ("rerun below the faces", found({"flexarm-log": ["rerun", "mcap"]}), "dependency on rerun: only faces"),
        ("faer elsewhere", found({"flexarm-stepping": ["dev:faer"]}), "dev-dependency on faer: only links"),
        ("clap in the facade's folder", found({"flexarm": ["clap"]}), None),
        ("urdf-rs below", found({"flexarm-kinematics": ["urdf-rs"]}), "only robot may name it"),
        ("a crate the page forgot", found({"flexarm-new": []}, **{"flexarm-new": "studies"}), "crate flexarm-new is not on it"),
        ("a crate that is gone", found(extra="see flexarm-gone/src/lib.rs"), "names flexarm-gone, which is not"),
        ("a folder of its own", found({"flexarm-map": []}, **{"flexarm-map": "maps"}), "maps is not a folder"),
        ("a cycle of four files", check_cycles("c", chain), "4 files import each other"),
        ("a cycle of three files", check_cycles("c", {**chain, "c.rs": "use crate::{a::X, e};"}), None),
        ("a cycle of paths in code, by super", check_cycles("c", {**chain, "d.rs": "fn f() { super::a::g() }"}), "4 files import each other"),
        ("a cycle of tests", check_cycles("c", {**chain, "d.rs": "fn f() {}\n#[cfg(test)]\nmod tests { use crate::a::X; }"}), None),
        ("a file of tests that is not compiled", check_suite("c", "mod a;\n// mod b;\n", ["a", "b"]), 'no line "mod b;"'),
        ("files of tests, all named", check_suite("c", "mod a;\nmod b;\n", ["a", "b"]), None),
        ("printing", source("run", 'fn f() {\n    println!("x");\n}\n'), "c.rs:2: c prints"),
        ("printing to stderr", source("base", 'eprint!("x");'), "prints"),
        ("printing in the facade", check_source("flexarm", "faces", "c.rs", 'println!("x");'), "prints"),
        ("a module of tests prints", check_source("c", "base", "src/x/tests.rs", 'eprintln!("x");'), None),
        ("a part of a module of tests prints", check_source("c", "base", "src/x/tests/y.rs", 'eprintln!("x");'), None),
        ("the program of the case studies prints", check_source("c", "proof", "crates/proof/c/src/main.rs", 'println!("x");'), None),
        ("a face prints", source("faces", 'println!("x");'), None),
        ("printing in docs and tests", source("base", '/// println!("x");\n#[cfg(test)]\nmod tests { fn f() { println!("x"); } }'), None),
        ("a clock inside", source("motion", "let t = Instant::now();"), "clock"),
        ("a clock in a run", source("run", "let t = Instant::now();"), None),
        ("the environment inside", source("base", 'std::env::var("X")'), "environment"),
        ("the environment in a run", source("run", "let x = std::env::var(y);"), "reads the environment"),
        ("the environment in a face", source("faces", "let x = std::env::args();"), None),
        ("the environment where it is allowed", check_source("flexarm-urdf", "robot", "crates/robot/flexarm-urdf/src/resolve.rs", ".filter_map(std::env::var_os)"), None),
        ("a flag in a text", source("run", 'f("ok");\ng("use --step, or so");'), "c.rs:2: c names the flag --step"),
        ("a flag in a text of many lines", source("base", 'f("a \\\n  b (--step)");'), "names the flag --step"),
        ("a flag in a raw text", source("base", 'f(r#"say "--step""#);'), "names the flag --step"),
        ("a flag at the start", source("proof", 'f("--from");'), "names the flag --from"),
        ("a short flag", source("results", 'f("choose another with -o");'), "names the flag -o"),
        ("a flag in a face", source("faces", 'f("use --step");'), None),
        ("a flag in a comment, a dash, an axis, a difference", source("run", '// use --step\nf("a -- b, well-known, not along -z");\nlet x = a --b;'), None),
        ("a flag of another program", check_source("flexarm-fe-io", "links", "crates/links/flexarm-fe-io/src/mesh/read.rs", 'f("gmsh -o OUT");'), None),
        ("its own flag there", check_source("flexarm-fe-io", "links", "crates/links/flexarm-fe-io/src/mesh/read.rs", 'f("gmsh --force");'), "names the flag --force"),
        ("a flag after a quoted quote and a lifetime", source("run", "fn f<'a>(x: &'a str) -> char { '\"' }\ng(\"--step\");"), "c.rs:2: c names the flag --step"),
        ("a flag in a test", source("run", 'fn f() {}\n#[cfg(test)]\nmod tests { fn g() { h("--step"); } }'), None),
        ("a word of a terminal", source("run", 'f("the command line says");'), "speaks of the command line"),
        ("the end of the process", source("run", "std::process::exit(2);"), "ends the process"),
        ("an exit code", source("proof", "pub fn exit_code(&self) -> u8 {"), "exit code"),
        ("a face ends", source("faces", "std::process::exit(2);"), None),
        ("files among numbers", check_source("flexarm-stepping", "dynamics", "c.rs", "use std::path::PathBuf;"), "names files"),
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
