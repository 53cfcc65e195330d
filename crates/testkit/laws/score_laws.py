#!/usr/bin/env python3
"""Scores the laws that `wormd explain` finds where its library does not explain the data.

    target/release/write_campaigns laws FOLDER
    python3 crates/testkit/laws/score_laws.py FOLDER --wormd target/release/wormd [--only NAME ...] [--library]

Of a worm with an effect of the library, that effect and its twins are left out of the search, or the whole library (--library): the law
should depend on what the effect depends on (AXES), and predict the run between the slopes nearly as well as the effect itself does. That is
fitted by the full search, and with the whole library left out by one that knows this effect alone, where the law leaves more than a fifth.
The closure on that run is the fraction of the squared error of the recalibrated model (the law taken away, calibration kept) that is
closed, down to the squared noise. A worm with a stranger should be detected as outside; a clean one should have no law.
"""

import argparse
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

# What each effect depends on, decided before any law was fitted. At first there was no displacement in the body, and nothing was right for a
# lost stroke and a scale: theirs was decided when those of the first round of worms had been seen, and none of the second. What a tip or a
# pad remembers became an axis when neither breakaway nor creep had been right in both rounds, and before any law over it was fitted.
# "cell" is the cell that it concerns.
AXES = {
    "unequal-clamping": {"cell"},
    "unequal-stiffness": {"cell"},
    "directional-friction": {"speed", "deformation", "load", "deformation-rate"},
    "breakaway-friction": {"speed", "deformation-rate", "recent-slide"},
    "pad-hardening": {"deformation", "load"},
    "pad-creep": {"deformation-rate", "recent-deformation", "deformation", "load"},
    "pad-hysteresis": {"deformation", "load", "deformation-rate"},
    "viscous-drag": {"speed"},
    "constant-drag": {"constant"},
    "payload": {"slope"},
    "slope-error": {"slope"},
    "tether-drag": {"place", "time"},
    "lost-stroke": {"cell", "phase"},
    "actuator-compliance": {"load", "deformation"},
    "backlash": {"load", "deformation"},
    "step-overlap": {"phase"},
    "slick-patch": {"place"},
    "wear": {"time"},
    "sensor-scale": {"phase"},
    "sensor-latency": {"phase", "speed"},
    "slope-clamping": {"slope"},
}
TWINS = {
    "constant-drag": ["directional-friction"],
    "directional-friction": ["constant-drag"],
    "lost-stroke": ["sensor-scale"],
    "sensor-scale": ["lost-stroke"],
}
# Part of the effect's own closure that a law should reach.
ENOUGH = 0.8


def run(args):
    done = subprocess.run([str(arg) for arg in args], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr.strip()[-300:])
    return json.loads(done.stdout)


def explain(wormd, folder, out, without=()):
    flags = [flag for name in without for flag in ("--without", name)]
    return run([wormd, "explain", folder / "campaign.toml", "--out", out, "--json", *flags])


def unseen_m2(wormd, folder, model):
    """Mean square error of the run between the slopes, m²."""
    found = run([wormd, "predict", folder / "unseen.toml", "--config", model, "--json"])
    return found["runs"][0]["root_mean_square_error_m"] ** 2


def without_law(model):
    """A model's text with its table taken away."""
    return re.sub(r"\n# Found by `wormd explain` where.*", "\n", model, flags=re.S)


def recalibrated(folder, answer, out):
    """The recalibrated model without anything else, by the calibration of an answer."""
    worm = tomllib.loads((folder / "worm.toml").read_text())
    cells, values = worm["worm"]["cells"], {one["name"]: one["found"] for one in answer["calibration"]}
    factor = lambda name, cell: values.get(name, 1.0) * values.get(f"{name} of cell {cell + 1}", 1.0)
    stiffness = [980.0 * factor("stiffness", cell) for cell in range(cells)]
    bound = [0.00175 * factor("friction", cell) / factor("stiffness", cell) for cell in range(cells)]
    text = (folder / "worm.toml").read_text()
    more = f"stroke_m = {values.get('stroke', 0.0115)}\nstiffness_n_per_m = {stiffness}\nmax_deformation_m = {bound}\n"
    path = out / "recalibrated.toml"
    path.write_text(text.replace("\n[gait]", more + "\n[gait]", 1))
    return path


def axes(law):
    names = law["axis"] if isinstance(law["axis"], list) else [law["axis"]]
    found = {"cell"} if law["cell"] else set(names)
    values = law.get("value")
    says_so = "is the same everywhere" in law.get("sentence", "")
    is_even = values and max(values) - min(values) < 0.1 * max(abs(value) for value in values)
    # A factor on friction is about 1 everywhere whatever it says.
    if law["acts_on"] == "contact-force" and (says_so or is_even):
        found.add("constant")
    return found


def add_true(wormd, folder, out, left_out, known, row, gap, open_m2):
    """Adds what the effect itself closes on the run between, where a search names it; returns what that names."""
    named = [one["name"] for one in explain(wormd, folder, out, left_out)["effects"]]
    if set(known) & set(named):
        true_um = 1e6 * unseen_m2(wormd, folder, out / "model.toml") ** 0.5
        row["unseen_um"]["true"] = true_um
        row["closure_true"] = 1 - gap(true_um) / open_m2 if open_m2 else None
    return named


def closes_enough(row):
    """Whether a law closes four fifths of what the effect itself does on the run between; of the whole gap, where that was not fitted."""
    closed = row["closure_unseen"]
    return closed is not None and closed > 0 and closed >= ENOUGH * row.get("closure_true", 1.0)


def score(wormd, folder, whole_library):
    truth = json.loads((folder / "truth.json").read_text())
    name = folder.name.rsplit("-", 1)[0]
    row = {"case": folder.name, "sigma": truth["sigma"], "stranger": truth["stranger"]}
    single = name in AXES
    out = folder / ("found-by-law" if whole_library else "found")
    left_out = list(AXES) if whole_library else [name, *TWINS.get(name, [])] if single else []
    answer = explain(wormd, folder, out, left_out)
    law = answer.get("law")
    row |= {"verdict": answer["verdict"], "named": [one["name"] for one in answer["effects"]], "law": law and {
        key: law.get(key) for key in ("acts_on", "axis", "cell", "period", "memory_s", "formula", "closure", "closure_interval", "improvement", "rivals", "sentence")
    }}
    if law:
        noise_m2 = truth["noise_m"] ** 2
        base = recalibrated(folder, answer, out)
        row["unseen_um"] = {
            "nominal": 1e6 * unseen_m2(wormd, folder, folder / "worm.toml") ** 0.5,
            "recalibrated": 1e6 * unseen_m2(wormd, folder, base) ** 0.5,
            "law": 1e6 * unseen_m2(wormd, folder, out / "model.toml") ** 0.5,
        }
        gap = lambda rms_um: max((1e-6 * rms_um) ** 2 - noise_m2, 0.0)
        open_m2 = gap(row["unseen_um"]["recalibrated"])
        row["closure_unseen"] = 1 - gap(row["unseen_um"]["law"]) / open_m2 if open_m2 else None
        if single:
            found = axes(law)
            row["axis_right"] = bool(found & AXES[name])
            row["axis_among"] = row["axis_right"] or any(axes(other) & AXES[name] for other in law["rivals"])
            known = [name, *TWINS.get(name, [])]
            if whole_library and not closes_enough(row):
                knows_it = folder / "knows-it"
                row["known"] = add_true(wormd, folder, knows_it, [other for other in AXES if other != name], known, row, gap, open_m2)
            elif not whole_library:
                row["full"] = add_true(wormd, folder, folder / "full", (), known, row, gap, open_m2)
            row["closes_enough"] = closes_enough(row)
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--wormd", type=Path, default=Path("target/release/wormd"))
    parser.add_argument("--only", nargs="*", help="beginnings of the names of cases")
    parser.add_argument("--library", action="store_true", help="leave the whole library out")
    parser.add_argument("--again", action="store_true", help="also cases that have a score already")
    args = parser.parse_args()
    rows = []
    for folder in sorted(args.folder.iterdir()):
        if not (folder / "truth.json").is_file() or args.only and not folder.name.startswith(tuple(args.only)):
            continue
        kept = folder / ("score-by-law.json" if args.library else "score.json")
        if kept.is_file() and not args.again:
            row = json.loads(kept.read_text())
        else:
            try:
                row = score(args.wormd, folder, args.library)
                kept.write_text(json.dumps(row, indent=1))
            except (RuntimeError, KeyError) as problem:
                row = {"case": folder.name, "error": repr(problem)}
        print(json.dumps(row), flush=True)
        rows.append(row)
    singles = [row for row in rows if row["case"].rsplit("-", 1)[0] in AXES]
    for key in ("axis_right", "closes_enough"):
        print(f"{key}: {sum(bool(row.get(key)) for row in singles)} of {len(singles)}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
