"""Recordings: which files were read, and their channels; never their samples."""

from __future__ import annotations

from dataclasses import dataclass

import h5py
import pandas as pd

from . import stored
from .table import read_table


@dataclass(frozen=True)
class Recording:
    """The record files of a run.

    >>> import afmid
    >>> with afmid.open("a.h5") as r:
    ...     recording = r.records
    >>> recording.records.file[0], recording.channels.unit[0]
    ('record_0000.h5', 'V')
    """

    records: pd.DataFrame
    """One row per record: file, path, size, blake3, sample_rate, started_at..."""
    channels: pd.DataFrame
    """One row per channel: record (row of `records`), role, location, samples, unit, scale_factor, add_offset..."""


def read_recording(group: h5py.Group) -> Recording:
    """A recording artifact.

    >>> with h5py.File("a.h5") as file:
    ...     len(read_recording(file["entry/records/records"]).records.blake3[0])
    64
    """
    return Recording(*(read_table(stored.group(group, name)) for name in ("records", "channels")))
