"""A motion that somebody wishes for in the panel, and how it is made."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from artigrasp.config import SimulatorConfig
from artigrasp.controllers.library import SEARCH_ROLLOUTS, make_controller
from artigrasp.controllers.policy_file import load_policy
from artigrasp.errors import UserError
from artigrasp.motion.choice import choose_references, target_offset
from artigrasp.motion.generate import generate
from artigrasp.motion.motion import Motion
from artigrasp.references.reference import load_references
from artigrasp.tasks import get_task
from artigrasp.tasks.sequences import SEQUENCES
from artigrasp.viewer.jobs import Progress

OPEN = "open it where it is"
SEQUENCE_OF = {
    "carry it, then open it": "grasp-then-articulate",
    "open it, then carry it": "articulate-then-grasp",
}
WHATS = (OPEN, *SEQUENCE_OF)
BASELINES = {"PD+IK": "pd-ik", "D-Grasp": "d-grasp", f"search, {SEARCH_ROLLOUTS} rollouts": "search"}
"""What can act without a policy, by its name in the panel."""
SPLIT = "test"


@dataclass(frozen=True)
class Wish:
    """What is wished for.

    Attributes:
        object: Name of the object.
        what: One of ``WHATS``.
        actor: One of ``BASELINES``, or the name of a policy.
        reference: Index of the articulation reference in the test split.
        grasp: Index of the grasp reference there.
        angle: Hinge angle to reach [rad].
        shift: From the object's start to its target, along x and y of the world [m].
        yaw: Turn of the target about the vertical [rad].
        seed: Of the environment and of a search.
    """

    object: str
    what: str = OPEN
    actor: str = "PD+IK"
    reference: int = 0
    grasp: int = 0
    angle: float = 1.0
    shift: tuple[float, float] = (-0.08, -0.08)
    yaw: float = 0.0
    seed: int = 0


def fulfil(
    wish: Wish,
    policies: Mapping[str, Path],
    progress: Progress,
    simulator: SimulatorConfig = SimulatorConfig(),
) -> Motion:
    """Generate the motion.

    Args:
        wish: What is wished for.
        policies: Policy files by name.
        progress: Told how many control steps are done, and how many there are in all; it may raise.
        simulator: Backend, device and threads.

    Raises:
        UserError: There is no such object, reference or policy.
    """
    sequence = SEQUENCE_OF.get(wish.what)
    references = choose_references(
        load_references(wish.object), sequence, split=SPLIT, articulation=wish.reference, grasp=wish.grasp
    )
    if wish.actor not in BASELINES and wish.actor not in policies:
        raise UserError(f"no policy {wish.actor!r} any more")
    policy = None if wish.actor in BASELINES else load_policy(policies[wish.actor])
    name = BASELINES.get(wish.actor, "policy")
    whole: dict[str, Any] = {}
    if sequence is None:
        task = get_task("right-fixed") if policy is None else policy.task
    else:
        task = get_task("both-free")
        whole = {"sequence": SEQUENCES[sequence], "target_offset": target_offset((*wish.shift, 0.0), wish.yaw)}
    controller = make_controller(name, task=task, policy=policy, seed=wish.seed)
    phases = whole.get("sequence", ())
    steps = sum(each.most_steps for each in phases) if phases else controller.task.episode_steps
    return generate(
        controller,
        references,
        wish.angle,
        **whole,
        seed=wish.seed,
        simulator=simulator,
        on_step=lambda step: progress(step, steps),
        on_plan=progress,
    )


def reference_counts(object: str) -> tuple[int, int]:
    """How many articulation and grasp references an object has in the test split."""
    references = load_references(object)
    kinds = references.kind[[split == SPLIT for split in references.split]].tolist()
    return kinds.count("articulate"), kinds.count("grasp")
