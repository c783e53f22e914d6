"""A task to be viewed while it is simulated: only as far as somebody watches."""

import logging
import threading
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from artigrasp.config import SimulatorConfig
from artigrasp.controllers.controller import Controller
from artigrasp.controllers.rollout import run_episode
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import training_worlds
from artigrasp.errors import UserError
from artigrasp.motion.generate import MotionRecorder, phase_name
from artigrasp.motion.kinematics import pose_object
from artigrasp.motion.motion import Motion
from artigrasp.references.reference import load_references
from artigrasp.viewer.motion_subject import moved_target
from artigrasp.viewer.pilot import Pilot
from artigrasp.viewer.recording import Aim, Recording, Sample, Track
from artigrasp.viewer.subject import Picker

logger = logging.getLogger(__name__)

AHEAD = 0.3
"""How far the simulation runs ahead of who watches [s]."""
MEASURED = 25
"""Control steps between two looks at the metrics."""
RETRY = 2.0
"""How long to wait before looking again for a policy that was not there [s]."""


class LiveSubject:
    """Some worlds of a task; see :class:`artigrasp.viewer.subject.Subject`.

    A thread simulates episode after episode, each of them no farther than somebody asked for samples.
    """

    is_live = True

    def __init__(
        self,
        title: str,
        pilot: Pilot,
        objects: Sequence[str],
        *,
        reward_terms: Sequence[str] = (),
        split: str = "test",
        world_count: int = 4,
        seed: int = 0,
        simulator: SimulatorConfig = SimulatorConfig(),
    ) -> None:
        """Get ready; nothing is simulated yet.

        Args:
            title: What it is, in a few words.
            pilot: What acts.
            objects: Objects to choose from.
            reward_terms: Terms of the reward that are worth a plot.
            split: Split whose references are played.
            world_count: Worlds that are simulated at once.
            seed: Seed of everything that is drawn.
            simulator: Backend, device and threads.
        """
        self.reward_terms = tuple(reward_terms)
        self._title, self._pilot, self._split, self._seed = title, pilot, split, seed
        self._world_count, self._simulator, self._objects = world_count, simulator, tuple(objects)
        self._object, self._world = self._objects[0], 0
        self.generation = 0
        self.duration = 0.0
        self._message = "preparing"
        self._all_tracks: list[Track] = []
        self._recorders: list[MotionRecorder] = []
        self._environment: Environment | None = None
        self._controller: Controller | None = None
        self._changed = threading.Condition()
        self._simulating = threading.Lock()
        self._demanded = -1.0
        self._episode, self._shown, self._closed = 0, -1, False
        self._thread = threading.Thread(target=self._run, name="simulation", daemon=True)
        self._thread.start()

    @property
    def title(self) -> str:
        """The task and what acts."""
        return f"{self._title}: {self._pilot.label}"

    @property
    def status(self) -> str:
        """What it waits for, or what went wrong."""
        return self._message

    @property
    def pickers(self) -> Sequence[Picker]:
        """Object and environment."""
        worlds = tuple(str(world) for world in range(self._world_count))
        return [
            Picker("Object", self._objects, self._object),
            Picker("Environment", worlds, str(self._world)),
        ]

    @property
    def tracks(self) -> Sequence[Track]:
        """The chosen world."""
        return self._all_tracks[self._world : self._world + 1]

    def pick(self, label: str, option: str) -> None:
        """Watch another world of the same episode, or begin anew with another object."""
        if label == "Environment":
            self._world = int(option)
            self.generation += 1
        else:
            self._object = option
            self._give_up()

    def demand(self, time: float) -> float:
        """Simulate up to this time and a little farther."""
        with self._changed:
            self._demanded = time
            self._changed.notify_all()
        tracks = self.tracks
        return tracks[0].recording.duration if tracks else 0.0

    def begin_anew(self) -> None:
        """Give up this episode and begin another one, unless that is already under way."""
        if self._shown == self._episode:
            self._give_up()

    def motion(self) -> Motion:
        """The episode of the chosen world so far.

        Raises:
            UserError: Nothing is simulated yet.
        """
        with self._simulating:
            if self._controller is None or not self._recorders:
                raise UserError("nothing is simulated yet: play it first")
            return self._recorders[self._world].motion(self._controller, self._seed)

    def close(self) -> None:
        """End the simulation."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join(timeout=5.0)

    def _give_up(self) -> None:
        with self._changed:
            self._episode += 1
            self._demanded = 0.0
            self._changed.notify_all()

    def _run(self) -> None:
        episode = 0
        while self._wait(lambda: self._demanded >= 0):
            with self._changed:
                episode = self._episode
            try:
                self._play(episode)
            except _Interrupted:
                continue
            except UserError as error:
                self._message = str(error)
                with self._changed:
                    self._demanded = -1.0
                    self._changed.wait_for(lambda: self._closed, timeout=RETRY)
                continue
            except Exception as error:
                # one bad episode must not end the viewer
                logger.exception("the simulation failed")
                self._message = f"the simulation failed: {error}"
            # the episode is over: the next one begins when it is asked for
            self._wait(partial(self._is_given_up, episode))

    def _is_given_up(self, episode: int) -> bool:
        return self._episode != episode

    def _play(self, episode: int) -> None:
        with self._simulating:
            controller = self._controller = self._pilot.controller()
            environment = self._make_environment(controller)
        steps, dt = environment.episode_steps, environment.task.control_dt
        recorders = [MotionRecorder(environment, world) for world in range(environment.world_count)]
        tracks: list[Track] = []

        def on_step(step: int) -> None:
            if step == 0:
                tracks.extend(_new_track(environment, world) for world in range(environment.world_count))
            for recorder in recorders:
                recorder.record(step)
            for track, sample in zip(tracks, _samples(environment, step), strict=True):
                track.recording.append(sample)
            if step == 0:
                self._recorders, self._all_tracks, self.duration, self._message = recorders, tracks, steps * dt, ""
                self._shown = episode
                self.generation += 1
            if step and step % MEASURED == 0:
                _measure(environment, tracks)
            self._simulating.release()
            try:
                self._wait(lambda: self._demanded + AHEAD >= step * dt or self._episode != episode)
            finally:
                self._simulating.acquire()
            if self._closed or self._episode != episode:
                raise _Interrupted

        def on_plan(done: int, total: int) -> None:
            self._message = f"searching: {done} of {total} steps"
            if self._closed or self._episode != episode:
                raise _Interrupted

        with self._simulating:
            run_episode(environment, controller, on_step, on_plan)
            _measure(environment, tracks)

    def _make_environment(self, controller: Controller) -> Environment:
        made = self._environment
        if made is None or made.object_names != (self._object,) or made.task != controller.task:
            self._message = f"preparing {self._object}"
            task = controller.task
            references = [load_references(self._object).select(split=self._split, kind=task.kinds)]
            worlds = training_worlds(references, self._world_count)
            made = Environment(task, references, worlds, seed=self._seed, simulator=self._simulator)
            self._environment = made
        return made

    def _wait(self, condition: Callable[[], bool]) -> bool:
        """Wait until the condition holds; whether it does, and the subject is not closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or condition())
            return not self._closed


class _Interrupted(Exception):
    """Somebody asked for another episode, or for the end."""


def _new_track(environment: Environment, world: int) -> Track:
    """An empty track of a world at the beginning of its episode."""
    goal, model = environment.goal, environment.objects[environment.worlds.object_index[world]]
    start = goal.start_object_pose.numpy()[world]
    aim = Aim(
        angle=float(goal.target_angle.numpy()[world]),
        object_pose=moved_target(goal.target_object_pose.numpy()[world].copy(), start),
        part=goal.part.numpy()[world].astype(np.int64),
        link_poses_in_part=goal.link_pose_in_part.numpy()[world].copy(),
        contacts=goal.contacts.numpy()[world] > 0.5,
        active=goal.active.numpy()[world] > 0,
    )
    recording = Recording(environment.episode_steps + 1, environment.task.hands)
    return Track(f"environment {world}", environment.hands, [model], recording, aim, environment.task.stage, {})


def _measure(environment: Environment, tracks: Sequence[Track]) -> None:
    """Tell every track its metrics so far."""
    for name, values in environment.episode_summary().items():
        for track, value in zip(tracks, values, strict=True):
            track.metrics[name] = float(value)


def _samples(environment: Environment, step: int) -> list[Sample]:
    """The present state of every world."""
    state, task = environment.state, environment.task
    links = state.hands.link_pose.numpy()
    forces, poses, angles = (
        array.numpy() for array in (state.hands.contact_force, state.objects.pose, state.objects.hinge_q)
    )
    # at first they are still those of the episode before
    terms = {
        name: values.numpy()[..., index].sum(axis=1) if step else np.zeros(environment.world_count)
        for names, values in environment.reward_terms
        for index, name in enumerate(names)
    }
    samples = []
    for world in range(environment.world_count):
        model = environment.objects[environment.worlds.object_index[world]]
        samples.append(
            Sample(
                time=step * task.control_dt,
                link_poses=links[world],
                part_poses=pose_object(poses[world, None], angles[world, None], model),
                focus=0,
                hinge_angle=float(angles[world]),
                contact_force=forces[world],
                phase=phase_name(task.action, step),
                signals={name: float(values[world]) for name, values in terms.items()},
            )
        )
    return samples
