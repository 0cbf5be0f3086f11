"""Sections that all reports have: what was run, every value, versions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from fem_needle.manifest import manifest as manifest_now
from fem_needle.report.numbers import MISSING, instant, number, quantity, tidy, varying, with_unit
from fem_needle.report.parts import Grid, Section
from fem_needle.report.words import layer_grids, scene_words
from fem_needle.scene import Scene
from fem_needle.scene.listing import entries

# Parts of a closed loop, shown where a scene has one.
_OF_A_LOOP = ("target", "controller", "actuators", "scatter")


def scene_section(scene: Scene, title: str = "What was run") -> Section:
    """Return the scene in words, with the table of its layers."""
    return Section("scene", title, paragraphs=scene_words(scene), grids=layer_grids(scene))


def values_section(scene: Scene) -> Section:
    """Return every value of a scene."""
    headers = ("key of the scene file", "value", "value in SI")
    grid = Grid("Every value of the scene, defaults and derived values included", headers, tuple(_rows(scene)))
    return Section("values", "All values", grids=(grid,), new_page=True)


def _rows(scene: Scene) -> Iterator[tuple[str, ...]]:
    fields = type(scene).model_fields
    hidden = {name for name in _OF_A_LOOP if getattr(scene, name) == fields[name].default} | {"title"}
    for path, value, kind in entries(scene):
        if path.partition(".")[0] in hidden:
            continue
        if isinstance(value, tuple):
            yield path, f"{len(value)} places", ""
        elif isinstance(value, str) or kind is None:
            yield path, str(value), ""
        else:
            stored = with_unit(f"{value:.6g}", kind.unit) if isinstance(value, float | int) else ""
            yield path, varying(value, kind.unit) if not isinstance(value, int) else str(value), stored


def versions_section(scene: Scene, manifest: dict[str, Any]) -> Section:
    """Return what computed the results beside what made the report."""
    now = manifest_now(scene)
    made = manifest.get("versions") if isinstance(manifest.get("versions"), dict) else {}
    names = list(dict.fromkeys((*(made or {}), *now["versions"])))
    rows = [(name, _text((made or {}).get(name)), _text(now["versions"].get(name))) for name in names]
    rows.append(("platform", _text(manifest.get("platform")), now["platform"]))
    rows.append(("date", instant(_text(manifest.get("started"))), instant(now["started"])))
    grid = Grid("With what it was made", ("", "of the results", "of this report"), tuple(rows))
    wall, seed = manifest.get("wall_time"), manifest.get("seed")
    told = f"Seed of random numbers: {_text(seed)}. " if seed is not None else ""
    told += f"Computed in {quantity(float(wall), 's')}." if isinstance(wall, int | float) else ""
    return Section("versions", "Versions", paragraphs=((("", told.strip()),) if told else ()), grids=(grid,))


def warnings_section(warnings: Iterator[str] | tuple[str, ...] | list[str]) -> Section:
    """Return the warnings, or that there are none."""
    told = tuple(dict.fromkeys(tidy(str(text)) for text in warnings))
    return Section("warnings", "Warnings", paragraphs=() if told else (("", "None."),), warnings=told)


def subject(kind: str, manifest: dict[str, Any]) -> str:
    """Return what a report is about and when it was computed."""
    started = manifest.get("started")
    return f"{kind}, computed {instant(started)}" if isinstance(started, str) else kind


def _text(value: Any) -> str:
    return MISSING if value is None else number(value)
