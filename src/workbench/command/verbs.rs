//! The verbs of the command language.

/// A verb of the command language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verb {
    /// The words it begins with.
    pub name: &'static str,
    /// What follows them.
    pub arguments: &'static str,
    /// What it does, in one line.
    pub help: &'static str,
}

impl Verb {
    /// How it is written: its words and what follows them.
    pub fn usage(&self) -> String {
        format!("{} {}", self.name, self.arguments).trim_end().to_owned()
    }
}

/// Every verb of the command language.
pub fn verbs() -> impl Iterator<Item = &'static Verb> {
    VERBS.iter()
}

const fn verb(name: &'static str, arguments: &'static str, help: &'static str) -> Verb {
    Verb { name, arguments, help }
}

#[rustfmt::skip]
const VERBS: &[Verb] = &[
    verb("train", "[FOLDER] [until N]", "start a run with the settings shown, or queue it; `until` pauses it there"),
    verb("pause", "", "pause the training; the key also goes on with it"),
    verb("stop", "", "end the training; a checkpoint is kept"),
    verb("epsilon", "SPEC", "set the epsilon schedule; a running training takes it at its next episode"),
    verb("clusters", "[FILE]", "compute the action clusters of the task anew, and save them to a file"),
    verb("guide", "", "give the action clusters to the running training"),
    verb("method", "NAME", "choose the method of the next run"),
    verb("task", "NAME|FILE", "open a shipped task or a task file"),
    verb("model", "learned|true|uniform|NAME|FILE", "choose what predicts the rollouts behind the clusters"),
    verb("seed", "N", "set the master seed of the next run"),
    verb("episodes", "N", "set the number of episodes of the next run"),
    verb("undo", "", "take the latest edit back"),
    verb("redo", "", "make the undone edit again"),
    verb("save", "[FILE]", "save the edited task"),
    verb("quit", "", "leave the workbench; a running training is checkpointed first"),
    verb("subgoal add", "X Y [RADIUS]", "add a subgoal after the others"),
    verb("tool add", "TYPE X Y [SIZE]", "add a static tool: bucket, square, box, wall or floor"),
    verb("propose", "[N]", "let the model propose subgoals, N or as many as the task has"),
    verb("proposal accept", "[N]", "accept one proposed subgoal, or all in place of the task's own"),
    verb("proposal delete", "[N]", "reject one proposed subgoal, or all of them"),
    verb("place", "X Y", "place the tool and let the world run for one action"),
    verb("reset", "", "start the episode of hand play again"),
    verb("evaluate", "", "play the greedy policy of the watched run"),
    verb("continue", "[FOLDER]", "go on with a run from its checkpoint"),
    verb("open", "FOLDER", "open a run that is on disk"),
    verb("delete", "FOLDER", "delete a run from the disk, with all its files; the key asks first"),
    verb("model train", "TYPE,... FILE [EPOCHS]", "train a dynamics model of these tool types, in the background"),
    verb("model evaluate", "FILE|NAME", "measure a dynamics model on fresh launches and unseen scenes"),
    verb("model stop", "", "end the training or evaluation of a model; nothing of it is kept"),

    verb("subgoal move", "N X Y", "move subgoal N (from 1) to normalised X Y"),
    verb("subgoal size", "N RADIUS", "resize a subgoal, in units"),
    verb("subgoal swap", "N M", "exchange two subgoals in the order"),
    verb("subgoal delete", "N", "delete a subgoal"),
    verb("goal move", "X Y", "move the goal"),
    verb("goal size", "RADIUS", "resize the goal, in units"),
    verb("ball move", "X Y", "move the ball's start"),
    verb("tool move", "N X Y", "move a static tool (from 1)"),
    verb("tool size", "N SIZE", "resize a static tool, in units"),
    verb("tool delete", "N", "delete a static tool"),
    verb("proposal move", "N X Y", "move proposed subgoal N (from 1)"),
    verb("proposal size", "N RADIUS", "resize a proposed subgoal, in units"),
    verb("set", "KEY VALUE", "set any setting by its JSON path, such as ddpg.critic_learning_rate 1e-4"),
    verb("out", "FOLDER", "choose the folder for runs"),
    verb("resume", "[until N]", "go on with the paused run"),
    verb("wait", "", "wait until the run pauses or ends, or the clusters are there"),
    verb("watch", "N", "act on run N of the session, counted from 1 in the order they began"),
    verb("figure", "KIND FILE [DPI]", "export a figure: scene, clusters, learning, dashboard or episode"),
    verb("expect", "WHAT OP VALUE", "fail the script unless it holds, such as expect success >= 0.5"),
    verb("record", "FILE", "save the session so far as a script"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verbs_are_unique_and_explained() {
        for (index, verb) in VERBS.iter().enumerate() {
            assert!(VERBS[index + 1..].iter().all(|other| other.name != verb.name), "{}", verb.name);
            assert!(!verb.help.is_empty() && verb.help.len() <= 80, "{}", verb.name);
        }
    }
}
