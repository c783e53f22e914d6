"""The object in focus, in and out of the slots."""

import numpy as np
import pytest
import warp as wp

from artigrasp.kernels import states
from artigrasp.simulation.state import SimulationState, allocate_state
from tests.kernels.samples import Sample, fill, object_slots, random_sample

WORLD_COUNT, OBJECT_COUNT = 4, 3
FIELDS = tuple(states.element_types(states.ObjectSlots))


@pytest.fixture
def sample() -> Sample:
    """Random objects."""
    return random_sample(WORLD_COUNT)


@pytest.fixture
def state(sample: Sample) -> SimulationState:
    """Worlds of several objects each."""
    state = allocate_state(WORLD_COUNT, 1, OBJECT_COUNT, "cpu")
    for name in FIELDS:
        getattr(state.slots, name).assign(getattr(object_slots(sample, OBJECT_COUNT), name))
    return state


def set_focus(state: SimulationState, focus: np.ndarray) -> None:
    """Slot by slot."""
    for slot in range(OBJECT_COUNT):
        state.set_focus(slot, wp.array((focus == slot).astype(int), dtype=int, device="cpu"))


def test_the_object_in_focus_is_read(state: SimulationState) -> None:
    """Each world's own."""
    focus = np.array([2, 0, 1, 2])
    set_focus(state, focus)
    np.testing.assert_array_equal(state.focus.numpy(), focus)
    for name in FIELDS:
        expected = getattr(state.slots, name).numpy()[np.arange(WORLD_COUNT), focus]
        np.testing.assert_array_equal(getattr(state.objects, name).numpy(), expected, err_msg=name)


def test_the_object_in_focus_is_written(state: SimulationState) -> None:
    """In the masked worlds, and no other object."""
    focus, mask = np.array([2, 0, 1, 2]), np.array([1, 0, 1, 1])
    set_focus(state, focus)
    fill(state.objects, states.ObjectState, random_sample(WORLD_COUNT, seed=1))
    expected = {name: getattr(state.slots, name).numpy().copy() for name in FIELDS}
    for name, slots in expected.items():
        slots[mask == 1, focus[mask == 1]] = getattr(state.objects, name).numpy()[mask == 1]
    state.write_focus(wp.array(mask, dtype=int, device="cpu"))
    for name, slots in expected.items():
        np.testing.assert_array_equal(getattr(state.slots, name).numpy(), slots, err_msg=name)


def test_the_only_object_is_always_in_focus() -> None:
    """Its arrays are those of its slot, so that nothing is copied."""
    state = allocate_state(WORLD_COUNT, 1, 1, "cpu")
    for name in FIELDS:
        assert getattr(state.objects, name).ptr == getattr(state.slots, name).ptr, name
        assert getattr(state.objects, name).is_contiguous, name
