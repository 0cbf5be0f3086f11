"""A report as one HTML page: everything inside, nothing from elsewhere, nothing that a scene says is run."""

from __future__ import annotations

import json
from base64 import b64encode
from hashlib import sha256
from importlib import metadata, resources
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from fem_needle.atomic_file import write_file
from fem_needle.report.parts import Chart, Page, Picture

TEMPLATE, STYLE, SCRIPT = "page.html", "page.css", "page.js"


def html_page(page: Page) -> str:
    """Return a report as HTML.

    Parameters
    ----------
    page
        Of `read_folder`.
    """
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters.update(source=_source, chart_data=_chart_data)
    charts = any(section.charts for section in page.sections)
    scripts = [get_plotlyjs(), _resource(SCRIPT)] if charts else []
    return environment.from_string(_resource(TEMPLATE)).render(
        page=page,
        style=Markup(_resource(STYLE)),
        scripts=[Markup(script) for script in scripts],
        policy=_policy(scripts),
        version=metadata.version("fem-needle"),
    )


def write_report(page: Page, path: Path) -> None:
    """Write a report; its folder is created where it is missing.

    Parameters
    ----------
    page
        Of `read_folder`.
    path
        An HTML file; one of that name is replaced.

    Raises
    ------
    ComputationError
        If the file cannot be written.
    """
    write_file(path, html_page(page).encode("utf-8", "replace"))


def _resource(name: str) -> str:
    return resources.files("fem_needle.report").joinpath(name).read_text(encoding="utf-8")


def _policy(scripts: list[str]) -> str:
    """Return what a browser may do for the page: run these scripts, show pictures from inside, fetch nothing."""
    digests = [f"'sha256-{b64encode(sha256(script.encode()).digest()).decode()}'" for script in scripts]
    allowed = " ".join(digests) or "'none'"
    return f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data: blob:"


def _source(picture: Picture) -> str:
    return f"data:image/png;base64,{b64encode(picture.content).decode()}"


def _chart_data(chart: Chart) -> Markup:
    """Return the data of a chart as JSON that cannot end its element."""
    data: dict[str, Any] = json.loads(chart.figure.to_json()) | {"moments": chart.moments, "first": chart.first}
    text = json.dumps(data, allow_nan=False).replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    return Markup(text)
