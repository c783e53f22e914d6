"""Damage files of every kind, and see that readers refuse them in one line, or read them, and nothing else.

    python -m tools.fuzz_readers [--readers READER ...] [--inputs N] [--slow-inputs N] [--seed S] [--keep FOLDER]

Every reader of `tests/readers.py` gets so many inputs, damaged in the ways of `tests/fuzzing.py`, in a process of its
own that may take 12 GiB. A crash is whatever is neither success nor a `UserError` of one line: any other exception, 30
seconds of a processor for an input, a pickle that was run, or the end of the process; a reader that starts a process
of its own has its own limits for that. The inputs of crashes are kept in FOLDER. Prints a table, and fails if there was
a crash.
"""

import argparse
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from hypothesis.errors import HypothesisException

from tests.fuzzing import crash_of
from tests.readers import READERS, Reader, damage_and_read

MEMORY = 12 * 2**30
"""What a process may take [bytes]."""
SECONDS = 30
"""Processor time that reading one input may take [s]."""


@dataclass(frozen=True)
class Result:
    """How a reader's inputs ended."""

    reader: str
    inputs: int
    read: int
    refused: int
    crashes: dict[str, int]
    """How often, by what was raised and where."""
    slowest: float
    """Most processor time for an input [s]."""


def fuzz(reader: Reader, inputs: int, number: int, keep: Path) -> Result:
    """Give a reader so many inputs."""
    counts: Counter[str] = Counter()
    crashes: Counter[str] = Counter()
    slowest = 0.0

    with tempfile.TemporaryDirectory() as name:
        # pieces of damaged meshes are worth no place in the user's cache
        os.environ["ARTIGRASP_CACHE"] = str(Path(name) / "cache")
        whole = Path(name) / "whole"
        whole.mkdir()
        reader.write(whole)

        @seed(number)
        @settings(
            max_examples=inputs,
            deadline=None,
            database=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(data=st.data())
        def one(data: st.DataObject) -> None:
            nonlocal slowest
            folder, began = Path(tempfile.mkdtemp(dir=name)), processor_time()
            signal.setitimer(signal.ITIMER_PROF, SECONDS)
            try:
                _, refusal = damage_and_read(data, reader, whole, folder)
                counts["read" if refusal is None else "refused"] += 1
            except HypothesisException:
                raise
            except Exception as error:
                crash = crash_of(error)
                crashes[crash] += 1
                if crashes[crash] == 1:
                    shutil.copytree(folder, keep / f"{reader.name} {len(crashes)}", dirs_exist_ok=True)
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0)
                slowest = max(slowest, processor_time() - began)
                shutil.rmtree(folder)

        one()
    total = counts.total() + crashes.total()
    return Result(reader.name, total, counts["read"], counts["refused"], dict(crashes), round(slowest, 2))


def processor_time() -> float:
    """What this process and the children that have ended used so far [s]."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def fuzz_apart(name: str, options: argparse.Namespace) -> Result:
    """The same in a process of its own, whose end is a crash."""
    words = [sys.executable, "-m", "tools.fuzz_readers", "--readers", name, "--here", "--seed", str(options.seed)]
    words += ["--inputs", str(options.inputs), "--slow-inputs", str(options.slow_inputs), "--keep", str(options.keep)]
    process = subprocess.run(words, stdout=subprocess.PIPE, check=False)
    lines = process.stdout.decode().splitlines()
    if process.returncode != 0 or not lines:
        return Result(name, 0, 0, 0, {f"the process ended with {process.returncode}": 1}, 0.0)
    return Result(**json.loads(lines[-1]))


def table(results: list[Result]) -> str:
    """A row for each reader, and one for all."""
    lines = ["| reader | inputs | read | refused | crashes | slowest s |", "| --- | --- | --- | --- | --- | --- |"]
    for each in results:
        cells = (
            f"{each.inputs:,} | {each.read:,} | {each.refused:,} | {sum(each.crashes.values())} | {each.slowest:.2f}"
        )
        lines.append(f"| {each.reader} | {cells} |")
    sums: dict[str, Any] = {key: sum(getattr(each, key) for each in results) for key in ("inputs", "read", "refused")}
    crashes = sum(sum(each.crashes.values()) for each in results)
    slowest = max(each.slowest for each in results)
    lines.append(f"| all | {sums['inputs']:,} | {sums['read']:,} | {sums['refused']:,} | {crashes} | {slowest:.2f} |")
    return "\n".join(lines)


def _too_long(number: int, frame: FrameType | None) -> None:
    raise TimeoutError(f"an input took more than {SECONDS} s")


def main() -> None:
    """Damage, read, and tell what came of it."""
    by_name = {reader.name: reader for reader in READERS}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--readers", nargs="+", choices=by_name, default=list(by_name), metavar="READER")
    parser.add_argument("--inputs", type=int, default=2000)
    parser.add_argument("--slow-inputs", type=int, default=200, help="of each of the readers that take long")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, default=Path("build/fuzz"), help="where inputs of crashes are kept")
    parser.add_argument("--here", action="store_true", help="in this process")
    options = parser.parse_args()
    if options.here:
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        signal.signal(signal.SIGPROF, _too_long)
        for name in options.readers:
            inputs = options.slow_inputs if by_name[name].slow else options.inputs
            print(json.dumps(asdict(fuzz(by_name[name], inputs, options.seed, options.keep))), flush=True)
        return
    results = []
    for name in options.readers:
        results.append(fuzz_apart(name, options))
        for crash, count in results[-1].crashes.items():
            print(f"{name}: {count} x {crash}", file=sys.stderr, flush=True)
    print(table(results))
    sys.exit(any(each.crashes for each in results))


if __name__ == "__main__":
    main()
