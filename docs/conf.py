"""Sphinx configuration of the documentation site; tools/build_docs.py builds it."""

project = "flexarm"
author = "The flexarm developers"
copyright = "The flexarm developers"
extensions = ["myst_parser"]
myst_heading_anchors = 3
# Pygments has no lexer for CSV; tools/build_docs.py checks links to files outside of docs.
suppress_warnings = ["misc.highlighting_failure", "myst.xref_missing"]
html_theme = "furo"
html_title = "flexarm"
