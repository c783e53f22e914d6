"""Files of synthesised references, which grow grip by grip so that nothing is lost."""

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from artigrasp.errors import UserError
from artigrasp.evaluation.synthesis import SynthesizedReferences
from artigrasp.references.reference import (
    ReferenceSet,
    describe_provenance,
    join_references,
    read_references,
    save_references,
)

MADE_BY = "synthesize-references"


class SynthesisFile:
    """A file of synthesised references of one object.

    Attributes:
        path: The file, which need not be there.
        grips: What it says of each grip that was tried: ``"count"``, see
            :class:`artigrasp.evaluation.synthesis.SynthesisCount`, and ``"references"``, one record for each.
    """

    def __init__(self, path: Path, settings: Mapping[str, Any], *, overwrite: bool = False) -> None:
        """Go on with a file, or begin one.

        Args:
            path: The file.
            settings: What its references depend on besides the object, of JSON's types.
            overwrite: Whether to begin anew where it was made with other settings.

        Raises:
            UserError: it was made with other settings, or is no file of synthesised references.
        """
        self.path, self.grips = path, {}
        self._settings: dict[str, Any] = json.loads(json.dumps(dict(settings)))
        self._references: ReferenceSet | None = None
        if not path.is_file():
            return
        references = read_references(path)
        provenance = _read_provenance(references)
        if all(provenance.get(key) == value for key, value in {"made_by": MADE_BY, **self._settings}.items()):
            self._references, self.grips = references, provenance["grips"]
        elif not overwrite:
            raise UserError(f"{path}: expected references made with these settings, found others: add --overwrite")

    def add(self, grip: str, made: SynthesizedReferences) -> None:
        """Add what was made of a grip, and write the file unless nothing has been kept yet."""
        self.grips[grip] = {"count": asdict(made.count), "references": list(made.records)}
        parts = [each for each in (self._references, made.references) if each is not None]
        if not parts:
            return
        provenance = describe_provenance(MADE_BY, **self._settings, grips=self.grips)
        self._references = replace(join_references(parts), provenance=provenance)
        save_references(self.path, self._references)

    def made_of(self, grip: str) -> tuple[ReferenceSet, list[dict[str, Any]]] | None:
        """The references of a grip and their records, None where there are none."""
        records = self.grips[grip]["references"] if grip in self.grips else []
        if self._references is None or not records:
            return None
        rows = np.flatnonzero(np.isin(self._references.source, [each["source"] for each in records]))
        return self._references.select(indices=rows), records


def _read_provenance(references: ReferenceSet) -> dict[str, Any]:
    """Where references came from; nothing where it is not told as :meth:`SynthesisFile.add` does."""
    try:
        found = json.loads(references.provenance or "{}")
        whole = all("source" in record for grip in found["grips"].values() for record in grip["references"])
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError):
        return {}
    return dict(found) if whole else {}
