"""Tell a story from many starts and count how often it is told to its end.

    python -m tools.measure_story ketchup-into-box [--starts N] [--start-shift METRES] [--start-turn RADIANS] ...

Every start draws places and turns of the objects as `artigrasp tell --seed S` does, S being 0, 1, 2, ... Printed is a
row for each start, then how many were told with the 95 % interval, episodes and time. FILE (--out) keeps what is
measured as it comes, and what stands there is not measured again.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from artigrasp.assets.library import find_file
from artigrasp.cli.output import show
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig
from artigrasp.config.story import StoryConfig
from artigrasp.evaluation.report import format_estimate, markdown_table
from artigrasp.evaluation.statistics import estimate_rate
from artigrasp.files import write_text
from artigrasp.stories.file import read_story
from artigrasp.stories.start import scatter_objects
from artigrasp.stories.teller import Teller, TellerSettings

HEADER = ("seed", "told", "steps done", "episodes", "CPU s", "seconds of motion")


def tell(story: StoryConfig, options: argparse.Namespace, seed: int) -> dict[str, Any]:
    """What became of a story from one start."""
    start = scatter_objects(story, options.start_shift, options.start_turn, seed)
    settings = TellerSettings(rollouts=options.search, seed=seed)
    began = time.process_time()
    teller = Teller(start, settings, SimulatorConfig(threads=options.threads))
    tale = teller.tell()
    samples = sum(len(take.phases) for take in tale.takes)
    return {
        "seed": seed,
        "told": tale.is_whole,
        "steps": sum(take.success for take in tale.takes),
        "episodes": tale.tried,
        "cpu": time.process_time() - began,
        "duration": samples * teller.task.control_dt,
        "problem": tale.problem,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("story", help="a file or the name of a shipped story")
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--start-shift", type=float, default=0.03, help="of objects along x and y, at most [m]")
    parser.add_argument("--start-turn", type=float, default=0.3, help="of objects about the vertical, at most [rad]")
    parser.add_argument("--search", type=int, default=1, help="rollouts where no reference does a step; 1 for none")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("build/story.json"))
    options = parser.parse_args()
    start_warp()
    story = read_story(find_file("stories", options.story))
    key = [options.story, options.start_shift, options.start_turn, options.search]
    kept = json.loads(options.out.read_text(encoding="utf-8")) if options.out.exists() else []
    options.out.parent.mkdir(parents=True, exist_ok=True)
    for seed in range(options.starts):
        if not any(row["of"] == key and row["seed"] == seed for row in kept):
            kept.append({"of": key, **tell(story, options, seed)})
            write_text(options.out, json.dumps(kept, indent=1))
    rows = [row for row in kept if row["of"] == key][: options.starts]
    table = [
        (str(row["seed"]), "yes" if row["told"] else row["problem"], str(row["steps"]), str(row["episodes"]),
         f"{row['cpu']:.0f}", f"{row['duration']:.1f}")
        for row in rows
    ]  # fmt: skip
    show(markdown_table(HEADER, table))
    told = estimate_rate(np.array([row["told"] for row in rows]), np.arange(len(rows)))
    episodes, seconds = np.mean([[row["episodes"], row["cpu"]] for row in rows], axis=0)
    show(f"told: {format_estimate(told)} of {len(rows)}; {episodes:.0f} episodes, {seconds:.0f} s each")


if __name__ == "__main__":
    main()
