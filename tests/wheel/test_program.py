"""The program that the package installs: exit codes, signals, plugins, start-up; and the readers."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import afmid
import numpy as np
import pytest

PROGRAM = Path(sys.executable).with_name("afmid")


def test_exit_codes_are_the_program_s():
    run = lambda *arguments: subprocess.run([PROGRAM, *arguments], capture_output=True, text=True)  # noqa: E731
    assert run("--version").stdout.startswith("afmid ")
    assert run("stages").returncode == 0
    assert run("no-such-command").returncode == 2
    missing = run("run", "none.toml")
    assert missing.returncode == 2 and "none.toml" in missing.stderr
    module = subprocess.run([sys.executable, "-m", "afmid", "--version"], capture_output=True, text=True)
    assert module.stdout == run("--version").stdout


@pytest.mark.skipif(sys.platform == "win32", reason="no signals")
def test_a_signal_ends_a_run_as_it_ends_the_program(tmp_path):
    rng = np.random.default_rng(1)
    rows = np.column_stack([rng.standard_normal(200_000), np.cumsum(rng.standard_normal(200_000))])
    np.savetxt("a.csv", rows, delimiter=",", header="u,y", comments="", fmt="%.6g")
    (tmp_path / "a.toml").write_text(
        '[pipeline]\nname = "a"\n\n[[stage]]\nid = "data"\nuses = "io.columns"\n'
        'params = { file = "a.csv", inputs = ["u"], output = "y", sample_rate_hz = 1e3 }\n\n'
        '[[stage]]\nid = "model"\nuses = "model.pem"\ninputs = { pair = "data.pair" }\n'
        'params = { order = 30, noise = "free", max_iterations = 10000 }\n'
    )
    command = [PROGRAM, "run", "a.toml", "-o", "a.h5", "--cache", "cache"]
    run = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    # the stage before the long one is done: the run is under way, and not near its end
    while "data" not in (run.stderr.readline() or "data"):
        pass
    assert run.poll() is None
    run.send_signal(signal.SIGINT)
    run.communicate(timeout=30)
    assert run.returncode == 130
    # nothing half-written: if the first stage's result was handed over before the signal, it is kept and opens
    left = [path.name for path in tmp_path.glob("*.h5")]
    assert left in ([], ["a.failed.h5"]) and not list(tmp_path.glob(".*.tmp"))
    assert not left or list(afmid.open("a.failed.h5").stages) == ["data"]


def test_a_recording_is_read_with_its_clock():
    time_ms = np.arange(200) / 10
    u = np.sin(time_ms)
    Path("a.csv").write_text("t (ms);u (mV)\n" + "".join(f"{t:.1f};{v:.9f}\n" for t, v in zip(time_ms, u, strict=True)))
    found = afmid.read("a.csv")
    assert found["u"].attrs["units"] == "mV" and found["u"].attrs["sample_rate_hz"] == pytest.approx(1e4)
    assert np.allclose(found["u"], u, atol=1e-9) and np.allclose(found.time, time_ms / 1e3)
    shown = subprocess.run([PROGRAM, "inspect", "a.csv", "--json"], capture_output=True, text=True, check=True).stdout
    assert afmid.inspect("a.csv") == json.loads(shown)["files"][0]
    with pytest.raises(afmid.DataError, match=r"none\.csv"):
        afmid.read("none.csv")


def test_importing_is_quick_and_imports_nothing_else():
    code = "import sys; had = {*sys.modules, '__future__'}; import afmid; print(sorted({*sys.modules} - had))"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said == "['afmid']\n"


def test_every_name_is_there_and_documented():
    for name in afmid.__all__:
        assert getattr(afmid, name).__doc__, name
    with pytest.raises(AttributeError, match="no attribute"):
        afmid.no_such_name  # noqa: B018
