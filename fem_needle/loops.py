"""Which loop goes over the steps of a run: compiled where it can be and pays, in numpy elsewhere."""

from __future__ import annotations

from collections.abc import Generator
from importlib.util import find_spec

from fem_needle.errors import SceneError
from fem_needle.legs.equilibria import equilibrium_march
from fem_needle.march import RunEnd, TimeGrid, march
from fem_needle.plant import Plant
from fem_needle.pushed_march import march_pushed
from fem_needle.samples import Sample
from fem_needle.steppers import DynamicStepper, StaticStepper, Stepper

FEWEST_STEPS = 300  # fewer take no longer in numpy than the compiled loop takes to load

LARGEST_LOSS, LOSS_SHARE = 1e-7, 0.01  # of the tip, of the tolerance: beyond, equilibria are solved one by one, by flexibility


def run_loop(plant: Plant, stepper: Stepper, grid: TimeGrid) -> Generator[Sample, None, RunEnd]:
    """Return the generator of a run's samples, in the loop that the scene's ``numerics.loop`` asks for.

    Raises
    ------
    SceneError
        If it asks for the compiled loop where there is none.
    """
    if plant.scene.insertion.kind == "force" and isinstance(stepper, DynamicStepper):
        if plant.scene.numerics.loop == "compiled":
            raise _refused("a push decides its motion step by step")
        return march_pushed(plant, stepper, grid)
    if plant.has_table and plant.scene.numerics.loop == "auto":
        if isinstance(stepper, StaticStepper) and not _loses_digits(plant):
            return equilibrium_march(plant, stepper, grid)
    if is_compiled(plant, stepper, grid) and isinstance(stepper, DynamicStepper):
        from fem_needle.legs.compiled import compiled_march

        return compiled_march(plant, stepper, grid)
    return march(plant, stepper, grid)


def _loses_digits(plant: Plant) -> bool:
    """Return whether rounding in the stiffness matrix is too much for equilibria."""
    return plant.stiffness_round_off > min(LARGEST_LOSS, LOSS_SHARE * plant.scene.numerics.tolerance)


def is_compiled(plant: Plant, stepper: Stepper, grid: TimeGrid) -> bool:
    """Return whether the compiled loop does a run's steps.

    Raises
    ------
    SceneError
        If the scene asks for it where there is none.
    """
    loop = plant.scene.numerics.loop
    if loop == "numpy":
        return False
    missing = why_not_compiled(plant, stepper)
    if loop == "compiled" and missing:
        raise _refused(missing)
    return not missing and (loop == "compiled" or grid.steps >= FEWEST_STEPS)


def why_not_compiled(plant: Plant, stepper: Stepper) -> str:
    """Return why the compiled loop cannot do a run's steps, "" where it can."""
    scene = plant.scene
    if find_spec("numba") is None:
        return "numba is not installed"
    if scene.insertion.kind == "force":
        return "a push decides its motion step by step"
    if scene.tissue.rest_line == "cut-path":
        return "the path that the tip cuts is found step by step"
    if not isinstance(stepper, DynamicStepper):
        return "nothing is stepped"
    if not plant.has_table:
        return "the model gives its matrices depth by depth only"
    return ""


def _refused(reason: str) -> SceneError:
    return SceneError(f"numerics.loop: {reason} (got 'compiled'; allowed 'auto', 'numpy')")
