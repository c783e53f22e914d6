"""MuJoCo's warnings, counted by the thread that steps the world."""

import logging
import threading

import mujoco

logger = logging.getLogger(__name__)

CAPACITY_WARNINGS = (mujoco.mjtWarning.mjWARN_CONTACTFULL.value, mujoco.mjtWarning.mjWARN_CNSTRFULL.value)
"""Kinds of ``MjData.warning`` that tell of dropped contacts or constraints."""

_of_thread = threading.local()


def warning_count() -> int:
    """Warnings that MuJoCo gave in the calling thread so far."""
    count: int = getattr(_of_thread, "count", 0)
    return count


def _count(message: str) -> None:
    logger.debug(message)
    _of_thread.count = warning_count() + 1


# Without a handler MuJoCo writes its warnings to a file in whatever folder the user is in. Worlds that failed are
# marked in the state, so the text is only for those who debug.
mujoco.set_mju_user_warning(_count)
