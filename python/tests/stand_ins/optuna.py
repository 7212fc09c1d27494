"""Stands in for Optuna: two trials, of which the second is pruned at its first report."""


class TrialPruned(Exception):
    pass


class Trial:
    def __init__(self, number):
        self.number, self.reports = number, []

    def suggest_float(self, name, low, high, log=False):
        return (low * high) ** 0.5

    def report(self, value, step):
        self.reports.append((step, value))

    def should_prune(self):
        return self.number == 1


class Study:
    def optimize(self, objective, n_trials):
        values = []
        for number in range(2):
            try:
                values.append(objective(Trial(number)))
            except TrialPruned:
                print(f"pruned trial {number}")
        self.best_value, self.best_params = max(values), {"gamma": 0.95}


def create_study(direction):
    return Study()
