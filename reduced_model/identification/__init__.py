"""The thesis' identification repeated: friction, stiffness of the tissue, bending of the needle."""
