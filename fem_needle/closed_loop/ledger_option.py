"""The option that left works and energy balance out of a loop; it does nothing any more."""

from __future__ import annotations

import warnings

ADVICE = "energies does nothing any more: a loop always computes works and the energy balance; leave it out"


def warn_of_energies(energies: bool | None, stacklevel: int = 4) -> None:
    """Warn who still says whether a loop shall compute works and the energy balance."""
    if energies is not None:
        warnings.warn(ADVICE, DeprecationWarning, stacklevel=stacklevel)
