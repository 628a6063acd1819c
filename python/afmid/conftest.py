"""A result file for tests and examples: AFMID_RESULT, written by the program AFMID from a free-lever config
(tests/commands/python_reader.rs makes both).
"""

import importlib.util
import json
import os
import subprocess
from pathlib import Path

import pytest

# without the native module the package reads results, and no more
NATIVE = (
    *("_program", "__main__", "artifacts", "decays", "densities", "diagnosed_model", "diagnoses", "formula", "identification"),
    *("own_causes", "own_stages", "pairs", "rational", "reading", "response_modes", "responses", "running", "smoothed", "thermal"),
)
collect_ignore_glob = (
    [*(f"src/afmid/{name}.py" for name in NATIVE), "src/afmid/__init__.py"]
    if importlib.util.find_spec("afmid._native") is None
    else []
)


def needed(name):
    value = os.environ.get(name)
    if value is None or not Path(value).is_file():
        pytest.fail(f"{name} is {value!r}, wanted a file: `make test` sets it; by hand see python/afmid/README.md")
    return Path(value).resolve()


@pytest.fixture(scope="session")
def program():
    """The program afmid."""
    return needed("AFMID")


@pytest.fixture(scope="session")
def result():
    """A result of configs/free-lever.toml."""
    return needed("AFMID_RESULT")


@pytest.fixture(scope="session")
def afmid_cli(program):
    """Runs afmid and gives its stdout."""

    def run(*arguments):
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="session")
def show(afmid_cli, result):
    """`afmid show RESULT ID --json`, parsed."""
    return lambda id: json.loads(afmid_cli("show", result, id, "--json"))


@pytest.fixture(autouse=True)
def in_a_folder_with_a_result(request, monkeypatch, tmp_path_factory):
    """Examples open `a.h5` of the working directory."""
    if isinstance(request.node, pytest.DoctestItem):
        folder = tmp_path_factory.getbasetemp() / "examples"
        folder.mkdir(exist_ok=True)
        if not (folder / "a.h5").exists():
            (folder / "a.h5").symlink_to(needed("AFMID_RESULT"))
        monkeypatch.chdir(folder)
