"""Survey how steady the physics is, over all references of every object.

    python tools/survey_physics.py [rest|press|hold ...] [--objects NAME ...] [--references N] [--physics JSON]

- ``rest``: objects stand alone on the table for 5.5 s; how far they move from t = 0.5 s on;
- ``press``: hands close on fixed objects with the paper's gains and push; how deep they sink into them;
- ``hold``: hands hold objects in the air by the grasp references; how far the objects slip in 5 s, from 2 s after the
  hands took their weight on.

N is the most references of an object, evenly spread over all. JSON replaces settings, such as '{"impratio": 10}'. With
--out FILE what was measured of every reference is kept as CSV. See docs/physics.md, whose tables come from here.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from artigrasp.arrays import Array
from artigrasp.assets.library import list_assets
from artigrasp.benchmark.steadiness import (
    CARRYING_GAINS,
    PAPER_GAINS,
    HoldSlip,
    PressDepth,
    RestDrift,
    hold_slip,
    press_depth,
    rest_drift,
)
from artigrasp.config import PhysicsConfig
from artigrasp.files import write_csv
from artigrasp.references.reference import ReferenceSet, load_references

SURVEYS = ("rest", "press", "hold")
HEADERS = {
    "rest": (
        "object",
        "references",
        "distance mm",
        "turn mrad",
        "hinge mrad",
        "hinge beyond gravity mrad",
        "moving",
        "failed",
    ),
    "press": (
        "object",
        "presses",
        "began inside",
        "force N",
        "peak mm",
        "over 2 mm",
        "steady mm",
        "over 2 mm",
        "failed",
    ),
    "hold": ("object", "grasps", "held", "held, slip < 2 mm", "slip mm", "settling mm", "hinge rad/s", "failed"),
}


def quantiles(values: Array, scale: float = 1000.0) -> str:
    """Median, nine tenths and most."""
    if len(values) == 0:
        return "-"
    return " / ".join(f"{value * scale:.2f}" for value in np.quantile(values, [0.5, 0.9, 1.0]))


def cells(result: RestDrift | PressDepth | HoldSlip) -> list[str]:
    """What a row of the table says of it, after the object."""
    if isinstance(result, RestDrift):
        columns = [quantiles(getattr(result, name)) for name in ("distance", "turn", "hinge", "hinge_unexplained")]
        moving = (result.distance > 1e-3) | (np.maximum(result.turn, result.hinge_unexplained) > 0.01)
        return [str(len(result.failed)), *columns, str(moving.sum()), str(result.failed.sum())]
    if isinstance(result, PressDepth):
        fair = ~result.began_inside
        row = [str(fair.sum()), str(result.began_inside.sum()), quantiles(result.force[fair], 1.0)]
        for depth in (result.peak[fair], result.steady[fair]):
            row += [quantiles(depth), str((depth > 0.002).sum())]
        return [*row, str(result.failed.sum())]
    held = result.held
    still = held & (result.slip < 0.002)
    row = [
        str(len(held)),
        str(held.sum()),
        str(still.sum()),
        quantiles(result.slip[held]),
        quantiles(result.before[held]),
    ]
    return [*row, quantiles(result.hinge_jitter[held], 1.0), str(result.failed.sum())]


def measure(
    survey: str, references: ReferenceSet, options: argparse.Namespace, physics: PhysicsConfig
) -> RestDrift | PressDepth | HoldSlip:
    """One survey of one object."""
    if survey != "rest":
        references = references.select(kind="articulate" if survey == "press" else "grasp")
    if options.references is not None and options.references < len(references):
        references = references.select(indices=np.linspace(0, len(references) - 1, options.references).astype(int))
    if survey == "rest":
        return rest_drift(references, physics)
    if survey == "press":
        return press_depth(references, physics)
    return hold_slip(references, physics, squeeze=options.squeeze)


def show(survey: str, rows: Sequence[Sequence[str]]) -> None:
    """Print a survey's table."""
    print(f"\n| {' | '.join(HEADERS[survey])} |\n|{' --- |' * len(HEADERS[survey])}")
    for row in rows:
        print(f"| {' | '.join(row)} |")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("surveys", nargs="*", default=SURVEYS, choices=[*SURVEYS, []])
    parser.add_argument("--objects", nargs="*", default=None, help="all that have references by default")
    parser.add_argument("--references", type=int, help="most references of an object; all by default")
    parser.add_argument(
        "--squeeze", type=float, default=0.0, help="flexion of holding fingers past the reference [rad]"
    )
    parser.add_argument("--physics", type=json.loads, default={})
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    physics = replace(PhysicsConfig(), **options.physics)
    print(f"physics: {asdict(physics)}")
    print(f"gains that press: {asdict(PAPER_GAINS)}")
    print(f"gains that hold: {asdict(CARRYING_GAINS)}")
    print("a / b / c: median, nine tenths, most")
    trials: list[dict[str, object]] = []
    for survey in options.surveys:
        rows = []
        for name in options.objects or list_assets("references"):
            result = measure(survey, load_references(name), options, physics)
            rows.append([name, *cells(result)])
            print(f"{survey}: {' | '.join(rows[-1])}", flush=True)
            for index in range(len(result.failed)):
                values = {key: float(column[index]) for key, column in vars(result).items()}
                trials.append({"survey": survey, "object": name, "reference": index, **values})
        show(survey, rows)
    if options.out:
        columns = list(dict.fromkeys(key for trial in trials for key in trial))
        write_csv(options.out, columns, ([trial.get(key, "") for key in columns] for trial in trials))


if __name__ == "__main__":
    main()
