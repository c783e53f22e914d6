"""What a step of a story means: which references may do it, in which phases, and when it is done."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from artigrasp.config import PhaseConfig
from artigrasp.config.story import MoveStep, ReleaseStep, Step, StoryConfig
from artigrasp.controllers.search import Objective
from artigrasp.environment.instant import Instant
from artigrasp.environment.worlds import DRAW_GOAL
from artigrasp.errors import UserError
from artigrasp.kernels.layout import HANDS
from artigrasp.references.reference import ReferenceSet
from artigrasp.tasks.sequences import ARTICULATE, GRASP, PUT_DOWN, RELEASE, RELOCATE, RETREAT, TRANSIT, WITHDRAW

LARGEST_SHIFT, LARGEST_TURN = 0.1, 0.7
"""How far other objects may be moved [m] and turned [rad] by a step that succeeds."""
LARGEST_DISPLACEMENT = 0.1
"""How far the base may be moved by what should only turn its hinge [m]."""
LEAST_WRIST_HEIGHT = 0.02
"""Of a wrist over the table in a reference that is tried [m]."""


@dataclass(frozen=True, eq=False)
class Hold:
    """What a hand holds."""

    slot: int
    """Which object of the story."""
    reference: ReferenceSet
    """One reference, by which it holds it."""
    offsets: NDArray[np.float32]
    """What was decided for both hands, [1, H, direction]."""


@dataclass(frozen=True, eq=False)
class Situation:
    """Where a story has come to."""

    instant: Instant
    """Hands and objects, in the story's order."""
    holds: Mapping[str, Hold] = field(default_factory=dict)
    """What hands hold, by their sides."""

    def after(
        self, instant: Instant, plan: "StepPlan", reference: ReferenceSet, offsets: NDArray[np.float32]
    ) -> "Situation":
        """Where a step has led to.

        Args:
            instant: Hands and objects after it.
            plan: What was done.
            reference: The one by which it was done.
            offsets: What was decided, [1, H, direction].
        """
        used = {side for side, active in zip(HANDS, reference.active[0], strict=True) if active}
        holds = {side: hold for side, hold in self.holds.items() if side not in used}
        if plan.holds:
            holds |= dict.fromkeys(used, Hold(plan.slot, reference, offsets))
        return Situation(instant, holds)


@dataclass(frozen=True, eq=False)
class StepPlan:
    """How a step may be done from a situation."""

    slot: int
    """The object that it is about."""
    references: ReferenceSet
    """References to try, at least one."""
    phases: tuple[PhaseConfig, ...]
    """What is done with each."""
    objective: Objective
    """When it is done."""
    goal_angle: float
    """Hinge angle to reach [rad], or ``DRAW_GOAL`` for the one that there is."""
    target_object_pose: NDArray[np.float32]
    """Where the base should go: position [m], quaternion xyzw, shape [7]."""
    holds: bool
    """Whether the hands stay on the object."""
    offsets: NDArray[np.float32] | None = None
    """What was decided before by hands that hold the object already, [1, H, direction]."""


def plan_step(step: Step, story: StoryConfig, situation: Situation, references: Sequence[ReferenceSet]) -> StepPlan:
    """How a step may be done from where its story has come to.

    Args:
        step: The step.
        story: Its story.
        situation: Where it has come to.
        references: Those of every object, in the story's order.

    Raises:
        UserError: A hand should let go and holds nothing, or no reference fits: hands are busy, or there is none.
    """
    names, instant = list(story.objects), situation.instant
    last: tuple[PhaseConfig, ...] = () if getattr(step, "hold", False) else _let_go(step)
    goal_angle, target = DRAW_GOAL, None
    phases: tuple[PhaseConfig, ...]
    if isinstance(step, ReleaseStep):
        held = situation.holds.get(step.release)
        if held is None:
            raise UserError(f"expected a {step.release} hand that holds something, found one that holds nothing")
        slot, phases = held.slot, last
    elif isinstance(step, MoveStep):
        slot = names.index(step.move)
        held = _hold_of(step, "grasp", slot, situation)
        phases = (*_approach(held, GRASP), *_carry(step, held), *last)
        target = target_pose(step, names, instant)
    else:
        slot, goal_angle = names.index(step.object), step.to
        held = _hold_of(step, "articulate", slot, situation)
        turn = ARTICULATE if held is None else _holding_on(ARTICULATE)
        phases = (*_approach(held), replace(turn, reference="first", steadies=False))
        phases += tuple(replace(each, opens=True) for each in last)
    return StepPlan(
        slot=slot,
        references=_free_references(step, references[slot], situation, slot) if held is None else held.reference,
        phases=phases,
        objective=step_objective(step, len(names) > 1),
        goal_angle=goal_angle,
        target_object_pose=instant.pose[slot] if target is None else target,
        holds=not last,
        offsets=None if held is None else held.offsets,
    )


def target_pose(step: MoveStep, names: Sequence[str], instant: Instant) -> NDArray[np.float32]:
    """Where an object should be moved to in the world: position [m], quaternion xyzw, shape [7]."""
    rotation = Rotation.from_euler("xyz", [step.roll, step.pitch, step.yaw])
    target = RigidTransform.from_components(step.to, rotation)
    if step.relative_to is not None:
        other = instant.pose[names.index(step.relative_to)]
        target = RigidTransform.from_components(other[:3], Rotation.from_quat(other[3:])) * target
    position, turn = target.as_components()
    return np.concatenate([position, turn.as_quat()]).astype(np.float32)


def step_objective(step: Step, has_bystanders: bool) -> Objective:
    """When a step is done, and what makes one way of doing it better than another."""
    within: dict[str, tuple[float, float]] = {}
    weights, error = {"max_tilt": -0.1}, "final_displacement"
    if isinstance(step, MoveStep):
        within["position_error"] = (-np.inf, step.tolerance)
        within["rotation_error"] = (-np.inf, step.turn_tolerance)
        weights |= {"position_error": -5.0, "rotation_error": -1.0}
        error = "position_error"
    elif not isinstance(step, ReleaseStep):
        within |= {"angle_error": (-np.inf, step.tolerance), "max_displacement": (-np.inf, LARGEST_DISPLACEMENT)}
        weights |= {"angle_error": -1.0, "mean_angle_error": -0.2, "max_displacement": -3.0}
        error = "angle_error"
    if has_bystanders:
        within |= {"bystander_shift": (-np.inf, LARGEST_SHIFT), "bystander_turn": (-np.inf, LARGEST_TURN)}
        weights |= {"bystander_shift": -3.0, "bystander_turn": -0.5}
    return Objective(within, weights, error)


def _hold_of(step: Step, kind: str, slot: int, situation: Situation) -> Hold | None:
    """How an object is held, if that is by a hand that the step may use, as it needs it."""
    wanted = getattr(step, "hand", None)
    for side, hold in situation.holds.items():
        if hold.slot == slot and hold.reference.kind[0] == kind and wanted in (None, "both", side):
            return hold
    return None


def _let_go(step: Step) -> tuple[PhaseConfig, ...]:
    """How hands come off an object and out of the way; of what they drop there is nothing to draw out of."""
    if getattr(step, "drop", 0.0):
        return replace(RELEASE, drops=True), replace(WITHDRAW, drops=True)
    return RELEASE, RETREAT, WITHDRAW


def _approach(held: Hold | None, *then: PhaseConfig) -> tuple[PhaseConfig, ...]:
    """How hands come to the object; those that hold it are there."""
    return (replace(TRANSIT, reference="first", steadies=False), *then) if held is None else ()


def _holding_on(turn: PhaseConfig) -> PhaseConfig:
    """A turn of the hinge by a hand that is closed already."""
    action = replace(
        turn.action, finger_prior="closed", approach_steps=20, approach_arc=0.0, lead_start=20, lead_end=200
    )
    return replace(turn, action=action)


def _carry(step: MoveStep, held: Hold | None) -> tuple[PhaseConfig, ...]:
    """Up, over and down."""
    carry = replace(RELOCATE, retry_from=RELOCATE.retry_from if held is None else None)
    down = replace(PUT_DOWN, retry_from=carry.retry_from, lift=step.drop)
    return (
        replace(carry, name="raise", lift=step.clearance, raises=True, most_steps=200, action=down.action),
        replace(carry, lift=step.clearance + step.drop),
        down,
    )


def _free_references(step: Step, references: ReferenceSet, situation: Situation, slot: int) -> ReferenceSet:
    """Those by which free hands may do a step.

    Raises:
        UserError: There are none.
    """
    kind, wanted = "grasp" if isinstance(step, MoveStep) else "articulate", getattr(step, "hand", None)
    of_kind = references.kind == kind
    busy = np.array([side in situation.holds for side in HANDS])
    free = ~(references.active & busy).any(axis=1)
    fits = np.ones(len(references), dtype=bool)
    if wanted is not None:
        fits = (references.active == [wanted in (side, "both") for side in HANDS]).all(axis=1)
    rows = np.flatnonzero(of_kind & free & fits & _over_table(references, situation.instant, slot))
    if not len(rows):
        sides = " or ".join(np.array(HANDS)[~busy]) or "no"
        raise UserError(
            f"{references.object}: expected a {kind} reference of the {wanted or sides} hand, which is free, found none"
        )
    return references.select(indices=rows)


def _over_table(references: ReferenceSet, instant: Instant, slot: int) -> NDArray[np.bool_]:
    """References whose wrists are over the table, the object being as it is; the hinge is left out of account."""
    base = Rotation.from_quat(instant.pose[slot, 3:])
    wrists = references.wrist_pose_in_part[..., :3]
    heights = instant.pose[slot, 2] + base.apply(wrists.reshape(-1, 3))[:, 2].reshape(wrists.shape[:2])
    return np.asarray(((heights > LEAST_WRIST_HEIGHT) | ~references.active).all(axis=1))
