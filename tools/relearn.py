"""Learn again from what trainings from replay have tried, more cautiously, and without simulating anything.

    python tools/relearn.py RUN [RUN ...] OUT --action-cost 0.06 --doubt 1
    python tools/relearn.py RUN OUT --objects NAME [NAME ...] --rounds 30

reads `RUN/latest.pt` and writes the policy OUT. It goes on from the networks of the first run, whose features are
normalised as there, with what all of the runs have tried. Where references are few, an actor that stays nearer to the
prior and trusts the critics less does better on others, see `docs/policies.md`.

With --go-on the first run gets the networks and all that was tried, too: `artigrasp train TASK --resume RUN` explores
on with them, at once if decisions were still drawn at random.

With --objects new networks learn, from what was tried on these objects alone: what a training without the others, or
with fewer variants, would have come to. How decisions were explored has seen them all.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from artigrasp.controllers.policy_file import PolicyFile, load_policy, save_policy
from artigrasp.training.replay import COLUMNS, Replay
from artigrasp.training.runner import CHECKPOINT

Memory = dict[str, torch.Tensor]


def remembered(checkpoint: PolicyFile, network: str, objects: Sequence[str] | None) -> Memory:
    """What a training has tried on some objects, by default on all of them."""
    assert checkpoint.learner is not None
    memory: Memory = checkpoint.learner["learners"][network]["memory"]
    if objects is None:
        return memory
    # worlds are shared evenly between the objects, side by side, and each keeps its object
    worlds, count = checkpoint.task.world_count, len(checkpoint.objects)
    if len(memory["reward"]) % worlds:
        raise SystemExit(f"expected decisions of {worlds} worlds each, found {len(memory['reward'])}: some failed")
    of_world = np.array(checkpoint.objects)[np.arange(worlds) * count // worlds]
    rows = np.flatnonzero(np.isin(np.tile(of_world, len(memory["reward"]) // worlds), list(objects)))
    return {key: memory[key][rows] for key in COLUMNS}


def main() -> None:
    """Learn and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", type=Path, nargs="+", metavar="RUN")
    parser.add_argument("out", type=Path)
    parser.add_argument("--action-cost", type=float, default=0.06)
    parser.add_argument("--doubt", type=float, default=1.0)
    parser.add_argument("--actor-rate", type=float, default=1e-3)
    parser.add_argument("--rounds", type=int, default=3, help="each as many batches as an iteration of the training")
    parser.add_argument("--objects", nargs="+", help="learn anew from what was tried on these alone")
    parser.add_argument("--go-on", action="store_true", help="let the first run go on from here when it is resumed")
    options = parser.parse_args()
    torch.set_num_threads(1)
    checkpoints = [load_policy(run / CHECKPOINT) for run in options.runs]
    first = checkpoints[0]
    assert first.task.replay is not None and first.learner is not None
    changes = {name: getattr(options, name) for name in ("action_cost", "doubt", "actor_rate")}
    config = replace(first.task.replay, **changes)
    task = replace(first.task, replay=config)
    actors, states = {}, {}
    for name, actor in first.actors.items():
        tried = [remembered(each, name, options.objects) for each in checkpoints]
        memory = {key: torch.cat([each[key] for each in tried]) for key in COLUMNS}
        seen, decided = (memory[key].shape[1] for key in ("observation", "action"))
        torch.manual_seed(first.seed)
        learner = Replay(config, task.ppo, 1.0, seen, decided)
        if options.objects is None:
            learner.actor.load_state_dict(actor)
            learner.load_state_dict({**first.learner["learners"][name], "memory": memory})
        else:
            learner.remember(memory)
        learner.train_mode()
        for _ in range(options.rounds):
            learner.update()
        actors[name], states[name] = learner.actor.state_dict(), learner.state_dict()
    objects = options.objects or list(dict.fromkeys(each for one in checkpoints for each in one.objects))
    save_policy(replace(first, task=task, objects=tuple(objects), actors=actors, learner=None), options.out)
    if options.go_on:
        save_policy(
            replace(first, actors=actors, learner={**first.learner, "learners": states}), options.runs[0] / CHECKPOINT
        )


if __name__ == "__main__":
    main()
