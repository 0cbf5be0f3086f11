"""`view --html` in a real browser: the scene turns under the mouse, the slider moves the needle and the time that is told."""

from __future__ import annotations

import pytest

from fem_needle import run_scene
from fem_needle.view import arrangement
from fem_needle.view.html import write_html
from tests.browser.pages import SCENE, changed, drag, inside, until

DRAWN = "['canvas', '.slider-rail-rect'].every((part) => document.querySelector('#view ' + part) !== null)"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="session")
def view(tmp_path_factory):
    path = tmp_path_factory.mktemp("view") / "view.html"
    assert write_html(arrangement(run_scene(SCENE)), path) == 8
    return path


def settled(page):
    """Wait until the picture no longer changes and return it."""
    before = page.screenshot()
    for _ in range(20):
        page.wait_for_timeout(150)
        after = page.screenshot()
        if changed(before, after) == 0.0:
            return after
        before = after
    raise AssertionError("the picture never comes to rest")


def told(page):
    """Return the time at the slider and the caption of the scene."""
    return page.locator("#view .slider-label").first.inner_html(), page.locator("#view .gtitle").inner_html()


def test_it_turns_under_the_mouse_and_moves_with_the_slider(view, opened):
    with opened(view) as page:
        until(page, DRAWN)
        first, box = settled(page), page.locator("#view").bounding_box()
        assert "time 14 s" in told(page)[0] and told(page)[1].startswith("14 s, depth 160 mm")
        drag(page, inside(box, 0.5, 0.5), inside(box, 0.65, 0.35))
        turned = settled(page)
        assert changed(first, turned) > 0.02
        rail = page.locator("#view .slider-rail-touch-rect").bounding_box()
        drag(page, inside(rail, 0.995, 0.5), inside(rail, 0.01, 0.5))
        until(page, "document.querySelector('#view .gtitle').textContent.startsWith('0 s')")
        assert told(page)[1].startswith("0 s, depth 20 mm") and "time 0 s" in told(page)[0]
        assert changed(turned, settled(page)) > 0.005
        assert page.evaluate("window.ran") is None


@pytest.mark.parametrize("width", [1280, 390])
def test_nothing_is_wider_than_the_window(view, width, opened):
    with opened(view, width) as page:
        until(page, DRAWN)
        assert page.evaluate("document.documentElement.scrollWidth") == width
