"""Settings under which numba compiles the kernel sooner, and makes the same of it; outside they are as a user has left them."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import config, types
from numba.core.compiler_lock import global_compiler_lock

# The third level and vectors of LLVM's own cost a fifth more time, and the kernel's loops of four rows are no faster with them.
OPTIMIZATION = 2
SETTINGS = {"LOOP_VECTORIZE": 0, "SLP_VECTORIZE": 0}


@contextmanager
def hastened() -> Iterator[None]:
    """Compile inside the context and let nobody else: settings are the process's."""
    with global_compiler_lock, _configured(), _uncollected(), _remembered():
        yield


@contextmanager
def _configured() -> Iterator[None]:
    usual = {name: getattr(config, name) for name in ("OPT", *SETTINGS)}
    changed = SETTINGS | {"OPT": type(usual["OPT"])(OPTIMIZATION)}
    for name, value in changed.items():
        setattr(config, name, value)
    try:
        yield
    finally:
        for name, value in usual.items():
            setattr(config, name, value)


@contextmanager
def _uncollected() -> Iterator[None]:
    """Look for no garbage: millions of objects live until the end, and each search goes through all of them."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


@contextmanager
def _remembered() -> Iterator[None]:
    """Remember what an operator makes of which types: numba asks for that of every product anew, in a dozen places."""
    found: dict[tuple[int, tuple[Any, ...]], Any] = {}
    kept = []  # so that no other function gets the number of one that is gone
    functions: Any = types.Function
    is_own, usual = "get_call_type" in vars(functions), functions.get_call_type

    def get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws:
            return usual(self, context, args, kws)
        key = id(self), tuple(args)
        if key not in found:
            kept.append(self)
            found[key] = usual(self, context, args, kws)
        return found[key]

    functions.get_call_type = get_call_type
    try:
        yield
    finally:
        if is_own:
            functions.get_call_type = usual
        else:
            del functions.get_call_type
