"""Learn again from what a training from replay has tried, more cautiously, and without simulating anything.

    python tools/relearn.py RUN OUT --action-cost 0.06 --doubt 1

reads `RUN/latest.pt` and writes the policy OUT. Where references are few, an actor that stays nearer to the prior and
trusts the critics less does better on others, see `docs/policies.md`.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import torch

from artigrasp.controllers.policy_file import load_policy, save_policy
from artigrasp.training.replay import Replay
from artigrasp.training.runner import CHECKPOINT


def main() -> None:
    """Learn and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--action-cost", type=float, default=0.06)
    parser.add_argument("--doubt", type=float, default=1.0)
    parser.add_argument("--actor-rate", type=float, default=1e-3)
    parser.add_argument("--rounds", type=int, default=3, help="each as many batches as an iteration of the training")
    options = parser.parse_args()
    torch.set_num_threads(1)
    checkpoint = load_policy(options.run / CHECKPOINT)
    task = checkpoint.task
    assert task.replay is not None and checkpoint.learner is not None
    cautious = replace(task.replay, action_cost=options.action_cost, doubt=options.doubt)
    task = replace(task, replay=replace(cautious, actor_rate=options.actor_rate))
    actors = {}
    for name, actor in checkpoint.actors.items():
        state = checkpoint.learner["learners"][name]
        torch.manual_seed(checkpoint.seed)
        seen, decided = (state["memory"][key].shape[1] for key in ("observation", "action"))
        learner = Replay(task.replay, task.ppo, 1.0, seen, decided)
        learner.actor.load_state_dict(actor)
        learner.load_state_dict(state)
        learner.train_mode()
        for _ in range(options.rounds):
            learner.update()
        actors[name] = learner.actor.state_dict()
    save_policy(replace(checkpoint, task=task, actors=actors, learner=None), options.out)


if __name__ == "__main__":
    main()
