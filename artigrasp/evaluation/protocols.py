"""What `artigrasp evaluate` can be asked for, by name: experiments on the references of a split."""

from dataclasses import dataclass
from typing import Any

from artigrasp.errors import unknown
from artigrasp.evaluation.articulation import ARTICULATION
from artigrasp.evaluation.composed import COMPOSED
from artigrasp.evaluation.experiment import Experiment
from artigrasp.evaluation.grasping import GRASPING


@dataclass(frozen=True)
class Protocol:
    """Experiments and the splits that each is done on."""

    name: str
    summary: str
    """What is measured, in a line."""
    experiments: tuple[Experiment[Any], ...]
    splits: tuple[str, ...] = ("test",)
    unseen_objects: bool = False
    """Whether a policy may not have been trained on any of the objects."""


EXPERIMENTS: dict[str, Experiment[Any]] = {each.name: each for each in (ARTICULATION, GRASPING, COMPOSED)}
"""All experiments by name."""

PROTOCOLS = {
    each.name: each
    for each in (
        Protocol("articulation", "every reference toward .5, .75, 1, 1.25 and 1.5 rad", (ARTICULATION,)),
        Protocol("grasping", "every reference grasps its object and takes it to 30 targets in the air", (GRASPING,)),
        Protocol(
            "composed", "every grasp and articulation of an object: carry it to a target and open it", (COMPOSED,)
        ),
        Protocol(
            "images",
            "references from images, and those of the same frames from motion capture",
            (ARTICULATION, GRASPING),
            splits=("recon", "recon-mocap"),
        ),
        Protocol("left-out", "objects that a policy has not seen", (ARTICULATION,), unseen_objects=True),
    )
}
"""All protocols by name."""


def get_protocol(name: str) -> Protocol:
    """The protocol of that name.

    Raises:
        UserError: There is none; the message suggests the nearest.
    """
    if name not in PROTOCOLS:
        raise unknown("protocol", name, PROTOCOLS)
    return PROTOCOLS[name]
