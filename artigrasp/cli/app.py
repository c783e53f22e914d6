"""From the words of a command line to a verb's exit code: 0 done, 1 failed, 2 bad usage or bad input.

A verb is a module of this package with a frozen dataclass ``Options``, whose docstrings are the help texts, and a
function ``run(options) -> int``. Verbs import the simulator and the learner inside ``run`` so that help stays quick.
"""

import importlib
import importlib.metadata
import logging
import os
import sys
from collections.abc import Callable, Sequence
from typing import Any, Protocol, cast

import tyro

from artigrasp.cli.output import results_only, show, show_columns
from artigrasp.cli.progress import log_to_console
from artigrasp.errors import UserError, unknown

VERBS = (
    "demo",
    "list",
    "import-arctic",
    "extract-references",
    "refine-references",
    "synthesize-references",
    "make-object",
    "import-object",
    "check-asset",
    "train",
    "evaluate",
    "compare",
    "generate",
    "tell",
    "view",
    "render",
    "export-usd",
    "export-mano",
    "export-policy",
    "bench",
)
"""Every verb, in the order of the help text; the module of `check-asset` is ``check_asset``."""
_SEEDS = 10**18
"""How many seeds there are."""


class Verb(Protocol):
    """What a verb's module holds."""

    Options: type
    run: Callable[[Any], int]


def load_verb(name: str) -> Verb:
    """The module of a verb.

    Raises:
        UserError: There is no such verb.
    """
    if name not in VERBS:
        raise unknown("verb", name, VERBS)
    return cast(Verb, importlib.import_module(f"artigrasp.cli.{name.replace('-', '_')}"))


def parse(words: Sequence[str]) -> tuple[Verb, Any]:
    """The verb that words name first, and its options from the others.

    Raises:
        UserError: There is no such verb, or the seed is none.
        SystemExit: tyro printed the verb's help (code 0) or refused the usage (code 2).
    """
    verb = load_verb(words[0])
    options: Any = tyro.cli(
        verb.Options,
        prog=f"artigrasp {words[0]}",
        args=words[1:],
        config=(tyro.conf.FlagCreatePairsOff, tyro.conf.OmitArgPrefixes),
    )
    seed = getattr(options, "seed", 0)
    if isinstance(seed, int) and not 0 <= seed < _SEEDS:
        raise UserError(f"seed: expected 0 to {_SEEDS - 1}, found {seed}")
    return verb, options


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb.

    Args:
        arguments: The words after the program's name; those of this process if None.

    Returns:
        The exit code.

    Raises:
        SystemExit: tyro printed a verb's help (code 0) or refused the usage (code 2).
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    log_to_console(logging.getLogger("artigrasp"))
    try:
        return _run(words)
    except UserError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except MemoryError as error:
        print(f"error: not enough memory, ask for less: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # Whoever read our output has enough of it; Python's flush at exit must not fail over that.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _run(words: list[str]) -> int:
    if not words:
        _show_help()
        return 2
    if words[0] in ("-h", "--help"):
        _show_help()
        return 0
    if words[0] == "--version":
        show(importlib.metadata.version("artigrasp"))
        return 0
    verb, options = parse(words)
    with results_only():
        return verb.run(options)


def _show_help() -> None:
    show("usage: artigrasp VERB [OPTIONS]\n")
    show("Simulated hands that grasp, carry and open hinged objects.\n")
    summaries = ((load_verb(name).Options.__doc__ or "").splitlines()[0] for name in VERBS)
    show_columns([(f"  {name}", summary) for name, summary in zip(VERBS, summaries, strict=True)])
    show("\nartigrasp VERB --help tells a verb's options.")
