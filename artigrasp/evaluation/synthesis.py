"""Synthesis of references with the physics as the judge: what is kept works."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artigrasp.assets.hand import HandModel
from artigrasp.config import SimulatorConfig, SynthesisConfig
from artigrasp.evaluation.reference_check import FAILED, PD_IK, SEARCH, ReferenceCheck, check_references
from artigrasp.references.natural_pose import NaturalPose
from artigrasp.references.reference import ReferenceSet
from artigrasp.references.synthesis.grip import Grip, RestingObject
from artigrasp.references.synthesis.mirror import MirrorPlane, mirror_references
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
    untested: bool = False,
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
        untested: Whether to keep sound grips that differ as they are, without asking the physics.
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
    if untested:
        rows = candidates.chosen[:count]
        check, works = ReferenceCheck(np.full(len(rows), FAILED), np.zeros(len(rows))), np.arange(len(rows))
    else:
        rows, check = _try(candidates, count, config, simulator, on_stage)
        works = np.flatnonzero(check.works)[:count]
    kept = rows[works]
    verdict = check.verdict[works]
    found = SynthesisCount(
        fitted=len(candidates.references),
        sound=int(candidates.judgement.sound.sum()),
        tried=0 if untested else len(rows),
        pd_ik=int((verdict == PD_IK).sum()),
        search=int((verdict == SEARCH).sum()),
        seconds=time.perf_counter() - began,
    )
    if not len(kept):
        return SynthesizedReferences(None, found, ())
    judgement, references = candidates.judgement, candidates.references.select(indices=kept)
    references = replace(
        references, source=np.array([f"synthesised {grip.name} seed {config.seed} candidate {row}" for row in kept])
    )
    records = [
        {
            "energy": round(float(judgement.energy[row]), 3),
            "deepest": round(float(judgement.deepest[row]), 5),
            "merit": round(float(judgement.merit[row]), 3),
        }
        for row in kept
    ]
    return _kept(references, records, check, works, found)


def mirror_synthesized(
    other: ReferenceSet,
    records: Sequence[Mapping[str, Any]],
    plane: MirrorPlane,
    config: SynthesisConfig,
    *,
    simulator: SimulatorConfig = SimulatorConfig(),
    on_stage: OnStage = lambda stage, share: None,
) -> SynthesizedReferences:
    """What the other hand did, in the mirror, tried again.

    Args:
        other: References of the other hand.
        records: Of every one of them.
        plane: In which the object is its own mirror image.
        config: How they are tried.
        simulator: Backend, device and threads of the physics.
        on_stage: For progress.
    """
    began = time.perf_counter()
    references = mirror_references(other, plane)
    check = _ask(references, config, 0, simulator, lambda share: on_stage("trying", share))
    failed = np.flatnonzero(~check.works)
    if config.rollouts and len(failed):
        again = references.select(indices=failed)
        found = _ask(again, config, config.rollouts, simulator, lambda share: on_stage("searching", share))
        check = check.update(failed, found)
    works = np.flatnonzero(check.works)
    verdict = check.verdict[works]
    count = SynthesisCount(
        fitted=len(other),
        sound=len(other),
        tried=len(other),
        pd_ik=int((verdict == PD_IK).sum()),
        search=int((verdict == SEARCH).sum()),
        seconds=time.perf_counter() - began,
    )
    if not len(works):
        return SynthesizedReferences(None, count, ())
    references = replace(references, source=np.array([f"{source}, mirrored" for source in references.source]))
    same = [{name: records[row][name] for name in ("energy", "deepest", "merit")} for row in works.tolist()]
    return _kept(references.select(indices=works), same, check, works, count)


def _kept(
    references: ReferenceSet,
    records: Sequence[Mapping[str, Any]],
    check: ReferenceCheck,
    works: NDArray[np.int64],
    count: SynthesisCount,
) -> SynthesizedReferences:
    """References that work, in splits and with their records."""
    split = np.where(np.arange(len(references)) % TEST_EVERY == TEST_EVERY - 1, "test", "train")
    whole = [
        {
            **record,
            "source": str(references.source[row]),
            "contacts": int(references.contacts[row].sum()),
            "verdict": str(check.verdict[index]),
            "success": round(float(check.success[index]), 3),
        }
        for row, (record, index) in enumerate(zip(records, works.tolist(), strict=True))
    ]
    return SynthesizedReferences(replace(references, split=split), count, tuple(whole))


def _ask(
    references: ReferenceSet,
    config: SynthesisConfig,
    rollouts: int,
    simulator: SimulatorConfig,
    on_share: Callable[[float], None],
) -> ReferenceCheck:
    return check_references(
        references,
        trials=config.trials,
        rollouts=rollouts,
        seed=config.seed,
        simulator=simulator,
        on_step=lambda done, total: on_share(done / total),
    )


def _try(
    candidates: Candidates, count: int, config: SynthesisConfig, simulator: SimulatorConfig, on_stage: OnStage
) -> tuple[NDArray[np.int64], ReferenceCheck]:
    """Try chosen grips, so many at a time as are wanted, until enough work; search only if PD+IK is not enough."""
    rows: NDArray[np.int64] = np.zeros(0, np.int64)
    check = ReferenceCheck(np.zeros(0, "<U8"), np.zeros(0))

    def ask(these: NDArray[np.int64], stage: str, rollouts: int) -> ReferenceCheck:
        chosen = candidates.references.select(indices=these)
        return _ask(chosen, config, rollouts, simulator, lambda share: on_stage(stage, share))

    for start in range(0, len(candidates.chosen), count):
        batch = candidates.chosen[start : start + count]
        rows, check = np.concatenate([rows, batch]), check.join(ask(batch, "trying", 0))
        if check.works.sum() >= count:
            return rows, check
    failed = np.flatnonzero(~check.works)[:count]
    if config.rollouts and len(failed):
        check = check.update(failed, ask(rows[failed], "searching", config.rollouts))
    return rows, check
