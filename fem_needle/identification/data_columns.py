"""Which columns of measured data a fit uses, what it says of the others, and which it cannot do without."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches

import numpy as np

from fem_needle.errors import SceneError
from fem_needle.identification.measurements import Measurements
from fem_needle.motion import depth_law
from fem_needle.scene import Scene, Sinusoid, Table
from fem_needle.scene.listing import entries
from fem_needle.scene.time_quantity import extremes
from fem_needle.trajectory import VARIABLES

SHAPE = "deflection_at_"  # and an arc length in mm
FITTED = ("tip_deflection", "push_force")
PLACES = ("depth", "time")
NEAR = 0.8  # names that are as alike count as misspelled
LOOP = ("insertion", "target", "sensors", "controller", "actuators", "scatter")  # no part of an equilibrium at a given depth
SAME_DEPTH = 1e-3  # of the needle's length


def fitted_columns(data: Measurements) -> list[str]:
    """Return the names of the columns that are fitted.

    Raises
    ------
    SceneError
        If there is none.
    """
    found = [name for name in data.names if name in FITTED or name.startswith(SHAPE)]
    if not found:
        allowed = f"{', '.join(FITTED)}, {SHAPE}<mm>"
        raise SceneError(f"{data.source}: has no column that could be fitted (got {', '.join(data.names)}; allowed {allowed})")
    return found


def refuse_misspelled(sets: Sequence[Measurements]) -> None:
    """Refuse columns whose names are nearly those that a fit uses.

    Raises
    ------
    SceneError
        With every such column, and the name that it is near to.
    """
    mistakes = []
    for one in sets:
        meant = {name: _meant(name) for name in unused_columns(one)}
        mistakes += [
            f"{one.source}: column {name!r} is not known, did you mean {near!r}? Rename it, or leave it out"
            for name, near in meant.items()
            if near
        ]
    if mistakes:
        raise SceneError(mistakes)


def unused_columns(data: Measurements) -> list[str]:
    """Return the names of the columns that no fit uses."""
    return [name for name in data.names if name not in (*FITTED, *PLACES) and not name.startswith(SHAPE)]


def check_time(scene: Scene, data: Measurements) -> None:
    """Refuse equilibria at unknown times of a scene in which something varies.

    Raises
    ------
    SceneError
        With the paths of what varies.
    """
    found = varying(scene)
    if found and "time" not in data:
        raise SceneError(
            f"{data.source}: needs a column 'time [s]' (got {', '.join(data.names)}): {', '.join(found)} "
            f"{'varies' if len(found) == 1 else 'vary'} in time, and a depth does not say what acted"
        )


def varying(scene: Scene) -> list[str]:
    """Return the paths of what varies in time and acts on a needle at rest at a given depth."""
    values = [(entry.path, entry.value) for entry in entries(scene) if isinstance(entry.value, Table | Sinusoid)]
    return [path for path, value in values if path.split(".")[0] not in LOOP and len(set(extremes(value))) > 1]


def data_notes(scene: Scene, sets: Sequence[Measurements], *, at_rest: bool) -> tuple[str, ...]:
    """Return a sentence for every column that has no part in the answer."""
    notes = []
    for one in sets:
        unused = unused_columns(one)
        if unused:
            used = ", ".join(name for name in one.names if name not in unused)
            notes.append(f"{one.source}: not used: {', '.join(unused)} (used: {used})")
        if "depth" in one and not at_rest:
            where = f"the run is compared at the measured times, wherever the needle is then{_other_depth(scene, one)}"
            notes.append(f"{one.source}: not used: depth: {where}")
    return tuple(notes)


def _other_depth(scene: Scene, data: Measurements) -> str:
    if scene.insertion.kind == "force":
        return ""
    away = float(np.max(np.abs(depth_law(scene).depths(data["time"]) - data["depth"])))
    if away <= SAME_DEPTH * scene.needle.length:
        return ""
    return f"; it differs from the scene's insertion by up to {1e3 * away:.3g} mm"


def _meant(name: str) -> str | None:
    """Return the name that a fit uses and that another one is nearly, None where it is its own."""
    if name in VARIABLES:
        return None
    plain = "_".join(name.casefold().replace("-", " ").split())
    if plain.startswith(SHAPE):
        return plain
    close = get_close_matches(plain, (*FITTED, *PLACES, SHAPE), n=1, cutoff=NEAR)
    return (f"{SHAPE}<mm>" if close[0] == SHAPE else close[0]) if close else None
