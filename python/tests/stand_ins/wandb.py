"""Stands in for Weights & Biases: prints what it is given."""

from contextlib import contextmanager


@contextmanager
def init(project, config):
    class Run:
        def log(self, values, step):
            print(f"{project} {step} {sorted(values)}")

    yield Run()
