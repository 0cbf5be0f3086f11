"""Many needles under way at once, in threads: the kernel holds no lock."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from fem_needle.closed_loop.simulation import Simulation
from fem_needle.errors import NeedleError
from fem_needle.models import build_plant
from fem_needle.plant import Plant
from fem_needle.scene import Scene
from fem_needle.threads import one_thread
from fem_needle.trajectory import Trajectory

Command = Mapping[str, float]


class SimulationBatch:
    """Simulations that are stepped together; each gives what it would give alone.

    Parameters
    ----------
    scenes_or_plants
        A needle each; of a scene its own model is built.
    threads
        How many to use; default: as many as there are cores.
    settings
        As `Simulation` takes them: ``time_step``, ``analysis``, ``output_step``.

    Attributes
    ----------
    simulations
        In the order of the scenes; simulation number i is repetition i, so that sensors of the same scene have other noise.
    """

    def __init__(self, scenes_or_plants: Iterable[Scene | Plant], *, threads: int | None = None, **settings: Any) -> None:
        plants = [build_plant(one) if isinstance(one, Scene) else one for one in scenes_or_plants]
        self.simulations = tuple(Simulation(plant, repetition=number, **settings) for number, plant in enumerate(plants))
        self._threads = max(1, min(len(plants), (os.cpu_count() or 1) if threads is None else threads))
        self._pool: ThreadPoolExecutor | None = None

    def __len__(self) -> int:
        return len(self.simulations)

    @one_thread
    def step(
        self, commands: Command | Sequence[Command | None] | None = None, duration: float | Sequence[float] | None = None
    ) -> list[dict[str, Any]]:
        """Let commands act for a while; returns what the sensors of each tell at its end, as `Simulation.step` does.

        Parameters
        ----------
        commands
            One for each simulation, or one for all.
        duration
            [s], likewise; default: one ``time_step`` of each.

        Raises
        ------
        ComputationError
            The first simulation's that fails, when all have been stepped.

        Notes
        -----
        A simulation whose run has ended stays as it is.
        """
        count = len(self)
        of_each = [commands] * count if commands is None or isinstance(commands, Mapping) else list(commands)
        durations = list(duration) if isinstance(duration, Sequence) else [duration] * count
        jobs = list(zip(self.simulations, of_each, durations, strict=True))
        if self._threads == 1:
            return [_stepped(*job) for job in jobs]
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self._threads)
        shares = [self._pool.submit(_share, jobs[first :: self._threads]) for first in range(self._threads)]
        found: list[Any] = [None] * count
        for first, share in enumerate(shares):
            found[first :: self._threads] = share.result()
        for one in found:
            if isinstance(one, NeedleError):
                raise one
        return found

    def measurements(self) -> list[dict[str, Any]]:
        """Return what the sensors of each tell now."""
        return [simulation.measurement() for simulation in self.simulations]

    def trajectories(self) -> list[Trajectory]:
        """Return the runs so far."""
        return [simulation.trajectory() for simulation in self.simulations]


def _stepped(simulation: Simulation, command: Command | None, duration: float | None) -> dict[str, Any]:
    return simulation.measurement() if simulation.stop_reason is not None else simulation.step(command, duration)


def _share(jobs: Sequence[tuple[Simulation, Command | None, float | None]]) -> list[dict[str, Any] | NeedleError]:
    """Step one thread's share; what fails is told when all are done."""
    found: list[dict[str, Any] | NeedleError] = []
    for job in jobs:
        try:
            found.append(_stepped(*job))
        except NeedleError as error:
            found.append(error)
    return found
