//! The question before a command is sent: what it may do, and whether that is wanted.
//!
//! A person at a terminal answers it. Where there is no terminal, only `--yes` sends a command. A command whose profile
//! wants a typed confirmation asks for the controller's key in place of a yes, so that no habit answers it; `--yes`
//! stands for that too, because who writes it has typed the controller and the command beside it.

use std::io::{self, IsTerminal};

use busbar_link::Endpoint;
use busbar_profile::{Command, Confirm, Profile, Risk};

use crate::{failure::Failure, terminal};

/// A question that waits for its answer.
pub(super) struct Question {
    text: String,
    /// What is to be typed; a yes where there is none.
    word: Option<String>,
}

impl Question {
    /// The question for a command, where somebody is there to answer it.
    pub(super) fn new(
        profile: &Profile,
        command: &Command,
        unit: u8,
        endpoint: &Endpoint,
    ) -> Result<Self, Failure> {
        if !io::stdin().is_terminal() || !io::stderr().is_terminal() {
            return Err(Failure::Call(format!(
                "{} of {} is not sent without a yes; give --yes, or call it from a terminal",
                command.id, profile.key
            )));
        }
        let word = command.confirm.map(|confirm| match confirm {
            Confirm::Typed => profile.key.clone(),
        });
        let ask = match &word {
            Some(word) => format!("Type {word} to send it: "),
            None => "Send it? [y/N] ".to_owned(),
        };
        let risk = risk(command.risk);
        let text = format!("{} for {}, unit {unit} at {endpoint}: {risk}.\n{ask}", command.name, profile.key);
        Ok(Self { text, word })
    }

    /// Asks it. Anything but the right answer is a no.
    pub(super) async fn ask(self) -> Result<(), Failure> {
        terminal::error_text(&self.text);
        let answer = tokio::task::spawn_blocking(|| {
            let mut line = String::new();
            io::stdin().read_line(&mut line).map(|_| line)
        });
        let answer = answer.await.ok().and_then(Result::ok).unwrap_or_default();
        if !answer.ends_with('\n') {
            // Ctrl-D leaves the cursor behind the question.
            terminal::error_text("\n");
        }
        if is_yes(answer.trim(), self.word.as_deref()) {
            return Ok(());
        }
        Err(Failure::Failed("nothing was sent, the answer was no".to_owned()))
    }
}

fn is_yes(answer: &str, word: Option<&str>) -> bool {
    match word {
        Some(word) => answer == word,
        None => answer.eq_ignore_ascii_case("y") || answer.eq_ignore_ascii_case("yes"),
    }
}

/// What a command may do, in words.
fn risk(risk: Risk) -> &'static str {
    match risk {
        Risk::None => "nothing moves",
        Risk::MayStartEngine => "the engine may start, now or later, by itself",
        Risk::StopsSupply => "the load may lose its supply",
        Risk::ResetsController => "the controller restarts",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_right_answer_is_a_yes() {
        for (answer, word, yes) in [
            ("y", None, true),
            ("YES", None, true),
            ("", None, false),
            ("yep", None, false),
            ("no", None, false),
            ("y", Some("datakom-d"), false),
            ("datakom-d", Some("datakom-d"), true),
            ("Datakom-D", Some("datakom-d"), false),
        ] {
            assert_eq!(is_yes(answer, word), yes, "{answer} {word:?}");
        }
    }
}
