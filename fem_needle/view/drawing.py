"""An arrangement as colored surfaces with labels: what VTK, matplotlib and the browser draw alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_needle.layer_names import layer_key
from fem_needle.pictures import SHADES
from fem_needle.view.arrangement import Arrangement, Pose
from fem_needle.view.solids import Surface

Array = NDArray[np.float64]

NEEDLE, LOAD, REACTION, PLATE, SPRING, PATH = "#303030", "#D55E00", "#0072B2", "#777777", "#009E73", "#CC79A7"
LEGEND = (("needle", NEEDLE), ("loads on the needle", LOAD), ("forces of its supports", REACTION))
GUIDES = (("rigid guides", PLATE), ("guides on springs", SPRING))
LAYER_OPACITY = 0.4
CHARACTER = 0.0095  # width of a letter over what is drawn along the insertion axis
KEY_WIDTH = 125  # characters
RULER, RULER_TICK, RULER_TEXT = 1.2, 1.3, 1.62  # half widths of the block below the axis


@dataclass(frozen=True, eq=False)
class Part:
    """A surface with its name, color and opacity."""

    name: str
    surface: Surface
    color: str
    opacity: float = 1.0


@dataclass(frozen=True)
class Label:
    """A text at a point [mm]."""

    text: str
    place: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Drawing:
    """One instant.

    Attributes
    ----------
    title, caption
        What was run; time, depth and tip, what is not to scale, and the key of layers that are numbered.
    parts, labels
        Surfaces and texts.
    lines
        Ruler and cut path: color and points (n, 3) [mm].
    """

    title: str
    caption: str
    parts: tuple[Part, ...]
    labels: tuple[Label, ...]
    lines: tuple[tuple[str, Array], ...]

    @property
    def legend(self) -> tuple[tuple[str, str], ...]:
        """Names and colors of what is drawn, without the layers."""
        shown = {part.name for part in self.parts}
        return tuple((name, color) for name, color in (*LEGEND, *GUIDES) if name in shown or (name, color) in LEGEND)

    def corners(self) -> Array:
        """Return all points (n, 3) [mm] that a picture must hold."""
        surfaces = [part.surface.points for part in self.parts]
        lines = [points for _, points in self.lines]
        return np.concatenate([*surfaces, *lines, np.array([label.place for label in self.labels])])


def drawing(arranged: Arrangement, row: int) -> Drawing:
    """Return a sample as colored surfaces."""
    parts = (*still_parts(arranged), *moving_parts(arranged.pose(row)))
    caption = told(arranged, arranged.pose(row))
    shown = tuple(part for part in parts if len(part.surface.triangles))
    texts = (*layer_labels(arranged), *ruler_labels(arranged))
    return Drawing(title_of(arranged), caption, shown, texts, lines(arranged))


def title_of(arranged: Arrangement) -> str:
    """Return what was run."""
    return arranged.scene.title or "needle"


def still_parts(arranged: Arrangement) -> tuple[Part, ...]:
    """Return layers and guides."""
    blocks = zip(arranged.slabs, arranged.blocks(), strict=True)
    layers = [
        Part(slab.note, block, SHADES[number % len(SHADES)], LAYER_OPACITY) for number, (slab, block) in enumerate(blocks)
    ]
    guides = zip(GUIDES, (arranged.rigid_guides, arranged.spring_guides), strict=True)
    return (*layers, *(Part(name, surface, color, 0.6) for (name, color), surface in guides))


def moving_parts(pose: Pose) -> tuple[Part, ...]:
    """Return needle and arrows."""
    surfaces = (pose.needle, pose.loads, pose.reactions)
    return tuple(Part(name, surface, color) for (name, color), surface in zip(LEGEND, surfaces, strict=True))


def told(arranged: Arrangement, pose: Pose) -> str:
    """Return time, depth and tip, what is not to scale, and the key where layers are numbered."""
    key = "" if named(arranged) else layer_key((slab.note for slab in arranged.slabs), KEY_WIDTH)
    return "\n".join(text for text in (pose.caption, arranged.note, key) if text)


def named(arranged: Arrangement) -> bool:
    """Return whether the names of all layers have room above their blocks, on two heights in turn."""
    places = [0.5 * (slab.start + slab.end) for slab in arranged.slabs]
    widths = [_width(arranged, slab.label) for slab in arranged.slabs]
    return all(
        later - first >= 0.5 * (one + other)
        for first, later, one, other in zip(places, places[2:], widths, widths[2:], strict=False)
    )


def layer_labels(arranged: Arrangement, *, numbered: bool | None = None) -> tuple[Label, ...]:
    """Return names or numbers of the layers, above their blocks; by default names where they have room."""
    half = arranged.half_width
    if numbered is None and named(arranged):
        return tuple(
            Label(slab.label, (0.5 * (slab.start + slab.end), (1.5 + 0.45 * (place % 2)) * half, 0.0))
            for place, slab in enumerate(arranged.slabs)
        )
    labels: list[Label] = []
    for slab in arranged.slabs:
        place, text = 0.5 * (slab.start + slab.end), str(slab.number)
        if not labels or place - labels[-1].place[0] >= 1.5 * _width(arranged, text):
            labels.append(Label(text, (place, 1.2 * half, -half)))
    return tuple(labels)


def _width(arranged: Arrangement, text: str) -> float:
    """Return the width of a text [mm], about."""
    places = arranged.ruler
    return CHARACTER * len(text) * float(places[-1] - places[0])


def ruler_labels(arranged: Arrangement) -> tuple[Label, ...]:
    """Return the numbers of the ruler, the unit with the last."""
    places, half = arranged.ruler.tolist(), arranged.half_width
    texts = [f"{place:.6g}" for place in places]
    texts[-1] += " mm"
    return tuple(Label(text, (place, -RULER_TEXT * half, half)) for text, place in zip(texts, places, strict=True))


def lines(arranged: Arrangement) -> tuple[tuple[str, Array], ...]:
    """Return the ruler with its ticks, and the path that the tip has cut."""
    half, places = arranged.half_width, arranged.ruler
    corners = [point for place in places for point in ((place, -RULER), (place, -RULER_TICK), (place, -RULER))]
    ruler = np.array([(place, height * half, half) for place, height in corners])
    path = arranged.path
    return ((NEEDLE, ruler), *(((PATH, path),) if len(path) > 1 else ()))
