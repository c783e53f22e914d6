"""Tests of the command line's frame: exit codes, one-line errors, clean output and quick help."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from artigrasp.cli import app
from artigrasp.errors import UserError


@dataclass(frozen=True)
class Options:
    """Do something.

    And more about it.
    """

    world_count: int = 1
    """How many."""
    json: bool = False
    """Print JSON."""


@pytest.fixture
def verb(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """A verb `try-it` whose ``run`` a test sets."""
    module = SimpleNamespace(Options=Options, run=lambda options: 0)
    monkeypatch.setattr(app, "VERBS", ("try-it",))
    monkeypatch.setitem(sys.modules, "artigrasp.cli.try_it", module)
    return module


def test_run_gets_the_options_and_gives_the_exit_code(verb: SimpleNamespace) -> None:
    """Flags are written with hyphens; what ``run`` returns is the exit code."""
    seen = []
    verb.run = lambda options: seen.append(options) or 1
    assert app.main(["try-it", "--world-count", "3", "--json"]) == 1
    assert seen == [Options(world_count=3, json=True)]


def raiser(error: BaseException) -> Callable[[Options], int]:
    """A ``run`` that fails."""

    def run(options: Options) -> int:
        raise error

    return run


def test_users_error_is_one_line_and_code_2(verb: SimpleNamespace, capsys: pytest.CaptureFixture[str]) -> None:
    """A mistake of the user's is told without a traceback."""
    verb.run = raiser(UserError("box.usda: mass: expected a positive number, found -1"))
    assert app.main(["try-it"]) == 2
    assert capsys.readouterr() == ("", "error: box.usda: mass: expected a positive number, found -1\n")


def test_other_errors_keep_their_traceback(verb: SimpleNamespace) -> None:
    """A mistake of the program's is not dressed up as the user's."""
    verb.run = raiser(ValueError("a bug"))
    with pytest.raises(ValueError, match="a bug"):
        app.main(["try-it"])


def test_interruption_is_quiet(verb: SimpleNamespace, capsys: pytest.CaptureFixture[str]) -> None:
    """Ctrl-C ends a verb without a traceback."""
    verb.run = raiser(KeyboardInterrupt())
    assert app.main(["try-it"]) == 130
    assert capsys.readouterr().err == "interrupted\n"


@pytest.mark.parametrize("words", [["try-it", "--nothing"], ["try-it", "--world-count", "many"], ["try-it", "extra"]])
def test_bad_usage_of_a_verb_is_code_2(
    verb: SimpleNamespace, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """Unknown flags, wrong types and words too many are refused on standard error."""
    with pytest.raises(SystemExit) as caught:
        app.main(words)
    assert caught.value.code == 2
    captured = capsys.readouterr()
    assert captured.out == "" and words[1] in captured.err


def test_unknown_verb_is_code_2(capsys: pytest.CaptureFixture[str]) -> None:
    """A misspelt verb leads to the one that was meant."""
    assert app.main(["lits"]) == 2
    assert capsys.readouterr().err == "error: unknown verb 'lits': did you mean 'list'?\n"


def test_help_shows_every_verb(capsys: pytest.CaptureFixture[str]) -> None:
    """`--help` and no words at all show all verbs with a summary; only the latter is a mistake."""
    assert app.main(["--help"]) == 0
    text = capsys.readouterr().out
    for name in app.VERBS:
        summary = (app.load_verb(name).Options.__doc__ or "").splitlines()[0]
        assert f"  {name} " in text and summary.endswith(".") and summary in text
    assert app.main([]) == 2
    assert capsys.readouterr().out == text


@pytest.mark.parametrize("name", app.VERBS)
def test_every_verb_has_help(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A verb's help describes each option."""
    with pytest.raises(SystemExit) as caught:
        app.main([name, "--help"])
    assert caught.value.code == 0
    assert capsys.readouterr().out.startswith(f"usage: artigrasp {name}")


def test_what_libraries_print_is_no_result(verb: SimpleNamespace, capsys: pytest.CaptureFixture[str]) -> None:
    """Only results reach standard output; other prints of a verb go to standard error."""

    def run(options: Options) -> int:
        from artigrasp.cli.output import show_json

        print("library 1.0 initialised")
        show_json({"a": 1})
        return 0

    verb.run = run
    assert app.main(["try-it"]) == 0
    assert capsys.readouterr() == ('{\n  "a": 1\n}\n', "library 1.0 initialised\n")


def test_help_loads_nothing_heavy() -> None:
    """Help must come at once: neither simulator nor learner is loaded for it, whatever the verbs."""
    heavy = ["warp", "newton", "mujoco", "torch", "pxr", "scipy", "matplotlib"]
    program = (
        "import sys; from artigrasp.cli import main; main(['--help']);"
        f"print([name for name in {heavy} if name in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"


def test_reader_that_goes_away_is_no_error() -> None:
    """`artigrasp ... | head` ends without a traceback."""
    program = "from artigrasp.cli import app; app._show_help = lambda: app.show('x\\n' * 1_000_000); app.main(['-h'])"
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        assert process.stderr.read() == b""
