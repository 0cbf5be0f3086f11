"""The environment below must be set before numpy is loaded for the first time."""

import os
import sys

import pytest

# Small matrices: threads only wait for each other, up to thirty times slower on a busy machine.
for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")


@pytest.fixture
def command_line(monkeypatch, capsys):
    """Run the command `fem-needle` as `main` does; return status, stdout, stderr."""
    from fem_needle import cli

    def command(*arguments) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["fem-needle", *map(str, arguments)])
        with pytest.raises(SystemExit) as caught:
            cli.main()
        captured = capsys.readouterr()
        return int(caught.value.code or 0), captured.out, captured.err

    return command
