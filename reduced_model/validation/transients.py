"""Where transients matter: dynamic against quasi-static runs, and against equilibria, over speed, stiffness and damping."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import cycle
from math import pi
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from fem_needle import FiniteElementNeedle, simulate
from fem_needle.free_response import natural_frequencies
from fem_needle.inertia_effect import inertia_effect
from fem_needle.scene import Insertion, Run, Scene, Table, TipLoad
from reduced_model.validation.cases import TUBE, foundation, inserted, scene_of
from reduced_model.validation.pictures import Curve, Panel, error_picture
from reduced_model.validation.section import Section, blocks, kilo, percent, picture, prose, table

Array = NDArray[np.float64]

SPEEDS = (1e-3, 1e-2, 1e-1, 1.0, 5.0)  # m/s
MODULI = (500.0, 5e3, 5e4)  # N/m^2
DAMPINGS = (0.0, 1.0, 100.0)  # N s/m^2
RAMPS = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1)  # s
FROM_REST, IN_MOTION = "from rest, at once", "already in motion"
START, WAY = 0.1, 0.05  # m
LONGEST, WAIT = 0.04, 1e-3  # s
AFTER_RAMP = 0.04  # s
ELEMENTS = 8
STEPS_A_SWING = 20
SAMPLES = 100
CLINICAL = 0.1  # m/s: faster than any robot or hand inserts on purpose
LIMIT = 0.01
ROUNDING = 1e-5  # of the tip: smaller effects are not compared with the bound
PICTURE = "validation_transients.png"


@dataclass(frozen=True)
class Effect:
    """What quasi-static runs and equilibria miss of a dynamic run, by the largest tip (1).

    Attributes
    ----------
    inertia
        Largest difference of the tip, dynamic against quasi-static.
    all_transients
        The same against equilibria, without the viscosity.
    bound
        `fem_needle.inertia_effect.inertia_effect` of the scene.
    """

    inertia: float
    all_transients: float
    bound: float


def insertion_scene(start: str, modulus: float, damping: float, speed: float) -> Scene:
    """Return the tube, clamped at the skin, at a speed [m/s] from 100 mm for 50 mm or 40 ms, whichever is less."""
    duration = min(LONGEST, WAY / speed)
    end = START + speed * duration
    insertion, total = inserted(speed, START, end), duration
    if start == FROM_REST:
        total = WAIT + duration
        insertion = Insertion(kind="profile", depth=Table(time=(0.0, WAIT, total), value=(START, START, end)))
    return scene_of(TUBE, "entry", foundation(modulus, damping), insertion, run=Run(duration=total))


def ramp_scene(modulus: float, ramp: float) -> Scene:
    """Return the tube held at 100 mm, the force at the tip growing from zero in a time [s]."""
    force = Table(time=(0.0, WAIT, WAIT + ramp), value=(0.0, 0.0, 0.1))
    held = Insertion(kind="hold", initial_depth=START)
    run = Run(duration=WAIT + ramp + AFTER_RAMP)
    return scene_of(TUBE, "entry", foundation(modulus), held, (TipLoad(force=force),), run=run)


@cache
def insertion_effect(start: str, modulus: float, damping: float, speed: float) -> Effect:
    """Return the effect in an insertion."""
    return _effect(insertion_scene(start, modulus, damping, speed))


@cache
def ramp_effect(modulus: float, ramp: float) -> Effect:
    """Return the effect of a force that grows in a time [s]."""
    return _effect(ramp_scene(modulus, ramp))


def section() -> Section:
    """Return the section."""
    text = blocks(
        prose(
            f"""The tube of section 2, clamped at the skin, 0.1 N at the tip, goes in from 100 mm, for {1e3 * WAY:g} mm or
            {1e3 * LONGEST:g} ms, whichever is less. Largest difference of the tip between a dynamic run ({ELEMENTS} elements)
            and a quasi-static one, which has the viscosity but no inertia, in percent of the largest tip; c in N s/m^2, k in
            kN/m^2."""
        ),
        "**Starting from rest, with a jump of speed**",
        _table(FROM_REST),
        "**Already in motion at the start**, on the path of the equilibria",
        _table(IN_MOTION),
        "**All transients**: dynamic against equilibria, which know neither inertia nor viscosity, from rest",
        _table(FROM_REST, "all_transients"),
        "**A force that grows from zero**: held at 100 mm, undamped, in the time of the column; dynamic against equilibria",
        _ramp_table(),
        "`inertia_effect`, by which automatic runs leave out inertia: " + _bounds(),
        picture(PICTURE, "What inertia does to the tip over the speed"),
    )
    return Section("7 Where transients matter", text, _conclusions(), {PICTURE: _picture})


def _effect(scene: Scene) -> Effect:
    plant = FiniteElementNeedle(scene, elements=ELEMENTS)
    duration = float(scene.run.duration or 0.0)
    swing = 2.0 * pi / float(natural_frequencies(plant, START)[0])
    settings: dict[str, Any] = {"time_step": min(swing / STEPS_A_SWING, duration / SAMPLES), "output_step": duration / SAMPLES}

    def tips(analysis: str) -> Array:
        return simulate(plant, analysis=analysis, **settings).tip_deflection

    dynamic, slow = tips("dynamic"), tips("quasi-static")
    rest = tips("static") if any(layer.damping > 0.0 for layer in scene.tissue.layers) else slow
    largest = float(np.max(np.abs(dynamic)))
    inertia, everything = (float(np.max(np.abs(dynamic - other))) / largest for other in (slow, rest))
    return Effect(inertia, everything, inertia_effect(plant))


def _cells(start: str) -> Iterator[Effect]:
    for modulus in MODULI:
        for damping in DAMPINGS:
            for speed in SPEEDS:
                yield insertion_effect(start, modulus, damping, speed)


def _table(start: str, what: str = "inertia") -> str:
    rows = []
    for modulus in MODULI:
        for damping in DAMPINGS:
            cells = [insertion_effect(start, modulus, damping, speed) for speed in SPEEDS]
            rows.append([kilo(modulus), f"{damping:g}", *(percent(getattr(cell, what)) for cell in cells)])
    return table(["k", "c", *(f"{speed:g} m/s" for speed in SPEEDS)], rows)


def _ramp_table() -> str:
    rows = [[kilo(modulus), *(percent(ramp_effect(modulus, ramp).inertia) for ramp in RAMPS)] for modulus in MODULI]
    return table(["k", *(f"{1e3 * ramp:g} ms" for ramp in RAMPS)], rows)


def _bounds() -> str:
    """Return how the bound compares with what was measured."""
    texts = []
    for start in (FROM_REST, IN_MOTION):
        cells = [cell for cell in _cells(start) if cell.inertia > ROUNDING]
        held = sum(cell.inertia <= cell.bound for cell in cells)
        worst = max(cell.inertia / cell.bound for cell in cells)
        text = f"""{start}, it bounds {held} of the {len(cells)} cells above 0.001 %, the largest measured effect is {worst:.1f}
            times the bound"""
        texts.append(prose(text))
    return "; ".join(texts) + "."


def _fastest(start: str, what: str) -> float:
    """Return the largest speed [m/s] up to which an effect stays within the limit for every stiffness and damping; 0 if none."""
    good = 0.0
    for speed in SPEEDS:
        cells = [insertion_effect(start, modulus, damping, speed) for modulus in MODULI for damping in DAMPINGS]
        if max(getattr(cell, what) for cell in cells) > LIMIT:
            break
        good = speed
    return good


def _conclusions() -> tuple[str, ...]:
    slow = [cell for cell, speed in zip(_cells(FROM_REST), cycle(SPEEDS), strict=False) if speed <= CLINICAL]
    worst, everything = max(cell.inertia for cell in slow), max(cell.all_transients for cell in slow)
    ramps = [ramp for ramp in RAMPS if max(ramp_effect(modulus, ramp).inertia for modulus in MODULI) > LIMIT]
    text = f"""The thesis' hypothesis, that transients must be known: up to {CLINICAL:g} m/s inertia moves the tip by at most
        {percent(worst)} % of its largest deflection, also at a jump of speed, so quasi-static models are enough for insertion at
        clinical speeds; inertia and viscosity together make {percent(everything)} %, so in viscous tissue the quasi-static model
        needs the viscosity. Inertia stays within 1 % up to {_fastest(FROM_REST, "inertia"):g} m/s from rest and up to
        {_fastest(IN_MOTION, "inertia"):g} m/s in motion (of the speeds of the table). To the same
        1 % a dynamic model is needed where an undamped needle's load changes within {1e3 * max(ramps):g} ms or less, or where its
        tip is let go."""
    return (prose(text),)


def _picture() -> bytes:
    panels = []
    for start in (FROM_REST, IN_MOTION):
        curves = []
        for modulus in MODULI:
            for damping in (DAMPINGS[0], DAMPINGS[-1]):
                found = [insertion_effect(start, modulus, damping, speed).inertia for speed in SPEEDS]
                label = f"{kilo(modulus)} kN/m², {damping:g} N s/m²"
                curves.append(Curve(label, np.array(SPEEDS), np.array(found)))
        panels.append(Panel(start, "speed [m/s]", tuple(curves)))

    def style(axes: Axes) -> None:
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))

    return error_picture("inertia's share of the tip [%]", panels, (LIMIT,), style)
