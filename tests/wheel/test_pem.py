"""`afmid.pem` against known truth, and against the program on the same samples."""

import os
import pickle
import signal
import subprocess
import sys
import threading
import time

import afmid
import numpy as np
import pytest

RATE_HZ = 1e3
# z-plane: 90.7 Hz, damping 9.2 %
A = (1.6, -0.9)
POLE = np.roots([1, -A[0], -A[1]])[0]
FREQUENCY_HZ = abs(np.log(POLE)) * RATE_HZ / (2 * np.pi)


def pair(seed, samples=2000, std=0.05):
    rng = np.random.default_rng(seed)
    u, y = rng.standard_normal(samples), np.zeros(samples)
    for k in range(2, samples):
        y[k] = A[0] * y[k - 1] + A[1] * y[k - 2] + 0.3 * u[k - 1]
    return u, y + std * rng.standard_normal(samples)


def test_the_mode_is_within_its_errors():
    off = []
    for seed in range(20):
        model = afmid.pem(*pair(seed), sample_rate_hz=RATE_HZ, order=2)
        mode = model.modes.loc[0]
        off.append((mode.frequency_hz - FREQUENCY_HZ) / mode.frequency_std_hz)
    # 20 standard normal numbers: the rms is 1 +- 0.16
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.5 and max(map(abs, off)) < 4


def test_the_same_numbers_as_the_program_bit_for_bit(afmid_cli, tmp_path):
    u, y = pair(3)
    np.savetxt("a.csv", np.column_stack([u, y]), delimiter=",", header="u (V),y (V)", comments="", fmt="%.17g")
    afmid_cli("new", "pipeline", "a.csv", "--goal", "input-output", "--input", "u", "--rate", RATE_HZ, "-o", "a.toml", cwd=tmp_path)
    afmid_cli("run", "a.toml", "-o", "a.h5", cwd=tmp_path)
    stored = afmid.open("a.h5").model("model")
    model = afmid.pem(u, y, sample_rate_hz=RATE_HZ)
    for name in ("A", "B", "C", "D", "K", "x0", "parameters", "covariance"):
        assert np.array_equal(getattr(model, name), getattr(stored, name)), name
    assert model.innovation_variance == stored.innovation_variance


def test_a_model_simulates_responds_and_goes_to_other_packages():
    u, y = pair(4, std=0.01)
    model = afmid.pem(u, y, sample_rate_hz=RATE_HZ)
    assert model.order == 2 and "order 2" in model.summary()
    assert np.std((y - model.simulate(u))[100:]) < 0.05
    band = model.frequency_response([50.0, 90.0])
    assert np.all(band.magnitude_low < band.magnitude)
    assert model.to_scipy().dt == pytest.approx(1 / RATE_HZ)
    assert len(model.bode().axes) == 2
    again = pickle.loads(pickle.dumps(model))
    assert np.array_equal(again.A, model.A) and again.modes.equals(model.modes)


def test_levels_of_input_and_output_are_the_models_and_a_fresh_record_has_its_own_state():
    u, y = pair(4, std=0.01)
    model = afmid.pem(u + 3, y - 20, sample_rate_hz=RATE_HZ, order=2)
    assert np.std(y - 20 - model.simulate(u + 3)) < 0.02 and abs(np.mean(y - 20 - model.simulate(u + 3))) < 2e-3
    # of noise="coloured" there is no gain: nothing is known of the next error
    assert np.array_equal(model.predict(u + 3, y - 20), model.simulate(u + 3))
    half = afmid.pem(u[:1000] + 3, y[:1000] - 20, sample_rate_hz=RATE_HZ, order=2)
    beside = half.compare(u[1000:] + 3, y[1000:] - 20)
    error = y[1000:] - 20 - beside.simulated
    assert beside.fit_percent == pytest.approx(100 * (1 - np.linalg.norm(error) / (np.std(y[1000:]) * 1000**0.5)), abs=1e-6)
    assert beside.fit_percent > 95 and np.std(error) < 0.02
    assert np.array_equal(half.simulate(u[1000:] + 3, beside.x0).round(9), beside.simulated.round(9))
    two = afmid.pem(np.stack([u + 3, np.roll(u, 7) - 5]), y - 20, sample_rate_hz=RATE_HZ, order=2)
    assert np.std(y - 20 - two.simulate(np.stack([u + 3, np.roll(u, 7) - 5]))) < 0.02


def test_two_inputs():
    u, y = pair(5)
    other = np.random.default_rng(9).standard_normal(len(u))
    model = afmid.pem(np.stack([u, other]), y, sample_rate_hz=RATE_HZ, order=2, inputs=["force", "drive"])
    assert model.B.shape == (2, 2) and np.all(abs(model.B[:, 1]) < 0.05)


def test_bad_input_is_refused_with_what_was_found():
    u, y = pair(6)
    with pytest.raises(afmid.DataError, match="2000 samples|1999"):
        afmid.pem(u[:-1], y, sample_rate_hz=RATE_HZ)
    with pytest.raises(afmid.DataError, match="misses sample 7"):
        afmid.pem(np.where(np.arange(2000) == 7, np.nan, u), y, sample_rate_hz=RATE_HZ)
    with pytest.raises(afmid.ConfigError, match="noise"):
        afmid.pem(u, y, sample_rate_hz=RATE_HZ, noise="pink")
    with pytest.raises(afmid.DataError, match="constant"):
        afmid.pem(u, np.ones(2000), sample_rate_hz=RATE_HZ, order=2)
    with pytest.raises(afmid.DataError, match="sample_rate_hz is '10 kHz'"):
        afmid.pem(u, y, sample_rate_hz="10 kHz")
    with pytest.raises(afmid.DataError, match="does nothing"):
        afmid.pem(np.ones(2000), y, sample_rate_hz=RATE_HZ, order=2)
    model = afmid.pem(u, y[:, None], sample_rate_hz=RATE_HZ, order=2)
    with pytest.raises(ValueError, match="a number for every state"):
        model.simulate(u, x0=[0.0])
    assert model.frequency_response(90.0).sizes["frequency_hz"] == 1
    for wrong in (-1.0, RATE_HZ):
        with pytest.raises(ValueError, match="half the sample rate"):
            model.frequency_response(wrong)


@pytest.mark.skipif(sys.platform == "win32", reason="no signals")
def test_ctrl_c_ends_a_long_fit_and_leaves_the_interpreter():
    u, y = pair(7, samples=100_000)
    # what is imported when first needed is not what is interrupted
    afmid.pem(*pair(8), sample_rate_hz=RATE_HZ, order=2)
    began = time.monotonic()
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        afmid.pem(u, np.cumsum(y), sample_rate_hz=RATE_HZ, order=20, block_rows=60, noise="free", max_iterations=10_000)
    assert afmid.pem(*pair(8), sample_rate_hz=RATE_HZ, order=2).order == 2
    assert time.monotonic() - began < 60


def test_numbers_do_not_depend_on_threads():
    code = "import sys; sys.path.insert(0, sys.argv[1]); from test_pem import *; "
    code += "m = afmid.pem(*pair(1), sample_rate_hz=RATE_HZ); print(m.parameters.tobytes().hex())"
    run = lambda threads: subprocess.run(  # noqa: E731
        [sys.executable, "-c", code, os.path.dirname(__file__)],
        env={**os.environ, "RAYON_NUM_THREADS": threads},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert run("1") == run("2")
