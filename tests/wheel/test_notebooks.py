"""examples/notebooks: stored without outputs, every one runs from top to bottom, and what it finds is the truth."""

import json
import os
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = ROOT / "examples/notebooks"
MOST_BYTES = 10_000


def code_cells(path):
    book = json.loads(path.read_text(encoding="utf-8"))
    return [cell for cell in book["cells"] if cell["cell_type"] == "code"]


@pytest.fixture
def run(monkeypatch, tmp_path):
    """Runs the cells of a notebook in an empty folder; what they have defined."""
    plt.switch_backend("agg")
    monkeypatch.setenv("AFMID_CACHE", str(tmp_path / "cache"))

    def of(name):
        path = NOTEBOOKS / f"{name}.ipynb"
        defined = {"__name__": "__main__"}
        for number, cell in enumerate(code_cells(path), 1):
            exec(compile("".join(cell["source"]), f"{path.name}, cell {number}", "exec"), defined)
        return defined

    yield of
    plt.close("all")


def test_they_are_small_have_no_outputs_and_are_all_run_here():
    here = Path(__file__).read_text(encoding="utf-8")
    for path in NOTEBOOKS.glob("*.ipynb"):
        assert path.stat().st_size < MOST_BYTES
        assert all(not cell["outputs"] and cell["execution_count"] is None for cell in code_cells(path))
        assert f'run("{path.stem}")' in here, path.name


# a finding of 12 to 16 deviates beyond 4 standard errors has a chance of 1e-3, beyond 5 of 1e-5
SIGMAS = 5.0


@pytest.mark.filterwarnings("ignore::afmid.AfmidWarning")
def test_the_paper_s_modes_are_those_of_the_simulated_lever(run):
    table = run("paper")["table"]
    of_model = table.loc["pem"]
    assert np.abs(of_model[["error / std", "Q error / std"]].values).max() < SIGMAS
    # the notebook says why: standard errors without thermal motion are half of what they should be
    assert np.abs(table.loc["ringdown", ["error / std", "Q error / std"]].values).max() < 2 * SIGMAS


def test_a_hammer_test_finds_frequencies_damping_and_shapes(run):
    found = run("hammer")
    assert np.abs(found["table"][["error / std", "damping error / std"]].values).max() < SIGMAS
    shapes = found["found"].shapes
    errors = np.abs(shapes["shape"].values.real - found["true"])
    assert np.all(errors <= SIGMAS * shapes["re_std"].values + 1e-12)


@pytest.mark.filterwarnings("ignore::afmid.AfmidWarning")
def test_an_oscillator_that_is_not_linear_is_diagnosed(run, monkeypatch):
    monkeypatch.delenv("AFMID_SILVERBOX", raising=False)
    found = run("duffing")
    parameters = found["diagnosis"].parameters.set_index("parameter")
    k3 = parameters.loc["k3"]
    assert found["diagnosis"].verdict == "named" and k3.cause == "duffing"
    assert abs(k3.value - found["cubic"] / found["w"] ** 2) < SIGMAS * k3["std"]
    assert Path("diagnosis.html").stat().st_size > 10_000


@pytest.mark.filterwarnings("ignore::afmid.AfmidWarning")
def test_silverbox_has_a_cubic_spring(run, monkeypatch, capsys):
    data = Path(os.environ.get("AFMID_DATA", ROOT / "../shared/data"))
    recording = data / "silverbox/SNLS80mV.mat"
    if not recording.is_file():
        with capsys.disabled():
            print("\nstand-in: 1 recording simulated in place of Silverbox")
        return
    monkeypatch.setenv("AFMID_SILVERBOX", str(recording))
    diagnosis = run("duffing")["diagnosis"]
    assert diagnosis.verdict == "named" and "duffing" in set(diagnosis.causes.id)


@pytest.mark.filterwarnings("ignore::afmid.AfmidWarning")
def test_a_hundred_fits_scatter_as_their_errors_say(run):
    coverage = run("many")["coverage"]
    # 100 fits: a standard deviation is known to 7 %, a coverage of 95 % to 2.2 %; 4 sigma of either
    assert (np.abs(coverage["scatter / stated"] - 1) < 0.28).all()
    assert (coverage["coverage"] > 0.95 - 0.088).all()
