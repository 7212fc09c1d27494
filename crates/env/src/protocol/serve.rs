//! The environment as a server for other programs: requests and answers, one line of JSON each.
//!
//! ```text
//! {"command": "spaces"}                   {"observation_space": {"shape": [..], "low": [..], "high": [..]}, "observation_parts": [..], "action_space": {..}}
//! {"command": "reset", "seed": 1}         {"observation": [..], "info": {..}}
//! {"command": "step", "action": [0, 1]}   {"observation": [..], "reward": 0.0, "terminated": false, "truncated": false, "info": {..}}
//! {"command": "close"}                    {"closed": true}
//! ```
//!
//! With an action set, the answer to a reset also has `"tools": [..]`, the catalogue numbers of the tools in the set.
//! A step chooses one by its index in that list, `"tool": 3`; `"tool_space": {"n": 40}` gives their number.
//!
//! A bound of null means unbounded. `observation_parts` lists the parts of an observation. Without a seed, `reset`
//! continues the stream of the last seed. A request that cannot be executed is answered by `{"error": ".."}` and
//! leaves the environment unchanged.

use std::io::{BufRead, Write};

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::lines::{Lines, LinesError, write_line};
use crate::{Action, Choice, Environment, Info, ObservationPart};
use mge_base::streams::Stream;
use mge_physics::ACTION_SET;

/// A request.
#[derive(Debug, Deserialize)]
#[serde(tag = "command", rename_all = "lowercase", deny_unknown_fields)]
enum Request {
    Spaces {},
    Reset {
        #[serde(default)]
        seed: Option<u64>,
    },
    Step {
        action: Action,
        #[serde(default)]
        tool: Option<usize>,
    },
    Close {},
}

/// An answer.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Answer {
    Spaces {
        observation_space: Space,
        observation_parts: Vec<ObservationPart>,
        action_space: Space,
        #[serde(skip_serializing_if = "Option::is_none")]
        tool_space: Option<Discrete>,
    },
    Reset {
        observation: Vec<f32>,
        #[serde(skip_serializing_if = "Option::is_none")]
        tools: Option<Vec<usize>>,
        info: Info,
    },
    Step {
        observation: Vec<f32>,
        reward: f32,
        terminated: bool,
        truncated: bool,
        info: Info,
    },
    Closed {
        closed: bool,
    },
    Error {
        error: String,
    },
}

/// Integers from 0 to n - 1, like Gymnasium's `Discrete`.
#[derive(Debug, Serialize)]
struct Discrete {
    n: usize,
}

/// A box of 32-bit floats, like Gymnasium's `Box`.
#[derive(Debug, Serialize)]
struct Space {
    shape: [usize; 1],
    low: Vec<Option<f32>>,
    high: Vec<Option<f32>>,
}

/// Serves the requests in `input` until a `close` request or the end of the input. `seed` applies until a reset gives
/// another.
///
/// # Errors
/// When the input cannot be read, a line is too long, or an answer cannot be written.
pub fn serve(env: Environment, seed: u64, input: impl BufRead, mut output: impl Write) -> Result<(), LinesError> {
    let mut server = Server { env, rng: Stream::Episode.of(seed), begun: false };
    let mut lines = Lines::new(input, "stdin");
    loop {
        let answer = match lines.read() {
            Ok(None) => break,
            Ok(Some(request)) => server.answer(request),
            Err(LinesError::Syntax(error)) => Answer::Error { error: error.to_string() },
            Err(error) => return Err(error),
        };
        // The client waits for the answer, so it is flushed at once.
        write_line(&mut output, &answer).and_then(|()| output.flush()).map_err(LinesError::Write)?;
        if matches!(answer, Answer::Closed { .. }) {
            break;
        }
    }
    Ok(())
}

struct Server {
    env: Environment,
    rng: ChaCha8Rng,
    begun: bool,
}

impl Server {
    fn answer(&mut self, request: Request) -> Answer {
        match request {
            Request::Spaces {} => self.spaces(),
            Request::Reset { seed } => {
                if let Some(seed) = seed {
                    self.rng = Stream::Episode.of(seed);
                }
                self.begun = true;
                let observation = self.env.reset(&mut self.rng);
                let tools = self.env.action_set().map(|set| set.numbers().collect());
                Answer::Reset { observation, tools, info: Info::of(self.env.snapshot(), None) }
            }
            Request::Step { .. } if !self.begun => {
                Answer::Error { error: "the first episode has not begun: reset the environment first".to_owned() }
            }
            Request::Step { action, tool } => self.step(action, tool).unwrap_or_else(|error| Answer::Error { error }),
            Request::Close {} => Answer::Closed { closed: true },
        }
    }

    fn step(&mut self, place: Action, tool: Option<usize>) -> Result<Answer, String> {
        let tool = match (self.env.action_set(), tool) {
            (None, None | Some(0)) => 0,
            (None, Some(_)) => return Err("tool: the agent has one tool only: leave it out".to_owned()),
            (Some(set), Some(tool)) if tool < set.len() => tool,
            (Some(set), _) => return Err(format!("tool: must be an index from 0 to {}", set.len().saturating_sub(1))),
        };
        let step = self.env.step(Choice { tool, place }).map_err(|over| over.to_string())?;
        Ok(Answer::Step {
            observation: step.observation,
            reward: step.reward,
            terminated: step.terminated,
            truncated: step.truncated,
            info: Info::of(self.env.snapshot(), Some(step.placement)),
        })
    }

    /// Infinite bounds are given as null.
    fn spaces(&self) -> Answer {
        let finite = |bounds: Vec<f32>| bounds.into_iter().map(|bound| bound.is_finite().then_some(bound)).collect();
        let [low, high]: [Vec<Option<f32>>; 2] = self.env.observation_bounds().map(finite);
        Answer::Spaces {
            observation_space: Space { shape: [low.len()], low, high },
            observation_parts: self.env.observation_parts(),
            action_space: Space { shape: [2], low: vec![Some(-1.0); 2], high: vec![Some(1.0); 2] },
            tool_space: self.env.split().map(|_| Discrete { n: ACTION_SET }),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use serde_json::{Value, json};

    use super::*;
    use crate::observation_len;
    use mge_physics::ToolSplit;

    fn talk(requests: &str) -> Vec<Value> {
        let task = Arc::new(mge_task::load("task1").unwrap());
        talk_to(Environment::new(task), requests)
    }

    fn talk_to(env: Environment, requests: &str) -> Vec<Value> {
        let mut output = Vec::new();
        serve(env, 0, requests.as_bytes(), &mut output).unwrap();
        String::from_utf8(output).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }

    #[test]
    fn an_episode_equals_that_of_the_environment() {
        let answers = talk(
            "{\"command\":\"spaces\"}\n{\"command\":\"reset\",\"seed\":3}\n{\"command\":\"step\",\"action\":[0.5,-0.5]}\n\n{\"command\":\"close\"}\n{\"command\":\"spaces\"}\n",
        );
        let task = Arc::new(mge_task::load("task1").unwrap());
        let mut env = Environment::new(task.clone());
        let start = env.reset(&mut Stream::Episode.of(3));
        let step = env.step([0.5, -0.5]).unwrap();
        assert_eq!(answers.len(), 4, "nothing is answered after close");
        assert_eq!(answers[0]["observation_space"]["shape"], json!([observation_len(&task)]));
        assert_eq!(answers[0]["observation_space"]["low"].as_array().unwrap().len(), observation_len(&task));
        assert_eq!(answers[0]["action_space"]["high"], json!([1.0, 1.0]));
        let floats = |value: &Value| serde_json::from_value::<Vec<f32>>(value.clone()).unwrap();
        assert_eq!(floats(&answers[1]["observation"]), start);
        assert_eq!(floats(&answers[2]["observation"]), step.observation);
        assert_eq!(answers[2]["reward"].as_f64().unwrap() as f32, step.reward);
        assert_eq!(answers[2]["terminated"], json!(step.terminated));
        assert_eq!(answers[3], json!({"closed": true}));
    }

    #[test]
    fn with_tools_a_step_chooses_from_the_action_set_of_the_reset() {
        let task = Arc::new(mge_task::load("create/Push").unwrap());
        let mut env = Environment::new(task.clone()).with_tools(ToolSplit::Test);
        let answers = talk_to(
            env.clone(),
            "{\"command\":\"spaces\"}\n{\"command\":\"reset\",\"seed\":3}\n\
             {\"command\":\"step\",\"tool\":5,\"action\":[-0.5,0.5]}\n{\"command\":\"step\",\"action\":[0,0]}\n\
             {\"command\":\"step\",\"tool\":40,\"action\":[0,0]}\n{\"command\":\"reset\"}\n",
        );
        let observation = env.reset(&mut Stream::Episode.of(3));
        let numbers: Vec<usize> = env.action_set().unwrap().numbers().collect();
        let step = env.step(Choice { tool: 5, place: [-0.5, 0.5] }).unwrap();
        assert_eq!(answers[0]["tool_space"], json!({"n": 40}));
        assert_eq!(answers[0]["observation_space"]["shape"], json!([observation.len()]));
        let parts = answers[0]["observation_parts"].as_array().unwrap();
        let length =
            |part: &Value| -> u64 { part["shape"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).product() };
        assert_eq!(parts.iter().map(length).sum::<u64>(), observation.len() as u64);
        assert_eq!(answers[1]["tools"], json!(numbers));
        assert_eq!(answers[2]["info"]["placement"], json!(step.placement));
        assert_eq!(serde_json::from_value::<Vec<f32>>(answers[2]["observation"].clone()).unwrap(), step.observation);
        for refused in &answers[3..5] {
            assert_eq!(refused["error"], "tool: must be an index from 0 to 39");
        }
        assert_ne!(answers[5]["tools"], answers[1]["tools"]);
    }

    #[test]
    fn a_seed_fixes_the_episode_and_without_one_the_stream_continues() {
        let mut task = mge_task::load("task1").unwrap();
        task.rules.start_noise = 1.0;
        let reset = |requests: &str| {
            let mut output = Vec::new();
            serve(Environment::new(Arc::new(task.clone())), 7, requests.as_bytes(), &mut output).unwrap();
            String::from_utf8(output).unwrap().lines().map(str::to_owned).collect::<Vec<_>>()
        };
        let seeded =
            reset("{\"command\":\"reset\",\"seed\":7}\n{\"command\":\"reset\",\"seed\":7}\n{\"command\":\"reset\"}");
        assert_eq!(seeded[0], seeded[1]);
        assert_ne!(seeded[1], seeded[2]);
        assert_eq!(reset("{\"command\":\"reset\"}")[0], seeded[0]);
    }

    #[test]
    fn mistakes_are_answered_and_change_nothing() {
        for (line, expected) in [
            ("{\"command\":\"rest\"}", "unknown variant `rest`, expected one of `spaces`, `reset`"),
            ("not json", "stdin:1:"),
            ("{\"command\":\"step\",\"action\":[0.1]}", "invalid length 1"),
            ("{\"command\":\"step\",\"action\":[NaN,0]}", "stdin:1:"),
            ("{\"command\":\"step\",\"action\":[0,0]}", "reset the environment first"),
            ("{\"command\":\"reset\",\"sed\":1}", "unknown field `sed`"),
            ("\u{fffd}", "stdin:1:"),
        ] {
            let answers = talk(&format!("{line}\n{{\"command\":\"reset\"}}\n"));
            let error = answers[0]["error"].as_str().unwrap_or_else(|| panic!("{line}: {}", answers[0]));
            assert!(error.contains(expected), "{line}: {error}");
            assert!(answers[1]["observation"].is_array());
        }
        let step = "{\"command\":\"step\",\"action\":[1,1]}\n";
        let answers = talk(&format!("{{\"command\":\"reset\"}}\n{}", step.repeat(60)));
        let over = answers.iter().position(|answer| answer["error"].is_string()).unwrap();
        assert!(answers[over - 1]["terminated"] == json!(true) || answers[over - 1]["truncated"] == json!(true));
        assert!(answers[over]["error"].as_str().unwrap().contains("the episode is over"));
    }
}
