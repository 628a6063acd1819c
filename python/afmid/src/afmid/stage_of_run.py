"""A stage of a run: what it was given, and what it found."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import h5py

from . import stored
from .array import read_array
from .document import read_document
from .errors import Damaged, UnknownName
from .format import OpenFile
from .model import read_model
from .recording import read_recording
from .table import read_table

READERS: dict[str, Callable[[h5py.Group], Any]] = {
    "array": read_array,
    "table": read_table,
    "state-space model": read_model,
    "document": read_document,
    "recording": read_recording,
}


@dataclass(frozen=True)
class Source:
    """A file that a stage read.

    >>> Source("a/b.h5", 12, "00ff").path
    'a/b.h5'
    """

    path: str
    """Where it lay, relative to the config."""
    size: int
    """In bytes."""
    blake3: str
    """BLAKE3 hash of its bytes, in hexadecimal."""


class Stage(Mapping[str, Any]):
    """A stage; a mapping from its ports to its artifacts, each read when it is asked for and kept.

    >>> import afmid
    >>> stage = afmid.open("a.h5")["modes"]
    >>> stage.uses, list(stage), len(stage["roots"]) > 4
    ('model.modes', ['modes', 'roots', 'response', 'summary'], True)
    """

    def __init__(self, id: str, place: str, file: OpenFile) -> None:
        self.id = id
        """Its name in the config."""
        self._place = place
        self._file = file
        self._read: dict[str, Any] = {}

    @property
    def _group(self) -> h5py.Group:
        return stored.group(self._file.entry, self._place)

    @property
    def _provenance(self) -> h5py.Group:
        return stored.group(self._group, "provenance")

    @cached_property
    def _ports(self) -> dict[str, tuple[str, str]]:
        group = self._group
        listed = stored.parsed(group, stored.plain(group.attrs.get("afmid_ports")), "list of ports")
        return {port["name"]: (port["shape"], port["group"]) for port in listed}

    @property
    def ports(self) -> dict[str, str]:
        """Its artifacts and their shapes, in order.

        >>> import afmid
        >>> afmid.open("a.h5")["modes"].ports["roots"]
        'table'
        """
        return {name: shape for name, (shape, _) in self._ports.items()}

    def __getitem__(self, port: str) -> Any:
        if port not in self._read:
            if port not in self._ports:
                raise UnknownName(f"artifact of stage `{self.id}` called", port, self._ports)
            shape, place = self._ports[port]
            if shape not in READERS:
                raise Damaged(f"stage `{self.id}`: an artifact of unknown shape `{shape}`")
            self._read[port] = READERS[shape](stored.group(self._group, place))
        return self._read[port]

    def __iter__(self) -> Iterator[str]:
        return iter(self._ports)

    def __len__(self) -> int:
        return len(self._ports)

    # artifacts are compared by code that knows what they are; a stage is itself
    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        return self is other

    @property
    def value(self) -> Any:
        """Its first artifact that is no document, or else its first.

        >>> import afmid
        >>> type(afmid.open("a.h5")["etfe"].value).__name__
        'Dataset'
        """
        names = [name for name, shape in self.ports.items() if shape != "document"] or list(self._ports)
        if not names:
            raise UnknownName("artifact of stage", self.id, [])
        return self[names[0]]

    @property
    def summary(self) -> Any:
        """What `afmid show RESULT ID --json` prints where the stage has a summary; otherwise an `UnknownName` error.

        >>> import afmid
        >>> afmid.open("a.h5")["model"].summary["order"]
        11
        """
        return self["summary"]

    @cached_property
    def uses(self) -> str:
        """The stage's name in the registry.

        >>> import afmid
        >>> afmid.open("a.h5")["etfe"].uses
        'spectrum.etfe'
        """
        return str(stored.value(self._provenance, "uses"))

    @cached_property
    def version(self) -> int:
        """The stage's own version.

        >>> import afmid
        >>> afmid.open("a.h5")["etfe"].version > 0
        True
        """
        return int(stored.value(self._provenance, "stage_version"))

    @cached_property
    def params(self) -> dict[str, Any]:
        """All its parameters, defaults included.

        >>> import afmid
        >>> afmid.open("a.h5")["model"].params["order"]
        11
        """
        group = self._provenance
        return dict(stored.parsed(group, stored.value(group, "params"), "list of parameters"))

    @cached_property
    def inputs(self) -> dict[str, str]:
        """Its wires: port to `stage.port`.

        >>> import afmid
        >>> afmid.open("a.h5")["modes"].inputs["half"]
        'half.model'
        """
        ports, stages, outputs = (
            stored.value(self._provenance, f"input_{part}") for part in ("port", "stage", "output")
        )
        return {port: f"{stage}.{output}" for port, stage, output in zip(ports, stages, outputs)}

    @cached_property
    def seed(self) -> int | None:
        """The seed of its random numbers; None if it has none.

        >>> import afmid
        >>> afmid.open("a.h5")["etfe"].seed is None
        True
        """
        return int(stored.value(self._provenance, "seed")) if "seed" in self._provenance else None

    @cached_property
    def key(self) -> str:
        """The content address of its result.

        >>> import afmid
        >>> len(afmid.open("a.h5")["etfe"].key)
        64
        """
        return str(stored.value(self._provenance, "key"))

    @cached_property
    def sources(self) -> list[Source]:
        """The files that it read itself.

        >>> import afmid
        >>> len(afmid.open("a.h5")["records"].sources[0].blake3)
        64
        """
        group = self._provenance
        columns = (
            stored.value(group, "source_path"),
            stored.numbers(group, "source_size"),
            stored.value(group, "source_blake3"),
        )
        return [Source(path, int(size), blake3) for path, size, blake3 in zip(*columns)]

    @cached_property
    def warnings(self) -> list[str]:
        """What it warned of.

        >>> import afmid
        >>> afmid.open("a.h5")["etfe"].warnings
        []
        """
        return list(stored.value(self._provenance, "warnings"))

    def __repr__(self) -> str:
        ports = ", ".join(f"{name} ({shape})" for name, shape in self.ports.items())
        return f"<afmid.Stage {self.id}: {self.uses}; {ports}>"
