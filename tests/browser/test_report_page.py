"""The report in a real browser: zoom, slider, keyboard, narrow windows, paper, no scripts; nothing hostile runs."""

from __future__ import annotations

import io

import pypdfium2
import pytest

from fem_needle import converge, load_scene, run_scene
from fem_needle.convergence.picture import convergence_picture
from fem_needle.report import html_page, read_folder
from fem_needle.run_folder import save_run
from fem_needle.run_target import RunTarget
from fem_needle.study_files import StudyFolder
from tests.browser.pages import SCENE, changed, drag, inside, until

LEAST_CONTRAST = 4.5  # WCAG 2.1 AA, of text
DRAWN = "[...document.querySelectorAll('.chart')].every((chart) => chart.classList.contains('drawn'))"
OVERLAPPING = """() => [...document.querySelectorAll(".chart")].filter((chart) => {
  const bottom = chart.querySelector(".main-svg").getBoundingClientRect().bottom;
  return chart.nextElementSibling.getBoundingClientRect().top < bottom - 1;
}).map((chart) => chart.id)"""
CONTRASTS = """() => {
  const numbers = (color) => (color.match(/[\\d.]+/g) || []).map(Number);
  const light = (color) => {
    const bent = (v) => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
    const part = numbers(color).slice(0, 3).map((v) => bent(v / 255));
    return 0.2126 * part[0] + 0.7152 * part[1] + 0.0722 * part[2];
  };
  const behind = (node) => {
    for (; node; node = node.parentElement) {
      const color = getComputedStyle(node).backgroundColor;
      if (numbers(color)[3] !== 0) return color;
    }
    return "rgb(255, 255, 255)";
  };
  return [...document.querySelectorAll("h1, h2, p, a, li, dt, dd, th, td, caption, figcaption, label, output")].map((node) => {
    const [a, b] = [light(getComputedStyle(node).color), light(behind(node))].sort();
    return [node.tagName, (b + 0.05) / (a + 0.05)];
  });
}"""

pytestmark = pytest.mark.slow


@pytest.fixture(scope="session")
def report(tmp_path_factory):
    folder = save_run(run_scene(SCENE), tmp_path_factory.mktemp("report") / "run", vtk=False)
    path = folder / "report.html"
    path.write_text(html_page(read_folder(folder)), encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def study(tmp_path_factory):
    study = converge(load_scene("bench-s"), values=(1, 2))
    target = StudyFolder("converge", RunTarget(tmp_path_factory.mktemp("study") / "one", for_study=True))
    folder = target.write(study.scene, study.to_dict(), study.columns(), convergence_picture(study))
    path = folder / "report.html"
    path.write_text(html_page(read_folder(folder)), encoding="utf-8")
    return path


def test_slider_and_zoom_change_what_is_seen(report, opened):
    with opened(report) as page:
        until(page, DRAWN)
        needle, moment = page.locator("#needle"), page.locator("#needle-moment")
        needle.scroll_into_view_if_needed()
        before, said = needle.screenshot(), moment.inner_text()
        assert said.startswith("14\u00a0s: 160\u00a0mm deep")
        page.locator("#needle-time").fill("0")
        until(page, "document.getElementById('needle')._fullData[1].x.at(-1) < 21")
        first = needle.screenshot()
        assert moment.inner_text().startswith("0\u00a0s: 20\u00a0mm deep") and changed(before, first) > 0.005
        page.locator("#needle-time").press("ArrowRight")  # the keyboard does it too
        until(page, "document.getElementById('needle')._fullData[1].x.at(-1) > 39")
        assert moment.inner_text().startswith("2\u00a0s: 40\u00a0mm deep") and changed(first, needle.screenshot()) > 0.001
        courses = page.locator("#courses")
        courses.scroll_into_view_if_needed()
        before, box = courses.screenshot(), courses.bounding_box()
        drag(page, inside(box, 0.3, 0.12), inside(box, 0.6, 0.2))
        until(page, "document.getElementById('courses').layout.xaxis.range[0] > 1")
        assert changed(before, courses.screenshot()) > 0.005
        assert page.evaluate("window.ran") is None and page.locator("h1").inner_text() == " ".join(SCENE.title.split())


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("kind", ["report", "study"])
def test_nothing_is_wider_than_the_window(request, kind, width, opened):
    with opened(request.getfixturevalue(kind), width) as page:
        until(page, DRAWN)
        assert page.evaluate("document.documentElement.scrollWidth") == width
        assert page.evaluate(OVERLAPPING) == []
        if width == 1280:
            assert [pair for pair in page.evaluate(CONTRASTS) if pair[1] < LEAST_CONTRAST] == []


@pytest.mark.parametrize(("kind", "said"), [("report", "Energy ledger"), ("study", "Discretizations")])
def test_paper_has_text_and_pictures_in_place_of_curves(request, kind, said, opened):
    with opened(request.getfixturevalue(kind)) as page:
        until(page, DRAWN)
        page.emulate_media(media="print")
        assert page.locator(".chart:visible, nav:visible").count() == 0
        assert page.locator("figure img:visible").count() == page.locator("figure img").count() > 0
        printed = pypdfium2.PdfDocument(io.BytesIO(page.pdf(format="A4")))
        texts = [sheet.get_textpage().get_text_range() for sheet in printed]
        assert len(texts) > 1 and all(len(text) > 20 for text in texts) and any(said in text for text in texts)


def test_without_scripts_there_are_pictures(report, opened):
    with opened(report, java_script_enabled=False) as page:
        assert page.locator(".on-paper img:visible").count() == 3
        assert page.locator(".chart:visible, input:visible").count() == 0
