"""Our way to learn articulation: one slow decision per episode, learned from replay on a free base.

The decision is that of `right_fixed_synergy`. An episode costs thousands of times what learning from it does, so all
are kept and learned from again. From a few hundred references the networks learn more of less: they see where hand and
hinge are at the start, and nothing of the fingers.
"""

from dataclasses import replace

from artigrasp.config import ReplayConfig, SynergyConfig
from artigrasp.tasks import right_fixed_synergy
from artigrasp.tasks.sequences import ARTICULATE

_BANDIT = right_fixed_synergy.TASK

TASK = replace(
    _BANDIT,
    name="right-free-replay",
    description="Right hand, free base, one decision per episode over 12 slow offsets, learned from replay",
    fixed_base=False,
    iterations=150,
    action=replace(ARTICULATE.action, synergy=SynergyConfig()),
    reward=replace(_BANDIT.reward, outcome_displacement=3.0),
    replay=ReplayConfig(),
    ppo=replace(
        _BANDIT.ppo,
        observed_features=("part_pose_in_wrist", "hinge_in_wrist", "angle_error"),
    ),
)

FIRM = replace(
    TASK,
    name="right-free-replay-firm",
    description="The same with a prior that presses what it holds, for references that only touch: synthesised ones",
    action=replace(TASK.action, squeeze=0.15, press=0.01),
    replay=ReplayConfig(doubt=1.0, action_cost=0.06),
)
"""Hands of recordings are a centimetre deep in the object, and press as they strive to get there. Hands that are fitted
touch it; with them the prior alone opens half as often unless it squeezes.

As that prior opens most things by itself, the actor stays nearer to it and trusts the critics less.
"""

RETRY = replace(
    TASK,
    name="right-free-retry",
    description="The same with a second decision at half time, which is added to the first and so can try again",
    action=replace(_BANDIT.action, synergy=SynergyConfig(decision_interval=150, adds_up=True)),
    replay=ReplayConfig(random_share=0.6),
    ppo=replace(
        TASK.ppo,
        steps_per_env=2,
        observed_features=(*TASK.ppo.observed_features, "wrist_rotation_error", "wrist_error_in_part", "link_forces"),
    ),
)
"""What fails has mostly not moved the hinge at all by half time, so that there is something to see and time to act."""

ABLATIONS = (
    replace(
        TASK,
        name="right-free-replay-follow",
        description="Ablation: the wrist follows the hinge and runs ahead of it, in place of turning it on a schedule",
        action=_BANDIT.action,
    ),
    replace(
        TASK,
        name="right-free-replay-all-features",
        description="Ablation: networks that see all features",
        ppo=replace(TASK.ppo, observed_features=()),
    ),
    replace(
        TASK,
        name="right-free-replay-without-hinge-features",
        description="Ablation: a policy that does not see the hinge (the paper's articulation features)",
        include_hinge_features=False,
    ),
    replace(
        TASK,
        name="right-free-replay-without-doubt",
        description="Ablation: an actor that trusts the critics' mean, however much they disagree",
        replay=ReplayConfig(doubt=0.0),
    ),
    replace(
        TASK,
        name="right-free-replay-without-jitter",
        description="Ablation: references as they are, not moved and turned at random",
        reset=replace(TASK.reset, reference_position_noise=0.0, reference_rotation_noise=0.0),
    ),
    replace(
        TASK,
        name="right-free-ppo",
        description="Ablation: PPO, which learns from each decision in one iteration only, in place of replay",
        replay=None,
    ),
)
"""The same but for one thing each."""

TASKS = (TASK, FIRM, RETRY, *ABLATIONS)
