"""Play an object for a million control steps, and see that nothing which is no number reaches the learner.

    python tools/stress.py [OBJECT ...] [--steps N] [--policy NAME] [--out FILE] [--threads N] [--seed S]

Every object is played through what the learner steps (`HandVecEnv`), in three kinds of play that share the steps:

- ``trembling``: the paper's prior and residual scales, new numbers within ±3 at every control step: thrice what a
  policy begins with; in two scenes, both hands with a free base and the right hand with a fixed one;
- ``flailing``: twenty times the paper's scales, 2 cm, 0.2 rad and 0.3 rad, numbers within ±1 held for ten steps; in
  the same two scenes;
- ``policy``: a trained policy in its own scene, if one is named.

References of all splits are drawn, hands start with the task's noise. The table is printed at the end. FILE keeps what
is measured as it comes, and what stands there is not measured again.
"""

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import torch
import warp as wp

from artigrasp.assets.library import find_file
from artigrasp.assets.open_set.catalogue import PAPER_CATEGORIES, object_name
from artigrasp.benchmark.memory import memory_mb
from artigrasp.config import ActionConfig, ResidualConfig, SimulatorConfig, TaskConfig
from artigrasp.controllers.controller import PolicyController
from artigrasp.controllers.policy_file import load_policy
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import training_worlds
from artigrasp.files import check_format, write_text
from artigrasp.kernels.metrics import FAILURES
from artigrasp.references.reference import load_references
from artigrasp.training.vec_env import HandVecEnv

FORMAT, VERSION = "artigrasp.stress", 2
OBJECTS = tuple(map(object_name, PAPER_CATEGORIES))
MEMORY_SAMPLES = 10
"""Of each play, spread evenly over it."""

PAPER = ResidualConfig()
SCENES = {
    "two hands, free base": TaskConfig(
        name="stress", description="", hands=("left", "right"), fixed_base=False, kinds=("articulate", "grasp")
    ),
    "right hand, fixed base": TaskConfig(name="stress", description=""),
}

Act = Callable[[torch.Tensor], torch.Tensor]
"""From what the learner sees, [row, feature], to actions, [row, action]."""


@dataclass(frozen=True)
class Noise:
    """Random actions: residual scales, the range of the numbers and the control steps that they are held for."""

    residual: ResidualConfig
    amplitude: float
    hold: int


NOISES = {
    "trembling": Noise(PAPER, 3.0, 1),
    "flailing": Noise(
        ResidualConfig(20 * PAPER.wrist_translation, 20 * PAPER.wrist_rotation, 20 * PAPER.fingers), 1.0, 10
    ),
}


@dataclass(frozen=True)
class Play:
    """What one object was put through, and what came of it."""

    object: str
    scene: str
    actions: str
    """Kind of noise, or the name of a policy."""
    control_steps: int
    """Over all worlds."""
    failures: dict[str, int]
    """Episodes in which each of ``FAILURES`` happened."""
    bad_numbers: int
    """Features, rewards and ends of episodes given to the learner that are no finite numbers."""
    touching: float
    """Share of the control steps of worlds in which a hand touches the object."""
    top_speed: float
    """Fastest joint of a sound world [rad/s, m/s]."""
    farthest: float
    """Largest displacement of an object in a sound world [m]."""
    memory_mb: tuple[float, ...]
    """What the process held at equal intervals, the first after one interval [MiB]."""
    seconds: float
    """Processor time."""


class WatchedEnvironment(Environment):
    """Notes what happens in every control step, before worlds that failed begin anew."""

    steps = touches = 0
    top_speed = farthest = 0.0

    def step(self, action: wp.array) -> None:
        """See `Environment`."""
        super().step(action)
        sound = self.metrics.failure.numpy() == 0
        hands = self.state.hands
        self.steps += self.world_count
        self.touches += int(hands.contact_force.numpy().any(axis=(1, 2, 3, 4)).sum())
        if sound.any():
            self.top_speed = max(self.top_speed, float(np.abs(hands.joint_qd.numpy()[sound]).max()))
            self.farthest = max(self.farthest, float(self.metrics.displacement.numpy()[sound].max()))


def play(
    name: str, scene: str, task: TaskConfig, actions: str, act: Act, steps: int, options: argparse.Namespace
) -> Play:
    """Play an object for so many control steps, over all worlds."""
    began = time.process_time()
    references = [load_references(name).select(kind=task.kinds, hands=task.hands)]
    simulator = SimulatorConfig(threads=options.threads)
    environment = WatchedEnvironment(
        task, references, training_worlds(references, task.world_count), seed=options.seed, simulator=simulator
    )
    learner_side = HandVecEnv(environment)
    features = learner_side.get_observations()["policy"]
    bad_numbers = 0
    memory: list[float] = []
    while environment.steps < steps:
        observations, rewards, dones, extras = learner_side.step(act(features))
        features = observations["policy"]
        for values in (features, rewards, dones, *extras.values()):
            bad_numbers += int((~torch.isfinite(values)).sum())
        while len(memory) < MEMORY_SAMPLES * environment.steps // steps:
            memory.append(round(memory_mb(), 1))
    return Play(
        object=name,
        scene=scene,
        actions=actions,
        control_steps=environment.steps,
        failures=environment.failure_counts(),
        bad_numbers=bad_numbers,
        touching=environment.touches / environment.steps,
        top_speed=environment.top_speed,
        farthest=environment.farthest,
        memory_mb=tuple(memory[:MEMORY_SAMPLES]),
        seconds=time.process_time() - began,
    )


def random_actions(noise: Noise, rows: int, seed: int) -> Act:
    """Numbers within a range, new ones after some steps."""
    random, steps = torch.Generator().manual_seed(seed), 0
    action = torch.empty(0)

    def act(features: torch.Tensor) -> torch.Tensor:
        nonlocal action, steps
        if steps % noise.hold == 0:
            action = noise.amplitude * (2 * torch.rand(rows, 51, generator=random) - 1)
        steps += 1
        return action

    return act


def policy_actions(controller: PolicyController) -> Act:
    """What a policy decides."""
    hand_count = len(controller.task.hands)

    def act(features: torch.Tensor) -> torch.Tensor:
        decided = controller.act(features.numpy().reshape(-1, hand_count, features.shape[-1]))
        return torch.from_numpy(decided.reshape(len(features), -1))

    return act


def plays(name: str, options: argparse.Namespace) -> list[tuple[str, TaskConfig, str, Act]]:
    """Scene, its task, actions and what acts, for all that an object is put through."""
    found = []
    for scene, task in SCENES.items():
        for kind, noise in NOISES.items():
            noisy = replace(task, action=ActionConfig(residual=noise.residual), world_count=options.worlds)
            found.append((scene, noisy, kind, random_actions(noise, options.worlds * len(task.hands), options.seed)))
    if options.policy is not None:
        policy = load_policy(find_file("policies", options.policy))
        if name in policy.objects:
            task = replace(policy.task, world_count=options.worlds)
            act = policy_actions(PolicyController(replace(policy, task=task)))
            found.append((f"its own: {task.name}", task, options.policy, act))
    return found


def table(measured: list[Play]) -> str:
    """A row for every object and scene, and one for all."""
    lines = [
        f"| object | scene | control steps | {' | '.join(FAILURES)} | bad numbers | touching | top speed | farthest m "
        "| memory grew MiB |",
        f"| --- | --- |{' --- |' * (len(FAILURES) + 6)}",
    ]
    groups: dict[tuple[str, str], list[Play]] = {(each.object, each.scene): [] for each in measured}
    for each in measured:
        groups[each.object, each.scene].append(each)
    for (name, scene), rows in [*groups.items(), (("all", ""), measured)]:
        steps = sum(row.control_steps for row in rows)
        cells = [str(sum(row.failures[failure] for row in rows)) for failure in FAILURES]
        cells.append(str(sum(row.bad_numbers for row in rows)))
        cells.append(f"{sum(row.touching * row.control_steps for row in rows) / max(steps, 1):.2f}")
        cells += [f"{max(getattr(row, key) for row in rows):.2f}" for key in ("top_speed", "farthest")]
        cells.append(f"{max(row.memory_mb[-1] - row.memory_mb[0] for row in rows):.1f}")
        lines.append(f"| {name} | {scene} | {steps:,} | {' | '.join(cells)} |")
    return "\n".join(lines)


def read(path: Path) -> list[Play]:
    """What was measured before."""
    if not path.is_file():
        return []
    content = json.loads(path.read_text(encoding="utf-8"))
    check_format(content.get("format"), content.get("version"), FORMAT, VERSION, path)
    return [Play(**row) for row in content["plays"]]


def main() -> None:
    """Measure what is not measured yet, then print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("objects", nargs="*", default=OBJECTS)
    parser.add_argument("--steps", type=int, default=1_000_000, help="control steps of every object, over all worlds")
    parser.add_argument("--worlds", type=int, default=100)
    parser.add_argument("--policy", default="open-set-articulate", help="a file or a name, for the objects it knows")
    parser.add_argument("--out", type=Path, default=Path("build/stress.json"))
    parser.add_argument("--threads", type=int)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    measured = read(options.out)
    done = {(each.object, each.scene, each.actions) for each in measured}
    for name in options.objects:
        wanted = plays(name, options)
        for scene, task, actions, act in wanted:
            if (name, scene, actions) in done:
                continue
            measured.append(play(name, scene, task, actions, act, options.steps // len(wanted), options))
            content = {"format": FORMAT, "version": VERSION, "plays": [asdict(each) for each in measured]}
            write_text(options.out, json.dumps(content, indent=1) + "\n")
            failed = {failure: count for failure, count in measured[-1].failures.items() if count}
            print(f"{name}, {scene}, {actions}: {failed or 'sound'}, {measured[-1].seconds:.0f} s", flush=True)
    print(table(measured))


if __name__ == "__main__":
    main()
