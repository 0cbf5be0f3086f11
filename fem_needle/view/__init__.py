"""A run in three dimensions: the needle as a tube in a translucent block of layers, its template, the forces as arrows."""

from fem_needle.view.arrangement import Arrangement, Pose, arrangement
from fem_needle.view.picture import Renderer, write_picture

__all__ = ["Arrangement", "Pose", "Renderer", "arrangement", "write_picture"]
