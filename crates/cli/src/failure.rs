//! How a command ends when it does not end well: one sentence and an exit status.

use std::{error::Error, io, process::ExitCode};

use crate::{excerpt::Excerpts, terminal};

/// Why a command did not do what it was asked for.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The call itself is wrong: exit status 2.
    Call(String),
    /// Nothing was asked for: the help, and exit status 2.
    Help(String),
    /// What was asked for failed: exit status 1.
    Failed(String),
    /// A file is wrong in places that can be shown: exit status 1.
    Findings(Box<Excerpts>),
    /// The call names a file that is wrong in places that can be shown, where 1 means something else: exit status 2.
    CallFindings(Box<Excerpts>),
    /// The command failed and its own output says how: exit status 1.
    Reported,
    /// Standard output took no more. A closed pipe is the reader's way to say that it has seen enough.
    Output(io::Error),
}

impl Failure {
    /// An error of a room below, as the sentence it prints.
    pub(crate) fn failed(error: impl Error) -> Self {
        Self::Failed(error.to_string())
    }

    /// What went wrong, as sentences for a log.
    pub(crate) fn sentences(&self) -> Vec<String> {
        match self {
            Self::Call(sentence) | Self::Failed(sentence) => vec![sentence.clone()],
            Self::Findings(excerpts) | Self::CallFindings(excerpts) => excerpts.sentences().collect(),
            Self::Output(error) => vec![error.to_string()],
            Self::Help(_) | Self::Reported => Vec::new(),
        }
    }

    /// Says on standard error what went wrong, and gives the exit status.
    pub(crate) fn report(self) -> ExitCode {
        match self {
            Self::Call(sentence) => {
                terminal::message(&sentence);
                ExitCode::from(2)
            }
            Self::Help(text) => {
                terminal::error_text(&text);
                ExitCode::from(2)
            }
            Self::Failed(sentence) => {
                terminal::message(&sentence);
                ExitCode::FAILURE
            }
            Self::Findings(excerpts) => {
                terminal::error_text(&excerpts.render(terminal::error_is_coloured()));
                ExitCode::FAILURE
            }
            Self::CallFindings(excerpts) => {
                terminal::error_text(&excerpts.render(terminal::error_is_coloured()));
                ExitCode::from(2)
            }
            Self::Reported => ExitCode::FAILURE,
            Self::Output(error) if error.kind() == io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
            Self::Output(error) => {
                terminal::message(&format!(
                    "standard output cannot be written: {error}; free the disk or write elsewhere"
                ));
                ExitCode::FAILURE
            }
        }
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Output(error)
    }
}
