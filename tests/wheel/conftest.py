"""Tests of the installed package, with its native module and its program (tests/wheel/wheel.sh)."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest


@pytest.fixture(scope="session")
def afmid_cli(tmp_path_factory):
    """Runs the program that the package installs and gives its stdout."""
    program = Path(sys.executable).with_name("afmid")

    def run(*arguments, cwd):
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False, cwd=cwd)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(autouse=True, scope="session")
def fresh_cache(tmp_path_factory):
    """No result of an earlier build with stages of the same versions, whatever is kept on this machine."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AFMID_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(autouse=True)
def in_a_folder(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def by_config(afmid_cli, tmp_path):
    """Runs stages of the program on records of named inputs and outputs from CSV files, and opens the result.
    `stages`: a list of (id, uses, inputs, params), the first of them after `data`, the stage `io.columns`.
    """
    import afmid

    def table(values):
        return "{ " + ", ".join(f"{name} = {json.dumps(value)}" for name, value in values.items()) + " }"

    def run(records, stages, sample_rate_hz):
        files = []
        for number, (inputs, outputs) in enumerate(records):
            columns = {**inputs, **outputs}
            files.append(f"record-{number}.csv")
            header = ",".join(columns)
            rows = np.column_stack(list(columns.values()))
            np.savetxt(tmp_path / files[-1], rows, delimiter=",", header=header, comments="", fmt="%.17g")
        bare = lambda names: [name.split(" (")[0] for name in names]  # noqa: E731
        params = {"inputs": bare(inputs), "outputs": bare(outputs), "sample_rate_hz": sample_rate_hz}
        params |= {"files": files} if len(files) > 1 else {"file": files[0]}
        lines = ["[pipeline]", 'name = "a"']
        for id, uses, wires, given in [("data", "io.columns", {}, params), *stages]:
            lines += ["", "[[stage]]", f'id = "{id}"', f'uses = "{uses}"']
            lines += [f"inputs = {table(wires)}", f"params = {table(given)}"]
        (tmp_path / "by_config.toml").write_text("\n".join(lines) + "\n")
        afmid_cli("run", "by_config.toml", "-o", "by_config.h5", cwd=tmp_path)
        return afmid.open(tmp_path / "by_config.h5")

    return run


@pytest.fixture
def same_array():
    """Asserts that a Dataset holds all of what the program stored, bit for bit."""

    def check(found, stored):
        for name, variable in stored.variables.items():
            other = found[name]
            if np.issubdtype(other.dtype, np.number):
                assert np.array_equal(other.values, variable.values, equal_nan=True), name
                assert other.attrs.get("units") == variable.attrs.get("units"), name
        assert found.attrs == stored.attrs

    return check
