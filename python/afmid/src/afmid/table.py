"""Tables: columns of equal length, as pandas DataFrames."""

from __future__ import annotations

from typing import Any

import h5py
import pandas as pd

from . import stored


def read_table(group: h5py.Group) -> pd.DataFrame:
    """A table artifact, its columns in reading order; standard errors are the columns with `std` in their names.

    `attrs["units"]` and `attrs["long_name"]` say what each column holds, `attrs["attributes"]` are the table's scalars.
    Unknown numbers are NaN.

    >>> with h5py.File("a.h5") as file:
    ...     modes = read_table(file["entry/modes/modes"])
    >>> list(modes.columns[:2]), modes.attrs["units"]["frequency_std_hz"]
    (['frequency_hz', 'frequency_std_hz'], 'Hz')
    """
    layout = stored.layout(group)
    names = [column["name"] for column in layout["columns"]]
    columns = {column["name"]: _column(group, column["name"], column["kind"]) for column in layout["columns"]}
    frame = pd.DataFrame(columns, columns=names)
    described = {name: stored.described(stored.dataset(group, name)) for name in names}
    frame.attrs = {
        "units": {name: of.get("units", "") for name, of in described.items()},
        "long_name": {name: of.get("long_name", "") for name, of in described.items()},
        "attributes": stored.attributes(group, layout["attributes"]),
    }
    return frame


def _column(group: h5py.Group, name: str, kind: str) -> Any:
    if kind == "text":
        return stored.value(group, name)
    values = stored.numbers(group, name)
    return values.astype(bool) if kind == "flag" else values
