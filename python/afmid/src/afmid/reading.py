"""Recordings of any format that the program reads."""

from __future__ import annotations

import json
import os
from typing import Any

import numpy as np
import xarray as xr

from . import _native, artifacts


def read(path: str | os.PathLike[str], *, format: str = "auto") -> xr.Dataset:
    """The channels of a recording: samples in their units over time, as the file states both.

    Channels of one clock share a coordinate `time` in seconds; those of other clocks have one of their own, `time_2`
    and so on; channels whose clock the file does not state are over `sample`. A variable's `attrs` say its `units`,
    `long_name`, `sample_rate_hz`, and whether that rate is a guess, which is a warning; `remarks` of the whole are what
    its reader has to say.

    Parameters
    ----------
    path : path
        The file.
    format : str
        Its format, where it is not to be recognised.

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    DataError
        A file of no known format, or a damaged one.

    Examples
    --------
    >>> import afmid
    >>> _ = open("decay.csv", "w").write("time (ms),u (V)\\n" + "".join(f"{k / 10},{k % 7}\\n" for k in range(50)))
    >>> found = afmid.read("decay.csv")
    >>> found["u"].attrs["units"], found["u"].attrs["sample_rate_hz"], found.sizes["time"]
    ('V', 10000.0, 50)
    """
    found = _native.read(os.fspath(path), format)
    clocks: dict[tuple[Any, ...], str] = {}
    coordinates, variables = {}, {}
    for channel in found["channels"]:
        rate_hz, values = channel["sample_rate_hz"], channel["values"]
        if channel["is_axis"] and any(not other["is_axis"] for other in found["channels"]) and rate_hz is None:
            continue
        start_s = channel["start_s"] or 0.0
        clock = (rate_hz, start_s, len(values), tuple(channel["gaps"]))
        if clock not in clocks:
            kind = "sample" if rate_hz is None else "time"
            number = sum(name.split("_")[0] == kind for name in clocks.values()) + 1
            clocks[clock] = kind if number == 1 else f"{kind}_{number}"
            at = np.arange(len(values))
            attrs = {"units": "1", "long_name": "number of the sample"}
            if rate_hz is not None:
                at, attrs = start_s + at / rate_hz, {"units": "s", "long_name": "time"}
            coordinates[clocks[clock]] = xr.Variable(clocks[clock], at, attrs)
        attrs = {"units": channel["units"], "long_name": channel["long_name"]}
        if rate_hz is not None:
            attrs |= {"sample_rate_hz": rate_hz, "rate_is_guess": channel["rate_is_guess"]}
            attrs |= {"rate_relative_std": channel["rate_relative_std"]}
        if channel["gaps"]:
            attrs["gaps"] = channel["gaps"]
        variables[channel["location"]] = xr.Variable(clocks[clock], values, attrs)
    if any(channel["rate_is_guess"] for channel in found["channels"]):
        artifacts.warn([f"{os.fspath(path)}: {remark}" for remark in found["remarks"]])
    attrs = {"format": found["format"], "started_at": found["started_at"], "remarks": found["remarks"]}
    return xr.Dataset(variables, coordinates, attrs)


def inspect(path: str | os.PathLike[str]) -> dict[str, Any]:
    """What a file holds, and whether it can carry a ringdown: what `afmid inspect --json` says of
    each file.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    dict
        Format, channels with their units, lengths and sample rates in hertz; `error` of a file that cannot be read.

    Raises
    ------
    TypeError
        `path` is none.

    Examples
    --------
    >>> import afmid
    >>> _ = open("notes.txt", "w").write("nothing of interest\\n")
    >>> afmid.inspect("notes.txt")["channels"]
    []
    """
    return dict(json.loads(_native.inspect(os.fspath(path))))
