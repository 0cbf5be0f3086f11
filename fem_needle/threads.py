"""One thread for linear algebra: more of them add numbers in another order, and a result would depend on their number.

They also cost time here: the matrices are small, and threads wait for each other.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from typing import ParamSpec, TypeVar

import numpy as np  # noqa: F401 (its library must be loaded to be found)
from scipy.linalg import lapack  # noqa: F401 (likewise)
from threadpoolctl import ThreadpoolController

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def one_thread(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Let a function compute with one thread of BLAS, whatever the environment says; what follows it has its own again."""

    @wraps(function)
    def alone(*arguments: Arguments.args, **named: Arguments.kwargs) -> Result:
        with _libraries().limit(limits=1, user_api="blas"):
            return function(*arguments, **named)

    return alone


@cache
def _libraries() -> ThreadpoolController:
    """Return the loaded libraries; to look for them takes some milliseconds, to set their threads some microseconds."""
    return ThreadpoolController()
