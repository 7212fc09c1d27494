"""Training on a thread in Rust: `train` and `resume`."""

import numpy as np
import pytest
from test_interruption import interrupted

import mge

SMALL = {
    "ddpg": {"hidden": 16, "warmup_steps": 50},
    "model": "true",
    "guidance": {"model_rollouts": 50},
    "practice": {"rollouts": 20},
    "evaluation": {"every": 10},
    "progress": False,
}


def check_same(one, other):
    for name in one:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)


def test_an_interrupted_training_continues_to_the_results_of_a_whole_one(tmp_path):
    seen = []
    whole = mge.train("task1", tmp_path / "whole", callback=seen.append, seed=np.int64(3), episodes=30, **SMALL)
    assert whole.state == "finished" and whole.path == str(tmp_path / "whole") and whole.config["seed"] == 3
    episodes = [event for event in seen if event["type"] == "episode_finished"]
    assert [event["episode"] for event in episodes] == [*range(1, 31)]
    np.testing.assert_array_equal([event["return"] for event in episodes], whole.episodes["return"])
    assert [event["episode"] for event in seen if event["type"] == "evaluated"] == [10, 20, 30]

    def fails(event):
        if event.get("episode") == 5:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        mge.train("task1", tmp_path / "parts", callback=fails, seed=3, episodes=30, **SMALL)
    part = mge.read_run(tmp_path / "parts")
    assert part.state in ("stopped", "finished") and len(part.episodes["return"]) >= 5
    check_same(mge.resume(part.path, progress=False).episodes, whole.episodes)
    longer = mge.resume(part.path, 40, progress=False)
    assert longer.config["episodes"] == len(longer.episodes["goal"]) == 40
    # A finished run is left as it is.
    check_same(mge.resume(part.path, progress=False).episodes, longer.episodes)


@pytest.mark.parametrize("model", ["true", "trained"])
def test_ctrl_c_ends_a_training_with_a_checkpoint(tmp_path, model):
    # It takes a fifth of a second; more where other programs keep the processor busy.
    call = lambda: mge.train("task1", tmp_path / "run", episodes=100_000, model=model, progress=False)
    assert interrupted(call, after=1.5) < 3
    assert mge.read_run(tmp_path / "run").state == "stopped"


def test_progress_is_a_line_a_minute_without_a_terminal(tmp_path, capsys):
    mge.train("task1", tmp_path / "run", episodes=20, **{**SMALL, "progress": True})
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) <= 2 and lines[-1].startswith("20/20 episodes, success ")


def test_settings_without_effect_are_told_and_wrong_ones_refused(tmp_path):
    with pytest.warns(UserWarning, match="`epsilon` has no effect") as warned:
        mge.train("task1", tmp_path / "run", method="ddpg", epsilon=0.5, episodes=1, progress=False)
    assert warned[0].filename == __file__
    other = mge.train("task1", tmp_path / "other", config="paper", start_noise=0.125, episodes=1, **SMALL)
    assert other.config["method"] == "ddpg-mge" and other.config["start_noise"] == 0.125
    for settings, error, message in [
        ({"ddpg": {"gama": 1}}, ValueError, "did you mean `ddpg.gamma`"),
        ({"episodes": "many"}, ValueError, "it is a whole number from 1 to 10000000"),
        ({"config": "papr"}, FileNotFoundError, "did you mean `paper`"),
        ({"seed": object()}, TypeError, "`seed` is of type object"),
        ({"out": other.path}, ValueError, "already holds a run"),
    ]:
        with pytest.raises(error, match=message):
            mge.train("task1", **{"out": tmp_path / "wrong", **settings})
    with pytest.raises(ValueError, match="cannot become fewer"):
        mge.resume(other.path, 0)
    with pytest.raises(ValueError, match="does not exist"):
        mge.resume(tmp_path / "nothing")
