"""`@afmid.cause`: causes in Python beside their twins in the catalogue."""

import pickle
import time
import traceback

import afmid
import numpy as np
import pytest
from test_diagnose import RATE_HZ, driven, friction

STRENGTH = {"k3": afmid.Parameter(unit="1/V^2", low=-10, high=10, trials=(0.003,))}


@afmid.cause(parameters=STRENGTH, next_measurement="drive it at two amplitudes")
def stiffening(x, v, k3):
    """The spring stiffens with the square of its deflection."""
    return -k3 * x**3


@afmid.cause(
    parameters={"c": afmid.Parameter(unit="V", low=0, high=10, trials=(3e-5, 3e-3))},
    next_measurement="let it ring until it stops",
)
def rubbing(x, v, c):
    """Two surfaces rub."""
    return -c * np.tanh(v / (0.2 * c)) if c else 0.0


@afmid.cause(
    parameters={"a": afmid.Parameter(unit="1/V^2", low=-10, high=10, trials=(0.01,))},
    next_measurement="calibrate the sensor statically",
    on="output",
)
def bent(y, a):
    """The sensor bends."""
    return y + a * y**3


def timed(*arguments, **named):
    begin = time.perf_counter()
    found = afmid.diagnose(*arguments, **named)
    return found, time.perf_counter() - begin


def bent_output(seed):
    """A linear oscillator seen by a sensor of y + 0.2 y^3."""
    u, _, y = driven(seed, stiffening=0.0)
    return u, y + 0.2 * y**3 + 1e-3 * np.random.default_rng(seed).standard_normal(len(y))


def cases(seed):
    u, y, _ = driven(seed)
    bent_u, bent_y = bent_output(seed)
    return {
        "duffing": (stiffening, (y, u), {"sample_rate_hz": 1e3, "remove": "none"}),
        "coulomb-friction": (rubbing, (friction(seed, 2e-3),), {"sample_rate_hz": RATE_HZ, "begin": 0}),
        "output-cubic": (bent, (bent_y, bent_u), {"sample_rate_hz": 1e3, "remove": "none"}),
    }


@pytest.mark.parametrize("twin", ["duffing", "coulomb-friction", "output-cubic"])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_cause_in_python_is_found_as_its_twin(twin, seed):
    own, data, how = cases(seed)[twin]
    known, took = timed(*data, **how)
    found, own_took = timed(*data, **how, without=[twin], causes=[own])
    print(f"{twin}, seed {seed}: {own_took:.2f} s in Python, {took:.2f} s in the catalogue: {own_took / took:.1f} times")
    # beside dry friction small laws are found that the simulation of the data has
    assert known.causes.id[0] == twin and list(found.causes.id) == [own.id, *known.causes.id[1:]], found.summary()
    # the same law in other words: rounding, which the steps of the fits end at
    for column in ("rms_before", "rms_after"):
        assert np.allclose(found.gains[column], known.gains[column], rtol=1e-3)
    value, std = found.parameters.value[0], found.parameters["std"][0]
    apart = abs(value - known.parameters.value[0]) / std
    print(f"gains apart by {abs(found.gains.rms_after[0] / known.gains.rms_after[0] - 1):.1e}, values by {apart:.1e} std")
    assert apart < 0.01 and std == pytest.approx(known.parameters["std"][0], rel=0.01)
    assert found.causes.next_measurement[0] == own.about["next_measurement"]
    assert found.parameters.unit[0] == known.parameters.unit[0]


def test_beside_its_twin_it_is_of_one_class():
    own, data, how = cases(3)["duffing"]
    found = afmid.diagnose(*data, **how, causes=[own])
    assert found.verdict == "named" and {"duffing", "stiffening"} <= set(found.causes["class"][0]), found.summary()
    assert afmid.diagnose(*data, **how).causes.id[0] == "duffing", "it is gone afterwards"


def test_its_model_simulates_and_survives_pickling(tmp_path):
    own, data, how = cases(4)["duffing"]
    found = pickle.loads(pickle.dumps(afmid.diagnose(*data, **how, without=["duffing"], causes=[own])))
    fresh, _, truth = driven(104)
    assert np.std(found.model.simulate(fresh) - truth) < 3e-4
    found.report(tmp_path / "a.html")
    assert "stiffening" in (tmp_path / "a.html").read_text(encoding="utf-8")


def test_what_the_function_raises_is_raised():
    @afmid.cause(parameters=STRENGTH, next_measurement="none", on="output")
    def late(y, k3):
        raise KeyError("of its own")

    @afmid.cause(parameters=STRENGTH, next_measurement="none")
    def misspelt(x, v, k3):
        return k3 * y**3  # noqa: F821

    _, data, how = cases(1)["duffing"]
    for own, kind in ((late, KeyError), (misspelt, NameError)):
        with pytest.raises(kind) as raised:
            afmid.diagnose(*data, **how, causes=[own])
        assert any(frame.name == own.__name__ for frame in traceback.extract_tb(raised.value.__traceback__))


@pytest.mark.parametrize(
    "law, what",
    [
        (lambda x, v, k3: k3 * np.cumsum(x), "cumsum"),
        (lambda x, v, k3: k3 * x if x > 0 else 0 * x, "`if`"),
        (lambda x, v, k3: k3 * x[1:], "part of a motion"),
        (lambda x, v, k3: sum(x), "loop"),
        (lambda x, v, k3: "x", "wanted a number"),
    ],
)
def test_a_force_that_is_no_formula_of_its_instant_is_refused(law, what):
    own = afmid.cause(parameters=STRENGTH, next_measurement="none", id="lambda")(law)
    _, data, how = cases(1)["duffing"]
    with pytest.raises(afmid.ConfigError, match=what):
        afmid.diagnose(*data, **how, causes=[own])


def test_formulas_are_what_numpy_computes():
    """Operations that a force may have, through the native module."""
    from afmid import formula

    x, v = np.linspace(-2, 2, 9), np.linspace(1, -1, 9)
    laws = [
        lambda x, v: np.where(x > v, x**3, np.tanh(v / 2)) + np.clip(x, -0.5, 0.7),
        lambda x, v: np.select([x < -1, x > 1], [x + 1, x - 1]) * np.sign(v) - np.abs(x) * v,
        lambda x, v: np.interp(x, [-1, 0, 1.5], [2, 0, 1]) + np.polyval([1.0, 2.0, 3.0], v),
        lambda x, v: np.hypot(x, v) + np.maximum(x, 0) + np.heaviside(v, 0.5) + x % 0.7,
        lambda x, v: np.exp(-(x**2)) * np.sqrt(np.abs(v)) + (x >= 0) * 1.0 + np.arctan2(x, v),
    ]
    for law in laws:
        found = formula.computed(formula.traced(law, []), x, v)
        assert np.allclose(found, law(x, v), rtol=1e-14, atol=1e-14)


def test_what_a_cause_says_of_itself_is_checked():
    with pytest.raises(afmid.ConfigError, match="no parameters"):
        afmid.cause(parameters={}, next_measurement="none")(lambda x, v: x)
    with pytest.raises(afmid.ConfigError, match="finite limits"):
        afmid.cause(parameters={"k": afmid.Parameter()}, next_measurement="none")(lambda x, v, k: x)
    with pytest.raises(afmid.ConfigError, match="wanted k3"):
        afmid.cause(parameters=STRENGTH, next_measurement="none")(lambda x, v, k: x)
    _, data, how = cases(1)["duffing"]
    taken = afmid.cause(parameters=STRENGTH, next_measurement="none", id="duffing")(lambda x, v, k3: k3 * x)
    with pytest.raises(afmid.ConfigError, match="duffing"):
        afmid.diagnose(*data, **how, causes=[taken])
