"""The paper's rules on signals whose interactions are known by construction."""

from dataclasses import replace

import numpy as np
import pytest

from artigrasp.config import ExtractionConfig
from artigrasp.errors import UserError
from artigrasp.references.interactions import FRAME_RATE, Interaction, Signals, find_interactions

CONFIG = ExtractionConfig()
FRAME_COUNT = 300
LEFT, RIGHT = 0, 1
DELAY = round(CONFIG.delay * FRAME_RATE)


def still() -> Signals:
    """An object that nobody touches or moves."""
    return Signals(
        base_speed=np.zeros(FRAME_COUNT),
        hinge_angle=np.zeros(FRAME_COUNT),
        hinge_rate=np.zeros(FRAME_COUNT),
        height=np.zeros(FRAME_COUNT),
        turning_links=np.zeros((FRAME_COUNT, 2), int),
        holding_links=np.zeros((FRAME_COUNT, 2), int),
    )


def hold(signals: Signals, hand: int, first: int, end: int, links: int = 8) -> None:
    """A hand touches the base."""
    signals.holding_links[first:end, hand] = links


def touch_lid(signals: Signals, hand: int, first: int, end: int, links: int = 4) -> None:
    """A hand touches the articulated part."""
    signals.holding_links[first:end, hand] = signals.turning_links[first:end, hand] = links


def carry(signals: Signals, first: int, end: int, speed: float = 0.4) -> None:
    """The base moves and comes back to its surface at the end."""
    signals.base_speed[first:end] = speed
    signals.height[first:end] = 0.1 * np.sin(np.linspace(0, np.pi, end - first))


def turn(signals: Signals, first: int, end: int, change: float = 1.0) -> None:
    """The hinge turns evenly."""
    signals.hinge_rate[first:end] = change / (end - first) * FRAME_RATE
    signals.hinge_angle[first:] += change
    signals.hinge_angle[first:end] = signals.hinge_angle[first - 1] + np.linspace(0, change, end - first)


def tasks(signals: Signals, config: ExtractionConfig = CONFIG) -> list[str]:
    """What was found, in the order of its frames."""
    return [each.task for each in find_interactions(signals, config)]


@pytest.mark.parametrize(("hands", "task"), [((LEFT,), "left"), ((RIGHT,), "right"), ((LEFT, RIGHT), "two")])
def test_hands_that_move_the_base_grasp(hands: tuple[int, ...], task: str) -> None:
    """One frame stands for a carry: a while after its first, while hands that touched before had not moved it."""
    signals = still()
    for hand in hands:
        hold(signals, hand, 40, 120)
    carry(signals, 60, 100)
    assert find_interactions(signals, CONFIG) == [Interaction(f"{task}_grasp", 60, 99, 60 + DELAY, 59)]


@pytest.mark.parametrize(("hands", "task"), [((LEFT,), "left"), ((RIGHT,), "right"), ((LEFT, RIGHT), "two")])
@pytest.mark.parametrize("change", [1.0, -1.0])
def test_hands_that_change_the_angle_articulate(hands: tuple[int, ...], task: str, change: float) -> None:
    """So it is whether they open or close, and whichever hand it is."""
    signals = still()
    for hand in hands:
        touch_lid(signals, hand, 40, 120)
    turn(signals, 60, 100, change)
    assert find_interactions(signals, CONFIG) == [Interaction(f"{task}_arti", 60, 99, 60 + DELAY, 60)]


def test_nothing_without_contact() -> None:
    """An object that moves and opens by itself, hands near, shows nothing; no more does a hand on one at rest."""
    signals = still()
    carry(signals, 60, 100)
    turn(signals, 120, 160)
    assert tasks(signals) == []
    hold(signals, LEFT, 200, 260)
    touch_lid(signals, RIGHT, 200, 260)
    assert tasks(signals) == []


def test_few_links_are_no_hold() -> None:
    """Fewer links than a hold needs let the other hand's grasp stand alone."""
    signals = still()
    hold(signals, LEFT, 40, 120)
    hold(signals, RIGHT, 40, 120, links=CONFIG.holding_links - 1)
    carry(signals, 60, 100)
    assert tasks(signals) == ["left_grasp"]


def test_opening_what_the_other_hand_holds() -> None:
    """The right hand opens in the air what the left carries: the left grasped when it took it off the surface."""
    signals = still()
    hold(signals, LEFT, 20, 250)
    carry(signals, 30, 240)
    touch_lid(signals, RIGHT, 100, 160)
    turn(signals, 110, 150)
    found = find_interactions(signals, CONFIG)
    assert [(each.task, each.frame) for each in found] == [("left_grasp", 30 + DELAY), ("right_arti", 110 + DELAY)]
    # Both start where the object lay last.
    assert [each.initial_frame for each in found] == [29, 29]
    held = find_interactions(signals, replace(CONFIG, held_grasps=True))
    assert [(each.task, each.frame) for each in held] == [
        ("left_grasp", 30 + DELAY),
        ("left_grasp", 110 + DELAY),
        ("right_arti", 110 + DELAY),
    ]


def test_a_hand_that_articulates_does_not_grasp() -> None:
    """A base that slides while its lid is opened is pushed; a hand that holds it on its surface grasps nothing."""
    signals = still()
    touch_lid(signals, RIGHT, 40, 120)
    turn(signals, 60, 100)
    signals.base_speed[60:100] = 0.3
    assert tasks(signals) == ["right_arti"]
    signals.base_speed[:] = 0.0
    hold(signals, LEFT, 40, 120)
    assert tasks(signals, replace(CONFIG, held_grasps=True)) == ["right_arti"]


def test_a_short_touch_of_the_other_hand_interrupts_nothing() -> None:
    """It makes neither a grasp of both nor two of one."""
    signals = still()
    hold(signals, LEFT, 20, 200)
    signals.base_speed[40:160] = 0.3
    hold(signals, RIGHT, 90, 90 + round(CONFIG.contact_time * FRAME_RATE) - 1)
    assert tasks(signals) == ["left_grasp"]


def test_what_is_gripped_in_the_air_was_grasped_before() -> None:
    """A second hand that joins a carried object moves nothing off its surface."""
    signals = still()
    hold(signals, LEFT, 20, 250)
    carry(signals, 30, 240)
    hold(signals, RIGHT, 120, 200)
    assert tasks(signals) == ["left_grasp"]


def test_hands_take_turns_on_the_surface() -> None:
    """Another hand is another interaction."""
    signals = still()
    hold(signals, LEFT, 20, 100)
    hold(signals, RIGHT, 105, 200)
    carry(signals, 30, 95)
    carry(signals, 110, 180)
    assert tasks(signals) == ["left_grasp", "right_grasp"]


@pytest.mark.parametrize(("pause", "count"), [(CONFIG.pause - 0.1, 1), (CONFIG.pause + 0.1, 2)])
def test_a_long_pause_ends_an_interaction(pause: float, count: int) -> None:
    """The same hands may stand still for a while."""
    signals = still()
    hold(signals, RIGHT, 20, 280)
    carry(signals, 30, 80)
    carry(signals, 80 + round(pause * FRAME_RATE), 180)
    assert tasks(signals) == ["right_grasp"] * count


def test_jitter_adds_and_removes_nothing() -> None:
    """Contacts that flicker, speeds that tremble below their thresholds and single frames above them do not matter."""
    random = np.random.default_rng(0)
    signals = still()
    hold(signals, RIGHT, 40, 120)
    carry(signals, 60, 100)
    touch_lid(signals, RIGHT, 150, 220)
    turn(signals, 160, 200)
    expected = find_interactions(signals, CONFIG)
    assert [each.task for each in expected] == ["right_grasp", "right_arti"]
    signals.base_speed[:] += random.uniform(0, 0.5 * CONFIG.base_speed, FRAME_COUNT)
    signals.hinge_rate[:] += random.uniform(-0.5, 0.5, FRAME_COUNT) * CONFIG.hinge_rate
    for frame in (75, 79, 170, 190):
        signals.holding_links[frame : frame + 2] = signals.turning_links[frame : frame + 2] = 0
    signals.holding_links[[5, 130, 250, 251], LEFT] = signals.turning_links[[5, 130, 250, 251], LEFT] = 9
    signals.base_speed[[10, 130, 250]] = 1.0
    signals.hinge_rate[[10, 130, 250]] = 5.0
    assert find_interactions(signals, CONFIG) == expected


def test_short_and_small_movements_are_none() -> None:
    """A push that is over at once and a hinge that hardly turns show nothing."""
    signals = still()
    hold(signals, RIGHT, 40, 120)
    carry(signals, 60, 60 + round(CONFIG.duration * FRAME_RATE) - 1)
    touch_lid(signals, LEFT, 150, 220)
    turn(signals, 160, 170, change=0.9 * CONFIG.hinge_change)
    assert tasks(signals) == []


def test_interactions_at_the_ends_of_a_recording() -> None:
    """Hands that hold from the first frame to the last, and an object that is never at rest, are no trouble."""
    signals = still()
    hold(signals, LEFT, 0, FRAME_COUNT)
    signals.base_speed[:] = 1.0
    assert find_interactions(signals, CONFIG) == [Interaction("left_grasp", 0, FRAME_COUNT - 1, DELAY, 0)]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"base_speed": 0.0}, "base_speed: expected a positive number, found 0.0"),
        ({"turning_links": 0}, "turning_links: expected a positive number, found 0"),
        ({"delay": -0.1}, "delay: expected zero or a positive number, found -0.1"),
    ],
)
def test_senseless_rules_are_refused(change: dict[str, float], message: str) -> None:
    """The message names the setting."""
    with pytest.raises(UserError, match=message):
        replace(CONFIG, **change)
