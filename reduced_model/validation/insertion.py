"""A needle that goes in, slowly and fast: the tip's error over the run."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from fem_needle import FiniteElementNeedle
from fem_needle.comparison.runs import RunErrors, model_run, reference_run, run_errors
from fem_needle.inertia_effect import inertia_effect
from fem_needle.scene import Scene
from reduced_model.validation.cases import (
    CORRECTED,
    FIVE,
    THESIS,
    THESIS_MODULUS,
    THREE,
    TUBE,
    TWO,
    TWO_INSERTED,
    Choice,
    foundation,
    inserted,
    scene_of,
)
from reduced_model.validation.pictures import Curve, Panel, error_picture
from reduced_model.validation.section import Section, blocks, percent, picture, prose, table

START, END = 0.02, 0.18  # m
SLOW, FAST = 0.01, 3.0  # m/s
ELEMENTS = 16
STEPS: dict[float, dict[str, Any]] = {
    SLOW: {"analysis": "quasi-static", "time_step": 0.2, "output_step": 0.2},
    FAST: {"analysis": "dynamic", "time_step": 8e-5, "output_step": 4e-4},
}
CASES = {
    "thesis, `entry`, 0.52 kN/m^2": (THESIS, "entry", THESIS_MODULUS),
    "18 gauge tube, `entry`, 20 kN/m^2": (TUBE, "entry", 2e4),
    "18 gauge tube, `hub`, 5 kN/m^2": (TUBE, "hub", 5e3),
}
CHOICES = (TWO, THREE, FIVE, TWO_INSERTED, CORRECTED)
PICTURE = "validation_inserted.png"


@dataclass(frozen=True, eq=False)
class Insertions:
    """A case at a speed: errors over the run by model, and the bound on what inertia does (1)."""

    case: str
    speed: float
    errors: dict[str, RunErrors]
    inertia: float


def insertion_scene(case: str, speed: float) -> Scene:
    """Return the scene of a case at a speed [m/s]: 0.1 N at the tip, in motion from the start."""
    needle, support, modulus = CASES[case]
    return scene_of(needle, support, foundation(modulus), inserted(speed, START, END))


@cache
def insertions(case: str, speed: float) -> Insertions:
    """Return the errors of a case at a speed [m/s], relative to the largest tip of the run."""
    scene = insertion_scene(case, speed)
    settings = STEPS[speed]
    elements = FiniteElementNeedle(scene, elements=ELEMENTS)
    reference = reference_run(elements, **settings)
    chosen = [choice for choice in CHOICES if _differs(choice, scene)]
    errors = {choice.label: run_errors(model_run(choice.plant(scene), reference.run), reference) for choice in chosen}
    return Insertions(case, speed, errors, inertia_effect(elements))


def section() -> Section:
    """Return the section."""
    found = [insertions(case, speed) for case in CASES for speed in (SLOW, FAST)]
    rows = [
        [one.case, f"{one.speed:g}", percent(one.inertia), *(_told(one, choice) for choice in CHOICES)] for one in found
    ]
    text = blocks(
        prose(
            """From 20 to 180 mm with 0.1 N at the tip, already in motion at the start, at 0.01 m/s (quasi-static) and at 3 m/s
            (with inertia, steps of 0.08 ms). Largest difference of the tip from 16 elements over the run, in percent of the
            run's largest tip; before it the bound on what inertia does to the tip (section 7)."""
        ),
        table(["case", "speed [m/s]", "inertia, bound", *(choice.label for choice in CHOICES)], rows),
        picture(PICTURE, "Error of the tip over the depth at both speeds"),
    )
    return Section("4 Inserted", text, _conclusions(found), {PICTURE: _picture})


def _differs(choice: Choice, scene: Scene) -> bool:
    """Return whether a basis is one of its own: under ``hub`` the inserted length is the whole needle."""
    return scene.support.kind == "entry" or choice.basis == "full-length"


def _told(found: Insertions, choice: Choice) -> str:
    errors = found.errors.get(choice.label)
    return "as 2 modes" if errors is None else percent(errors.largest_tip)


def _conclusions(found: list[Insertions]) -> tuple[str, ...]:
    texts = []
    for speed in (SLOW, FAST):
        errors = [one.errors[TWO.label].largest_tip for one in found if one.speed == speed]
        mended = [one.errors[CORRECTED.label].largest_tip for one in found if one.speed == speed]
        text = f"""Inserted at {speed:g} m/s two modes miss the tip by {percent(min(errors))} to {percent(max(errors))} % of its
            largest deflection in the three cases, with static corrections by {percent(max(mended))} % at most."""
        texts.append(prose(text))
    return tuple(texts)


def _picture() -> bytes:
    panels = []
    for speed in (SLOW, FAST):
        curves = []
        for case in CASES:
            errors = insertions(case, speed).errors[TWO.label]
            curves.append(Curve(case.replace("`", "").replace("m^2", "m²"), 1e3 * errors.depth, np.asarray(errors.tip)))
        panels.append(Panel(f"two modes at {speed:g} m/s", "depth z [mm]", tuple(curves)))
    return error_picture("|tip error| / largest tip [%]", panels)
