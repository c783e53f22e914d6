"""Typed settings: pure data, which imports nothing but the standard library and the user's error."""

from artigrasp.config.action import ActionConfig, ResidualConfig, SynergyConfig
from artigrasp.config.curriculum import CurriculumConfig
from artigrasp.config.extraction import ExtractionConfig
from artigrasp.config.learning import PPOConfig
from artigrasp.config.parse import from_dict, to_dict
from artigrasp.config.phase import PhaseConfig
from artigrasp.config.physics import PDGain, PDGains, PhysicsConfig
from artigrasp.config.refinement import RefinementConfig
from artigrasp.config.replay import ReplayConfig
from artigrasp.config.reset import ResetConfig
from artigrasp.config.reward import RewardConfig
from artigrasp.config.simulator import SimulatorConfig
from artigrasp.config.stage import StageConfig
from artigrasp.config.synthesis import SynthesisConfig
from artigrasp.config.task import TaskConfig
from artigrasp.config.task_file import read_task, write_task

__all__ = [
    "ActionConfig",
    "CurriculumConfig",
    "ExtractionConfig",
    "PDGain",
    "PDGains",
    "PPOConfig",
    "PhaseConfig",
    "PhysicsConfig",
    "RefinementConfig",
    "ReplayConfig",
    "ResetConfig",
    "ResidualConfig",
    "RewardConfig",
    "SimulatorConfig",
    "StageConfig",
    "SynergyConfig",
    "SynthesisConfig",
    "TaskConfig",
    "from_dict",
    "read_task",
    "to_dict",
    "write_task",
]
