"""The kernels of a control step, recorded for every range of worlds that the physics steps on a thread of its own."""

from collections.abc import Sequence
from dataclasses import dataclass

import warp as wp

from artigrasp.environment.acting import Acting
from artigrasp.environment.measuring import Measuring
from artigrasp.environment.rewarding import Rewarding
from artigrasp.environment.world_range import WorldRange
from artigrasp.kernels import episodes, features, kinematics, states
from artigrasp.simulation.launches import record


@dataclass(frozen=True)
class _Launches:
    """What some worlds need besides the physics: at a control step's beginning, in every substep, at its end, after."""

    begin: tuple[wp.Launch, ...]
    apply_torques: wp.Launch
    finish: tuple[wp.Launch, ...]
    observe: wp.Launch


class ControlSteps:
    """What all worlds need besides the physics; each method launches the kernels of one range of worlds."""

    def __init__(
        self,
        ranges: Sequence[WorldRange],
        acting: Acting,
        rewarding: Rewarding,
        measuring: Measuring,
        hand_model: states.HandModel,
        *,
        joint_torque: wp.array,
        observed: wp.array,
        with_hinge: bool,
    ) -> None:
        """Record the launches.

        Args:
            ranges: All worlds, as the physics shares them out.
            acting: What hands are told.
            rewarding: How they are rewarded.
            measuring: What is measured.
            hand_model: The hands.
            joint_torque: [W, H, 51] where the physics takes torques from.
            observed: [W, H, 279] where features go.
            with_hinge: Whether these tell of the hinge.
        """
        device = joint_torque.device
        self._launches = {
            worlds.rows.start: _Launches(
                begin=tuple(acting.set_targets(worlds)),
                apply_torques=acting.set_torques(worlds, joint_torque),
                finish=(
                    record(episodes.advance_steps, worlds.every_world, [worlds.step_count, worlds.phase], device),
                    record(
                        kinematics.forward_kinematics, worlds.every_hand, [worlds.state.hands, hand_model], device
                    ),
                    *rewarding.reward(worlds),
                    measuring.measure(worlds),
                ),
                observe=record(
                    features.compute_features,
                    worlds.every_hand,
                    [
                        worlds.state.hands, worlds.state.objects, worlds.object_model, worlds.goal, int(with_hinge),
                        observed[worlds.rows],
                    ],
                    device,
                ),
            )
            for worlds in ranges
        }  # fmt: skip

    def begin(self, rows: slice) -> None:
        """Take over due decisions and set the PD targets."""
        for kernel in self._launches[rows.start].begin:
            kernel.launch()

    def apply_torques(self, rows: slice) -> None:
        """PD torques towards the targets, from the present state."""
        self._launches[rows.start].apply_torques.launch()

    def finish(self, rows: slice) -> None:
        """Count, pose the hands' links, reward and measure."""
        for kernel in self._launches[rows.start].finish:
            kernel.launch()

    def observe(self, rows: slice) -> None:
        """Compute the features of the present state."""
        self._launches[rows.start].observe.launch()
