"""Linear models over the depth as a MATLAB file, for gain schedules and Simulink."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from typing import Any

import numpy as np
from scipy.io import savemat

from fem_needle.analysis.study import Analysis
from fem_needle.linear.model import LinearModel, Signal


def analysis_matlab(analysis: Analysis) -> bytes:
    """Return a version 5 file.

    ``A``, ``B``, ``C``, ``D`` (rows, columns, depths), or cells where the number of states changes with the depth; ``depth`` [m];
    ``states``, ``inputs``, ``outputs`` and their ``..._units``; the struct ``slow`` with the same of the slowest vibrations;
    ``gain`` (depths, inputs) over ``gain_depth`` for ``gain_inputs``; ``natural_frequency`` (depths, number) [rad/s].
    """
    curve = analysis.curve
    content = _system([one.model for one in analysis.points])
    content |= {
        "depth": analysis.depths[:, None],
        "slow": _system([one.slow for one in analysis.points]),
        "gain": curve.gains,
        "gain_depth": curve.depths[:, None],
        "gain_inputs": _cells([signal.name for signal in curve.inputs]),
        "natural_frequency": curve.frequencies,
    }
    memory = BytesIO()
    savemat(memory, content, long_field_names=True, do_compression=True)
    return memory.getvalue()


def _system(models: Sequence[LinearModel]) -> dict[str, Any]:
    content = {name: _stacked([getattr(model, name) for model in models]) for name in ("A", "B", "C", "D")}
    signals: dict[str, tuple[Signal, ...]] = {
        "states": models[0].states,
        "inputs": models[0].inputs,
        "outputs": models[0].outputs,
    }
    for name, found in signals.items():
        content[name] = _cells([signal.name for signal in found])
        content[f"{name}_units"] = _cells([signal.unit for signal in found])
    return content


def _stacked(matrices: list[Any]) -> Any:
    if len({matrix.shape for matrix in matrices}) == 1:
        return np.stack(matrices, axis=-1)
    cells = np.empty((len(matrices), 1), dtype=object)
    cells[:, 0] = matrices
    return cells


def _cells(texts: list[str]) -> Any:
    cells = np.empty((len(texts), 1), dtype=object)
    cells[:, 0] = texts
    return cells
