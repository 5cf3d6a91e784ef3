"""Sphinx configuration of the documentation site; tools/build_docs.py builds it."""

import os
import pathlib
import re
import tomllib

DOCS = pathlib.Path(__file__).resolve().parent
ROOT = DOCS.parent
WORKSPACE = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]
REPOSITORY = WORKSPACE["repository"]

project = "flexarm"
author = "The flexarm developers"
copyright = "The flexarm developers"
version = release = WORKSPACE["version"]
extensions = ["myst_parser", "autoapi.extension", "sphinx.ext.napoleon", "sphinx.ext.mathjax", "sphinx_copybutton", "notfound.extension"]
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 3
copybutton_prompt_text = "$ "
# Pygments has no lexer for CSV. tools/build_docs.py checks links between files.
# Types such as "path" in docstrings are words, not names.
suppress_warnings = ["misc.highlighting_failure", "ref.python"]

# The Python package, from its sources and type stubs, without importing it.
autoapi_dirs = [os.environ.get("FLEXARM_PYTHON", str(ROOT / "crates/faces/flexarm-python/python"))]
autoapi_file_patterns = ["*.pyi", "*.py"]
autoapi_options = ["members", "show-module-summary", "imported-members"]
autoapi_root = "python-api"
autoapi_add_toctree_entry = False
autoapi_keep_files = False

html_theme = "furo"
html_title = f"flexarm {version}"
html_baseurl = "https://flexarm.github.io/flexarm/"
html_logo = html_favicon = "images/logo.svg"
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_theme_options = {
    "source_repository": REPOSITORY,
    "source_branch": "main",
    "source_directory": "docs/",
    "footer_icons": [{"name": "repository", "url": REPOSITORY, "html": "source", "class": ""}],
}
notfound_urls_prefix = "/flexarm/"


def to_repository(app, docname, source):
    """Leads links to files outside of docs to the repository."""
    folder = (DOCS / docname).parent

    def link(found):
        path, hash, anchor = found[1].partition("#")
        place = (folder / path).resolve()
        if not path or ":" in path or place.is_relative_to(DOCS) or not place.is_relative_to(ROOT):
            return found[0]
        kind = "tree" if place.is_dir() else "blob"
        return f"]({REPOSITORY}/{kind}/main/{place.relative_to(ROOT)}{hash}{anchor})"

    source[0] = re.sub(r"\]\(([^)\s]+)\)", link, source[0])


def setup(app):
    app.connect("source-read", to_repository)
