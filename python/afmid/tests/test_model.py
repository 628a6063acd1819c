"""Models: the response and the prediction are afmid's own, in Python as in Rust."""

import numpy as np
import pytest

import afmid

# sums over 11 states and 8192 samples, poles as near to the circle as 1e-3: 1e-16 per operation times 1e3 and some
ROUNDING = 1e-10


@pytest.fixture(scope="module")
def r(result):
    with afmid.open(result) as r:
        yield r


@pytest.fixture(scope="module")
def model(r):
    return r.model("model")


def test_shapes_fit_together(model):
    n, m, p = model.order, model.B.shape[1], model.C.shape[0]
    assert (model.A.shape, model.D.shape, model.K.shape, model.x0.shape) == ((n, n), (p, m), (n, p), (n,))
    assert model.covariance.shape == (len(model.parameters),) * 2
    assert model.parameter_names[0] == "a1" and len(model.parameter_names) == 2 * n + 1
    assert (model.parameter_table["std"] > 0).all()


def test_response_and_band_are_those_of_the_stage_modes(r, model):
    stored = r["modes.response"]
    found = model.frequency_response(stored.frequency_hz)
    # the two are computed in another order: the resolvent's condition is below 1e6
    close = dict(rtol=1e-8, atol=1e-12)
    assert np.allclose(found.transfer, stored.transfer, **close)
    # at half the rate G is real: its phase's error vanishes by rounding
    below = stored.frequency_hz < 0.499 / model.sample_time_s
    for name in ("magnitude_std", "magnitude_low", "magnitude_high", "phase_std"):
        # errors are roots of small differences: half the digits at least where they nearly cancel
        assert np.allclose(found[name][below], stored[name][below], rtol=1e-5, atol=1e-12), name


def test_the_band_widens_with_its_level_and_leaves_the_hold_to_the_caller(model):
    narrow, wide = (model.frequency_response([2e5], level=level) for level in (0.5, 0.999))
    assert wide.magnitude_low < narrow.magnitude_low < narrow.magnitude_high < wide.magnitude_high
    sampled = model.frequency_response([2e5], intersample="sampled").transfer.item()
    z = np.exp(2j * np.pi * 2e5 * model.sample_time_s)
    plain = (model.C @ np.linalg.solve(z * np.eye(model.order) - model.A, model.B) + model.D).item()
    assert abs(sampled - plain) < ROUNDING * abs(plain)


def test_prediction_is_the_one_that_afmid_stored(r, model):
    pair, residuals = r.force, r["model.residuals"]
    t = np.arange(pair.sizes["time"])
    # the drift runs through zero in the middle of the record
    level = model.attributes["offset_v"] + model.attributes["drift_v_per_s"] * model.sample_time_s * (t - t.mean())
    found = model.predict(pair.force.values, pair.response.values - level) + level
    assert np.abs(found - residuals.prediction.values).max() < ROUNDING
    # and it can fail: without drift it is another one
    assert np.abs(model.predict(pair.force.values, pair.response.values) - residuals.prediction.values).max() > 1e-6


def test_scipy_and_control_simulate_as_the_model_does(r, model):
    import control
    import scipy.signal

    u = r.force.force.values[:4000]
    wanted = model.simulate(u)
    _, found, _ = scipy.signal.dlsim(model.to_scipy(), u, x0=model.x0)
    assert np.abs(found[:, 0] - wanted).max() < ROUNDING
    found = control.forced_response(model.to_control(), U=u, X0=model.x0).outputs
    assert np.abs(found - wanted).max() < ROUNDING
    frequency = np.array([1e4, 1e5, 1e6])
    plain = model.frequency_response(frequency, intersample="sampled").transfer.values
    assert np.allclose(model.to_control()(np.exp(2j * np.pi * frequency * model.sample_time_s)), plain, rtol=1e-8)


def test_poles_are_the_roots_that_afmid_names(r, model):
    roots = r["modes.roots"]
    poles = roots[roots.kind == "pole"]
    for z in poles.z_re + 1j * poles.z_im:
        assert np.abs(model.poles - z).min() < 1e-9, z


def test_without_a_covariance_the_band_is_unknown_and_the_response_is_not(model):
    import dataclasses

    bare = dataclasses.replace(model, covariance=np.empty((0, 0)))
    response = bare.frequency_response([1e5])
    assert np.isfinite(response.transfer).all() and np.isnan(response.magnitude_std).all()
    assert bare.parameter_table["std"].isna().all()
    with pytest.raises(afmid.NoCovariance, match="no covariance"):
        afmid.response.sensitivities(bare, np.ones((1, 11)), np.ones((1, 11)), 0, 0)
    moved = dataclasses.replace(model, parameters=model.parameters + 1e-9)
    with pytest.raises(afmid.NoCovariance, match="`a1`"):
        afmid.response.sensitivities(moved, np.ones((1, 11)), np.ones((1, 11)), 0, 0)


def test_wrong_shapes_are_refused(model):
    with pytest.raises(ValueError, match="2 rows, the model 1 inputs"):
        model.simulate(np.zeros((2, 5)))
    with pytest.raises(ValueError, match="level is 95"):
        model.frequency_response([1e4], level=95)
    with pytest.raises(afmid.UnknownName, match="did you mean `held`"):
        model.frequency_response([1e4], intersample="helt")
