"""Measure what each setting of a scene costs: processor time of a control step of one world.

The time is the processor's, of all threads, so that other programs hardly change it. Every scene plays a whole episode
by PD+IK in turn, round after round; what is told is the median over the rounds of the ratio to the first scene in the
same round, and the range. One more round warms up. ``python -m tools.measure_costs [--rounds N]`` prints the table of
`docs/performance.md`.
"""

import argparse
import statistics
import time
from dataclasses import dataclass, replace

from rich.progress import track

from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig
from artigrasp.controllers.controller import pd_ik_controller
from artigrasp.controllers.rollout import run_episode
from artigrasp.environment.make import make_environment
from artigrasp.evaluation.report import markdown_table
from artigrasp.tasks import get_task


@dataclass(frozen=True)
class Scene:
    """What is simulated; the defaults are what the others are compared with."""

    label: str
    object: str = "lidded-box"
    both_hands: bool = False
    free_base: bool = False
    world_count: int = 64


SCENES = (
    Scene("64 worlds, one hand, fixed base, `lidded-box`"),
    Scene("1 world", world_count=1),
    Scene("8 worlds", world_count=8),
    Scene("256 worlds", world_count=256),
    Scene("free base", free_base=True),
    Scene("both hands", both_hands=True),
    Scene("both hands, free base", both_hands=True, free_base=True),
    Scene("both hands, free base, `open-box`", "open-box", True, True),
    Scene("both hands, free base, `open-microwave`", "open-microwave", True, True),
)


class Player:
    """Plays episodes of one scene."""

    def __init__(self, scene: Scene) -> None:
        """Build it."""
        task = replace(
            get_task("both-free" if scene.both_hands else "right-fixed"),
            fixed_base=not scene.free_base,
            world_count=scene.world_count,
            kinds=("articulate",),
        )
        self._controller = pd_ik_controller(task)
        simulator = SimulatorConfig(threads=1)
        self._environment = make_environment(self._controller.task, [scene.object], simulator=simulator)

    def time(self) -> float:
        """Processor time of a control step of one world, over an episode [s]."""
        began = time.process_time()
        run_episode(self._environment, self._controller)
        return (time.process_time() - began) / (self._environment.world_count * self._environment.episode_steps)


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, help="rounds that are measured")
    parser.add_argument("--worlds", type=int, help="worlds of every scene, to try it")
    options = parser.parse_args()
    start_warp()
    players = [Player(replace(each, world_count=options.worlds or each.world_count)) for each in SCENES]
    times = [[player.time() for player in players] for _ in track(range(options.rounds + 1), "rounds")][1:]
    rows = []
    for i, scene in enumerate(SCENES):
        ratios = [each[i] / each[0] for each in times]
        spread = f"{min(ratios):.2f} to {max(ratios):.2f}" if i else ""
        milliseconds = 1e3 * statistics.median(each[i] for each in times)
        rows.append((scene.label, f"{statistics.median(ratios):.2f}", spread, f"{milliseconds:.3f}"))
    print(markdown_table(("scene", "cost", "range", "CPU ms a control step and world"), rows))


if __name__ == "__main__":
    main()
