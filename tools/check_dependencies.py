#!/usr/bin/env python3
"""Checks that the crates depend on each other as ARCHITECTURE.md says. Plain Python 3, needs cargo.

    python3 tools/check_dependencies.py                status 1 and one line per violation
    python3 tools/check_dependencies.py --self-test    feeds made-up workspaces to every rule

Rules:
 * a crate uses crates of lower lines of the table only; the line "tests" is for dev-dependencies; flexarm-testkit uses
   the base line and below, flexarm-tests whatever it likes;
 * outside crates that belong to one line (OWNERS) are named nowhere else, dev-dependencies included;
 * no source file but the faces' prints, and none from words to results reads a clock;
 * no text and no code of a library crate (all but the faces and the tests) knows a command line: flags, its words, the
   environment, the exit of the process (ALLOWED lists what may, and why);
 * what a crate "must not know" by the page is not in its code (MUST_NOT_KNOW), as far as a word shows it;
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
LINES = ["packages", "faces", "proof", "facade", "edges", "results", "motion", "links", "base", "words", "algebra"]  # top to bottom
FACES = ("packages", "faces")  # what people hold: words, signals, the end of the process
INNER = ["results", "motion", "links", "base", "words", "algebra"]
OWNERS = {  # outside crate: lines that may name it
    **dict.fromkeys(["rerun", "mcap", "re_cdr", "parquet", "arrow-array", "arrow-ipc", "arrow-schema", "rustix", "zstd", "lz4_flex", "bzip2", "rusqlite",
                     "urdf-rs"], ["edges"]),
    **dict.fromkeys(["png", "plotters", "noto-sans-mono-bitmap", "clarabel", "rand", "sobol_burley", "statrs"], ["results"]), "hdf5-pure": ["links"], "diffsol": ["motion"],
    **dict.fromkeys(["faer", "metis-sys", "saphyr-parser"], ["base"]), "toml_edit": ["facade"],
    **dict.fromkeys(["signal-hook", "clap", "clap_complete", "clap_mangen", "indicatif"], ["faces"]),
    **dict.fromkeys(["pyo3", "pyo3-build-config", "numpy"], ["packages"]),
}
PRINTS = re.compile(r"\b(?:e?print(?:ln)?|dbg)!\s*[(\[{]|\bstd::io::(?:stdout|stderr)\b")
CLOCK = re.compile(r"\b(?:Instant|SystemTime)::now\b")
ENVIRONMENT = re.compile(r"\bstd::env\b|\benv::(?:var|args|current)")
EXIT = re.compile(r"\bprocess::(?:exit|abort|ExitCode)\b|\bExitCode\b|\bexit_code\b")
FLAG = re.compile(r"(?<![\w-])--[a-z][a-z-]*|(?<![\w/-])-o(?![\w-])")
FACE_WORDS = re.compile(r"\b(?:command line|exit code|terminal|stdout|stderr)\b")
ALLOWED = {  # file: what it may have (a pattern of the hit), and why
    "crates/links/flexarm-fe-io/src/mesh/read.rs": (r"-o", "tells how to call another program, Gmsh"),
    "crates/motion/flexarm-motion-io/src/error.rs": (r"--full-length", "tells how to call another program, ROS 2"),
    "crates/robot/flexarm-urdf/src/resolve.rs": (r"std::env", "search_paths_from_environment, which the caller may use or not"),
    "crates/robot/flexarm-urdf/src/xacro/substitution.rs": (r"std::env|env::var|env::current", "xacro's own $(env NAME), $(optenv NAME) and $(cwd)"),
    "crates/faces/flexarm/src/report/html/figures.rs": (r"--c", "a custom property of a style sheet"),
    "crates/proof/flexarm-verify/src/files.rs": (r"--force|--check|-o", "the page tells how it is written, and is compared letter by letter"),
    "crates/proof/flexarm-verify/src/one_beam/page.rs": (r"--[a-z-]+|-o", "the page tells how a figure is had by hand"),
    "crates/proof/flexarm-verify/src/three_beams/page.rs": (r"--[a-z-]+|-o", "the page tells how a figure is had by hand"),
    "crates/proof/flexarm-verify/src/lower_arm/page.rs": (r"--[a-z-]+|-o", "the page tells how a figure is had by hand"),
    "crates/proof/flexarm-verify/src/manipulator/page.rs": (r"--[a-z-]+|-o", "the page tells how a figure is had by hand"),
}
FILES = (r"\bstd::(?:fs|path)\b|\bPathBuf\b|\bFile::open\b", "files")
MUST_NOT_KNOW = {  # crate: what its code must not have, and what it is; imports of other crates are the manifest's matter
    "flexarm-settings": [FILES, (r"\bflexarm_(?!settings\b)\w+", "other crates of the workspace")],
    "flexarm-spatial": [FILES, (r"\bflexarm_(?!spatial\b)\w+", "other crates of the workspace")],
    "flexarm-sample": [(r"\bstd::fs\b|\bFile::open\b", "files"), (r"\bflexarm_(?!sample\b|spatial\b)\w+", "how a run is made")],
    "flexarm-kinematics": [FILES, (r"\b[Ss]tiffness\b", "stiffness")],
    "flexarm-fem": [(r"\b(?:Joint|Robot|Mechanism)\b", "joints and robots"), (r"\b(?:flate2|hdf5_pure)\b", "files of other programs")],
    "flexarm-files": [(r"\bflexarm_(?!files\b|settings\b)\w+", "what the files mean")],
    "flexarm-fe-io": [(r"\breduction::|\bCondensation\b|\breduce_mesh\b", "reduction"), (r"\b(?:Robot|Mechanism)\b", "robots")],
    "flexarm-linkmaker": [(r"\b(?:Robot|Mechanism|Joint|Trajectory|Motion)\b|\bread_urdf\b", "robots and motion"),
                          (r"\bflexarm_(?!linkmaker\b|draw\b|fe_io\b|fem\b|files\b|settings\b|spatial\b)\w+", "more than links")],
    "flexarm-programs": [(r"\b(?:Robot|Mechanism|Trajectory|inverse_kinematics)\b", "robots and planned motion"),
                         (r"\bflexarm_(?!programs\b|path\b|spatial\b|files\b)\w+", "more than programs")],
    "flexarm-draw": [(r"\bflexarm_log\b|\bRecorder\b", "files of recordings"), (r"\bflexarm_(?:stepping|analysis)\b", "what numbers mean")],
    "flexarm-trajectory": [(r"\b(?:Robot|Mechanism|inverse_kinematics)\b", "robots and inverse kinematics")],
    "flexarm-motion-io": [(r"\b(?:Robot|Mechanism|Model)\b", "robots"), (r"\bflexarm_(?!motion_io\b|trajectory\b|files\b|settings\b)\w+", "more than trajectories")],
    "flexarm-flexlink": [FILES],
    "flexarm-identify": [FILES, (r"\b(?:Robot|Trajectory)\b", "robots by name and motion"),
                         (r"\bflexarm_(?!identify\b|stepping\b|kinematics\b|testkit\b)\w+", "more than arms at rest")],
    "flexarm-study": [FILES, (r"\bflexarm_(?!study\b)\w+", "other crates of the workspace")],
    "flexarm-path": [FILES, (r"\b[Ss]tiffness\b", "stiffness"), (r"\bflexarm_(?!path\b|kinematics\b|spatial\b|trajectory\b|testkit\b)\w+", "more than motions")],
    "flexarm-stepping": [FILES, (r"\b(?:TcpMetrics|substitute)\b", "metrics and substitution")],
    "flexarm-chatter": [FILES, (r"\b(?:Robot|Pose)\b", "robots and poses"), (r"\bflexarm_(?!chatter\b)\w+", "other crates of the workspace")],
    "flexarm-analysis": [FILES, (r"\bflexarm_(?!analysis\b|kinematics\b)\w+", "other crates than the one of poses")],
    "flexarm-urdf": [(r"\b(?:inverse_dynamics|mass_matrix|forward_dynamics)\b", "dynamics")],
    "flexarm-log": [(r"\bflexarm_stepping\b|\bStepper\b", "how a simulation runs"), (r"\bflexarm_fem\b", "finite elements")],
    "flexarm": [(r"\bclap\b|\bindicatif\b", "arguments and terminals")],
    "flexarm-verify": [(r"\bclap\b|\bindicatif\b", "arguments and terminals")],
    "flexarm-cli": [(r"\bflexarm_(?!verify\b|cli\b)\w+", "other crates than the facade and the case studies")],
    "flexarm-python": [(r"\bflexarm_(?!cli\b)\w+", "other crates than the facade and the command line")],
    "flexarm-testkit": [], "flexarm-tests": [],      # truths and privacy show in no word
}
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
    for crate in sorted(existing - set(MUST_NOT_KNOW)):
        problems.append(f"tools/check_dependencies.py: what {crate} must not know is not checked: add it to MUST_NOT_KNOW")
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


def scan(text):
    """Pieces of Rust source: (kind, start, end) with kind "code", "comment" or "literal" (between its quotes)."""
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
    """Line and text of each string literal."""
    return [(text.count("\n", 0, start) + 1, text[start:end]) for kind, start, end in scan(text) if kind == "literal"]


def without_literals(text):
    """The code alone; line breaks stay."""
    kept = list(re.sub(r"[^\n]", " ", text))
    for kind, start, end in scan(text):
        if kind == "code":
            kept[start:end] = text[start:end]
    return "".join(kept)


def check_source(crate, line, path, text):
    problems = []
    if re.search(r"/(?:tests|test_\w+)\.rs$", str(path)):  # a module of unit tests
        return problems
    pattern, _ = ALLOWED.get(str(path), (r"(?!)", ""))
    may = lambda hit: re.fullmatch(pattern, hit.group())
    is_library = line not in (*FACES, "tests")
    before_tests = text.split("\n#[cfg(test)]\nmod ", 1)[0]
    for number, literal in literals(before_tests) if is_library else []:
        for hit in [h for h in FLAG.finditer(literal) if not may(h)][:1]:
            problems.append(f"{path}:{number}: {crate} names the flag {hit.group()}: name a Setting, each face has its own words for it")
        for hit in [h for h in FACE_WORDS.finditer(literal) if not may(h)][:1]:
            problems.append(f"{path}:{number}: {crate} speaks of the {hit.group()}, which only a face has")
    for number, code in enumerate(without_literals(before_tests).splitlines(), 1):
        if is_library and EXIT.search(code):
            problems.append(f"{path}:{number}: {crate} ends the process or knows its exit code: return an error, the face ends")
        for word, what in MUST_NOT_KNOW.get(crate, []):
            if re.search(word, code):
                problems.append(f"{path}:{number}: {crate} knows {what}, which {PAGE} says it must not")
    for number, code in enumerate(code_of(text).splitlines(), 1):
        if line not in (*FACES, "tests") and PRINTS.search(code):
            problems.append(f"{path}:{number}: {crate} prints; only the faces do: return what is to be said")
        if line in INNER and CLOCK.search(code):
            problems.append(f"{path}:{number}: {crate} ({line}) reads a clock: pass the value in")
        if is_library and any(not may(hit) for hit in ENVIRONMENT.finditer(code)):
            problems.append(f"{path}:{number}: {crate} ({line}) reads the environment: pass the value in")
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
        ("mcap below", found({"flexarm-stepping": ["mcap"]}), "dependency on mcap: only edges may name it"),
        ("a package on a face", found({"flexarm-python": ["flexarm", "flexarm-cli", "pyo3"]}, {**lines, "packages": ["flexarm-python"]}), None),
        ("a face on a package", found({"flexarm-python": [], "flexarm-cli": ["flexarm-python"]}, {**lines, "packages": ["flexarm-python"]}), "flexarm-cli (faces): dependency on flexarm-python (packages)"),
        ("pyo3 in a face", found({"flexarm-cli": ["flexarm", "pyo3"]}), "only packages may name it"),
        ("rerun in a face", found({"flexarm-cli": ["flexarm", "rerun"]}), "dependency on rerun: only edges"),
        ("faer elsewhere", found({"flexarm-stepping": ["dev:faer"]}), "dev-dependency on faer: only base"),
        ("diffsol elsewhere", found({"flexarm": ["diffsol"]}), "only motion may name it"),
        ("clap in the facade", found({"flexarm": ["clap"]}), "only faces may name it"),
        ("urdf-rs below", found({"flexarm-kinematics": ["urdf-rs"]}), "only edges may name it"),
        ("a crate the page forgot", found({"flexarm-new": []}), "flexarm-new is missing from the table of lines"),
        ("a crate nobody watches", found({"flexarm-new": []}), "what flexarm-new must not know is not checked"),
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
        ("the environment in the facade", source("facade", "let x = std::env::var(y);"), "reads the environment"),
        ("the environment in a face", source("faces", "let x = std::env::args();"), None),
        ("the environment where it is allowed", check_source("flexarm-urdf", "edges", "crates/robot/flexarm-urdf/src/resolve.rs", ".filter_map(std::env::var_os)"), None),
        ("a flag in a text", source("facade", 'f("ok");\ng("use --step, or so");'), "c.rs:2: c names the flag --step"),
        ("a flag in a text of many lines", source("base", 'f("a \\\n  b (--step)");'), "names the flag --step"),
        ("a flag in a raw text", source("base", 'f(r#"say "--step""#);'), "names the flag --step"),
        ("a flag at the start", source("proof", 'f("--from");'), "names the flag --from"),
        ("a short flag", source("edges", 'f("choose another with -o");'), "names the flag -o"),
        ("a flag in a face", source("faces", 'f("use --step");'), None),
        ("a flag in a comment, a dash, an axis, a difference", source("facade", '// use --step\nf("a -- b, well-known, not along -z");\nlet x = a --b;'), None),
        ("a flag of another program", check_source("flexarm-fem", "base", "crates/links/flexarm-fe-io/src/mesh/read.rs", 'f("gmsh -o OUT");'), None),
        ("its own flag there", check_source("flexarm-fem", "base", "crates/links/flexarm-fe-io/src/mesh/read.rs", 'f("gmsh --force");'), "names the flag --force"),
        ("a flag after a quoted quote and a lifetime", source("facade", "fn f<'a>(x: &'a str) -> char { '\"' }\ng(\"--step\");"), "c.rs:2: c names the flag --step"),
        ("a flag in a test", source("facade", 'fn f() {}\n#[cfg(test)]\nmod tests { fn g() { h("--step"); } }'), None),
        ("a word of a terminal", source("facade", 'f("the command line says");'), "speaks of the command line"),
        ("the end of the process", source("facade", "std::process::exit(2);"), "ends the process"),
        ("an exit code", source("proof", "pub fn exit_code(&self) -> u8 {"), "exit code"),
        ("a face ends", source("faces", "std::process::exit(2);"), None),
        ("files in the motion", check_source("flexarm-stepping", "motion", "c.rs", "use std::path::PathBuf;"), "flexarm-stepping knows files"),
        ("a robot in the link maker", check_source("flexarm-linkmaker", "edges", "c.rs", "let robot: Robot = read_urdf(path)?;"), "knows robots and motion"),
        ("joints of a link as numbers", check_source("flexarm-linkmaker", "edges", "c.rs", "pub struct LinkJoint; use flexarm_fem::Mesh;"), None),
        ("a stepper in the link maker", check_source("flexarm-linkmaker", "edges", "c.rs", "use flexarm_stepping::Stepper;"), "knows more than links"),
        ("stiffness in a text of the kinematics", check_source("flexarm-kinematics", "base", "c.rs", 'f("stiffness"); // stiffness'), None),
        ("stiffness in the kinematics", check_source("flexarm-kinematics", "base", "c.rs", "let stiffness = 1.0;"), "knows stiffness"),
        ("a face below the facade", check_source("flexarm-cli", "faces", "c.rs", "use flexarm_log::Sample;"), "other crates than the facade"),
        ("a package below the facade", check_source("flexarm-python", "packages", "c.rs", "use flexarm_log::Sample;"), "other crates than the facade"),
        ("a face and the facade", check_source("flexarm-cli", "faces", "c.rs", "use flexarm::Error;\nuse flexarm_verify::verify;"), None),
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
