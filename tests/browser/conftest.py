"""The system's Chromium, without a network; every test of a page fails on an error in its console and on any request."""

from __future__ import annotations

import shutil
from contextlib import contextmanager

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ARGUMENTS = (
    "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic",
    "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip
# What the browser says of its own speed, of plotly's canvas and of GL in software; not of an error in the page.
HARMLESS = (
    "Canvas2D: Multiple readback operations using getImageData are faster with the willReadFrequently attribute set to true. "
    "See: https://html.spec.whatwg.org/multipage/canvas.html#concept-canvas-will-read-frequently",
)
LOCAL = ("file:", "data:", "blob:")


@pytest.fixture(scope="session")
def browser():
    """The browser; the test is skipped where there is none."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    found = next((path for path in map(shutil.which, NAMES) if path), None)
    if found is None:
        pytest.skip(f"no browser on this system (looked for {', '.join(NAMES)})")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=found, args=list(ARGUMENTS))
        yield browser
        browser.close()


class Complaints(list):
    """What a page should not have said or asked for."""

    def heard(self, message):
        if message.type in {"error", "warning"} and message.text not in HARMLESS:
            self.append(f"console {message.type}: {message.text}")

    def asked(self, route):
        if route.request.url.startswith(LOCAL):
            route.continue_()
        else:
            self.append(f"request: {route.request.url}")
            route.abort()


@pytest.fixture
def opened(browser):
    """Return a context manager that opens a file in a page of a width and fails on any complaint."""

    @contextmanager
    def opening(path, width=1280, height=800, **options):
        context = browser.new_context(viewport={"width": width, "height": height}, offline=True, **options)
        complaints, page = Complaints(), context.new_page()
        page.on("console", complaints.heard)
        page.on("pageerror", lambda error: complaints.append(f"error: {error}"))
        context.route("**/*", complaints.asked)
        page.set_default_timeout(20_000)
        page.goto(path.resolve().as_uri())
        try:
            yield page
        finally:
            context.close()
        assert complaints == []

    return opening
