"""`artigrasp check-asset`: is a USD file fit for simulation?"""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import tyro

from artigrasp.cli.output import show, show_columns, show_json


@dataclass(frozen=True)
class Options:
    """Check a hand or an object in USD, and say how to mend it; exit code 1 if it cannot be simulated.

    With --json: {"path": file, "format": format, "usable": whether it can be simulated, "facts": {name_unit: number},
    "findings": [{"severity": "error" or "warning", "field", "problem", "remedy"}]}.
    """

    file: Annotated[Path, tyro.conf.Positional]
    """The USD file."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Print what was measured and what is wrong."""
    from artigrasp.assets.check import check_asset

    report = check_asset(options.file)
    if options.json:
        findings = [asdict(finding) for finding in report.findings]
        head = {"path": str(report.path), "format": report.format, "usable": report.usable}
        show_json({**head, "facts": report.facts, "findings": findings})
    else:
        show_columns([(f"{name}:", f"{value:.4g}") for name, value in report.facts.items()])
        for finding in report.findings:
            show(f"{finding.severity}: {finding.field}: {finding.problem}; {finding.remedy}")
        show(f"{report.path}: {'can' if report.usable else 'cannot'} be simulated")
    return 0 if report.usable else 1
