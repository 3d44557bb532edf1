"""Sphinx configuration."""

project = "horf"
author = "The horf developers"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
# Tables are included in pages.
exclude_patterns = ["_build", "tables"]
html_theme = "furo"
html_title = "horf"
autodoc_typehints = "description"
