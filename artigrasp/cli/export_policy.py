"""`artigrasp export-policy`: a policy as TorchScript and ONNX."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from artigrasp.assets.library import find_file
from artigrasp.cli.output import show, show_json
from artigrasp.cli.progress import progress_bar
from artigrasp.files import check_folder


@dataclass(frozen=True)
class Options:
    """Write a policy for other programs: a TorchScript and an ONNX file for each hand, and policy.json.

    Each takes the 279 features of its hand, [row, 279], and gives the mean of the policy's action, [row, number].
    Normalisation is in the file, and the mirror for a hand that another one's network acts for. policy.json names the
    blocks of the features and says what each number of the action means, its scale and how long a decision holds.

    With --json: {"paths": [file]}.
    """

    policy: Annotated[str, tyro.conf.Positional]
    """Policy file, or a name of `artigrasp list policies`."""
    out: Path = Path("exported")
    """Folder to write to."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Export the policy."""
    from artigrasp.controllers.policy_export import export_policy
    from artigrasp.controllers.policy_file import load_policy

    check_folder(options.out)
    policy = load_policy(find_file("policies", options.policy))
    with progress_bar("Exporting", hidden=options.json) as progress:
        paths = export_policy(policy, options.out, on_file=lambda done, total: progress("", done, total))
    if options.json:
        show_json({"paths": [str(path) for path in paths]})
        return 0
    for path in paths:
        show(f"wrote {path}")
    return 0
