#!/usr/bin/env python3
"""Lists the public API of the library `flexarm`, item by item, from the pages made by `cargo doc`.

    cargo doc --release --no-deps --workspace
    python3 tools/public_surface.py            writes docs/public-surface.txt
    python3 tools/public_surface.py --check    status 1 if the file differs from the pages

Pages differ between versions of rustdoc: with a version other than that of the list, the check is
skipped with a message. The list makes changes of the API visible in review: a removed line is a
breaking change.
"""
import html
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/public-surface.txt"
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
KINDS = ["mod", "trait", "struct", "enum", "fn", "constant", "type", "macro"]


def text(markup):
    """Converts markup to one line of code."""
    plain = html.unescape(re.sub(r"<[^>]+>", "", re.sub(r'<a class="src.*?</a>', "", markup)))
    plain = re.sub(r"ⓘ", "", plain)
    return re.sub(r"\s+", " ", plain).strip()


def own_part(page):
    """Returns the page without trait implementations."""
    for mark in ('id="trait-implementations"', 'id="deref-methods', 'id="synthetic-implementations"', 'id="blanket-implementations"'):
        page = page.split(mark, 1)[0]
    return page


def members(kind, page):
    page = own_part(page)
    found = []
    if kind == "struct":
        found += [text(m) for m in re.findall(r'<span id="structfield\.[^"]*"[^>]*>(.*?)</span>', page, re.S)]
    if kind == "enum":
        found += [text(m) for m in re.findall(r'<section id="variant\.[^"]*"[^>]*>(.*?)</section>', page, re.S)]
    pattern = r'<section id="(?:method|tymethod|associatedconstant|associatedtype)\.[^"]*" class="method"[^>]*>(.*?)</section>'
    found += [text(m) for m in re.findall(pattern, page, re.S)]
    return [re.sub(r"^§\s*", "", m) for m in found]


def surface():
    folder = TARGET / "doc/flexarm"
    every = folder / "all.html"
    if not every.exists():
        sys.exit(f"{every} is not there: run cargo doc --release --no-deps --workspace first")
    lines, items = [], 0
    for link in sorted(set(re.findall(r'href="([A-Za-z_0-9/]*?(?:%s)\.[A-Za-z_0-9]+\.html)"' % "|".join(KINDS), every.read_text(encoding="utf-8")))):
        kind, name = pathlib.Path(link).name.split(".")[:2]
        path = "::".join(["flexarm", *pathlib.Path(link).parent.parts, name])
        page = (folder / link).read_text(encoding="utf-8")
        items += 1
        if kind == "fn":
            declaration = re.search(r'<pre class="rust item-decl"><code>(.*?)</code></pre>', page, re.S)
            lines.append(f"fn {path}: {text(declaration.group(1))}")
            continue
        lines.append(f"{kind} {path}")
        lines += [f"    {member}" for member in members(kind, page)]
    return lines, items


def rustdoc():
    """Returns the version of rustdoc without its patch number: 1.95."""
    said = subprocess.run(["rustdoc", "--version"], stdout=subprocess.PIPE, text=True, check=True).stdout
    return re.match(r"rustdoc (\d+\.\d+)", said).group(1)


def main():
    lines, items = surface()
    head = f"# What the library flexarm offers: tools/public_surface.py, from the pages of rustdoc {rustdoc()}"
    lines.insert(0, head)
    wanted = "\n".join(lines) + "\n"
    if sys.argv[1:] == ["--check"]:
        have = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
        if have and have.splitlines()[0] != head:
            print(f"skipped: the list was made with another rustdoc ({have.splitlines()[0].rsplit(' ', 1)[-1]}, here {rustdoc()})")
            return 0
        if have == wanted:
            print(f"public surface: {items} items, as listed")
            return 0
        old, new = set(have.splitlines()), set(lines)
        for line in sorted(old - new):
            print(f"gone: {line.strip()}")
        for line in sorted(new - old):
            print(f"new:  {line.strip()}")
        print("docs/public-surface.txt is not what the pages say: review the change, then python3 tools/public_surface.py")
        return 1
    if sys.argv[1:]:
        sys.exit(__doc__)
    PAGE.write_text(wanted, encoding="utf-8")
    print(f"{PAGE.relative_to(ROOT)}: {items} items, {len(lines)} lines")
    return 0


if __name__ == "__main__":
    sys.exit(main())
