"""How values lie in HDF5: text, flags, lists, JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from .errors import Damaged

LAYOUT = "afmid_layout"


def plain(value: Any) -> Any:
    """An attribute or scalar as Python has it.

    >>> plain(np.int64(3)), plain(b"V"), plain(np.array([b"a"], dtype=object))
    (3, 'V', ['a'])
    """
    if isinstance(value, bytes):
        return value.decode()
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, np.ndarray):
        return [plain(item) for item in value]
    return value


def group(parent: h5py.Group, name: str) -> h5py.Group:
    """The group of this name. Errors: `Damaged`.

    >>> with h5py.File("a.h5") as file:
    ...     group(file, "entry").name
    '/entry'
    """
    found = parent.get(name)
    if not isinstance(found, h5py.Group):
        raise Damaged(f"{parent.file.filename}: the group {parent.name.rstrip('/')}/{name} is missing")
    return found


def dataset(parent: h5py.Group, name: str) -> h5py.Dataset:
    """The dataset of this name. Errors: `Damaged`.

    >>> with h5py.File("a.h5") as file:
    ...     dataset(file["entry"], "title").shape
    ()
    """
    found = parent.get(name)
    if not isinstance(found, h5py.Dataset):
        raise Damaged(f"{parent.file.filename}: the dataset {parent.name.rstrip('/')}/{name} is missing")
    return found


def value(parent: h5py.Group, name: str) -> Any:
    """A stored scalar or list of text.

    >>> with h5py.File("a.h5") as file:
    ...     value(file["entry"], "title")
    'free-lever'
    """
    return plain(dataset(parent, name)[()])


def numbers(parent: h5py.Group, name: str) -> np.ndarray[Any, np.dtype[Any]]:
    """All values of a dataset of numbers.

    >>> with h5py.File("a.h5") as file:
    ...     numbers(file["entry/etfe/etfe"], "frequency_hz")[0]
    np.float64(0.0)
    """
    return np.asarray(dataset(parent, name)[()])


def parsed(owner: h5py.Group, text: Any, what: str) -> Any:
    """JSON that afmid stored. Errors: `Damaged`.

    >>> parsed(None, '{"a": null}', "params")
    {'a': None}
    """
    try:
        return json.loads(text)
    except (TypeError, ValueError) as error:
        raise Damaged(f"{owner.file.filename}: {owner.name}: the {what} is not JSON: {error}") from error


def layout(owner: h5py.Group) -> dict[str, Any]:
    """What HDF5 alone does not say about an artifact: the order of its parts, and their kinds.

    >>> with h5py.File("a.h5") as file:
    ...     layout(file["entry/etfe/etfe"])["axes"]
    ['frequency_hz']
    """
    found = parsed(owner, plain(owner.attrs.get(LAYOUT)), "layout")
    if not isinstance(found, dict):
        raise Damaged(f"{owner.file.filename}: {owner.name}: the layout is no object")
    return found


def attributes(owner: h5py.Group, stored: list[Mapping[str, str]]) -> dict[str, Any]:
    """The scalars that describe an artifact; `stored` is the list `attributes` of its layout.

    >>> with h5py.File("a.h5") as file:
    ...     etfe = file["entry/etfe/etfe"]
    ...     attributes(etfe, layout(etfe)["attributes"])["differenced"]
    True
    """
    found: dict[str, Any] = {}
    for entry in stored:
        place = entry.get("stored_as") or entry["name"]
        if place not in owner.attrs:
            raise Damaged(f"{owner.file.filename}: {owner.name}: the attribute {place} is missing")
        scalar = plain(owner.attrs[place])
        found[entry["name"]] = bool(scalar) if entry["kind"] == "flag" else scalar
    return found


def described(data: h5py.Dataset) -> dict[str, str]:
    """Unit and meaning of a dataset.

    >>> with h5py.File("a.h5") as file:
    ...     described(file["entry/etfe/etfe/frequency_hz"])
    {'units': 'Hz', 'long_name': 'frequency'}
    """
    return {name: plain(data.attrs[name]) for name in ("units", "long_name") if name in data.attrs}
