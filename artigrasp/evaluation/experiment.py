"""What an experiment is: trials, what happened in them, what counts as success, and what is reported."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from artigrasp.config import PhaseConfig, SimulatorConfig
from artigrasp.config.task import Kind
from artigrasp.controllers.controller import Controller
from artigrasp.controllers.search import Objective
from artigrasp.evaluation.outcomes import Outcomes
from artigrasp.evaluation.statistics import Estimate, estimate_mean, estimate_rate
from artigrasp.references.reference import ReferenceSet

CRITERIA = ("paper", "released", "strict")
"""Three readings of success: the paper's text, the authors' scripts, and what a viewer would call success."""


@dataclass(frozen=True)
class Trials:
    """What a controller is measured on, one row per trial; trials of one object stand side by side."""

    object: NDArray[np.str_]
    """Name of the object, shape [trial]."""
    reference: NDArray[np.int64]
    """Index among the object's references that the experiment is given, shape [trial]."""
    targets: Mapping[str, NDArray[Any]]
    """What is to be reached, by name, each of shape [trial, ...]."""

    def __len__(self) -> int:
        return len(self.object)

    def __getitem__(self, rows: slice | NDArray[np.int64]) -> "Trials":
        """Some of the trials."""
        targets = {name: values[rows] for name, values in self.targets.items()}
        return Trials(self.object[rows], self.reference[rows], targets)

    def spread(self, per_object: int) -> "Trials":
        """So many trials of each object, or all where there are fewer, at even distances."""
        chosen = []
        for name in dict.fromkeys(self.object.tolist()):
            rows = np.flatnonzero(self.object == name)
            count = min(per_object, len(rows))
            chosen.append(rows[np.arange(count) * len(rows) // count])
        return self[np.concatenate(chosen)]


O = TypeVar("O", bound=Outcomes)  # noqa: E741
Success = Callable[[Any], NDArray[np.bool_]]
"""Which of the trials count as success."""


@dataclass(frozen=True)
class Metric:
    """A number of every trial whose mean is reported."""

    key: str
    """Name in `metrics.json`."""
    label: str
    """Name and unit in tables."""
    column: str
    """Field or property of the outcomes."""


QUALITY_METRICS = (
    Metric("add_auc_base", "ADD-AUC base", "base_auc"),
    Metric("add_auc_articulated", "ADD-AUC articulated", "articulated_auc"),
    Metric("penetration", "penetration m", "penetration"),
    Metric("jerk", "jerk m/s³", "jerk"),
    Metric("contact_consistency", "contact consistency", "contact_consistency"),
)
"""What is reported in every experiment besides its own metrics."""


class RunTrials(Protocol):
    """Plays trials and says what happened."""

    def __call__(
        self,
        controller: Controller,
        references: Sequence[ReferenceSet],
        trials: Trials,
        *,
        seed: int,
        simulator: SimulatorConfig,
        on_step: Callable[[int, int], None],
    ) -> Any:
        """Play every trial once.

        Args:
            controller: What acts.
            references: One set per object that occurs in the trials, of the experiment's kind and split.
            trials: What to play.
            seed: Seed of the environment.
            simulator: Backend, device and threads.
            on_step: Called with the control steps done, planning included, and how many there are.

        Returns:
            The experiment's outcomes, in the order of the trials.
        """
        ...


@dataclass(frozen=True)
class Experiment(Generic[O]):
    """One way to measure a controller, as data."""

    name: str
    kinds: tuple[Kind, ...]
    """Kinds of references that its trials are made of."""
    draw_trials: Callable[[Sequence[ReferenceSet], int], Trials]
    """The trials of one reference set per object, and of a seed where targets are drawn at random."""
    run_trials: RunTrials
    outcomes: type[O]
    """What :attr:`run_trials` returns."""
    success: Metric
    """The rate of success; its column is without meaning."""
    criteria: Mapping[str, Success]
    """What counts as success in each of ``CRITERIA``."""
    metrics: tuple[Metric, ...]
    """What else is reported, besides ``QUALITY_METRICS``."""
    target: Metric
    """The target that success is plotted against."""
    paper_rows: Mapping[str, Mapping[str, Mapping[str, float]]]
    """The paper's numbers by split, row and key."""
    paper_note: str
    """What the paper's rows are."""
    sequence: tuple[PhaseConfig, ...] = ()
    """Phases that are played; without them there is one, the controller's task."""
    retry_count: int = 0
    """How often an episode may go back after a failed phase; the paper's never does."""
    objectives: tuple[Objective, ...] = ()
    """What a search seeks by each decision of an episode; without them there is no search."""

    @property
    def all_metrics(self) -> tuple[Metric, ...]:
        """Everything that is reported but the rate of success."""
        return (*self.metrics, *QUALITY_METRICS)

    def measure(self, outcomes: O) -> dict[str, dict[str, Estimate]]:
        """Every metric in every reading, over all trials, failed ones included; intervals count references."""
        groups = outcomes.groups
        means = {each.key: estimate_mean(getattr(outcomes, each.column), groups) for each in self.all_metrics}
        return {
            name: {self.success.key: estimate_rate(success(outcomes), groups), **means}
            for name, success in self.criteria.items()
        }
