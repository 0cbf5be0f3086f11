"""The energy ledger of a run: what is stored, what came in and went out, and what the balances miss."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fem_needle.display import ROUNDING
from fem_needle.figures.common import name_figure, set_time_limits, suited
from fem_needle.figures.course_figure import Panel, draw_panel
from fem_needle.pictures import new_figure, shared_style
from fem_needle.trajectory import Trajectory

Array = NDArray[np.float64]

WIDTH, PANEL_HEIGHT = 8.0, 2.3  # inches
EMPTY = 0.12  # height of a panel without curves over that of another
RESIDUALS = "Residuals"
# Title of a panel and its variables with their short names.
LEDGER: tuple[tuple[str, dict[str, str]], ...] = (
    ("Stored, lateral", {"kinetic_energy": "kinetic", "bending_energy": "bending", "tissue_energy": "tissue, guides"}),
    (
        "Lateral works",
        {
            "load_work": "loads",
            "hub_work": "hub",
            "tissue_work": "swelling",
            "boundary_energy": "boundary",
            "tissue_dissipation": "lost in tissue",
        },
    ),
    (
        "Axial",
        {
            "push_work": "push",
            "friction_dissipation": "lost in friction",
            "cutting_work": "cutting",
            "arrest_loss": "lost in arrest",
            "axial_kinetic_energy": "kinetic",
        },
    ),
    (RESIDUALS, {"energy_residual": "lateral", "axial_energy_residual": "axial"}),
)


def energies(run: Trajectory) -> Figure:
    """Draw stored energies, works since the start and the residuals of both balances over the time [s].

    Terms that are zero throughout are named in the title of their panel and have no line.

    Parameters
    ----------
    run
        Computed or loaded.

    Returns
    -------
    matplotlib.figure.Figure
        Four panels, each in J or a part of it.
    """
    panels = [_panel(run, title, names) for title, names in LEDGER]
    with shared_style():
        heights = [1.0 if panel.curves else EMPTY for panel in panels]
        figure = new_figure(WIDTH, PANEL_HEIGHT * sum(heights) + 1.0)
        places = figure.subplots(len(panels), 1, sharex=True, height_ratios=heights)
        for axes, panel in zip(places, panels, strict=True):
            draw_panel(axes, panel, run)
            if not panel.curves:
                axes.set(yticks=[], ylabel="")
                axes.spines[["left", "top", "right"]].set_visible(False)
        set_time_limits(places[-1], run.time)
        places[-1].set_xlabel("time [s]")
        figure.align_ylabels()
        name_figure(figure, run)
    return figure


def ledger_terms(run: Trajectory, title: str, names: dict[str, str]) -> dict[str, Array]:
    """Return the terms of a panel [J] by variable; one that is round-off throughout beside the largest energy is 0.

    Residuals stay what they are: how small they are is what they tell.
    """
    known = {name: np.asarray(getattr(run, name)) for name in names}
    if title == RESIDUALS:
        return known
    least = ROUNDING * largest_energy(run)
    return {name: values * (not np.all(np.abs(values) < least)) for name, values in known.items()}


def largest_energy(run: Trajectory) -> float:
    """Return the largest magnitude of all energies, works and losses [J]."""
    terms = [getattr(run, name) for title, names in LEDGER if title != RESIDUALS for name in names]
    return max(float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0)) for values in terms)


def _panel(run: Trajectory, title: str, names: dict[str, str]) -> Panel:
    known = ledger_terms(run, title, names)
    drawn = {name: values for name, values in known.items() if np.any(np.nan_to_num(values))}
    size, unit = suited(drawn.values(), "J")
    curves = {names[name]: values / size for name, values in drawn.items()}
    relative = run.summary.get("relative_energy_residual")
    if title == RESIDUALS and curves:
        told = "" if relative is None else f" (at most {relative:.1e} of the largest energy)"
        title = f"{title}: {' and '.join(name + told * (name == 'lateral') for name in curves)}"
    elif len(curves) == 1:
        title = f"{title}: {next(iter(curves))}"
    elif not curves:
        missing = all(np.all(np.isnan(values)) for values in known.values())
        title = f"{title}: {'not computed' if missing else 'zero throughout'}"
    return Panel(title, f"energy [{unit}]", curves)
