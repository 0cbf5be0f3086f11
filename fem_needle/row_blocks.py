"""Rows of a table in blocks: what is computed of many rows at once takes bounded memory."""

from __future__ import annotations

from collections.abc import Iterator

NUMBERS = 2**18  # of one array of a block, 2 MB: some twenty arrays at a time stay below 50 MB


def row_blocks(rows: int, width: int) -> Iterator[slice]:
    """Yield slices that cover so many rows, each with about `NUMBERS` numbers in rows of a width.

    Parameters
    ----------
    rows
        How many rows there are.
    width
        How many numbers the largest array on the way has for each row.
    """
    size = max(1, NUMBERS // max(1, width))
    for first in range(0, rows, size):
        yield slice(first, min(first + size, rows))
