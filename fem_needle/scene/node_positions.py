"""The mesh of a needle in a scene: a file, or the positions of its nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationInfo
from pydantic.json_schema import JsonSchemaValue

from fem_needle.errors import SceneError
from fem_needle.mesh_file import MAXIMUM_ELEMENTS, checked_positions, read_mesh
from fem_needle.scene.part import custom_error, shown
from fem_needle.scene.quantity import Quantity
from fem_needle.scene.table_file import inside_folder


@dataclass(frozen=True)
class NodePositions(Quantity):
    """Metadata and check of a field that holds a line mesh: positions from the hub, 0, to the tip [m]."""

    unit: str = "m"
    optional: bool = True

    def validate(self, value: Any, info: ValidationInfo) -> Any:
        """Return the positions as a tuple; a text names a mesh file inside the scene's folder.

        Raises
        ------
        PydanticCustomError
            If there is no such mesh.
        """
        if value is None:
            return None
        try:
            if isinstance(value, str):
                folder = info.context.get("folder") if isinstance(info.context, Mapping) else None
                return tuple(_from_file(value, folder).tolist())
            if isinstance(value, bytes) or not isinstance(value, Sequence):
                raise SceneError(f"is no mesh (got {shown(value)}; allowed a file's name or a list of node positions in m)")
            return tuple(checked_positions([self.number(item) for item in value]).tolist())
        except (ValueError, OSError) as error:
            raise custom_error(str(error)) from None

    def json_choices(self) -> list[JsonSchemaValue]:
        """Return the JSON schemas of the allowed forms."""
        numbers: JsonSchemaValue = {"type": "array", "items": {"type": ["number", "string"]}, "description": "in m"}
        numbers |= {"minItems": 2, "maxItems": MAXIMUM_ELEMENTS + 1}
        return [{"type": "string", "description": "mesh file"}, numbers]


def _from_file(file: str, folder: Path | None) -> Any:
    if folder is None:
        raise SceneError(f"{file!r} needs a scene in a folder; write the node positions, or use --mesh")
    return read_mesh(inside_folder(file, folder))
