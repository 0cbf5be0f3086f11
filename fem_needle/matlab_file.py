"""A run as a MATLAB file: version 5, which `load` and `scipy.io.loadmat` open."""

from __future__ import annotations

from io import BytesIO

from scipy.io import savemat

from fem_needle.errors import ComputationError
from fem_needle.scene_file import scene_text
from fem_needle.series_file import described_values
from fem_needle.trajectory import Trajectory

LARGEST = 2**31 - 1  # bytes of one variable of the format


def matlab_file(run: Trajectory) -> bytes:
    """Return the file of a run.

    Every variable of `series.nc` under its name, vectors as columns, time along the rows; the structs ``units`` and ``long_name``
    with a field for each; ``scene``, the text of `scene.toml`, and ``title``.

    Raises
    ------
    ComputationError
        If a variable is larger than the format allows.
    """
    described = described_values(run)
    for name, (_, _, _, values) in described.items():
        if values.nbytes > LARGEST:
            raise ComputationError(f"{name} is too large for a .mat file of version 5; MATLAB opens series.nc with ncread")
    content = {name: values for name, (_, _, _, values) in described.items()}
    texts = {
        "units": {name: unit for name, (_, unit, _, _) in described.items()},
        "long_name": {name: meaning for name, (_, _, meaning, _) in described.items()},
        "title": run.scene.title,
        "scene": scene_text(run.scene),
    }
    memory = BytesIO()
    savemat(memory, content | texts, long_field_names=True, oned_as="column", do_compression=True)
    return memory.getvalue()
