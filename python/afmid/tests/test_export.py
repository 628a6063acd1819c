"""`afmid export`: a model read back from its MATLAB and JSON files is the one in the result, bit for bit."""

import json
import subprocess

import numpy as np
import pytest
from scipy.io import loadmat

import afmid

MATRICES = ("A", "B", "C", "D", "K")


@pytest.fixture(scope="module")
def model(result):
    with afmid.open(result) as r:
        return r.model("model")


@pytest.fixture(scope="module")
def exported(afmid_cli, result, tmp_path_factory):
    """Writes a model and gives its path."""

    def write(format, *more):
        path = tmp_path_factory.mktemp("export") / f"m.{format}"
        assert afmid_cli("export", result, "--model", format, "-o", path, *more).strip() == str(path)
        return path

    return write


def test_the_matlab_file_is_the_model(exported, model):
    mat = loadmat(exported("mat"), struct_as_record=False, squeeze_me=False)
    for name in MATRICES:
        assert np.array_equal(mat[name], getattr(model, name)), name
    assert np.array_equal(mat["covariance"], model.covariance)
    assert [str(name.item()) for name in mat["parameter_names"][:, 0]] == list(model.parameter_names)
    assert np.array_equal(mat["parameters"][:, 0], model.parameters) and np.array_equal(mat["x0"][:, 0], model.x0)
    assert mat["Ts"].item() == mat["sample_time_s"].item() == model.sample_time_s
    assert mat["innovation_variance"].item() == model.innovation_variance
    units = mat["units"].item()
    assert (units.time.item(), units.input.item(), units.output.item()) == ("s", "V", "V")
    attributes = mat["attributes"].item()
    assert sorted(attributes._fieldnames) == sorted(model.attributes)
    assert attributes.converged.dtype == np.bool_ or attributes.converged.item() == 1
    assert attributes.offset_v.item() == model.attributes["offset_v"] and attributes.set.item() == "all"
    poles = mat["poles"][:, 0]
    # eigenvalues of two programs: rounding times a condition of at most 1e4
    assert all(np.abs(model.poles - pole).min() < 1e-11 for pole in poles) and len(poles) == model.order
    assert (mat["source"].item(), mat["uses"].item()) == ("model.model", "model.pem")


def test_the_json_file_is_the_model_and_knows_no_nan(exported, model):
    text = exported("json").read_text()
    found = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    for name in (*MATRICES, "covariance", "x0", "parameters"):
        assert np.array_equal(np.array(found[name]), getattr(model, name)), name
    assert found["parameter_names"] == list(model.parameter_names) and found["attributes"] == model.attributes
    assert found["sample_time_s"] == model.sample_time_s
    assert found["units"] == {"time": "s", "input": "V", "output": "V"}
    assert next(iter(found)) == "afmid_model" and found["source"] == "model.model"


def test_poles_have_the_frequencies_of_the_modal_table(exported, result):
    poles = json.loads(exported("json").read_text())["poles"]
    with afmid.open(result) as r:
        for mode in r.modes.itertuples():
            near = min(poles, key=lambda pole: abs(pole["frequency_hz"] - mode.frequency_hz))
            # eigenvalues of A here, of the sections there: rounding over the distance to the circle, 1e-3
            assert abs(near["frequency_hz"] / mode.frequency_hz - 1) < 1e-9
            assert abs(near["quality_factor"] / mode.quality_factor - 1) < 1e-7


def test_another_stage_is_exported_by_its_name(exported, result):
    found = json.loads(exported("json", "--stage", "half").read_text())
    with afmid.open(result) as r:
        assert np.array_equal(np.array(found["B"]), r.model("half").B)
    assert found["source"] == "half.model" and found["attributes"]["set"] == "identification"


def test_the_same_model_gives_the_same_bytes(exported):
    for format in ("mat", "json"):
        assert exported(format).read_bytes() == exported(format).read_bytes()


@pytest.fixture
def refused(program, tmp_path):
    """Runs a command that ends with exit code 2 and nothing on stdout; gives what it says."""

    def run(*arguments):
        done = subprocess.run(
            [program, "export", *map(str, arguments)], capture_output=True, text=True, check=False, cwd=tmp_path
        )
        assert (done.returncode, done.stdout) == (2, ""), done.stderr
        return done.stderr

    return run


def test_what_cannot_be_exported_is_refused_with_what_to_do(refused, result, tmp_path):
    assert "no state-space model `modle`" in (errors := refused(result, "--model", "mat", "--stage", "modle"))
    assert "did you mean `model`?" in errors
    assert "possible values: mat, json" in refused(result, "--model", "xml")
    assert "--model" in refused(result)
    assert "there is no file" in refused("nowhere.h5", "--model", "mat")
    (tmp_path / "mine.mat").write_bytes(b"MATLAB 5.0 MAT-file, Platform: GLNXA64" + bytes(200))
    (tmp_path / "mine.json").write_text('{"modes": []}')
    for name in ("mine.mat", "mine.json"):
        before = (tmp_path / name).read_bytes()
        assert "only a file that `afmid export` wrote is replaced" in refused(result, "--model", "mat", "-o", name)
        assert (tmp_path / name).read_bytes() == before
    assert "is an input of this command" in refused(result, "--model", "mat", "-o", result)


def test_the_file_has_a_name_by_itself_and_is_replaced_by_another_export(program, result, tmp_path):
    for format in ("mat", "json", "mat"):
        command = [program, "export", str(result), "--model", format]
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
        assert done.stdout == f"{result.stem}-model.{format}\n" and done.stderr == ""
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".json", ".mat"]
