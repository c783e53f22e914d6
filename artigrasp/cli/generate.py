"""`artigrasp generate`: one motion from a reference, a target angle and a controller."""

from dataclasses import dataclass
from pathlib import Path

from artigrasp.cli.output import show, show_json
from artigrasp.cli.policies import find_policy, played_task
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig
from artigrasp.errors import UserError
from artigrasp.files import check_target


@dataclass(frozen=True)
class Options:
    """Simulate one motion and write it as motion.npz.

    With --json: {"motion": file, "metrics": {name: value}}.
    """

    object: str = "lidded-box"
    """Object to open."""
    split: str = "test"
    """Split of the reference."""
    reference: int = 0
    """Index of the articulation reference in that split."""
    target_angle: float = 1.0
    """Hinge angle to reach [rad]."""
    controller: str | None = None
    """What acts: policy, pd-ik, d-grasp, search (64 rollouts around pd-ik) or zero (the task's prior alone); by default
    the policy if there is one, else pd-ik."""
    policy: str | None = None
    """Policy of the controller "policy": a file, or a name of `artigrasp list policies`."""
    task: str | None = None
    """Task to play: by default the policy's, without one right-fixed."""
    search: int = 0
    """Rollouts of a search around what acts; the best of them is played."""
    seed: int = 0
    """Seed of the environment and of a search."""
    out: Path = Path("motion.npz")
    """Motion file to write."""
    simulator: SimulatorConfig = SimulatorConfig()
    """Backend, device and threads."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Generate the motion."""
    from artigrasp.assets.object import load_object
    from artigrasp.references.reference import load_references

    policy = find_policy(options.policy) if options.policy is not None else None
    reference = load_references(options.object).select(
        split=options.split, kind="articulate", indices=options.reference
    )
    widest = load_object(options.object).hinge_upper
    if not 0 <= options.target_angle <= widest:
        expected = f"0 to {widest:.2f} rad, as far as {options.object} opens"
        raise UserError(f"target-angle: expected {expected}, found {options.target_angle}")
    check_target(options.out)

    start_warp()
    from artigrasp.controllers.library import load_controller
    from artigrasp.motion.file import save_motion
    from artigrasp.motion.generate import generate

    name = options.controller or ("pd-ik" if policy is None else "policy")
    task = played_task(options.task, policy)
    controller = load_controller(name, task=task, policy=policy, search=options.search, seed=options.seed)
    with progress_bar("Simulating", hidden=options.json) as progress:
        motion = generate(
            controller,
            reference,
            options.target_angle,
            seed=options.seed,
            simulator=options.simulator,
            on_step=lambda step: progress("", step, controller.task.episode_steps),
            on_plan=lambda done, total: progress("searching", done, total),
        )
    save_motion(options.out, motion)
    if options.json:
        show_json({"motion": str(options.out), "metrics": dict(motion.metrics)})
        return 0
    show(
        f"{motion.object}: opened to {motion.metrics['final_angle']:.2f} rad, target {motion.target_angle:.2f} rad, "
        f"by {controller.name} from {motion.provenance['reference']}"
    )
    show(f"wrote {options.out}")
    return 0
