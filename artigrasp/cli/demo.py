"""`artigrasp demo`: the main job on what is shipped."""

from dataclasses import dataclass
from pathlib import Path

from artigrasp.cli.output import show, show_json
from artigrasp.cli.policies import find_policy
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig

OBJECT = POLICY = "lidded-box"
TARGET_ANGLE = 1.0


@dataclass(frozen=True)
class Options:
    """Open the shipped box with the shipped policy: metrics, a motion, a USD animation and a picture.

    The policy plays a reference that it was not trained on. Its success over all test references is measured beside
    that of the PD+IK baseline. Writes motion.npz, motion.usdc, motion.png and the folder evaluation/.

    With --json: {"motion", "usd", "picture", "evaluation": paths, "metrics": {name: value}, "protocols": as in
    metrics.json}.
    """

    reference: int = 0
    """Index of the test reference to play."""
    target_angle: float = TARGET_ANGLE
    """Hinge angle to reach [rad]."""
    out: Path = Path("demo")
    """Folder to write to."""
    simulator: SimulatorConfig = SimulatorConfig()
    """Backend, device and threads."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Generate, export, render and measure."""
    from artigrasp.references.reference import load_references

    references = load_references(OBJECT)
    reference = references.select(split="test", kind="articulate", indices=options.reference)
    policy = find_policy(POLICY)
    start_warp()

    from artigrasp.controllers.controller import pd_ik_controller
    from artigrasp.controllers.library import load_controller
    from artigrasp.evaluation.articulation import ARTICULATION
    from artigrasp.evaluation.evaluate import evaluate
    from artigrasp.evaluation.report import metrics_dict, metrics_table, write_report
    from artigrasp.export.picture import render_filmstrip
    from artigrasp.export.usd import export_usd
    from artigrasp.motion.file import save_motion
    from artigrasp.motion.generate import generate
    from artigrasp.tasks import get_task

    controller = load_controller("policy", task=get_task("right-fixed"), policy=policy)
    steps = controller.task.episode_steps
    with progress_bar("Opening the box", hidden=options.json) as progress:
        motion = generate(
            controller,
            reference,
            options.target_angle,
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

    evaluations = []
    for each in (controller, pd_ik_controller(controller.task)):
        with progress_bar(f"Measuring {each.name}", hidden=options.json) as progress:
            evaluation = evaluate(
                each,
                [references],
                ARTICULATION,
                split="test",
                policies=[policy.name] if each is controller else [],
                simulator=options.simulator,
                on_trial=lambda done, total: progress("", int(done), total),
            )
        if evaluation is not None:
            evaluations.append(evaluation)
    write_report(evaluations, paths["evaluation"])
    if options.json:
        protocols = metrics_dict(evaluations[0])["protocols"]
        show_json(
            {
                **{name: str(path) for name, path in paths.items()},
                "metrics": dict(motion.metrics),
                "protocols": protocols,
            }
        )
        return 0
    show(
        f"opened the lid to {motion.metrics['final_angle']:.2f} rad, target {motion.target_angle:.2f} rad, "
        f"from {motion.provenance['reference']}"
    )
    show()
    show(metrics_table(evaluations))
    for path in paths.values():
        show(f"wrote {path}")
    return 0
