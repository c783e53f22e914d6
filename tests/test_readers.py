"""Damaged files of every kind: they are read, or refused in one line, and never run."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.fuzzing import examples, note
from tests.readers import READERS, Reader, damage_and_read

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
