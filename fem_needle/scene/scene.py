"""The scene: everything physical about a run, and how it is computed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, StrictStr, ValidationError, model_validator

from fem_needle.display import Card, Shown
from fem_needle.errors import SceneError
from fem_needle.scene.card import scene_card
from fem_needle.scene.cross_checks import cross_mistakes
from fem_needle.scene.insertion import Insertion
from fem_needle.scene.loads import LateralLoad, Load
from fem_needle.scene.mistakes import check_path, mistake_lines
from fem_needle.scene.needle import Needle
from fem_needle.scene.part import MOST_ENTRIES, Part, raise_mistakes, shown
from fem_needle.scene.plain_data import plain, with_entry
from fem_needle.scene.quantity import Quantity
from fem_needle.scene.settings import Friction, Initial, Model, Numerics, Run
from fem_needle.scene.steering import Actuators, Controller, Scatter, Sensor, Target
from fem_needle.scene.support import Support
from fem_needle.scene.tissue import Tissue


class Scene(Shown, Part):
    """A needle, its support, the tissue, the insertion, the loads; SI, frozen.

    Built with keywords, or from a file with `fem_needle.load_scene`.

    Raises
    ------
    SceneError
        With all mistakes, one line each: value, unit and allowed range.
    """

    format_version: Annotated[int, Quantity(at_least=1, at_most=1, integer=True)] = 1
    title: StrictStr = ""
    needle: Needle
    support: Support
    tissue: Tissue
    insertion: Insertion
    friction: Friction = Friction()
    loads: Annotated[tuple[Load, ...], Field(max_length=MOST_ENTRIES)] = ()
    initial: Initial = Initial()
    target: Target = Target()
    sensors: Annotated[tuple[Sensor, ...], Field(max_length=MOST_ENTRIES)] = ()
    controller: Controller = Controller()
    actuators: Actuators = Actuators()
    scatter: Scatter = Scatter()
    run: Run = Run()
    model: Model = Model()
    numerics: Numerics = Numerics()

    @model_validator(mode="after")
    def _check(self) -> Self:
        raise_mistakes("Scene", cross_mistakes(self))
        return self

    def _card(self) -> Card:
        return scene_card(self)

    @property
    def lateral_loads(self) -> tuple[LateralLoad, ...]:
        """The lateral loads, in their order."""
        return tuple(load for load in self.loads if isinstance(load, LateralLoad))

    @property
    def duration(self) -> float:
        """Duration of the run [s]: as given, or until the insertion ends."""
        return self.run.duration or self.insertion.end_time or 0.0

    def to_dict(self, *, complete: bool = False) -> dict[str, Any]:
        """Return the scene as plain data, SI.

        Parameters
        ----------
        complete
            With every default; otherwise only what was given.
        """
        return plain(self, complete=complete)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], *, folder: Path | None = None) -> Self:
        """Return the scene of plain data as a scene file has it.

        Parameters
        ----------
        data
            Keys and values of the scene file; numbers are SI, texts carry units.
        folder
            Where the CSV files lie that the data name.

        Raises
        ------
        SceneError
            With all mistakes, one line each.
        """
        if not isinstance(data, Mapping):
            raise SceneError(f"scene: is not a table of keys (got {shown(data)})")
        try:
            return cls.model_validate(dict(data), context={"folder": folder})
        except ValidationError as error:
            raise SceneError(mistake_lines(error, cls)) from None

    def with_value(self, path: str, value: Any) -> Self:
        """Return the scene with another value, checked again.

        Parameters
        ----------
        path
            Dotted keys as in the scene file; a list entry by number or, where
            it has one, by name: ``"tissue.layers.0.damping"``, ``"tissue.layers.fat.damping"``.
        value
            Number in SI, text with a unit, or any other value of the file; None
            removes the key.

        Raises
        ------
        SceneError
            If the path is unknown or the new scene is impossible.
        """
        return self.with_values({path: value})

    def with_values(self, values: Mapping[str, Any]) -> Self:
        """Return the scene with several values changed at once; see `with_value`."""
        data = self.to_dict()
        for path, value in values.items():
            check_path(type(self), path)
            data = with_entry(data, path, value)
        return self.from_dict(data)
