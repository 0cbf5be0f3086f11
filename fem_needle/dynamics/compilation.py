"""How the kernel's functions are compiled: small ones into their callers, each entrance as a whole, which is kept on disk.

An entrance takes one table of arrays (`fem_needle.dynamics.arrays`) and is compiled before its first call, once on a machine.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib.resources import files
from multiprocessing import parent_process
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numba import njit
from numba.core import config, event, types
from numba.core.errors import NumbaError
from numpy.typing import NDArray

from fem_needle.dynamics import notice
from fem_needle.dynamics.haste import hastened
from fem_needle.dynamics.linking import EntranceCompiler, InnerCompiler
from fem_needle.dynamics.rows import TABLE

# Sums may be reordered; NaN and infinity keep their meaning, by which a failed step is found.
_ARITHMETIC: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "reassoc", "nsz"}}
# Without counting references, which costs more than the arithmetic: compiled code allocates nothing.
_INNER = _ARITHMETIC | {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": InnerCompiler}
_ENTRANCE = _ARITHMETIC | {"_nrt": False, "no_cfunc_wrapper": True, "nogil": True, "pipeline_class": EntranceCompiler}

_TABLE = types.Array(types.int64, 2, "C")
_FUNCTIONS_SHARE = 0.75  # of the time goes into the functions, what is left into the whole that they become
_SECONDS_PER_FUNCTION = 0.1
_DIGITS = 12  # of what tells sources apart
_TOLD: list[str] = []  # what was compiled and kept nowhere


def inner(function: Callable[..., Any]) -> Any:
    """Compile a function into its callers, once: not anew for every constant that one of them passes."""
    compiled = njit(**_INNER)(function)
    if not config.DISABLE_JIT:  # type: ignore[attr-defined]
        template = compiled.get_call_template
        compiled.get_call_template = lambda args, kws: template(tuple(map(_handed_on, args)), kws)
    return compiled


stage = inner  # of a function that has one caller


def _handed_on(argument: Any) -> Any:
    """Return the type as which an argument is taken: no constant, and of a table only where it is."""
    return TABLE if argument == _TABLE else types.unliteral(argument)


def entrance(what: str, functions: int) -> Callable[[Callable[..., Any]], Entrance]:
    """Compile a function that Python calls as a whole, and keep it on disk.

    Parameters
    ----------
    what
        Its name in messages.
    functions
        How many functions are compiled for it alone, about: so that somebody who waits sees how long.
    """
    return lambda function: Entrance(function, what, functions)


class Entrance:
    """A compiled function that Python calls with a table; other threads go on meanwhile.

    Attributes
    ----------
    what, functions
        As `entrance` takes them.
    compiled
        How many functions have been compiled for it in this process, 0 where it was on disk.
    """

    def __init__(self, function: Callable[..., Any], what: str, functions: int) -> None:
        self.what, self.functions, self.compiled = what, functions, 0
        self.__name__, self.__doc__, self.__module__ = function.__name__, function.__doc__, function.__module__
        self._function = function
        self._is_ready = bool(config.DISABLE_JIT)  # type: ignore[attr-defined]
        self._stamp = "" if self._is_ready else _stamp(function)
        self._run: Any = function if self._is_ready else _kept(function, self._stamp)

    def __call__(self, table: NDArray[np.int64]) -> int:
        """Run it."""
        if not self._is_ready:
            self.prepare()
        return int(self._run(table))

    def __reduce__(self) -> str:
        """Be the same in copies and in other processes."""
        return self.__name__

    @property
    def folder(self) -> Path | None:
        """Where it is kept, None where it can be kept nowhere."""
        path = None if self._run is self._function else self._run.stats.cache_path
        return None if path is None else Path(path)

    @property
    def is_kept(self) -> bool:
        """Whether it is there for the next process."""
        return self.folder is not None and any(self.folder.glob(f"*.{self.__name__}{self._stamp}-*.nbc"))

    def prepare(self) -> float:
        """Load or compile it where that has not been done yet: before threads or processes need it; returns the seconds."""
        began = perf_counter()
        with hastened():
            if not self._is_ready:
                self._read()
                self._run.disable_compile()  # a table of another kind is a mistake
                self._is_ready = True
        return perf_counter() - began

    def _read(self) -> None:
        """Load or compile it; what is kept and cannot be read is made anew."""
        try:
            self._compile()
        except NumbaError:
            raise
        except Exception as error:
            if self.compiled or self.folder is None:
                raise
            notice.LOGGER.warning("what was kept of the %s in %s cannot be read: %s", self.what, self.folder, error)
            _remove(self.folder, f"*.{self.__name__}{self._stamp}-*.nb[ic]")
            self._run = _kept(self._function, self._stamp)
            self._compile()

    def _compile(self) -> None:
        dispatcher = self._run
        try:
            with event.install_listener("numba:compile", _Counter(self)):
                dispatcher.compile((_TABLE,))
            if self.compiled:  # by now what was made of other sources is of no use
                _remove(self.folder, f"*.{self.__name__}{self._stamp[:-_DIGITS]}{'?' * _DIGITS}-*.nb[ic]", self._stamp)
        except OSError as error:
            if not dispatcher.signatures:
                raise
            notice.LOGGER.warning("the %s cannot be kept in %s: %s", self.what, self.folder, error)


class _Counter(event.Listener):
    """Tells how much of an entrance is compiled."""

    def __init__(self, entrance: Entrance) -> None:
        self._entrance = entrance
        self._depth = 0

    def on_start(self, event: event.Event) -> None:
        """Announce the first one."""
        if self._depth == 0:
            self._announce()
        self._depth += 1

    def _announce(self) -> None:
        """Say what is compiled; that it can be kept nowhere once, by the process that others were started from."""
        what, seconds = self._entrance.what, round(_SECONDS_PER_FUNCTION * self._entrance.functions)
        is_kept = self._entrance.folder is not None
        if not is_kept and parent_process() is not None:
            return
        if is_kept or not _TOLD:
            notice.begun(what, seconds, is_kept=is_kept)
        else:
            notice.LOGGER.warning("compiling the %s (some %d s)", what, seconds)
            notice.done(what, 0.0)
        if not is_kept:
            _TOLD.append(what)

    def on_end(self, event: event.Event) -> None:
        """Count."""
        self._depth -= 1
        self._entrance.compiled += 1
        share = min(1.0, self._entrance.compiled / self._entrance.functions)
        notice.done(self._entrance.what, _FUNCTIONS_SHARE * share if self._depth else 1.0)


def _kept(function: Callable[..., Any], stamp: str) -> Any:
    """Return a function that is kept on disk, by a name that is another where any file of its package is another."""
    name = function.__qualname__
    function.__qualname__ = f"{name}{stamp}"
    try:
        return njit(**_ENTRANCE, cache=True)(function)
    except RuntimeError:  # no folder can be written
        return njit(**_ENTRANCE)(function)
    finally:
        function.__qualname__ = name


def _stamp(function: Callable[..., Any]) -> str:
    """Return a text that is another for other sources, of which numba itself sees one, and where indices are checked."""
    digest = _digest(function.__module__.rpartition(".")[0])
    return f"_checked_{digest}" if config.BOUNDSCHECK else f"_{digest}"  # type: ignore[attr-defined]


@cache
def _digest(package: str) -> str:
    digest = hashlib.sha256()
    sources = (path for path in files(package).iterdir() if path.name.endswith(".py"))
    for path in sorted(sources, key=lambda path: path.name):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:_DIGITS]


def _remove(folder: Path | None, pattern: str, but: str = "/") -> None:
    """Remove files but those whose names contain something."""
    for path in () if folder is None else folder.glob(pattern):
        if but not in path.name:
            with suppress(OSError):
                path.unlink()
