"""The site: `sphinx-build -W --keep-going -b html docs <folder>`."""

from __future__ import annotations

from importlib import metadata

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

project = "fem-needle"
author = "The fem-needle developers"
copyright = author
version = release = metadata.version("fem-needle")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_heading_anchors = 3

autodoc_default_options = {"members": True, "exclude-members": "model_config, model_post_init"}
autodoc_member_order = "bysource"
autodoc_typehints = "none"
napoleon_google_docstring = False
napoleon_use_rtype = False

html_theme = "furo"
html_title = f"fem-needle {release}"


def setup(app: Sphinx) -> None:
    """Let blocks of data be plain text."""
    app.add_lexer("csv", TextLexer)
