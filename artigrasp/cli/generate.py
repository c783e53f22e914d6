"""`artigrasp generate`: one motion from a reference, a target angle and a controller."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from artigrasp.assets.library import find_file
from artigrasp.cli.output import show, show_json
from artigrasp.cli.policies import played_task
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig
from artigrasp.errors import UserError
from artigrasp.files import check_target

if TYPE_CHECKING:
    from artigrasp.motion.motion import Motion


@dataclass(frozen=True)
class Options:
    """Simulate one motion and write it as motion.npz.

    One hand opens an object; with --sequence, both hands also grasp it and carry it to a target pose. The motion then
    tells what became of each phase, and why one failed.

    With --json: {"motion": file, "metrics": {name: value}, "phases": {name: what became of it}},
    the last for a sequence only.
    """

    object: str = "lidded-box"
    """Object to open."""
    split: str = "test"
    """Split of the references."""
    reference: int = 0
    """Index of the articulation reference in that split."""
    target_angle: float = 1.0
    """Hinge angle to reach [rad]."""
    sequence: Literal["grasp-then-articulate", "articulate-then-grasp"] | None = None
    """Phases to play: carry the object to its target and open it there, or open it and carry it; by default it is only
    opened."""
    grasp_reference: int = 0
    """Index of the grasp reference in that split."""
    target_shift: tuple[float, float, float] = (-0.08, -0.08, 0.0)
    """From the object's start to its target, along the world's axes [m]."""
    target_yaw: float = 0.0
    """Turn of the target about the vertical [rad]."""
    retries: int = 0
    """How often a phase that failed may be tried again."""
    controller: str | None = None
    """What acts: policy, pd-ik, d-grasp, search (64 rollouts around pd-ik) or zero (the task's prior alone); by default
    the policy if there is one, else pd-ik."""
    policy: str | None = None
    """Policy of the controller "policy": a file, or a name of `artigrasp list policies`."""
    grasp_policy: str | None = None
    """Policy that acts in its place where a sequence grasps and carries."""
    task: str | None = None
    """Task to play: by default the policy's, without one right-fixed, or both-free for a sequence."""
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
    from artigrasp.motion.choice import choose_references, target_offset
    from artigrasp.references.reference import load_references

    files = [None if each is None else find_file("policies", each) for each in (options.policy, options.grasp_policy)]
    if options.grasp_policy is not None and options.sequence is None:
        raise UserError("grasp-policy: expected a --sequence in which it acts, found none")
    references = choose_references(
        load_references(options.object),
        options.sequence,
        split=options.split,
        articulation=options.reference,
        grasp=options.grasp_reference,
    )
    widest = load_object(options.object).hinge_upper
    if not 0 <= options.target_angle <= widest:
        expected = f"0 to {widest:.2f} rad, as far as {options.object} opens"
        raise UserError(f"target-angle: expected {expected}, found {options.target_angle}")
    check_target(options.out)

    start_warp()
    from artigrasp.controllers.library import make_controller
    from artigrasp.controllers.policy_file import load_policy
    from artigrasp.motion.file import save_motion
    from artigrasp.motion.generate import generate
    from artigrasp.tasks.sequences import SEQUENCES

    policy, grasp_policy = (None if file is None else load_policy(file) for file in files)
    brought = policy or grasp_policy
    name = options.controller or ("pd-ik" if brought is None else "policy")
    task = played_task(options.task or (None if options.sequence is None or brought else "both-free"), brought)
    controller = make_controller(
        name, task=task, policy=policy, grasp_policy=grasp_policy, search=options.search, seed=options.seed
    )
    whole: dict[str, Any] = {}
    total_steps = controller.task.episode_steps
    if options.sequence is not None:
        sequence = SEQUENCES[options.sequence]
        offset = target_offset(options.target_shift, options.target_yaw)
        whole = {"sequence": sequence, "target_offset": offset, "retry_count": options.retries}
        total_steps = (1 + options.retries) * sum(each.most_steps for each in sequence)
    with progress_bar("Simulating", hidden=options.json) as progress:
        motion = generate(
            controller,
            references,
            options.target_angle,
            **whole,
            seed=options.seed,
            simulator=options.simulator,
            on_step=lambda step: progress("", step, total_steps),
            on_plan=lambda done, total: progress("searching", done, total),
        )
    save_motion(options.out, motion)
    _tell(motion, controller.name, options)
    return 0


def _tell(motion: "Motion", controller: str, options: Options) -> None:
    """Print what happened."""
    phases = dict(line.split(": ") for line in motion.provenance.get("phases", "").splitlines())
    if options.json:
        show_json(
            {"motion": str(options.out), "metrics": dict(motion.metrics)} | ({"phases": phases} if phases else {})
        )
        return
    show(
        f"{motion.object}: opened to {motion.metrics['final_angle']:.2f} rad, target {motion.target_angle:.2f} rad, "
        f"by {controller} from {motion.provenance['reference']}"
    )
    if phases:
        distance, turn = motion.metrics["position_error"], motion.metrics["rotation_error"]
        show(f"{100 * distance:.1f} cm and {turn:.2f} rad from its target pose")
        show(", ".join(f"{name} {outcome}" for name, outcome in phases.items()))
    show(f"wrote {options.out}")
