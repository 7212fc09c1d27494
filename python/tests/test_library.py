"""The rest of the library: tasks, models, priors, actors, results, figures."""

import json
import pickle
import subprocess

import numpy as np
import pytest

import mge


def test_tasks(tmp_path):
    task = mge.Task("task1")
    assert task == pickle.loads(pickle.dumps(task)) != mge.Task("task2")
    assert task.name == "task1" and task.description and task.max_actions > 0
    assert task.stages.shape == (task.observation_len - 160, 3)
    path = tmp_path / "copy.json"
    task.save(path)
    assert mge.Task(path) == mge.Task.parse(path.read_text()) == task
    with pytest.raises(ValueError, match="x.json:1"):
        mge.Task.parse("{", "x.json")
    with pytest.raises(ValueError, match="rules.max_actions"):
        mge.Task.parse(task.to_json().replace('"max_actions": ', '"max_actions": -'))


def test_a_prediction_is_a_step_of_a_rollout():
    task = mge.Task("task1")
    model = mge.Model.shipped_for(task)
    assert model.name == "bucket-box" and model.interval == 5 and model.tools == ["bucket", "box"]
    assert json.loads(model.provenance)["epoch"] > 0
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (50, 3, 2))
    rolled = mge.rollout(task, model, actions)
    assert rolled.hit.shape == (50,) and rolled.placed.shape == (50, 3) and rolled.balls.shape == (50, 3, 5)
    start = np.repeat(mge.PuzzleEnv(task).get_state().balls, 50, axis=0)
    places = np.where(rolled.placed[:, :1], actions[:, 0], np.nan)[:, None]
    once = model.predict(task, start, places)
    np.testing.assert_array_equal(once[:, :2], rolled.path[:, 1])
    ball = start
    for _ in range(8):
        ball = model.predict(task, ball, places)
    # The library keeps balls in units between predictions, so repeated single predictions differ by rounding.
    at_once = model.predict(task, start, places, steps=8)
    np.testing.assert_allclose(ball, at_once, atol=1e-2)
    whole = rolled.length > 1
    np.testing.assert_array_equal(at_once[whole], rolled.balls[whole, 0])
    assert np.isnan(rolled.path[rolled.length < 3][:, -1]).all()


def test_rapier_is_a_model():
    task = mge.Task("task1")
    actions = np.random.default_rng(1).uniform(-1, 1, (200, 6, 2))
    other, true = (mge.rollout(task, model, actions) for model in ("rapier", "physics"))
    apart = np.linalg.norm(other.balls[:, :, :2] - true.balls[:, :, :2], axis=2)
    # Nearly the same laws, but a different solver: trajectories differ after contacts.
    assert np.nanmedian(apart) < 0.01 and np.nanmax(apart) > 0.05
    prior = mge.build_prior(task, "rapier", seed=1)
    assert prior.model == "rapier" and json.loads(prior.to_json())["stages"][0]["model_hits"] > 0


def test_the_true_physics_is_a_model():
    task = mge.Task("task1")
    env = mge.PuzzleEnv(task)
    env.reset(seed=0)
    env.step(np.array([0.3, 0.2]))
    actions = np.random.default_rng(1).uniform(-1, 1, (20, 4, 2)).astype(np.float32)
    rolled = mge.rollout(task, "physics", actions, env.get_state())
    vector = mge.PuzzleVectorEnv(task, 20, "Disabled")
    vector.set_state(env.get_state())
    vector.step(actions[:, 0])
    np.testing.assert_array_equal(vector.get_state().balls, rolled.balls[:, 0])


def test_invalid_models_and_actions_are_reported():
    task = mge.Task("task1")
    with pytest.raises(TypeError, match="is not a model"):
        mge.rollout(task, object(), np.zeros((1, 1, 2)))
    with pytest.raises(ValueError, match="never trained"):
        mge.rollout(task, "square-floor", np.zeros((1, 1, 2)))
    with pytest.raises(FileNotFoundError):
        mge.Model("nowhere.safetensors")
    for actions, error, message in [
        (np.zeros((1, 2)), ValueError, r"`actions` has the shape \[1, 2\], and should have \[n, length, 2\]"),
        (np.zeros((1, 1, 3)), ValueError, "shape"),
        (np.full((1, 1, 2), np.nan), ValueError, "NaN at index"),
        (np.zeros((1, 1, 2), complex), TypeError, "complex128, and should be numbers"),
        ("left", TypeError, "numbers"),
        (None, TypeError, "numbers"),
    ]:
        with pytest.raises(error, match=message):
            mge.rollout(task, "physics", actions)
    model = mge.Model.shipped_for(task)
    with pytest.raises(ValueError, match=r"\[n, 5\]"):
        model.predict(task, np.zeros((3, 4)))
    with pytest.raises(ValueError, match="NaN at index"):
        model.predict(task, np.full((3, 5), np.nan))
    with pytest.raises(ValueError, match=r"\[3, m, 2\]"):
        model.predict(task, np.zeros((3, 5)), np.zeros((2, 1, 2)))


def test_a_prior_has_clusters_and_samples_from_them():
    task = mge.Task("task1")
    prior = mge.build_prior(task, mge.Model.shipped_for(task), seed=0)
    again = mge.build_prior(task, "bucket-box", seed=0)
    assert prior.to_json() == again.to_json() == mge.ActionPrior.parse(prior.to_json(), task).to_json()
    stage, clusters = json.loads(prior.to_json())["stages"][0], prior.clusters(0)
    assert clusters["mean"].shape == clusters["std"].shape == (len(clusters["weight"]), 2)
    assert clusters["count"].sum() == len(stage["actions"]) and abs(clusters["weight"].sum() - 1) < 1e-6
    assert stage["model_rollouts"] == 600 and 0 < stage["model_hits"] < 600
    sampled = prior.sample(0, 500, seed=1)
    assert sampled.shape == (500, 2) and np.abs(sampled).max() <= 1
    assert (sampled == prior.sample(0, 500, seed=1)).all() and (sampled != prior.sample(0, 500, seed=2)).any()
    with pytest.raises(IndexError, match="no stage 9"):
        prior.clusters(9)
    with pytest.raises(ValueError, match="horizon"):
        mge.build_prior(task, "physics", horizon=0)


def test_clusters_are_those_of_the_program(program, tmp_path):
    subprocess.run(
        [program, "clusters", "task1", "--model", "learned", "--seed", "5", "--out", str(tmp_path / "c.json")],
        check=True,
        capture_output=True,
    )
    task = mge.Task("task1")
    written = json.loads((tmp_path / "c.json").read_text())
    ours = json.loads(mge.build_prior(task, mge.Model.shipped_for(task), seed=5).to_json())
    assert written["stages"] == ours["stages"]


@pytest.mark.parametrize("which", ["run", "plain"])
def test_an_actor_acts_as_the_program_does(program, which, request):
    run = request.getfixturevalue(which)
    actor = mge.Actor(run)
    command = [program, "evaluate", str(run), "--episodes", "3", "--observations"]
    episodes = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    for line in episodes.splitlines():
        episode = json.loads(line)
        observations = np.array(episode["observations"], np.float32)
        np.testing.assert_array_equal(actor.act(observations), np.array(episode["actions"], np.float32))
        assert actor.values(observations, actor.act(observations)).shape == (len(observations),)
        np.testing.assert_array_equal(actor.act(observations.astype(np.float64).tolist()), actor.act(observations))
    with pytest.raises(ValueError, match="162"):
        actor.act(np.zeros((1, 3), np.float32))


def test_a_run_is_a_table(run):
    import csv

    read = mge.read_run(run)
    assert read.state == "finished" and read.config["task"]["name"] == "task1"
    with open(run / "metrics.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(read.episodes) and len(read.episodes["episode"]) == 40
    assert read.episodes["goal"].dtype == bool and read.episodes["steps"].dtype == np.int64
    assert read.episodes["critic_loss"].dtype == np.float64 and np.isfinite(read.episodes["critic_loss"]).all()
    assert [float(row["return"]) for row in rows] == pytest.approx(read.episodes["return"].tolist())
    assert [row["end"] for row in rows] == read.episodes["end"]
    assert read.evaluations["episode"].tolist() == [10, 20, 30, 40]
    assert isinstance(mge.ActionPrior.of_run(run), mge.ActionPrior)


def test_a_run_without_episodes_has_empty_columns(run, tmp_path):
    (tmp_path / "config.json").write_bytes((run / "config.json").read_bytes())
    whole, empty = mge.read_run(run), mge.read_run(tmp_path)
    assert empty.state == "not started"
    for full, none in [(whole.episodes, empty.episodes), (whole.evaluations, empty.evaluations)]:
        assert list(none) == list(full)
        for name, column in none.items():
            assert len(column) == 0 and getattr(column, "dtype", list) == getattr(full[name], "dtype", list), name


def test_missing_measurements_are_nan(plain):
    read = mge.read_run(plain)
    assert read.episodes["critic_loss"].dtype == np.float64 and np.isnan(read.episodes["critic_loss"][0])


def test_results_and_reports_are_tables(run, tmp_path):
    results = mge.read_results(run.parent)
    assert results["seed"].tolist() == [0, 1] and results["task"] == ["task1", "task1"]
    assert set(results["state"]) == {"finished"} and len(set(results["label"])) == 1
    report = mge.write_report([run.parent], tmp_path / "report", resamples=50)
    assert report["learning"] and (tmp_path / "report" / "figures" / "learning.svg").exists()
    table = mge.read_report(tmp_path / "report", "learning")
    assert table["seed"].dtype == np.int64 and table["seed"].tolist() == [0, 1]
    with pytest.raises(ValueError, match="no table `nothing`: use one of"):
        mge.read_report(tmp_path / "report", "nothing")
    with pytest.raises(ValueError, match="confidence"):
        mge.write_report(run.parent, tmp_path, confidence=1.5)


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_tables_become_frames(run, library):
    table = mge.read_run(run).episodes
    frame_of = pytest.importorskip(library).DataFrame
    frame = frame_of(table)
    assert frame.shape == (40, len(table)) and list(frame.columns) == list(table)
    assert frame_of(mge.read_results(run)).shape[0] == 1


def test_figures(run, tmp_path):
    task = mge.Task("task1")
    drawn = [
        mge.figures.tasks(task, mge.Task("task2")),
        mge.figures.clusters(task, mge.ActionPrior.of_run(run)),
        mge.figures.learning_curves(run.parent),
        mge.figures.learning_curves([run], steps=True),
        mge.figures.methods(run.parent),
        mge.figures.scene(mge.PuzzleEnv(task).get_state()),
    ]
    for figure in drawn:
        assert figure.svg().lstrip().startswith("<svg") or "<svg" in figure.svg()[:200]
        assert "," in figure.csv()
    for ending in ("png", "svg"):
        drawn[0].save(tmp_path / f"tasks.{ending}")
        assert (tmp_path / f"tasks.{ending}").stat().st_size > 1000
    with pytest.raises(ValueError, match="png"):
        drawn[0].save(tmp_path / "tasks.jpg")
    with pytest.raises(ValueError, match="no runs|holds no"):
        mge.figures.methods(tmp_path)
