//! From a line to a command.

use std::path::PathBuf;

use super::{Command, CommandError, Comparison, Expectation, FigureKind, Quantity};
use crate::physics::ToolKind;
use crate::spelling::did_you_mean;
use crate::task::Edit;
use crate::trainer::PriorSource;
use crate::workbench::registry::{Verb, verbs};

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

pub(super) fn find_verb(words: &[String]) -> Result<(&'static Verb, &[String]), CommandError> {
    let starts_with = |verb: &&Verb| {
        let parts: Vec<&str> = verb.name.split(' ').collect();
        words.len() >= parts.len() && parts.iter().zip(words).all(|(part, word)| part == word)
    };
    // `model train` is not `model` with an argument.
    let parts = |verb: &Verb| verb.name.split(' ').count();
    if let Some(verb) = verbs().filter(starts_with).max_by_key(|verb| parts(verb)) {
        return Ok((verb, &words[parts(verb)..]));
    }
    let typed = words.iter().take(2).map(String::as_str).collect::<Vec<_>>().join(" ");
    let closeness = |verb: &Verb| {
        let one = strsim::jaro_winkler(verb.name, words.first().map_or("", String::as_str));
        one.max(strsim::jaro_winkler(verb.name, &typed))
    };
    let nearest = verbs().max_by(|a, b| closeness(a).total_cmp(&closeness(b))).filter(|v| closeness(v) > 0.75);
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

    fn optional_index(&mut self) -> Result<Option<usize>, String> {
        if self.next < self.words.len() { self.index().map(Some) } else { Ok(None) }
    }

    fn optional_count(&mut self, most: usize) -> Result<Option<usize>, String> {
        match self.optional_number("number of subgoals")? {
            Some(count) if !(1..=most).contains(&count) => {
                Err(format!("`{count}` is not a number of subgoals from 1 to {most}"))
            }
            count => Ok(count),
        }
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
        all.iter().copied().find(|item| name(*item) == word).ok_or_else(|| {
            let known: Vec<&str> = all.iter().map(|item| name(*item)).collect();
            let hint = did_you_mean(known.iter().copied(), word);
            format!("`{word}` is not one of {}{hint}", known.join(", "))
        })
    }
}

fn read(verb: &str, mut arguments: Arguments<'_>) -> Result<Command, String> {
    let args = &mut arguments;
    let command = match verb {
        "task" => Command::Task(args.word("a task")?.to_owned()),
        "save" => Command::Save(args.path()),
        "undo" => Command::Undo,
        "redo" => Command::Redo,
        "propose" => Command::Propose(args.optional_count(9)?),
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
            dpi: args.optional_number("resolution")?,
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
        "proposal move" => Edit::MoveProposal { index: args.index()?, position: args.position()? },
        "proposal size" => Edit::ResizeProposal { index: args.index()?, radius: args.number("radius")? },
        "proposal accept" => Edit::AcceptProposal { index: args.optional_index()? },
        "proposal delete" => Edit::DeleteProposal { index: args.optional_index()? },
        // Only a verb of the table gets here, and a test reads them all.
        other => return Err(format!("`{other}` is not implemented")),
    })
}
