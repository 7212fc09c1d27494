//! Commands for output and control: figures, expectations, recording, waiting and quitting.

use super::arguments::{Argument, Composed, Named, Number, Optional, Output, Parsed, Words, is_option};
use super::{Command, DependsOn, Execute, ScriptRole, Verb, WaitFor, command};
use crate::journal::SCRIPT;
use crate::setup::Setup;
use crate::{Session, SessionError, write_file};
use mge_base::atomic::Target;
use mge_base::by_name;
use mge_base::paths::suffix;
use mge_figures::{EXTENSIONS, FigureError, PICTURE};
use mge_results::Composition;

command! {
    /// Exports a figure.
    Figure {
        /// What it shows.
        kind: FigureKind = Parsed("a kind"),
        /// The file; its extension selects the format.
        to: Target = Output(PICTURE),
        /// Its resolution; None for the default.
        dpi: Option<u32> = Optional(Number("resolution"), is_option),
        /// What the figure of learning curves shows, and how.
        composition: Composition = Composed,
    }: "figure" "KIND FILE [force] [DPI] [KEY=VALUE]..." "export a figure: scene, clusters or learning";
    execute = |this, session| session.export(this);
    check = |this, _| this.check_kind();
    script_role = |this| {
        let depends_on = if this.kind == FigureKind::Learning { DependsOn::Runs } else { DependsOn::Nothing };
        ScriptRole { depends_on, awaits: WaitFor::Result, ..ScriptRole::default() }
    };
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
            return Err(format!("{key}: only the figure `learning` is composed, not `{}`", kind.name()).into());
        }
        if EXTENSIONS.contains(&suffix(path).as_str()) {
            return Ok(());
        }
        Err(FigureError::Format(path.clone()).to_string().into())
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
}

by_name!(FigureKind, "kind of figure", {
    Scene = "scene", Clusters = "clusters", Learning = "learning"
});

command! {
    /// An assertion; the script fails if it does not hold.
    #[derive(Copy)]
    Expect {
        /// The quantity.
        quantity: Quantity = Parsed("a quantity"),
        /// The comparison operator.
        comparison: Comparison = Parsed("a comparison"),
        /// The value it is compared with.
        value: f64 = Number("number"),
    }: "expect" "WHAT OP VALUE" "fail the script unless it holds, such as expect success >= 0.5";
    execute = |this, session| session.expect(this);
    script_role = |this| {
        let depends_on = match this.quantity {
            Quantity::Episodes | Quantity::Success | Quantity::Greedy => DependsOn::Run,
            Quantity::Clusters | Quantity::Subgoals | Quantity::Proposals => DependsOn::Nothing,
        };
        ScriptRole { depends_on, ..ScriptRole::default() }
    };
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

by_name!(Quantity, "quantity", {
    Episodes = "episodes", Success = "success", Greedy = "greedy",
    Clusters = "clusters", Subgoals = "subgoals", Proposals = "proposals"
});

/// A comparison operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// `<=`
    AtMost,
    /// `>=`
    AtLeast,
    /// `<`
    Below,
    /// `>`
    Above,
    /// `=`, which allows for values in single precision, but keeps integers apart.
    Equal,
}

impl Comparison {
    /// Whether it holds.
    pub fn holds(self, left: f64, right: f64) -> bool {
        match self {
            Self::AtMost => left <= right,
            Self::AtLeast => left >= right,
            Self::Below => left < right,
            Self::Above => left > right,
            Self::Equal => (left - right).abs() < (1e-6 * right.abs().max(1.0)).min(0.5),
        }
    }
}

by_name!(Comparison, "comparison", { AtMost = "<=", AtLeast = ">=", Below = "<", Above = ">", Equal = "=" });

command! {
    /// Saves the session so far as a script.
    Record(to: Target = Output(SCRIPT)): "record" "FILE [force]" "save the session so far as a script";
    execute = |this, session| {
        write_file(&this.0, session.to_script().as_bytes(), &SCRIPT)?;
        Ok(format!("saved the session to {}", this.0.path.display()))
    };
    script_role = |_| ScriptRole { unrecorded: true, ..ScriptRole::default() };
}

command! {
    /// In a script, waits for runs and jobs. Elsewhere, reports what is running.
    Wait: "wait" "" "in a script: wait until runs pause or end and computations are done";
    execute = |_, session| Ok(session.activity());
    script_role = |_| ScriptRole { unrecorded: true, awaits: WaitFor::Everything, ..ScriptRole::default() };
}

command! {
    /// Ends the session.
    Quit: "quit" "" "leave the workbench; a running training is checkpointed first";
    execute = |_, session| {
        session.quit = true;
        Ok(String::new())
    };
    script_role = |_| ScriptRole { unrecorded: true, ..ScriptRole::default() };
}
