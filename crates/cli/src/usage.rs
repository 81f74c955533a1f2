//! What is wrong with a call, as one sentence.

use std::error::Error as _;

use clap::error::{ContextKind, ContextValue, ErrorKind};

use crate::{failure::Failure, terminal};

/// A call that the argument parser refused.
pub(crate) fn failure(error: &clap::Error) -> Failure {
    match error.kind() {
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            Failure::Help(terminal::help(error, terminal::error_is_coloured()))
        }
        _ => Failure::Call(sentence(error)),
    }
}

/// The sentence for a call that the argument parser refused: what, where, and what to write instead.
fn sentence(error: &clap::Error) -> String {
    let argument = text(error, ContextKind::InvalidArg);
    match error.kind() {
        ErrorKind::ValueValidation => {
            let value = text(error, ContextKind::InvalidValue);
            let why = error.source().map(ToString::to_string).unwrap_or_default();
            format!("{argument} cannot be \"{value}\": {why}")
        }
        ErrorKind::InvalidValue if text(error, ContextKind::InvalidValue).is_empty() => {
            format!("{argument} needs a value; write it behind the option")
        }
        ErrorKind::UnknownArgument => {
            let kind = if argument.starts_with('-') { "option" } else { "argument" };
            match error.get(ContextKind::SuggestedArg) {
                Some(meant) => format!("there is no {kind} \"{argument}\" here; did you mean {meant}?"),
                None => format!("there is no {kind} \"{argument}\" here; {}", see(error)),
            }
        }
        ErrorKind::InvalidSubcommand => {
            let command = text(error, ContextKind::InvalidSubcommand);
            match error.get(ContextKind::SuggestedSubcommand) {
                Some(meant) => format!("there is no command \"{command}\"; did you mean {meant}?"),
                None => format!("there is no command \"{command}\"; {}", see(error)),
            }
        }
        ErrorKind::MissingSubcommand => format!("no command is given; {}", see(error)),
        ErrorKind::MissingRequiredArgument => format!("{argument} is missing; write {}", usage(error)),
        ErrorKind::ArgumentConflict if argument == text(error, ContextKind::PriorArg) => {
            format!("{argument} is given twice; give it once")
        }
        _ => {
            let rendered = error.render().to_string();
            let first = rendered.lines().next().unwrap_or_default();
            format!("{}; {}", first.trim_start_matches("error: "), see(error))
        }
    }
}

fn text(error: &clap::Error, kind: ContextKind) -> String {
    error.get(kind).map(ContextValue::to_string).unwrap_or_default()
}

fn usage(error: &clap::Error) -> String {
    text(error, ContextKind::Usage)
        .trim_start_matches("Usage:")
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
}

/// Points at the help of the command that was called.
fn see(error: &clap::Error) -> String {
    let usage = usage(error);
    let command: Vec<&str> = usage.split(' ').take_while(|word| !word.starts_with(['[', '<', '-'])).collect();
    let command = if usage.is_empty() { "busbar".to_owned() } else { command.join(" ") };
    format!("see \"{command} --help\"")
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::Args;

    #[test]
    fn says_what_and_what_to_do() {
        for (call, expected) in [
            ("frobnicate", "there is no command \"frobnicate\"; see \"busbar --help\""),
            ("--json", "no command is given; see \"busbar --help\""),
            ("decod", "there is no command \"decod\"; did you mean demo, decode?"),
            ("profile frob", "there is no command \"frob\"; see \"busbar profile --help\""),
            ("profile list more", "there is no argument \"more\" here; see \"busbar profile list --help\""),
            ("profile list --jso", "there is no option \"--jso\" here; did you mean --json?"),
            ("decode", "<KEY>, <ADDRESS>, <REG>... is missing; write busbar decode <KEY> <ADDRESS> <REG>..."),
            (
                "decode datakom-d 70000 0",
                "<ADDRESS> cannot be \"70000\": an address is 0 to 65535, decimal or hex behind 0x",
            ),
            (
                "decode datakom-d 1 0zz",
                "<REG>... cannot be \"0zz\": a register is one to four hex digits, for example 08FE",
            ),
            (
                "registers tcp://127.0.0.1:1 0 1 --unit",
                "--unit <N> needs a value; write it behind the option",
            ),
            ("registers tcp://127.0.0.1:1 0 1 --unit 1 --unit 2", "--unit <N> is given twice; give it once"),
        ] {
            let error = Args::try_parse_from(["busbar"].into_iter().chain(call.split(' '))).expect_err(call);
            assert_eq!(sentence(&error), expected, "busbar {call}");
        }
    }
}
