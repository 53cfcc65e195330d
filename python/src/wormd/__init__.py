"""Watch, drive, record and analyse an earthworm robot that runs wormd.

::

    import wormd

    with wormd.Worm("worm1") as worm:  # a worm that runs on this computer, as by `wormd up`
        for cycle in worm.cycles():
            print(f"{1e3 * cycle.advance_m:.2f} mm, {1e3 * cycle.energy_electrical_j:.0f} mJ")

- `Worm`: telemetry as iterators of typed messages, and commands. A crawl lasts as long as the script.
- `read`: a log, or a CSV of positions, as pandas data frames.
- `analyze`, `explain`, `simulate`: the program's analyses, with results as objects.

Messages are `State`, `Timing`, `Estimate`, `Cycle`, `Alarm`, `Range`, `Inferred`, `CommandRecord`, `TripStatus`, `RecordingStatus` and
`BlackBoxStatus`. All units are
SI and stand in the names. Everything that can go wrong is a `WormError`. ``python -m wormd`` shows how a worm is.
"""

from ._messages import (
    MAX_CELLS,
    VERSION,
    Alarm,
    AlarmKind,
    BlackBoxStatus,
    CommandKind,
    CommandOutcome,
    CommandRecord,
    Culprit,
    Cycle,
    Estimate,
    Fault,
    HoldReason,
    Inferred,
    InferredStanding,
    Mode,
    Range,
    RecordingProblem,
    RecordingState,
    RecordingStatus,
    Severity,
    State,
    Timing,
    TripStatus,
)
from ._relay import Answer, Driver
from .analysis import Analysis, AnalysisByCurrent, CampaignAnalysis, analyze, analyze_campaign, analyze_unseen
from .errors import (
    BadName,
    NotDriver,
    NotRunning,
    OtherVersion,
    ProgramFailed,
    ProgramNotFound,
    Refused,
    RelayLost,
    Silent,
    WormError,
)
from .explanation import Effect, Explanation, Run, explain, write_campaign
from .recording import Recording, read
from .simulation import simulate
from .stream import Stream
from .worm import Latest, Recorder, Worm, alarms_of

__version__ = VERSION

__all__ = [
    "MAX_CELLS",
    "VERSION",
    "Alarm",
    "AlarmKind",
    "Analysis",
    "AnalysisByCurrent",
    "Answer",
    "BadName",
    "BlackBoxStatus",
    "CampaignAnalysis",
    "CommandKind",
    "CommandOutcome",
    "CommandRecord",
    "Culprit",
    "Cycle",
    "Driver",
    "Effect",
    "Estimate",
    "Explanation",
    "Fault",
    "HoldReason",
    "Inferred",
    "InferredStanding",
    "Latest",
    "Mode",
    "NotDriver",
    "NotRunning",
    "OtherVersion",
    "ProgramFailed",
    "ProgramNotFound",
    "Range",
    "Recorder",
    "Recording",
    "RecordingProblem",
    "RecordingState",
    "RecordingStatus",
    "Refused",
    "RelayLost",
    "Run",
    "Severity",
    "Silent",
    "State",
    "Stream",
    "Timing",
    "TripStatus",
    "Worm",
    "WormError",
    "alarms_of",
    "analyze",
    "analyze_campaign",
    "analyze_unseen",
    "explain",
    "read",
    "simulate",
    "write_campaign",
]
