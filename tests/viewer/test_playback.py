"""Tests of the playhead, without any browser or clock."""

import pytest

from artigrasp.viewer.playback import Playback


def test_moves_by_speed() -> None:
    """The playhead moves by real time times speed, and only while it plays."""
    playback = Playback(duration=10.0, speed=0.5)
    assert not playback.advance(1.0) and playback.time == 0.0
    playback.toggle()
    assert not playback.advance(1.0) and playback.time == 0.5


def test_loops_or_stops() -> None:
    """At the end it begins again, or stops there; playing on from there begins at the start."""
    playback = Playback(duration=1.0, time=0.9, playing=True)
    assert playback.advance(0.2)
    assert (playback.time, playback.playing) == (0.0, True)
    playback.loop, playback.time = False, 0.9
    assert playback.advance(0.2)
    assert (playback.time, playback.playing) == (1.0, False)
    playback.toggle()
    assert (playback.time, playback.playing) == (0.0, True)


def test_waits_for_what_is_not_recorded_yet() -> None:
    """A playhead waits at the last sample there is, and goes on from there."""
    playback = Playback(duration=3.0, time=1.0, playing=True)
    assert not playback.advance(1.0, recorded=1.2) and playback.time == 1.2
    assert not playback.advance(1.0, recorded=2.5) and playback.time == 2.2


@pytest.mark.parametrize(("time", "expected"), [(-1.0, 0.0), (1.5, 1.5), (9.0, 2.0)])
def test_seeks_within_the_timeline(time: float, expected: float) -> None:
    """It can be put anywhere on the timeline, and nowhere else."""
    playback = Playback(duration=2.0)
    playback.seek(time)
    assert playback.time == expected


def test_nothing_to_play_yet() -> None:
    """A timeline without length does not move, and plays as soon as it has one."""
    playback = Playback(playing=True)
    assert not playback.advance(1.0) and not playback.is_moving and playback.playing
    playback.restart(2.0)
    assert not playback.advance(0.5) and playback.time == 0.5
