"""Assumed-mode models of a needle in soft tissue."""

from __future__ import annotations

from importlib import import_module
from typing import Any

# Name and the module that defines it, imported at its first use.
_HOMES = {
    "AssumedModeNeedle": "reduced_model.needle",
    "ClampedFreeModes": "reduced_model.modes",
    "project": "reduced_model.projection",
    "ProjectedNeedle": "reduced_model.projection",
    "FixedBasis": "reduced_model.bases",
    "mode_basis": "reduced_model.bases",
    "natural_mode_basis": "reduced_model.bases",
    "snapshot_basis": "reduced_model.bases",
}

__all__ = sorted(_HOMES)  # noqa: PLE0605 (names are what `_HOMES` says)


def __getattr__(name: str) -> Any:
    """Import a public name from its module."""
    if name not in _HOMES:
        raise AttributeError(f"module 'reduced_model' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """List the public names."""
    return __all__
