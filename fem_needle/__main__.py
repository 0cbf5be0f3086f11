"""``python -m fem_needle`` is the command ``fem-needle``."""

from fem_needle.cli import main

if __name__ == "__main__":
    main()
