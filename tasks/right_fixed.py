"""The paper's first phase, right hand: articulation with the object's base fixed.

Reward weights, network and PPO settings are those of the paper's table of parameters; where it is silent they are the
defaults of the config classes, which name their source. The authors' release also mixes in grasp references here.
"""

from artigrasp.config import TaskConfig

TASK = TaskConfig(
    name="right-fixed",
    description="The paper's task: right hand, fixed base, a 51-joint residual every control step",
)
