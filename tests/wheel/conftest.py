"""Tests of the installed package, with its native module and its program (tests/wheel/wheel.sh)."""

import subprocess
import sys
from pathlib import Path

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


@pytest.fixture(autouse=True)
def in_a_folder(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
