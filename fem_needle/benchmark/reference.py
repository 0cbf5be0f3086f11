"""The tips that count as true: closed forms, an independent spectral solution, or a very fine run that is kept in a file.

`python -m fem_needle.benchmark.reference` computes the file again.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_needle.atomic_file import json_bytes, write_atomically
from fem_needle.benchmark.cases import CASES, Case
from fem_needle.benchmark.growing_beam import GrowingBeam, spectral_tips
from fem_needle.exact import ClampedTipForce, ReleaseFromTipForce
from fem_needle.scene import Scene
from fem_needle.scene.time_functions import as_function
from fem_needle.simulation import run_scene

Array = NDArray[np.float64]

FILE = Path(__file__).with_name("brachytherapy.json")
FINE_ELEMENTS, FINE_STEP = 48, 2.5e-4  # s
EXACT_TEXT = "closed form"
SPECTRAL_TEXT = "independent spectral solution: 14 polynomials, three-stage Gauss collocation"
STEPS_PER_RADIAN = {"M": 4.0, "M2": 12.0}  # the load of M2 leaves a vibration behind that has to be followed
HOW = {"S": EXACT_TEXT, "D": "sum over modes to 1e-13", "M": SPECTRAL_TEXT, "M2": SPECTRAL_TEXT}


@cache
def reference_tips(case: Case) -> Array:
    """Return the true tips of a case at its times [m]."""
    if case.name == "S":
        return np.array([_clamped(case.scene).tip_deflection])
    if case.name == "D":
        return ReleaseFromTipForce(case.scene).tip_deflection(case.times)
    if case.name in STEPS_PER_RADIAN:
        return spectral_tips(growing_beam(case.scene), case.times, steps_per_radian=STEPS_PER_RADIAN[case.name])
    return np.array(stored()["tip_deflection"])


def how(case: Case) -> str:
    """Return where the true tips of a case come from."""
    return HOW.get(case.name) or str(stored()["how"])


def growing_beam(scene: Scene) -> GrowingBeam:
    """Return the beam of a scene like M: `entry`, homogeneous, undamped, a plain speed (0 where held), at most one tip force."""
    insertion, needle = scene.insertion, scene.needle
    force = as_function((scene.loads[0].force or 0.0) if scene.loads else 0.0)
    speed = 0.0 if insertion.speed is None else float(insertion.speed)  # type: ignore[arg-type]
    return GrowingBeam(
        needle.bending_stiffness,
        needle.mass_per_length,
        scene.tissue.layers[0].foundation_modulus,
        insertion.first_depth,
        speed,
        lambda time: float(force.value(time)),
    )


def stored() -> dict[str, Any]:
    """Return what is kept in the file: `how`, `settings`, `difference`, `time` [s], `tip_deflection` [m]."""
    content: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))
    return content


def fine_reference(case: Case, elements: int = FINE_ELEMENTS, time_step: float = FINE_STEP) -> dict[str, Any]:
    """Compute a case with inertia on very many elements and steps, and again on coarser ones to see what that changes."""
    settings = {"model": "fem", "elements": elements, "analysis": "dynamic", "time_step": time_step}
    fine = run_scene(case.scene, **settings).tip_deflection  # type: ignore[arg-type]
    longer = run_scene(case.scene, **settings | {"time_step": 2 * time_step}).tip_deflection  # type: ignore[arg-type]
    coarser = run_scene(case.scene, **settings | {"time_step": 2 * time_step, "elements": elements // 2})  # type: ignore[arg-type]
    difference = max(case.error(longer, fine), case.error(coarser.tip_deflection, longer))
    size = f"{elements} quartic elements and steps of {1e3 * time_step:g} ms"
    return {
        "how": f"a run with {size}; twice the step or half the elements change {difference:.0e}",
        "settings": settings,
        "difference": difference,
        "time": case.times,
        "tip_deflection": fine,
    }


def _clamped(scene: Scene) -> ClampedTipForce:
    needle, modulus = scene.needle, scene.tissue.layers[0].foundation_modulus
    force = scene.loads[0].force
    return ClampedTipForce(needle.bending_stiffness, modulus, scene.insertion.first_depth, float(force))  # type: ignore[arg-type]


if __name__ == "__main__":
    write_atomically(FILE, json_bytes(fine_reference(CASES[-1])))
