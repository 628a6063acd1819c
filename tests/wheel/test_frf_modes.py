"""`afmid.frf_modes` against known truth, and against the program on the same responses."""

import copy
import inspect
import json
import pickle

import afmid
import numpy as np
import pytest
from afmid import _native
from scipy.signal import lfilter

# frequency, damping ratio, shape at unit modal mass over three points; the second is the driving point
MODES = [(60.0, 0.01, (0.4, 0.8, 1.0)), (140.0, 0.008, (0.9, -0.6, 0.5))]
F = np.arange(20.0, 200.0, 0.25)
STD = 2e-6


def receptances(seed=None, f=F):
    """Receptances of the three points, (responses, frequencies), in complex noise of `STD`."""
    found = np.zeros((3, len(f)), complex)
    for frequency, damping, shape in MODES:
        omega, s = 2 * np.pi * frequency, 2j * np.pi * f
        found += np.outer(np.array(shape) * shape[1], 1 / (s**2 + 2 * damping * omega * s + omega**2))
    if seed is None:
        return found
    noise = np.random.default_rng(seed).normal(0, STD / np.sqrt(2), (2, *found.shape))
    return found + noise[0] + 1j * noise[1]


def test_modes_and_shapes_are_within_their_errors():
    off = []
    for seed in range(10):
        found = afmid.frf_modes(
            receptances(seed),
            frequency_hz=F,
            std=np.full((3, len(F)), STD),
            points=["a", "b", "c"],
            unit="m/N",
            driving_point=2,
        )
        assert len(found.modes) == 2 and found.shapes.channel.values.tolist() == ["a", "b", "c"]
        for (frequency, damping, shape), (number, mode) in zip(MODES, found.modes.iterrows(), strict=True):
            off.append((mode.frequency_hz - frequency) / mode.frequency_std_hz)
            off.append((mode.damping_ratio - damping) / mode.damping_ratio_std)
            of_shape = found.shapes.isel(mode=number)
            for point, value in enumerate(np.array(shape) / max(shape, key=abs)):
                if value != 1:
                    off.append((of_shape["shape"][point].item().real - value) / of_shape["re_std"][point].item())
                    off.append(of_shape["shape"][point].item().imag / of_shape["im_std"][point].item())
        scaled = [point["value"] for point in found.details["modes"][0]["mass_normalised"]]
        assert np.allclose(scaled, MODES[0][2], rtol=0.03)
    # 120 standard normal numbers: the rms is 1 +- 0.06
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.4 and max(map(abs, off)) < 4


def test_the_same_numbers_as_the_program_bit_for_bit(afmid_cli, tmp_path):
    h = receptances(3)
    columns = np.column_stack([F, *(part for row in h for part in (1e3 * row.real, 1e3 * row.imag))])
    titles = ["frequency (Hz)", *(f"{name} {part} (mm/N)" for name in "abc" for part in ("real", "imag"))]
    np.savetxt(tmp_path / "h.csv", columns, delimiter=",", header=",".join(titles), comments="", fmt="%.17g")
    (tmp_path / "a.toml").write_text(
        '[pipeline]\nname = "a"\n\n[[stage]]\nid = "frf"\nuses = "io.frf"\n'
        'params = { files = ["h.csv"], driving_point = 2, positions_m = [0.1, 0.2, 0.3], band_hz = [20, 200] }\n\n'
        '[[stage]]\nid = "modes"\nuses = "model.frf_modes"\ninputs = { frf = "frf.frf" }\nparams = { max_modes = 4 }\n'
    )
    afmid_cli("run", "a.toml", "-o", "a.h5", cwd=tmp_path)
    stored = afmid.open(tmp_path / "a.h5")
    values = 1e3 * h.real + 1j * (1e3 * h.imag)
    found = afmid.frf_modes(
        values, frequency_hz=F, unit="mm/N", driving_point=2, positions_m=[0.1, 0.2, 0.3], max_modes=4
    )
    for name in ("modes", "diagram"):
        assert found.__dict__[name].equals(stored["modes"][name]), name
    for name in ("shape", "mac"):
        assert np.array_equal(found.shapes[name], stored["modes"]["shapes"][name]), name
    assert np.array_equal(found.fit["fitted"], stored["modes"]["fit"]["fitted"])
    assert (
        found.fit["fitted"].units == "m/N" and list(found.warnings) == stored["frf"].warnings + stored["modes"].warnings
    )
    # the artifact of a result, read from its file
    again = afmid.frf_modes(stored["frf"]["frf"], max_modes=4)
    assert again.modes.equals(found.modes)


def test_measured_input_and_output_lead_to_modes_as_the_program_has_them(by_config):
    rng = np.random.default_rng(4)
    u = rng.standard_normal(40_000)
    y = [lfilter(b, [1.0, -1.6, 0.9], u) + 0.01 * rng.standard_normal(len(u)) for b in ([0, 0.3], [0, 0.2, -0.1])]
    stages = [
        ("frf", "spectrum.measured_frf", {"pair": "data.pair"}, {"block_samples": 2000, "quantity": "receptance"}),
        ("modes", "model.frf_modes", {"frf": "frf.frf"}, {"modes": 1}),
    ]
    stored = by_config([({"f (N)": u}, {"a (m)": y[0], "b (m)": y[1]})], stages, 1e3)
    measured = afmid.frf(
        u, y, sample_rate_hz=1e3, block_samples=2000, quantity="receptance", inputs=["f"], outputs=["a", "b"],
        input_unit="N", output_unit="m",
    )  # fmt: skip
    for response in (measured, pickle.loads(pickle.dumps(measured)), measured.response):
        with pytest.warns(afmid.AfmidWarning, match="neighbouring lines"):
            found = afmid.frf_modes(response, modes=1)
        assert found.modes.equals(stored["modes"]["modes"])
        assert np.array_equal(found.shapes["shape"], stored["modes"]["shapes"]["shape"])
        assert found.details == stored["modes"]["summary"]


def test_outputs_and_inputs_make_a_grid():
    h = receptances(5)
    found = afmid.frf_modes(h[:, None], frequency_hz=F, outputs=["a", "b", "c"], inputs=["b"], unit="m/N")
    assert found.shapes.channel.values.tolist() == ["a", "b", "c"] and found.details["driving_point"] == 2
    with pytest.warns(afmid.AfmidWarning, match="no driving point"):
        one = afmid.frf_modes(h[0], frequency_hz=F, unit="m/N")
    assert one.shapes.sizes["channel"] == 1


def test_the_other_sign_is_turned_and_said():
    with pytest.warns(afmid.AfmidWarning, match="responses: the phases have the other sign"):
        found = afmid.frf_modes(receptances(6).conj(), frequency_hz=F, unit="m/N", driving_point=2)
    assert np.allclose(found.modes.frequency_hz, [60, 140], rtol=1e-3)


def test_bad_input_is_refused_with_what_was_found():
    h = receptances(7)
    with pytest.raises(afmid.DataError, match="frequency_hz is missing"):
        afmid.frf_modes(h)
    with pytest.raises(afmid.DataError, match=r"shape \(3, 719\)"):
        afmid.frf_modes(h[:, 1:], frequency_hz=F)
    with pytest.raises(afmid.DataError, match="do not ascend"):
        afmid.frf_modes(h, frequency_hz=F[::-1])
    with pytest.raises(afmid.DataError, match="std has the shape"):
        afmid.frf_modes(h, frequency_hz=F, std=np.ones(len(F)))
    with pytest.raises(afmid.DataError, match="2 names"):
        afmid.frf_modes(h, frequency_hz=F, points=["a", "b"])
    with pytest.raises(afmid.ConfigError, match="directions"):
        afmid.frf_modes(h, frequency_hz=F, directions=[2])
    with pytest.raises(afmid.ConfigError, match="max_order"):
        afmid.frf_modes(h, frequency_hz=F, unit="m/N", driving_point=2, max_order=2)
    with pytest.raises(afmid.DataError, match="is `mobility`, m/N is the unit of a `receptance`"):
        afmid.frf_modes(h, frequency_hz=F, unit="m/N", quantity="mobility")
    u = np.random.default_rng(1).standard_normal(20_000)
    measured = afmid.frf(u, np.roll(u, 1), sample_rate_hz=1e3, quantity="transfer")
    with pytest.raises(afmid.ConfigError, match="`unit` is of values"):
        afmid.frf_modes(measured, unit="m/N")


def test_a_result_is_pickled_copied_shown_and_drawn():
    found = afmid.frf_modes(receptances(8), frequency_hz=F, unit="m/N", driving_point=2)
    for again in (pickle.loads(pickle.dumps(found)), copy.copy(found), copy.deepcopy(found)):
        assert again.modes.equals(found.modes) and again.shapes.identical(found.shapes)
    assert "frequency (Hz)" in repr(found) and found._repr_html_().startswith("<table>")
    assert found.mac().loc[2, 2] == pytest.approx(1.0)
    assert [axes.get_ylabel() for axes in found.plot().axes] == ["magnitude (m/N)", "mode indicator"]


def test_defaults_are_the_stage_s():
    given = {name: of.default for name, of in inspect.signature(afmid.frf_modes).parameters.items()}
    stage = json.loads(_native.stage_parameters("model.frf_modes"))
    assert {name: given[name] for name in stage} == stage
