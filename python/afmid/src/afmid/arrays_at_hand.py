"""What a user hands over, as the stages take it: one-dimensional arrays of float64, borrowed where they are that."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .errors import DataError
from .response import Array


def rate(sample_rate_hz: Any) -> float:
    """A sample rate. Errors: `DataError`, none that can be.

    >>> rate(5e6)
    5000000.0
    """
    try:
        found = float(sample_rate_hz)
    except (TypeError, ValueError):
        found = np.nan
    if not (np.isfinite(found) and found > 0):
        raise DataError(f"sample_rate_hz is {sample_rate_hz!r}, wanted a positive number of samples per second")
    return found


def real(values: Any, what: str) -> Array:
    """An array of real numbers, NaN where a masked array is masked. Errors: `DataError`, no numbers, or complex ones.

    >>> real([1, 2], "y").dtype
    dtype('float64')
    >>> real(np.ma.array([1, 2], mask=[False, True]), "y")
    array([ 1., nan])
    """
    found = _unmasked(values)
    if found.dtype == object or not (np.issubdtype(found.dtype, np.number) or found.dtype == bool):
        raise DataError(f"{what} is an array of {found.dtype}, wanted numbers")
    if np.iscomplexobj(found):
        raise DataError(f"{what} is complex, wanted real samples")
    return np.ascontiguousarray(found, dtype=np.float64)


def complex_values(values: Any, what: str) -> Array:
    """An array of complex numbers. Errors: `DataError`, no numbers.

    >>> complex_values([1, 2j], "responses")
    array([1.+0.j, 0.+2.j])
    """
    found = _unmasked(values)
    if found.dtype == object or not np.issubdtype(found.dtype, np.number):
        raise DataError(f"{what} is an array of {found.dtype}, wanted numbers")
    return np.ascontiguousarray(found, dtype=np.complex128)


def _unmasked(values: Any) -> Array:
    if isinstance(values, np.ma.MaskedArray) and np.issubdtype(values.dtype, np.number):
        return np.asarray(np.ma.filled(values.astype(np.result_type(values.dtype, np.float64)), np.nan))
    return np.asarray(values)


CHANNELS = ("channel", "channels", "sensor", "sensors")
HITS = ("hit", "hits", "event", "events", "record", "records")


def labelled(y: Any, axes: str | None) -> tuple[Any, str | None, list[str] | None]:
    """Samples with their labels: samples last, what a first of two axes counts where a name says it, and names of the
    channels. A DataFrame has a channel in every column.

    >>> import pandas as pd
    >>> frame = pd.DataFrame({"tip": [1.0, 2.0, 3.0], "root": [0.0, 1.0, 2.0]})
    >>> values, axes, channels = labelled(frame, None)
    >>> values.shape, axes, channels
    ((2, 3), 'channels', ['tip', 'root'])
    >>> import xarray as xr
    >>> labelled(xr.DataArray(np.zeros((5, 2)), dims=("time", "hit")), None)[:2][1]
    'hits'
    """
    columns = getattr(y, "columns", None)
    if columns is not None and np.ndim(y) == 2:
        return y.to_numpy().T, axes or "channels", [str(name) for name in columns]
    dims = getattr(y, "dims", None)
    if dims is None or not all(isinstance(dim, str) for dim in dims):
        return y, axes, None
    of_channels = [dim for dim in dims if dim in CHANNELS]
    of_hits = [dim for dim in dims if dim in HITS]
    of_samples = [dim for dim in dims if dim not in (*CHANNELS, *HITS)]
    if len(of_samples) != 1 or len(of_channels) > 1 or len(of_hits) > 1:
        return y, axes, None
    channels = None
    if of_channels and of_channels[0] in getattr(y, "coords", {}):
        channels = [str(name) for name in np.asarray(y.coords[of_channels[0]])]
    said = "channels" if of_channels and not of_hits else "hits" if of_hits and not of_channels else None
    return y.transpose(*of_hits, *of_channels, *of_samples).to_numpy(), axes or said, channels


def records(y: Any, axes: str | None) -> list[list[Array]]:
    """Records of channels of samples.

    >>> [len(record) for record in records(np.zeros((3, 100)), "hits")]
    [1, 1, 1]
    >>> [len(record) for record in records(np.zeros((3, 100)), "channels")]
    [3]
    >>> len(records(np.zeros((5, 3, 100)), None))
    5
    """
    if isinstance(y, (list, tuple)) and y and all(np.ndim(part) > 0 for part in y):
        lengths = {np.shape(part)[-1] for part in y}
        if len(lengths) > 1:
            return _unequal(y, axes)
    found = real(y, "y")
    if found.ndim == 2 and 1 in found.shape:
        found = found.ravel()
    if found.ndim == 1:
        return [[found]]
    if found.ndim == 2:
        if axes not in (None, "hits", "channels"):
            raise DataError(f'axes is {axes!r}, wanted "hits" or "channels": what the first axis of y counts')
        if found.shape[0] > found.shape[1]:
            raise DataError(
                f"y has the shape {found.shape}: {found.shape[0]} rows of {found.shape[1]} samples", help="is y.T meant?"
            )
        if axes is None:
            raise DataError(
                f"y has the shape {found.shape}: whether its {found.shape[0]} rows are hits or channels is not said",
                help='give axes="hits" or axes="channels"',
            )
        rows = list(found)
        return [[row] for row in rows] if axes == "hits" else [rows]
    if found.ndim == 3:
        return [list(hit) for hit in found]
    raise DataError(f"y has {found.ndim} axes, wanted samples; hits or channels, samples; or hits, channels, samples")


def recorded(values: Any, what: str) -> list[list[Array]]:
    """Records of the channels of an input or output: (samples,), (channels, samples) or (records, channels, samples); a
    list of (samples,) or (channels, samples) where records have unlike lengths.

    >>> [len(record) for record in recorded(np.zeros((2, 100)), "u")]
    [2]
    >>> [len(record) for record in recorded([np.zeros(100), np.zeros(90)], "u")]
    [1, 1]
    >>> recorded(np.zeros((100, 2)), "u")
    Traceback (most recent call last):
    afmid.errors.DataError: u has the shape (100, 2): 100 channels of 2 samples; is u.T meant?
    """
    if isinstance(values, (list, tuple)) and values and all(np.ndim(part) > 0 for part in values):
        if len({np.shape(part)[-1] for part in values}) > 1:
            parts = [real(part, f"{what}[{k}]") for k, part in enumerate(values)]
            if any(part.ndim > 2 for part in parts):
                raise DataError(f"the records in {what} want one or two axes: samples; channels, samples")
            return [list(np.atleast_2d(part)) for part in parts]
    found = real(labelled(values, None)[0], what)
    if found.ndim == 2 and found.shape[1] == 1:
        found = found.T
    if not 1 <= found.ndim <= 3:
        wanted = "samples; channels, samples; or records, channels, samples"
        raise DataError(f"{what} has {found.ndim} axes, wanted {wanted}")
    if found.size == 0:
        raise DataError(f"{what} has the shape {found.shape}: no samples")
    shaped = found.reshape((1,) * (3 - found.ndim) + found.shape)
    if shaped.shape[1] > shaped.shape[2]:
        problem = f"{what} has the shape {found.shape}: {shaped.shape[1]} channels of {shaped.shape[2]} samples"
        raise DataError(problem, help=f"is {what}.T meant?")
    return [list(record) for record in shaped]


def _unequal(y: Sequence[Any], axes: str | None) -> list[list[Array]]:
    """Hits of unlike length."""
    if axes == "channels":
        raise DataError("the channels in y have unlike lengths, wanted one")
    parts = [real(part, f"y[{k}]") for k, part in enumerate(y)]
    if any(part.ndim > 2 for part in parts):
        raise DataError("the hits in y want one or two axes: samples; channels, samples")
    return [[part] if part.ndim == 1 else list(part) for part in parts]


def names(channels: Sequence[str] | None, units: str | Sequence[str] | None, count: int, what: str) -> list[Any]:
    """A name and a unit for each channel. Errors: `DataError`, more or fewer than there are.

    >>> names(None, "V", 2, "channel")
    [('channel 1', 'V'), ('channel 2', 'V')]
    """
    if channels is None:
        channels = [what] if count == 1 else [f"{what} {k + 1}" for k in range(count)]
    elif isinstance(channels, str):
        channels = [channels]
    of_each = [units or ""] * count if units is None or isinstance(units, str) else list(units)
    for found, of in ((channels, "names"), (of_each, "units")):
        if len(found) != count:
            raise DataError(f"{len(found)} {of} for {count} {what}s")
    return list(zip(map(str, channels), map(str, of_each), strict=True))
