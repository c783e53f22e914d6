"""The part of the panel where new motions are made: what, by whom, to which angle and where to."""

import html
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from viser import GuiApi, GuiEvent, Icon, SceneApi

from artigrasp.assets.object import load_object
from artigrasp.motion.motion import Motion
from artigrasp.viewer.events import from_people
from artigrasp.viewer.job_bar import JobBar
from artigrasp.viewer.jobs import JobState
from artigrasp.viewer.target_gizmo import TargetGizmo
from artigrasp.viewer.wish import BASELINES, OPEN, WHATS, Wish, reference_counts

Post = Callable[[Callable[[], None]], None]


class Maker:
    """Widgets for a wish, and how far it is fulfilled; all its methods are for the viewer's thread."""

    def __init__(
        self,
        scene: SceneApi,
        post: Post,
        objects: Sequence[str],
        policies: Mapping[str, Path],
        generate: Callable[[Wish], None],
        cancel: Callable[[], None],
    ) -> None:
        """Get ready.

        Args:
            scene: Where the target can be seen and moved.
            post: Hands calls to the viewer's thread.
            objects: Objects to choose from.
            policies: Policies to choose from.
            generate: Called with what is wished for.
            cancel: Called when somebody gives up waiting.
        """
        self._post, self._objects, self._policies = post, tuple(objects), policies
        self._generate, self._cancel = generate, cancel
        self._gizmo = TargetGizmo(scene, lambda shift, yaw: post(lambda: self._move(shift, yaw)))
        self.wish = Wish(self._objects[0])

    def build(self, gui: GuiApi) -> None:
        """Add the widgets where the panel is being filled."""
        wish = self.wish
        self._what = gui.add_dropdown("What", WHATS, initial_value=wish.what)
        self._object = gui.add_dropdown("Object", self._objects, initial_value=wish.object)
        self._actor = gui.add_dropdown("By", (*BASELINES, *self._policies), initial_value=wish.actor)
        self._reference = gui.add_slider("Reference", 0, 1, 1, 0, hint="of the test split")
        self._grasp = gui.add_slider("Grasp", 0, 1, 1, 0, hint="reference to grasp by, of the test split")
        self._angle = gui.add_slider("Angle [rad]", 0.0, 1.5, 0.05, wish.angle)
        self._handle = gui.add_checkbox("Show the target to move it", False)
        self._where = gui.add_html("")
        self._seed = gui.add_number("Seed", wish.seed, min=0, step=1)
        self._button = gui.add_button("Generate anew", icon=Icon.WAND)
        self._bar = JobBar(gui, lambda: self._post(self._cancel))
        self._message = gui.add_html("")
        for widget in (self._what, self._object, self._actor, self._reference, self._grasp, self._angle, self._seed):
            widget.on_update(self._from_people(self._read))
        self._handle.on_update(self._from_people(self._show))
        self._button.on_click(self._from_people(lambda: self._generate(self.wish)))
        self._show()

    def propose(self, object: str, angle: float | None) -> None:
        """Begin with what is being watched."""
        if object in self._objects:
            self.wish = replace(self.wish, object=object, angle=self.wish.angle if angle is None else angle)
            self._show()

    def show_job(self, job: JobState) -> None:
        """Say how far the work is."""
        self._button.disabled = bool(job.name)
        self._bar.show(job)

    def say(self, content: str) -> None:
        """Say what came of it."""
        self._message.content = content

    def _from_people(self, act: Callable[[], None]) -> Callable[[GuiEvent], None]:
        return from_people(lambda event: self._post(act))

    def _read(self) -> None:
        """Take over what the widgets say."""
        self.wish = replace(
            self.wish,
            object=self._object.value,
            what=self._what.value,
            actor=self._actor.value,
            reference=int(self._reference.value),
            grasp=int(self._grasp.value),
            angle=float(self._angle.value),
            seed=int(self._seed.value),
        )
        self._show()

    def _move(self, shift: tuple[float, float], yaw: float) -> None:
        self.wish = replace(self.wish, shift=shift, yaw=yaw)
        self._show_where()

    def _show(self) -> None:
        """Let the widgets say what is wished for, of what there is."""
        articulate, grasp = reference_counts(self.wish.object)
        widest = round(load_object(self.wish.object).hinge_upper - 0.005, 2)
        self.wish = wish = replace(
            self.wish,
            reference=min(self.wish.reference, max(articulate - 1, 0)),
            grasp=min(self.wish.grasp, max(grasp - 1, 0)),
            angle=min(self.wish.angle, widest),
        )
        carries = wish.what != OPEN
        self._reference.max, self._grasp.max = max(articulate - 1, 1), max(grasp - 1, 1)
        self._angle.max = widest
        self._object.value, self._reference.value, self._grasp.value = wish.object, wish.reference, wish.grasp
        self._angle.value = wish.angle
        self._grasp.visible = self._handle.visible = self._where.visible = carries
        self._gizmo.show(wish if carries and self._handle.value else None)
        self._show_where()

    def _show_where(self) -> None:
        x, y = (100 * value for value in self.wish.shift)
        self._where.content = (
            f"<div style='padding:0 10px;font-size:12px;color:#7b8794'>target: {x:+.0f} cm, {y:+.0f} cm, "
            f"turned by {self.wish.yaw:+.2f} rad</div>"
        )


def error_html(message: str) -> str:
    """What went wrong."""
    style = "padding:4px 10px;font-size:12px;color:#c2410c;overflow-wrap:anywhere"
    return f"<div style='{style}'>{html.escape(message)}</div>"


def motion_html(motion: Motion) -> str:
    """What came of a wish."""
    words = f"opened to {motion.metrics['final_angle']:.2f} rad of {motion.target_angle:.2f} rad"
    phases = motion.provenance.get("phases", "").splitlines()
    lines = "<br>".join(html.escape(line) for line in (words, *phases))
    return f"<div style='padding:4px 10px;font-size:12px;color:#4b5563'>{lines}</div>"
