"""MGE Workbench's library: intuitive-physics puzzles as fast Gymnasium environments, with dynamics
models and model-guided exploration.

    import gymnasium, mge
    envs = gymnasium.make_vec("mge/task1-v0", num_envs=1024)

    task = mge.Task("task1")
    prior = mge.build_prior(task, mge.Model.shipped_for(task), seed=0)
    actions = prior.sample(stage=0, count=100, seed=0)

    run = mge.train(task, episodes=1000, seed=0)
"""

from mge import figures
from mge._mge import (
    ActionPrior,
    Actor,
    Model,
    State,
    Task,
    __version__,
    build_prior,
    level_names,
    model_names,
    task_names,
    tool_feature_names,
    tool_features,
    tool_numbers,
    tool_types,
)
from mge.environments import PuzzleEnv, PuzzleVectorEnv, register
from mge.library import Rollouts, rollout
from mge.results import Report, Run, Table, read_report, read_results, read_run, write_report
from mge.training import resume, train

__all__ = [
    "ActionPrior",
    "Actor",
    "Model",
    "PuzzleEnv",
    "PuzzleVectorEnv",
    "Report",
    "Rollouts",
    "Run",
    "State",
    "Table",
    "Task",
    "__version__",
    "build_prior",
    "figures",
    "level_names",
    "model_names",
    "read_report",
    "read_results",
    "read_run",
    "register",
    "resume",
    "rollout",
    "task_names",
    "tool_feature_names",
    "tool_features",
    "tool_numbers",
    "tool_types",
    "train",
    "write_report",
]

register()
