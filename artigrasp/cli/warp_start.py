"""Starting what computes, without the notes that mean nothing to who runs a verb."""

import contextlib
import logging
import os
import sys
from collections.abc import Iterator
from pathlib import Path

logger = logging.getLogger(__name__)


def start_warp() -> None:
    """Initialise Warp quietly; to be called by a verb before it uses kernels, and before it imports PyTorch."""
    # PyTorch's threads would spin while they wait for each other: where anything else wants a core, that makes two of
    # them tens of times slower than one.
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")

    import warp

    warp.config.log_level = warp.LOG_WARNING
    # Its native library reports a missing CUDA driver, which is no news on a machine without a GPU.
    with _errors_dropped():
        warp.init()
    if not list(Path(warp.config.kernel_cache_dir).glob("*artigrasp*")):
        logger.info("Compiling kernels, once: this takes a minute or two.")


@contextlib.contextmanager
def _errors_dropped() -> Iterator[None]:
    """Drop what native code writes to standard error; exceptions still come through."""
    sys.stderr.flush()
    kept = os.dup(2)
    try:
        with Path(os.devnull).open("wb") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
