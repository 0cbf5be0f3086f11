"""A needle that is steered: inputs, the loop around either model, and what comes of it."""
