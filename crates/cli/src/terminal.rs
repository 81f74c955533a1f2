//! Standard output and standard error: what is printed where, and whether it may be coloured.

use std::{
    env,
    io::{self, IsTerminal, Write},
};

use serde::Serialize;

/// Prints text for people or programs on standard output, at once.
pub(crate) fn print(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()
}

/// Prints one JSON document on a line of its own.
pub(crate) fn print_json(document: &impl Serialize) -> io::Result<()> {
    let mut text = serde_json::to_string(document)?;
    text.push('\n');
    print(&text)
}

/// Prints the help that was asked for.
pub(crate) fn print_help(help: &clap::Error) -> io::Result<()> {
    print(&self::help(help, style().coloured))
}

/// The help, coloured or not.
pub(crate) fn help(help: &clap::Error, coloured: bool) -> String {
    let help = help.render();
    if coloured { help.ansi().to_string() } else { help.to_string() }
}

/// A message about the work, on standard error. Nothing can be done when even that is closed.
pub(crate) fn message(sentence: &str) {
    error_text(&format!("busbar: {sentence}\n"));
}

/// Text on standard error as it is.
pub(crate) fn error_text(text: &str) {
    let _ = io::stderr().lock().write_all(text.as_bytes());
}

/// The look of what goes to standard output.
pub(crate) fn style() -> Style {
    Style { coloured: io::stdout().is_terminal() && colour_is_wanted() }
}

/// Columns of the terminal that standard output is; none where it is none.
pub(crate) fn width() -> Option<usize> {
    let (width, _) = terminal_size::terminal_size_of(io::stdout())?;
    Some(width.0.into())
}

/// Columns and rows of the terminal that standard output is.
pub(crate) fn size() -> Option<(usize, usize)> {
    let (width, height) = terminal_size::terminal_size_of(io::stdout())?;
    Some((width.0.into(), height.0.into()))
}

/// Whether standard output is a terminal on which the cursor can be moved.
pub(crate) fn can_redraw() -> bool {
    size().is_some_and(|(width, height)| width > 0 && height > 0)
        && env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Whether standard error is a terminal.
pub(crate) fn error_is_terminal() -> bool {
    io::stderr().is_terminal()
}

/// Whether standard error takes colour.
pub(crate) fn error_is_coloured() -> bool {
    io::stderr().is_terminal() && colour_is_wanted()
}

/// `NO_COLOR` set to anything but the empty string means no, see no-color.org.
fn colour_is_wanted() -> bool {
    env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
        && env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// How text looks: colours on a terminal that takes them, none elsewhere.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Style {
    coloured: bool,
}

impl Style {
    /// Titles.
    pub(crate) fn title(self, text: &str) -> String {
        self.paint("1", text)
    }

    /// What is needed seldom.
    pub(crate) fn dim(self, text: &str) -> String {
        self.paint("2", text)
    }

    /// What somebody must see.
    pub(crate) fn alarm(self, text: &str) -> String {
        self.paint("31", text)
    }

    /// What somebody should know.
    pub(crate) fn caution(self, text: &str) -> String {
        self.paint("33", text)
    }

    fn paint(self, code: &str, text: &str) -> String {
        if self.coloured && !text.is_empty() { format!("\x1b[{code}m{text}\x1b[0m") } else { text.to_owned() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paints_only_where_colour_is_taken() {
        assert_eq!(Style { coloured: true }.alarm("trip"), "\x1b[31mtrip\x1b[0m");
        assert_eq!(Style { coloured: false }.alarm("trip"), "trip");
        assert_eq!(Style { coloured: true }.dim(""), "");
    }
}
