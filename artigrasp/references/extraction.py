"""The interactions in raw recordings of ARCTIC, by the paper's rules."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.assets.arctic import HAND_NAME, ArcticSource
from artigrasp.assets.arctic_hand import load_mean_pose, mean_pose_path
from artigrasp.assets.hand import HandModel, load_hand
from artigrasp.assets.library import asset_roots
from artigrasp.assets.object import ObjectModel
from artigrasp.config.extraction import ExtractionConfig
from artigrasp.errors import UserError
from artigrasp.kernels.layout import HANDS
from artigrasp.references.arctic_sequence import RecordedSequence, Recording, read_sequence, sequence_files
from artigrasp.references.contacts import measure_contacts
from artigrasp.references.interactions import Interaction, Signals, find_interactions
from artigrasp.references.signals import measure_signals


@dataclass(frozen=True, eq=False)
class Extraction:
    """What was found in one recording of T frames.

    Attributes:
        recording: The recording.
        states: States of the object in the world, shape (T, 7).
        shown: What the recording shows.
        contacts: Contacts that the rules looked at, those of the recording or measured ones, shape (T, 2, 3, 16).
        signals: What else the rules looked at.
        interactions: What they found.
    """

    recording: Recording
    states: Array
    shown: RecordedSequence
    contacts: NDArray[np.bool_]
    signals: Signals
    interactions: tuple[Interaction, ...]


class Extractor:
    """Applies the rules to recordings.

    Args:
        source: A user's copy of ARCTIC with recordings.
        config: The rules' numbers.
        measure: Whether to measure contacts even where the recording has some.
    """

    def __init__(self, source: ArcticSource, config: ExtractionConfig, *, measure: bool = False) -> None:
        self._source, self.config, self.measure = source, config, measure

    @cached_property
    def mean_pose(self) -> dict[str, Array]:
        """MANO's mean pose of each side, shape (45,) [rad].

        Raises:
            UserError: no hands were imported.
        """
        paths = [mean_pose_path(root) for root in asset_roots()]
        found = next((path for path in paths if path.is_file()), None)
        if found is None:
            raise UserError(
                f"{paths[0]}: no such file: extraction needs MANO's hands, which import-arctic makes of the ArtiGrasp "
                "release or of --mano"
            )
        return load_mean_pose(found)

    @cached_property
    def hands(self) -> list[HandModel]:
        """Left and right hand of the mean shape."""
        return [load_hand(HAND_NAME, side) for side in HANDS]

    def extract(self, model: ObjectModel, recording: Recording) -> Extraction:
        """Find the interactions of a recording.

        In a reconstruction from images the object does not move: what the object does is taken from the recording of
        the same frames, and only where hands touch it from the reconstruction.

        Raises:
            UserError: a file is missing or malformed.
        """
        shown = self._read(recording)
        states = self._read(recording._replace(reconstructed=False)).object_state
        if len(states) != len(shown.object_state):
            path = sequence_files(self._source, recording)[1]
            raise UserError(f"{path}: states: expected {len(states)} frames, as recorded, found {len(shown.pose)}")
        contacts = shown.contacts
        if contacts is None or self.measure:
            contacts = measure_contacts(model, self.hands, shown, self.mean_pose, self.config.contact_distance)
        signals = measure_signals(model, states, contacts, self.config)
        return Extraction(recording, states, shown, contacts, signals, tuple(find_interactions(signals, self.config)))

    def _read(self, recording: Recording) -> RecordedSequence:
        sequence = read_sequence(self._source, recording)
        if sequence is None:
            subject, name, reconstructed = recording
            what = "reconstruction" if reconstructed else "recording"
            raise UserError(f"{self._source.path}: expected the {what} {name} of {subject}, found none")
        if len(sequence.object_state) < 2:
            path = sequence_files(self._source, recording)[1]
            raise UserError(f"{path}: states: expected at least 2 frames, found {len(sequence.object_state)}")
        return sequence
