"""Flexible needles in soft tissue: the finite-element reference and the shared tools."""

from __future__ import annotations

from importlib import import_module
from typing import Any

# Name and the module that defines it, imported at its first use: `--help` pays for nothing else.
_HOMES = {
    "load_scene": "fem_needle.scene_file",
    "parse_scene": "fem_needle.scene_file",
    "save_scene": "fem_needle.scene_file",
    "suspicious": "fem_needle.checks",
    "run_scene": "fem_needle.simulation",
    "simulate": "fem_needle.simulation",
    "Simulation": "fem_needle.closed_loop.simulation",
    "UnstableLoopError": "fem_needle.closed_loop.simulation",
    "SimulationBatch": "fem_needle.closed_loop.simulation_batch",
    "steer": "fem_needle.closed_loop.steering",
    "controller_of": "fem_needle.control.build",
    "simulate_many": "fem_needle.batch.many",
    "ManyRuns": "fem_needle.batch.many",
    "converge": "fem_needle.convergence.study",
    "ConvergenceStudy": "fem_needle.convergence.study",
    "compare": "fem_needle.comparison.study",
    "Comparison": "fem_needle.comparison.result",
    "FiniteElementNeedle": "fem_needle.needle",
    "solve_static": "fem_needle.statics",
    "build_plant": "fem_needle.models",
    "linearize": "fem_needle.linear.linearization",
    "LinearModel": "fem_needle.linear.model",
    "analyze": "fem_needle.analysis.study",
    "Analysis": "fem_needle.analysis.study",
    "identify": "fem_needle.identification.fit",
    "Identification": "fem_needle.identification.result",
    "Measurements": "fem_needle.identification.measurements",
    "read_measurements": "fem_needle.identification.measurements",
    "Trajectory": "fem_needle.trajectory",
    "NeedleError": "fem_needle.errors",
    "SceneError": "fem_needle.errors",
    "ComputationError": "fem_needle.errors",
    "SuspiciousValueWarning": "fem_needle.errors",
} | dict.fromkeys(
    (
        "Actuator",
        "Actuators",
        "Controller",
        "Friction",
        "Gains",
        "Guide",
        "Initial",
        "Insertion",
        "LateralLoad",
        "Layer",
        "Model",
        "Needle",
        "Numerics",
        "Run",
        "Scatter",
        "Scene",
        "Sensor",
        "Sinusoid",
        "Support",
        "Table",
        "Target",
        "TipLoad",
        "Tissue",
    ),
    "fem_needle.scene",
)

__all__ = sorted(_HOMES)  # noqa: PLE0605 (names are what `_HOMES` says)


def __getattr__(name: str) -> Any:
    """Import a public name from its module."""
    if name not in _HOMES:
        raise AttributeError(f"module 'fem_needle' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """List the public names."""
    return __all__
