//! The command language: one command, one line.

use std::fmt;
use std::path::PathBuf;

use crate::guidance::EpsilonSchedule;
use crate::physics::ToolKind;
use crate::task::Edit;
use crate::trainer::{Method, PriorSource};

/// A verb of the language, for help, completion and the manual.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verb {
    /// The words it begins with.
    pub name: &'static str,
    /// What follows them.
    pub arguments: &'static str,
    /// What it does, in one line.
    pub help: &'static str,
}

/// Every verb there is.
pub const VERBS: &[Verb] = &[
    verb("task", "NAME|FILE", "load a shipped task or a task file"),
    verb("save", "[FILE]", "save the edited task"),
    verb("undo", "", "take the latest edit back"),
    verb("redo", "", "make the undone edit again"),
    verb("subgoal add", "X Y [RADIUS]", "append a subgoal"),
    verb("subgoal move", "N X Y", "move subgoal N (from 1) to normalised X Y"),
    verb("subgoal size", "N RADIUS", "resize a subgoal, in units"),
    verb("subgoal swap", "N M", "exchange two subgoals in the order"),
    verb("subgoal delete", "N", "delete a subgoal"),
    verb("goal move", "X Y", "move the goal"),
    verb("goal size", "RADIUS", "resize the goal, in units"),
    verb("ball move", "X Y", "move the ball's start"),
    verb("tool add", "TYPE X Y [SIZE]", "add a static tool: bucket, square, box, wall or floor"),
    verb("tool move", "N X Y", "move a static tool (from 1)"),
    verb("tool size", "N SIZE", "resize a static tool, in units"),
    verb("tool delete", "N", "delete a static tool"),
    verb("seed", "N", "set the master seed"),
    verb("method", "ddpg|ddpg-mge", "choose the algorithm"),
    verb("episodes", "N", "set the number of training episodes"),
    verb("epsilon", "SPEC", "set the epsilon threshold; a running training takes it at its next episode"),
    verb("set", "KEY VALUE", "set any setting of the run by its JSON path, such as ddpg.critic_learning_rate 1e-4"),
    verb("model train", "TYPE,... FILE [EPOCHS]", "train a dynamics model of these tool types, in the background"),
    verb("model evaluate", "FILE|NAME", "measure a dynamics model on fresh launches and unseen scenes"),
    verb("model stop", "", "end the training or evaluation of a dynamics model; nothing of it is kept"),
    verb("model", "learned|true|uniform|FILE", "choose what predicts the rollouts behind the clusters"),
    verb("clusters", "[FILE]", "compute the action clusters anew, and save them to a file"),
    verb("guide", "", "give the action clusters to the running training"),
    verb("out", "FOLDER", "choose the folder for runs"),
    verb("train", "[FOLDER] [until N]", "start a run, or queue it; with `until`, pause it after N episodes"),
    verb("pause", "", "pause the run"),
    verb("resume", "[until N]", "go on with the paused run"),
    verb("stop", "", "save a checkpoint and end the run"),
    verb("wait", "", "wait until the run pauses or ends, or the clusters are there"),
    verb("open", "FOLDER", "open a run that is on disk"),
    verb("watch", "N", "act on run N of the session, counted from 1 in the order they began"),
    verb("delete", "FOLDER", "delete a run that nobody works on, with all its files"),
    verb("continue", "[FOLDER]", "go on with a run from its checkpoint"),
    verb("evaluate", "", "play the greedy policy of the run"),
    verb("place", "X Y", "hand play: place the tool and let the world run"),
    verb("reset", "", "hand play: start again"),
    verb("figure", "KIND FILE", "export a figure: scene, clusters, learning, dashboard or episode"),
    verb("expect", "WHAT OP VALUE", "fail the script unless it holds, such as expect success >= 0.5"),
    verb("record", "FILE", "save the session so far as a script"),
    verb("quit", "", "leave; a running training is checkpointed first"),
];

const fn verb(name: &'static str, arguments: &'static str, help: &'static str) -> Verb {
    Verb { name, arguments, help }
}

/// Something a person can do.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Load a shipped task or a task file.
    Task(String),
    /// Save the edited task.
    Save(Option<PathBuf>),
    /// Take the latest edit back.
    Undo,
    /// Make the undone edit again.
    Redo,
    /// Change the task.
    Edit(Edit),
    /// Set the master seed.
    Seed(u64),
    /// Choose the algorithm.
    Method(Method),
    /// Set the number of training episodes.
    Episodes(u32),
    /// Set the epsilon threshold.
    Epsilon(EpsilonSchedule),
    /// Set any setting of the run by its JSON path.
    Set { key: String, value: String },
    /// Choose what predicts the rollouts.
    Model(PriorSource),
    /// Train a dynamics model in the background.
    ModelTrain { tools: Vec<ToolKind>, path: PathBuf, epochs: Option<u32> },
    /// End what is being done about a dynamics model.
    ModelStop,
    /// Measure a dynamics model in the background.
    ModelEvaluate(String),
    /// Compute the action clusters anew.
    Clusters(Option<PathBuf>),
    /// Give the action clusters to the running training.
    Guide,
    /// Choose the folder for runs.
    Out(PathBuf),
    /// Start a run.
    Train { folder: Option<PathBuf>, until: Option<u32> },
    /// Pause the run.
    Pause,
    /// Go on with the paused run.
    Resume { until: Option<u32> },
    /// End the run.
    Stop,
    /// Wait for the run or the clusters.
    Wait,
    /// Open a run that is on disk.
    Open(PathBuf),
    /// Act on another run of the session, numbered from 0.
    Watch(usize),
    /// Delete a run from the disk.
    Delete(PathBuf),
    /// Go on with a run from its checkpoint.
    Continue(Option<PathBuf>),
    /// Play the greedy policy of the run.
    Evaluate,
    /// Hand play: place the tool.
    Place([f32; 2]),
    /// Hand play: start again.
    Reset,
    /// Export a figure.
    Figure { kind: FigureKind, path: PathBuf },
    /// Fail unless it holds.
    Expect(Expectation),
    /// Save the session so far as a script.
    Record(PathBuf),
    /// Leave.
    Quit,
}

/// A figure of the session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FigureKind {
    /// The task's scene.
    Scene,
    /// The action clusters over the scene.
    Clusters,
    /// Rolling success of the session's runs.
    Learning,
    /// Everything logged of the current run.
    Dashboard,
    /// The latest episode, animated.
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

/// What `expect` can look at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Episodes the current run has finished.
    Episodes,
    /// Rolling success of the current run, 0 to 1.
    Success,
    /// Success of the latest greedy evaluation, 0 to 1.
    Greedy,
    /// Action clusters over all stages.
    Clusters,
    /// Subgoals of the task.
    Subgoals,
}

impl Quantity {
    const ALL: [Self; 5] = [Self::Episodes, Self::Success, Self::Greedy, Self::Clusters, Self::Subgoals];

    /// The name in the language.
    pub fn name(self) -> &'static str {
        match self {
            Self::Episodes => "episodes",
            Self::Success => "success",
            Self::Greedy => "greedy",
            Self::Clusters => "clusters",
            Self::Subgoals => "subgoals",
        }
    }
}

/// A comparison that must hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expectation {
    /// The quantity.
    pub quantity: Quantity,
    /// How it is compared.
    pub comparison: Comparison,
    /// With what.
    pub value: f64,
}

/// How two numbers are compared.
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

/// A line that is no command.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CommandError {
    /// No verb of the language.
    #[error("unknown command `{word}`{}", suggestion(nearest))]
    Unknown { word: String, nearest: Option<String> },
    /// The verb takes other arguments.
    #[error("{problem}; usage: {usage}")]
    Usage { problem: String, usage: String },
}

fn suggestion(nearest: &Option<String>) -> String {
    nearest.as_ref().map(|name| format!(": did you mean `{name}`?")).unwrap_or_default()
}

impl Command {
    /// Reads one line. None if it is empty or a comment (`#`).
    ///
    /// # Errors
    /// When the verb is unknown or its arguments are not what it takes.
    pub fn parse(line: &str) -> Result<Option<Self>, CommandError> {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            return Ok(None);
        }
        let unbalanced = |_| CommandError::Usage { problem: "a quote is not closed".into(), usage: "\"TEXT\"".into() };
        let words = shell_words::split(line).map_err(unbalanced)?;
        let (verb, rest) = find_verb(&words)?;
        let problem = |problem| CommandError::Usage { problem, usage: format!("{} {}", verb.name, verb.arguments) };
        let arguments = Arguments { words: rest, next: 0 };
        read(verb.name, arguments).map(Some).map_err(problem)
    }
}

fn find_verb(words: &[String]) -> Result<(&'static Verb, &[String]), CommandError> {
    let starts_with = |verb: &&Verb| {
        let parts: Vec<&str> = verb.name.split(' ').collect();
        words.len() >= parts.len() && parts.iter().zip(words).all(|(part, word)| part == word)
    };
    if let Some(verb) = VERBS.iter().find(starts_with) {
        return Ok((verb, &words[verb.name.split(' ').count()..]));
    }
    let typed = words.iter().take(2).map(String::as_str).collect::<Vec<_>>().join(" ");
    let closeness = |verb: &Verb| {
        let one = strsim::jaro_winkler(verb.name, words.first().map_or("", String::as_str));
        one.max(strsim::jaro_winkler(verb.name, &typed))
    };
    let nearest = VERBS.iter().max_by(|a, b| closeness(a).total_cmp(&closeness(b))).filter(|v| closeness(v) > 0.75);
    Err(CommandError::Unknown { word: typed, nearest: nearest.map(|verb| verb.name.to_owned()) })
}

/// The words after a verb, taken one by one.
struct Arguments<'a> {
    words: &'a [String],
    next: usize,
}

impl Arguments<'_> {
    fn optional(&mut self) -> Option<&str> {
        let word = self.words.get(self.next)?;
        self.next += 1;
        Some(word)
    }

    fn word(&mut self, what: &str) -> Result<&str, String> {
        self.optional().ok_or_else(|| format!("{what} is missing"))
    }

    fn number<T: std::str::FromStr>(&mut self, what: &str) -> Result<T, String> {
        let word = self.word(what)?;
        word.parse().map_err(|_| format!("`{word}` is not a {what}"))
    }

    fn optional_number<T: std::str::FromStr>(&mut self, what: &str) -> Result<Option<T>, String> {
        if self.next < self.words.len() { self.number(what).map(Some) } else { Ok(None) }
    }

    fn position(&mut self) -> Result<[f32; 2], String> {
        Ok([self.number("coordinate")?, self.number("coordinate")?])
    }

    /// A number that counts from 1 in the language and from 0 inside.
    fn index(&mut self) -> Result<usize, String> {
        let number: usize = self.number("number")?;
        number.checked_sub(1).ok_or_else(|| "numbers count from 1".to_owned())
    }

    fn path(&mut self) -> Option<PathBuf> {
        self.optional().map(PathBuf::from)
    }

    fn until(&mut self) -> Result<Option<u32>, String> {
        match self.optional() {
            None => Ok(None),
            Some("until") => self.number("number of episodes").map(Some),
            Some(other) => Err(format!("`{other}` was not expected")),
        }
    }

    fn one_of<T: Copy>(&mut self, what: &str, all: &[T], name: fn(T) -> &'static str) -> Result<T, String> {
        let word = self.word(what)?;
        let known = || all.iter().map(|item| name(*item)).collect::<Vec<_>>().join(", ");
        all.iter()
            .copied()
            .find(|item| name(*item) == word)
            .ok_or_else(|| format!("`{word}` is not one of {}", known()))
    }
}

fn read(verb: &str, mut arguments: Arguments<'_>) -> Result<Command, String> {
    let args = &mut arguments;
    let command = match verb {
        "task" => Command::Task(args.word("a task")?.to_owned()),
        "save" => Command::Save(args.path()),
        "undo" => Command::Undo,
        "redo" => Command::Redo,
        "seed" => Command::Seed(args.number("seed")?),
        "method" => Command::Method(args.word("a method")?.parse()?),
        "episodes" => Command::Episodes(args.number("number of episodes")?),
        "epsilon" => {
            let spec = args.word("a schedule")?;
            Command::Epsilon(spec.parse().map_err(|error: crate::guidance::ScheduleError| error.to_string())?)
        }
        "set" => Command::Set { key: args.word("a key")?.to_owned(), value: args.word("a value")?.to_owned() },
        "model train" => Command::ModelTrain {
            tools: args.word("tool types")?.split(',').map(str::parse).collect::<Result<_, String>>()?,
            path: args.word("a file")?.into(),
            epochs: args.optional_number("number of epochs")?,
        },
        "model stop" => Command::ModelStop,
        "model evaluate" => Command::ModelEvaluate(args.word("a model")?.to_owned()),
        "model" => Command::Model(PriorSource::from(args.word("a model")?.to_owned())),
        "clusters" => Command::Clusters(args.path()),
        "guide" => Command::Guide,
        "out" => Command::Out(args.word("a folder")?.into()),
        "train" => {
            let first = args.optional().map(str::to_owned);
            if first.as_deref() == Some("until") {
                args.next = 0;
                Command::Train { folder: None, until: args.until()? }
            } else {
                Command::Train { folder: first.map(PathBuf::from), until: args.until()? }
            }
        }
        "pause" => Command::Pause,
        "resume" => Command::Resume { until: args.until()? },
        "stop" => Command::Stop,
        "wait" => Command::Wait,
        "open" => Command::Open(args.word("a run's folder")?.into()),
        "watch" => Command::Watch(args.index()?),
        "delete" => Command::Delete(args.word("a run's folder")?.into()),
        "continue" => Command::Continue(args.path()),
        "evaluate" => Command::Evaluate,
        "place" => Command::Place(args.position()?),
        "reset" => Command::Reset,
        "figure" => Command::Figure {
            kind: args.one_of("a kind", &FigureKind::ALL, FigureKind::name)?,
            path: args.word("a file")?.into(),
        },
        "expect" => Command::Expect(Expectation {
            quantity: args.one_of("a quantity", &Quantity::ALL, Quantity::name)?,
            comparison: args.one_of("a comparison", &Comparison::ALL, Comparison::sign)?,
            value: args.number("number")?,
        }),
        "record" => Command::Record(args.word("a file")?.into()),
        "quit" => Command::Quit,
        edit => Command::Edit(read_edit(edit, args)?),
    };
    match args.optional() {
        Some(extra) => Err(format!("`{extra}` was not expected")),
        None => Ok(command),
    }
}

fn read_edit(verb: &str, args: &mut Arguments<'_>) -> Result<Edit, String> {
    Ok(match verb {
        "subgoal add" => {
            Edit::AddSubgoal { position: args.position()?, radius: args.optional_number("radius")?.unwrap_or(4.0) }
        }
        "subgoal move" => Edit::MoveSubgoal { index: args.index()?, position: args.position()? },
        "subgoal size" => Edit::ResizeSubgoal { index: args.index()?, radius: args.number("radius")? },
        "subgoal swap" => Edit::SwapSubgoals { first: args.index()?, second: args.index()? },
        "subgoal delete" => Edit::DeleteSubgoal { index: args.index()? },
        "goal move" => Edit::MoveGoal { position: args.position()? },
        "goal size" => Edit::ResizeGoal { radius: args.number("radius")? },
        "ball move" => Edit::MoveBall { position: args.position()? },
        "tool add" => Edit::AddTool {
            kind: args.word("a type")?.parse::<ToolKind>()?,
            position: args.position()?,
            size: args.optional_number("size")?,
        },
        "tool move" => Edit::MoveTool { index: args.index()?, position: args.position()? },
        "tool size" => Edit::ResizeTool { index: args.index()?, size: args.number("size")? },
        "tool delete" => Edit::DeleteTool { index: args.index()? },
        // Only a verb of the table gets here, and a test reads them all.
        other => return Err(format!("`{other}` is not implemented")),
    })
}

impl fmt::Display for Command {
    /// The line that is read back as this command.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let quote = |text: &str| shell_words::quote(text).into_owned();
        let path = |path: &PathBuf| quote(&path.display().to_string());
        let optional = |value: &Option<PathBuf>| value.as_ref().map(|p| format!(" {}", path(p))).unwrap_or_default();
        let until = |value: &Option<u32>| value.map(|n| format!(" until {n}")).unwrap_or_default();
        match self {
            Self::Task(name) => write!(f, "task {}", quote(name)),
            Self::Save(file) => write!(f, "save{}", optional(file)),
            Self::Undo => f.write_str("undo"),
            Self::Redo => f.write_str("redo"),
            Self::Edit(edit) => write_edit(edit, f),
            Self::Seed(seed) => write!(f, "seed {seed}"),
            Self::Method(method) => write!(f, "method {method}"),
            Self::Episodes(episodes) => write!(f, "episodes {episodes}"),
            Self::Epsilon(schedule) => write!(f, "epsilon {schedule}"),
            Self::Set { key, value } => write!(f, "set {} {}", quote(key), quote(value)),
            Self::Model(source) => write!(f, "model {}", quote(&String::from(source.clone()))),
            Self::ModelTrain { tools, path: file, epochs } => {
                let tools = tools.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
                let epochs = epochs.map(|epochs| format!(" {epochs}")).unwrap_or_default();
                write!(f, "model train {tools} {}{epochs}", path(file))
            }
            Self::ModelStop => f.write_str("model stop"),
            Self::ModelEvaluate(model) => write!(f, "model evaluate {}", quote(model)),
            Self::Clusters(file) => write!(f, "clusters{}", optional(file)),
            Self::Guide => f.write_str("guide"),
            Self::Out(folder) => write!(f, "out {}", path(folder)),
            Self::Train { folder, until: at } => write!(f, "train{}{}", optional(folder), until(at)),
            Self::Pause => f.write_str("pause"),
            Self::Resume { until: at } => write!(f, "resume{}", until(at)),
            Self::Stop => f.write_str("stop"),
            Self::Wait => f.write_str("wait"),
            Self::Open(folder) => write!(f, "open {}", path(folder)),
            Self::Watch(number) => write!(f, "watch {}", number + 1),
            Self::Delete(folder) => write!(f, "delete {}", path(folder)),
            Self::Continue(folder) => write!(f, "continue{}", optional(folder)),
            Self::Evaluate => f.write_str("evaluate"),
            Self::Place([x, y]) => write!(f, "place {x} {y}"),
            Self::Reset => f.write_str("reset"),
            Self::Figure { kind, path: file } => write!(f, "figure {} {}", kind.name(), path(file)),
            Self::Expect(Expectation { quantity, comparison, value }) => {
                write!(f, "expect {} {} {value}", quantity.name(), comparison.sign())
            }
            Self::Record(file) => write!(f, "record {}", path(file)),
            Self::Quit => f.write_str("quit"),
        }
    }
}

fn write_edit(edit: &Edit, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match *edit {
        Edit::AddSubgoal { position: [x, y], radius } => write!(f, "subgoal add {x} {y} {radius}"),
        Edit::MoveSubgoal { index, position: [x, y] } => write!(f, "subgoal move {} {x} {y}", index + 1),
        Edit::ResizeSubgoal { index, radius } => write!(f, "subgoal size {} {radius}", index + 1),
        Edit::SwapSubgoals { first, second } => write!(f, "subgoal swap {} {}", first + 1, second + 1),
        Edit::DeleteSubgoal { index } => write!(f, "subgoal delete {}", index + 1),
        Edit::MoveGoal { position: [x, y] } => write!(f, "goal move {x} {y}"),
        Edit::ResizeGoal { radius } => write!(f, "goal size {radius}"),
        Edit::MoveBall { position: [x, y] } => write!(f, "ball move {x} {y}"),
        Edit::AddTool { kind, position: [x, y], size } => {
            write!(f, "tool add {kind} {x} {y}{}", size.map(|size| format!(" {size}")).unwrap_or_default())
        }
        Edit::MoveTool { index, position: [x, y] } => write!(f, "tool move {} {x} {y}", index + 1),
        Edit::ResizeTool { index, size } => write!(f, "tool size {} {size}", index + 1),
        Edit::DeleteTool { index } => write!(f, "tool delete {}", index + 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One line for every verb.
    const LINES: &[&str] = &[
        "task task1",
        "save 'my tasks/new.json'",
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
        "tool add wall 0.5 0.5 30",
        "tool move 1 0 0",
        "tool size 1 9",
        "tool delete 1",
        "seed 7",
        "method ddpg",
        "episodes 300",
        "epsilon linear:0.5:0:1000",
        "set ddpg.gamma 0.9",
        "model true",
        "model train bucket,box models/mine.safetensors 500",
        "model evaluate bucket-box",
        "model stop",
        "clusters",
        "guide",
        "out runs",
        "train runs/a until 100",
        "pause",
        "resume until 200",
        "stop",
        "wait",
        "open runs/a",
        "watch 2",
        "delete runs/a",
        "continue runs/a",
        "evaluate",
        "place 0.25 -0.5",
        "reset",
        "figure learning curves.png",
        "expect success >= 0.5",
        "record session.mge",
        "quit",
    ];

    #[test]
    fn every_verb_reads_and_writes_the_same_line() {
        for verb in VERBS {
            let line = LINES.iter().find(|line| find_verb(&shell_words::split(line).unwrap()).unwrap().0 == verb);
            let line = line.unwrap_or_else(|| panic!("no line for {}", verb.name));
            let command = Command::parse(line).unwrap().unwrap();
            assert_eq!(&command.to_string(), line);
        }
    }

    #[test]
    fn comments_and_empty_lines_are_nothing() {
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
            ("seed x", "`x` is not a seed"),
            ("epsilon 2", "not within 0 and 1"),
            ("figure pie a.png", "`pie` is not one of scene, clusters"),
            ("undo now", "`now` was not expected"),
            ("task 'a", "a quote is not closed"),
        ] {
            let error = Command::parse(line).unwrap_err().to_string();
            assert!(error.contains(expected), "{line}: {error}");
        }
    }
}
