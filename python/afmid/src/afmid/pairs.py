"""Measured inputs and outputs, as the stages take them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import _native
from .arrays_at_hand import names, rate, recorded
from .errors import DataError


def pair(
    u: Any,
    y: Any,
    *,
    sample_rate_hz: Any,
    remove: str = "mean",
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    input_unit: str = "",
    output_unit: str = "",
) -> tuple[Any, list[str]]:
    """What `io.columns` hands on of these samples, and what it warns of: inputs and outputs in the shapes of
    `arrays_at_hand.recorded`. Errors: `DataError`, as many records of one as of the other are wanted.

    >>> made, said = pair(np.arange(100.0), np.arange(100.0), sample_rate_hz=1e3)
    >>> made.shape, said
    ('array', [])
    """
    of_inputs, of_outputs = recorded(u, "u"), recorded(y, "y")
    if len(of_inputs) != len(of_outputs):
        raise DataError(f"u has {len(of_inputs)} records and y {len(of_outputs)}, wanted as many")
    return _native.pair(
        list(zip(of_inputs, of_outputs, strict=True)),
        names(inputs, input_unit, len(of_inputs[0]), "input"),
        names(outputs, output_unit, len(of_outputs[0]), "output"),
        rate(sample_rate_hz),
        json.dumps({"remove": remove}),
    )


def pair_of_one_output(u: Any, y: Any, *, output: str | None = None, **given: Any) -> tuple[Any, list[str]]:
    """The same of one record with one output. Errors: `DataError`, several.

    >>> pair_of_one_output(np.ones((2, 100)), np.ones((2, 100)), sample_rate_hz=1e3)
    Traceback (most recent call last):
    afmid.errors.DataError: y has the shape (2, 100), wanted one output: (samples,)
    """
    shape = np.shape(y)
    if len(shape) == 2 and shape[1] == 1:
        y = np.asanyarray(y).ravel()
    elif len(shape) != 1:
        raise DataError(f"y has the shape {shape}, wanted one output: (samples,)")
    if np.ndim(u) not in (1, 2):
        raise DataError(f"u has {np.ndim(u)} axes, wanted (samples,) or (inputs, samples)")
    return pair(u, y, outputs=None if output is None else [output], **given)
