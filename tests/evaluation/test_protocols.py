"""Protocols by name."""

import pytest

from artigrasp.errors import UserError
from artigrasp.evaluation.protocols import PROTOCOLS, get_protocol


def test_protocols_are_found_by_name() -> None:
    """Each calls itself so and measures something; a wrong name gets the nearest."""
    for name, protocol in PROTOCOLS.items():
        assert get_protocol(name) is protocol and protocol.name == name
        assert protocol.experiments and protocol.splits and protocol.summary
    with pytest.raises(UserError, match="unknown protocol 'articulate': did you mean 'articulation'"):
        get_protocol("articulate")


def test_images_are_held_against_motion_capture_of_the_same_frames() -> None:
    """Only left-out asks for objects that a policy has not seen."""
    assert PROTOCOLS["images"].splits == ("recon", "recon-mocap")
    assert [name for name, each in PROTOCOLS.items() if each.unseen_objects] == ["left-out"]
