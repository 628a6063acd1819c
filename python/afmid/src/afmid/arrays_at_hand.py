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
    found = float(sample_rate_hz)
    if not (np.isfinite(found) and found > 0):
        raise DataError(f"sample_rate_hz is {found}, wanted a positive number of samples per second")
    return found


def real(values: Any, what: str) -> Array:
    """An array of real numbers. Errors: `DataError`, no numbers, or complex ones.

    >>> real([1, 2], "y").dtype
    dtype('float64')
    """
    found = np.asarray(values)
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
    found = np.asarray(values)
    if found.dtype == object or not np.issubdtype(found.dtype, np.number):
        raise DataError(f"{what} is an array of {found.dtype}, wanted numbers")
    return np.ascontiguousarray(found, dtype=np.complex128)


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
    if found.ndim == 1:
        return [[found]]
    if found.ndim == 2:
        if axes not in (None, "hits", "channels"):
            raise DataError(f'axes is {axes!r}, wanted "hits" or "channels": what the first axis of y counts')
        if axes is None:
            raise DataError(
                f"y has the shape {found.shape}: whether its {found.shape[0]} rows are hits or channels is not said",
                help='give axes="hits" or axes="channels"',
            )
        if found.shape[0] > found.shape[1]:
            raise DataError(
                f"y has the shape {found.shape}: {found.shape[0]} rows of {found.shape[1]} samples", help="is y.T meant?"
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
    found = real(values, what)
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
    if len(channels) != count or len(of_each) != count:
        raise DataError(f"{len(channels)} names and {len(of_each)} units for {count} channels")
    return list(zip(map(str, channels), map(str, of_each), strict=True))
