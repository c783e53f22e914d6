"""Both hands and a free object: the scene of the paper's second phase and of its evaluation.

Half of the references are grasps, half articulations; an idle hand waits out of the way.
"""

from artigrasp.config import TaskConfig

TASK = TaskConfig(
    name="both-free",
    description="The paper's scene: both hands, free base, a 51-joint residual every control step",
    hands=("left", "right"),
    fixed_base=False,
    kinds=("articulate", "grasp"),
)
