"""Two simulated hands grasp, carry and open hinged objects: ArtiGrasp on Warp and Newton.

The names below are the stable interface. They are imported on first use, so that ``import artigrasp`` stays light::

    import artigrasp
    references = artigrasp.load_references("lidded-box").select(split="test", kind="articulate", indices=0)
    controller = artigrasp.load_controller("pd-ik", task=artigrasp.get_task("right-fixed"))
    motion = artigrasp.generate(controller, references, target_angle=1.0)
    artigrasp.export_usd(motion, "motion.usdc")
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from artigrasp.assets.hand import load_hand
    from artigrasp.assets.object import load_object
    from artigrasp.config import SimulatorConfig
    from artigrasp.controllers.library import load_controller
    from artigrasp.environment.make import make_environment
    from artigrasp.errors import UserError
    from artigrasp.evaluation.evaluate import evaluate
    from artigrasp.export.usd import export_usd
    from artigrasp.motion.file import load_motion, save_motion
    from artigrasp.motion.generate import generate
    from artigrasp.references.reference import load_references
    from artigrasp.tasks import get_task

__all__ = [
    "SimulatorConfig",
    "UserError",
    "evaluate",
    "export_usd",
    "generate",
    "get_task",
    "load_controller",
    "load_hand",
    "load_motion",
    "load_object",
    "load_references",
    "make_environment",
    "save_motion",
]

_HOMES = {
    "SimulatorConfig": "artigrasp.config",
    "UserError": "artigrasp.errors",
    "evaluate": "artigrasp.evaluation.evaluate",
    "export_usd": "artigrasp.export.usd",
    "generate": "artigrasp.motion.generate",
    "get_task": "artigrasp.tasks",
    "load_controller": "artigrasp.controllers.library",
    "load_hand": "artigrasp.assets.hand",
    "load_motion": "artigrasp.motion.file",
    "load_object": "artigrasp.assets.object",
    "load_references": "artigrasp.references.reference",
    "make_environment": "artigrasp.environment.make",
    "save_motion": "artigrasp.motion.file",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)
