"""Searches settings with Optuna, which ends trials that fall behind."""

import sys

import mge
import optuna

episodes = int(sys.argv[1]) if len(sys.argv) > 1 else 1000


def objective(trial):
    def callback(event):
        if event["type"] == "evaluated":
            trial.report(event["success"], event["episode"])
            if trial.should_prune():
                raise optuna.TrialPruned  # ends the training; its run stays, and could be resumed

    ddpg = {
        "gamma": trial.suggest_float("gamma", 0.9, 0.99),
        "critic_learning_rate": trial.suggest_float("critic_learning_rate", 1e-4, 1e-2, log=True),
    }
    evaluation = {"every": max(1, episodes // 10), "episodes": 20}
    run = mge.train("task1", callback=callback, episodes=episodes, start_noise=0.05, ddpg=ddpg, evaluation=evaluation)
    return run.episodes["rolling_success"].mean()


study = optuna.create_study(direction="maximize")
study.optimize(objective, n_trials=20)
print(f"the best mean success is {study.best_value:.2f}, with {study.best_params}")
