"""Names of worms and of files, and a program that is none."""

from __future__ import annotations

from pathlib import Path

import pytest

import wormd
from wormd import _program


@pytest.mark.parametrize("name", ["", "../x", "-x", "Worm"])
def test_a_name_that_no_worm_can_have_is_refused(name: str) -> None:
    with pytest.raises(wormd.BadName, match="no worm's name") as refused:
        wormd.Worm(name)
    assert isinstance(refused.value, ValueError) and isinstance(refused.value, wormd.WormError)


def test_a_file_name_may_begin_with_a_dash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    wormd.simulate("-up.csv", slope_deg=0, cycles=3)
    wormd.analyze("-up.csv", slope_deg=0)
    with pytest.raises(wormd.ProgramFailed, match=r"-none\.mcap"):
        wormd.read("-none.mcap")
    with pytest.raises(wormd.ProgramFailed, match=r"-none\.csv"):
        wormd.explain("-none.csv", slope_deg=0)


def test_what_prints_no_json_has_failed() -> None:
    with pytest.raises(wormd.ProgramFailed, match="printed what is no JSON"):
        _program.call_json("echo", ["hello"])
