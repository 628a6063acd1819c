"""`afmid.smoothing` and `afmid.vector_fitting` against known truth, and against the program on the same samples."""

import copy
import inspect
import json
import pickle

import afmid
import numpy as np
import pytest
from afmid import _native
from scipy.signal import lfilter

RATE_HZ = 1e3
# 90.5 Hz, damping 1.8 %
A = [1.0, -1.66, 0.98]
FREQUENCY_HZ = abs(np.log(np.roots(A)[0])) * RATE_HZ / (2 * np.pi)


def driven(seed, samples=4000, std=0.1):
    rng = np.random.default_rng(seed)
    u = rng.standard_normal(samples)
    return u, lfilter([0.0, 0.3], A, u) + std * rng.standard_normal(samples)


def truth(frequency_hz):
    z = np.exp(-2j * np.pi * np.asarray(frequency_hz) / RATE_HZ)
    return 0.3 * z / np.polyval(A[::-1], z)


def test_squared_errors_of_a_smoothed_response_are_those_that_are_stated():
    off = []
    for seed in range(10):
        found = afmid.smoothing(*driven(seed), sample_rate_hz=RATE_HZ, intersample="sampled").response
        off.append(np.abs(found["transfer"].values - truth(found.frequency_hz)) ** 2 / found["variance"].values)
    # some 200 independent values of each of 10 records; the variance of the estimate is good to 27 %
    assert 0.6 < np.nanmean(off) < 1.6
    # a fifth of the scatter of the estimate at most
    found = afmid.smoothing(*driven(1), sample_rate_hz=RATE_HZ, intersample="sampled")
    of = lambda one: np.nanmedian(np.abs(one["transfer"].values - truth(one.frequency_hz)) ** 2)  # noqa: E731
    assert of(found.response) < 0.4 * of(found.etfe)


def test_smoothing_and_fit_are_the_program_s_bit_for_bit(by_config, same_array):
    u, y = driven(3)
    stages = [
        ("etfe", "spectrum.etfe", {"pair": "data.pair"}, {"normalise": False, "bandwidth_hz": 500.0}),
        ("smooth", "spectrum.smoothing", {"etfe": "etfe.etfe"}, {"half_width_bins": 12}),
        ("fit", "model.vector_fitting", {"transfer": "smooth.smoothed"}, {"order": 2}),
        ("raw", "model.vector_fitting", {"transfer": "etfe.etfe"}, {"order": 3, "max_frequency_hz": 300.0}),
        ("modes", "model.modes", {"model": "fit.model"}, {}),
    ]
    stored = by_config([({"u": u}, {"y": y})], stages, RATE_HZ)
    found = afmid.smoothing(u, y, sample_rate_hz=RATE_HZ, half_width_bins=12)
    same_array(found.response, stored["smooth"]["smoothed"])
    same_array(found.etfe, stored["etfe"]["etfe"])
    assert found.details == stored["etfe"]["summary"]
    for response in (found, pickle.loads(pickle.dumps(found)), stored["smooth"]["smoothed"]):
        model = afmid.vector_fitting(response, order=2)
        for name in ("A", "B", "C", "D", "parameters", "covariance"):
            assert np.array_equal(getattr(model, name), getattr(stored.model("fit"), name)), name
        assert model.modes.equals(stored["modes"]["modes"]) and model.details == stored["fit"]["summary"]
    with pytest.warns(afmid.AfmidWarning, match="outside the unit circle"):
        model = afmid.vector_fitting(found.etfe, order=3, max_frequency_hz=300.0)
    assert np.array_equal(model.A, stored.model("raw").A)


def test_modes_from_a_measured_response_are_within_their_errors():
    off = []
    for seed in range(20):
        measured = afmid.frf(*driven(seed, 20_000), sample_rate_hz=RATE_HZ, block_samples=4000, quantity="transfer")
        mode = afmid.vector_fitting(measured, order=2).modes.loc[0]
        off.append((mode.frequency_hz - FREQUENCY_HZ) / mode.frequency_std_hz)
        off.append((mode.quality_factor - 1 / (2 * DAMPING)) / mode.quality_factor_std)
    # neighbouring bins of a Hann window are alike, which the errors count; leakage takes a half of one from Q
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.4


POLE = np.log(np.roots(A)[0])
DAMPING = -POLE.real / abs(POLE)


def test_values_are_fitted_with_and_without_their_errors():
    f = np.arange(1.0, 500.0)
    model = afmid.vector_fitting(truth(f), order=2, frequency_hz=f, sample_rate_hz=RATE_HZ, intersample="sampled")
    assert model.modes.frequency_hz[0] == pytest.approx(FREQUENCY_HZ, rel=1e-9) and model.details["weight"] == "uniform"
    noise = np.random.default_rng(1).normal(0, 0.01, (2, len(f)))
    values = truth(f) + noise[0] + 1j * noise[1]
    model = afmid.vector_fitting(
        values, order=2, frequency_hz=f, sample_rate_hz=RATE_HZ, std=np.full(len(f), 0.014), intersample="sampled"
    )
    mode = model.modes.loc[0]
    assert abs(mode.frequency_hz - FREQUENCY_HZ) < 4 * mode.frequency_std_hz and model.details["weight"] == "variance"


def test_bad_input_is_refused_with_what_was_found():
    f, (u, y) = np.arange(1.0, 500.0), driven(4)
    with pytest.raises(afmid.DataError, match="frequency_hz and sample_rate_hz are wanted"):
        afmid.vector_fitting(truth(f), order=2, frequency_hz=f)
    with pytest.raises(afmid.DataError, match="do not ascend"):
        afmid.vector_fitting(truth(f), order=2, frequency_hz=f[::-1], sample_rate_hz=RATE_HZ)
    with pytest.raises(afmid.DataError, match=r"std \(3,\)"):
        afmid.vector_fitting(truth(f), order=2, frequency_hz=f, sample_rate_hz=RATE_HZ, std=[1, 2, 3])
    with pytest.raises(afmid.ConfigError, match="order"):
        afmid.vector_fitting(truth(f), order=0, frequency_hz=f, sample_rate_hz=RATE_HZ)
    with pytest.raises(afmid.DataError, match="2 responses, wanted one"):
        afmid.vector_fitting(afmid.frf(u, [y, y[::-1]], sample_rate_hz=RATE_HZ, quantity="transfer"), order=2)
    with pytest.raises(afmid.DataError, match="wanted one input"):
        afmid.smoothing([u, u], y, sample_rate_hz=RATE_HZ)
    with pytest.raises(afmid.ConfigError, match="method"):
        afmid.smoothing(u, y, sample_rate_hz=RATE_HZ, method="spline")


def test_results_are_pickled_copied_shown_and_drawn():
    found = afmid.smoothing(*driven(5), sample_rate_hz=RATE_HZ)
    for again in (pickle.loads(pickle.dumps(found)), copy.copy(found), copy.deepcopy(found)):
        assert again.response.identical(found.response) and again.etfe.identical(found.etfe)
    assert "smoothed" in repr(found) and found._repr_html_().startswith("<table>")
    assert [axes.get_ylabel() for axes in found.plot().axes] == ["magnitude", "phase (rad)"]


def test_defaults_are_the_stages_but_for_those_of_events():
    for function, stage, other in [
        (afmid.smoothing, "spectrum.smoothing", {"lines"}),
        (afmid.smoothing, "spectrum.etfe", {"bandwidth_hz"}),
        (afmid.vector_fitting, "model.vector_fitting", {"order", "weight", "intersample"}),
    ]:
        given = {name: of.default for name, of in inspect.signature(function).parameters.items()}
        stage = json.loads(_native.stage_parameters(stage))
        assert {name for name in given if name in stage and given[name] != stage[name]} == other
