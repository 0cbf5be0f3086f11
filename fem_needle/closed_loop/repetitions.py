"""What differs from one repetition of a scene to the next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_needle.scene import Insertion, Scene, Sinusoid, Table

STREAM = 2**31  # of the scatter's random numbers, apart from those of the sensors


@dataclass(frozen=True)
class Draw:
    """What a repetition is, beside the scene as it is written.

    Attributes
    ----------
    modulus_factor
        On all foundation moduli and dampings.
    entry_angle
        Of the needle at the entry point, added [rad].
    speed_factor
        On the insertion's speed; 1 where the scene has none.
    """

    modulus_factor: float = 1.0
    entry_angle: float = 0.0
    speed_factor: float = 1.0


def drawn(scene: Scene, repetition: int) -> Draw:
    """Return what a repetition draws: nothing where it is 0, the scene itself.

    Drawn from the scene's seed and the number of the repetition, so that each is the same whenever it is run.
    """
    scatter = scene.scatter
    if repetition == 0 or not (scatter.modulus or scatter.entry_angle or scatter.speed):
        return Draw()
    draws = np.random.default_rng([scene.run.seed, repetition, STREAM]).standard_normal(3)
    return Draw(
        modulus_factor=float(np.exp(scatter.modulus * draws[0])),
        entry_angle=float(scatter.entry_angle * draws[1]),
        speed_factor=1.0 if scene.insertion.speed is None else float(np.exp(scatter.speed * draws[2])),
    )


def scattered(scene: Scene, repetition: int) -> Scene:
    """Return the scene of a repetition: 0 is the scene itself; others draw modulus, entry angle and speed."""
    draw = drawn(scene, repetition)
    changes: dict[str, Any] = {}
    if draw.modulus_factor != 1.0:
        changes |= _with_modulus(scene, draw.modulus_factor)
    if draw.entry_angle:
        changes |= _with_angle(scene, draw.entry_angle)
    if draw.speed_factor != 1.0:
        changes |= _with_speed(scene.insertion, draw.speed_factor)
    return scene.with_values(changes) if changes else scene


def _with_modulus(scene: Scene, factor: float) -> dict[str, Any]:
    changes: dict[str, Any] = {}
    if scene.tissue.tip_stiffness is not None:
        changes["tissue.tip_stiffness"] = factor * scene.tissue.tip_stiffness
    for index, layer in enumerate(scene.tissue.layers):
        changes[f"tissue.layers.{index}.foundation_modulus"] = factor * layer.foundation_modulus
        changes[f"tissue.layers.{index}.damping"] = factor * layer.damping
    return changes


def _with_angle(scene: Scene, angle: float) -> dict[str, Any]:
    """Turn the hub, and move it so that the straight needle goes through the entry point."""
    outside = scene.needle.length - scene.insertion.first_depth
    return {
        "support.hub_angle": _moved(scene.support.hub_angle, angle),
        "support.hub_deflection": _moved(scene.support.hub_deflection, -angle * outside),
    }


def _with_speed(insertion: Insertion, factor: float) -> dict[str, Any]:
    if insertion.speed is None:
        return {}
    return {"insertion.speed": _scaled(insertion.speed, factor)}


def _moved(value: float | Table | Sinusoid, by: float) -> Any:
    if isinstance(value, Table):
        return {"time": list(value.time), "value": [one + by for one in value.values]}
    if isinstance(value, Sinusoid):
        return value.model_dump() | {"mean": value.mean + by}
    return value + by


def _scaled(value: float | Table | Sinusoid, factor: float) -> Any:
    if isinstance(value, Table):
        return {"time": list(value.time), "value": [factor * one for one in value.values]}
    if isinstance(value, Sinusoid):
        return value.model_dump() | {"mean": factor * value.mean, "amplitude": factor * value.amplitude}
    return factor * value
