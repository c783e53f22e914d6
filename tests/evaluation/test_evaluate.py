"""Chunks: however an evaluation is cut, stopped or shared, it measures the same."""

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from artigrasp.config import PhaseConfig, SimulatorConfig
from artigrasp.controllers.controller import Controller, ZeroController, pd_ik_controller
from artigrasp.controllers.cross_entropy import CrossEntropySettings
from artigrasp.controllers.search import SearchController
from artigrasp.evaluation.articulation import ARTICULATION
from artigrasp.evaluation.chunks import Shard
from artigrasp.evaluation.evaluate import Evaluation, evaluate
from artigrasp.tasks import get_task
from tests.example_references import box_references

SHORT = replace(get_task("right-fixed"), episode_steps=130)
SHORTEST = replace(SHORT, episode_steps=2)


def measured(controller: Controller, world_count: int = 512, **options: Any) -> Evaluation[Any]:
    """Three references, five goals each."""
    evaluation = evaluate(
        controller,
        [box_references()],
        ARTICULATION,
        split="train",
        world_count=world_count,
        simulator=SimulatorConfig(threads=2),
        **options,
    )
    assert evaluation is not None
    return evaluation


def check_same(first: Evaluation[Any], second: Evaluation[Any]) -> None:
    """All columns of all trials are equal to the bit."""
    for name, column in first.outcomes.columns().items():
        np.testing.assert_array_equal(second.outcomes.columns()[name], column, err_msg=name)


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The number of trials of every chunk that is simulated."""
    sizes: list[int] = []
    run_trials: Callable[..., Any] = ARTICULATION.run_trials

    def run(controller: Controller, references: Any, trials: Any, **options: Any) -> Any:
        sizes.append(len(trials))
        return run_trials(controller, references, trials, **options)

    monkeypatch.setitem(vars(ARTICULATION), "run_trials", run)
    return sizes


def test_chunks_change_nothing(counted: list[int]) -> None:
    """Four chunks of at most four trials measure what one of fifteen does."""
    controller = pd_ik_controller(SHORT)
    whole = measured(controller)
    assert whole.outcomes.final_angle.max() > 0.05, "there must be something to be different"
    check_same(whole, measured(controller, world_count=4))
    assert counted == [15, 4, 4, 4, 3]


def test_what_is_done_is_not_done_again(counted: list[int], tmp_path: Path) -> None:
    """After a stop only the missing chunks are simulated, and the whole is the same."""

    def stop(done: float, total: int) -> None:
        if done > 8:
            raise KeyboardInterrupt

    controller = pd_ik_controller(SHORT)
    with pytest.raises(KeyboardInterrupt):
        measured(controller, 4, chunk_folder=tmp_path, on_trial=stop)
    assert len(list(tmp_path.iterdir())) == 2 and counted == [4, 4, 4]
    check_same(measured(controller), measured(controller, 4, chunk_folder=tmp_path))
    assert counted == [4, 4, 4, 15, 4, 3]


def test_chunks_of_other_evaluations_are_left_alone(
    counted: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another task, physics, controller, seed, policy or sequence begins anew, and other weights in a file as well."""
    policy = tmp_path / "policy.pt"
    policy.write_bytes(b"weights")
    folder = tmp_path / "chunks"
    settings = CrossEntropySettings(rollouts=1, population=1)
    variants: list[tuple[Controller, dict[str, Any]]] = [
        (ZeroController(SHORTEST), {}),
        (ZeroController(replace(SHORTEST, episode_steps=3)), {}),
        (ZeroController(replace(SHORTEST, physics=replace(SHORTEST.physics, impratio=10.0))), {}),
        (pd_ik_controller(SHORTEST), {}),
        (ZeroController(SHORTEST), {"seed": 1}),
        (ZeroController(SHORTEST), {"policies": [str(policy)]}),
        (SearchController(ZeroController(SHORTEST), settings), {}),
        (SearchController(ZeroController(SHORTEST), settings, seed=1), {}),
    ]
    for controller, options in [*variants, *variants]:
        measured(controller, chunk_folder=folder, **options)
    assert len(counted) == len(variants) == len(list(folder.iterdir()))
    policy.write_bytes(b"other weights")
    measured(ZeroController(SHORTEST), chunk_folder=folder, policies=[str(policy)])
    assert len(counted) == len(variants) + 1
    monkeypatch.setitem(vars(ARTICULATION), "sequence", (PhaseConfig("reach", 2),))
    measured(ZeroController(SHORTEST), chunk_folder=folder)
    assert len(counted) == len(variants) + 2


def test_processes_share_the_chunks(counted: list[int], tmp_path: Path) -> None:
    """Each simulates its own; the first waits for the others and ends with everything."""
    controller = ZeroController(SHORTEST)
    results: dict[int, Evaluation[Any] | None] = {}

    def work(rank: int) -> None:
        results[rank] = evaluate(
            controller,
            [box_references()],
            ARTICULATION,
            split="train",
            world_count=4,
            chunk_folder=tmp_path,
            shard=Shard(rank, 2),
        )

    helper = threading.Thread(target=work, args=(1,))
    helper.start()
    work(0)
    helper.join(60)
    assert sorted(counted) == [3, 4, 4, 4]
    assert results[1] is None and results[0] is not None
    check_same(results[0], measured(controller))


def test_torchrun_says_which_process_this_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without it there is one."""
    monkeypatch.delenv("RANK", raising=False)
    monkeypatch.delenv("WORLD_SIZE", raising=False)
    assert Shard.from_environment() == Shard(0, 1)
    monkeypatch.setenv("RANK", "2")
    monkeypatch.setenv("WORLD_SIZE", "3")
    assert Shard.from_environment() == Shard(2, 3)


def test_a_search_is_cut_by_its_worlds(counted: list[int], tmp_path: Path) -> None:
    """Twelve worlds are three trials of four candidates; what was found comes back from the chunks."""
    controller = SearchController(pd_ik_controller(SHORTEST), CrossEntropySettings(rollouts=6, population=4))
    first, second = (measured(controller, 12, chunk_folder=tmp_path) for _ in range(2))
    assert counted == [3] * 5 and (first.rollout_count, first.label) == (6, "search, 6 rollouts")
    assert first.found is not None and second.found is not None
    assert first.found.offsets.shape == (15, 1, 1, 14) and first.found.success.shape == (15, 6)
    for name, values in vars(first.found).items():
        np.testing.assert_array_equal(getattr(second.found, name), values)
