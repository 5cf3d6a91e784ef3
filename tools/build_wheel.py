#!/usr/bin/env python3
"""Builds the Python package and tests it without a compiler.

Needs Python 3.11 or later, cargo and pip.

    python3 tools/build_wheel.py                    builds and tests a wheel for Linux as new as this
    python3 tools/build_wheel.py --manylinux        builds one for older Linux (links with zig)
    python3 tools/build_wheel.py --sdist            also builds and tests the source package
    python3 tools/build_wheel.py --no-test          builds only
    python3 tools/build_wheel.py --quick            tests without type checkers and plotting tools

Wheels are written to target/wheels. The linker for older Linux is zig from PyPI. The tests run in a
separate environment, in an empty folder, with a PATH without cargo. Status 0: success; 1: a step
failed; 3: pip cannot download what it needs (no network).
"""
import argparse
import base64
import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import tomllib
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "crates/faces/flexarm-python"
MOST_BYTES = 45e6  # with the web page and the library of FMUs
MATURIN = "maturin>=1.13,<2"
FMU_LIBRARY = {"darwin": "libflexarm_fmu.dylib", "win32": "flexarm_fmu.dll"}.get(sys.platform, "libflexarm_fmu.so")
#: Oldest glibc on which a manylinux wheel must run.
OLDEST_GLIBC = "2.28"
#: Packages that the tests require, and optional ones; tests without an optional package are
#: skipped.
NEEDED = ["numpy", "pytest"]
OTHERS = ["matplotlib", "scipy", "pandas", "polars", "pyarrow", "pin", "mypy", "pyright[nodejs]", "nbclient", "nbformat", "ipykernel"]
NO_NETWORK = 3


def run(*line, **options):
    print("+", " ".join(map(str, line)), flush=True)
    subprocess.run([str(word) for word in line], check=True, **options)


def environment(folder, *packages, without=()):
    """Creates a virtual environment; packages in `without` may be missing."""
    venv.create(folder, with_pip=True)
    python = folder / "bin/python"
    install = [python, "-m", "pip", "install", "-q", "--disable-pip-version-check"]
    if subprocess.run([*install, *packages]).returncode != 0:
        print(f"skipped: pip cannot install {', '.join(packages)}")
        sys.exit(NO_NETWORK)
    for package in without:
        if subprocess.run([*install, package]).returncode != 0:
            print(f"without {package}: pip cannot install it")
    return python


def zig_linker(tools):
    """Returns a linker with an old C library; compiled objects are only linked again."""
    linker = tools / "zig-cc"
    target = f"{platform.machine()}-linux-gnu.{OLDEST_GLIBC}"
    linker.write_text(f'#!/bin/sh\nexec "{tools}/maturin" zig cc -- -target {target} "$@"\n')
    linker.chmod(0o755)
    return linker


def library(target, linker):
    """Builds the library of FMUs, which the program in the wheel writes into them; returns its path."""
    # With the features of the wheel, so that nothing is compiled twice.
    features = ["--features", "flexarm-cli/rerun,flexarm-cli/sqlite"]
    run("cargo", "build", "--release", "--locked", "-p", "flexarm-fmu", "-p", "flexarm-cli", *features, cwd=ROOT)
    if linker:
        line = ["cargo", "rustc", "--release", "--locked", "-p", "flexarm-fmu", "--lib", "--crate-type", "cdylib"]
        run(*line, "--", "-C", f"linker={linker}", cwd=ROOT)
    return target / "release" / FMU_LIBRARY


def build(tools, out, manylinux, source=PACKAGE):
    """Builds the wheel with maturin, which checks that the symbols match the wheel's name."""
    line = [tools / "maturin", "build", "--release", "--locked", "--compression-level", "9", "-o", out]
    if manylinux:
        line += ["--compatibility", f"manylinux_{OLDEST_GLIBC.replace('.', '_')}", "--", "-C", f"linker={zig_linker(tools)}"]
    # Use the build folder of the workspace, so that nothing is compiled twice.
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    extra = {"CARGO_TARGET_DIR": str(target)}
    if source == PACKAGE:
        extra["FLEXARM_FMU_LIBRARY"] = str(library(target, zig_linker(tools) if manylinux else None))
    before = set(out.glob("*.whl"))
    run(*line, cwd=source, env={**os.environ, **extra, "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}"})
    new = set(out.glob("*.whl")) - before
    return new.pop() if new else max(out.glob("*.whl"), key=lambda file: file.stat().st_mtime)


def sdist(out):
    """Creates the source package in pip's layout: tracked files, with pyproject.toml at the top."""
    version = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]
    name = f"flexarm-{version}"
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / name
        folder.mkdir()
        archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout
        subprocess.run(["tar", "x", "-C", folder], input=archive, check=True)
        # Tests and their data are not included.
        for part in [".ci", "tests/golden", "tests/verification", "docs/images", "docs/verification"]:
            shutil.rmtree(folder / part, ignore_errors=True)
        text = (folder / "crates/faces/flexarm-python/pyproject.toml").read_text()
        text = text.replace('readme = "README.md"', 'readme = "crates/faces/flexarm-python/README.md"')
        text = text.replace('python-source = "python"', 'python-source = "crates/faces/flexarm-python/python"\nmanifest-path = "crates/faces/flexarm-python/Cargo.toml"')
        (folder / "pyproject.toml").write_text(text)
        about = tomllib.loads(text)["project"]
        (folder / "PKG-INFO").write_text(
            f"Metadata-Version: 2.1\nName: flexarm\nVersion: {version}\nSummary: {about['description']}\n"
            f"Requires-Python: {about['requires-python']}\n" + "".join(f"Requires-Dist: {d}\n" for d in about["dependencies"])
        )
        file = out / f"{name}.tar.gz"
        with tarfile.open(file, "w:gz") as tar:
            tar.add(folder, name)
    print(f"{file}: {file.stat().st_size / 1e6:.1f} MB")
    return file


RENDER = """
import sys
import rattler_build as rb

variants = rb.VariantConfig({"c_compiler": ["gcc"], "rust_compiler": ["rust"], "python": ["3.11"]})
recipe = rb.Stage0Recipe.from_file(sys.argv[1]).render(variants, rb.RenderConfig())[0].recipe.to_dict()
print(f"recipe.yaml: {recipe['package']['name']} {recipe['package']['version']}, as rattler-build {rb.rattler_build_version()} reads it")
"""


def check_recipe(python):
    """Checks that the recipe has the workspace version, and that rattler-build can read it if
    installed."""
    version = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]
    recipe = PACKAGE / "recipe.yaml"
    if f'  version: "{version}"\n' not in recipe.read_text():
        sys.exit(f"error: {recipe.relative_to(ROOT)} is not of version {version}")
    if subprocess.run([python, "-c", "import rattler_build"], capture_output=True).returncode == 0:
        subprocess.run([python, "-c", RENDER, recipe], check=True)
    else:
        print("without rattler-build: the recipe is not read")


def document(wheel, scratch):
    """Puts the stub with docstrings into a wheel."""
    python = environment(scratch / "stub", "numpy", wheel)
    stub = subprocess.run([python, ROOT / "tools/python_stub.py"], check=True, stdout=subprocess.PIPE).stdout
    digest = base64.urlsafe_b64encode(hashlib.sha256(stub).digest()).decode().rstrip("=")
    name, new = "flexarm/_flexarm.pyi", wheel.with_suffix(".new")
    with zipfile.ZipFile(wheel) as old, zipfile.ZipFile(new, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as out:
        for entry in old.infolist():
            data = stub if entry.filename == name else old.read(entry)
            if entry.filename.endswith(".dist-info/RECORD"):
                line = f"{name},sha256={digest},{len(stub)}"
                data = "\n".join(line if row.startswith(f"{name},") else row for row in data.decode().splitlines()) + "\n"
            out.writestr(entry, data)
    new.replace(wheel)


def inspect(wheel, *more):
    """Checks size and contents of the wheel; `more`: other files that it must have."""
    size = wheel.stat().st_size
    names = zipfile.ZipFile(wheel).namelist()
    print(f"{wheel}: {size / 1e6:.1f} MB, {len(names)} files")
    wanted = ["flexarm/py.typed", "flexarm/_flexarm.pyi", "flexarm/share/robots/kr210/robot.toml", "flexarm/share/trajectories/pick_and_place.toml", *more]
    missing = [name for name in wanted if name not in names]
    if missing or size > MOST_BYTES:
        sys.exit(f"error: the wheel has {size} bytes (most {MOST_BYTES:.0f}) and lacks {missing}")


def programs(folder):
    """Fills a folder with links to the system's programs except those of Rust; returns it."""
    folder.mkdir()
    for source in [Path("/usr/bin"), Path("/bin")]:
        for program in source.iterdir():
            link = folder / program.name
            if not program.name.startswith(("cargo", "rust")) and not link.is_symlink():
                link.symlink_to(program)
    return folder


def installed(wheel, scratch, *needed, without=()):
    """Creates an environment with a wheel, an empty folder, and variables without a compiler."""
    python = environment(scratch / "venv", *needed, without=without)
    run(python, "-m", "pip", "install", "-q", "--no-deps", "--disable-pip-version-check", wheel)
    empty = scratch / "empty"
    empty.mkdir()
    path = os.pathsep.join([str(python.parent), str(programs(scratch / "programs"))])
    return python, empty, {"PATH": path, "HOME": str(scratch), "MPLBACKEND": "Agg"}


def try_out(wheel):
    """Imports a wheel and runs the program."""
    with tempfile.TemporaryDirectory() as scratch:
        python, empty, bare = installed(wheel, Path(scratch), "numpy")
        run(python, "-c", "import flexarm; print(flexarm.load('kr210').flexible().simulate())", cwd=empty, env=bare)
        run(python.parent / "flexarm", "compare", cwd=empty, env=bare)


def test(wheel, quick):
    """Installs the wheel in an environment without a compiler, and runs its tests."""
    with tempfile.TemporaryDirectory() as scratch:
        python, empty, bare = installed(wheel, Path(scratch), *NEEDED, without=() if quick else OTHERS)
        begin = time.time()
        run(python, "-m", "pip", "install", "-q", "--no-deps", "--force-reinstall", "--disable-pip-version-check", wheel)
        run(python.parent / "flexarm", "compare", cwd=empty, env=bare)
        study = "import flexarm; a = flexarm.load('kr210').flexible(); print(a.deflections([None] * 20, step=5e-3))"
        run(python, "-c", study, cwd=empty, env=bare)
        print(f"from the wheel to a recording, a report and a study of 20 runs: {time.time() - begin:.1f} s")
        tests, examples = PACKAGE / "tests", PACKAGE / "examples"
        there = {**bare, "FLEXARM_EXAMPLES": str(examples)}
        run(python, "-m", "pytest", "-p", "no:cacheprovider", "-c", PACKAGE / "pyproject.toml", "--rootdir", tests, tests, cwd=empty, env=there)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for flag in ["--manylinux", "--sdist", "--no-test", "--quick"]:
        options.add_argument(flag, action="store_true")
    options.add_argument("-o", "--out", type=Path, default=ROOT / "target/wheels")
    args = options.parse_args()
    out = args.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        scratch = Path(scratch)
        packages = [MATURIN, "ziglang"] if args.manylinux else [MATURIN]
        python = environment(scratch / "tools", *packages, without=["py-rattler-build"])
        check_recipe(python)
        run(sys.executable, ROOT / "tools/python_types.py", "--check")
        tools = python.parent
        wheel = build(tools, out, args.manylinux)
        document(wheel, scratch)
        inspect(wheel, f"flexarm/share/lib/{FMU_LIBRARY}")
        if args.sdist:
            file = sdist(out)
            with tarfile.open(file) as tar:
                tar.extractall(scratch, filter="data")
            again = build(tools, scratch / "again", args.manylinux, scratch / file.name.removesuffix(".tar.gz"))
            inspect(again)
            try_out(again)
    if not args.no_test:
        test(wheel, args.quick)


if __name__ == "__main__":
    try:
        main()
    except subprocess.CalledProcessError as error:
        sys.exit(f"error: status {error.returncode}: {' '.join(map(str, error.cmd))}")
