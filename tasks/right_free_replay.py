"""Our way to learn articulation: three slow decisions per episode, learned from replay on a free base.

The decisions are those of `right_fixed_synergy`. A decision shows within a second whether it was good, and what fails
mostly has not moved the hinge at all: so there are three per episode, and the second and third can try again. An
episode costs thousands of times what learning from it does, so all are kept and learned from again. From a few hundred
references the networks learn more of less: they see where hand, reference and hinge are, and nothing of the fingers.
"""

from dataclasses import replace

from artigrasp.config import ReplayConfig, SynergyConfig
from artigrasp.tasks import right_fixed_synergy

_BANDIT = right_fixed_synergy.TASK

TASK = replace(
    _BANDIT,
    name="right-free-replay",
    description="Right hand, free base, three decisions per episode over 12 slow offsets, learned from replay",
    fixed_base=False,
    iterations=150,
    action=replace(_BANDIT.action, synergy=SynergyConfig(decision_interval=100), lead_start=65, lead_end=100),
    reward=replace(_BANDIT.reward, outcome_displacement=3.0),
    replay=ReplayConfig(),
    ppo=replace(
        _BANDIT.ppo,
        steps_per_env=3,
        init_std=0.6,
        observed_features=(
            "part_pose_in_wrist",
            "hinge_in_wrist",
            "wrist_rotation_error",
            "wrist_error_in_part",
            "link_forces",
            "angle_error",
        ),
    ),
)

TASKS = (TASK,)
