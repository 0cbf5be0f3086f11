"""Friction, start, run, model and numerics of a scene."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import StrictBool, StrictStr, model_validator

from fem_needle.errors import SceneError, SuspiciousValueWarning
from fem_needle.scene.node_positions import NodePositions
from fem_needle.scene.part import Mistake, Part, raise_mistakes
from fem_needle.scene.quantity import Quantity

OF_ASSUMED_MODES = ("model.modes", "model.basis", "model.static_corrections")  # without effect on another model
FIXED_FRAME_VARIANTS = ("corrected", "as-printed")
_STEP = Quantity("s", above=0.0, words=("auto",))


class Friction(Part):
    """Axial friction of the shaft: sign(v) coulomb + viscous v.

    Parameters
    ----------
    coulomb
        [N].
    viscous
        [N s/m].
    coulomb_per_length
        [N/m], times the inserted length, added.
    viscous_per_length
        [N s/m^2], times the inserted length, added.
    """

    coulomb: Annotated[float, Quantity("N", at_least=0.0)] = 0.0
    viscous: Annotated[float, Quantity("N s/m", at_least=0.0)] = 0.0
    coulomb_per_length: Annotated[float, Quantity("N/m", at_least=0.0)] = 0.0
    viscous_per_length: Annotated[float, Quantity("N s/m^2", at_least=0.0)] = 0.0


class Initial(Part):
    """How the needle starts.

    Parameters
    ----------
    shape
        ``"equilibrium"`` under the loads at t = 0, ``"straight"``, or
        ``"tip-displaced"``: static shape under a tip force, let go at rest.
    tip_deflection
        Of the tip-displaced shape [m].
    """

    shape: Literal["equilibrium", "straight", "tip-displaced"] = "equilibrium"
    tip_deflection: Annotated[float | None, Quantity("m", optional=True)] = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        displaced = self.shape == "tip-displaced"
        if displaced and self.tip_deflection is None:
            message = "is required by shape 'tip-displaced' (allowed any finite number m)"
            raise_mistakes("Initial", [Mistake("tip_deflection", message)])
        if not displaced and self.tip_deflection is not None:
            limits = f"got {self.tip_deflection:g}; allowed only with shape 'tip-displaced'"
            message = f"has no meaning with shape '{self.shape}' ({limits})"
            raise_mistakes("Initial", [Mistake("tip_deflection", message, self.tip_deflection)])
        return self


class Run(Part):
    """Duration and seed of a run.

    Parameters
    ----------
    duration
        [s]; None: until the insertion ends.
    seed
        Of the random numbers.
    """

    duration: Annotated[float | None, Quantity("s", above=0.0, optional=True)] = None
    seed: Annotated[int, Quantity(at_least=0, integer=True)] = 0


class Model(Part):
    """Which model computes the scene.

    Parameters
    ----------
    kind
        ``"fem"``: finite elements; ``"assumed-modes"``: shapes of the whole needle; or another installed model.
    kinematics
        ``"material"``, or under the support entry ``"fixed-frame"``, the
        kinetic energy of the growing domain without convective terms.
    modes
        How many assumed modes.
    variant
        Of the assumed modes: ``"conservative"``; ``"corrected"``, the thesis' derivation done right, and ``"as-printed"``, its
        appendix with its mistakes, both ``fixed-frame``.
    basis
        Assumed modes of the ``"full-length"`` or of the ``"inserted-length"``.
    static_corrections
        Whether the static responses to loads and hub motion join the assumed modes.
    """

    kind: StrictStr = "fem"
    kinematics: Literal["material", "fixed-frame"] = "material"
    modes: Annotated[int, Quantity(at_least=1, at_most=200, integer=True)] = 2
    variant: Literal["conservative", "corrected", "as-printed"] = "conservative"
    basis: Literal["full-length", "inserted-length"] = "full-length"
    static_corrections: StrictBool = False

    @model_validator(mode="before")
    @classmethod
    def _imply_kinematics(cls, data: Any) -> Any:
        """The thesis' variants are fixed-frame where nothing else is said."""
        if isinstance(data, Mapping) and data.get("variant") in FIXED_FRAME_VARIANTS and "kinematics" not in data:
            return dict(data) | {"kinematics": "fixed-frame"}
        return data

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.variant in FIXED_FRAME_VARIANTS and self.kinematics != "fixed-frame":
            message = f"the variant '{self.variant}' is fixed-frame (got '{self.kinematics}'; allowed 'fixed-frame')"
            raise_mistakes("Model", [Mistake("kinematics", message, self.kinematics)])
        return self


class Numerics(Part):
    """Accuracy and output.

    Parameters
    ----------
    elements
        Equal elements over the part that bends, or ``"auto"``.
    mesh
        In place of elements: positions of the nodes from the hub, 0, to the tip [m]; in a scene file also the name of a mesh
        file. Under the support entry they are scaled to the inserted part.
    degree
        Polynomial degree of an element, 3 or 4.
    time_step
        [s] or ``"auto"``.
    tolerance
        Largest tip error over the run by largest tip deflection.
    absolute_tolerance
        Floor of the tip error [m].
    analysis
        ``"dynamic"``, ``"quasi-static"``, ``"static"`` or ``"auto"``.
    spectral_radius
        Of the integrator at infinite frequency: 1 no numerical damping, 0 the strongest; "auto": 1, and 0 where the needle slides
        in rigid guides or steps need not follow vibrations.
    output_step
        Time between samples [s] or ``"auto"``.
    output_points
        Stations along the needle.
    loop
        Of former versions, which had several loops over the time steps: "auto"; other values warn and change nothing.
    """

    elements: Annotated[
        int | Literal["auto"], Quantity(at_least=1, at_most=1_000_000, integer=True, words=("auto",))
    ] = "auto"
    mesh: Annotated[tuple[float, ...] | None, NodePositions()] = None
    degree: Annotated[int, Quantity(at_least=3, at_most=4, integer=True)] = 4
    time_step: Annotated[float | Literal["auto"], _STEP] = "auto"
    tolerance: Annotated[float, Quantity(at_least=1e-10, at_most=0.1)] = 1e-3
    absolute_tolerance: Annotated[float, Quantity("m", above=0.0)] = 1e-9
    analysis: Literal["auto", "dynamic", "quasi-static", "static"] = "auto"
    spectral_radius: Annotated[float | Literal["auto"], Quantity(at_least=0.0, at_most=1.0, words=("auto",))] = "auto"
    output_step: Annotated[float | Literal["auto"], _STEP] = "auto"
    output_points: Annotated[int, Quantity(at_least=2, at_most=100_001, integer=True)] = 101
    loop: Literal["auto", "compiled", "numpy"] = "auto"

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.mesh is not None and self.elements != "auto":
            message = f"a mesh has its own elements (got elements = {self.elements}; allowed one of the two)"
            raise_mistakes("Numerics", [Mistake("mesh", message, self.elements)])
        if self.loop != "auto":
            message = f"numerics.loop = '{self.loop}': a setting of former versions; every needle goes through the same steps"
            warnings.warn(message, SuspiciousValueWarning, stacklevel=2)
        return self


def refuse_idle(kind: str, given: Mapping[str, Any]) -> None:
    """Refuse what was asked for by name, by path, and has no effect on a kind of model.

    Raises
    ------
    SceneError
        With every such setting, and the model that knows it.
    """
    idle = [path for path in OF_ASSUMED_MODES if kind == "fem" and given.get(path) not in {None, False}]
    if idle:
        raise SceneError(
            [f"{path}: has no effect on the model 'fem' (got {given[path]!r}; give model 'assumed-modes' too)" for path in idle]
        )


def overriding(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings by path, made to win over the scene's: a mesh replaces its elements, and elements its mesh."""
    result = dict(values)
    for given, replaced in (("numerics.mesh", "numerics.elements"), ("numerics.elements", "numerics.mesh")):
        if given in values:
            result.setdefault(replaced, None)
    return result
