"""Which parts of a run need inertia, and how: steps that follow vibrations, steps over them, cosines, no inertia at all.

A part begins at a kink (of speed, load, hub; an interface) whose response matters, and ends where the tissue has damped it.
Derivation: docs/theory.md, "What may be left out".
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise

import numpy as np

from fem_needle.dynamics.engine import REST
from fem_needle.dynamics.grid import output_times
from fem_needle.dynamics.parts import COSINES, CREEP_STEPS, EQUILIBRIA, FOLLOWED, PASSED_OVER, Part
from fem_needle.dynamics.run import without_inertia
from fem_needle.dynamics.vibration import is_free_to_swing, needs_no_steps
from fem_needle.inertia_effect import Inertia
from fem_needle.motion import depth_law, landing_times, lateral_values, run_duration
from fem_needle.scene import Scene, Sinusoid, as_function

VIBRATION_SHARE = 0.5  # of the tolerance: smaller vibrations need not be resolved
LEAST_QUIET = 0.05  # of a run: shorter parts in which steps may be long are not worth it
INSTANTS = 201  # of a part, at which it is looked whether anything moves
HELD = "held, undamped, under constant loads: eigenvectors once, no steps"
LEAST_HOLD = 3  # outputs: a shorter hold is not worth eigenvectors


@dataclass(frozen=True)
class _Piece:
    """A piece of a run: times [s], whether steps follow vibrations, how far inertia moves the tip."""

    begin: float
    end: float
    is_followed: bool
    moved: float


def without_inertia_throughout(scene: Scene, analysis: str, reason: str) -> Part:
    """Return the only part of a run without inertia."""
    rests = analysis == "static" or without_inertia(scene).kind == REST
    return Part(0.0, run_duration(scene), EQUILIBRIA if rests else CREEP_STEPS, f"inertia {reason}")


def chooses_steps(scene: Scene) -> bool:
    """Return whether automatic time steps want to know how far the needle of a given motion may vibrate."""
    return scene.numerics.time_step == "auto" and scene.insertion.kind != "force" and not needs_no_steps(scene)


def parts_with_inertia(scene: Scene, effect: Inertia, output_step: float) -> tuple[Part, ...]:
    """Return the parts of a dynamic run; ``effect`` is what inertia does on a coarse needle."""
    duration = run_duration(scene)
    if not chooses_steps(scene):
        return (_whole(scene),)
    if not effect.responses:
        begins = "the needle is let go" if scene.initial.shape != "equilibrium" else "loads swing as fast as the needle does"
        return (Part(0.0, duration, FOLLOWED, begins),)
    allowed, is_free = VIBRATION_SHARE * scene.numerics.tolerance, scene.numerics.spectral_radius == "auto"
    is_damped = any(layer.damping > 0.0 for layer in scene.tissue.layers)
    lasts = f"what lasts moves the tip by up to {effect.lasting:.1e} of its largest deflection (allowed {allowed:.1e})"
    if not is_free or (effect.lasting <= allowed and not is_damped):
        return (Part(0.0, duration, FOLLOWED, f"of inertia {lasts}"),)
    outputs = output_times(duration, output_step)
    return _with_cosines(scene, _alternating(scene, effect, allowed, outputs), outputs)


def _whole(scene: Scene) -> Part:
    """Return the only part of a run whose steps are not free, or that needs none."""
    duration = run_duration(scene)
    if scene.insertion.kind == "force":
        return Part(0.0, duration, FOLLOWED, "a force drives the needle, whose mass it accelerates")
    if scene.numerics.time_step != "auto":
        return Part(0.0, duration, FOLLOWED, "numerics.time_step was given")
    return Part(0.0, duration, COSINES, HELD)


def _alternating(scene: Scene, effect: Inertia, allowed: float, outputs: Sequence[float]) -> tuple[Part, ...]:
    """Return parts in which vibrations are followed and parts in which they are passed over."""
    duration, found = run_duration(scene), list[_Piece]()
    for moves, group in groupby(_pieces(effect, allowed, outputs), lambda piece: piece.is_followed):
        rows = list(group)
        piece = _Piece(rows[0].begin, rows[-1].end, moves, max(row.moved for row in rows))
        if piece.end - piece.begin < LEAST_QUIET * duration:
            piece = replace(piece, is_followed=True)
        if found and found[-1].is_followed == piece.is_followed:
            before = found.pop()
            piece = replace(piece, begin=before.begin, moved=max(before.moved, piece.moved))
        found.append(piece)
    return tuple(_part(piece, allowed) for piece in found)


def _pieces(effect: Inertia, allowed: float, outputs: Sequence[float]) -> Iterator[_Piece]:
    """Yield pieces from kink to kink, cut at the output at which a vibration has decayed.

    A vibration that is damped before the first output behind its kink is seen nowhere; of larger ones the ledger would miss the
    energy, which is as the square of the swing.
    """
    for response in effect.responses:
        times = outputs[bisect_right(outputs, response.begin) : bisect_left(outputs, response.end)]
        lasting = response.lasting_at(response.begin)
        seen = max(lasting, response.moving_at(times[0]) if times else 0.0)
        if seen <= allowed and response.swing**2 * VIBRATION_SHARE <= allowed:
            yield _Piece(response.begin, response.end, False, lasting)
            continue
        quiet = next((time for time in times if response.moving_at(time) <= allowed), response.end)
        yield _Piece(response.begin, quiet, True, response.moving_at(response.begin))
        if quiet < response.end:
            yield _Piece(quiet, response.end, False, response.lasting_at(quiet))


def _part(piece: _Piece, allowed: float) -> Part:
    how = FOLLOWED if piece.is_followed else PASSED_OVER
    reason = f"inertia moves the tip by up to {piece.moved:.1e} of its largest deflection (allowed {allowed:.1e})"
    return Part(piece.begin, piece.end, how, reason, piece.moved)


def _with_cosines(scene: Scene, parts: Sequence[Part], outputs: Sequence[float]) -> tuple[Part, ...]:
    """Let cosines take over where the needle is held at last, undamped and under constant loads."""
    duration = run_duration(scene)
    held = _held_from(scene)
    behind, last = outputs[bisect_right(outputs, held + 1e-9 * duration) :], parts[-1]
    if len(behind) < LEAST_HOLD or last.how != FOLLOWED or last.begin >= behind[0]:
        return tuple(parts)
    before = replace(last, end=behind[0])
    return (*parts[:-1], before, Part(behind[0], duration, COSINES, HELD))


def _held_from(scene: Scene) -> float:
    """Return since when the needle is held for good under constant loads, without anything that damps it [s]."""
    duration, law = run_duration(scene), depth_law(scene)
    values = [as_function(value) for value in lateral_values(scene)]
    if not is_free_to_swing(scene) or any(isinstance(value, Sinusoid) for value in values):
        return duration
    held = duration
    for begin, end in reversed(list(pairwise([0.0, *landing_times(scene, law, duration, 0.0), duration]))):
        times = np.linspace(begin, end, INSTANTS)[1:-1]
        if np.any(law.speeds(times) != 0.0) or any(np.any(value.derivative(times) != 0.0) for value in values):
            break
        held = begin
    return held
