"""`afmid.welch` and `afmid.thermal_fit` against known truth, and against the program on the same samples."""

import copy
import inspect
import json
import pickle

import afmid
import h5py
import numpy as np
import pytest
from afmid import _native
from scipy.signal import lfilter, welch

RATE_HZ, FREQUENCY_HZ, QUALITY_FACTOR = 1e4, 1000.0, 50.0


def thermal(seed, samples=200_000, quality_factor=QUALITY_FACTOR):
    """A damped resonance that white noise drives, sampled exactly, and white noise of a tenth of its mean square."""
    rng = np.random.default_rng(seed)
    omega = 2 * np.pi * FREQUENCY_HZ / RATE_HZ
    decay, turn = omega / (2 * quality_factor), omega * np.sqrt(1 - 1 / (4 * quality_factor**2))
    # an AR(2) with the oscillator's poles: its spectrum near the resonance is the oscillator's
    a = [1, -2 * np.exp(-decay) * np.cos(turn), np.exp(-2 * decay)]
    x = lfilter([1], a, rng.standard_normal(samples + 5000))[5000:]
    x /= np.std(x)
    return x + 0.3 * rng.standard_normal(samples)


def store(path, records, unit="V"):
    """Native records, as the program reads them."""
    for number, values in enumerate(records):
        with h5py.File(path / f"record-{number}.h5", "w") as file:
            file.attrs["sample_rate_hz"] = RATE_HZ
            file["deflection"] = values
            file["deflection"].attrs["units"] = unit


def run(afmid_cli, path, stages):
    (path / "a.toml").write_text(RECORDS + stages)
    afmid_cli("run", "a.toml", "-o", "a.h5", cwd=path)
    return afmid.open(path / "a.h5")


def stage(id, uses, wires, params):
    return f'\n[[stage]]\nid = "{id}"\nuses = "{uses}"\n{wires}params = {{ {params} }}\n'


RECORDS = '[pipeline]\nname = "a"\n' + stage("records", "io.records", "", 'files = ["record-*.h5"]')
WELCH = stage(
    "density", "spectrum.welch", 'inputs = { records = "records" }\n', 'segment_samples = 4096, stretches = "all"'
)
THERMAL = stage("thermal", "spectrum.thermal", 'inputs = { density = "density.density" }\n', "fitted_hz = [500, 1500]")


def test_a_resonance_in_noise_is_within_its_errors():
    off = []
    for seed in range(12):
        found = afmid.thermal_fit(thermal(seed), sample_rate_hz=RATE_HZ, unit="V", fitted_hz=(700, 1300))
        mode = found.modes.loc[0]
        off.append((mode.frequency_hz - FREQUENCY_HZ) / mode.frequency_std_hz)
        off.append((mode.quality_factor - QUALITY_FACTOR) / mode.quality_factor_std)
        assert mode.damping_ratio == pytest.approx(0.01, abs=5 * mode.damping_ratio_std)
    # 24 standard normal numbers: the rms is 1 +- 0.14
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.5 and max(map(abs, off)) < 4
    assert found.parameters.loc["variance", "unit"] == "V^2"


def test_the_same_numbers_as_the_program_bit_for_bit(afmid_cli, tmp_path, same_array):
    records = [thermal(seed, samples) for seed, samples in ((1, 60_000), (2, 50_000))]
    store(tmp_path, records)
    stored = run(afmid_cli, tmp_path, WELCH + THERMAL)
    density = afmid.welch(records, sample_rate_hz=RATE_HZ, units="V", segment_samples=4096)
    same_array(density.density, stored["density"]["density"])
    assert density.details == stored["density"]["summary"]
    fits = [
        afmid.thermal_fit(records, sample_rate_hz=RATE_HZ, unit="V", segment_samples=4096, fitted_hz=(500, 1500)),
        afmid.thermal_fit(pickle.loads(pickle.dumps(density)), fitted_hz=(500, 1500)),
    ]
    for found in fits:
        same_array(found.fit, stored["thermal"]["fit"])
        assert found.details == stored["thermal"]["summary"] and found.lines.equals(stored["thermal"]["lines"])


def test_a_density_at_hand_is_that_of_a_file_bit_for_bit(afmid_cli, tmp_path):
    f, p = welch(thermal(3), RATE_HZ, nperseg=4096)
    f, p = f[1:], p[1:]
    with h5py.File(tmp_path / "psd.h5", "w") as file:
        file["x"], file["y"] = f, p
    (tmp_path / "b.toml").write_text(
        '[pipeline]\nname = "b"\n\n[[stage]]\nid = "density"\nuses = "io.spectrum"\n'
        'params = { file = "psd.h5", unit = "nm", averages = 91 }\n' + THERMAL
    )
    afmid_cli("run", "b.toml", "-o", "b.h5", cwd=tmp_path)
    stored = afmid.open(tmp_path / "b.h5")
    found = afmid.thermal_fit(p, frequency_hz=f, averages=91, unit="nm", fitted_hz=(500, 1500))
    assert found.details == stored["thermal"]["summary"]
    with pytest.warns(afmid.AfmidWarning, match="by the scatter of neighbouring values"):
        afmid.thermal_fit(p, frequency_hz=f, fitted_hz=(500, 1500))


def test_a_density_is_scipy_s_with_its_error():
    y = np.random.default_rng(1).standard_normal((2, 60_000)) * [[1.0], [3.0]]
    found = afmid.welch(y, sample_rate_hz=RATE_HZ, axes="channels", channels=["a", "b"], units=["V", "V"])
    for name, row in zip("ab", y, strict=True):
        one = found.density.sel(channel=name)
        f, p = welch(row, RATE_HZ, nperseg=2 * (one.sizes["frequency_hz"] - 1))
        assert np.allclose(one.frequency_hz, f) and np.allclose(one["density"][3:-1], p[3:-1])
        off = (one["density"] / (2 * np.var(row) / RATE_HZ) - 1) / (one["standard_error"] / one["density"])
        assert 0.8 < np.sqrt(np.mean(np.square(off.values[3:-3]))) < 1.2
    assert found.details["b"]["mean_square"]["value"] == pytest.approx(9, rel=0.03)
    joint = afmid.welch(y[0].reshape(4, -1), sample_rate_hz=RATE_HZ, axes="records", segment_samples=512)
    assert joint.details["records"] == 4 and joint.density["density"].ndim == 1


def test_bad_input_is_refused_with_what_was_found():
    y = thermal(4, 20_000)
    with pytest.raises(afmid.DataError, match='axes="records" or axes="channels"'):
        afmid.welch(y.reshape(2, -1), sample_rate_hz=RATE_HZ)
    with pytest.raises(afmid.DataError, match="is y.T meant"):
        afmid.welch(y.reshape(-1, 2), sample_rate_hz=RATE_HZ, axes="channels")
    with pytest.raises(afmid.DataError, match="misses sample 5"):
        afmid.welch(np.where(np.arange(20_000) == 5, np.nan, y), sample_rate_hz=RATE_HZ)
    with pytest.raises(afmid.ConfigError, match="even"):
        afmid.welch(y, sample_rate_hz=RATE_HZ, segment_samples=101)
    with pytest.raises(afmid.DataError, match="lower `segment_samples`"):
        afmid.welch(y, sample_rate_hz=RATE_HZ, segment_samples=32_768)
    with pytest.raises(afmid.DataError, match="neither sample_rate_hz nor frequency_hz"):
        afmid.thermal_fit(y)
    with pytest.raises(afmid.DataError, match="no resonance"):
        afmid.thermal_fit(np.random.default_rng(1).standard_normal(50_000), sample_rate_hz=RATE_HZ)
    with pytest.raises(afmid.ConfigError, match="fitted_hz"):
        afmid.thermal_fit(y, sample_rate_hz=RATE_HZ, fitted_hz=(1500, 500))
    with pytest.raises(afmid.DataError, match="2 channels, wanted one"):
        afmid.thermal_fit(afmid.welch(y.reshape(2, -1), sample_rate_hz=RATE_HZ, axes="channels"))


def test_results_are_pickled_copied_shown_and_drawn():
    density = afmid.welch(thermal(5), sample_rate_hz=RATE_HZ, units="V")
    found = afmid.thermal_fit(density, fitted_hz=(500, 1500))
    for one in (density, found):
        for again in (pickle.loads(pickle.dumps(one)), copy.copy(one), copy.deepcopy(one)):
            assert again.summary() == one.summary()
        assert one._repr_html_().startswith("<table>")
    assert "quality_factor" in repr(found) and "V^2" in repr(found)
    assert density.plot().axes[0].get_ylabel() == "density (V^2/Hz)"
    assert [axes.get_ylabel() for axes in found.plot().axes] == ["density (V^2/Hz)", "ratio"]


def test_defaults_are_the_stage_s():
    given = {name: of.default for name, of in inspect.signature(afmid.thermal_fit).parameters.items()}
    stage = json.loads(_native.stage_parameters("spectrum.thermal"))
    assert {name: given[name] for name in stage} == stage
