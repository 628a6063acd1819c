"""docs/notebooks: every notebook runs on a fresh result, and is stored with small outputs."""

import base64
import os
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = sorted((Path(__file__).parents[3] / "docs/notebooks").glob("*.ipynb"))
IMAGE_BYTES = 100_000


def test_there_is_a_notebook():
    assert NOTEBOOKS


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_runs_from_top_to_bottom(path, result, monkeypatch):
    monkeypatch.setenv("AFMID_RESULT", str(result))
    source = str(Path(__file__).parents[1] / "src")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([source, os.environ.get("PYTHONPATH", "")]))
    book = nbformat.read(path, as_version=4)
    stored = [len(cell.outputs) for cell in book.cells if cell.cell_type == "code"]
    # a cell that hangs is an error: the slowest takes two seconds on an idle machine
    NotebookClient(
        book, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(path.parent)}}
    ).execute()
    assert [len(cell.outputs) for cell in book.cells if cell.cell_type == "code"] == stored
    pictures = [
        output for cell in book.cells for output in cell.get("outputs", []) if "image/png" in output.get("data", {})
    ]
    assert len(pictures) >= 2


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_is_stored_with_its_outputs_and_they_are_small(path):
    book = nbformat.read(path, as_version=4)
    code = [cell for cell in book.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1)), "not executed from top to bottom"
    assert str(Path.home()) not in path.read_text()
    for cell in code:
        for output in cell.outputs:
            assert output.output_type != "error" and output.get("name") != "stderr"
            image = output.get("data", {}).get("image/png", "")
            assert len(base64.b64decode(image)) < IMAGE_BYTES
