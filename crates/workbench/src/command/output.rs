//! Commands for output and control: figures, expectations, recording, waiting and quitting.

use super::arguments::{Argument, Composed, Number, OneOf, OptionalUnless, Output, is_option};
use super::{Awaits, DependsOn, Execute, InScripts, Verb, syntax};
use crate::dry_run::DryRun;
use crate::journal::SCRIPT;
use crate::{Session, SessionError, write_file};
use mge_base::atomic::{Format, Target};
use mge_base::paths::suffix;
use mge_figures::{EXTENSIONS, PICTURE};
use mge_results::Composition;

/// Exports a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// What it shows.
    pub kind: FigureKind,
    /// The file; its extension selects the format.
    pub to: Target,
    /// Its resolution; None for the default.
    pub dpi: Option<u32>,
    /// What the figure of learning curves shows, and how.
    pub composition: Composition,
}

impl Execute for Figure {
    syntax! {
        "figure" "KIND FILE [force] [DPI] [KEY=VALUE]..." "export a figure: scene, clusters, learning, dashboard or episode"
            => Figure {
                kind: OneOf("a kind", &FigureKind::ALL, FigureKind::name),
                to: Output("a file"),
                dpi: OptionalUnless(Number("resolution"), is_option),
                composition: Composed,
            };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.export(self)
    }

    fn check(&self, _dry_run: &mut DryRun) -> Result<(), SessionError> {
        self.check_kind()
    }

    fn in_scripts(&self) -> InScripts {
        let depends_on = match self.kind {
            FigureKind::Scene | FigureKind::Clusters => DependsOn::Nothing,
            FigureKind::Dashboard => DependsOn::Run,
            FigureKind::Episode => DependsOn::Checkpoint,
            FigureKind::Learning => DependsOn::Runs,
        };
        InScripts { depends_on, awaits: Awaits::Result, ..InScripts::default() }
    }

    fn output(&self) -> Option<(&Target, Format<'static>)> {
        Some((&self.to, PICTURE))
    }

    fn output_mut(&mut self) -> Option<&mut Target> {
        Some(&mut self.to)
    }
}

impl Figure {
    /// A figure with default options.
    pub fn with_defaults(kind: FigureKind, to: impl Into<Target>) -> Self {
        Self { kind, to: to.into(), dpi: None, composition: Composition::default() }
    }

    /// Checks that a figure of this kind has these options and can be written to a file with this extension.
    pub(crate) fn check_kind(&self) -> Result<(), SessionError> {
        let Self { kind, to: Target { ref path, .. }, ref composition, .. } = *self;
        if let Some((key, _)) = composition.options().first().filter(|_| kind != FigureKind::Learning) {
            let reason = format!("{key}: only the figure `learning` is composed, not `{}`", kind.name());
            return Err(SessionError::Failed(reason));
        }
        let (known, expected): (&[&str], _) =
            if kind == FigureKind::Episode { (&["gif"], "`.gif`") } else { (&EXTENSIONS, "`.png`, `.svg` or `.pdf`") };
        if known.contains(&suffix(path).as_str()) {
            return Ok(());
        }
        let figure = format!("{}: a figure of this kind is written as {expected}", path.display());
        Err(SessionError::Failed(figure + ": use that extension"))
    }
}

/// A figure of the session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FigureKind {
    /// The task's scene.
    Scene,
    /// The action clusters over the scene.
    Clusters,
    /// Success of the runs in the session's folder, or of those given, as in reports.
    Learning,
    /// All logged metrics of the current run.
    Dashboard,
    /// An animation of the episode played by hand, or else of a greedy episode of the current run.
    Episode,
}

impl FigureKind {
    /// All kinds.
    pub const ALL: [Self; 5] = [Self::Scene, Self::Clusters, Self::Learning, Self::Dashboard, Self::Episode];

    /// The name in the language.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Clusters => "clusters",
            Self::Learning => "learning",
            Self::Dashboard => "dashboard",
            Self::Episode => "episode",
        }
    }
}

/// An assertion; the script fails if it does not hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expect {
    /// The quantity.
    pub quantity: Quantity,
    /// The comparison operator.
    pub comparison: Comparison,
    /// The value it is compared with.
    pub value: f64,
}

impl Execute for Expect {
    syntax! {
        "expect" "WHAT OP VALUE" "fail the script unless it holds, such as expect success >= 0.5"
            => Expect {
                quantity: OneOf("a quantity", &Quantity::ALL, Quantity::name),
                comparison: OneOf("a comparison", &Comparison::ALL, Comparison::sign),
                value: Number("number"),
            };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.expect(self)
    }

    fn in_scripts(&self) -> InScripts {
        let depends_on = match self.quantity {
            Quantity::Episodes | Quantity::Success | Quantity::Greedy => DependsOn::Run,
            Quantity::Clusters | Quantity::Subgoals | Quantity::Proposals => DependsOn::Nothing,
        };
        InScripts { depends_on, ..InScripts::default() }
    }
}

/// A quantity that `expect` can check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Episodes the current run has finished.
    Episodes,
    /// Rolling success of the current run, 0 to 1.
    Success,
    /// Success of the latest greedy evaluation, 0 to 1.
    Greedy,
    /// Number of action clusters over all stages.
    Clusters,
    /// Number of subgoals of the task.
    Subgoals,
    /// Number of proposed subgoals neither accepted nor rejected.
    Proposals,
}

impl Quantity {
    const ALL: [Self; 6] =
        [Self::Episodes, Self::Success, Self::Greedy, Self::Clusters, Self::Subgoals, Self::Proposals];

    /// The name in the language.
    pub fn name(self) -> &'static str {
        match self {
            Self::Episodes => "episodes",
            Self::Success => "success",
            Self::Greedy => "greedy",
            Self::Clusters => "clusters",
            Self::Subgoals => "subgoals",
            Self::Proposals => "proposals",
        }
    }
}

/// A comparison operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// `=`
    Equal,
    /// `>=`
    AtLeast,
    /// `<=`
    AtMost,
}

impl Comparison {
    const ALL: [Self; 3] = [Self::Equal, Self::AtLeast, Self::AtMost];

    /// The sign in the language.
    pub fn sign(self) -> &'static str {
        match self {
            Self::Equal => "=",
            Self::AtLeast => ">=",
            Self::AtMost => "<=",
        }
    }

    /// Whether it holds.
    pub fn holds(self, left: f64, right: f64) -> bool {
        match self {
            Self::Equal => left == right,
            Self::AtLeast => left >= right,
            Self::AtMost => left <= right,
        }
    }
}

/// Saves the session so far as a script.
#[derive(Debug, Clone, PartialEq)]
pub struct Record(pub Target);

impl Execute for Record {
    syntax! {
        "record" "FILE [force]" "save the session so far as a script" => Record { 0: Output("a file") };
    }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        write_file(&self.0, session.to_script().as_bytes(), &SCRIPT)?;
        Ok(format!("saved the session to {}", self.0.path.display()))
    }

    fn in_scripts(&self) -> InScripts {
        InScripts { unrecorded: true, ..InScripts::default() }
    }

    fn output(&self) -> Option<(&Target, Format<'static>)> {
        Some((&self.0, SCRIPT))
    }

    fn output_mut(&mut self) -> Option<&mut Target> {
        Some(&mut self.0)
    }
}

/// In a script, waits for runs and jobs. Elsewhere, reports what is running.
#[derive(Debug, Clone, PartialEq)]
pub struct Wait;

impl Execute for Wait {
    syntax! { "wait" "" "in a script: wait until runs pause or end and computations are done" => Wait {}; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        Ok(session.activity())
    }

    fn in_scripts(&self) -> InScripts {
        InScripts { unrecorded: true, awaits: Awaits::Everything, ..InScripts::default() }
    }
}

/// Ends the session.
#[derive(Debug, Clone, PartialEq)]
pub struct Quit;

impl Execute for Quit {
    syntax! { "quit" "" "leave the workbench; a running training is checkpointed first" => Quit {}; }

    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.quit = true;
        Ok(String::new())
    }

    fn in_scripts(&self) -> InScripts {
        InScripts { unrecorded: true, ..InScripts::default() }
    }
}
