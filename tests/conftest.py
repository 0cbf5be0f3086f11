"""The environment below must be set before numpy is loaded for the first time."""

import os

# Small matrices: threads only wait for each other, up to thirty times slower on a busy machine.
for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
