"""Models of a needle by name: each is an entry point of the group ``fem_needle.models``, in this package or in another."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import metadata
from typing import Protocol

from fem_needle.errors import SceneError
from fem_needle.plant import Plant
from fem_needle.scene import Scene

ENTRY_POINTS = "fem_needle.models"


class Ladder(Protocol):
    """Models of one scene from coarse to fine."""

    def finer(self, plant: Plant, factor: float) -> Plant | None:
        """Return the first model with ``factor`` times the unknowns of a plant and more than it; None beyond the finest."""

    def choice(self, plant: Plant, error: float) -> ChosenPlant:
        """Return the choice of one of them, whose error in motion is known, relative to the largest tip deflection."""


@dataclass(frozen=True, eq=False)
class ChosenPlant:
    """A plant for a run.

    Attributes
    ----------
    plant
        The model.
    error
        What its discretization may cost the tip, relative to the largest deflection; None where nothing finer was compared.
    warnings
        What a user should know before trusting it.
    round_off
        What rounding costs one answer of the tip, relative to itself.
    ladder
        Finer and coarser models of the same scene; None: there are none.
    """

    plant: Plant
    error: float | None
    warnings: tuple[str, ...] = ()
    round_off: float = 0.0
    ladder: Ladder | None = None


class ModelFamily(Protocol):
    """What an entry point of the group names: how plants of one kind are made of a scene."""

    def pilot(self, scene: Scene) -> Plant:
        """Return a coarse plant for estimates."""

    def build(self, scene: Scene) -> Plant:
        """Return the plant with the sizes that the scene gives, fixed defaults on "auto"."""

    def choose(self, scene: Scene, analysis: str) -> ChosenPlant:
        """Return the plant for a run, with the sizes that the tolerance needs on "auto", and its estimated error."""


@cache
def model_family(kind: str) -> ModelFamily:
    """Return the family of a ``model.kind``.

    Raises
    ------
    SceneError
        If no installed package has it.
    """
    found = metadata.entry_points(group=ENTRY_POINTS)
    if kind not in found.names:
        raise SceneError(f"model.kind: unknown model (got {kind!r}; allowed {', '.join(sorted(found.names))})")
    family: ModelFamily = found[kind].load()
    return family


def build_plant(scene: Scene) -> Plant:
    """Return the plant of ``scene.model.kind`` with the scene's sizes.

    Raises
    ------
    SceneError
        If the model is unknown or cannot have what the scene asks for.
    """
    return model_family(scene.model.kind).build(scene)
