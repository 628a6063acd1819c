"""`afmid.frf` against known truth, and against the program on the same samples."""

import copy
import inspect
import json
import pickle
from contextlib import nullcontext

import afmid
import numpy as np
import pytest
from afmid import _native
from scipy.signal import lfilter

RATE_HZ = 1e3
# 90.7 Hz, damping 9.2 %
B, A = [0.0, 0.3], [1.0, -1.6, 0.9]


def driven(seed, samples=20_000, std=0.1):
    rng = np.random.default_rng(seed)
    u = rng.standard_normal(samples)
    return u, lfilter(B, A, u) + std * rng.standard_normal(samples)


def truth(frequency_hz):
    z = np.exp(-2j * np.pi * np.asarray(frequency_hz) / RATE_HZ)
    return np.polyval(B[::-1], z) / np.polyval(A[::-1], z)


def struck(seed, hits=4, samples=2000):
    """Pulses of 4 ms and what rings after them at two sensors, in a row."""
    rng = np.random.default_rng(seed)
    u = np.zeros(hits * samples)
    for hit in range(hits):
        u[hit * samples + 100 : hit * samples + 104] = (1 + 0.1 * hit) * np.sin(np.pi * (np.arange(4) + 0.5) / 4)
    y = [lfilter(b, [1.0, -1.95, 0.98], u) + 1e-3 * rng.standard_normal(len(u)) for b in ([0.0, 1.0], [0.0, 0.6, -0.5])]
    return u, np.array(y)


def test_squared_errors_are_those_that_are_stated():
    off = []
    for seed in range(10):
        found = afmid.frf(*driven(seed), sample_rate_hz=RATE_HZ, block_samples=1000, quantity="transfer")
        one = found.response.isel(response=0)
        off.append(np.abs(one["frf"].values - truth(one.frequency_hz)) ** 2 / one["variance"].values)
        assert np.allclose(one["std"].values ** 2, one["variance"].values)
    # 10 records of some 150 independent bins each; leakage of a resonance 18 bins wide is a few per cent of it
    assert 0.8 < np.mean(off) < 1.3


@pytest.mark.parametrize(
    "params",
    [
        {},
        {"block_samples": 512, "estimator": "hv", "band_hz": [20.0, 300.0], "quantity": "mobility"},
        {"excited_share": 0.1, "estimator": "h2"},
    ],
)
def test_the_same_numbers_as_the_program_bit_for_bit(by_config, same_array, params):
    u, y = driven(3)
    records = [({"u": u}, {"y": y})]
    stored = by_config(records, [("frf", "spectrum.measured_frf", {"pair": "data.pair"}, params)], RATE_HZ)["frf"]
    with pytest.warns(afmid.AfmidWarning) if "quantity" not in params else nullcontext():
        found = afmid.frf(u, y, sample_rate_hz=RATE_HZ, inputs=["u"], outputs=["y"], **params)
    same_array(found.response, stored["frf"])
    assert found.details == stored["summary"]
    assert list(found.warnings) == stored.warnings


def test_hits_of_several_sensors_and_records_are_the_program_s_too(by_config, same_array):
    u, y = struck(1)
    params = {"blocks": "hits", "added_decay_per_s": 2.0, "driving_point": 1, "quantity": "receptance"}
    stages = [("frf", "spectrum.measured_frf", {"pair": "data.pair"}, params)]
    stored = by_config([({"f (N)": u}, {"a (m)": y[0], "b (m)": y[1]})], stages, RATE_HZ)
    units = {"inputs": ["f"], "outputs": ["a", "b"], "input_unit": "N", "output_unit": "m"}
    found = afmid.frf(u, y, sample_rate_hz=RATE_HZ, **units, **params)
    same_array(found.response, stored["frf"]["frf"])
    assert found.response.response.values.tolist() == ["a / f", "b / f"]
    assert found.response["frf"].units == "m/N" and found.details["blocks"] == 4
    # a record for each hit
    apart = [
        ({"f (N)": u[k : k + 2000]}, {"a (m)": y[0, k : k + 2000], "b (m)": y[1, k : k + 2000]})
        for k in range(0, 8000, 2000)
    ]
    stored = by_config(apart, stages, RATE_HZ)
    split = lambda values: values.reshape(-1, 4, 2000).swapaxes(0, 1)  # noqa: E731
    found = afmid.frf(split(u), split(y), sample_rate_hz=RATE_HZ, **units, **params)
    same_array(found.response, stored["frf"]["frf"])


def test_points_that_were_struck_one_after_the_other_are_joined(by_config, same_array):
    (u, y), (v, z) = driven(1), driven(2)
    joined = {"pair": "data.pair", "before": "one.frf"}
    given = {"quantity": "transfer", "block_samples": 500}
    stages = [("one", "spectrum.measured_frf", {"pair": "data.pair"}, {**given, "point": "1"})]
    stages += [("two", "spectrum.measured_frf", joined, {**given, "point": "2", "band_hz": [10.0, 200.0]})]
    stored = by_config([({"u": u}, {"y": y})], stages, RATE_HZ)
    named = {"sample_rate_hz": RATE_HZ, "inputs": ["u"], "outputs": ["y"], **given}
    one = afmid.frf(u, y, point="1", **named)
    same_array(afmid.frf(u, y, point="2", band_hz=[10.0, 200.0], before=one, **named).response, stored["two"]["frf"])
    two = afmid.frf(v, z, point="2", before=pickle.loads(pickle.dumps(one)), **named)
    assert two.response.response.values.tolist() == ["y / 1", "y / 2"]
    assert two.response.input.values.tolist() == ["1", "2"]


def test_inputs_and_outputs_are_in_the_shapes_of_scipy():
    u, y = driven(5)
    v = np.random.default_rng(6).standard_normal(len(u))
    found = afmid.frf([u, v], [y, lfilter([0.0, 1.0], [1.0], v)], sample_rate_hz=RATE_HZ, quantity="transfer")
    names = ["output 1 / input 1", "output 1 / input 2", "output 2 / input 1", "output 2 / input 2"]
    assert found.response.response.values.tolist() == names and found.coherence.shape == found.response["frf"].shape
    other = found.response.sel(response="output 2 / input 2").sel(frequency_hz=100, method="nearest")
    assert abs(other["frf"].item() - np.exp(-2j * np.pi * other.frequency_hz.item() / RATE_HZ)) < 0.05


def test_bad_input_is_refused_with_what_was_found():
    u, y = driven(7)
    with pytest.raises(afmid.DataError, match="is u.T meant"):
        afmid.frf(np.stack([u, u]).T, y, sample_rate_hz=RATE_HZ)
    with pytest.raises(afmid.DataError, match="1 records and y 2"):
        afmid.frf(u, np.zeros((2, 1, 100)), sample_rate_hz=RATE_HZ)
    with pytest.raises(afmid.DataError, match="input has 19999 samples|20000"):
        afmid.frf(u[:-1], y, sample_rate_hz=RATE_HZ)
    with pytest.raises(afmid.ConfigError, match="blocks"):
        afmid.frf(u, y, sample_rate_hz=RATE_HZ, blocks="segment")
    with pytest.raises(afmid.ConfigError, match="excited_share.*2"):
        afmid.frf(u, y, sample_rate_hz=RATE_HZ, excited_share=2.0)
    with pytest.raises(afmid.ConfigError, match="force_window_s"):
        afmid.frf(u, y, sample_rate_hz=RATE_HZ, force_window_s=0.1)
    with pytest.raises(afmid.DataError, match="does not repeat itself"):
        afmid.frf(u, y, sample_rate_hz=RATE_HZ, blocks="periods")
    with pytest.raises(afmid.DataError, match="misses sample 3|missing"):
        afmid.frf(np.where(np.arange(len(u)) == 3, np.nan, u), y, sample_rate_hz=RATE_HZ)


def test_a_single_hit_has_no_error_and_says_so():
    u, y = struck(2, hits=1)
    with pytest.warns(afmid.AfmidWarning, match="neither coherence nor variance"):
        found = afmid.frf(u, y[0], sample_rate_hz=RATE_HZ, blocks="hits", quantity="transfer")
    assert found.coherence is None and "std" not in found.response and "warning: a single block" in found.summary()
    assert len(found.plot().axes) == 2


def test_a_result_is_pickled_copied_shown_and_drawn():
    found = afmid.frf(*driven(8), sample_rate_hz=RATE_HZ, quantity="transfer")
    for again in (pickle.loads(pickle.dumps(found)), copy.copy(found), copy.deepcopy(found)):
        assert again.response.identical(found.response) and again.summary() == found.summary()
    assert "output / input" in repr(found) and found._repr_html_().startswith("<table>")
    assert [axes.get_ylabel() for axes in found.plot().axes] == ["magnitude (1)", "phase (rad)", "coherence"]


def test_defaults_are_the_stage_s():
    stage = json.loads(_native.stage_parameters("spectrum.measured_frf"))
    given = {name: of.default for name, of in inspect.signature(afmid.frf).parameters.items()}
    assert {name: given[name] for name in stage if stage[name] is not None} == {
        k: v for k, v in stage.items() if v is not None
    }
    assert set(stage) <= set(given)
