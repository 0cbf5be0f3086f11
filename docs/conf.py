"""The site: `sphinx-build -W --keep-going -b html docs <folder>`."""

from __future__ import annotations

from importlib import metadata

from pydantic import BaseModel
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

COLON = "\N{RATIO}"


def setup(app: Sphinx) -> None:
    """Let blocks of data be plain text; keep first lines and signatures readable."""
    app.add_lexer("csv", TextLexer)
    app.connect("autodoc-process-docstring", _hide_colons, priority=400)
    app.connect("autodoc-process-docstring", _show_colons, priority=600)
    app.connect("autodoc-process-signature", _short_signature)


def _hide_colons(app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Hide colons of a property's docstring from napoleon, which takes what is before the first one as a type."""
    if what in ("property", "attribute"):
        lines[:] = [line.replace(":", COLON) for line in lines]


def _show_colons(app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    lines[:] = [line.replace(COLON, ":") for line in lines]


def _short_signature(
    app: Sphinx, what: str, name: str, thing: object, options: object, signature: str | None, returned: str | None
) -> tuple[str, str | None] | None:
    """Leave out the defaults of a part of a scene: they are parts themselves, and in the contract."""
    if not (isinstance(thing, type) and issubclass(thing, BaseModel)):
        return None
    keys = (key if field.is_required() else f"{key}=..." for key, field in thing.model_fields.items())
    return f"(*, {', '.join(keys)})", returned
