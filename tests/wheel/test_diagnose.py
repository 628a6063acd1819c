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


def driven(seed, stiffening=0.3, noise=1e-3, samples=3000):
    """Input and output of an oscillator of 80 Hz and Q = 10 at 1 kHz whose stiffness grows by `stiffening` per square of
    its output, by Runge and Kutta's rule under the held input: a random multisine, another for every seed.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(samples) / 1e3
    lines = np.arange(10, 200, 3.7)
    u = 0.03 * np.cos(2 * np.pi * lines[:, None] * time + rng.uniform(0, 2 * np.pi, (len(lines), 1))).sum(axis=0)
    omega, h = 2 * np.pi * 80, 1e-3 / 16
    y, x, v = np.empty(samples), 0.0, 0.0
    for k in range(samples):
        y[k] = x
        f = lambda x, v: omega**2 * (u[k] - x - stiffening * x**3) - 0.1 * omega * v  # noqa: E731, B023
        for _ in range(16):
            a = f(x, v)
            b = f(x + 0.5 * h * v, v + 0.5 * h * a)
            c = f(x + 0.5 * h * (v + 0.5 * h * a), v + 0.5 * h * b)
            d = f(x + h * (v + 0.5 * h * b), v + h * c)
            x, v = x + h * v + h * h / 6 * (a + b + c), v + h / 6 * (a + 2 * b + 2 * c + d)
    return u, y + noise * rng.standard_normal(samples), y


@pytest.mark.parametrize("seed", range(4))
def test_the_extended_model_simulates_an_input_that_it_has_not_seen(seed):
    u, y, _ = driven(seed)
    found = afmid.diagnose(y, u, sample_rate_hz=1e3, remove="none")
    assert list(found.causes.id) == ["duffing"], found.summary()
    linear = afmid.diagnose(y, u, sample_rate_hz=1e3, remove="none", candidates=["offset"])
    fresh, _, truth = driven(seed + 100)
    error, before = (np.std(truth - one.model.simulate(fresh)) for one in (found, linear))
    # the truth moves by 0.3 to 0.5, and the linear model misses a tenth of that; the extended one the parameters'
    # errors, some sqrt(p / N) of the noise of 1e-3
    assert before > 50 * error and error < 3e-4, (before, error)
    assert list(found.model.causes.id) == ["duffing"] and len(linear.model.causes) == 0
    assert found.model.parameters.equals(found.parameters)
    section = found.model.sections.iloc[0]
    assert abs(section.frequency_hz / 80 - 1) < 2e-3 and abs(section.quality_factor / 10 - 1) < 0.02
    assert abs(section.gain - 1) < 0.01


def test_what_was_learnt_from_is_simulated_as_the_diagnosis_did():
    u, y, truth = driven(5)
    found = afmid.diagnose(y, u, sample_rate_hz=1e3, remove="none")
    copy_ = pickle.loads(pickle.dumps(found)).model
    assert np.array_equal(copy_.simulate(u), found.model.simulate(u))
    # the diagnosis fits the state at the first sample, which was rest
    assert np.std(found.simulation["after"].values - found.model.simulate(u)[: found.simulation.sizes["time"]]) < 3e-4
    moved = found.model.simulate(np.zeros(2000), x0=[[0.1, 0.0]])
    assert moved[0] == pytest.approx(0.1) and np.abs(moved[-100:]).max() < 1e-6
    for wrong, what in (
        (lambda: found.model.simulate(samples=3), "has an input"),
        (lambda: found.model.simulate([np.nan, 0.0]), "sample 0"),
        (lambda: found.model.simulate(np.zeros((2, 3))), "shape"),
        (lambda: found.model.simulate(u, x0=[1.0]), "wanted 2"),
        (lambda: found.model.simulate(u, samples=3), "leave one"),
    ):
        with pytest.raises(afmid.DataError, match=what):
            wrong()


def test_a_decays_model_goes_on_without_an_input():
    found = afmid.diagnose(friction(3, 2e-3), sample_rate_hz=RATE_HZ, begin=0)
    whole = friction(3, 2e-3)
    assert np.std(found.model.simulate(samples=4000) - whole) < 1.5e-3
    with pytest.raises(afmid.DataError, match="no input"):
        found.model.simulate(np.zeros(10))
    with pytest.raises(afmid.DataError, match="samples=1000"):
        found.model.simulate()


def test_what_is_unexplained_is_printed_with_the_reason():
    u, y, _ = driven(6)
    found = afmid.diagnose(y, u, sample_rate_hz=1e3, remove="none", candidates="offset")
    lines = found.summary().splitlines()
    assert lines[0] == found.verdict == "unexplained", lines
    assert any(line.startswith("- ") for line in lines) and "<li>" in found._repr_html_()


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
