"""Run a loop many times, in as many processes as pay."""

from __future__ import annotations

import os
import signal
import warnings
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from itertools import islice
from multiprocessing import current_process, get_context
from time import perf_counter

from fem_needle.closed_loop.ledger_option import warn_of_energies
from fem_needle.closed_loop.repeated import RepeatedLoop, Repetition
from fem_needle.closed_loop.repetitions import drawn
from fem_needle.closed_loop.steering import steer
from fem_needle.errors import ComputationError, NeedleError, SceneError
from fem_needle.scene import Scene
from fem_needle.trajectory import Trajectory

Progress = Callable[[float], None]

START = 3.0  # s of work from which on the start of processes pays
NO_ANSWER = (
    "a process ended without an answer: it was killed, or memory was short, or the script that called runs anew in every process "
    "(write the call below if __name__ == '__main__':, or give processes=1)"
)
# Small matrices: in every process threads would only wait for each other.
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def repeat(
    scene: Scene,
    repetitions: int,
    *,
    processes: int | None = None,
    energies: bool | None = None,
    progress: Progress | None = None,
) -> RepeatedLoop:
    """Steer a scene again and again, with other scatter and other noise each time.

    Parameters
    ----------
    scene
        As for `steer`.
    repetitions
        How many; number i is ``steer(scene, repetition=i)``, i = 1, 2, ...
    processes
        How many to use; default: one, and as many as there are cores where the first repetition shows that it pays and the
        caller can start processes. Inside a daemonic process one.
    energies
        As for `steer`.
    progress
        Is told which share of all repetitions is done, 0 to 1.

    Returns
    -------
    RepeatedLoop
        The same whatever the number of processes. A repetition that fails is one of its rows. On an interrupt: what was
        computed.

    Raises
    ------
    SceneError
        If there is nothing to repeat, or the scene is impossible in every repetition.
    ComputationError
        If a process dies.
    """
    warn_of_energies(energies, stacklevel=3)
    if repetitions < 1:
        raise SceneError(f"repetitions: too few (got {repetitions}; allowed 1 or more)")
    found: dict[int, Repetition] = {}
    mistakes: dict[int, Mistakes] = {}
    try:
        for one, wrong in _all(partial(one_repetition, scene), repetitions, processes, progress or _nobody):
            found[one.number], mistakes[one.number] = one, wrong
    except KeyboardInterrupt:
        pass  # what was computed is told
    if found and all(mistakes.values()):
        raise SceneError(mistakes[min(mistakes)])
    return RepeatedLoop(scene, repetitions, tuple(found[number] for number in sorted(found)))


Mistakes = tuple[str, ...]  # in the scene of a repetition
Answer = tuple[Repetition, Mistakes]
Compute = Callable[..., Answer]  # `one_repetition` of a scene


def _nobody(fraction: float) -> None:
    """Tell nobody."""


def _all(compute: Compute, repetitions: int, processes: int | None, progress: Progress) -> Iterator[Answer]:
    """Yield all repetitions, in any order: one after the other, until processes pay; up to one that was interrupted."""
    workers, started = (os.cpu_count() or 1) if processes is None else processes, perf_counter()
    if current_process().daemon:  # which may have no children
        workers = 1
    for number in range(1, repetitions + 1):
        left, spent = repetitions - number + 1, perf_counter() - started
        pays = processes is not None or (number > 1 and spent / (number - 1) * left > START)
        if workers > 1 and left > 1 and pays:
            numbers, must = range(number, repetitions + 1), processes is not None
            if (yield from _in_processes(compute, numbers, workers, progress, must=must)):
                return
            workers = 1  # none of them could begin
        answer = compute(number, partial(_tell_share, progress, number, repetitions))
        yield answer
        if answer[0].stop_reason == "interrupted":
            return
        progress(number / repetitions)


def _tell_share(progress: Progress, number: int, repetitions: int, share: float) -> None:
    progress((number - 1 + share) / repetitions)


def one_repetition(scene: Scene, number: int, progress: Progress = _nobody) -> Answer:
    """Return a repetition, whatever becomes of it, and what is wrong with its scene."""
    try:
        return _row(scene, number, steer(scene, repetition=number, progress=progress)), ()
    except KeyboardInterrupt:
        return Repetition(number, drawn(scene, number), {"stop_reason": "interrupted"}), ()
    except NeedleError as error:
        if isinstance(error, ComputationError) and error.partial is not None:
            return _row(scene, number, error.partial, str(error)), ()
        wrong = error.mistakes if isinstance(error, SceneError) else ()
        return Repetition(number, drawn(scene, number), {"stop_reason": "failed"}, str(error)), wrong


def _row(scene: Scene, number: int, run: Trajectory, failure: str | None = None) -> Repetition:
    return Repetition(number, drawn(scene, number), run.summary, failure, run.time, run.depth, run.tip_deflection)


def _in_processes(
    compute: Compute, numbers: range, workers: int, progress: Progress, *, must: bool
) -> Generator[Answer, None, bool]:
    """Yield repetitions as they come; each process has one at a time, so that an interrupt leaves none in a queue.

    Returns whether processes could begin at all: those of a script without a guard cannot, which is an error if they ``must``.
    """
    waiting: set[Future[Answer]] = set()
    left, done = iter(numbers), numbers.start - 1
    # Not forked: the caller may have threads.
    with _single_threads(), ProcessPoolExecutor(workers, get_context("spawn"), initializer=_prepare) as pool:
        try:
            waiting |= {pool.submit(_in_process, compute, number) for number in islice(left, workers)}
            while waiting:
                finished, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                waiting |= {pool.submit(_in_process, compute, number) for number in islice(left, len(finished))}
                yield from (one.result() for one in finished)
                done += len(finished)
                progress(done / numbers[-1])
        except BrokenProcessPool:
            if done < numbers.start and not must:
                return False
            raise ComputationError(NO_ANSWER) from None
        except KeyboardInterrupt:
            yield from (one.result() for one in waiting)
    return True


@contextmanager
def _single_threads() -> Iterator[None]:
    """Let processes that start now compute with one thread each."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _prepare() -> None:
    """Make a process quiet: its warnings stand in its answers, and it ends when it is told."""
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _in_process(compute: Compute, number: int) -> Answer:
    """Compute a repetition that an interrupt ends early."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return compute(number)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
