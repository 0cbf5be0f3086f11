"""What a loop asks of a controller, and the controller that commands nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeVar

State = TypeVar("State")
# Latest reading of each name in SI; no controller asks for the one that is an array, the needle's shape.
Measurement = Mapping[str, Any]
Command = dict[str, float]


class Controller(Protocol[State]):
    """Who decides the command, once in every period. Neither the controller nor a state ever changes: a new state is returned."""

    def begin(self) -> State:
        """Return the state before the first decision."""

    def update(self, state: State, time: float, measurement: Measurement) -> tuple[State, Command]:
        """Return the next state and the command: name of the input and its value in SI.

        Parameters
        ----------
        state
            Of the decision before.
        time
            [s].
        measurement
            Latest reading of each name, in SI; a name is absent until its first reading has arrived. As long as one is missing
            that the controller needs, the last command stays, at first the scene's own value of the input at t = 0.
        """


class NoState(NamedTuple):
    """Nothing to remember."""


@dataclass(frozen=True)
class Uncontrolled:
    """Commands nothing: the scene's own inputs act."""

    def begin(self) -> NoState:
        """Return the one state."""
        return NoState()

    def update(self, state: NoState, time: float, measurement: Measurement) -> tuple[NoState, Command]:
        """Return the state and no command."""
        return state, {}
