"""What pictures and tables call the layers: by name, or by the number that ``tissue.layers.N`` has in the scene, from 0."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import wrap

from fem_needle.scene import Layer, Scene

NO_BREAK = "\u00a0"
KILO = 1e3
MOST_NOTES = 8  # layers in a key


def numbered_layers(scene: Scene) -> tuple[tuple[int, Layer], ...]:
    """Return the layers with their numbers in the scene, by depth."""
    return tuple(sorted(enumerate(scene.tissue.layers), key=lambda pair: pair[1].start))


def layer_name(number: int, layer: Layer) -> str:
    """Return the name of a layer, or "layer" and its number."""
    return layer.name or f"layer {number}"


def layer_text(number: int, layer: Layer) -> str:
    """Return name and modulus of a layer."""
    return f"{layer_name(number, layer)}, {_modulus(layer)}"


def key_entry(number: int, layer: Layer) -> str:
    """Return what a key says of a layer of which a picture shows the number alone."""
    return f"{number}: {layer.name}, {_modulus(layer)}" if layer.name else f"{number}: {_modulus(layer)}"


def layer_key(entries: Iterable[str], width: int) -> str:
    """Return a key in lines of so many characters; "" without entries, the first ones of very many.

    Parameters
    ----------
    entries
        Of `key_entry`.
    width
        Characters of a line.
    """
    known = list(entries)
    left_out = len(known) - MOST_NOTES
    shown = [*known[:MOST_NOTES], *([f"and {left_out} more layers"] if left_out > 0 else [])]
    return "\n".join(wrap(f"Layers by their numbers in the scene: {';  '.join(shown)}", width)) if shown else ""


def _modulus(layer: Layer) -> str:
    return f"{layer.foundation_modulus / KILO:.4g}{NO_BREAK}kN/m²"
