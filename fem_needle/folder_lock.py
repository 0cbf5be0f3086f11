"""A folder that one writer has to itself: the system lets go of it when the process ends, however that happens.

The lock is on the folder itself (``flock``), so that no file is left behind. Where a system has none, nothing is locked.
"""

from __future__ import annotations

import os
from pathlib import Path

from fem_needle.errors import SceneError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]


class FolderLock:
    """Holds an existing folder until it is released.

    Parameters
    ----------
    folder
        The folder.

    Raises
    ------
    SceneError
        If somebody else holds it.
    OSError
        If there is no such folder.
    """

    _descriptor: int | None = None

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._descriptor = _locked(folder)

    def release(self) -> None:
        """Let go; once more does nothing."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            os.close(descriptor)

    def __del__(self) -> None:
        self.release()


def is_locked(folder: Path) -> bool:
    """Return whether somebody writes into a folder at this moment."""
    try:
        FolderLock(folder).release()
    except SceneError:
        return True
    except OSError:
        return False
    return False


def _locked(folder: Path) -> int | None:
    if fcntl is None:
        return None
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise SceneError(f"{folder}: another run is writing into it; wait, or name another folder") from None
    except OSError:  # a file system without locks
        os.close(descriptor)
        return None
    return descriptor
