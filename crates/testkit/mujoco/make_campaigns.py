"""Makes campaigns of MuJoCo worms in which an effect is hidden, each with its truth.

    python make_campaigns.py --split development --out FOLDER

writes FOLDER/NAME/{campaign.toml, worm.toml, run1.csv ..., truth.json}; `wormd explain FOLDER/NAME/campaign.toml` reads it.
Needs `mujoco` and `numpy`, as listed in tests/clients.txt.
"""

import argparse
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import effects
from campaign import draw, make
from worm import CrawlFailed

# Below the first seed of each split, and how many campaigns there are of each kind: clean, single, stranger, onset.
SPLITS = {
    "sample": (9_100_007, (1, 1, 1, 0)),
    "development": (41_600_000, (12, 24, 8, 4)),
    "development-clean": (41_700_000, (40, 0, 0, 0)),
    "development-single": (41_800_000, (0, 220, 0, 0)),
    "sealed": (73_200_000, (66, 132, 54, 12)),
    "sealed-single": (73_400_000, (0, 132, 0, 0)),
    "sealed-stranger": (73_500_000, (0, 0, 54, 0)),
}
KINDS = ("clean", "single", "stranger", "onset")
# How large campaigns are where they are not of the usual size.
SIZE_OF = {"sample": "small", "development-clean": "varied"}
# A drawn worm that does not crawl is drawn again with the next of so many seeds.
ATTEMPTS = 10


def strangers_of(split: str) -> dict:
    """The kinds of strangers of a split: those of a sealed one are never tuned on."""
    return effects.STRANGERS["sealed" if split.startswith("sealed") else "development"]


def cases(split: str) -> list:
    """(name, kind, what is hidden, seed) of every campaign of a split."""
    base, counts = SPLITS[split]
    out = []
    for kind, count in zip(KINDS, counts):
        group = KINDS.index(kind)
        names = {
            "clean": [None],
            "single": list(effects.LIBRARY),
            "stranger": list(strangers_of(split)),
            "onset": list(effects.WITH_ONSET),
        }[kind]
        for number in range(count):
            what = names[number % len(names)]
            label = kind if what is None else f"{kind}-{what}"
            out.append((f"{label}-{number:03}", kind, what, base + 10_000 * group + ATTEMPTS * number))
    return out


def hider(split: str, kind: str, what):
    """The function that draws what is hidden."""
    if what is None:
        return lambda rng, worm: []
    table = strangers_of(split) if kind == "stranger" else effects.LIBRARY
    return lambda rng, worm: [table[what](rng, worm)]


def make_case(job) -> str:
    """Makes one campaign; a line about it."""
    folder, split, (name, kind, what, seed) = job
    begun = time.monotonic()
    for attempt in range(ATTEMPTS):
        plan = draw(name, kind, hider(split, kind, what), seed + attempt, SIZE_OF.get(split, "usual"))
        try:
            truth = make(plan, folder / name, split)
        except CrawlFailed as problem:
            print(f"{name}, seed {seed + attempt}: {problem}: drawn again", file=sys.stderr)
            continue
        change = 100 * max(max(run["advance_change"], run["energy_change"]) for run in truth["runs"])
        seconds = time.monotonic() - begun
        return f"{name}: {truth['sigma']:.1f} sigma, {change:.1f} % of advance or energy, {seconds:.0f} s"
    return f"{name}: no worm of {ATTEMPTS} seeds crawls"


def main() -> None:
    parser = argparse.ArgumentParser(description="Makes campaigns of MuJoCo worms in which an effect is hidden, each with its truth.")
    parser.add_argument("--split", choices=SPLITS, default="development")
    parser.add_argument("--out", type=Path, required=True, help="folder for the campaigns, one folder each")
    parser.add_argument("--only", default="", help="only campaigns whose name contains this")
    parser.add_argument("--list", action="store_true", help="only list their names and seeds")
    parser.add_argument("--processes", type=int, default=1)
    arguments = parser.parse_args()
    chosen = [case for case in cases(arguments.split) if arguments.only in case[0]]
    if arguments.list:
        for name, _, _, seed in chosen:
            print(name, seed)
        return
    jobs = [(arguments.out, arguments.split, case) for case in chosen]
    with ProcessPoolExecutor(arguments.processes) as pool:
        for line in pool.map(make_case, jobs):
            print(line, flush=True)


if __name__ == "__main__":
    main()
