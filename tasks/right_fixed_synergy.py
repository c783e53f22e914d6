"""Our own way to learn the first phase: one slow, low-dimensional decision on top of a prior that follows the hinge.

White noise on 51 joints every 10 ms explores badly: the hand trembles instead of trying something else. Here the wrist
follows the hinge toward the goal, the fingers close to the reference, and the policy decides twelve offsets once per
episode: where the wrist sits on the part, how much the fingers and the thumb close, and how far ahead of the part the
wrist runs. What is rewarded is the outcome.
"""

from artigrasp.config import ActionConfig, PPOConfig, ResetConfig, RewardConfig, SynergyConfig, TaskConfig

TASK = TaskConfig(
    name="right-fixed-synergy",
    description="Right hand, fixed base, one decision per episode over 12 slow offsets of a hinge-following prior",
    world_count=256,
    iterations=60,
    action=ActionConfig(
        wrist_prior="hinge",
        finger_prior="reference",
        synergy=SynergyConfig(),
        residual=None,
        hinge_lead=0.35,
        approach_steps=60,
        close_start=30,
        close_end=70,
    ),
    reset=ResetConfig(
        position_noise=0.005, angle_noise=0.02, reference_position_noise=0.01, reference_rotation_noise=0.1
    ),
    reward=RewardConfig(
        keypoint=0.0,
        fingertip=0.0,
        pose=0.0,
        contact=0.0,
        force=0.0,
        hand_velocity=0.0,
        object_velocity=0.0,
        angle=0.0,
        displacement=0.0,
        outcome_error=1.0,
        outcome_mean_error=0.3,
        outcome_success=0.5,
    ),
    ppo=PPOConfig(
        steps_per_env=1,
        epochs=10,
        mini_batches=4,
        learning_rate=1e-3,
        schedule="fixed",
        gamma=1.0,
        hidden_sizes=(128, 128),
        init_std=0.7,
        normalize_observations=True,
        save_interval=5,
    ),
)

TASKS = (TASK,)
