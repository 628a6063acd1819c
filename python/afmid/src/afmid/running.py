"""Configs of the program, run from Python."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from . import _native
from .errors import ConfigError, DataError
from .own_stages import served
from .result import Result
from .result import open as open_result

_USAGE = 2
"""The program's exit code for what cannot be run; 1 is for what failed."""


def run(
    config: str | os.PathLike[str],
    *,
    files: Sequence[str | os.PathLike[str]] | None = None,
    set: Mapping[str, Any] | None = None,
    output: str | os.PathLike[str] | None = None,
    cache: str | os.PathLike[str] | None = None,
    progress: bool = False,
    stages: Sequence[Any] = (),
) -> Result:
    """Runs a config as `afmid run` does, in a process of its own, and opens its result. With stages of one's own it runs
    in this process.

    Parameters
    ----------
    config : path
        The config.
    files : sequence of path, optional
        Files of its loading stage, instead of those that it names.
    set : mapping, optional
        Other values of parameters: `{"model.order": 9}`.
    output : path, optional
        Where the result is written. Where it is not said, a temporary file that lives as long as the result.
    cache : path, optional
        The folder of the cache; the program's own by default.
    progress : bool
        Whether what the program says is shown while it runs; without `stages`.
    stages : sequence of stages
        What `exec:NAME` is in the config: functions that `afmid.stage` made stages of, or those of a plugin's script.
        They run in this process and see its variables; no plugin is started. The numbers are those that `afmid run`
        gets from the same stage as a plugin.

    Returns
    -------
    Result

    Raises
    ------
    ConfigError
        A config that cannot be run, in the program's words.
    DataError
        A stage that failed.
    Exception
        What one of the `stages` raised.

    Examples
    --------
    >>> import afmid
    >>> _ = open("a.toml", "w").write('[pipeline]\\nname = "a"\\n\\n[[stage]]\\nid = "data"\\nuses = "io.column"\\n')
    >>> afmid.run("a.toml")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    afmid.errors.ConfigError: ...io.column...
    """
    # a result that nobody named lives as long as its reader
    kept = tempfile.TemporaryDirectory(prefix="afmid-") if output is None else None
    place = Path(kept.name) / "result.h5" if kept is not None else Path(os.fspath(output or ""))
    values = dict(set or {})
    if files is not None:
        values[f"{_loading_stage(Path(config))}.files"] = [os.path.abspath(file) for file in files]
    said = [f"{name}={json.dumps(value)}" for name, value in values.items()]
    if stages:
        own = [served(stage) for stage in stages]
        _native.run_config(os.fspath(config), said, str(place), None if cache is None else os.fspath(cache), own)
        return _opened(place, kept)
    command = [sys.executable, "-m", "afmid", "run", os.fspath(config), "-o", os.fspath(place)]
    for one in said:
        command += ["--set", one]
    if cache is not None:
        command += ["--cache", os.fspath(cache)]
    heard = []
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as running:
        for line in running.stderr or ():
            heard.append(line)
            if progress:
                print(line, end="", file=sys.stderr, flush=True)
    if running.returncode != 0:
        kind = ConfigError if running.returncode == _USAGE else DataError
        raise kind("".join(heard).strip() or f"afmid run ended with {running.returncode}")
    return _opened(place, kept)


def _opened(place: Path, kept: tempfile.TemporaryDirectory[str] | None) -> Result:
    result = open_result(place)
    if kept is not None:
        weakref.finalize(result, kept.cleanup)
    return result


def _loading_stage(config: Path) -> str:
    """The id of the one stage that reads files. Errors: `ConfigError`, there is none, or there are several."""
    stages = _native.stages_of(config.read_text(encoding="utf-8"))
    ids = [name for name, uses in stages if uses in ("io.records", "io.columns", "io.frf")]
    if len(ids) != 1:
        raise ConfigError(f"{len(ids)} stages read files, wanted one", str(config), 'give set={"STAGE.files": [...]}')
    return ids[0]
