"""One instant as a PNG: by VTK in a process of its own, which may crash without GL, or by matplotlib where it does."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from enum import Enum
from io import BytesIO
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from PIL import Image

from fem_needle.atomic_file import write_file
from fem_needle.errors import NeedleError
from fem_needle.view.arrangement import Arrangement
from fem_needle.view.by_matplotlib import picture
from fem_needle.view.drawing import Drawing, drawing

FEWEST_COLORS = 8  # in a picture that shows anything


class Renderer(Enum):
    """Who draws; ``AUTO`` tries VTK first."""

    AUTO = "auto"
    VTK = "vtk"
    MATPLOTLIB = "matplotlib"


def write_picture(arranged: Arrangement, row: int, path: Path, renderer: Renderer = Renderer.AUTO) -> Renderer:
    """Write a sample as a PNG and return who drew it.

    Parameters
    ----------
    arranged, row
        The run and the sample.
    path
        File.
    renderer
        Who may draw.

    Raises
    ------
    NeedleError
        If VTK was asked for and cannot draw here.
    ComputationError
        If the file cannot be written.
    """
    drawn = drawing(arranged, row)
    content = None if renderer is Renderer.MATPLOTLIB else _by_vtk(drawn)
    if content is not None:
        write_file(path, content)
        return Renderer.VTK
    if renderer is Renderer.VTK:
        raise NeedleError("--renderer: VTK cannot draw here: it finds no GL (allowed auto, matplotlib)")
    write_file(path, picture(drawn))
    return Renderer.MATPLOTLIB


def _by_vtk(drawn: Drawing) -> bytes | None:
    """Return a PNG, None where VTK cannot draw."""
    for window in ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow"):
        try:
            with ProcessPoolExecutor(1, get_context("spawn")) as pool:
                width, height, pixels = pool.submit(_rendered, drawn, window).result()
        except (BrokenProcessPool, OSError, RuntimeError, ImportError):
            continue
        image = np.frombuffer(pixels, dtype=np.uint8).reshape(height, width, 3)
        if len(np.unique(image.reshape(-1, 3)[::97], axis=0)) >= FEWEST_COLORS:
            content = BytesIO()
            Image.fromarray(image).save(content, format="png", optimize=True)
            return content.getvalue()
    return None


def _rendered(drawn: Drawing, window: str) -> tuple[int, int, bytes]:
    from fem_needle.view.by_vtk import render

    return render(drawn, window)
