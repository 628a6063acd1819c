"""Arrays: variables over named axes, as xarray Datasets."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
import xarray as xr

from . import stored

REAL, IMAGINARY = "_real", "_imag"


def read_array(group: h5py.Group) -> xr.Dataset:
    """An array artifact: coordinates, variables with `units` and `long_name`, the artifact's scalars as `attrs`.

    Complex variables, stored as two real ones, are joined. The first variable is the one that viewers plot.

    >>> with h5py.File("a.h5") as file:
    ...     etfe = read_array(file["entry/etfe/etfe"])
    >>> etfe.transfer.dtype, etfe.transfer.dims, etfe.frequency_hz.units
    (dtype('complex128'), ('frequency_hz',), 'Hz')
    """
    layout = stored.layout(group)
    axes = {name: _variable(group, name, (name,)) for name in layout["axes"]}
    variables = {}
    for entry in layout["variables"]:
        name, dims = entry["name"], tuple(entry["dims"])
        read = _complex_variable if entry["kind"] == "complex" else _variable
        variables[name] = read(group, name, dims)
    return xr.Dataset(variables, axes, stored.attributes(group, layout["attributes"]))


def _variable(group: h5py.Group, name: str, dims: tuple[str, ...]) -> xr.Variable:
    data = stored.dataset(group, name)
    return xr.Variable(dims, np.asarray(data[()]), stored.described(data))


def _complex_variable(group: h5py.Group, name: str, dims: tuple[str, ...]) -> xr.Variable:
    real = stored.dataset(group, name + REAL)
    values = np.empty(real.shape, complex)
    # part by part: a product with 1j makes (inf, nan) of (0, inf)
    values.real = real[()]
    values.imag = stored.numbers(group, name + IMAGINARY)
    attrs: dict[str, Any] = stored.described(real)
    attrs["long_name"] = attrs.get("long_name", name).removesuffix(" (real part)")
    return xr.Variable(dims, values, attrs)
