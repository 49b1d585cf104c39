"""Room for temporary files: where there is none, nothing is said of the log, and nothing of it is left out."""

from __future__ import annotations

import errno
import os
import tempfile

from replay.errors import LogError

FULL = {errno.ENOSPC, errno.EFBIG, errno.EDQUOT}


class NoRoom(LogError):
    """The folder for temporary files cannot take what reading a log needs."""

    def __init__(self, what: str, error: OSError | None = None) -> None:
        super().__init__(
            f"the temporary folder {tempfile.gettempdir()} cannot take {what}; set TMPDIR to a folder with more room"
        )
        self.__cause__ = error or OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
