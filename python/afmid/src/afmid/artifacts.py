"""What a stage hands on, as pandas, xarray and plain Python have it."""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from . import _native
from .errors import AfmidWarning
from .response import Array


def run_stage(
    name: str, inputs: dict[str, Any], seed: int = 1, causes: Sequence[Any] = (), **params: Any
) -> tuple[dict[str, Any], list[str]]:
    """Runs a stage; its artifacts by port, and its warnings. `None` stands for a parameter's default; `causes`: further
    ones for a diagnosis, as the native module has them.
    """
    outputs, said = _native.run_stage(name, inputs, as_json(params), seed, causes=list(causes))
    return dict(outputs), list(said)


def as_json(params: dict[str, Any]) -> str:
    """Parameters as the native module takes them; `None` stands for a parameter's default.

    >>> as_json({"band_hz": (1, np.float64(2)), "modes": None})
    '{"band_hz": [1, 2.0]}'
    """
    return json.dumps({name: value for name, value in params.items() if value is not None}, default=_plain)


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


def of_array(found: xr.Dataset, names: Sequence[str]) -> Any:
    """The artifact that a Dataset is from, of those of its variables that have these names. An axis of texts is
    numbered.
    """
    variables = {name: found[name].variable for name in names if name in found}
    dims = list(dict.fromkeys(str(dim) for of in variables.values() for dim in of.dims))
    content = {
        "axes": [_part(dim, found[dim].variable, _coordinates(found[dim].variable)) for dim in dims],
        "variables": [_part(name, of, np.ravel(of.values)) for name, of in variables.items()],
        "attributes": {str(name): _scalar(value) for name, value in found.attrs.items()},
    }
    return _native.artifact("array", content)


def _part(name: str, of: xr.Variable, values: Array) -> dict[str, Any]:
    described = {key: str(of.attrs.get(key, "")) for key in ("units", "long_name")}
    return {"name": name, **described, "dims": [str(dim) for dim in of.dims], "values": values}


def _coordinates(axis: xr.Variable) -> Array:
    numbers = np.issubdtype(axis.dtype, np.number)
    return np.asarray(axis.values, dtype=np.float64) if numbers else np.arange(1.0, len(axis) + 1)


def _scalar(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


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
