"""Names as people type them: `tip deflection`, `Tip-Deflection`."""

from __future__ import annotations

from collections.abc import Iterable


def known_name(name: str, known: Iterable[str]) -> str:
    """Return the known name that another one spells with spaces, hyphens or capitals, else the name as it is."""
    names = tuple(known)
    if name in names:
        return name
    return next((one for one in names if _plain(one) == _plain(name)), name)


def _plain(name: str) -> str:
    return "_".join(name.casefold().replace("-", " ").replace("_", " ").split())
