"""What the reader gives is what `afmid show --json` prints."""

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import afmid


def as_shown(value):
    """An artifact in the words of `afmid show --json`."""
    if isinstance(value, pd.DataFrame):
        return json.loads(value.to_json(orient="records", double_precision=15))
    if isinstance(value, xr.Dataset):
        axes = [
            {"name": name, "unit": axis.units, "length": axis.size, "first": float(axis[0]), "last": float(axis[-1])}
            for name, axis in value.coords.items()
        ]
        variables = [
            {"name": name, "unit": v.units, "dims": list(v.dims), "shape": list(v.shape)}
            for name, v in value.data_vars.items()
        ]
        return {"axes": axes, "variables": variables, "attributes": value.attrs}
    assert isinstance(value, (dict, list)), type(value)
    return value


@pytest.fixture(scope="module")
def r(result):
    with afmid.open(result) as r:
        yield r


def test_the_list_of_stages_is_the_programs(r, afmid_cli, result):
    shown = json.loads(afmid_cli("show", result, "--json"))
    assert (r.name, r.seed, r.program) == (shown["name"], shown["seed"], shown["program"])
    for stage, of in zip(r.stages.values(), shown["stages"], strict=True):
        assert (stage.id, stage.uses, stage.version, stage.warnings) == (
            of["id"],
            of["uses"],
            of["version"],
            of["warnings"],
        )
        assert stage.ports == {artifact["port"]: artifact["shape"] for artifact in of["artifacts"]}


def test_every_summary_is_the_document_that_show_prints(r, show):
    summaries = [stage for stage in r.stages.values() if "summary" in stage]
    assert len(summaries) > 5
    for stage in summaries:
        assert stage.summary == show(stage.id), stage.id


def test_a_stage_without_summary_is_shown_by_its_artifacts(r, show):
    shown = show("window")
    assert as_shown(r["window.windowed"]) == shown["windowed"]


def test_modes_are_the_numbers_of_show_to_the_last_bit(r, show):
    shown = show("modes")["modes"]
    assert len(r.modes) == len(shown) > 0
    for row, of in zip(r.modes.to_dict("records"), shown):
        assert {name: row[name] for name in of} == of


def test_every_artifact_opens(r):
    kinds = {
        "array": xr.Dataset,
        "table": pd.DataFrame,
        "document": dict,
        "state-space model": afmid.Model,
        "recording": afmid.Recording,
    }
    seen = set()
    for stage in r.stages.values():
        for port, shape in stage.ports.items():
            assert isinstance(stage[port], kinds[shape]), f"{stage.id}.{port}"
            seen.add(shape)
    assert seen == set(kinds)


def test_complex_variables_are_joined_and_carry_unit_and_meaning(r, result):
    transfer = r.etfe.transfer
    with xr.open_dataset(result, group="entry/etfe/etfe", engine="h5netcdf") as stored:
        assert np.array_equal(transfer.real, stored.transfer_real, equal_nan=True)
        assert np.array_equal(transfer.imag, stored.transfer_imag, equal_nan=True)
    assert transfer.attrs == {"units": "1", "long_name": "transfer function"}
    assert not any(name.endswith(("_real", "_imag", "_magnitude")) for name in r.etfe.variables)
    assert r.etfe.frequency_hz.attrs == {"units": "Hz", "long_name": "frequency"}


def test_tables_keep_order_units_text_and_flags(r):
    roots = r["modes.roots"]
    assert list(roots.columns[:3]) == ["kind", "class", "frequency_hz"]
    assert set(roots["kind"]) == {"pole", "zero"}
    assert roots.attrs["units"]["s_re"] == "rad/s" and roots.attrs["long_name"]["kind"] == "pole or zero"
    assert r.records.channels.has_fill_code.dtype == bool


def test_config_parameters_files_and_warnings(r, afmid_cli, result):
    assert r.config.startswith("#:schema")
    assert r["model"].params["order"] == 11 and r["modes"].inputs["model"] == "model.model"
    assert len(r.sources) == len(r.records.records)
    assert list(r.sources.blake3) == list(r.records.records.blake3)
    assert r.run["threads"] >= 1 and len(r.run["stage_seconds"]) == len(r.stages)
    assert json.loads(json.dumps(r.provenance))["stages"]["records"]["sources"][0]["size"] > 0


def test_the_last_result_with_a_modal_table_or_a_model_is_found(r):
    assert r.modes is r["modes"]["modes"]
    assert r.model().attributes["set"] == "all"
    assert r.model("half") is r["half.model"]
