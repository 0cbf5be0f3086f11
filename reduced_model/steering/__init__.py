"""The thesis' experiments in closed loop, repeated; and controllers compared: the page docs/steering.md."""
