#!/usr/bin/env python3
"""Builds the documentation site from docs/*.md and checks every link to a file of the repository.

    python3 tools/build_docs.py [-o target/site]

Makes a virtual environment with Sphinx in target/; a warning of Sphinx is an error. The page of the
command line is written from `flexarm help`, that of the Python package from the newest wheel in
target/wheels, whose type stub has the docstrings of the compiled classes; without a wheel, from the
sources. The front page embeds the page of web/ if tools/build_web.py has built it. The program is $FLEXARM, else
target/release/flexarm, else flexarm on the PATH. Exit status: 0 built, 1 a broken link or a warning,
3 pip cannot install Sphinx (no network).
"""

import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import zipfile

import make_gallery

ROOT = pathlib.Path(__file__).resolve().parent.parent
PACKAGES = [
    "sphinx==9.0.4", "myst-parser==5.2.0", "furo==2025.12.19", "sphinx-autoapi==3.8.0", "sphinx-copybutton==0.5.2", "sphinx-notfound-page==1.1.0",
]
# Written by command_line(); not stored.
COMMAND_LINE = ROOT / "docs/command-line.md"


def broken_links():
    """Links of Markdown files to files of the repository that do not exist."""
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True)
    broken = []
    for name in listed.stdout.split():
        text = re.sub(r"```.*?```|`[^`]*`", "", (ROOT / name).read_text(), flags=re.S)
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            path = target.split("#")[0]
            if path.startswith("python-api/") or path == COMMAND_LINE.name:
                continue
            if path and "://" not in path and not path.startswith("mailto:") and not (ROOT / name).parent.joinpath(path).exists():
                broken.append(f"{name}: {target} does not exist")
    return broken


def command_line(flexarm):
    """Writes the help of all commands as a page."""

    def help_of(*command):
        return subprocess.run([flexarm, *command, "--help"], capture_output=True, text=True, check=True, env={**os.environ, "COLUMNS": "96"}).stdout

    text = "# Command line\n\nWritten from `flexarm help COMMAND`. Exit codes: 0 done, 1 the run failed, 2 bad input.\n"
    whole = help_of()
    text += f"\n```text\n{whole.strip()}\n```\n"
    for line in whole.splitlines():
        heading, command = re.fullmatch(r"([A-Z][\w ]+):", line), re.match(r"  ([a-z][a-z-]+)  +[A-Z]", line)
        if heading and heading[1] not in ("Usage", "Start"):
            text += f"\n## {heading[1]}\n"
        elif command and command[1] != "help":
            text += f"\n### {command[1]}\n\n```text\n{help_of(command[1]).strip()}\n```\n"
    COMMAND_LINE.write_text(text)


def python_package():
    """The folder with the Python package: that of the newest wheel, else that of the sources."""
    wheels = sorted((ROOT / "target/wheels").glob("flexarm-*.whl"), key=lambda file: file.stat().st_mtime)
    if not wheels:
        print("without a wheel in target/wheels: compiled classes are left out (tools/build_wheel.py)")
        return ROOT / "crates/faces/flexarm-python/python"
    folder = ROOT / "target/docs-python"
    shutil.rmtree(folder, ignore_errors=True)
    with zipfile.ZipFile(wheels[-1]) as wheel:
        wheel.extractall(folder, [name for name in wheel.namelist() if re.fullmatch(r"flexarm/\w+\.pyi?", name)])
    return folder


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--out", type=pathlib.Path, default=ROOT / "target/site")
    out = parser.parse_args().out
    broken = broken_links()
    print("\n".join(broken) if broken else "every link to a file leads to one")
    environment = ROOT / "target/docs-venv"
    python = environment / "bin/python"
    made = subprocess.run([sys.executable, "-m", "venv", str(environment)], capture_output=True)
    if made.returncode or subprocess.run([str(python), "-m", "pip", "install", "-q", *PACKAGES], capture_output=True).returncode:
        print("skipped: pip cannot install " + ", ".join(PACKAGES))
        return 1 if broken else 3
    command_line(make_gallery.program())
    web = ROOT / "web/dist"
    tags = ["-t", "web"] if web.is_dir() else []
    sphinx = [str(python), "-m", "sphinx", *tags, "-q", "-W", "--keep-going", "-b", "html", str(ROOT / "docs"), str(out)]
    built = subprocess.run(sphinx, env={**os.environ, "FLEXARM_PYTHON": str(python_package())})
    if tags:
        shutil.copytree(web, out / "web", dirs_exist_ok=True)
    if built.returncode == 0:
        print(f"{out}/index.html")
    return 1 if broken or built.returncode else 0


if __name__ == "__main__":
    sys.exit(main())
