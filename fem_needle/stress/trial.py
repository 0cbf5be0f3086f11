"""What one scene is put through: run, mirrored, in other units, back the way it came, compared with the exact solution."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fem_needle.errors import NeedleError, SuspiciousValueWarning
from fem_needle.exact import exact_static
from fem_needle.exact.statics import tip_force
from fem_needle.models import build_plant
from fem_needle.scene import Scene
from fem_needle.simulation import run_scene, simulate
from fem_needle.stress.numbers import OTHER, SI, Numbers, Units, scene_of
from fem_needle.trajectory import ENERGY_BOUND, VARIABLES, Trajectory

Array = NDArray[np.float64]

SAME = 1e-9  # of the largest value: how closely runs must agree that differ in sign, units or direction only
ROUGH = 1e-6  # the same of random scenes, whose equations may lose half of all digits
DEPENDENT = 1e-3  # the same of many modes, nearly dependent over a short inserted part: the tolerance
FEW_MODES = 2
INSERTED = 1e-6  # of the length: less of an `entry` needle counts as nothing
FORCE_SUM = 1e-6  # of the largest force
EXACT = 1e-3  # of the tip: the tolerance of an automatic mesh
TINY = 1e-250  # beside which a number has lost its digits to underflow


@dataclass(frozen=True)
class Figure:
    """One number that a run is judged by.

    Attributes
    ----------
    name
        What was measured.
    value, bound
        The number and the largest allowed one.
    """

    name: str
    value: float
    bound: float

    @property
    def share(self) -> float:
        """Value over bound; a value that is no number counts as infinite."""
        return self.value / self.bound if np.isfinite(self.value) else np.inf

    @property
    def failed(self) -> bool:
        """Whether the bound is passed."""
        return self.share > 1.0


@dataclass(frozen=True)
class Trial:
    """What came of one scene.

    Attributes
    ----------
    name
        How to make the scene again.
    figures
        What was measured, without what was announced.
    announced
        A refusal, a failed computation or a warning that says that the answer is not to be trusted; empty without one.
    crash
        An exception that was no message; empty without one.
    """

    name: str
    figures: tuple[Figure, ...] = ()
    announced: str = ""
    crash: str = ""

    @property
    def failed(self) -> bool:
        """Whether something happened that must not."""
        return bool(self.crash) or any(figure.failed for figure in self.figures)

    @property
    def worst(self) -> Figure | None:
        """The figure nearest to its bound, or farthest beyond."""
        return max(self.figures, key=lambda figure: figure.share, default=None)

    def why(self) -> str:
        """Return what failed."""
        failed = (figure for figure in self.figures if figure.failed)
        return self.crash or ", ".join(f"{figure.name} {figure.value:.2g} > {figure.bound:g}" for figure in failed)


def examine(name: str, numbers: Numbers, modes: int | None, *, brief: bool = False, same: float = SAME) -> Trial:
    """Put a scene through all checks, by finite elements or by so many assumed modes.

    In brief: mirrored and in other units at once, and no automatic mesh beside the exact solution. ``same``: how closely such
    runs must agree, over the largest value.
    """
    same = same if (modes or 0) <= FEW_MODES else DEPENDENT
    try:
        run = _run(numbers, modes)
        changed = _changed_at_once if brief else _changed
        figures = [*_of_run(run), *changed(numbers, modes, run, same), *_equilibrium(numbers, modes)]
        if not brief:
            figures += _automatic(numbers, modes)
    except NeedleError as error:
        return Trial(name, announced=str(error)) if str(error) else Trial(name, crash="no message")
    except Exception as error:
        return Trial(name, crash=f"{type(error).__name__}: {error}")
    warned = "; ".join(run.summary["warnings"])
    if _distrusted(run):
        figures = [figure for figure in figures if figure.name == "finite"]
    return Trial(name, tuple(figures), announced=warned)


def _run(numbers: Numbers, modes: int | None, units: Units = SI, *, mirrored: bool = False) -> Trajectory:
    """Run a scene; that it is suspicious is no news."""
    scene = _modelled(scene_of(numbers, units, mirrored=mirrored), modes)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SuspiciousValueWarning)
        return simulate(build_plant(scene))


def _modelled(scene: Scene, modes: int | None) -> Scene:
    return scene if modes is None else scene.with_values({"model.kind": "assumed-modes", "model.modes": modes})


def _distrusted(run: Trajectory) -> bool:
    """Return whether the run says itself that its answer is wrong."""
    return any("energies miss" in message or "rounding may cost" in message for message in run.summary["warnings"])


def _of_run(run: Trajectory) -> Iterator[Figure]:
    values = [run.station_deflection, run.guide_force, *(run.series[name] for name in VARIABLES)]
    unbounded = sum(int(np.count_nonzero(~np.isfinite(value))) for value in values)
    yield Figure("finite", float(unbounded), 0.5)
    yield Figure("energy", float(run.summary["relative_energy_residual"]), ENERGY_BOUND)


def _changed(numbers: Numbers, modes: int | None, run: Trajectory, same: float) -> Iterator[Figure]:
    """Run the scene turned round, in other units and, through equilibria, compare the way out with the way in."""
    tip = run.tip_deflection
    yield Figure("mirror", _apart(-_run(numbers, modes, mirrored=True).tip_deflection, tip), same)
    scaled = _run(numbers, modes, OTHER).tip_deflection
    yield Figure("units", _apart(scaled / OTHER.length, tip), same)
    if numbers.analysis == "static" and len(numbers.times) == 3 and numbers.depths[0] == numbers.depths[2]:
        yield Figure("way back", _apart(tip[::-1], tip), same)


def _changed_at_once(numbers: Numbers, modes: int | None, run: Trajectory, same: float) -> Iterator[Figure]:
    """Run the scene turned round and in other units."""
    changed = _run(numbers, modes, OTHER, mirrored=True).tip_deflection
    yield Figure("mirror and units", _apart(-changed / OTHER.length, run.tip_deflection), same)


def _equilibrium(numbers: Numbers, modes: int | None) -> Iterator[Figure]:
    """Add up the forces of the first equilibrium."""
    rest = _at_rest(numbers)
    run = _run(rest, modes)
    applied = sum(force for _, force in rest.lateral) + tip_force(scene_of(rest), rest.depths[0], 0.0)
    forces = [float(run.hub_force[0]), float(run.tissue_force[0]), *run.guide_force[0].tolist(), applied]
    largest = max(abs(force) for force in forces)
    yield Figure("force sum", abs(sum(forces)) / largest if largest > TINY else 0.0, FORCE_SUM)


def _automatic(numbers: Numbers, modes: int | None) -> Iterator[Figure]:
    """Compare the tip of an automatic mesh with the exact one, unless it says that it missed the tolerance."""
    rest = _at_rest(numbers)
    depth = rest.depths[0]
    if modes is not None or (rest.support == "entry" and depth <= INSERTED * rest.length):
        return
    scene = scene_of(rest)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SuspiciousValueWarning)
        run = run_scene(scene.with_value("numerics.elements", "auto"))
    if not any("tolerance" in message for message in run.summary["warnings"]):
        yield Figure("exact", _apart(run.tip_deflection[:1], np.array([exact_static(scene, depth).tip_deflection])), EXACT)


def _at_rest(numbers: Numbers) -> Numbers:
    return replace(numbers, times=(0.0,), depths=numbers.depths[:1], analysis="static", steps=1, outputs=1)


def _apart(values: Array, others: Array) -> float:
    """Return the largest difference over the largest value, of series that may have ended at different samples."""
    if values.shape != others.shape:
        return np.inf
    largest = float(np.max(np.abs(others)))
    return float(np.max(np.abs(values - others))) / largest if largest > TINY else 0.0
