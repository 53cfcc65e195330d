"""Logs as data frames."""

from __future__ import annotations

import tempfile
from itertools import islice
from pathlib import Path

import pytest
from conftest import Up

import wormd
from wormd import recording

pandas = pytest.importorskip("pandas")
pytest.importorskip("pyarrow")


@pytest.fixture(scope="module")
def log(session_worm: Up, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    session_worm.make_crawl()
    with session_worm.worm() as worm, worm.record(path):
        list(islice(worm.cycles(timeout=20), 2))
    return path


def test_a_log_becomes_frames(up: Up, log: Path) -> None:
    run = wormd.read(log)
    assert run.notes == ()
    assert run.metadata["worm"] == up.name
    states = run.states
    assert {"position_m_1", "position_m_4", "motor_current_a", "mode", "wall_time", "time_ns"} <= set(states)
    assert "position_m_5" not in states
    assert states.index.name == "at_s" and states.index.is_monotonic_increasing
    assert 0 <= states.index[0] < 1
    seconds = (states["time_ns"].iloc[-1] - states["time_ns"].iloc[0]) * 1e-9
    assert states.index[-1] - states.index[0] == pytest.approx(seconds, abs=1e-9)
    assert (states["sequence"].diff().dropna() == 1).all(), "no state is lost"
    assert set(states["mode"]) == {"crawling"}
    cycles = run.cycles
    assert len(cycles) >= 2 and cycles["advance_m"].between(0.004, 0.009).all()
    assert cycles.index[-1] <= states.index[-1] + 0.5, "one clock for all frames"
    assert len(run.estimates) > 100 and len(run.timing) > 0.99 * len(states)
    assert "kind" in run.alarms and run.range.empty and "range_m" in run.range
    assert run.trip.empty and "phase" in run.trip and "standing" in run.inferred
    assert "state" in repr(run)


def test_a_log_that_was_cut_is_read_as_far_as_it_goes(log: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[: log.stat().st_size // 2])
    run = wormd.read(cut)
    assert run.notes, "it says so"
    assert 0 < len(run.states) < len(wormd.read(log).states)
    no_log = tmp_path / "none.mcap"
    no_log.write_bytes(b"no log")
    with pytest.raises(wormd.ProgramFailed) as failed:
        wormd.read(no_log)
    assert failed.value.status == 2 and "none.mcap" in str(failed.value)


def test_estimates_before_the_first_state_have_no_place_in_time() -> None:
    folder: tempfile.TemporaryDirectory[str] = tempfile.TemporaryDirectory()
    times = pandas.Series([None, 5_000_000_000, 6_000_000_000], dtype="Int64")
    pandas.DataFrame({"time_ns": times}).to_parquet(Path(folder.name) / "estimate.parquet")
    estimates = recording.Recording(Path("x.mcap"), recording._LogTables(folder)).estimates
    assert list(estimates.index) == [0.0, 1.0]
    assert list(estimates["time_ns"]) == [5_000_000_000, 6_000_000_000]


def test_a_recorder_says_why_it_cannot(up: Up, log: Path) -> None:
    with up.worm() as worm, pytest.raises(wormd.ProgramFailed, match="run.mcap") as failed:
        worm.record(log)
    assert failed.value.status == 2


def test_positions_as_csv(tmp_path: Path) -> None:
    path = wormd.simulate(tmp_path / "up.csv", slope_deg=30, cycles=3, seed=2)
    run = wormd.read(path)
    assert {"position_m_1", "position_m_4", "phase"} <= set(run.states)
    assert run.states.index[-1] == pytest.approx(7.5, abs=0.1)
    assert run.cycles.empty
    other = tmp_path / "other.csv"
    other.write_text("a,b\n1,2\n")
    with pytest.raises(wormd.WormError, match="a recording has time_s"):
        wormd.read(other)
