"""Types: what `py.typed` promises holds for the installed package, its native module, and programs that use it."""

import subprocess
import sys

# of the packages that are needed only h5py and control have no types
CONFIG = """
[mypy]
strict = true
[mypy-h5py.*,control.*,scipy.*]
ignore_missing_imports = true
# one file that plugins of other programs copy: it has no types
[mypy-afmid.plugin]
ignore_errors = true
"""
# numpy's types are not read again: names and signatures are compared, not what they return
SIGNATURES = """
[mypy]
follow_imports = skip
"""
PROGRAM = """
from typing_extensions import assert_type

import afmid
import numpy as np
import pandas as pd
import xarray as xr

y = np.zeros(4000)
decay = afmid.ringdown(y, sample_rate_hz=1e4, units="m/s")
assert_type(decay, afmid.Ringdown)
assert_type(decay.modes, pd.DataFrame)
assert_type(decay.shapes, xr.Dataset)
assert_type(decay.warnings, tuple[str, ...])
assert_type(decay.summary(), str)
assert_type(afmid.pem(y, y, sample_rate_hz=1e4, order=11).order, int)
assert_type(afmid.frf_modes(afmid.frf(y, y, sample_rate_hz=1e4)).mac(), pd.DataFrame)
afmid.ringdown(y)  # no rate
afmid.ringdwn(y)  # no such name
decay.modse  # no such name
"""


def mypy(folder, config, *arguments):
    (folder / "mypy.ini").write_text(config)
    command = [sys.executable, "-m", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_strict_mypy_finds_nothing_in_the_package_and_three_errors_in_a_program(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    # in one run: reading the types of NumPy, pandas and xarray is most of it
    command = ["mypy", "--config-file", "mypy.ini", "-p", "afmid", "-m", "program"]
    said = mypy(tmp_path, CONFIG, *command).stdout
    lines = PROGRAM.splitlines()
    wrong = [number for number, line in enumerate(lines, 1) if "# no " in line]
    found = [line for line in said.splitlines() if ": error: " in line]
    assert [line.split(":")[:2] for line in found] == [["program.py", str(number)] for number in wrong], said


def test_the_native_module_has_the_names_and_signatures_of_its_stub(tmp_path):
    command = ["mypy.stubtest", "--mypy-config-file", "mypy.ini", "afmid._native"]
    done = mypy(tmp_path, SIGNATURES, *command)
    assert done.returncode == 0, done.stdout + done.stderr
