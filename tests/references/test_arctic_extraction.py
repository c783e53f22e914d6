"""Extraction from the real recordings, against the authors' labels and contacts. Needs a user's copy of ARCTIC."""

from pathlib import Path

import numpy as np
import pytest

from artigrasp.assets.arctic import find_source
from artigrasp.assets.object import load_object
from artigrasp.config import ExtractionConfig
from artigrasp.references.agreement import pair_labels
from artigrasp.references.arctic_labels import read_labels
from artigrasp.references.arctic_sequence import Recording
from artigrasp.references.extracted_references import PAPER_TASKS, choose_recordings, extract_all
from artigrasp.references.extraction import Extractor

CONFIG = ExtractionConfig()


@pytest.mark.parametrize(("reconstructed", "labels", "paired"), [(False, 52, 45), (True, 13, 7)])
def test_labels_are_found(
    reconstructed: bool, labels: int, paired: int, arctic_release: Path, arctic_assets: Path
) -> None:
    """Most frames that the authors picked of box and laptop have an interaction near, nearly always of their task."""
    source = find_source(arctic_release)
    recordings = choose_recordings(
        source, ["box", "laptop"], ["s5"] if reconstructed else [], reconstructed=reconstructed
    )
    pairs = [
        pair
        for name, extractions in extract_all(Extractor(source, CONFIG), recordings)
        for each in extractions
        for pair in pair_labels(each, read_labels(source, name), PAPER_TASKS, CONFIG)
    ]
    labelled = [pair for pair in pairs if pair.label is not None]
    found = [pair for pair in labelled if pair.interaction is not None]
    assert len(labelled) == labels and len(found) >= paired
    assert sum(not pair.same_task for pair in found) <= 2
    # The authors picked some of all interactions, so that there are more.
    assert len(found) < sum(pair.interaction is not None for pair in pairs) < 3 * labels


def test_measured_contacts_are_the_releases(arctic_release: Path, arctic_assets: Path) -> None:
    """Hands of the mean shape touch with the links that the subject's own hands touch with, in nearly all frames."""
    source = find_source(arctic_release)
    extraction = Extractor(source, CONFIG, measure=True).extract(load_object("box"), Recording("s5", "box_use_01"))
    given, measured = extraction.shown.contacts, extraction.contacts
    assert given is not None
    both = (given & measured)[:, :, 2].sum()
    assert both / given[:, :, 2].sum() > 0.85 and both / measured[:, :, 2].sum() > 0.85
    assert np.mean(given[:, :, 2].any(axis=-1) == measured[:, :, 2].any(axis=-1)) > 0.95
