#!/usr/bin/env python3
"""Builds the documentation site from docs/*.md and checks every link to a file of the repository.

    python3 tools/build_docs.py [-o target/site]

Makes a virtual environment with Sphinx in target/; a warning of Sphinx is an error. The front page
embeds the page of web/ if tools/build_web.py has built it. Exit status: 0 built, 1 a broken link or
a warning, 3 pip cannot install Sphinx (no network).
"""

import argparse
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PACKAGES = ["sphinx==9.0.4", "myst-parser==5.2.0", "furo==2025.12.19"]


def broken_links():
    """Links of Markdown files to files of the repository that do not exist."""
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True)
    broken = []
    for name in listed.stdout.split():
        text = re.sub(r"```.*?```|`[^`]*`", "", (ROOT / name).read_text(), flags=re.S)
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            path = target.split("#")[0]
            if path and "://" not in path and not path.startswith("mailto:") and not (ROOT / name).parent.joinpath(path).exists():
                broken.append(f"{name}: {target} does not exist")
    return broken


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
    web = ROOT / "web/dist"
    tags = ["-t", "web"] if web.is_dir() else []
    built = subprocess.run([str(python), "-m", "sphinx", *tags, "-q", "-W", "--keep-going", "-b", "html", str(ROOT / "docs"), str(out)])
    if tags:
        shutil.copytree(web, out / "web", dirs_exist_ok=True)
    if built.returncode == 0:
        print(f"{out}/index.html")
    return 1 if broken or built.returncode else 0


if __name__ == "__main__":
    sys.exit(main())
