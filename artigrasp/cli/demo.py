"""`artigrasp demo`: the main job on what is shipped."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from artigrasp.cli.output import show, show_json
from artigrasp.cli.policies import Policies, policies_for
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig
from artigrasp.errors import UserError
from artigrasp.files import check_folder

if TYPE_CHECKING:
    from artigrasp.controllers.controller import Controller
    from artigrasp.evaluation.composed import ComposedOutcomes
    from artigrasp.evaluation.evaluate import Evaluation
    from artigrasp.evaluation.experiment import Trials
    from artigrasp.motion.motion import Motion
    from artigrasp.references.reference import ReferenceSet


@dataclass(frozen=True)
class Options:
    """Carry a shipped object to a target and open it there: metrics, a motion, a USD animation and a picture.

    The paper's composed task on pairs of test references, each of a grasp and an articulation: both hands grasp the
    object, carry it to its target pose, put it down and let go, and one opens it. Shipped policies that learned on the
    object act in the phases of their skills, PD+IK in the others, and PD+IK alone is measured beside them. Of the pairs
    that do it the one that opens widest is shown; if none does, the nearest, and the exit code is 1. Writes motion.npz,
    motion.usdc, motion.png and the folder evaluation/.

    With --json: {"motion", "usd", "picture", "evaluation": paths, "success": whether it is done, "metrics": {name:
    value}, "phases": {name: what became of it}, "protocols": as in metrics.json}.
    """

    object: str = "open-box"
    """Object to carry and to open."""
    pairs: int = 8
    """Pairs of references to measure, at most."""
    seed: int = 0
    """Seed of the targets."""
    out: Path = Path("demo")
    """Folder to write to."""
    simulator: SimulatorConfig = SimulatorConfig()
    """Backend, device and threads."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Measure, generate, export and render."""
    from artigrasp.references.reference import load_references

    check_folder(options.out)
    if options.pairs < 1:
        raise UserError(f"pairs: expected a positive number, found {options.pairs}")
    references = load_references(options.object)
    policies = policies_for(options.object)
    start_warp()

    from artigrasp.evaluation.composed import strict_success

    controllers = _controllers(policies)
    evaluations = [_measure(each, references, policies, options) for each in controllers]
    outcomes = evaluations[0].outcomes
    done = strict_success(outcomes)
    error = outcomes.angle_error + 5.0 * outcomes.position_error + outcomes.rotation_error
    pair = int(np.argmax(np.where(done, outcomes.goal_angle, -1.0 - error)))
    motion = _generate(controllers[0], references, evaluations[0].trials, pair, options)
    paths = _write(motion, evaluations, options.out)
    if options.json:
        _show_json(motion, evaluations[0], bool(done[pair]), paths)
    else:
        _show_text(motion, evaluations, done, pair, paths)
    return 0 if done[pair] else 1


def _controllers(policies: Policies) -> "list[Controller]":
    """The shipped policies of the object, if there are any, and PD+IK."""
    from artigrasp.controllers.controller import pd_ik_controller
    from artigrasp.controllers.library import make_controller
    from artigrasp.tasks import get_task

    scene = get_task("both-free")
    controllers: list[Controller] = [pd_ik_controller(scene)]
    if policies:
        opens, grasps = (policies[kind][1] if kind in policies else None for kind in ("articulate", "grasp"))
        controllers.insert(0, make_controller("policy", task=scene, policy=opens, grasp_policy=grasps))
    return controllers


def _measure(
    controller: "Controller", references: "ReferenceSet", policies: Policies, options: Options
) -> "Evaluation[ComposedOutcomes]":
    """The composed task on pairs of test references."""
    from artigrasp.evaluation.composed import COMPOSED
    from artigrasp.evaluation.evaluate import evaluate

    with progress_bar(f"Measuring {controller.name}", hidden=options.json) as progress:
        evaluation = evaluate(
            controller,
            [references],
            COMPOSED,
            split="test",
            seed=options.seed,
            per_object=options.pairs,
            policies=[] if controller.name == "pd-ik" else [name for name, _ in policies.values()],
            simulator=options.simulator,
            on_trial=lambda done, total: progress("", int(done), total),
        )
    assert evaluation is not None  # there is but one process
    return evaluation


def _generate(
    controller: "Controller", references: "ReferenceSet", trials: "Trials", pair: int, options: Options
) -> "Motion":
    """One of the measured trials as a motion."""
    from artigrasp.evaluation.composed import COMPOSED
    from artigrasp.motion.generate import generate
    from artigrasp.references.reference import join_references
    from artigrasp.tasks.sequences import GRASP_THEN_ARTICULATE

    chosen = references.select(split="test", kind=COMPOSED.kinds)
    rows = trials.reference[pair], trials.targets["second_reference"][pair]
    steps = sum(phase.most_steps for phase in GRASP_THEN_ARTICULATE)
    with progress_bar("Generating the motion", hidden=options.json) as progress:
        return generate(
            controller,
            join_references([chosen.select(indices=row) for row in rows]),
            float(trials.targets["goal_angle"][pair]),
            sequence=GRASP_THEN_ARTICULATE,
            target_offset=trials.targets["target_offset"][pair],
            seed=options.seed,
            simulator=options.simulator,
            on_step=lambda step: progress("", step, steps),
        )


def _write(motion: "Motion", evaluations: "Sequence[Evaluation[ComposedOutcomes]]", folder: Path) -> dict[str, Path]:
    """Write what there is to keep; where it lies, by what it is."""
    from artigrasp.evaluation.report import write_report
    from artigrasp.export.picture import render_filmstrip
    from artigrasp.export.usd import export_usd
    from artigrasp.motion.file import save_motion

    paths = {
        "motion": folder / "motion.npz",
        "usd": folder / "motion.usdc",
        "picture": folder / "motion.png",
        "evaluation": folder / "evaluation",
    }
    save_motion(paths["motion"], motion)
    export_usd(motion, paths["usd"])
    render_filmstrip(motion, paths["picture"])
    write_report(evaluations, paths["evaluation"])
    return paths


def _show_json(
    motion: "Motion", evaluation: "Evaluation[ComposedOutcomes]", is_done: bool, paths: dict[str, Path]
) -> None:
    from artigrasp.evaluation.report import metrics_dict

    show_json(
        {
            **{name: str(path) for name, path in paths.items()},
            "success": is_done,
            "metrics": dict(motion.metrics),
            "phases": dict(line.split(": ") for line in motion.provenance["phases"].splitlines()),
            "protocols": metrics_dict(evaluation)["protocols"],
        }
    )


def _show_text(
    motion: "Motion",
    evaluations: "Sequence[Evaluation[ComposedOutcomes]]",
    done: NDArray[np.bool_],
    pair: int,
    paths: dict[str, Path],
) -> None:
    from artigrasp.evaluation.report import metrics_table

    show(metrics_table(evaluations))
    distance, turn = 100 * motion.metrics["position_error"], motion.metrics["rotation_error"]
    show(
        f"{'done' if done[pair] else 'not done'}: {motion.object} is {distance:.1f} cm and {turn:.2f} rad from "
        f"its target pose and open to {motion.metrics['final_angle']:.2f} of {motion.target_angle:.2f} rad, by "
        f"{evaluations[0].controller}; {done.sum()} of {len(done)} pairs of test references were done"
    )
    for path in paths.values():
        show(f"wrote {path}")
