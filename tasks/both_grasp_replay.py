"""Our way to learn grasping: one slow decision per hand and episode, learned from replay while the object is carried.

Whether a grasp is good shows when it is carried: so an episode is the whole sequence of grasping, to a target in the
air. What is decided when the hands set out holds until the end, and holds the object firmer or softer, too. One policy
acts for both hands; a left hand is shown to it as its mirror image.

Two hands hold nearly whatever they grasp. What fails are hands that grasp something heavy alone, always the same ones:
so references that fail are practised more, and what is tried lies farther from the prior than in articulation.
"""

from dataclasses import replace

from artigrasp.config import PPOConfig, ReplayConfig, RewardConfig, SynergyConfig, TaskConfig
from artigrasp.tasks import right_fixed_synergy
from artigrasp.tasks.sequences import GRASP, GRASPING

_STEPS = sum(phase.most_steps for phase in GRASPING)
_NOTHING = dict.fromkeys(
    ("keypoint", "fingertip", "pose", "contact", "force", "hand_velocity", "object_velocity", "angle", "displacement"),
    0.0,
)

TASK = TaskConfig(
    name="both-grasp-replay",
    description="Both hands, free base, one decision per hand over 14 slow offsets, learned from replay while carrying",
    hands=("left", "right"),
    fixed_base=False,
    policies="mirrored",
    kinds=("grasp",),
    episode_steps=_STEPS,
    sequence="grasping",
    practice=0.75,
    world_count=128,
    iterations=100,
    action=replace(GRASP.action, synergy=SynergyConfig(squeeze=0.15, press=0.015, decision_interval=_STEPS)),
    gains=GRASP.gains,
    reset=replace(right_fixed_synergy.TASK.reset, reference_position_noise=0.005, reference_rotation_noise=0.05),
    reward=RewardConfig(**_NOTHING, outcome_lift=1.0, outcome_position_error=1.0, outcome_rotation_error=0.5),
    replay=ReplayConfig(random_iterations=6),
    ppo=PPOConfig(
        steps_per_env=1,
        gamma=1.0,
        hidden_sizes=(128, 128),
        init_std=0.8,
        normalize_observations=True,
        observed_features=("part_pose_in_wrist", "hinge_in_wrist", "target_contacts"),
        save_interval=2,
    ),
)

TASKS = (TASK,)
