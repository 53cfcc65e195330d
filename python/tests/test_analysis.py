"""The program's analyses as objects."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import types
import typing
from pathlib import Path
from typing import Any

import pytest

import wormd
from wormd import _program
from wormd._result import Result

PROGRAM = _program.find()
TABLE4 = Path(__file__).parents[2] / "examples" / "table4" / "campaign.toml"


def assert_complete(result: Result) -> None:
    """Every member of the JSON is an attribute, and every attribute that must be there is a member."""
    hints = typing.get_type_hints(type(result))
    extra = {"json", "report", "model"}
    known = {field.name for field in dataclasses.fields(result)} - extra
    # Left out of the JSON where there is none.
    optional = {name for name in known if types.NoneType in typing.get_args(hints[name])} | {"together_with"}
    members = set(result.json) - {"campaign"}
    assert members <= known, f"{type(result).__name__}: {members - known}"
    assert known - optional <= members, f"{type(result).__name__}: {known - members}"
    for name in known:
        value: Any = getattr(result, name)
        for one in value if isinstance(value, tuple) else (value,):
            if isinstance(one, Result):
                assert_complete(one)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> list[wormd.Run]:
    folder = tmp_path_factory.mktemp("simulated")
    return [wormd.Run(wormd.simulate(folder / f"up{slope}.csv", slope_deg=slope, cycles=6), slope_deg=slope) for slope in (0, 30)]


def test_an_analysis_is_an_object(recordings: list[wormd.Run], tmp_path: Path) -> None:
    analysis = wormd.analyze(recordings[1].recording, slope_deg=30, out=tmp_path / "report", progress=False)
    assert_complete(analysis)
    assert (analysis.cells, len(analysis.cycles), analysis.phase_source) == (4, 6, "recorded")
    assert analysis.mass_estimate_kg == pytest.approx(0.34, rel=0.1)
    assert 0 < analysis.mean.advance_m < 0.0115
    assert analysis.report is not None and analysis.report.stat().st_size > 1000


def test_a_worm_that_nobody_saw_is_analysed_by_its_current(recordings: list[wormd.Run], tmp_path: Path) -> None:
    config, log = tmp_path / "unseen.toml", tmp_path / "unseen.mcap"
    config.write_text("[gait]\ncycle_s = 1.25\n[tracker]\npresent = false\n")
    command = [PROGRAM, "up", "--json", "--duration", "8", "--name", f"unseen-{os.getpid() % 100_000}", "--config", str(config)]
    subprocess.run([*command, "--record", str(log)], check=True, capture_output=True)
    unseen = wormd.analyze_unseen(log, slope_deg=0, progress=False)
    assert_complete(unseen)
    assert (unseen.evidence, unseen.cells) == ("current", 4)
    assert unseen.sigma.advance_m > 0 and len(unseen.cycles) >= 2
    with pytest.raises(wormd.WormError, match="analyze_unseen"):
        wormd.analyze(log, slope_deg=0, progress=False)
    with pytest.raises(wormd.WormError, match="has positions"):
        wormd.analyze_unseen(recordings[0].recording, slope_deg=0, progress=False)


def test_runs_become_a_campaign(recordings: list[wormd.Run], tmp_path: Path) -> None:
    file = wormd.write_campaign(recordings, tmp_path / "a folder" / "campaign.toml")
    campaign = wormd.analyze_campaign(file, progress=False)
    assert_complete(campaign)
    assert [run.slope_deg for run in campaign.runs] == [0, 30]


def test_an_explanation_is_an_object_and_progress_is_told() -> None:
    told: list[tuple[str, float]] = []
    answer = wormd.explain(TABLE4, progress=lambda stage, fraction: told.append((stage, fraction)))
    assert_complete(answer)
    assert answer.verdict == "ambiguous"
    assert {effect.name for effect in (*answer.effects, *answer.rivals)} >= {"unequal-clamping", "slope-clamping"}
    assert answer.next_experiment is not None and answer.next_experiment.predictions
    assert len(told) > 5 and all(0 <= fraction <= 1 for _, fraction in told)
    assert (answer.report, answer.model) == (None, None)


def test_the_programs_message_is_the_exceptions(tmp_path: Path) -> None:
    with pytest.raises(wormd.ProgramFailed, match=r"missing\.csv") as failed:
        wormd.analyze(tmp_path / "missing.csv", slope_deg=0, progress=False)
    assert failed.value.status == 2
    with pytest.raises(wormd.ProgramFailed, match="vertigo"):
        wormd.simulate(tmp_path / "out.csv", slope_deg=0, cycles=2, effects=["vertigo:a=1"])
    with pytest.raises(wormd.ProgramNotFound, match="no-such-program"):
        wormd.simulate(tmp_path / "out.csv", slope_deg=0, cycles=2, wormd="no-such-program")
