"""A result file."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import Any

import h5py
import pandas as pd

from . import stored
from .errors import AfmidError, UnknownName
from .format import OpenFile
from .model import Model
from .stage_of_run import Stage


class Result:
    """What a run left behind. Opened by `afmid.open`; nothing but the list of stages is read until it is asked for.

    `r["modes"]` is a stage, `r["modes.roots"]` an artifact, `r.etfe` what stage `etfe` found (`Stage.value`; for `-` in
    an id write `_`).

    >>> import afmid
    >>> with afmid.open("a.h5") as r:
    ...     transfer = r.etfe.transfer
    >>> list(r.stages)[:3], transfer.units
    (['records', 'events', 'ensemble'], '1')
    """

    def __init__(self, path: str | os.PathLike[str], require_seal: bool = True) -> None:
        self.path = Path(path)
        self._file = OpenFile(self.path, require_seal)
        try:
            ids, places = (stored.value(self._pipeline, name) for name in ("stages", "stage_groups"))
        except BaseException:
            self.close()
            raise
        self._stages = {id: Stage(id, place, self._file) for id, place in zip(ids, places)}

    @property
    def _pipeline(self) -> h5py.Group:
        return stored.group(self._file.entry, "pipeline")

    def close(self) -> None:
        """Closes the file; what was read stays.

        >>> import afmid
        >>> r = afmid.open("a.h5")
        >>> r.close()
        """
        self._file.close()

    def __enter__(self) -> Result:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def stages(self) -> Mapping[str, Stage]:
        """The stages by id, each after those that it needs.

        >>> import afmid
        >>> afmid.open("a.h5").stages["etfe"].uses
        'spectrum.etfe'
        """
        return MappingProxyType(self._stages)

    def __getitem__(self, name: str) -> Any:
        id, _, port = name.partition(".")
        if id not in self._stages:
            raise UnknownName("stage", id, self._stages)
        return self._stages[id][port] if port else self._stages[id]

    def __getattr__(self, name: str) -> Any:
        if name == "modes":
            # the property below found none: Python asks here next
            raise UnknownName("table called", "modes", self._tables())
        stages = self.__dict__.get("_stages", {})
        for id in (name, name.replace("_", "-")):
            if id in stages:
                return stages[id].value
        raise UnknownName("stage", name, stages)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(id.replace("-", "_") for id in self._stages)]

    def __contains__(self, id: object) -> bool:
        return id in self._stages

    def __iter__(self) -> Iterator[str]:
        return iter(self._stages)

    @cached_property
    def modes(self) -> pd.DataFrame:
        """The modal table, of the stage `modes` or else of the last one that has one; standard errors are the columns
        with `std` in their names.

        >>> import afmid
        >>> afmid.open("a.h5").modes[["frequency_hz", "frequency_std_hz"]].shape[1]
        2
        """
        have = [stage for stage in self._stages.values() if stage.ports.get("modes") == "table"]
        if not have:
            raise UnknownName("table called", "modes", self._tables())
        named = [stage for stage in have if stage.id == "modes"]
        table: pd.DataFrame = (named or have)[-1]["modes"]
        return table

    def _tables(self) -> list[str]:
        return [
            f"{stage.id}.{name}"
            for stage in self._stages.values()
            for name, shape in stage.ports.items()
            if shape == "table"
        ]

    def model(self, id: str | None = None) -> Model:
        """A state-space model: of stage `id` (or `id.port`); of the last stage that has one by default.

        >>> import afmid
        >>> afmid.open("a.h5").model("half").attributes["set"]
        'identification'
        """
        shape = "state-space model"
        have = {
            f"{stage.id}.{name}": stage
            for stage in self._stages.values()
            for name, found in stage.ports.items()
            if found == shape
        }
        if not have:
            raise AfmidError(f"{self.path} holds no state-space model")
        if id is None:
            wanted = next(reversed(have))
        else:
            wanted = id if "." in id else next((name for name in have if name.startswith(f"{id}.")), id)
        if wanted not in have:
            raise UnknownName("state-space model", wanted, dict.fromkeys(name.partition(".")[0] for name in have))
        model: Model = self[wanted]
        return model

    @cached_property
    def name(self) -> str:
        """The pipeline's name.

        >>> import afmid
        >>> afmid.open("a.h5").name
        'free-lever'
        """
        return str(stored.value(self._pipeline, "name"))

    @cached_property
    def program(self) -> str:
        """The program that wrote it, with its version.

        >>> import afmid
        >>> afmid.open("a.h5").program.split()[0]
        'afmid'
        """
        return str(stored.value(self._pipeline, "program"))

    @cached_property
    def seed(self) -> int:
        """The pipeline's seed.

        >>> import afmid
        >>> afmid.open("a.h5").seed
        1
        """
        return int(stored.value(self._pipeline, "seed"))

    @cached_property
    def config(self) -> str:
        """The config, as it was written.

        >>> import afmid
        >>> 'name = "free-lever"' in afmid.open("a.h5").config
        True
        """
        return str(stored.value(stored.group(self._pipeline, "config"), "data"))

    @cached_property
    def overrides(self) -> list[str]:
        """What `--set` changed.

        >>> import afmid
        >>> all("=" in change for change in afmid.open("a.h5").overrides)
        True
        """
        return list(stored.value(self._pipeline, "overrides"))

    @cached_property
    def run(self) -> dict[str, Any]:
        """When and where: started_at, seconds, host, threads, folder, config_file, and each stage's seconds and whether
        it came from the cache.

        >>> import afmid
        >>> afmid.open("a.h5").run["threads"] > 0
        True
        """
        group = stored.group(self._file.entry, "run")
        found = {name: stored.value(group, name) for name in group}
        found["stage_from_cache"] = [bool(flag) for flag in found.get("stage_from_cache", [])]
        return found

    @cached_property
    def warnings(self) -> list[tuple[str, str]]:
        """All warnings, each with its stage.

        >>> import afmid
        >>> [stage for stage, text in afmid.open("a.h5").warnings if not text]
        []
        """
        return [(stage.id, text) for stage in self._stages.values() for text in stage.warnings]

    @cached_property
    def sources(self) -> pd.DataFrame:
        """Every file that was read: stage, path, size, blake3.

        >>> import afmid
        >>> list(afmid.open("a.h5").sources.columns)
        ['stage', 'path', 'size', 'blake3']
        """
        rows = [(stage.id, of.path, of.size, of.blake3) for stage in self._stages.values() for of in stage.sources]
        return pd.DataFrame(rows, columns=["stage", "path", "size", "blake3"])

    @cached_property
    def provenance(self) -> dict[str, Any]:
        """Where everything comes from, ready for JSON: program, config, seed, and of each stage version, parameters,
        inputs, seed, key, files and warnings.

        >>> import afmid
        >>> afmid.open("a.h5").provenance["stages"]["etfe"]["uses"]
        'spectrum.etfe'
        """
        parts = ("uses", "version", "params", "inputs", "seed", "key", "warnings")
        stages = {
            stage.id: {name: getattr(stage, name) for name in parts} | {"sources": [vars(of) for of in stage.sources]}
            for stage in self._stages.values()
        }
        whole = {name: getattr(self, name) for name in ("name", "program", "seed", "overrides", "config", "run")}
        return whole | {"stages": stages}

    def __repr__(self) -> str:
        state = " (closed)" if self._file.closed else ""
        return f"<afmid.Result {self.path}{state}: {', '.join(self._stages)}>"


def open(path: str | os.PathLike[str], *, require_seal: bool = True) -> Result:
    """Opens a result file of `afmid run`.

    Parameters
    ----------
    path : path
        The file.
    require_seal : bool
        Whether to refuse a file without the line that seals it, as the program does; another program that had it open
        for writing has taken it off.

    Returns
    -------
    Result

    Raises
    ------
    FileNotFoundError
        There is no such file.
    NotAResult
        A file of another kind, or a damaged one.
    OtherFormat
        A result of a format that this reader does not know.

    Examples
    --------
    >>> import afmid
    >>> with afmid.open("a.h5") as r:
    ...     frequencies = r.modes.frequency_hz
    >>> frequencies.is_monotonic_increasing
    True
    """
    return Result(path, require_seal)
