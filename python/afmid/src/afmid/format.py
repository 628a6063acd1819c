"""Is it a result file, and of a format that this reader knows?"""

from __future__ import annotations

import os
from pathlib import Path

import h5py

from . import stored
from .errors import AfmidError, NotAResult, OtherFormat

FORMAT = 2
"""The layout of result files that this reader knows (`afmid_format_version`)."""
_SEAL = b"\nafmid seal, BLAKE3 of all bytes before this line: "
_SEAL_LENGTH = len(_SEAL) + 64 + 1


def open_result(path: Path, require_seal: bool = True) -> h5py.File:
    """Opens the file for reading. Errors: `FileNotFoundError`; `NotAResult`, saying what it is; `OtherFormat`.

    The last line of a result seals it; a program that opens it for writing, such as `nxcheck`, takes the seal off
    though it may change nothing.

    >>> open_result(Path("a.h5")).attrs["afmid_format"]
    'result'
    """
    if path.is_dir():
        raise NotAResult(f"{path} is a folder, wanted a result file")
    if not path.is_file():
        raise FileNotFoundError(f"there is no file {path}")
    if not h5py.is_hdf5(path):
        raise NotAResult(f"{path} is no HDF5 file: `afmid run CONFIG -o OUT.h5` makes a result")
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise NotAResult(f"{path} is cut short or damaged: {error}") from error
    try:
        _check(path, file, require_seal)
    except BaseException:
        file.close()
        raise
    return file


class OpenFile:
    """An open result file, shared by a result and its stages.

    >>> file = OpenFile(Path("a.h5"))
    >>> file.entry.name
    '/entry'
    >>> file.close()
    """

    def __init__(self, path: Path, require_seal: bool = True) -> None:
        self.path = path
        self._file: h5py.File | None = open_result(path, require_seal)

    @property
    def closed(self) -> bool:
        """Whether it was closed.

        >>> OpenFile(Path("a.h5")).closed
        False
        """
        return self._file is None

    @property
    def entry(self) -> h5py.Group:
        """What everything lies in. Errors: `AfmidError`, the file was closed.

        >>> OpenFile(Path("a.h5")).entry.name
        '/entry'
        """
        if self._file is None:
            raise AfmidError(f"{self.path} has been closed; what was read before stays, for more open it again")
        return stored.group(self._file, "entry")

    def close(self) -> None:
        """Closes it; once is enough.

        >>> OpenFile(Path("a.h5")).close()
        """
        if self._file is not None:
            self._file.close()
            self._file = None


def _check(path: Path, file: h5py.File, require_seal: bool) -> None:
    kind = stored.plain(file.attrs.get("afmid_format"))
    if kind is None and "sample_rate_hz" in file.attrs:
        raise NotAResult(
            f"{path} is a recording: name it in a config's stage `io.records`, "
            "`afmid run CONFIG -o OUT.h5` makes a result"
        )
    if kind is None:
        raise NotAResult(f"{path} is an HDF5 file of another program: it has no `afmid_format`")
    if kind != "result":
        raise NotAResult(f"{path} is a {kind} file of afmid's cache, wanted a result of `afmid run`")
    version = stored.plain(file.attrs.get("afmid_format_version"))
    if version != FORMAT:
        newer = isinstance(version, int) and version > FORMAT
        what = (
            "install a newer `afmid` package"
            if newer
            else "run its config again, or read it with the package of that time"
        )
        raise OtherFormat(f"{path} has format {version}, this reader knows {FORMAT}: {what}")
    if require_seal and not _sealed(path):
        what = "its last line is no seal; with require_seal=False it is read as it is"
        raise NotAResult(f"{path} is cut short, or was changed by another program: {what}")


def _sealed(path: Path) -> bool:
    """Whether the last line is a seal; its hash is checked by the program, not here."""
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - _SEAL_LENGTH))
        return file.read().startswith(_SEAL)
