"""`afmid.subspace` against known truth, and against the program on the same samples."""

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
A = [1.0, -1.6, 0.9]
FREQUENCY_HZ = abs(np.log(np.roots(A)[0])) * RATE_HZ / (2 * np.pi)
MATRICES = ("A", "B", "C", "D", "K", "x0", "parameters", "covariance")


def driven(seed, samples=4000, std=0.05):
    rng = np.random.default_rng(seed)
    u = rng.standard_normal(samples)
    return u, lfilter([0.0, 0.3], A, u) + std * rng.standard_normal(samples)


def test_the_mode_is_within_its_errors():
    off = []
    for seed in range(20):
        mode = afmid.subspace(*driven(seed), sample_rate_hz=RATE_HZ, order=2).modes.loc[0]
        off.append((mode.frequency_hz - FREQUENCY_HZ) / mode.frequency_std_hz)
    # the covariance is that of output error, a subspace method scatters more
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 3


def test_the_same_numbers_as_the_program_bit_for_bit(by_config):
    u, y = driven(3)
    v = np.random.default_rng(4).standard_normal(len(u))
    for params in (
        {"order": 4, "weight": "n4sid", "block_rows": 20},
        {"order": "auto", "weight": "cva", "drift": False},
    ):
        stages = [
            ("model", "model.subspace", {"pair": "data.pair"}, params),
            ("modes", "model.modes", {"model": "model.model"}, {}),
        ]
        stored = by_config([({"u": u, "v": v}, {"y": y})], stages, RATE_HZ)
        found = afmid.subspace(np.stack([u, v]), y, sample_rate_hz=RATE_HZ, **{"drift": True, **params})
        for name in MATRICES:
            assert np.array_equal(getattr(found, name), getattr(stored.model("model"), name)), name
        assert found.modes.equals(stored["modes"]["modes"]) and found.details == stored["model"]["summary"]


def test_a_model_simulates_and_is_pickled_copied_and_shown():
    u, y = driven(5, std=0.01)
    found = afmid.subspace(u, y, sample_rate_hz=RATE_HZ)
    assert found.order == 2 and "order 2" in repr(found) and "order 2" in found._repr_html_()
    assert np.std((y - found.simulate(u))[100:]) < 0.02
    for again in (pickle.loads(pickle.dumps(found)), copy.copy(found), copy.deepcopy(found)):
        assert np.array_equal(again.A, found.A) and again.modes.equals(found.modes)
    assert len(found.plot().axes) == 2 and len(found.residuals) == 0


def test_bad_input_is_refused_with_what_was_found():
    u, y = driven(6)
    with pytest.raises(afmid.DataError, match=r"shape \(2, 4000\), wanted one output"):
        afmid.subspace(u, np.stack([y, y]), sample_rate_hz=RATE_HZ)
    with pytest.raises(afmid.ConfigError, match="block_rows"):
        afmid.subspace(u, y, sample_rate_hz=RATE_HZ, order=4, block_rows=4)
    with pytest.raises(afmid.ConfigError, match="weight"):
        afmid.subspace(u, y, sample_rate_hz=RATE_HZ, weight="pca")


def test_defaults_are_the_stage_s_but_for_those_of_releases():
    stage = json.loads(_native.stage_parameters("model.subspace"))
    given = {name: of.default for name, of in inspect.signature(afmid.subspace).parameters.items()}
    other = {name for name in given if name in stage and given[name] != stage[name]}
    assert other == {"order", "weight", "drift"}
