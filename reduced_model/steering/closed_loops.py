"""Figures 3.8 to 3.12 of the thesis repeated: open loop, inverse dynamics and PID, on two modes and on finite elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from fem_needle import load_scene, run_scene, steer
from fem_needle.trajectory import Trajectory
from reduced_model.validation.pictures import Curve, Panel, curve_picture
from reduced_model.validation.section import Section, blocks, picture, prose, table

MODELS = (
    ("two modes", {"model.kind": "assumed-modes"}),
    ("finite elements", {"model.kind": "fem", "numerics.elements": 6}),
)
CASES = {
    "thesis-open-loop": ("3 N, open loop (Fig. 3.8, 3.9)", {"numerics.time_step": 2e-5}),
    "thesis-inverse-dynamics": ("inverse dynamics, fully actuated (Fig. 3.10, 3.11)", {}),
    "thesis-pid": ("PID, the push alone (Fig. 3.12)", {}),
}
TITLES = ("3 N, open loop", "inverse dynamics", "PID on the depth")
LATE = 0.2  # of the run: its last part, in which a remaining swing is looked for
PICTURE = "steering_thesis.png"


@dataclass(frozen=True, eq=False)
class Loop:
    """A run of a case on a model.

    Attributes
    ----------
    case, model
        Name of the scene, and of the model.
    run
        What came of it.
    """

    case: str
    model: str
    run: Trajectory

    @property
    def initial(self) -> float:
        """Magnitude of the tip's deflection at the start [m]."""
        return abs(float(self.run.tip_deflection[0]))

    @property
    def largest(self) -> float:
        """Largest magnitude on the way [m]."""
        return float(np.max(np.abs(self.run.tip_deflection)))

    @property
    def late(self) -> float:
        """Largest magnitude in the last part of the run [m]."""
        shown = self.run.time >= (1.0 - LATE) * self.run.time[-1]
        return float(np.max(np.abs(self.run.tip_deflection[shown])))


@cache
def loops() -> tuple[Loop, ...]:
    """Return all cases on both models."""
    found = []
    for case, (_, changes) in CASES.items():
        for model, kind in MODELS:
            scene = load_scene(case).with_values(changes | kind)
            found.append(Loop(case, model, run_scene(scene) if case == "thesis-open-loop" else steer(scene)))
    return tuple(found)


def _of(found: Sequence[Loop], case: str) -> list[Loop]:
    return [loop for loop in found if loop.case == case]


def findings(found: Sequence[Loop]) -> tuple[str, ...]:
    """Return which statements of the thesis hold, from the numbers."""
    opened, ideal, pid = (_of(found, case) for case in CASES)
    varies = all(loop.largest > 1.05 * loop.initial for loop in opened)
    vanishes = all(loop.late < 0.5 * loop.largest for loop in ideal)
    remains = all(loop.late > 0.5 * loop.initial for loop in pid)
    grown, modal = max(loop.largest for loop in opened), ideal[0]
    return (
        prose(f"""The tip's deflection varies as the needle passes through the tissue, and an initial deflection grows:
            {_holds(varies)} (0.5 mm becomes up to {1e3 * grown:.2f} mm)."""),
        prose(f"""Inverse dynamics leads to zero deflection as time grows: {_holds(vanishes)}, by construction: every coordinate
            has its own force, so every amplitude decays whatever the needle is. With the push alone, the thesis' real input, it
            cannot be built (decision 0016)."""),
        prose(f"""But on the way the tip of two modes reaches {1e3 * modal.largest:.1f} mm: amplitudes of modes of the full
            length that give {1e3 * modal.initial:.1f} mm at 20 mm depth belong to a much larger deflection deeper in, and they
            decay no faster than the needle advances. On the finite elements, whose coordinates are deflections along the
            inserted part, it never exceeds {1e3 * ideal[1].largest:.1f} mm: what "every coordinate" means depends on the
            model."""),
        prose(f"""PID leaves a position error: {_holds(remains)} (the tip still swings by
            {1e3 * min(loop.late for loop in pid):.2f} to {1e3 * max(loop.late for loop in pid):.2f} mm at the end): nothing that
            the push does reaches a straight needle's deflection, and this tissue has no damping."""),
        prose("""The controller that knows the model is the better one: not shown by these figures, for the two controllers do
            not have the same inputs. Compared with the same input and the same knowledge: section 3."""),
    )


def _holds(found: bool) -> str:
    return "holds" if found else "does not hold"


def _rows(found: Sequence[Loop]) -> list[list[str]]:
    return [
        [
            CASES[loop.case][0],
            loop.model,
            f"{1e3 * loop.run.depth[-1]:.1f}",
            f"{1e3 * loop.run.time[-1]:.1f}",
            f"{1e3 * loop.largest:.3g}",
            f"{1e3 * loop.late:.2g}",
            _largest_push(loop.run),
        ]
        for loop in found
    ]


def _largest_push(run: Trajectory) -> str:
    commands = run.signals.get("command_push_force", run.push_force)
    return f"{np.max(np.abs(commands)):.3g}"


def _draw(found: Sequence[Loop]) -> bytes:
    panels = []
    for case, title in zip(CASES, TITLES, strict=True):
        curves = tuple(Curve(loop.model, 1e3 * loop.run.time, 1e3 * loop.run.tip_deflection) for loop in _of(found, case))
        panels.append(Panel(title, "time [ms]", curves))
    return curve_picture("tip deflection [mm]", panels)


def section() -> Section:
    """Return the section."""
    found = loops()
    header = ["loop", "model", "end [mm]", "after [ms]", "largest tip [mm]", "tip in the last fifth [mm]", "largest push [N]"]
    about = prose("""Scenes `thesis-open-loop`, `thesis-inverse-dynamics`, `thesis-pid`: from 20 mm, the tip displaced by 0.5 mm
        and let go. The thesis prints no gains and no wanted path; ours are in the scenes. Neither controller sees the
        deflection: the encoder gives the depth.""")
    statements = "\n".join(f"- {sentence}" for sentence in findings(found))
    text = blocks(about, table(header, _rows(found)), picture(PICTURE, "Tip deflection over time of the three loops"), statements)
    return Section("1 Figures 3.8 to 3.12: open loop, inverse dynamics, PID", text, (), {PICTURE: lambda: _draw(found)})
