"""Recordings as data frames."""

from __future__ import annotations

import tempfile
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._messages import MAX_CELLS, Alarm, CommandRecord, Cycle, Estimate, Inferred, Range, State, Timing, TripStatus
from ._program import StrPath, call
from ._topic import Topic
from .errors import WormError

if TYPE_CHECKING:
    import pandas

_TIMES = {"cycle": "end_ns", "range": "end_ns", "timing": "deadline_ns"}
"""The field with the time of a topic's messages, where it is not `time_ns`."""
_INDEX = "at_s"
_CSV_NAMES = {"gait_phase": "phase"}


class Recording:
    """A recording, one data frame for each topic. They are read when they are first asked for.

    A row is a message, and columns are named as the fields of the messages: `State`, `Cycle` and so on. A field over cells
    has a column for each cell, from 1: ``position_m_1``. Numbers that are not known are NaN, enumerations are texts.

    The index ``at_s`` counts seconds from the beginning of the recording, and is the same for all frames. The messages'
    own times, ns of CLOCK_MONOTONIC, are columns: ``time_ns``, ``end_ns``, ``deadline_ns``. ``wall_time`` is UTC.
    """

    path: Path
    """The file."""
    notes: tuple[str, ...]
    """What could not be read, in words: where it was cut off, or is damaged."""
    metadata: dict[str, str]
    """Which worm, and what wrote it; empty for a CSV."""
    config: str | None
    """The worm's configuration, TOML; None where it was the worm of the paper, or, as a note says, is not known."""

    def __init__(self, path: Path, tables: _Tables, notes: tuple[str, ...] = ()) -> None:
        self.path, self.notes = path, notes
        self.metadata, self.config = tables.metadata, tables.config
        self._tables = tables

    @cached_property
    def states(self) -> pandas.DataFrame:
        """What the controller measured and commanded: one row for each tick."""
        return self._frame(State.TOPIC)

    @cached_property
    def timing(self) -> pandas.DataFrame:
        """How long the parts of each tick took."""
        return self._frame(Timing.TOPIC)

    @cached_property
    def estimates(self) -> pandas.DataFrame:
        """Deformations, contact points, forces and energy: one row for each tracker sample."""
        return self._frame(Estimate.TOPIC)

    @cached_property
    def cycles(self) -> pandas.DataFrame:
        """What each gait cycle did and cost, beside what the model predicts."""
        return self._frame(Cycle.TOPIC)

    @cached_property
    def alarms(self) -> pandas.DataFrame:
        """Alarms as they were raised and cleared."""
        return self._frame(Alarm.TOPIC)

    @cached_property
    def range(self) -> pandas.DataFrame:
        """How far the battery would last, after each gait cycle."""
        return self._frame(Range.TOPIC)

    @cached_property
    def commands(self) -> pandas.DataFrame:
        """What the controller was told, by whom, and what it made of it."""
        return self._frame(CommandRecord.TOPIC)

    @cached_property
    def trip(self) -> pandas.DataFrame:
        """How a trip stood, as it went on."""
        return self._frame(TripStatus.TOPIC)

    @cached_property
    def inferred(self) -> pandas.DataFrame:
        """What the motor's current alone says, after each gait cycle."""
        return self._frame(Inferred.TOPIC)

    def __repr__(self) -> str:
        return f"<Recording {self.path}: {', '.join(self._tables.names) or 'no messages'}>"

    def _frame(self, topic: Topic[Any]) -> pandas.DataFrame:
        return self._tables.frame(topic)


class _Tables:
    """Where the frames come from."""

    names: list[str]
    """The topics that there are messages of."""
    metadata: dict[str, str]
    config: str | None

    def frame(self, topic: Topic[Any]) -> pandas.DataFrame:
        """Return the frame of a topic, empty where it has no messages."""
        pd = _pandas()
        index = pd.Index([], name=_INDEX, dtype=float)
        empty: pandas.DataFrame = pd.DataFrame(columns=[field[0] for field in topic.memory._fields_], index=index)
        return empty


class _LogTables(_Tables):
    """Tables that ``wormd export`` has made of a log."""

    def __init__(self, folder: tempfile.TemporaryDirectory[str]) -> None:
        self._folder = folder  # is removed with this object
        self._files = {table.stem: table for table in Path(folder.name).glob("*.parquet")}
        self.names = sorted(self._files)
        self.metadata, self.config = self._facts()
        self._begun_ns = self._begin()

    def frame(self, topic: Topic[Any]) -> pandas.DataFrame:
        file = self._files.get(topic.name)
        if file is None:
            return super().frame(topic)
        time = _TIMES.get(topic.name, "time_ns")
        # An estimate before the first state has no time, and no place in a frame by time.
        frame = _pandas().read_parquet(file, filters=[(time, ">=", 0)])
        seconds = (frame[time] - self._begun_ns) * 1e-9
        indexed: pandas.DataFrame = frame.set_index(seconds.rename(_INDEX))
        return indexed

    def _facts(self) -> tuple[dict[str, str], str | None]:
        from pyarrow import parquet  # noqa: PLC0415, an extra

        for file in self._files.values():
            stored = parquet.read_schema(file).metadata or {}
            facts = {key.decode(): value.decode() for key, value in stored.items()}
            config = facts.pop("worm.toml", None)
            return {key: value for key, value in facts.items() if not key.startswith(("ARROW", "schema"))}, config
        return {}, None

    def _begin(self) -> int:
        """Return the time of the beginning: the log's own, or that of the first message."""
        if "begun_monotonic_ns" in self.metadata:
            return int(self.metadata["begun_monotonic_ns"])
        firsts = []
        for name, file in self._files.items():
            column = _TIMES.get(name, "time_ns")
            firsts += _pandas().read_parquet(file, columns=[column])[column].dropna().head(1).tolist()
        return int(min(firsts, default=0))


class _PositionTables(_Tables):
    """A CSV of positions."""

    def __init__(self, path: Path) -> None:
        try:
            frame = _pandas().read_csv(path, comment="#", skipinitialspace=True)
        except (ValueError, OSError) as error:
            raise WormError(f"{path} is no CSV that can be read: {error}") from error
        if "time_s" not in frame or "x1_m" not in frame:
            raise WormError(
                f"{path} has the columns {', '.join(map(str, frame.columns[:6]))}; a recording has time_s, x1_m, x2_m, … "
                "(docs/experiment.md). wormd.analyze also reads what motion capture exports"
            )
        cells = {f"x{cell}_m": f"position_m_{cell}" for cell in range(1, MAX_CELLS + 1)}
        self._states = frame.rename(columns=cells | _CSV_NAMES).set_index("time_s").rename_axis(_INDEX)
        self.names, self.metadata, self.config = [State.TOPIC.name], {}, None

    def frame(self, topic: Topic[Any]) -> pandas.DataFrame:
        return self._states if topic.name == State.TOPIC.name else super().frame(topic)


def read(path: StrPath, *, wormd: StrPath | None = None) -> Recording:
    """Read a log of this version or an older one, also a damaged one as far as it goes; or a CSV of positions.

    Args:
        path: an MCAP file of ``wormd record`` or ``wormd up --record``; or a ``*.csv`` with ``time_s``, ``x1_m``, ``x2_m``, …
            (docs/experiment.md), which becomes the frame `Recording.states`.
        wormd: the program, which decodes logs.

    Raises:
        ProgramFailed: the file is no such log.
        WormError: it is no such CSV.
    """
    _pandas()
    path = Path(path)
    if path.suffix.lower() == ".csv":
        return Recording(path, _PositionTables(path))
    folder: tempfile.TemporaryDirectory[str] = tempfile.TemporaryDirectory(prefix="wormd-")
    try:
        _, notes = call(wormd, ["export", "--parquet", folder.name, "--force", "--", path], progress=False)
        return Recording(path, _LogTables(folder), tuple(notes))
    except BaseException:
        folder.cleanup()
        raise


def _pandas() -> Any:
    try:
        import pandas  # noqa: PLC0415, an extra
        import pyarrow  # noqa: F401, PLC0415
    except ImportError as error:
        raise WormError("data frames need pandas and pyarrow: pip install pandas pyarrow") from error
    return pandas
