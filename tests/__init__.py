"""Tests; the environment below must be set before numpy is loaded for the first time."""

import os

# Small matrices: threads only wait for each other, up to thirty times slower on a busy machine.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
