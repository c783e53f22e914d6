"""Synthesis of references with the physics as the judge: what is kept works."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artigrasp.assets.hand import HandModel
from artigrasp.config import SimulatorConfig, SynthesisConfig
from artigrasp.evaluation.reference_check import PD_IK, SEARCH, ReferenceCheck, check_references
from artigrasp.references.natural_pose import NaturalPose
from artigrasp.references.reference import ReferenceSet
from artigrasp.references.synthesis.grip import Grip, RestingObject
from artigrasp.references.synthesis.synthesize import Candidates, synthesize

TEST_EVERY = 3
"""Every so manieth reference of a grip is for testing."""
OnStage = Callable[[str, float], None]
"""Told what is being done and which share of it is done."""


@dataclass(frozen=True)
class SynthesisCount:
    """How many hands came how far, of one grip on one object."""

    fitted: int
    """Hands, or pairs of them, that were fitted."""
    sound: int
    """Of these, how many touch as they should, and harm nothing."""
    tried: int
    """Of these, how many differ and were tried in the physics."""
    pd_ik: int
    """Of these, how many work with PD+IK and were kept."""
    search: int
    """How many more work with what a search finds and were kept."""
    seconds: float
    """Wall time."""

    @property
    def kept(self) -> int:
        """References."""
        return self.pd_ik + self.search


@dataclass(frozen=True, eq=False)
class SynthesizedReferences:
    """The references of one grip on one object.

    Attributes:
        references: What is kept, none at all where nothing works.
        count: How many hands came how far.
        records: Of every reference its ``"source"``, ``"energy"``, ``"deepest"`` [m] and ``"merit"``, see
            :class:`artigrasp.references.synthesis.judgement.Judgement`, its number of ``"contacts"``, ``"verdict"`` and
            ``"success"``, see :class:`artigrasp.evaluation.reference_check.ReferenceCheck`.
    """

    references: ReferenceSet | None
    count: SynthesisCount
    records: tuple[dict[str, Any], ...]


def synthesize_references(
    grip: Grip,
    resting: RestingObject,
    hands: tuple[HandModel, HandModel],
    natural: NaturalPose,
    config: SynthesisConfig,
    *,
    count: int,
    simulator: SimulatorConfig = SimulatorConfig(),
    on_stage: OnStage = lambda stage, share: None,
) -> SynthesizedReferences:
    """Make references of one grip on one object; the same input gives the same result.

    Args:
        grip: What the hands are to do.
        resting: The object, which must be among the assets.
        hands: Left and right hand.
        natural: Which finger angles are natural.
        config: How many hands are fitted and tried, and what weighs what.
        count: References that are wanted.
        simulator: Backend, device and threads of the physics.
        on_stage: For progress.
    """
    began = time.perf_counter()
    candidates = synthesize(
        grip,
        resting,
        hands,
        natural,
        config,
        most=config.tries * count,
        device=simulator.device or "cpu",
        on_iteration=lambda done: on_stage("fitting", done / config.iterations),
    )
    if candidates is None:
        seconds = time.perf_counter() - began
        return SynthesizedReferences(None, SynthesisCount(0, 0, 0, 0, 0, seconds), ())
    rows, checks = _try(candidates, count, config, simulator, on_stage)
    works = np.flatnonzero(checks.works)[:count]
    kept, verdict = rows[works], checks.verdict[works]
    found = SynthesisCount(
        fitted=len(candidates.references),
        sound=int(candidates.judgement.sound.sum()),
        tried=len(rows),
        pd_ik=int((verdict == PD_IK).sum()),
        search=int((verdict == SEARCH).sum()),
        seconds=time.perf_counter() - began,
    )
    if not len(kept):
        return SynthesizedReferences(None, found, ())
    sources = [f"synthesised {grip.name} seed {config.seed} candidate {row}" for row in kept]
    references = replace(
        candidates.references.select(indices=kept),
        source=np.array(sources),
        split=np.where(np.arange(len(kept)) % TEST_EVERY == TEST_EVERY - 1, "test", "train"),
    )
    judgement = candidates.judgement
    records = tuple(
        {
            "source": source,
            "energy": round(float(judgement.energy[row]), 3),
            "deepest": round(float(judgement.deepest[row]), 5),
            "contacts": int(candidates.references.contacts[row].sum()),
            "merit": round(float(judgement.merit[row]), 3),
            "verdict": str(checks.verdict[index]),
            "success": round(float(checks.success[index]), 3),
        }
        for source, row, index in zip(sources, kept.tolist(), works.tolist(), strict=True)
    )
    return SynthesizedReferences(references, found, records)


def _try(
    candidates: Candidates, count: int, config: SynthesisConfig, simulator: SimulatorConfig, on_stage: OnStage
) -> tuple[NDArray[np.int64], ReferenceCheck]:
    """Try chosen grips, so many at a time as are wanted, until enough work; search only if PD+IK is not enough."""
    rows: NDArray[np.int64] = np.zeros(0, np.int64)
    check = ReferenceCheck(np.zeros(0, "<U8"), np.zeros(0))

    def ask(these: NDArray[np.int64], stage: str, rollouts: int) -> ReferenceCheck:
        return check_references(
            candidates.references.select(indices=these),
            trials=config.trials,
            rollouts=rollouts,
            seed=config.seed,
            simulator=simulator,
            on_step=lambda done, total: on_stage(stage, done / total),
        )

    for start in range(0, len(candidates.chosen), count):
        batch = candidates.chosen[start : start + count]
        rows, check = np.concatenate([rows, batch]), check.join(ask(batch, "trying", 0))
        if check.works.sum() >= count:
            return rows, check
    failed = np.flatnonzero(~check.works)[:count]
    if config.rollouts and len(failed):
        check = check.update(failed, ask(rows[failed], "searching", config.rollouts))
    return rows, check
