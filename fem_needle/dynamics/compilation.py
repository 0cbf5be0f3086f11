"""How the kernel's functions are compiled: small ones into their callers, two entrances kept on disk."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit
from numba.core import config, types

# Sums may be reordered; NaN and infinity keep their meaning, by which a failed step is found.
_ARITHMETIC: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "reassoc", "nsz"}}
# Without counting references, which costs more than the arithmetic: compiled code allocates nothing.
_INNER = _ARITHMETIC | {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_ENTRANCE = _ARITHMETIC | {"_nrt": False, "no_cfunc_wrapper": True, "cache": True, "nogil": True}


def inner(function: Callable[..., Any]) -> Any:
    """Compile a function into its callers, once: not anew for every constant that one of them passes."""
    compiled = njit(**_INNER)(function)
    if not config.DISABLE_JIT:  # type: ignore[attr-defined]
        template = compiled.get_call_template
        compiled.get_call_template = lambda args, kws: template(tuple(map(types.unliteral, args)), kws)
    return compiled


def stage(function: Callable[..., Any]) -> Any:
    """Write a function that has one caller into it before it is compiled: what is called deeply is optimized again at each level."""
    return njit(**_INNER, inline="always")(function)


def entrance(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls, keep it on disk, and let other threads go on meanwhile."""
    return njit(**_ENTRANCE)(function)
