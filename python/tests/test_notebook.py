"""The notebook from a running worm to the name of a hidden effect runs from its first cell to its last."""

from __future__ import annotations

import base64
import os
from pathlib import Path

import pytest
from conftest import PROGRAM

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")
pytest.importorskip("matplotlib")
pytest.importorskip("ipykernel")

NOTEBOOK = Path(__file__).parents[2] / "examples" / "notebooks" / "hidden_effect.ipynb"


def test_the_hidden_effect_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WORMD", PROGRAM)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "outputs are not committed: strip them"
    client = nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": tmp_path}})
    client.execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    text = "".join(output.text for output in outputs if output.get("name") == "stdout")
    assert text.count("unequal-clamping of cell 2, with a probability of") == 2, text
    print(text)
    pictures = [output.data["image/png"] for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == 4
    # WORMD_PICTURES is a folder for who wants to look at them.
    for number, picture in enumerate(pictures):
        folder = Path(os.environ.get("WORMD_PICTURES", tmp_path))
        (folder / f"notebook-{number}.png").write_bytes(base64.b64decode(picture))
