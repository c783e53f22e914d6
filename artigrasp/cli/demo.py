"""`artigrasp demo`: the main job on what is shipped."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from artigrasp.cli.output import show, show_json
from artigrasp.cli.policies import policies_for
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig
from artigrasp.files import check_folder


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
    from artigrasp.references.reference import join_references, load_references

    check_folder(options.out)
    references = load_references(options.object)
    policies = policies_for(options.object)
    start_warp()

    from artigrasp.controllers.controller import Controller, pd_ik_controller
    from artigrasp.controllers.library import make_controller
    from artigrasp.evaluation.composed import COMPOSED, strict_success
    from artigrasp.evaluation.evaluate import evaluate
    from artigrasp.evaluation.report import metrics_dict, metrics_table, write_report
    from artigrasp.export.picture import render_filmstrip
    from artigrasp.export.usd import export_usd
    from artigrasp.motion.file import save_motion
    from artigrasp.motion.generate import generate
    from artigrasp.tasks import get_task
    from artigrasp.tasks.sequences import GRASP_THEN_ARTICULATE

    scene = get_task("both-free")
    controllers: list[Controller] = [pd_ik_controller(scene)]
    if policies:
        opens, grasps = (policies[kind][1] if kind in policies else None for kind in ("articulate", "grasp"))
        controllers.insert(0, make_controller("policy", task=scene, policy=opens, grasp_policy=grasps))
    evaluations = []
    for each in controllers:
        with progress_bar(f"Measuring {each.name}", hidden=options.json) as progress:
            evaluation = evaluate(
                each,
                [references],
                COMPOSED,
                split="test",
                seed=options.seed,
                per_object=options.pairs,
                policies=[] if each.name == "pd-ik" else [name for name, _ in policies.values()],
                simulator=options.simulator,
                on_trial=lambda done, total: progress("", int(done), total),
            )
        if evaluation is not None:
            evaluations.append(evaluation)

    outcomes, trials = evaluations[0].outcomes, evaluations[0].trials
    done = strict_success(outcomes)
    error = outcomes.angle_error + 5.0 * outcomes.position_error + outcomes.rotation_error
    pair = int(np.argmax(np.where(done, outcomes.goal_angle, -1.0 - error)))
    chosen = references.select(split="test", kind=COMPOSED.kinds)
    rows = trials.reference[pair], trials.targets["second_reference"][pair]
    steps = sum(phase.most_steps for phase in GRASP_THEN_ARTICULATE)
    with progress_bar("Generating the motion", hidden=options.json) as progress:
        motion = generate(
            controllers[0],
            join_references([chosen.select(indices=row) for row in rows]),
            float(trials.targets["goal_angle"][pair]),
            sequence=GRASP_THEN_ARTICULATE,
            target_offset=trials.targets["target_offset"][pair],
            seed=options.seed,
            simulator=options.simulator,
            on_step=lambda step: progress("", step, steps),
        )
    paths = {
        "motion": options.out / "motion.npz",
        "usd": options.out / "motion.usdc",
        "picture": options.out / "motion.png",
        "evaluation": options.out / "evaluation",
    }
    save_motion(paths["motion"], motion)
    export_usd(motion, paths["usd"])
    render_filmstrip(motion, paths["picture"])
    write_report(evaluations, paths["evaluation"])

    if options.json:
        show_json(
            {
                **{name: str(path) for name, path in paths.items()},
                "success": bool(done[pair]),
                "metrics": dict(motion.metrics),
                "phases": dict(line.split(": ") for line in motion.provenance["phases"].splitlines()),
                "protocols": metrics_dict(evaluations[0])["protocols"],
            }
        )
    else:
        show(metrics_table(evaluations))
        distance, turn = 100 * motion.metrics["position_error"], motion.metrics["rotation_error"]
        show(
            f"{'done' if done[pair] else 'not done'}: {options.object} is {distance:.1f} cm and {turn:.2f} rad from "
            f"its target pose and open to {motion.metrics['final_angle']:.2f} of {motion.target_angle:.2f} rad, by "
            f"{controllers[0].name}; {done.sum()} of {len(done)} pairs of test references were done"
        )
        for path in paths.values():
            show(f"wrote {path}")
    return 0 if done[pair] else 1
