"""`artigrasp evaluate`: measure controllers by the paper's protocols."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from artigrasp.cli.output import show, show_json
from artigrasp.cli.policies import find_policy, played_task
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig
from artigrasp.files import check_target


@dataclass(frozen=True)
class Options:
    """Measure a controller on every reference of a split.

    Writes metrics.json, trials.csv (one row per trial), metrics.md and success.png; with baselines, theirs go to
    subfolders and the table and the plot compare them. Every figure has its trial count and 95 % interval. The
    protocols are `paper` (the paper's text), `released` (the authors' scripts) and `strict` (the base must stay where
    it is).

    With --json: the contents of metrics.json.
    """

    protocol: Annotated[Literal["articulation"], tyro.conf.Positional]
    """What is measured: articulation plays every reference toward .5, .75, 1, 1.25 and 1.5 rad."""
    controller: str = "policy"
    """What acts: policy, pd-ik or zero (the task's prior alone)."""
    policy: str | None = None
    """Policy: a file, or a name of `artigrasp list policies`."""
    task: str | None = None
    """Task to play: by default the policy's, without one right-fixed."""
    objects: tuple[str, ...] = ("lidded-box",)
    """Objects to measure on."""
    split: str = "test"
    """Split of the references."""
    baselines: tuple[str, ...] = ()
    """Further controllers, measured on the same trials."""
    seed: int = 0
    """Seed, kept with the results; the trials start without noise."""
    out: Path = Path("evaluation")
    """Folder to write to."""
    simulator: SimulatorConfig = SimulatorConfig()
    """Backend, device and threads."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Measure and write the report."""
    from artigrasp.references.reference import load_references

    policy = find_policy(options.policy) if options.policy is not None else None
    references = [load_references(name) for name in options.objects]
    check_target(options.out / "metrics.json")

    start_warp()
    from artigrasp.controllers.library import load_controller
    from artigrasp.evaluation.articulation import evaluate_articulation
    from artigrasp.evaluation.report import metrics_dict, metrics_table, write_report

    task = played_task(options.task, policy)
    names = dict.fromkeys((options.controller, *options.baselines))
    controllers = [load_controller(name, task=task, policy=policy) for name in names]
    evaluations = []
    for controller in controllers:
        with progress_bar(f"Measuring {controller.name}", hidden=options.json) as progress:
            evaluations.append(
                evaluate_articulation(
                    controller,
                    references,
                    split=options.split,
                    seed=options.seed,
                    policy=str(policy) if controller.name == "policy" else None,
                    simulator=options.simulator,
                    on_step=lambda step: progress("", step, task.episode_steps),
                )
            )
    write_report(evaluations, options.out)
    if options.json:
        show_json(metrics_dict(evaluations[0]))
    else:
        show(metrics_table(evaluations))
    return 0
