"""What the tests of pages share: a scene, waiting, pictures."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image

from fem_needle.scene import Layer, Tissue
from tests.unit.scene.examples import hub_scene

HOSTILE = '</script><script>window.ran=1</script><img src=x onerror="window.ran=2"><a href="javascript:window.ran=3">'
SCENE = hub_scene(
    title=f"A needle {HOSTILE}",
    tissue=Tissue(layers=[Layer(name=f"gel {HOSTILE}", foundation_modulus=520.0)]),
    numerics={"analysis": "static", "elements": 2, "output_step": 2.0, "output_points": 21},
)


def changed(before, after):
    """Share of the points of two screenshots that differ."""
    one, other = (np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int) for shot in (before, after))
    return float(np.mean(np.any(np.abs(one - other) > 8, axis=-1)))


def until(page, condition):
    """Wait until an expression is true in a page; the page's policy forbids Playwright's own way, which evaluates texts in it."""
    for _ in range(200):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(50)
    raise AssertionError(f"never true: {condition}")


def drag(page, start, end):
    """Drag the mouse between two points of the window."""
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(*((a + b) / 2.0 for a, b in zip(start, end, strict=True)))
    page.mouse.move(*end)
    page.mouse.up()


def inside(box, across, down):
    """Return a point of a box by shares of its width and height."""
    return box["x"] + across * box["width"], box["y"] + down * box["height"]
