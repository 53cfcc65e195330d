#!/usr/bin/env python3
"""The table of a sealed split, by the lines that score_campaigns left of its answers.

    python3 crates/testkit/sealed/score.py crates/testkit/sealed/own.csv

The rows are those of `ScoreTable` in hidden_effects/table.rs, which sees campaigns and answers themselves; here are only the lines that outlast
them. Campaigns that were refused for what is wrong with their recordings count in the row on them alone. In brackets 95 % intervals
after Clopper and Pearson.
"""

import argparse
import csv
import math
from collections.abc import Callable, Iterable
from pathlib import Path

STRONG_SIGMA, STRONG_IMPACT, ONSET_SIGMA_PER_CYCLE = 8.0, 0.05, 2.0

Line = dict[str, str]


def at_least(hits: int, of: int, share: float) -> float:
    """The probability of so many hits or more."""
    return sum(math.comb(of, count) * share**count * (1 - share) ** (of - count) for count in range(hits, of + 1))


def solve(holds: Callable[[float], bool]) -> float:
    low, high = 0.0, 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def interval(hits: int, of: int) -> tuple[float, float]:
    low = solve(lambda share: at_least(hits, of, share) > 0.025) if hits else 0.0
    high = solve(lambda share: 1 - at_least(hits + 1, of, share) < 0.025) if hits < of else 1.0
    return low, high


def say(what: str, each: Iterable[bool | None]) -> None:
    """A row; None does not count."""
    known = [one for one in each if one is not None]
    hits, of = sum(known), len(known)
    if of == 0:
        print(f"{what:<62} none")
        return
    low, high = (100 * end for end in interval(hits, of))
    print(f"{what:<62} {hits:>3} of {of:<3} {100 * hits / of:5.1f} % ({low:.0f} to {high:.0f})")


def flag(line: Line, column: str) -> bool | None:
    return {"true": True, "false": False}.get(line[column])


def is_named(line: Line) -> bool:
    return line["verdict"] in ("named", "ambiguous")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lines", type=Path, help="mujoco.csv, own.csv, or one named after the bed and the commit")
    with parser.parse_args().lines.open(newline="") as file:
        lines = list(csv.DictReader(file))
    refused = [line for line in lines if line["verdict"] == "failed" and line["artefacts"]]
    answered = [line for line in lines if line not in refused]
    print(f"{len(lines)} campaigns, of which {len(refused)} were refused for what is wrong with their recordings")

    def of(kind: str) -> list[Line]:
        return [line for line in answered if line["kind"] == kind]

    clean = [line for line in of("clean") if float(line["discrepancy_m"]) == 0]
    discrepant = [line for line in of("clean") if float(line["discrepancy_m"]) > 0]
    for what, worms in [("clean", clean), ("discrepant", discrepant)]:
        say(f"{what}: an effect named", (is_named(line) for line in worms))
        say(f"{what}: outside the library", (line["verdict"] == "outside" for line in worms))

    def is_strong(line: Line) -> bool:
        return float(line["sigma"]) >= STRONG_SIGMA and float(line["impact"]) >= STRONG_IMPACT

    strong = [line for line in of("single") if is_strong(line)]
    weak = [line for line in of("single") if not is_strong(line)]
    say("single: false second effect", (flag(line, "false_second") for line in of("single")))
    say("strong: class right", (flag(line, "right_class") for line in strong))
    say("strong: strictly right", (flag(line, "strict") for line in strong))
    say("strong: agrees", (line["verdict"] == "nothing" for line in strong))
    say("strong: outside the library", (line["verdict"] == "outside" for line in strong))
    say("strong: 90 % interval of the severity covers", (flag(line, "covered") for line in strong))
    say("single: 90 % interval of the severity covers", (flag(line, "covered") for line in of("single")))
    say("weak: class right", (flag(line, "right_class") for line in weak))
    say("weak: another class named", (is_named(line) and flag(line, "right_class") is False for line in weak))
    errors = sorted(float(line["severity_error"]) for line in strong if line["severity_error"])
    if errors:
        middle = len(errors) // 2
        print(f"{'strong: severity error, median':<62} {50 * (errors[middle] + errors[~middle]):.1f} %")

    strangers = [line for line in of("stranger") if float(line["sigma"]) >= STRONG_SIGMA]
    say("stranger: outside the library", (line["verdict"] == "outside" for line in strangers))
    say("stranger: under another name", (is_named(line) for line in strangers))
    say("stranger: agrees", (line["verdict"] == "nothing" for line in strangers))

    pairs = [line for line in of("pair") if float(line.get("weakest_sigma") or "nan") >= STRONG_SIGMA]
    say("pair: both named", (int(line["of_several"]) >= 2 for line in pairs))
    say("pair: one named", (int(line["of_several"]) >= 1 for line in pairs))

    onsets = [line for line in of("onset") if float(line["sigma_per_cycle"]) >= ONSET_SIGMA_PER_CYCLE]
    say("onset: class right", (flag(line, "right_class") for line in onsets))
    say("onset: within one cycle", (flag(line, "onset_right") for line in onsets))

    stated = [(float(line["probability"]), flag(line, "probability_right")) for line in lines if line["probability"]]
    for low, high in [(0.5, 0.9), (0.9, 0.99), (0.99, 2.0)]:
        these = [one for one in stated if low <= one[0] < high]
        mean = sum(one[0] for one in these) / max(len(these), 1)
        say(f"stated at {low} or more, {mean:.3f} in the mean: right", (one[1] for one in these))
    for verdict, words in [("nothing", "agrees"), ("outside", "outside the library")]:
        these = [line for line in lines if line["verdict"] == verdict and line["probability"]]
        mean = sum(float(line["probability"]) for line in these) / max(len(these), 1)
        say(f"{words}, {mean:.3f} in the mean: right", (flag(line, "probability_right") for line in these))


if __name__ == "__main__":
    main()
