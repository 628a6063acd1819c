"""`afmid.diagnose` and `afmid.run`."""

import copy
import json
import pickle

import afmid
import numpy as np
import pytest

RATE_HZ = 5e3


def friction(seed, coulomb):
    """A free oscillator of 100 Hz and Q = 100 with dry friction, by its equation of motion; amplitude 1, noise 1e-3."""
    omega, steps = 2 * np.pi * 100, 8
    h = 1 / RATE_HZ / steps
    x, v, out = 1.0, 0.0, []
    for _ in range(4000):
        out.append(x)
        for _ in range(steps):
            # symplectic: drift, kick, drift
            x += 0.5 * h * v
            v += h * (-(omega**2) * x - omega / 100 * v - coulomb * omega**2 * np.tanh(v / (1e-3 * omega)))
            x += 0.5 * h * v
    return np.array(out) + 1e-3 * np.random.default_rng(seed).standard_normal(4000)


def test_dry_friction_is_named_and_a_linear_decay_is_clean():
    found = afmid.diagnose(friction(1, 2e-3), sample_rate_hz=RATE_HZ, begin=0)
    assert found.verdict == "named" and "coulomb-friction" in set(found.causes.id), found.summary()
    assert (found.gains.rms_after <= found.gains.rms_before).all()
    assert "coulomb" in found.summary() and found._repr_html_().startswith("<p>named")
    clean = afmid.diagnose(friction(1, 0.0), sample_rate_hz=RATE_HZ, begin=0)
    assert clean.verdict == "clean" and len(clean.causes) == 0


def test_the_page_is_written_of_a_copy_too(tmp_path):
    found = afmid.diagnose(friction(2, 2e-3), sample_rate_hz=RATE_HZ, begin=0, output_unit="V")
    assert [axes.get_ylabel() for axes in found.plot().axes] == ["output (V)", "residual (V)"]
    found.report(tmp_path / "a.html")
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert text.startswith("<!") and "coulomb-friction" in text and "<svg" in text
    for number, again in enumerate((pickle.loads(pickle.dumps(found)), copy.deepcopy(found))):
        assert again.verdict == found.verdict and again.causes.equals(found.causes)
        again.report(tmp_path / f"{number}.html")
        assert (tmp_path / f"{number}.html").read_text(encoding="utf-8") == text


def test_a_cause_that_is_none_is_refused():
    with pytest.raises(afmid.DataError, match="no-such-cause"):
        afmid.diagnose(friction(1, 0.0), sample_rate_hz=RATE_HZ, begin=0, candidates=["no-such-cause"])


def test_a_config_runs_with_other_files_and_parameters(tmp_path):
    rng = np.random.default_rng(3)
    u, y = rng.standard_normal(3000), np.zeros(3000)
    for k in range(2, 3000):
        y[k] = 1.6 * y[k - 1] - 0.9 * y[k - 2] + 0.3 * u[k - 1]
    np.savetxt("a.csv", np.column_stack([u, y + 0.01 * rng.standard_normal(3000)]), delimiter=",", header="u,y", comments="")
    config = """[pipeline]
name = "a"

[[stage]]
id = "data"
uses = "io.columns"
params = { file = "a.csv", inputs = ["u"], output = "y", sample_rate_hz = 1e3 }

[[stage]]
id = "model"
uses = "model.pem"
inputs = { pair = "data.pair" }
params = { order = 2 }
"""
    (tmp_path / "a.toml").write_text(config)
    assert afmid.run("a.toml").model("model").order == 2
    again = afmid.run("a.toml", set={"model.order": 4}, output="b.h5")
    assert again.model("model").order == 4 and (tmp_path / "b.h5").is_file()
    with pytest.raises(afmid.ConfigError, match="orde"):
        afmid.run("a.toml", set={"model.orde": 4})
    (tmp_path / "a.csv").unlink()
    with pytest.raises(afmid.DataError, match=r"a\.csv"):
        afmid.run("a.toml")
    assert json.dumps(again["model"].params)
