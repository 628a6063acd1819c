"""Every shipped config: the package and the program store the same numbers, bit for bit, on one thread and on two.

Those that take longest only with `AFMID_ALL_CONFIGS=1`.
"""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import afmid
import h5py
import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
CONFIGS = sorted((ROOT / "configs").glob("*.toml"))
# twenty seconds and more each, twice
LONG = {"beam", "decay", "silverbox", "simulate-paper", "wiener-hammerstein"}


def files_of(config):
    """Paths and patterns of a config's data, of this folder."""
    for stage in tomllib.loads(config.read_text(encoding="utf-8"))["stage"]:
        params = stage.get("params", {})
        named = params.get("files", params.get("file", []))
        yield from ([named] if isinstance(named, str) else named)


def stored(path):
    """What the stages of a result stored, by name: data sets, and attributes that are numbers."""
    found = {}

    def keep(name, item):
        # beside the stages stand when, where and on how many threads it was made
        if name.count("/") < 2 or name.startswith("entry/run/"):
            return
        for key, value in item.attrs.items():
            if np.issubdtype(np.asarray(value).dtype, np.number):
                found[f"{name}@{key}"] = np.asarray(value)
        if isinstance(item, h5py.Dataset):
            found[name] = np.asarray(item[()])

    with h5py.File(path) as file:
        file.visititems(keep)
    return found


@pytest.mark.parametrize("config", CONFIGS, ids=lambda path: path.stem)
def test_program_and_package_store_the_same_bits(config, tmp_path, monkeypatch):
    if any(not list(config.parent.glob(name)) for name in files_of(config)):
        pytest.skip(f"no data of {config.name}")
    if "sweep" in tomllib.loads(config.read_text(encoding="utf-8")):
        pytest.skip(f"{config.name} is for afmid sweep")
    if config.stem in LONG and "AFMID_ALL_CONFIGS" not in os.environ:
        pytest.skip(f"{config.name} takes long")
    program = Path(sys.executable).with_name("afmid")
    environment = {**os.environ, "RAYON_NUM_THREADS": "1"}
    command = [program, "run", config, "-o", tmp_path / "one.h5", "--cache", tmp_path / "one"]
    subprocess.run(command, check=True, capture_output=True, env=environment)
    monkeypatch.setenv("RAYON_NUM_THREADS", "2")
    afmid.run(config, output=tmp_path / "two.h5", cache=tmp_path / "two")
    one, two = stored(tmp_path / "one.h5"), stored(tmp_path / "two.h5")
    assert one.keys() == two.keys() and len(one) > 3
    assert [name for name in one if not same(one[name], two[name])] == []


def same(a, b):
    return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind in "fc")
