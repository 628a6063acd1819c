"""What a stage hands on, as pandas, xarray and plain Python have it."""

from __future__ import annotations

import json
import warnings
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from . import _native
from .errors import AfmidWarning


def run_stage(name: str, inputs: dict[str, Any], seed: int = 1, **params: Any) -> tuple[dict[str, Any], list[str]]:
    """Runs a stage; its artifacts by port, and its warnings. `None` stands for a parameter's default."""
    given = {name: value for name, value in params.items() if value is not None}
    outputs, said = _native.run_stage(name, inputs, json.dumps(given, default=_plain), seed)
    return dict(outputs), list(said)


def warn(said: list[str]) -> None:
    """Says what a stage warned of, at the line that called the package."""
    for text in said:
        warnings.warn(text, AfmidWarning, stacklevel=3)


def table(artifact: Any) -> pd.DataFrame:
    """A table as a DataFrame; `attrs["units"]` and `attrs["long_name"]` say what each column holds."""
    content = artifact.content()
    columns = content["columns"]
    frame = pd.DataFrame({column["name"]: column["values"] for column in columns})
    frame.attrs = {
        "units": {column["name"]: column["units"] for column in columns},
        "long_name": {column["name"]: column["long_name"] for column in columns},
        "attributes": content["attributes"],
    }
    return frame


def array(artifact: Any) -> xr.Dataset:
    """An array as a Dataset: coordinates, variables with `units` and `long_name`, the artifact's scalars as `attrs`."""
    content = artifact.content()
    axes = {axis["name"]: _variable(axis) for axis in content["axes"]}
    return xr.Dataset({part["name"]: _variable(part) for part in content["variables"]}, axes, content["attributes"])


def document(artifact: Any) -> Any:
    """A document as Python has JSON."""
    return json.loads(artifact.content()["json"])


def _variable(part: dict[str, Any]) -> xr.Variable:
    attrs = {"units": part["units"], "long_name": part["long_name"]}
    return xr.Variable(part["dims"], part["values"], attrs)


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"a parameter is {value!r}, wanted a number, a text, or a list of these")
