//! `mge clusters`: the action prior of a task.

use super::arguments::Clusters;
use super::output::{self, Outcome};
use super::session::{guided, perform};
use mge_workbench::{SessionError, command};

pub fn run(arguments: &Clusters) -> Outcome {
    let to = arguments.out.as_deref().map(|path| arguments.force.target(path));
    let mut session = guided(&arguments.task, arguments.model.clone(), arguments.seed)?;
    let is_saved = to.is_some();
    perform(&mut session, command::Clusters(to), "clusters", false)?;
    let prior = session.prior().ok_or(SessionError::NoClusters)?;
    if is_saved { Ok(()) } else { Ok(output::lines(prior.to_json())?) }
}
