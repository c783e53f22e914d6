"""Damaged files of every kind: they are read, or refused in one line, and never run."""

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from artigrasp.errors import UserError
from artigrasp.evaluation.synthesis_file import SynthesisFile
from artigrasp.references.reference import save_references
from tests.example_references import box_references
from tests.fuzzing import examples, note
from tests.readers import READERS, SETTINGS, Reader, damage_and_read

COUNTS = {False: 25, True: 8}
"""Inputs for each reader, the slow ones apart."""


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_damaged_files_end_in_one_line(reader: Reader, tmp_path_factory: pytest.TempPathFactory) -> None:
    """However one of its files is damaged, a reader returns or raises one line that a user can read."""
    whole = tmp_path_factory.mktemp("whole")
    reader.write(whole)
    reader.read(whole)

    @examples(COUNTS[reader.slow])
    @given(data=st.data())
    def damaged(data: st.DataObject) -> None:
        note(*damage_and_read(data, reader, whole, tmp_path_factory.mktemp("damaged")))

    damaged()


@pytest.mark.parametrize("provenance", ["{", "[]", "3", '{"grips": []}', '{"grips": {"a": {"references": [{}]}}}'])
def test_references_of_unknown_making_are_not_gone_on_with(provenance: str, tmp_path: Path) -> None:
    """Where they came from is told in JSON, which others may have written."""
    save_references(tmp_path / "r.npz", replace(box_references(), provenance=provenance))
    with pytest.raises(UserError, match="expected references made with these settings, found others"):
        SynthesisFile(tmp_path / "r.npz", SETTINGS)
