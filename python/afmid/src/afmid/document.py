"""Documents: JSON, as dicts."""

from __future__ import annotations

from typing import Any

import h5py

from . import stored


def read_document(group: h5py.Group) -> Any:
    """A document artifact: what `afmid show RESULT STAGE --json` prints; unknown numbers are None.

    >>> with h5py.File("a.h5") as file:
    ...     sorted(read_document(file["entry/modes/summary"])["fit_percent"])
    ['held_out', 'identification', 'noise_ceiling']
    """
    return stored.parsed(group, stored.value(group, "data"), "document")
