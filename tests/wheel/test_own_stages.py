"""`@afmid.stage`: stages that run in the process beside the same as plugins; what `afmid new` writes for Python."""

import importlib.util
import os
import subprocess
import sys
import traceback

import afmid
import numpy as np
import pytest
from afmid import plugin

SCRIPT = '''
import afmid
import numpy as np
from afmid import plugin

CALLED = []


@afmid.stage(
    name="both", version="1", summary="What is done to a pair, in all shapes",
    inputs=[plugin.port("pair", "array", tag="pair")],
    outputs=[plugin.port("squares", "array"), plugin.port("rows", "table"), plugin.port("summary", "document")],
    parameters={"factor": plugin.number(2.0, "what it is multiplied by", minimum=0.0)},
    seeded=True,
)
def both(inputs, parameters, context):
    CALLED.append(parameters)
    u = inputs["pair"]["force"]
    if u.size < 10:
        raise plugin.Refused(f"{u.size} samples, wanted 10", "record longer")
    if parameters["factor"] == 13.0:
        raise ArithmeticError("of thirteen")
    context.warn("a warning")
    draws = np.random.default_rng(context.seed).standard_normal(u.size)
    time = plugin.Axis("time", "s", inputs["pair"]["time"])
    squares = plugin.Variable("squares", "V^2", ["time"], parameters["factor"] * u**2 + draws)
    spectrum = plugin.Variable("spectrum", "V", ["time"], np.fft.fft(u))
    rows = plugin.Table([plugin.Column("value", "V", np.sort(u)[:5]), plugin.Column("name", "", list("abcde"))])
    return {"squares": plugin.Array([time], [squares, spectrum]), "rows": rows, "summary": {"rms": float(np.std(u))}}


if __name__ == "__main__":
    afmid.serve(both)
'''

CONFIG = """[pipeline]
name = "a"
seed = 3

[plugins]
both = "PYTHON both.py"

[[stage]]
id = "data"
uses = "io.columns"
params = { file = "a.csv", inputs = ["u"], output = "y", sample_rate_hz = 1e3 }

[[stage]]
id = "own"
uses = "exec:both"
inputs = { pair = "data.pair" }
params = { factor = 3.5 }
"""


@pytest.fixture
def both(tmp_path, monkeypatch):
    """The stage of the script, its config and data in the working folder."""
    rng = np.random.default_rng(2)
    u = rng.standard_normal((500, 2))
    np.savetxt("a.csv", u, delimiter=",", header="u,y", comments="")
    (tmp_path / "both.py").write_text(SCRIPT)
    (tmp_path / "a.toml").write_text(CONFIG.replace("PYTHON", sys.executable))
    monkeypatch.setenv("AFMID_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("AFMID_TRUST", str(tmp_path / "trust"))
    spec = importlib.util.spec_from_file_location("both", tmp_path / "both.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_in_the_process_and_as_a_plugin_the_numbers_are_the_same(both, afmid_cli, tmp_path):
    here = afmid.run("a.toml", stages=[both.both], output="here.h5")
    assert both.CALLED == [{"factor": 3.5}], "it ran in this process"
    afmid_cli("run", "a.toml", "--allow-plugins", "-o", "there.h5", "--cache", "other", cwd=tmp_path)
    there = afmid.open("there.h5")
    for port in here["own"]:
        one, other = here["own"][port], there["own"][port]
        same = one.identical(other) if port == "squares" else one.equals(other) if port == "rows" else one == other
        assert same, port
    assert here["own"].warnings == there["own"].warnings == ["a warning"]
    assert here["own"].seed == there["own"].seed and here["own"].params == there["own"].params
    # a second run takes it from the cache
    afmid.run("a.toml", stages=[both.both])
    assert len(both.CALLED) == 1
    again = afmid.run("a.toml", stages=[both.both], set={"own.factor": 1.0})
    assert len(both.CALLED) == 2 and not again["own"]["squares"].identical(here["own"]["squares"])


def test_what_a_stage_raises_is_raised_and_what_it_refuses_is_said(both):
    with pytest.raises(ArithmeticError, match="of thirteen") as raised:
        afmid.run("a.toml", stages=[both.both], set={"own.factor": 13.0})
    assert traceback.extract_tb(raised.value.__traceback__)[-1].name == "both"
    with pytest.raises(afmid.ConfigError, match="factor"):
        afmid.run("a.toml", stages=[both.both], set={"own.factor": -1.0})
    np.savetxt("a.csv", np.ones((5, 2)) * np.arange(5)[:, None], delimiter=",", header="u,y", comments="")
    with pytest.raises(afmid.DataError, match="wanted 10"):
        afmid.run("a.toml", stages=[both.both])
    with pytest.raises(afmid.ConfigError, match="afmid.stage"):
        afmid.run("a.toml", stages=[len])


def test_a_stage_that_is_not_handed_over_is_refused(both):
    @afmid.stage(name="other", version="1", summary="another", outputs=[plugin.port("b", "document")])
    def other(inputs, parameters, context):
        return {"b": {}}

    with pytest.raises(afmid.ConfigError, match="exec:both"):
        afmid.run("a.toml", stages=[other])


def test_the_script_of_a_new_cause_finds_it(afmid_cli, tmp_path):
    afmid_cli("new", "cause", "end_stop", "--python", cwd=tmp_path)
    command, folder = [sys.executable, "end_stop.py"], tmp_path / "end_stop"
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("named") and "end-stop" in done.stdout


def test_a_new_stage_runs_in_the_process(afmid_cli, tmp_path, monkeypatch):
    afmid_cli("new", "stage", "end_noise", "--python", cwd=tmp_path)
    monkeypatch.chdir(tmp_path / "end_noise")
    monkeypatch.syspath_prepend(os.getcwd())
    import end_noise

    found = afmid.run("end_noise.toml", stages=[end_noise.end_noise], cache="cache")
    # 0.7 V of mode 1, five decay times later: 4 mV, noise beside it
    assert 2e-3 < found["end_noise"].summary["rms"] < 8e-3
