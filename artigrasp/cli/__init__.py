"""The command line: `artigrasp VERB`, one module per verb."""

from artigrasp.cli.app import main

__all__ = ["main"]
