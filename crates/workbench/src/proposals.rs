//! Subgoals proposed for the session's task by model rollouts.

use std::sync::Arc;

use super::clusters::RolloutInputs;
use super::command::{Command, Propose};
use super::job::Reporter;
use super::{Session, SessionError};
use mge_base::text::counted;
use mge_guidance::{ChosenSubgoals, NO_SUBGOALS, TRIALS, choose_subgoals};
use mge_task::{Region, Task};
use mge_trainer::{RunConfig, required_model};

/// The inputs of proposals, which exclude the task's own subgoals.
fn inputs(config: &RunConfig) -> RolloutInputs {
    // Saving a task changes its name, but not its scene.
    let task = Task { subgoals: Vec::new(), name: String::new(), ..Task::clone(&config.task) };
    RolloutInputs::of(config, Arc::new(task), config.prior.clone())
}

impl Session {
    /// Starts searching for subgoals, by default as many as the task has.
    pub(super) fn propose(&mut self, command: &Propose) -> Result<String, SessionError> {
        self.setup.config.validate()?;
        let count = command.0.unwrap_or(self.task().subgoals.len().max(1));
        self.cancel_jobs(Command::is_propose);
        let config = self.setup.config.clone();
        let key = inputs(&config);
        let work = move |reporter: &Reporter| {
            let model = required_model(&config, &reporter.stop)?;
            let progress = |tried| _ = reporter.progress(tried, TRIALS);
            let RunConfig { task, guidance, seed, .. } = &config;
            let found = choose_subgoals(task, &*model, count, guidance, *seed, &reporter.stop, progress);
            Ok(found.map_err(|error| error.to_string())?)
        };
        self.start_job(Propose(Some(count)), work, move |session, found| {
            Ok(session.take_proposals(&key, count, found?)?)
        });
        Ok(format!("looking for {}", counted(count, "subgoal")))
    }

    fn take_proposals(&mut self, key: &RolloutInputs, count: usize, choice: ChosenSubgoals) -> Result<String, String> {
        if *key != inputs(&self.setup.config) {
            return Err("the task or the model was changed while subgoals were looked for: `propose` again".to_owned());
        }
        if choice.is_failure() {
            return Err(NO_SUBGOALS.to_owned());
        }
        let ChosenSubgoals { subgoals: regions, least_reached, actions, .. } = choice;
        let (found, percent) = (regions.len(), 100.0 * least_reached);
        if found == 0 {
            return Ok(format!("no subgoals are needed: {percent:.0} % of the guided rollouts reached the goal"));
        }
        self.setup.editor.propose(regions, actions as u64);
        // Recorded when the proposals arrive: only later commands can refer to them.
        self.journal.note(Propose(Some(count)).into(), self.runs.current);
        let all = if found < count { format!(" of the {count} looked for") } else { String::new() };
        let reached = if least_reached > 0.0 {
            format!("each stage was reached by {percent:.0} % of the guided rollouts or more")
        } else {
            "the guided rollouts of the check did not reach every stage".to_owned()
        };
        Ok(format!("{}{all} proposed with {}: {reached}", counted(found, "subgoal"), counted(actions, "real action")))
    }

    /// Proposed subgoals that were neither accepted nor rejected.
    pub fn proposed(&self) -> &[Region] {
        self.setup.editor.proposed()
    }

    /// The task with the proposed subgoals in place of its own, charged for the search for them.
    pub fn with_proposals(&self) -> Task {
        self.setup.editor.with_proposals()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Script;
    use mge_task::load;

    fn session() -> Session {
        let mut session = Session::new(load("task2").unwrap(), "runs".into());
        run(&mut session, "model true").unwrap();
        session
    }

    fn run(session: &mut Session, lines: &str) -> Result<(), String> {
        Script::parse(lines, "s", &[]).unwrap().run(session, |_| {}).map_err(|error| error.to_string())
    }

    #[test]
    fn proposed_subgoals_are_moved_accepted_and_undone() {
        let mut session = session();
        let before = session.task().clone();
        run(&mut session, "propose 1\nwait\nexpect proposals = 1\nproposal move 1 0.25 0.5\nproposal accept").unwrap();
        let [subgoal] = session.task().subgoals[..] else { panic!("{:?}", session.task().subgoals) };
        assert_eq!(subgoal.position, [0.25, 0.5]);
        run(&mut session, "undo\nexpect proposals = 1\nundo\nundo\nexpect proposals = 0").unwrap();
        assert_eq!(session.task(), &before);
    }

    #[test]
    fn a_recorded_session_proposes_and_accepts_the_same() {
        let mut first = session();
        run(&mut first, "goal size 5\npropose 2\nsubgoal size 1 3\nwait\nproposal accept 1").unwrap();
        let script = first.to_script();
        let mut second = session();
        run(&mut second, &script).unwrap();
        assert_eq!(second.task(), first.task(), "{script}");
    }

    #[test]
    fn proposals_for_another_scene_are_not_offered() {
        let mut session = session();
        let error = run(&mut session, "propose 1\ngoal move 0.1 0.1\nwait").unwrap_err();
        assert!(error.contains("was changed while"), "{error}");
        let error = run(&mut session, "model uniform\npropose\nwait").unwrap_err();
        assert!(error.contains("predicts nothing"), "{error}");
        assert!(session.proposed().is_empty() && session.job(Command::is_propose).is_none());
    }
}
