//! What was done in a session, as a script that does the same without a terminal.
//!
//! What a person does to a training while it runs takes effect at some episode. The
//! journal keeps that episode, and the script pauses the training there, so that it
//! gives the same run and the same figures, byte for byte.

use super::command::Command;

/// The commands carried out so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Journal {
    entries: Vec<Entry>,
}

#[derive(Debug, Clone)]
struct Entry {
    command: Command,
    /// Episodes the running training had finished when it took effect.
    at: Option<u32>,
}

impl Journal {
    /// Notes a command that does not concern a running training.
    pub fn note(&mut self, command: Command) {
        self.entries.push(Entry { command, at: None });
    }

    /// Notes a command that took effect when the running training had finished so many
    /// episodes. Effects are heard of late: the entry goes before those of later episodes.
    pub fn note_at(&mut self, command: Command, episode: u32) {
        let run = self.entries.iter().rposition(|entry| is_start(&entry.command)).map_or(0, |start| start + 1);
        let later = self.entries[run..].iter().position(|entry| entry.at.is_some_and(|at| at > episode));
        let place = later.map_or(self.entries.len(), |offset| run + offset);
        self.entries.insert(place, Entry { command, at: Some(episode) });
    }

    /// The script.
    pub fn to_script(&self) -> String {
        let mut lines = vec!["# A recorded session: play it with `mge script FILE`.".to_owned()];
        let mut training = false;
        for (index, entry) in self.entries.iter().enumerate() {
            let next_stop = || self.next_stop(index + 1);
            match &entry.command {
                Command::Train { folder, .. } => {
                    let until = next_stop();
                    lines.push(Command::Train { folder: folder.clone(), until }.to_string());
                    lines.push(Command::Wait.to_string());
                    training = until.is_some();
                }
                Command::Stop => {
                    lines.extend([Command::Stop.to_string(), Command::Wait.to_string()]);
                    training = false;
                }
                command => {
                    lines.push(command.to_string());
                    if matches!(command, Command::Clusters(None)) {
                        lines.push(Command::Wait.to_string());
                    }
                    let until = next_stop();
                    if training && entry.at.is_some() && until != entry.at {
                        lines.push(Command::Resume { until }.to_string());
                        lines.push(Command::Wait.to_string());
                        training = until.is_some();
                    }
                }
            }
        }
        lines.join("\n") + "\n"
    }

    /// The episode at which the training is next interfered with, from an entry on.
    fn next_stop(&self, from: usize) -> Option<u32> {
        self.entries[from..].iter().take_while(|entry| !is_start(&entry.command)).find_map(|entry| entry.at)
    }
}

fn is_start(command: &Command) -> bool {
    matches!(command, Command::Train { .. } | Command::Continue(_))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command(line: &str) -> Command {
        Command::parse(line).unwrap().unwrap()
    }

    fn check(entries: &[(&str, Option<u32>)], script: &[&str]) {
        let mut journal = Journal::default();
        for (line, at) in entries {
            match at {
                Some(episode) => journal.note_at(command(line), *episode),
                None => journal.note(command(line)),
            }
        }
        let text = journal.to_script();
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(lines, script);
    }

    #[test]
    fn commands_outside_of_a_training_stand_as_they_are() {
        check(
            &[("task task2", None), ("clusters", None), ("figure clusters a.png", None)],
            &["task task2", "clusters", "wait", "figure clusters a.png"],
        );
    }

    #[test]
    fn a_training_is_paused_where_it_was_interfered_with() {
        check(
            &[
                ("train a", None),
                ("figure dashboard b.png", Some(30)),
                ("epsilon 0.1", Some(20)),
                ("goal size 5", None),
                ("figure learning c.png", None),
            ],
            &[
                "train a until 20",
                "wait",
                "epsilon 0.1",
                "resume until 30",
                "wait",
                "figure dashboard b.png",
                "resume",
                "wait",
                "goal size 5",
                "figure learning c.png",
            ],
        );
    }

    #[test]
    fn two_changes_at_one_episode_need_one_pause() {
        check(
            &[("train", None), ("epsilon 0.2", Some(5)), ("stop", Some(5)), ("train", None)],
            &["train until 5", "wait", "epsilon 0.2", "stop", "wait", "train", "wait"],
        );
    }
}
