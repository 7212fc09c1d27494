//! A recording of a session as a script that repeats it without a terminal.
//!
//! A command given to a running training takes effect at some episode. The journal keeps that
//! episode, and the script pauses the training there, so that it reproduces the run and the figures
//! byte for byte. Runs that were trained concurrently are trained one after the other, as they are
//! independent.

use std::collections::HashSet;

use super::command::{Clusters, Command, Continue, Fork, Recording, Resume, Train, Wait, Watch};

/// The commands executed so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Journal {
    entries: Vec<Entry>,
    /// Number of entries so far, including removed ones.
    entries_created: u64,
}

#[derive(Debug, Clone)]
struct Entry {
    number: u64,
    command: Command,
    /// Number of the run that the command acted on.
    run: Option<usize>,
    /// Number of the run that it started, if a different one.
    begun: Option<usize>,
    /// Number of episodes that the training had finished when the command took effect.
    at: Option<u32>,
}

impl Entry {
    /// Number of the run that the command trains.
    fn trained(&self) -> Option<usize> {
        self.begun.or(self.run)
    }
}

impl Journal {
    /// Records a command that does not concern a running training; `run` is the current run after
    /// it. Returns the number of the entry.
    pub fn note(&mut self, command: Command, run: Option<usize>) -> u64 {
        if command == NEW_CLUSTERS {
            self.forget_unused_clusters();
        }
        let number = self.next_number();
        self.entries.push(Entry { number, command, run, begun: None, at: None });
        number
    }

    /// Records a fork of `run`; `begun` is the number of the new run.
    pub fn note_fork(&mut self, command: Command, run: usize, begun: usize) {
        let number = self.next_number();
        self.entries.push(Entry { number, command, run: Some(run), begun: Some(begun), at: None });
    }

    /// Removes the entries of a command that had no effect.
    pub fn forget(&mut self, numbers: &[u64]) {
        self.entries.retain(|entry| !numbers.contains(&entry.number));
    }

    fn next_number(&mut self) -> u64 {
        self.entries_created += 1;
        self.entries_created
    }

    /// Removes the latest computation of clusters if nothing but edits followed, that is, nothing
    /// used the clusters.
    fn forget_unused_clusters(&mut self) {
        let unused = |entry: &Entry| matches!(entry.command, Command::Edit(_) | Command::Undo(_) | Command::Redo(_));
        let edits = self.entries.iter().rev().take_while(|entry| unused(entry)).count();
        if let Some(before) = self.entries.len().checked_sub(edits + 1)
            && self.entries[before].command == NEW_CLUSTERS
        {
            self.entries.remove(before);
        }
    }

    /// Records a command that took effect when a running training had finished `episode` episodes.
    /// Effects are reported late, so the entry is inserted before those of later episodes. Returns
    /// the number of the entry.
    pub fn note_at(&mut self, command: Command, run: usize, episode: u32) -> u64 {
        let of_run = |entry: &Entry| entry.trained() == Some(run);
        let start = self.entries.iter().rposition(|entry| of_run(entry) && is_start(&entry.command));
        let start = start.map_or(0, |start| start + 1);
        let later =
            self.entries[start..].iter().position(|entry| of_run(entry) && entry.at.is_some_and(|at| at > episode));
        let place = later.map_or(self.entries.len(), |offset| start + offset);
        let number = self.next_number();
        self.entries.insert(place, Entry { number, command, run: Some(run), begun: None, at: Some(episode) });
        number
    }

    /// The script.
    pub fn to_script(&self) -> String {
        let mut writer =
            Writer { journal: self, lines: Vec::new(), runs: Vec::new(), current: None, paused: HashSet::new() };
        writer.lines.push("# A recorded session: play it with `mge script FILE`.".to_owned());
        for index in 0..self.entries.len() {
            writer.write(index);
        }
        writer.lines.join("\n") + "\n"
    }

    /// The episode of the next intervention in a run, searching from an entry on.
    fn next_stop(&self, from: usize, run: Option<usize>) -> Option<u32> {
        let own = self.entries[from..].iter().filter(|entry| entry.trained() == run);
        own.take_while(|entry| !is_start(&entry.command)).find_map(|entry| entry.at)
    }
}

/// Writes the script line by line.
struct Writer<'a> {
    journal: &'a Journal,
    lines: Vec<String>,
    /// The session's numbers of the script's runs, by their numbers in the script. Runs that the session failed to open
    /// or to start are not in the script.
    runs: Vec<usize>,
    /// The current run of the script.
    current: Option<usize>,
    /// Runs that are paused for their next intervention.
    paused: HashSet<usize>,
}

impl Writer<'_> {
    fn line(&mut self, command: impl Into<Command>) {
        self.lines.push(command.into().to_string());
    }

    fn write(&mut self, index: usize) {
        let entry = &self.journal.entries[index];
        let Entry { command, run, at, .. } = entry;
        let behaviour = command.behaviour().in_scripts();
        // The preceding line already paused the run at this episode.
        if matches!(command, Command::Pause(_)) {
            return;
        }
        // Without the run, only what also applies to the next run is repeated.
        if let Some(run) = run
            && behaviour.acts_on_run
            && !self.act_on(*run)
            && behaviour.recording != Recording::WhenEffective
        {
            return;
        }
        let until = self.journal.next_stop(index + 1, entry.trained());
        match command {
            Command::Fork(fork) => {
                self.line(Fork { until, ..fork.clone() });
                self.begin(entry.trained());
                return self.wait(entry.trained(), until);
            }
            Command::Train(Train { folder, .. }) => {
                self.begin(*run);
                self.line(Train { folder: folder.clone(), until, ..Train::default() });
                return self.wait(*run, until);
            }
            Command::Continue(continued) => {
                self.begin(*run);
                self.line(Continue { until, ..continued.clone() });
                return self.wait(*run, until);
            }
            Command::Watch(Watch(number)) => {
                self.act_on(*number);
                return;
            }
            Command::Open(_) => self.begin(*run),
            _ => {}
        }
        self.line(command.clone());
        match command {
            Command::Stop(_) => self.wait(*run, None),
            _ if behaviour.begins_work => self.line(Wait),
            _ if at.is_some() && until != *at && run.is_some_and(|run| self.paused.contains(&run)) => {
                self.line(Resume { until });
                self.wait(*run, until);
            }
            _ => {}
        }
    }

    /// Numbers a run that the next line starts or opens, unless it is known, and makes it the current one.
    fn begin(&mut self, run: Option<usize>) {
        self.runs.extend(run.filter(|run| !self.runs.contains(run)));
        self.current = run;
    }

    /// Makes a run the current one; false if the script does not have it.
    fn act_on(&mut self, run: usize) -> bool {
        let number = self.runs.iter().position(|known| *known == run);
        if let Some(number) = number.filter(|_| self.current != Some(run)) {
            self.line(Watch(number));
            self.current = Some(run);
        }
        number.is_some()
    }

    /// Waits until a run has ended, or has paused at `until`.
    fn wait(&mut self, run: Option<usize>, until: Option<u32>) {
        self.line(Wait);
        if let Some(run) = run {
            match until {
                Some(_) => self.paused.insert(run),
                None => self.paused.remove(&run),
            };
        }
    }
}

/// The command that computes clusters without saving them to a file.
const NEW_CLUSTERS: Command = Command::Clusters(Clusters(None));

fn is_start(command: &Command) -> bool {
    matches!(command, Command::Train(_) | Command::Continue(_) | Command::Fork(_))
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
                Some(episode) => journal.note_at(command(line), 0, *episode),
                None => journal.note(command(line), Some(0)),
            };
        }
        let text = journal.to_script();
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(lines, script);
    }

    #[test]
    fn commands_outside_a_training_are_recorded_unchanged() {
        check(
            &[("task task2", None), ("clusters", None), ("figure clusters a.png", None)],
            &["task task2", "clusters", "wait", "figure clusters a.png"],
        );
    }

    #[test]
    fn a_training_is_paused_at_each_intervention() {
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
    fn concurrent_runs_are_paused_each_at_its_own_interventions() {
        let mut journal = Journal::default();
        journal.note(command("train a"), Some(0));
        journal.note(command("seed 1"), Some(0));
        journal.note(command("train b"), Some(1));
        journal.note_at(command("epsilon 0.3"), 1, 5);
        journal.note(command("watch 1"), Some(0));
        journal.note_at(command("epsilon 0.2"), 0, 30);
        journal.note_at(command("stop"), 1, 9);
        journal.note(command("figure dashboard a.png"), Some(0));
        let text = journal.to_script();
        let lines: Vec<&str> = text.lines().skip(1).collect();
        let a = ["train a until 30", "wait", "seed 1", "train b until 5", "wait", "epsilon 0.3", "resume until 9"];
        let b = ["wait", "watch 1", "epsilon 0.2", "resume", "wait", "watch 2", "stop", "wait", "watch 1"];
        assert_eq!(lines, [&a[..], &b[..], &["figure dashboard a.png"]].concat());
    }

    #[test]
    fn unused_clusters_are_not_computed_again() {
        check(
            &[("clusters", None), ("goal size 5", None), ("undo", None), ("clusters", None)],
            &["goal size 5", "undo", "clusters", "wait"],
        );
        check(
            &[("clusters", None), ("figure clusters a.png", None), ("clusters", None)],
            &["clusters", "wait", "figure clusters a.png", "clusters", "wait"],
        );
    }

    #[test]
    fn a_run_paused_at_the_end_stays_paused() {
        check(&[("train a", None), ("pause", Some(7))], &["train a until 7", "wait"]);
        let changes = [("train a", None), ("epsilon 0.2", Some(3)), ("goal size 5", None), ("pause", Some(7))];
        check(&changes, &["train a until 3", "wait", "epsilon 0.2", "resume until 7", "wait", "goal size 5"]);
        let figure = [("train a", None), ("figure dashboard b.png", Some(7)), ("pause", Some(7))];
        check(&figure, &["train a until 7", "wait", "figure dashboard b.png"]);
    }

    #[test]
    fn a_command_without_effect_is_removed() {
        let mut journal = Journal::default();
        let number = journal.note(command("figure scene a.png"), None);
        journal.note(command("goal size 5"), None);
        journal.forget(&[number]);
        assert_eq!(journal.to_script().lines().skip(1).collect::<Vec<_>>(), ["goal size 5"]);
    }

    #[test]
    fn a_command_without_effect_in_a_training_is_removed() {
        let mut journal = Journal::default();
        journal.note(command("train a"), Some(0));
        let number = journal.note_at(command("figure dashboard b.png"), 0, 5);
        journal.forget(&[number]);
        assert_eq!(journal.to_script().lines().skip(1).collect::<Vec<_>>(), ["train a", "wait"]);
    }

    #[test]
    fn an_effect_reported_late_comes_between_earlier_and_later_ones() {
        let effects =
            [("train a", None), ("epsilon 0.1", Some(10)), ("epsilon 0.3", Some(30)), ("epsilon 0.2", Some(20))];
        let text = [
            "train a until 10",
            "wait",
            "epsilon 0.1",
            "resume until 20",
            "wait",
            "epsilon 0.2",
            "resume until 30",
            "wait",
            "epsilon 0.3",
            "resume",
            "wait",
        ];
        check(&effects, &text);
    }

    #[test]
    fn a_continued_and_a_forked_run_are_paused_for_changes() {
        check(
            &[("train a", None), ("stop", Some(2)), ("continue", None), ("epsilon 0.2", Some(4))],
            &["train a until 2", "wait", "stop", "wait", "continue until 4", "wait", "epsilon 0.2", "resume", "wait"],
        );
        let mut journal = Journal::default();
        journal.note(command("train a"), Some(0));
        journal.note_fork(command("fork 3"), 0, 1);
        journal.note_at(command("epsilon 0.2"), 1, 5);
        let text = journal.to_script();
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(lines, ["train a", "wait", "fork 3 until 5", "wait", "epsilon 0.2", "resume", "wait"]);
    }

    #[test]
    fn opened_runs_are_numbered_as_well() {
        let mut journal = Journal::default();
        journal.note(command("open a"), Some(0));
        journal.note(command("open b"), Some(1));
        journal.note(command("watch 1"), Some(0));
        journal.note(command("expect episodes = 3"), Some(0));
        let text = journal.to_script();
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(lines, ["open a", "open b", "watch 1", "expect episodes = 3"]);
    }

    #[test]
    fn a_stopped_run_is_not_resumed_after_a_figure() {
        check(
            &[("train a", None), ("stop", Some(5)), ("figure dashboard b.png", Some(5))],
            &["train a until 5", "wait", "stop", "wait", "figure dashboard b.png"],
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
