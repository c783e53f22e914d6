"""Policies by name."""

from pathlib import Path

from artigrasp.assets.library import asset_roots
from artigrasp.errors import unknown


def list_policies() -> dict[str, Path]:
    """The policy files among the assets by name; of two with one name the user's own."""
    return {path.stem: path for root in reversed(asset_roots()) for path in sorted((root / "policies").glob("*.pt"))}


def find_policy(name: str) -> Path:
    """The file of a policy, given by its path or by its name among the assets.

    Raises:
        UserError: There is neither; suggests the nearest name.
    """
    if (path := Path(name)).is_file():
        return path
    policies = list_policies()
    if name not in policies:
        raise unknown("policy", name, policies)
    return policies[name]
