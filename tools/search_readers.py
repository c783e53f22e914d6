"""Let a fuzzer that sees which lines run look for files that readers of our own stumble over; needs `atheris`.

    python -m tools.search_readers [--readers READER ...] [--seconds S] [--seed S] [--keep FOLDER]

`pip install atheris` first: it is none of the project's dependencies. Readers are those of `tests/readers.py` whose
parsers are Python, where what runs can be seen. Each begins with whole files, of which one at a time is changed by
libFuzzer, in a process of its own for so many seconds; what reaches new lines is changed further. Crashes are what they
are in `tools/fuzz_readers.py`, of which the first input of each kind is kept in FOLDER. Prints a table, and fails if
there was a crash.
"""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

READERS = ("MANO model", "story", "task", "run folder", "references", "motion", "foreign object, URDF and mesh")
"""Those whose parsers are Python."""
SECONDS = 30
"""That reading one input may take [s]."""
LARGEST = 2**16
"""Input [bytes]."""


def search(name: str, options: argparse.Namespace) -> None:
    """Look for crashes of one reader in this process, which ends with that."""
    import atheris

    with atheris.instrument_imports(include=["artigrasp", "yaml", "trimesh"]):
        from artigrasp.errors import UserError
        from tests.fuzzing import crash_of
        from tests.readers import READERS as EVERY

    (reader,) = (each for each in EVERY if each.name == name)
    folder, corpus = Path(tempfile.mkdtemp()), Path(tempfile.mkdtemp())
    reader.write(folder)
    whole = {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}
    for index, content in enumerate(whole.values()):
        (corpus / str(index)).write_bytes(bytes([index]) + content)
    seen = set()

    def read(data: bytes) -> None:
        if not data:
            return
        path = list(whole)[data[0] % len(whole)]
        path.write_bytes(data[1:])
        try:
            reader.read(folder)
        except UserError as error:
            found = None if "\n" not in str(error) else f"more than one line: {error}"
        except Exception as error:
            found = crash_of(error)
        else:
            found = None
        path.write_bytes(whole[path])
        if found is not None and (kind := found.split(": ")[0]) not in seen:
            seen.add(kind)
            options.keep.mkdir(parents=True, exist_ok=True)
            (options.keep / f"{name} {len(seen)}{path.suffix}").write_bytes(data[1:])
            print(f"crash: {found}", file=sys.stderr, flush=True)

    limits = [f"-max_total_time={options.seconds}", f"-timeout={SECONDS}", f"-max_len={LARGEST}"]
    atheris.Setup([sys.argv[0], f"-seed={options.seed + 1}", *limits, str(corpus)], read)
    atheris.Fuzz()


def main() -> None:
    """Search, and tell what came of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--readers", nargs="+", choices=READERS, default=READERS, metavar="READER")
    parser.add_argument("--seconds", type=int, default=120, help="for each reader")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, default=Path("build/search"), help="where inputs of crashes are kept")
    parser.add_argument("--here", action="store_true", help="in this process")
    options = parser.parse_args()
    if options.here:
        search(options.readers[0], options)
    rows, failed = [], False
    for name in options.readers:
        words = [sys.executable, "-m", "tools.search_readers", "--readers", name, "--here"]
        words += ["--seconds", str(options.seconds), "--seed", str(options.seed), "--keep", str(options.keep)]
        said = subprocess.run(words, stderr=subprocess.PIPE, check=False, text=True).stderr
        crashes = re.findall(r"^crash: (.*)", said, flags=re.MULTILINE)
        done = re.search(r"^Done (\d+) runs", said, flags=re.MULTILINE)
        crashes += [] if done else [f"the process ended: {said.splitlines()[-1]}"]
        for crash in crashes:
            print(f"{name}: {crash}", file=sys.stderr)
        reached = re.findall(r"cov: (\d+)", said) or ["0"]
        rows.append(f"| {name} | {int(done[1]) if done else 0:,} | {reached[0]} | {reached[-1]} | {len(crashes)} |")
        failed |= bool(crashes)
    print("| reader | inputs | branches at first | branches in the end | crashes |\n| --- | --- | --- | --- | --- |")
    print("\n".join(rows))
    sys.exit(failed)


if __name__ == "__main__":
    main()
