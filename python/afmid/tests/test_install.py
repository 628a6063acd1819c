"""The package installs as a wheel, and works from there."""

import subprocess
import sys
import zipfile
from pathlib import Path

PACKAGE = Path(__file__).parents[1]


def test_the_wheel_holds_the_package_and_reads_a_result(result, tmp_path):
    # without isolation, hatchling is the one of tests/requirements.txt: nothing is downloaded
    make = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    make += ["-w", tmp_path, PACKAGE]
    subprocess.run(make, check=True)
    [wheel] = tmp_path.glob("afmid-*-py3-none-any.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    modules = {f"afmid/{path.name}" for path in (PACKAGE / "src/afmid").iterdir() if path.is_file()}
    assert modules <= names and "afmid/py.typed" in names
    # a wheel of pure Python can be imported as it is
    code = f"import sys; sys.path.insert(0, {str(wheel)!r}); import afmid; "
    code += f"print(afmid.__file__, len(afmid.open({str(result)!r}).modes))"
    found = subprocess.run([sys.executable, "-I", "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert str(wheel) in found.stdout and int(found.stdout.split()[-1]) > 0
