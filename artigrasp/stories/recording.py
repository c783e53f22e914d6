"""A tale as a motion: all takes, one after the other."""

import importlib.metadata

import numpy as np

from artigrasp.config.story import CloseStep, MoveStep, OpenStep, ReleaseStep, Step, describe_step
from artigrasp.motion.generate import relative_to_first_base
from artigrasp.motion.motion import Motion, MotionBystanders
from artigrasp.simulation.backend import PACKAGES
from artigrasp.stories.take import FIELDS, Take
from artigrasp.stories.teller import Tale, Teller


def story_motion(tale: Tale, teller: Teller) -> Motion:
    """The motion of all takes of a tale; the first object of the story is the motion's, the others stand by.

    Its target angle is the widest that the story asks of its first object.

    Metrics are those of each step, such as ``"2 position_error"``, and ``"steps_done"``.

    Args:
        tale: At least one step of it was tried.
        teller: Who told it.

    Raises:
        ValueError: There is nothing to show.
    """
    if not tale.takes:
        raise ValueError("tale: expected at least one take, found none")
    story, task = tale.story, teller.task
    # each take begins where the one before has ended
    ranges = [slice(0 if index == 0 else 1, None) for index in range(len(tale.takes))]
    pairs = list(zip(tale.takes, ranges, strict=True))
    samples = {name: np.concatenate([take.samples[name][rows] for take, rows in pairs]) for name in FIELDS}
    focus = np.concatenate([np.full(len(take.phases[rows]), take.slot) for take, rows in pairs])
    steps = story.steps[: len(tale.takes)]
    names = list(story.objects)
    phases = [f"{names[take.slot]}: {phase}" for take, rows in pairs for phase in take.phases[rows]]
    placed = list(story.objects.values())
    turns = [each.to for each in story.steps if isinstance(each, OpenStep | CloseStep) and each.object == names[0]]
    bystanders = None
    if len(placed) > 1:
        others = tuple(each.asset for each in placed[1:])
        bystanders = MotionBystanders(others, samples["slot_pose"][:, 1:], samples["slot_angle"][:, 1:], focus)
    hand_bases = samples["hand_base"]
    done = sum(take.success for take in tale.takes)
    metrics = {"steps": len(story.steps), "steps_done": done, "success": float(tale.is_whole)}
    for number, take in enumerate(tale.takes, start=1):
        metrics |= {f"{number} {name}": value for name, value in take.summary.items()}
    return Motion(
        time=np.arange(len(phases), dtype=np.float64) * task.control_dt,
        hands=task.hands,
        hand=teller.references[0].hand,
        object=placed[0].asset,
        hand_base=hand_bases[0],
        joint_q=relative_to_first_base(samples["joint_q"], hand_bases),
        object_pose=samples["slot_pose"][:, 0],
        hinge_angle=samples["slot_angle"][:, 0],
        contact_force=samples["contact_force"],
        phases=np.array(phases),
        target_angle=max(turns, default=placed[0].angle),
        bystanders=bystanders,
        metrics=metrics,
        provenance={
            "controller": teller.controller_name,
            "steps": "\n".join(describe_take(step, take) for step, take in zip(steps, tale.takes, strict=True)),
            "problem": tale.problem,
            "rollouts": str(tale.tried),
            "seed": str(teller.settings.seed),
            **{name: importlib.metadata.version(name) for name in ("artigrasp", *PACKAGES)},
        },
    )


def describe_take(step: Step, take: Take) -> str:
    """What became of a step, in a line."""
    outcome = "done" if take.success else "failed"
    if isinstance(step, MoveStep):
        outcome += f", {100 * take.summary['position_error']:.1f} cm from its target"
    elif not isinstance(step, ReleaseStep):
        outcome += f", at {take.summary['final_angle']:.2f} rad"
    return f"{describe_step(step)}: {outcome}, by {take.controller} from {take.reference}"
