"""Play random actions on every object and count the episodes whose physics fails.

    python tools/stress.py [OBJECT ...] [--episodes N] [--out FILE] [--threads N] [--seed S]

Every object is played in two scenes, both hands with a free base and the right hand with a fixed one, with the paper's
prior and two kinds of random residuals:

- ``trembling``: the paper's scales, new numbers within ±3 at every control step: thrice what a policy begins with;
- ``flailing``: twenty times the paper's scales, 2 cm, 0.2 rad and 0.3 rad, numbers within ±1 held for ten steps.

Half of a scene's episodes are of each kind; references of all splits are drawn, hands start with the task's noise. The
table is printed at the end. FILE keeps what is measured as it comes, and what stands there is not measured again.
"""

import argparse
import json
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import warp as wp

from artigrasp.config import ActionConfig, ResidualConfig, SimulatorConfig, TaskConfig
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import training_worlds
from artigrasp.files import atomic_write, check_format
from artigrasp.kernels.metrics import FAILURES
from artigrasp.references.reference import load_references

FORMAT, VERSION = "artigrasp.stress", 1
OBJECTS = (
    "box", "capsulemachine", "espressomachine", "ketchup", "laptop", "microwave", "mixer", "notebook", "phone",
    "waffleiron", "lidded-box",
)  # fmt: skip

PAPER = ResidualConfig()
SCENES = {
    "two hands, free base": TaskConfig(
        name="stress", description="", hands=("left", "right"), fixed_base=False, kinds=("articulate", "grasp")
    ),
    "right hand, fixed base": TaskConfig(name="stress", description=""),
}


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
class Measurement:
    """What happened to the episodes of one object, scene and kind of noise."""

    object: str
    scene: str
    noise: str
    episodes: int
    failures: dict[str, int]
    """Episodes in which each of ``FAILURES`` happened."""
    bad_numbers: int
    """Features and rewards of sound worlds that are no finite numbers."""
    touched: float
    """Share of the episodes in which a hand touched the object."""
    top_speed: float
    """Fastest joint of a sound world [rad/s, m/s]."""
    farthest: float
    """Largest displacement of an object [m]."""
    seconds: float


def stress(name: str, scene: str, noise_name: str, episodes: int, seed: int, threads: int | None) -> Measurement:
    """Play random actions in as many worlds as there are episodes."""
    begin = time.perf_counter()
    task, noise = SCENES[scene], NOISES[noise_name]
    task = replace(task, action=ActionConfig(residual=noise.residual), world_count=episodes)
    references = [load_references(name).select(kind=task.kinds)]
    worlds = training_worlds(references, episodes)
    environment = Environment(task, references, worlds, seed=seed, simulator=SimulatorConfig(threads=threads))
    random = np.random.default_rng(seed)
    environment.reset()
    shape = (episodes, environment.hand_count, environment.action_count)
    action = wp.zeros(shape, dtype=float, device=environment.device)
    touched, bad_numbers, top_speed = np.zeros(episodes, dtype=bool), 0, 0.0
    for step in range(task.episode_steps):
        if step % noise.hold == 0:
            action.assign(random.uniform(-noise.amplitude, noise.amplitude, shape).astype(np.float32))
        environment.step(action)
        sound = environment.metrics.failure.numpy() == 0
        hands = environment.state.hands
        touched |= hands.contact_force.numpy().any(axis=(1, 2, 3, 4))
        for values in (environment.observe(), environment.reward):
            bad_numbers += int((~np.isfinite(values.numpy()[sound])).sum())
        if sound.any():
            top_speed = max(top_speed, float(np.abs(hands.joint_qd.numpy()[sound]).max()))
    return Measurement(
        object=name,
        scene=scene,
        noise=noise_name,
        episodes=episodes,
        failures=environment.failure_counts(),
        bad_numbers=bad_numbers,
        touched=float(touched.mean()),
        top_speed=top_speed,
        farthest=float(environment.episode_summary()["max_displacement"].max()),
        seconds=time.perf_counter() - begin,
    )


def table(measurements: list[Measurement]) -> str:
    """A row for every object and scene, and one for all."""
    lines = [
        f"| object | scene | episodes | {' | '.join(FAILURES)} | bad numbers | touched | top speed | farthest m |",
        f"| --- | --- |{' --- |' * (len(FAILURES) + 5)}",
    ]
    groups = {(each.object, each.scene): [] for each in measurements}
    for each in measurements:
        groups[each.object, each.scene].append(each)
    for (name, scene), rows in [*groups.items(), (("all", ""), measurements)]:
        episodes = sum(row.episodes for row in rows)
        cells = [str(sum(row.failures[failure] for row in rows)) for failure in FAILURES]
        cells.append(str(sum(row.bad_numbers for row in rows)))
        cells.append(f"{sum(row.touched * row.episodes for row in rows) / max(episodes, 1):.2f}")
        cells += [f"{max(getattr(row, key) for row in rows):.2f}" for key in ("top_speed", "farthest")]
        lines.append(f"| {name} | {scene} | {episodes} | {' | '.join(cells)} |")
    return "\n".join(lines)


def read(path: Path) -> list[Measurement]:
    """What was measured before."""
    if not path.is_file():
        return []
    content = json.loads(path.read_text(encoding="utf-8"))
    check_format(content.get("format"), content.get("version"), FORMAT, VERSION, path)
    return [Measurement(**row) for row in content["measurements"]]


def main() -> None:
    """Measure what is not measured yet, then print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("objects", nargs="*", default=OBJECTS)
    parser.add_argument("--episodes", type=int, default=200, help="episodes of every object and scene")
    parser.add_argument("--out", type=Path, default=Path("build/stress.json"))
    parser.add_argument("--threads", type=int)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    measurements = read(options.out)
    done = {(each.object, each.scene, each.noise) for each in measurements}
    wanted = [(name, scene, noise) for scene in SCENES for name in options.objects for noise in NOISES]
    for name, scene, noise in wanted:
        if (name, scene, noise) in done:
            continue
        measured = stress(name, scene, noise, options.episodes // len(NOISES), options.seed, options.threads)
        measurements.append(measured)
        content = {"format": FORMAT, "version": VERSION, "measurements": [asdict(each) for each in measurements]}
        with atomic_write(options.out) as path:
            path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        failed = {failure: count for failure, count in measured.failures.items() if count}
        print(f"{name}, {scene}, {noise}: {failed or 'sound'}, {measured.seconds:.0f} s", flush=True)
    print(table(measurements))


if __name__ == "__main__":
    main()
