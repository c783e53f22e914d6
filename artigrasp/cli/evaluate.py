"""`artigrasp evaluate`: measure controllers by the paper's protocols."""

import logging
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from artigrasp.assets.library import find_file
from artigrasp.cli.output import show, show_json
from artigrasp.cli.policies import played_task
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig
from artigrasp.errors import UserError
from artigrasp.files import check_folder

if TYPE_CHECKING:
    from artigrasp.controllers.controller import Controller
    from artigrasp.controllers.policy_file import PolicyFile
    from artigrasp.evaluation.chunks import Shard
    from artigrasp.evaluation.evaluate import Evaluation
    from artigrasp.evaluation.experiment import Experiment
    from artigrasp.evaluation.protocols import Protocol
    from artigrasp.references.reference import ReferenceSet

logger = logging.getLogger(__name__)

CHUNKS = "chunks"
"""Folder of an unfinished evaluation's chunks."""


@dataclass(frozen=True)
class Options:
    """Measure a controller on every reference of a split.

    Protocols: articulation plays every reference toward .5, .75, 1, 1.25 and 1.5 rad; grasping lets every reference
    grasp its object and take it to 30 targets in the air; composed lets every grasp carry its object to a target on the
    table, where every articulation opens it; images does articulation and grasping from references that come from
    images, and from those of the same frames that come from motion capture; left-out articulates objects that the
    policy has not seen. Success is counted in three ways: `paper` (the paper's text), `released` (the authors' scripts)
    and `strict` (what a viewer would call success).

    Writes metrics.json, trials.csv (one row per trial), metrics.md and success.png; with baselines, theirs go to
    subfolders and the table and the plot compare them. A search also writes demonstrations.npz. Where a protocol has
    several experiments or splits, each has a folder. Every figure has its trial count and 95 % interval.

    An evaluation that was stopped goes on where it was when it is started again with the same words. Started by
    `torchrun --no-python`, several processes share the trials.

    With --json: the contents of metrics.json, a list of them where there are several.
    """

    protocol: Annotated[str, tyro.conf.Positional]
    """What is measured: articulation, grasping, composed, images or left-out."""
    controller: str = "policy"
    """What acts: policy, pd-ik, d-grasp, search (64 rollouts around pd-ik) or zero (the task's prior alone)."""
    policy: str | None = None
    """Policy: a file, or a name of `artigrasp list policies`."""
    grasp_policy: str | None = None
    """Policy that acts in its place where a sequence grasps and carries: in the protocols grasping and composed."""
    task: str | None = None
    """Task to play: by default the policy's, without one right-fixed."""
    scene: str | None = None
    """Task whose hands and base, fixed or free, controllers meet instead of those of the task that they are for."""
    objects: tuple[str, ...] = ("lidded-box",)
    """Objects to measure on."""
    split: str | None = None
    """Split of the references, by default the protocol's."""
    baselines: tuple[str, ...] = ()
    """Further controllers, measured on the same trials."""
    search: int = 0
    """Rollouts of a search around the controller, for every trial; it no longer acts alone then, and says so."""
    goal_angles: tuple[float, ...] | None = None
    """Target angles of articulation instead of the protocol's [rad]."""
    targets: int | None = None
    """Grasping: the first so many of each reference's 30 targets; by default all."""
    per_object: int | None = None
    """Trials of each object, at most, spread evenly over its references and targets; by default all."""
    retries: int = 0
    """Composed: how often an episode may go back after a failed phase, to grasp again what is not in its place."""
    seed: int = 0
    """Seed of a search and of targets that are drawn; the trials start without noise."""
    failures: int = 0
    """Trials of each object to keep that the first controller fails in: simulated once more, of different causes first,
    as motion files in the folder failures and as a picture, failures.png."""
    worlds: int = 512
    """Worlds simulated at once, at most; trials are measured and kept in chunks of so many."""
    out: Path = Path("evaluation")
    """Folder to write to."""
    simulator: SimulatorConfig = SimulatorConfig()
    """Backend, device and threads."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Measure and write the report."""
    from artigrasp.references.reference import load_references

    files = [None if each is None else find_file("policies", each) for each in (options.policy, options.grasp_policy)]
    references = [load_references(name) for name in options.objects]
    check_folder(options.out)
    if options.per_object is not None and options.per_object < 1:
        raise UserError(f"per-object: expected a positive number, found {options.per_object}")
    if options.failures < 0:
        raise UserError(f"failures: expected 0 or more, found {options.failures}")
    if options.failures and (options.search or options.controller == "search"):
        raise UserError("failures: expected a controller that does not search, found a search")

    start_warp()
    from artigrasp.controllers.policy_file import load_policy
    from artigrasp.evaluation.chunks import Shard
    from artigrasp.evaluation.report import metrics_dict, metrics_table, write_report

    brought = {file: load_policy(file) for file in files if file is not None}
    policy, grasp_policy = (None if file is None else brought[file] for file in files)
    protocol = _asked_protocol(options, brought)
    controllers = _asked_controllers(options, policy, grasp_policy)
    parts = [(experiment, split) for split in protocol.splits for experiment in protocol.experiments]
    shard = Shard.from_environment()
    reports = _measure(parts, controllers, references, [str(each) for each in brought], shard, options)
    if not shard.is_first:
        return 0
    for (experiment, split), evaluations in zip(parts, reports, strict=True):
        folder = options.out if len(parts) == 1 else options.out / f"{experiment.name}-{split}"
        write_report(evaluations, folder)
        if options.failures and evaluations:
            _keep_failures(evaluations[0], controllers[0], references, folder, options)
        if not options.json:
            show(metrics_table(evaluations))
    if options.json:
        metrics = [metrics_dict(evaluations[0]) for evaluations in reports]
        show_json(metrics[0] if len(parts) == 1 else metrics)
    shutil.rmtree(options.out / CHUNKS)
    return 0


def _measure(
    parts: Sequence[tuple["Experiment[Any]", str]],
    controllers: Sequence["Controller"],
    references: Sequence["ReferenceSet"],
    policies: Sequence[str],
    shard: "Shard",
    options: Options,
) -> "list[list[Evaluation[Any]]]":
    """What every controller does in every experiment on its split; nothing but in the first process."""
    from artigrasp.evaluation.evaluate import evaluate

    threads = options.simulator.threads or max(1, (os.cpu_count() or 1) // shard.count)
    reports = []
    for experiment, split in parts:
        # of some objects all image references are of one kind: they are measured in that experiment alone
        played = [each for each in references if each.has(split, experiment.kinds)] if len(parts) > 1 else []
        evaluations = []
        for controller in controllers:
            title = f"Measuring {controller.name}" + (f" on {split}" if len(parts) > 1 else "")
            with progress_bar(title, hidden=options.json or not shard.is_first) as progress:
                evaluation = evaluate(
                    controller,
                    played or references,
                    experiment,
                    split=split,
                    seed=options.seed,
                    per_object=options.per_object,
                    policies=policies if controller.name.startswith("policy") else [],
                    world_count=options.worlds,
                    chunk_folder=options.out / CHUNKS,
                    shard=shard,
                    simulator=replace(options.simulator, threads=threads),
                    on_trial=lambda done, total: progress("", int(done), total),
                )
            if evaluation is not None:
                evaluations.append(evaluation)
        reports.append(evaluations)
    return reports


def _asked_protocol(options: Options, policies: "Mapping[Path, PolicyFile]") -> "Protocol":
    """The protocol with other goal angles, targets or splits than its own where they were asked for.

    Raises:
        UserError: It is none for these policies.
    """
    from artigrasp.evaluation.articulation import ARTICULATION, toward
    from artigrasp.evaluation.composed import COMPOSED, with_retries
    from artigrasp.evaluation.grasping import GRASPING, with_targets
    from artigrasp.evaluation.protocols import get_protocol

    protocol = get_protocol(options.protocol)
    instead = {each.name: each for each in protocol.experiments}
    if options.goal_angles is not None:
        instead[ARTICULATION.name] = toward(options.goal_angles)
    if options.targets is not None:
        instead[GRASPING.name] = with_targets(options.targets)
    if options.retries:
        instead[COMPOSED.name] = with_retries(options.retries)
    splits = protocol.splits if options.split is None else (options.split,)
    protocol = replace(protocol, experiments=tuple(instead[each.name] for each in protocol.experiments), splits=splits)
    for file, content in policies.items() if protocol.unseen_objects else ():
        if seen := set(options.objects) & set(content.objects):
            raise UserError(f"objects: expected objects that {file} has not seen, found {', '.join(sorted(seen))}")
    if policies:
        protocol = _learned(protocol, {kind for each in policies.values() for kind in each.task.kinds})
    if options.grasp_policy is not None and any(not each.sequence for each in protocol.experiments):
        raise UserError(f"grasp-policy: expected a protocol of sequences only, found {options.protocol}")
    return protocol


def _asked_controllers(
    options: Options, policy: "PolicyFile | None", grasp_policy: "PolicyFile | None"
) -> "list[Controller]":
    """The controller and the baselines, in the scene that was asked for."""
    from artigrasp.controllers.library import make_controller
    from artigrasp.controllers.skills import in_scene
    from artigrasp.tasks import get_task

    task = played_task(options.task, policy or grasp_policy)
    wanted = dict.fromkeys([(options.controller, options.search), *((name, 0) for name in options.baselines)])
    controllers = [
        make_controller(name, task=task, policy=policy, grasp_policy=grasp_policy, search=search, seed=options.seed)
        for name, search in wanted
    ]
    if options.scene is None:
        return controllers
    return [in_scene(each, get_task(options.scene)) for each in controllers]


def _keep_failures(
    evaluation: "Evaluation[Any]",
    controller: "Controller",
    references: Sequence["ReferenceSet"],
    folder: Path,
    options: Options,
) -> None:
    """Write motions of failures, and a picture of them."""
    from artigrasp.evaluation.failures import replay_failures
    from artigrasp.export.picture import Style, render_filmstrip
    from artigrasp.motion.file import save_motion

    with progress_bar("Simulating failures", hidden=options.json) as progress:
        failures = replay_failures(
            evaluation,
            controller,
            references,
            options.failures,
            simulator=options.simulator,
            on_failure=lambda done, total: progress("", done, total),
        )
    titles = []
    for each in failures:
        save_motion(folder / "failures" / f"{each.motion.object}-{each.trial}.npz", each.motion)
        titles.append(f"{each.motion.object}, trial {each.trial}: {each.cause or 'no success'}")
    if failures:
        with progress_bar("Rendering failures", hidden=options.json) as progress:
            render_filmstrip(
                [each.motion for each in failures],
                folder / "failures.png",
                titles=titles,
                style=Style(width=220, height=220, target=True),
                progress=lambda done, total: progress("", done, total),
            )


def _learned(protocol: "Protocol", skills: set[str]) -> "Protocol":
    """The protocol without experiments in which policies of these skills would not act, so that PD+IK is not for them.

    Raises:
        UserError: None is left.
    """
    fitting = tuple(each for each in protocol.experiments if skills & set(each.kinds))
    if not fitting:
        needed = " or ".join(sorted({kind for each in protocol.experiments for kind in each.kinds}))
        raise UserError(f"policy: expected one that learned to {needed}, found one for {' and '.join(sorted(skills))}")
    for each in protocol.experiments:
        if each not in fitting:
            logger.warning("%s is left out: the policy learned to %s only", each.name, " and ".join(sorted(skills)))
    return replace(protocol, experiments=fitting)
