//! A recording of a session as a script that repeats it without a terminal.
//!
//! A command given to a running training takes effect at some episode. The journal keeps that
//! episode, and the script pauses the training there, so that it reproduces the run and the figures
//! byte for byte. Runs that were trained concurrently are trained one after the other, as they are
//! independent.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::command::{
    Clusters, Command, Continue, DependsOn, Epsilon, Fork, Guide, Resume, Set, Train, Wait, WaitFor, Watch,
};
use mge_base::atomic::Format;
use mge_guidance::EpsilonSchedule;

/// The first line of a recorded script.
const TITLE: &str = "# A recorded session: play it with `mge script FILE`.";

/// The format of recorded scripts.
pub(super) const SCRIPT: Format<'static> =
    Format { name: "a recorded script", is: &|found| found.starts_with(TITLE.as_bytes()) };

/// The commands executed so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Journal {
    entries: Vec<Entry>,
    /// Number of entries so far, including removed ones.
    entries_created: u64,
}

/// A command, with the folders of the session's runs as `%N`.
#[derive(Debug, Clone)]
struct Entry {
    number: u64,
    command: Command,
    /// Number of the run that the command acted on, or that it started.
    run: Option<usize>,
    /// The trainings that the command depends on: the number of each, and of its finished episodes when the command
    /// took effect.
    at: Vec<(usize, u32)>,
}

/// In place of the number of episodes: the command was sent to the training, which has not taken it yet.
const SENT: u32 = u32::MAX;

impl Entry {
    /// Whether the command starts to train a run.
    fn starts(&self, run: usize) -> bool {
        let is_start = matches!(self.command, Command::Train(_) | Command::Continue(_) | Command::Fork(_));
        is_start && self.run == Some(run)
    }

    /// Number of episodes of a run when the command took effect, if it depends on the run.
    fn episode_of(&self, run: usize) -> Option<u32> {
        self.at.iter().find(|(known, _)| *known == run).map(|(_, episode)| *episode)
    }
}

/// The name of a run of the session in commands, in place of its folder: `%N`, counted from 1.
pub(super) fn run_name(number: usize) -> PathBuf {
    format!("%{}", number + 1).into()
}

/// The number of the run with this name, from 0.
pub(super) fn run_number(name: &Path) -> Option<usize> {
    name.to_str()?.strip_prefix('%')?.parse::<usize>().ok()?.checked_sub(1)
}

impl Journal {
    /// Records a command that does not depend on a training; `run` is the current run after it. Returns the number of
    /// the entry.
    pub fn note(&mut self, command: Command, run: Option<usize>) -> u64 {
        self.note_at(command, run, Vec::new())
    }

    /// Records a command that took effect when trainings had finished these episodes, if it depends on any; it acted on
    /// the first, or else on `run`. Commands take effect late, so the entry is inserted before those of later episodes.
    /// Returns the number of the entry.
    pub fn note_at(&mut self, command: Command, run: Option<usize>, at: Vec<(usize, u32)>) -> u64 {
        if command == NEW_CLUSTERS {
            self.forget_unused_clusters();
        }
        let starts = |entry: &Entry| at.iter().any(|(run, _)| entry.starts(*run));
        let start = self.entries.iter().rposition(starts).map_or(0, |start| start + 1);
        let is_later =
            |entry: &Entry| at.iter().any(|(run, episode)| entry.episode_of(*run).is_some_and(|of| of > *episode));
        let later = self.entries[start..].iter().position(is_later);
        let place = later.map_or(self.entries.len(), |offset| start + offset);
        let run = at.first().map(|(run, _)| *run).or(run);
        self.entries_created += 1;
        self.entries.insert(place, Entry { number: self.entries_created, command, run, at });
        self.entries_created
    }

    /// Records that the session's clusters were sent to a training.
    pub fn note_guide(&mut self, run: usize) {
        self.note_at(Guide.into(), None, vec![(run, SENT)]);
    }

    /// Records when a training took the clusters sent to it.
    pub fn note_guided(&mut self, run: usize, episode: u32) {
        let sent = [(run, SENT)];
        if let Some(entry) = self.entries.iter_mut().find(|entry| entry.at == sent) {
            entry.at = vec![(run, episode)];
        }
    }

    /// Records that a training took a schedule; `usual` is that of the next run.
    pub fn note_schedule(&mut self, schedule: EpsilonSchedule, usual: &EpsilonSchedule, run: usize, episode: u32) {
        let command = Command::from(Epsilon(schedule.clone()));
        // In a script, one command sets that of the next run as well, unless others came in between.
        self.entries.pop_if(|last| last.command == command && last.at.is_empty());
        self.note_at(command, None, vec![(run, episode)]);
        if schedule != *usual {
            self.note(set_epsilon(usual), None);
        }
    }

    /// Removes the entries of a command that had no effect.
    pub fn forget(&mut self, numbers: &[u64]) {
        self.entries.retain(|entry| !numbers.contains(&entry.number));
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

    /// The script.
    pub fn to_script(&self) -> String {
        let mut writer =
            Writer { journal: self, lines: Vec::new(), runs: Vec::new(), current: None, paused: HashSet::new() };
        writer.lines.push(TITLE.to_owned());
        for index in 0..self.entries.len() {
            writer.write(index);
        }
        writer.lines.join("\n") + "\n"
    }

    /// The number of episodes at which the script next pauses a run, searching from an entry on.
    fn next_stop(&self, from: usize, run: usize) -> Option<u32> {
        let own = self.entries[from..].iter().take_while(|entry| !entry.starts(run));
        own.filter_map(|entry| entry.episode_of(run)).find(|episode| *episode != SENT)
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
        let Entry { run, at, .. } = entry;
        let role = entry.command.as_execute().script_role();
        // The preceding line already paused the run at this episode.
        if matches!(entry.command, Command::Pause(_)) || at.iter().any(|(_, episode)| *episode == SENT) {
            return;
        }
        let Ok(mut command) = self.renamed(&entry.command) else { return };
        let acts_on_run = match role.depends_on {
            DependsOn::Nothing => !at.is_empty(),
            DependsOn::Run | DependsOn::Checkpoint => true,
            DependsOn::Runs => false,
        };
        if let Some(run) = run.filter(|_| acts_on_run)
            && !self.act_on(run)
        {
            return;
        }
        let until = run.and_then(|run| self.journal.next_stop(index + 1, run));
        match &mut command {
            Command::Train(Train { until: pause, .. })
            | Command::Continue(Continue { until: pause, .. })
            | Command::Fork(Fork { until: pause, .. }) => {
                *pause = until;
                self.begin(*run);
                self.line(command);
                return self.wait(*run, until);
            }
            Command::Watch(Watch(number)) => {
                self.act_on(*number);
                return;
            }
            Command::Open(_) => self.begin(*run),
            // The current run of the script may be another one than that of the session was, and take it.
            Command::Epsilon(Epsilon(schedule)) if at.is_empty() && self.current.is_some() => {
                command = set_epsilon(schedule);
            }
            _ => {}
        }
        self.line(command);
        if matches!(entry.command, Command::Stop(_)) {
            self.wait(*run, None);
        } else if role.awaits == WaitFor::Work {
            self.line(Wait);
        }
        for (run, episode) in at {
            let until = self.journal.next_stop(index + 1, *run);
            if until != Some(*episode) && self.paused.contains(run) && self.act_on(*run) {
                self.line(Resume { until });
                self.wait(Some(*run), until);
            }
        }
    }

    /// The command with the script's names of runs; an error if the script does not have one of them.
    fn renamed(&self, command: &Command) -> Result<Command, ()> {
        command.clone().with_run_folders(|folder| {
            let Some(number) = run_number(folder) else { return Ok(None) };
            let known = self.runs.iter().position(|known| *known == number);
            known.map(|number| Some(run_name(number))).ok_or(())
        })
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

/// Sets the schedule of the next run only.
fn set_epsilon(schedule: &EpsilonSchedule) -> Command {
    Set { key: "epsilon".to_owned(), value: schedule.to_string() }.into()
}

/// The command that computes clusters without saving them to a file.
const NEW_CLUSTERS: Command = Command::Clusters(Clusters(None));

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
                Some(episode) => journal.note_at(command(line), None, vec![(0, *episode)]),
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
                ("figure learning b.png", Some(30)),
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
                "figure learning b.png",
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
        journal.note_at(command("epsilon 0.3"), None, vec![(1, 5)]);
        journal.note(command("watch 1"), Some(0));
        journal.note_at(command("epsilon 0.2"), None, vec![(0, 30)]);
        journal.note_at(command("stop"), None, vec![(1, 9)]);
        journal.note(command("expect episodes = 30"), Some(0));
        let text = journal.to_script();
        let lines: Vec<&str> = text.lines().skip(1).collect();
        let a = ["train a until 30", "wait", "seed 1", "train b until 5", "wait", "epsilon 0.3", "resume until 9"];
        let b = ["wait", "watch 1", "epsilon 0.2", "resume", "wait", "watch 2", "stop", "wait", "watch 1"];
        assert_eq!(lines, [&a[..], &b[..], &["expect episodes = 30"]].concat());
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
        let figure = [("train a", None), ("figure learning b.png", Some(7)), ("pause", Some(7))];
        check(&figure, &["train a until 7", "wait", "figure learning b.png"]);
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
        let number = journal.note_at(command("figure learning b.png"), None, vec![(0, 5)]);
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
        journal.note(command("watch 1"), Some(0));
        journal.note(command("fork 3"), Some(1));
        journal.note_at(command("epsilon 0.2"), None, vec![(1, 5)]);
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

    fn lines(journal: &Journal) -> String {
        journal.to_script().lines().skip(1).collect::<Vec<_>>().join("; ")
    }

    #[test]
    fn a_training_is_given_the_clusters_of_the_time_when_they_were_sent() {
        let mut journal = Journal::default();
        journal.note(command("train a"), Some(0));
        journal.note(command("clusters"), Some(0));
        journal.note_guide(0);
        assert_eq!(lines(&journal), "train a; wait; clusters; wait", "it has not taken them");
        journal.note(command("clusters"), Some(0));
        journal.note_at(command("figure learning b.png"), None, vec![(0, 5)]);
        journal.note_guided(0, 7);
        let first = "train a until 5; wait; clusters; wait; figure learning b.png; resume until 7; wait; ";
        assert_eq!(lines(&journal), format!("{first}guide; resume; wait; clusters; wait"));
    }

    #[test]
    fn a_schedule_from_another_process_is_not_that_of_the_next_run() {
        let schedule = |text: &str| text.parse::<EpsilonSchedule>().unwrap();
        let mut journal = Journal::default();
        journal.note(command("train a"), Some(0));
        journal.note_schedule(schedule("0.2"), &schedule("0.5"), 0, 4);
        let run = "train a until 4; wait; epsilon 0.2; resume; wait";
        assert_eq!(lines(&journal), format!("{run}; set epsilon 0.5"));
    }

    #[test]
    fn a_figure_of_several_trainings_is_drawn_while_all_are_paused() {
        let mut journal = Journal::default();
        journal.note(command("train a"), Some(0));
        journal.note(command("train b"), Some(1));
        journal.note_at(command("figure learning c.png"), None, vec![(1, 3), (0, 8)]);
        journal.note(command("delete %1"), Some(1));
        let paused = "train a until 8; wait; train b until 3; wait; figure learning c.png";
        assert_eq!(lines(&journal), format!("{paused}; resume; wait; watch 1; resume; wait; delete '%1'"));
    }

    #[test]
    fn a_stopped_run_is_not_resumed_after_a_figure() {
        check(
            &[("train a", None), ("stop", Some(5)), ("figure learning b.png", Some(5))],
            &["train a until 5", "wait", "stop", "wait", "figure learning b.png"],
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
