"""HDF5 files that keep to themselves: no link, storage or view into another file, and no more numbers than fit into memory."""

from __future__ import annotations

from math import prod
from pathlib import Path
from typing import Any

import h5py

MOST_BYTES = 4_000_000_000  # of all datasets, unpacked


def check_hdf5(path: Path) -> None:
    """Look through the links and the sizes of a file without reading its numbers.

    Raises
    ------
    ValueError
        If it leads out of itself, or is too large unpacked: a small file may promise any size.
    OSError, RuntimeError
        If it is damaged.
    """
    with h5py.File(path, "r") as file:
        outward = file.visititems_links(lambda name, link: name if isinstance(link, h5py.ExternalLink) else None)
        if outward is not None:
            raise ValueError(f"{outward} is a link to another file, which is not read")
        found: list[Any] = []
        file.visititems(lambda _, item: found.append(item) if isinstance(item, h5py.Dataset) else None)
        outward = next((dataset.name for dataset in found if dataset.is_virtual or dataset.external), None)
        if outward is not None:
            raise ValueError(f"{outward} lies in another file, which is not read")
        size = sum(prod(dataset.shape or ()) * dataset.dtype.itemsize for dataset in found)
        if size > MOST_BYTES:
            raise ValueError(f"it holds {size / 1e9:.3g} GB of numbers (allowed up to {MOST_BYTES / 1e9:g} GB)")
