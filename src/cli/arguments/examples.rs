//! Examples in the help of commands, and the groups of commands in the help of the program.

use clap::{Command, CommandFactory};

use super::Arguments;

/// Commands as typed; each is an example in the help of the command that it begins with.
pub const EXAMPLES: [&str; 40] = [
    "mge runs/first",
    "mge tasks",
    "mge tasks check my-task.json",
    "mge tasks propose my-task.json --out with-subgoals.json",
    "mge puzzles generate --count 20 --split validation --out puzzles",
    "mge puzzles bench puzzles --method ddpg-adaptive --method ddpg-mge-adaptive",
    "mge simulate < scenes.jsonl",
    "mge play task1 --actions actions.json",
    "mge play --levels levels.jsonl < episodes.jsonl",
    "mge env serve task1",
    "mge env serve create/Push --tools train",
    "mge dynamics train --tools box,bucket --out model.safetensors",
    "mge dynamics evaluate model.safetensors",
    "mge selection train create/Push-random --out push.safetensors",
    "mge selection evaluate create/Push-random --policy push.safetensors",
    "mge clusters task1 --out clusters.json",
    "mge train task1 --until-solved",
    "mge train task4 --method ddpg --episodes 5000 --seed 3 --out runs/plain",
    "mge train task2 --model true --set start_noise=0.01",
    "mge config ddpg-mge-adaptive",
    "mge resume runs/first --episodes 3000",
    "mge fork runs/first --at 500 --set epsilon=0.1",
    "mge runs",
    "mge show runs/first",
    "mge compare runs/first runs/plain",
    "mge delete runs/first",
    "mge delete --restore runs/first",
    "mge rename runs/first \"first try\"",
    "mge evaluate runs/first --episodes 20",
    "mge evaluate runs/first --checkpoint best --task task3",
    "mge export runs/first --out actor.safetensors",
    "mge figures runs/first runs/plain --set against=charged",
    "mge script assets/scripts/tour.mge --define out=results",
    "mge sweep assets/sweeps/small.json",
    "mge sweep assets/sweeps/small.json --plan | parallel",
    "mge sweep assets/sweeps/small.json --slurm | sbatch",
    "mge report sweeps/small --out report",
    "mge reproduce --quick",
    "mge man > mge.1",
    "mge completions bash > ~/.local/share/bash-completion/completions/mge",
];

/// The groups of commands, each by its first one.
const GROUPS: [(&str, &str); 6] = [
    ("tasks", "Tasks"),
    ("dynamics", "Models, and agents that choose among tools"),
    ("train", "Training"),
    ("runs", "Runs"),
    ("script", "Experiments"),
    ("man", "Help"),
];

/// The command line, with its commands in groups, and with examples in the help of every command.
pub fn command() -> Command {
    let examples = EXAMPLES.map(|line| (line.trim_start_matches("mge "), line));
    grouped(with_examples(Arguments::command(), &examples))
}

/// Puts a heading above each group of commands in the help, which clap does only for arguments.
pub fn grouped(command: Command) -> Command {
    let listed = command.clone().disable_help_subcommand(true).help_template("{subcommands}").render_help();
    let styles = command.get_styles();
    let (heading, name) = (*styles.get_header(), *styles.get_literal());
    let listed = GROUPS.iter().fold(listed.ansi().to_string(), |listed, (first, title)| {
        let line = format!("  {name}{first}{name:#}");
        listed.replace(&line, &format!("\n{heading}{title}:{heading:#}\n{line}"))
    });
    command.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n{}\n\n{heading}Arguments:{heading:#}\n{{positionals}}\n\n\
         {heading}Options:{heading:#}\n{{options}}{{after-help}}",
        listed.trim_end()
    ))
}

/// Adds examples, each with what follows the command's own name, to the help of the command and those below it.
fn with_examples(command: Command, examples: &[(&'static str, &'static str)]) -> Command {
    let split = |(rest, _): &(&'static str, &str)| rest.split_once(' ').unwrap_or((rest, ""));
    let is_own = |example: &&(&'static str, &str)| command.find_subcommand(split(example).0).is_none();
    let mut own: Vec<&str> = examples.iter().filter(is_own).map(|(_, line)| *line).collect();
    // A group of commands shows the first example of what is below it.
    own.extend(examples.first().filter(|_| own.is_empty()).map(|(_, line)| *line));
    let command = match own.len() {
        0 => command,
        1 => command.after_help(format!("Example: {}", own[0])),
        _ => command.after_help(format!("Examples:\n  {}", own.join("\n  "))),
    };
    command.mut_subcommands(|inner| {
        let below = examples.iter().filter(|example| split(example).0 == inner.get_name());
        let below: Vec<_> = below.map(|example| (split(example).1, example.1)).collect();
        with_examples(inner, &below)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_examples_that_it_accepts() {
        for line in EXAMPLES {
            let typed = line.split(['<', '|', '>']).next().unwrap_or_default();
            let words = shell_words::split(typed).unwrap();
            let _ = command().try_get_matches_from(words).unwrap_or_else(|error| panic!("{line}: {error}"));
        }
        fn check(command: &Command) {
            assert!(command.get_after_help().is_some(), "`{}` has no example", command.get_name());
            command.get_subcommands().for_each(check);
        }
        check(&command());
    }

    #[test]
    fn every_command_is_in_a_group() {
        let help = command().render_help().to_string();
        let commands = Arguments::command();
        let names = commands.get_subcommands().map(Command::get_name);
        assert!(names.into_iter().all(|name| help.contains(&format!("\n  {name} "))), "{help}");
        let of =
            |name: &str| help[..help.find(&format!("\n  {name} ")).unwrap() + 1].rfind(":\n").map(|at| &help[..at]);
        let title = |name: &str| of(name).and_then(|before| before.lines().last()).unwrap_or_default();
        let found = ["tasks", "env", "clusters", "fork", "figures", "reproduce", "completions"].map(title);
        let [tasks, models, training, runs, experiments, last] = GROUPS.map(|(_, title)| title);
        assert_eq!(found, [tasks, tasks, models, training, runs, experiments, last]);
    }
}
