"""Ask Python from compiled code: for models that give their matrices depth by depth, and know more than polynomials can tell."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import config
from numba.extending import intrinsic

_SIGNATURE = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64)
_KNOWN: dict[int, Callable[[int, int], None]] = {}  # by address, for code that is not compiled


class Callback:
    """A Python function (instant, question) that compiled code can call while this object lives.

    Attributes
    ----------
    address
        What compiled code calls.
    failure
        The exception that the function raised last: compiled code cannot pass it on.
    """

    def __init__(self, function: Callable[[int, int], None]) -> None:
        self.failure: BaseException | None = None

        def guarded(at: int, question: int) -> None:
            try:
                function(at, question)
            except BaseException as error:
                self.failure = error

        self._pointer = _SIGNATURE(guarded)
        self.address = int(ctypes.cast(self._pointer, ctypes.c_void_p).value or 0)
        _KNOWN[self.address] = guarded

    def __del__(self) -> None:
        _KNOWN.pop(self.address, None)

    def check(self) -> None:
        """Raise what the function has raised."""
        if self.failure is not None:
            failure, self.failure = self.failure, None
            raise failure


def _typed(context: Any, address: Any, at: Any, question: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        word = ir.IntType(64)
        pointer = ir.FunctionType(ir.VoidType(), [word, word]).as_pointer()
        builder.call(builder.inttoptr(arguments[0], pointer), [arguments[1], arguments[2]])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64), generate


def _asked(address: int, at: int, question: int) -> None:
    _KNOWN[int(address)](int(at), int(question))


ask: Any = _asked if config.DISABLE_JIT else intrinsic(_typed)  # type: ignore[attr-defined]
