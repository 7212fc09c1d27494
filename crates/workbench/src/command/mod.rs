//! The command language: one command per line.
//!
//! Each command is one item that holds its verb, arguments, help line and effect on the session; parser, printer, help
//! and manual follow from it. To add a command, define it in the matching file and add its name to the list below.

mod arguments;
mod hand_play;
mod models;
mod output;
mod runs;
mod settings;
mod task;

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use derive_more::{Display, IsVariant};

use super::setup::Setup;
use super::{Session, SessionError};
pub(crate) use arguments::Named;
use arguments::Words;
use mge_base::atomic::{Format, Target};
use mge_base::spelling::{nearest, suggestion};
use mge_run::RunError;

pub use hand_play::{HandPlay, Place, Reset};
pub use mge_task::Edit;
pub use models::{Clusters, Guide, ModelStop, ModelTrain};
pub use output::{Comparison, Expect, Figure, FigureKind, Quantity, Quit, Record, Wait};
pub use runs::{
    Checkpoint, Continue, Delete, EmptyTrash, Evaluate, Fork, Note, Open, Pause, Rename, Restore, Resume, Stop, Train,
    Watch,
};
pub use settings::{Episodes, Epsilon, Method, Model, Out, Seed, Set};
pub use task::{Propose, Redo, Save, Task, Undo};

/// A verb of the command language.
#[derive(Debug, Clone, Copy)]
pub struct Verb {
    /// The words a command line begins with.
    pub name: &'static str,
    /// The arguments, as shown in usage and help.
    pub arguments: &'static str,
    /// One line of help.
    pub help: &'static str,
    /// Parses the arguments.
    read: fn(&mut Words<'_>) -> Result<Command, String>,
}

impl Verb {
    /// The usage line: name and arguments.
    pub fn usage(&self) -> String {
        format!("{} {}", self.name, self.arguments).trim_end().to_owned()
    }
}

/// The runs on which the effect of a command depends. A recorded script repeats it when these have as many episodes as
/// when it was executed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum DependsOn {
    /// None.
    #[default]
    Nothing,
    /// The current run.
    Run,
    /// The latest checkpoint of the current run.
    Checkpoint,
    /// All runs.
    Runs,
}

/// What a script waits for after a command.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum WaitFor {
    /// Nothing.
    #[default]
    Nothing,
    /// Nothing, but it starts work: a recorded script goes on with `wait`.
    Work,
    /// The result of the job that the command started, if it started one.
    Result,
    /// The end of all jobs and unpaused runs.
    Everything,
}

/// How a command behaves in scripts, both played and recorded.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ScriptRole {
    /// Whether it is not recorded when it is executed: either the journal gets it in another way, or nothing depends on
    /// it.
    pub unrecorded: bool,
    /// The runs on which its effect depends.
    pub depends_on: DependsOn,
    /// What a script waits for after it.
    pub awaits: WaitFor,
}

/// What a command does.
pub(super) trait Execute {
    /// Its verbs, in the order of the help.
    fn verbs() -> Vec<Verb>
    where
        Self: Sized;

    /// The line that parses to this command.
    fn line(&self) -> String;

    /// Changes the task or the settings of the next run, and returns the report.
    ///
    /// # Errors
    /// When the change is invalid; nothing has changed then.
    fn prepare(&self, _setup: &mut Setup) -> Result<String, SessionError> {
        Ok(String::new())
    }

    /// Executes the command without blocking, and returns the report.
    ///
    /// # Errors
    /// When it cannot be executed; nothing has changed then.
    fn execute(&self, session: &mut Session) -> Result<String, SessionError> {
        session.change(|setup| self.prepare(setup))
    }

    /// Checks the command as far as possible before the work of the preceding commands is done, and makes its changes
    /// of the task and the settings.
    ///
    /// # Errors
    /// When it would fail whatever the results of that work.
    fn check(&self, setup: &mut Setup) -> Result<(), SessionError> {
        self.prepare(setup).map(drop)
    }

    /// How it behaves in scripts.
    fn script_role(&self) -> ScriptRole {
        ScriptRole::default()
    }

    /// Passes the files and runs that it names to `visit`.
    fn visit(&mut self, _visit: &mut dyn FnMut(Named<'_>)) {}
}

/// Defines a command: the type with its arguments, each with its kind (see `arguments`); its verb, the arguments as
/// shown in usage and help, and the help line; then what it does: the methods of `Execute` that it has, as functions of
/// the command and the method's argument.
macro_rules! command {
    ($(#[$doc:meta])* $name:ident $(($($field:ident: $type:ty = $kind:expr),+))?:
        $verb:literal $arguments:literal $help:literal; $($method:ident = $body:expr;)*) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name $(($(pub $type),+))?;
        command! {
            @execute $name $verb $arguments $help ($name $(($($field),+))?) ($name $(($($field),+))?)
                [$($($field: $type = $kind),+)?];
            $($method = $body;)*
        }
    };
    ($(#[$doc:meta])* $name:ident { $($(#[$of_field:meta])* $field:ident: $type:ty = $kind:expr),+ $(,)? }:
        $verb:literal $arguments:literal $help:literal; $($method:ident = $body:expr;)*) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            $($(#[$of_field])* pub $field: $type),+
        }
        command! {
            @execute $name $verb $arguments $help ($name { $($field),+ }) ($name { $($field),+ })
                [$($field: $type = $kind),+];
            $($method = $body;)*
        }
    };
    (@execute $name:ident $verb:literal $arguments:literal $help:literal ($made:expr) ($parts:pat)
        [$($field:ident: $type:ty = $kind:expr),*]; $($method:ident = $body:expr;)*) => {
        impl Execute for $name {
            fn verbs() -> Vec<Verb> {
                let read: fn(&mut Words<'_>) -> Result<Command, String> = |_words| {
                    $(let $field = Argument::<$type>::read(&$kind, _words)?;)*
                    Ok($made.into())
                };
                vec![Verb { name: $verb, arguments: $arguments, help: $help, read }]
            }

            fn line(&self) -> String {
                let $parts = self;
                [$verb.to_owned(), $($kind.write($field)),*].concat()
            }

            fn visit(&mut self, _visit: &mut dyn FnMut(Named<'_>)) {
                let $parts = self;
                $($kind.visit($field, _visit);)*
            }

            $(command! { @method $method = $body; })*
        }
    };
    (@method prepare = $body:expr;) => {
        command! { @function prepare(setup: &mut Setup) -> Result<String, SessionError> = $body; }
    };
    (@method execute = $body:expr;) => {
        command! { @function execute(session: &mut Session) -> Result<String, SessionError> = $body; }
    };
    (@method check = $body:expr;) => {
        command! { @function check(setup: &mut Setup) -> Result<(), SessionError> = $body; }
    };
    (@method script_role = $body:expr;) => {
        command! { @function script_role() -> ScriptRole = $body; }
    };
    (@function $method:ident($($of:ident: $type:ty)?) -> $result:ty = $body:expr;) => {
        fn $method(&self $(, $of: $type)?) -> $result {
            let body: fn(&Self $(, $type)?) -> $result = $body;
            body(self $(, $of)?)
        }
    };
}
use command;

macro_rules! commands {
    ($($name:ident),* $(,)?) => {
        /// Something a user can do: its text is the line that parses to it.
        #[derive(Debug, Clone, PartialEq, Display, IsVariant)]
        #[display("{}", self.as_execute().line())]
        #[expect(missing_docs, reason = "each is documented where it is defined")]
        pub enum Command {
            $($name($name)),*
        }

        $(impl From<$name> for Command {
            fn from(command: $name) -> Self {
                Self::$name(command)
            }
        })*

        impl Command {
            /// Its implementation.
            pub(super) fn as_execute(&self) -> &dyn Execute {
                match self {
                    $(Self::$name(command) => command),*
                }
            }

            fn as_execute_mut(&mut self) -> &mut dyn Execute {
                match self {
                    $(Self::$name(command) => command),*
                }
            }
        }

        /// Every verb of the command language.
        pub fn verbs() -> impl Iterator<Item = &'static Verb> {
            static VERBS: LazyLock<Vec<Verb>> = LazyLock::new(|| [$($name::verbs()),*].concat());
            VERBS.iter()
        }
    };
}

// In the order of the help.
commands! {
    Task, Save, Undo, Redo, Edit, Propose,
    Seed, Method, Episodes, Epsilon, Set, Model, Out,
    ModelTrain, ModelStop,
    Clusters, Guide,
    Train, Pause, Resume, Stop, Open, Watch, Continue, Fork, Delete, Restore, EmptyTrash, Evaluate, Checkpoint, Note, Rename,
    Place, Reset,
    Figure, Expect, Record, Wait, Quit,
}

impl Command {
    /// Parses one line. None if it is empty or a comment (`#`).
    ///
    /// # Errors
    /// When the verb is unknown or the arguments are invalid.
    pub fn parse(line: &str) -> Result<Option<Self>, CommandError> {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            return Ok(None);
        }
        let unbalanced = |_| CommandError("a quote is not closed; usage: \"TEXT\"".to_owned());
        let words = shell_words::split(line).map_err(unbalanced)?;
        let (verb, rest) = find_verb(&words)?;
        let mut words = Words(rest);
        let command = (verb.read)(&mut words).and_then(|command| words.end().map(|()| command));
        command.map(Some).map_err(|problem| CommandError(format!("{problem}; usage: {}", verb.usage())))
    }

    /// The command with each folder of a run that it names replaced by what `replace` returns for it, if anything.
    ///
    /// # Errors
    /// Those of `replace`.
    pub(super) fn with_run_folders<E>(
        mut self,
        replace: impl Fn(&Path) -> Result<Option<PathBuf>, E>,
    ) -> Result<Self, E> {
        let mut outcome = Ok(());
        self.as_execute_mut().visit(&mut |named| {
            let Named::Run(folder) = named else { return };
            match replace(folder) {
                Ok(other) => *folder = other.unwrap_or_else(|| std::mem::take(folder)),
                Err(error) => outcome = Err(error),
            }
        });
        outcome.map(|()| self)
    }

    /// What `find` returns for the file that it writes, and its format; None if it writes none.
    pub(super) fn with_output<T>(&self, mut find: impl FnMut(&mut Target, &Format<'_>) -> T) -> Option<T> {
        let mut found = None;
        self.clone().as_execute_mut().visit(&mut |named| {
            if let Named::Output(to, format) = named {
                found = Some(find(to, format));
            }
        });
        found
    }

    /// The existing files whose content would be lost if the command were [forced](Self::forced): the one that it writes,
    /// with the table beside a figure.
    pub fn overwrites(&self) -> Vec<PathBuf> {
        let lost = self.with_output(|to, _| (!to.force && to.path.is_file()).then(|| to.path.clone())).flatten();
        let is_figure = matches!(self, Self::Figure(_));
        let table = lost.as_ref().filter(|_| is_figure).map(|path| path.with_extension("csv"));
        lost.into_iter().chain(table.filter(|table| table.is_file())).collect()
    }

    /// The command, replacing a file of any format.
    pub fn forced(mut self) -> Self {
        self.as_execute_mut().visit(&mut |named| {
            if let Named::Output(to, _) = named {
                to.force = true;
            }
        });
        self
    }

    /// Checks that the file that it writes may be replaced, unless that is `own`.
    ///
    /// # Errors
    /// When it is a file of another format.
    pub(super) fn check_output(&self, own: Option<&Path>) -> Result<(), RunError> {
        let check = |to: &mut Target, format: &Format<'_>| match own == Some(&to.path) {
            true => Ok(()),
            false => to.check(format).map_err(RunError::io("write", &to.path)),
        };
        self.with_output(check).unwrap_or(Ok(()))
    }
}

fn find_verb(words: &[String]) -> Result<(&'static Verb, &[String]), CommandError> {
    let parts = |verb: &Verb| verb.name.split(' ').count();
    let starts_with = |verb: &&Verb| verb.name.split(' ').eq(words.iter().take(parts(verb)));
    // `model train` is not `model` with an argument.
    if let Some(verb) = verbs().filter(starts_with).max_by_key(|verb| parts(verb)) {
        return Ok((verb, &words[parts(verb)..]));
    }
    let word = words.iter().take(2).map(String::as_str).collect::<Vec<_>>().join(" ");
    let names = || verbs().map(|verb| verb.name);
    let nearest = nearest(names(), &word).or_else(|| nearest(names(), words.first()?));
    Err(CommandError(format!("unknown command `{}`{}", words.join(" "), suggestion(nearest))))
}

/// A line that is not a valid command: an unknown verb, or arguments that are invalid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct CommandError(String);

#[cfg(test)]
mod tests {
    use super::*;

    /// One line for every verb.
    const LINES: &[&str] = &[
        "task task1",
        "save 'my tasks/new.json' force",
        "undo",
        "redo",
        "subgoal add 0.1 -0.2 5",
        "subgoal move 1 0.5 0.25",
        "subgoal size 2 3.5",
        "subgoal swap 1 2",
        "subgoal delete 1",
        "goal move -0.5 0",
        "goal size 6",
        "ball move 0 0.9",
        "tool add cannon 0.5 -0.5 30 angle=105 force=80.5",
        "tool move 1 0 0",
        "tool size 1 9",
        "tool set 2 angle=45 elasticity=1.2",
        "tool delete 1",
        "placeable ramp 14 angle=30",
        "part move ball-2 0.5 -0.25",
        "propose 2",
        "proposal accept 1",
        "proposal delete",
        "proposal move 2 0.5 -0.25",
        "proposal size 1 3.5",
        "seed 7",
        "method ddpg",
        "episodes 300",
        "epsilon linear:0.5:0:1000",
        "set ddpg.gamma 0.9",
        "model true",
        "model train bucket,box models/mine.safetensors 500",
        "model stop",
        "clusters",
        "guide",
        "out runs",
        "train runs/a seeds 3 until 100",
        "rename runs/a 'the best'",
        "pause",
        "resume until 200",
        "stop",
        "wait",
        "open runs/a",
        "watch 2",
        "delete runs/a",
        "empty-trash runs",
        "restore runs/a",
        "continue runs/a until 300",
        "fork 500 epsilon=0.1 ddpg.gamma=0.9 until 700",
        "evaluate",
        "checkpoint best",
        "note runs/a 'holds, but late'",
        "place 0.25 -0.5",
        "reset",
        "figure learning curves.png force 300 width=single",
        "expect success >= 0.5",
        "record session.mge",
        "quit",
    ];

    #[test]
    fn every_verb_reads_and_writes_the_same_line() {
        for verb in verbs() {
            let line =
                LINES.iter().find(|line| find_verb(&shell_words::split(line).unwrap()).unwrap().0.name == verb.name);
            let line = line.unwrap_or_else(|| panic!("no line for {}", verb.name));
            let command = Command::parse(line).unwrap().unwrap();
            assert_eq!(&command.to_string(), line);
        }
        let folder = Some("gamma=0.9".into());
        assert_eq!(Command::from(Train { folder, ..Default::default() }).to_string(), "train './gamma=0.9'");
    }

    #[test]
    fn a_note_needs_no_quotes() {
        let command = Command::parse("note runs/a holds, but  late").unwrap().unwrap();
        assert_eq!(command.to_string(), "note runs/a 'holds, but late'");
        assert!(Command::parse("note runs/a").unwrap_err().to_string().contains("a text is missing"));
    }

    #[test]
    fn comments_and_empty_lines_are_ignored() {
        assert_eq!(Command::parse("  # a comment"), Ok(None));
        assert_eq!(Command::parse(""), Ok(None));
    }

    #[test]
    fn mistakes_are_explained() {
        for (line, expected) in [
            ("trian", "did you mean `train`?"),
            ("subgoal mvoe 1 0 0", "did you mean `subgoal move`?"),
            ("subgoal move 0 0 0", "numbers count from 1"),
            ("subgoal move 1 0", "coordinate is missing; usage: subgoal move N X Y"),
            ("tool add rump 0 0", "unknown tool `rump`"),
            ("tool add ramp 0 0 x", "`x` is not a size"),
            ("tool set 1", "KEY=VALUE is missing; usage: tool set N KEY=VALUE..."),
            ("tool set 1 angel=30", "unknown property `angel`: use one of size, angle"),
            ("tool set 1 angle=steep", "`steep` is not a number for angle"),
            ("part move ball-0 0 0", "`ball-0` is not a part: use target, marker"),
            ("propose 0", "`0` is not a number of subgoals from 1 to 9"),
            ("proposal accept 0", "numbers count from 1"),
            ("seed x", "`x` is not a seed"),
            ("epsilon 2", "not between 0 and 1"),
            ("figure pie a.png", "unknown kind of figure `pie`: use one of scene, clusters"),
            ("fork 5 gamma", "`gamma` is not KEY=VALUE; usage: fork EPISODE [KEY=VALUE]... [in NAME] [until N]"),
            ("undo now", "`now` was not expected"),
            ("figure learning file=out.png", "`file=out.png` is not a file: write its name alone, or `./file=out.png`"),
            ("train epsilon=0.1", "`epsilon=0.1` is not a folder"),
            ("task 'a", "a quote is not closed"),
        ] {
            let error = Command::parse(line).unwrap_err().to_string();
            assert!(error.contains(expected), "{line}: {error}");
        }
    }

    #[test]
    fn verbs_are_unique_and_explained() {
        let all: Vec<&Verb> = verbs().collect();
        for (index, verb) in all.iter().enumerate() {
            assert!(all[index + 1..].iter().all(|other| other.name != verb.name), "{}", verb.name);
            assert!(!verb.help.is_empty() && verb.help.len() <= 80, "{}", verb.name);
        }
    }

    #[test]
    fn a_word_longer_than_any_verb_gets_no_suggestion() {
        let error = Command::parse(&"train".repeat(20)).unwrap_err();
        assert!(!error.to_string().contains("did you mean"), "{error}");
    }
}
