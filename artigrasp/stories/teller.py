"""The heuristic planner of stories: tries references in simulation, commits to one, and goes back if it led nowhere."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.config import SimulatorConfig, TaskConfig
from artigrasp.config.story import StoryConfig, describe_step
from artigrasp.controllers.controller import Controller, pd_ik_controller
from artigrasp.controllers.cross_entropy import CrossEntropySettings
from artigrasp.controllers.rollout import run_episode
from artigrasp.controllers.search import OffsetController, SearchController
from artigrasp.controllers.skills import in_free_scene, with_skills
from artigrasp.environment.action_columns import synergy_directions
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import planned_worlds
from artigrasp.errors import UserError
from artigrasp.kernels.layout import HANDS
from artigrasp.references.reference import ReferenceSet, load_references
from artigrasp.stories.plan import Situation, StepPlan, plan_step
from artigrasp.stories.start import check_angles, first_instant
from artigrasp.stories.take import Ended, Take, TakeRecorder
from artigrasp.tasks import get_task
from artigrasp.tasks.sequences import TRANSIT

SCENE = "both-free"
"""Task of the scene: both hands and free bases."""
WAY_COST = 0.2
"""What a take loses by each metre that its hands had to go to the object: of what does equally well the nearest is
taken, and hands cross less."""
PHASE_RETRIES = 1
"""How often a try may go back to grasp what it dropped."""


@dataclass(frozen=True)
class TellerSettings:
    """How hard a teller tries."""

    rollouts: int = 32
    """Rollouts of the search around each reference that comes nearest, where none does a step by itself."""
    searched: int = 2
    """References to search around."""
    branches: int = 4
    """Ways of doing a step from which the next ones are tried, the best first."""
    takes: int = 24
    """Ways of doing steps that are gone on from, in all."""
    seed: int = 0
    """Of the searches."""


@dataclass(frozen=True, eq=False)
class Tale:
    """How far a story was told."""

    story: StoryConfig
    takes: tuple[Take, ...]
    """One for every step that was done; after them the best try at the one that was not, if there is one."""
    is_whole: bool
    """Whether all steps were done."""
    problem: str = ""
    """Which step was not done, and why."""
    tried: int = 0
    """Episodes that were simulated."""


class Teller:
    """Tells a story: a depth-first search over ways of doing its steps, each from where the last one led.

    Every reference by which free hands may do a step is tried in a world of its own: by the policies that have learned
    to, and where none does it by PD+IK; then a search tries offsets of PD+IK around those that came nearest. What was
    tried is what is shown: nothing is played again.
    """

    def __init__(
        self,
        story: StoryConfig,
        settings: TellerSettings = TellerSettings(),
        simulator: SimulatorConfig = SimulatorConfig(),
        policies: Sequence[Controller] = (),
        on_progress: Callable[[str, int, int], None] = lambda what, done, total: None,
    ) -> None:
        """Load the references of all objects.

        Args:
            story: The story.
            settings: How hard to try.
            simulator: Backend, device and threads.
            policies: What acts first in steps whose skill it has learned, unless hands hold the object already.
            on_progress: Told what is tried, and how many control steps of it are done and to be done.

        Raises:
            UserError: An object or its references are missing, or it does not open so far.
        """
        check_angles(story)
        self.story, self.settings = story, settings
        self.references: list[ReferenceSet] = [load_references(each.asset) for each in story.objects.values()]
        self._controller = pd_ik_controller(get_task(SCENE))
        rollouts = CrossEntropySettings(rollouts=settings.rollouts)
        self._search = SearchController(self._controller, rollouts, seed=settings.seed)
        self._policies = [in_free_scene(each) for each in policies]
        self._simulator, self._on_progress = simulator, on_progress
        self._tried = self._gone_on = 0

    @property
    def task(self) -> TaskConfig:
        """The scene."""
        return self._controller.task

    @property
    def controller_name(self) -> str:
        """What acts."""
        return "+".join(dict.fromkeys(each.name for each in (*self._policies, self._controller)))

    def tell(self) -> Tale:
        """Do step after step; where none of the ways goes on, go back to the step before and take the next best."""
        self._tried = self._gone_on = 0
        return self._tell_from((), Situation(first_instant(self.story, self.references, self.task.hands)))

    def _tell_from(self, takes: tuple[Take, ...], situation: Situation) -> Tale:
        """The rest of the story after some takes, as far as it can be told."""
        if len(takes) == len(self.story.steps):
            return Tale(self.story, takes, True, tried=self._tried)
        step = self.story.steps[len(takes)]
        title = f"{len(takes) + 1}. {describe_step(step)}"
        try:
            plan = plan_step(step, self.story, situation, self.references)
        except UserError as error:
            return Tale(self.story, takes, False, f"{title}: {error}", self._tried)
        tries = self._try_step(plan, situation, title)
        done = [take for take in tries if take.success][: self.settings.branches]
        if not done:
            return Tale(self.story, (*takes, tries[0]), False, f"{title}: {explain(tries[0], plan)}", self._tried)
        tales = []
        for take in done:
            if self._gone_on < self.settings.takes:
                self._gone_on += 1
                tales.append(self._tell_from((*takes, take), take.after))
                if tales[-1].is_whole:
                    return tales[-1]
        unfinished = Tale(self.story, (*takes, done[0]), False, f"{title}: too many ways were tried", self._tried)
        return replace(max(tales, key=lambda tale: len(tale.takes), default=unfinished), tried=self._tried)

    def _try_step(self, plan: StepPlan, situation: Situation, title: str) -> list[Take]:
        """Ways of doing a step, the best first."""
        takes: list[Take] = []
        for policy in self._policies:
            has_learned = plan.offsets is None and plan.references.kind[0] in policy.task.kinds
            if has_learned and not any(take.success for take in takes):
                takes += self._play(plan, situation, policy, title)
        if not any(take.success for take in takes):
            takes += self._play(plan, situation, self._controller, title)
        if not any(take.success for take in takes) and plan.offsets is None and self.settings.rollouts > 1:
            by_pd_ik = takes[-len(plan.references) :]
            nearest = np.argsort([-take.score for take in by_pd_ik])[: self.settings.searched]
            chosen = replace(plan, references=plan.references.select(indices=np.sort(nearest)))
            takes += self._play_best(chosen, situation, title)
        return sorted(takes, key=lambda take: (take.success, take.score), reverse=True)

    def _environment(self, plan: StepPlan, situation: Situation, controller: Controller) -> Environment:
        """Worlds that begin where the story has come to, one for each reference, with the plan's object first."""
        order, count = self._order(plan), len(plan.references)
        task = controller.task
        environment = Environment(
            task,
            [plan.references],
            planned_worlds([plan.references], [0] * count, range(count), plan.goal_angle),
            bystanders=[self.references[slot] for slot in order[1:]],
            sequence=with_skills(plan.phases, controller),
            retry_count=PHASE_RETRIES,
            seed=self.settings.seed,
            noise=False,
            simulator=self._simulator,
        )
        active = plan.references.active[:, [HANDS.index(side) for side in task.hands]]
        environment.begin_at(situation.instant.in_order(order), ~active, plan.target_object_pose)
        return environment

    def _order(self, plan: StepPlan) -> list[int]:
        """The story's objects as they are in the scene of a step: the one that it is about, then the others."""
        return sorted(range(len(self.references)), key=lambda slot: slot != plan.slot)

    def _play(self, plan: StepPlan, situation: Situation, controller: Controller, title: str) -> list[Take]:
        """Every reference by a policy, or by PD+IK with what was decided when the object was taken hold of."""
        is_policy = controller is not self._controller
        environment = self._environment(plan, situation, controller if is_policy else self._search)
        offsets = plan.offsets
        if offsets is None:
            directions = len(synergy_directions(self._search.task.action.synergy))
            offsets = np.zeros((1, environment.hand_count, directions), np.float32)
        every = np.repeat(offsets[None], environment.world_count, axis=0)
        acting = controller if is_policy else OffsetController(controller, every, environment)
        return self._record(environment, acting, every, plan, situation, title)

    def _play_best(self, plan: StepPlan, situation: Situation, title: str) -> list[Take]:
        """Every reference with the best offsets that a search finds around it."""
        environment = self._environment(plan, situation, self._search)
        search = self._search.seeking([plan.objective])
        search.plan(environment, lambda done, total: self._on_progress(f"{title}: searching", done, total))
        if search.found is None:
            raise RuntimeError("a search must find something")
        self._tried += int(search.found.rollouts.sum())
        offsets = search.found.offsets
        acting = OffsetController(self._controller, offsets, environment)
        acting.name = search.name
        return self._record(environment, acting, offsets, plan, situation, title)

    def _record(
        self,
        environment: Environment,
        controller: Controller,
        offsets: NDArray[np.float32],
        plan: StepPlan,
        situation: Situation,
        title: str,
    ) -> list[Take]:
        """Play and record every world; PD+IK goes on with these offsets later, [world, decision, hand, direction]."""
        recorder = TakeRecorder(environment, self._order(plan))

        def record(step: int) -> None:
            recorder.record(step)
            self._on_progress(title, step, environment.episode_steps)

        run_episode(environment, controller, record)
        self._tried += environment.world_count
        takes = []
        for world, ended in enumerate(recorder.end()):
            reference = plan.references.select(indices=world)
            summary = {name: np.array([value]) for name, value in ended.summary.items()}
            take = Take(
                samples=ended.samples,
                phases=ended.phases,
                slot=plan.slot,
                reference=str(reference.source[0]),
                controller=controller.name,
                outcomes=ended.outcomes,
                summary=ended.summary,
                success=bool(plan.objective.success(summary)[0]),
                score=float(plan.objective.score(summary)[0]) - WAY_COST * way_to_object(ended, reference),
                after=situation.after(ended.instant, plan, reference, offsets[world]),
            )
            takes.append(take)
        return takes


def way_to_object(ended: Ended, reference: ReferenceSet) -> float:
    """How far the wrists that take part are from where they began when they have come to the object, in all [m]."""
    steps = ended.phases.count(TRANSIT.name)
    if steps == 0:
        return 0.0
    positions = []
    for step in (0, steps - 1):
        base, shift = ended.samples["hand_base"][step], ended.samples["joint_q"][step, :, :3]
        positions.append(base[:, :3] + Rotation.from_quat(base[:, 3:]).apply(shift))
    return float(np.linalg.norm(positions[1] - positions[0], axis=1)[reference.active[0]].sum())


def explain(take: Take, plan: StepPlan) -> str:
    """Why a try did not do its step."""
    missed = [
        f"{name.replace('_', ' ')} {take.summary[name]:.2f} instead of at most {high:g}"
        for name, (low, high) in plan.objective.within.items()
        if not low < take.summary[name] < high
    ]
    reasons = [each for each in (take.failure, *missed) if each]
    return f"none of {len(plan.references)} references did it; the nearest: {'; '.join(reasons) or 'failed physics'}"
