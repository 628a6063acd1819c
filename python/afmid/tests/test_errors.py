"""What is wrong is said, with what to do."""

import shutil
from pathlib import Path

import h5py
import pytest

import afmid


def hdf5(path, **attributes):
    with h5py.File(path, "w") as file:
        file.attrs.update(attributes)
    return path


def test_files_that_are_no_results_are_called_what_they_are(tmp_path):
    (tmp_path / "notes.txt").write_text("x")
    cases = {
        tmp_path: "is a folder",
        tmp_path / "notes.txt": "no HDF5 file: `afmid run",
        hdf5(tmp_path / "record.h5", sample_rate_hz=5e6): "is a recording: name it in a config",
        hdf5(tmp_path / "other.h5"): "of another program",
        hdf5(tmp_path / "stage.h5", afmid_format="stage"): "a stage file of afmid's cache",
    }
    for path, message in cases.items():
        with pytest.raises(afmid.NotAResult, match=message):
            afmid.open(path)
    with pytest.raises(FileNotFoundError, match="there is no file"):
        afmid.open(tmp_path / "nowhere.h5")


def test_formats_of_other_times_say_what_to_do(tmp_path):
    for version, message in ((3, "format 3, this reader knows 2: install a newer"), (1, "run its config again")):
        with pytest.raises(afmid.OtherFormat, match=message):
            afmid.open(hdf5(tmp_path / f"{version}.h5", afmid_format="result", afmid_format_version=version))


def test_a_file_that_was_cut_or_changed_is_refused(result, tmp_path):
    whole = result.read_bytes()
    for name, size in (("half.h5", len(whole) // 2), ("unsealed.h5", len(whole) - 20)):
        (tmp_path / name).write_bytes(whole[:size])
        with pytest.raises(afmid.NotAResult, match="cut short"):
            afmid.open(tmp_path / name)
    changed = tmp_path / "changed.h5"
    shutil.copy(result, changed)
    with h5py.File(changed, "a") as file:
        del file["entry/modes"]
        file["entry/extra"] = list(range(9999))
    with pytest.raises(afmid.NotAResult, match="changed by another program.*require_seal=False"):
        afmid.open(changed)
    with afmid.open(changed, require_seal=False) as r:
        assert len(r.records.records) > 0
        with pytest.raises(afmid.Damaged, match="/entry/modes is missing"):
            r.modes


def test_unknown_names_come_with_the_nearest(result):
    with afmid.open(result) as r:
        for wrong in (lambda: r["modse"], lambda: r.modse, lambda: r["modse.roots"]):
            with pytest.raises(afmid.UnknownName, match="^there is no stage `modse`; did you mean `modes`\\?$"):
                wrong()
        with pytest.raises(KeyError, match="there is: records, events"):
            r["xyz"]
        with pytest.raises(afmid.UnknownName, match="of stage `modes` called `root`; did you mean `roots`"):
            r["modes.root"]
        with pytest.raises(afmid.UnknownName, match="no state-space model `modle`; did you mean `model`"):
            r.model("modle")
        assert not hasattr(r, "modse") and "etfe" in dir(r) and "etfe" in r


def test_nothing_is_read_before_it_is_asked_for_and_what_was_read_stays(result, monkeypatch):
    read = []
    plain = h5py.Dataset.__getitem__
    monkeypatch.setattr(
        h5py.Dataset, "__getitem__", lambda self, *args: (read.append(self.name), plain(self, *args))[1]
    )
    with afmid.open(result) as r:
        stage = r["etfe"]
        assert stage.ports and repr(stage) and not any(name.endswith("transfer_real") for name in read)
        assert all(name.startswith(("/entry/pipeline/", "/entry/etfe/provenance/")) for name in read), read
        etfe = r.etfe
        assert {name.split("/")[2] for name in read} == {"pipeline", "etfe"}
        assert etfe is r.etfe
    assert r["etfe"]["etfe"].transfer.size > 0
    with pytest.raises(afmid.AfmidError, match="has been closed"):
        r["smoothed"].value


def test_a_result_without_modes_or_models_says_so(result, afmid_cli, tmp_path):
    (tmp_path / "bare.toml").write_text(
        f"""[pipeline]
name = "bare"
[[stage]]
id = "records"
uses = "io.records"
params = {{ files = {[str(path) for path in record_files(result)[:1]]!r} }}
"""
    )
    afmid_cli("run", tmp_path / "bare.toml", "-o", tmp_path / "bare.h5", "--cache", tmp_path / "cache")
    with afmid.open(tmp_path / "bare.h5") as r:
        with pytest.raises(afmid.UnknownName, match="no table called `modes`; there is: nothing"):
            r.modes
        with pytest.raises(afmid.AfmidError, match="holds no state-space model"):
            r.model()


def record_files(result):
    with afmid.open(result) as r:
        folder = Path(r.run["folder"])
        return [folder / path for path in r.records.records.path]
