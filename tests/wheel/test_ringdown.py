"""`afmid.ringdown` against known truth, and against the program on the same samples."""

import pickle
import warnings

import afmid
import h5py
import numpy as np
import pandas as pd
import pytest
import xarray as xr

RATE_HZ = 5e4
# undamped frequency, quality factor, amplitude at the two sensors
MODES = [(440.0, 60.0, (1.0, 0.5)), (1210.0, 90.0, (0.6, -0.9))]


def wave(frequency_hz, quality_factor, time):
    """A free decay of that pole: `abs(s) = 2 pi f`, `-2 Re(s) = abs(s) / Q`."""
    omega, rate = 2 * np.pi * frequency_hz, np.pi * frequency_hz / quality_factor
    return np.exp(-rate * time) * np.sin(np.sqrt(omega**2 - rate**2) * time)


def record(seed, quiet=2000):
    """Two sensors that see two modes after `quiet` samples, in noise of a thousandth."""
    time = np.arange(20_000 - quiet) / RATE_HZ
    ring = [sum(a[k] * wave(f, q, time) for f, q, a in MODES) for k in range(2)]
    noise = 1e-3 * np.random.default_rng(seed).standard_normal((2, 20_000))
    return noise + np.pad(np.array(ring), ((0, 0), (quiet, 0)))


def test_modes_are_within_their_errors():
    off = []
    for seed in range(12):
        found = afmid.ringdown(record(seed), sample_rate_hz=RATE_HZ, axes="channels", channels=["tip", "root"])
        assert len(found.modes) == 2
        for (frequency, quality, amplitude), (number, mode) in zip(MODES, found.modes.iterrows(), strict=True):
            off.append((mode.frequency_hz - frequency) / mode.frequency_std_hz)
            off.append((mode.quality_factor - quality) / mode.quality_factor_std)
            shape = found.shapes["shape"][number]
            ratio = amplitude[1] / amplitude[0] if abs(amplitude[0]) > abs(amplitude[1]) else amplitude[0] / amplitude[1]
            other = "root" if abs(amplitude[0]) > abs(amplitude[1]) else "tip"
            assert abs(complex(shape.sel(channel=other)) - ratio) < 0.01
    # 48 standard normal numbers: the rms is 1 +- 0.10, the largest below 4 in 99.7 % of runs
    assert 0.7 < np.sqrt(np.mean(np.square(off))) < 1.3 and max(map(abs, off)) < 4


def test_the_same_numbers_as_the_program_bit_for_bit(afmid_cli, tmp_path):
    for seed in range(3):
        with h5py.File("a.h5", "w") as file:
            for name, values in zip(("tip", "root"), record(seed), strict=True):
                file[name] = values
                file[name].attrs["sample_rate_hz"], file[name].attrs["units"] = RATE_HZ, "V"
        afmid_cli("new", "pipeline", "a.h5", "--goal", "decay", "-o", f"a{seed}.toml", cwd=tmp_path)
        afmid_cli("run", f"a{seed}.toml", "-o", f"r{seed}.h5", cwd=tmp_path)
        stored = afmid.open(f"r{seed}.h5")
        names = [stage for stage in stored.stages if stored[stage].uses == "model.decay"]
        table = stored[names[0]]["modes"]
        # the order of a file's channels: by name
        y = record(seed)[::-1]
        found = afmid.ringdown(y, sample_rate_hz=RATE_HZ, axes="channels", channels=["root", "tip"], units="V")
        assert list(found.modes.columns) == list(table.columns)
        assert np.array_equal(found.modes.to_numpy(), table.to_numpy())


def test_axes_are_asked_for_where_two_may_be_either():
    with pytest.raises(afmid.DataError, match='axes="hits" or axes="channels"'):
        afmid.ringdown(record(0), sample_rate_hz=RATE_HZ)
    hits = np.stack([record(seed) for seed in range(3)])
    joint = afmid.ringdown(hits, sample_rate_hz=RATE_HZ)
    assert joint.details["hits"] == 3 and len(joint.hits) == 6
    alone = afmid.ringdown(hits[:, 0], sample_rate_hz=RATE_HZ, axes="hits")
    assert alone.shapes.sizes["channel"] == 1 and alone.details["hits"] == 3


def test_labels_say_what_axes_are():
    y = record(0)
    of_array = afmid.ringdown(y, sample_rate_hz=RATE_HZ, axes="channels", channels=["tip", "root"])
    frame = pd.DataFrame({"tip": y[0], "root": y[1]})
    labelled = xr.DataArray(y.T, dims=("time", "channel"), coords={"channel": ["tip", "root"]})
    for same in (frame, labelled):
        found = afmid.ringdown(same, sample_rate_hz=RATE_HZ)
        assert found.modes.equals(of_array.modes) and found.shapes.channel.values.tolist() == ["tip", "root"]
    alone = afmid.ringdown(y[:1].T, sample_rate_hz=RATE_HZ)
    assert alone.modes.equals(afmid.ringdown(y[0], sample_rate_hz=RATE_HZ).modes)
    masked = np.ma.array(record(1, quiet=0)[0])
    masked[5000:5100] = 50.0
    masked[5000:5100] = np.ma.masked
    gap = afmid.ringdown(masked, sample_rate_hz=RATE_HZ, begin=0)
    assert gap.modes.equals(afmid.ringdown(masked.filled(np.nan), sample_rate_hz=RATE_HZ, begin=0).modes)


def test_given_decays_begin_at_their_first_sample():
    y = record(1, quiet=0)[0]
    found = afmid.ringdown(y, sample_rate_hz=RATE_HZ, begin=0)
    assert found.events is None and len(found.modes) == 2
    gap = y.copy()
    gap[5000:5100] = np.nan
    missing = afmid.ringdown(gap, sample_rate_hz=RATE_HZ, begin=0)
    assert np.all(abs(missing.modes.frequency_hz - found.modes.frequency_hz) < 3 * found.modes.frequency_std_hz)
    unequal = afmid.ringdown([y, y[:9000]], sample_rate_hz=RATE_HZ, begin=0, axes="hits")
    assert unequal.details["hits"] == 2


def test_a_mode_that_was_not_asked_for_is_said():
    with pytest.warns(afmid.AfmidWarning, match="1 mode is wanted, and one more explains more than noise"):
        afmid.ringdown(record(0)[0], sample_rate_hz=RATE_HZ, modes=1)


def test_warnings_and_errors_have_the_program_s_words():
    noise = np.random.default_rng(1).standard_normal(5000)
    with pytest.raises(afmid.DataError, match="no free decay"):
        afmid.ringdown(noise, sample_rate_hz=1e3)
    with pytest.raises(afmid.ConfigError, match="max_modes"):
        afmid.ringdown(record(0)[0], sample_rate_hz=RATE_HZ, max_modes="many")
    with pytest.raises(afmid.DataError, match="positive number of samples per second"):
        afmid.ringdown(record(0)[0], sample_rate_hz=0)
    for bad in (np.array(["a"] * 100), np.ones(100, complex), np.zeros((2, 2, 2, 50))):
        with pytest.raises(afmid.DataError):
            afmid.ringdown(bad, sample_rate_hz=1e3)
    moving = np.arange(40_000) / RATE_HZ
    envelope = np.exp(-12 * moving)
    phase = 2 * np.pi * np.cumsum(500 + 3 * envelope**2) / RATE_HZ
    with pytest.warns(afmid.AfmidWarning, match="moves while it dies away"):
        found = afmid.ringdown(envelope * np.cos(phase) + 1e-4 * noise[0] * np.cos(9e3 * moving), sample_rate_hz=RATE_HZ)
    assert "moves" in found.summary()


def test_a_result_is_pickled_shown_and_drawn():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = afmid.ringdown(record(2), sample_rate_hz=RATE_HZ, axes="channels", units=["m/s2", "m/s2"])
    again = pickle.loads(pickle.dumps(found))
    assert again.modes.equals(found.modes) and again.shapes.identical(found.shapes)
    text = found.summary()
    assert "440.0" in text and repr(found) == text and found._repr_html_().startswith("<table>")
    assert found.mac().loc[1, 1] == pytest.approx(1.0)
    axes = found.plot().axes
    assert len(axes) == 2 and axes[0].get_ylabel() == "m/s2"


def test_layouts_that_numpy_has_are_all_read():
    y = record(3)[0]
    plain = afmid.ringdown(y, sample_rate_hz=RATE_HZ).modes
    strided = np.repeat(y, 3)[::3]
    big = y.astype(">f8")
    column = np.asfortranarray(np.stack([y, y]).T)[:, 0]
    for other in (strided, big, column, list(y)):
        assert afmid.ringdown(other, sample_rate_hz=RATE_HZ).modes.equals(plain)
