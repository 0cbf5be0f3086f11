"""No picture has letters that are cut, too small or on top of each other, whatever the run."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from fem_needle.figures import courses, energies, shapes, tip_path, waterfall
from tests.unit.figures.runs import NAMES, run_named, visible_texts

DRAWN = {"shapes": shapes, "tip path": tip_path, "courses": courses, "energies": energies, "waterfall": waterfall}
SMALLEST = 8.0  # points
SLACK = 1.0  # pixels


def overlap(one, other):
    return min(one.x1, other.x1) - max(one.x0, other.x0) > SLACK and min(one.y1, other.y1) - max(one.y0, other.y0) > SLACK


def test_overlapping_letters_are_found():
    from fem_needle.pictures import new_figure

    figure = new_figure()
    for text in ("one text", "another"):
        figure.text(0.5, 0.5, text)
    (_, first), (_, second) = visible_texts(figure)
    assert overlap(first, second)


QUICK = {("thin", "shapes"), ("loop", "courses"), ("one sample", "energies"), ("hub", "waterfall")}
EACH = [(name, kind) for name in NAMES for kind in DRAWN]


@pytest.mark.parametrize(("name", "kind"), [pytest.param(*one, marks=() if one in QUICK else pytest.mark.slow) for one in EACH])
def test_letters_can_be_read(name, kind):
    figure = DRAWN[kind](run_named(name))
    texts = visible_texts(figure)
    assert [text.get_text() for text, _ in texts if text.get_fontsize() < SMALLEST] == []
    frame = figure.bbox
    inside = [-SLACK < box.x0 < box.x1 < frame.x1 + SLACK and -SLACK < box.y0 < box.y1 < frame.y1 + SLACK for _, box in texts]
    assert [text.get_text() for (text, _), is_inside in zip(texts, inside, strict=True) if not is_inside] == []
    pairs = [(a.get_text(), b.get_text()) for (a, box), (b, other) in combinations(texts, 2) if overlap(box, other)]
    assert pairs == []


@pytest.mark.parametrize("name", [pytest.param(one, marks=() if one in {"hub", "entry"} else pytest.mark.slow) for one in NAMES])
def test_no_needle_runs_out_of_the_picture(name):
    axes = shapes(run_named(name)).axes[1]
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    needles = [line for line in axes.lines if "deep" in str(line.get_label()) or str(line.get_label()).startswith("at ")]
    assert needles
    for line in needles:
        places, deflections = line.get_data()
        assert max(places) <= right and bottom <= min(deflections) and max(deflections) <= top
        assert min(places) >= left or run_named(name).scene.support.kind == "entry"


@pytest.mark.parametrize("kind", [pytest.param(one, marks=() if one == "waterfall" else pytest.mark.slow) for one in DRAWN])
def test_a_run_that_ends_in_nothing_finite_is_drawn_up_to_there(kind):
    run = run_named("hub")
    broken, tip = run.station_deflection.copy(), run.tip_deflection.copy()
    broken[-1], tip[-1] = np.nan, np.nan
    figure = DRAWN[kind](replace(run, station_deflection=broken, series=run.series | {"tip_deflection": tip}, plant=None))
    assert figure.axes and all(np.isfinite([*axes.get_xlim(), *axes.get_ylim()]).all() for axes in figure.axes)
