//! Mistakes in files, shown where they stand: file, line, column, the source underlined, and what to write instead.

use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode};

/// Mistakes that are shown; who has mended these will see the others.
const MOST_SHOWN: usize = 50;

/// No more of a line is drawn, in bytes; of a longer one the sentence says it all.
const LONGEST_LINE: usize = 400;

/// One mistake in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Excerpt {
    /// `file:line:column: what is wrong`.
    pub(crate) sentence: String,
    /// What to write instead.
    pub(crate) help: String,
    /// Where it stands in the text, in bytes.
    pub(crate) offset: usize,
    pub(crate) length: usize,
}

/// The mistakes of one file.
#[derive(Debug)]
pub(crate) struct Excerpts {
    source: NamedSource<String>,
    excerpts: Vec<Excerpt>,
}

impl Excerpts {
    pub(crate) fn new(file: &str, text: String, excerpts: Vec<Excerpt>) -> Self {
        // Nothing in the file reaches a terminal that would obey it. Places stay as they are: a byte for a byte.
        let tame = text.replace(|c: char| c.is_ascii_control() && c != '\n' && c != '\t', "?");
        Self { source: NamedSource::new(file, tame), excerpts }
    }

    /// Each mistake and its remedy in one sentence.
    pub(crate) fn sentences(&self) -> impl Iterator<Item = String> {
        self.excerpts.iter().map(|excerpt| format!("{}; {}", excerpt.sentence, excerpt.help))
    }

    /// All mistakes, one under the other.
    pub(crate) fn render(&self, coloured: bool) -> String {
        let theme = if coloured { GraphicalTheme::unicode() } else { GraphicalTheme::none() };
        let handler = GraphicalReportHandler::new_themed(theme).with_wrap_lines(false).with_context_lines(1);
        let mut text = String::new();
        for excerpt in self.excerpts.iter().take(MOST_SHOWN) {
            if !text.is_empty() {
                text.push('\n');
            }
            let shown = Shown { excerpt, source: &self.source };
            // The sentence alone still says everything if the excerpt cannot be drawn.
            if !self.is_drawn(excerpt) || handler.render_report(&mut text, &shown).is_err() {
                text.push_str(&format!("{}; {}\n", excerpt.sentence, excerpt.help));
            }
        }
        if let Some(more) = self.excerpts.len().checked_sub(MOST_SHOWN).filter(|more| *more > 0) {
            text.push_str(&format!("\nand {more} more\n"));
        }
        text
    }
}

impl Excerpts {
    /// Whether its line and those around it can be looked at.
    fn is_drawn(&self, excerpt: &Excerpt) -> bool {
        let (before, after) = self.source.inner().split_at_checked(excerpt.offset).unwrap_or_default();
        let mut lines = before.rsplit('\n').take(2).chain(after.split('\n').take(2));
        lines.all(|line| line.len() <= LONGEST_LINE)
    }
}

/// An excerpt with its source, as miette wants it.
#[derive(Debug)]
struct Shown<'a> {
    excerpt: &'a Excerpt,
    source: &'a NamedSource<String>,
}

impl std::fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.excerpt.sentence)
    }
}

impl std::error::Error for Shown<'_> {}

impl Diagnostic for Shown<'_> {
    fn help<'a>(&'a self) -> Option<Box<dyn std::fmt::Display + 'a>> {
        (!self.excerpt.help.is_empty()).then(|| Box::new(&self.excerpt.help) as Box<dyn std::fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(self.source)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = LabeledSpan::new(None, self.excerpt.offset, self.excerpt.length);
        Some(Box::new(std::iter::once(span)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn underlines_the_mistake() {
        let text = "[site]\nname = \"North\"\ncolour = \"red\"\n".to_owned();
        let excerpt = Excerpt {
            sentence: "site.toml:3:1: unknown key \"colour\"".to_owned(),
            help: "write one of name".to_owned(),
            offset: 22,
            length: 6,
        };
        insta::assert_snapshot!(Excerpts::new("site.toml", text, vec![excerpt]).render(false));
    }

    #[test]
    fn draws_no_line_that_nobody_could_look_at_and_nothing_that_a_terminal_obeys() {
        let render = |text: &str| {
            let excerpt = Excerpt {
                sentence: "site.toml:2:1: wrong".to_owned(),
                help: "mend it".to_owned(),
                offset: 2,
                length: 1,
            };
            Excerpts::new("site.toml", text.to_owned(), vec![excerpt]).render(false)
        };
        for text in [format!("a\n{}", "x".repeat(100_000)), format!("a\nb\n{}", "x".repeat(100_000))] {
            assert_eq!(render(&text), "site.toml:2:1: wrong; mend it\n");
        }
        let drawn = render("a\r\n\u{1B}[2Jb = 1\n");
        assert!(drawn.contains("?[2Jb = 1") && !drawn.contains('\u{1B}') && !drawn.contains('\r'), "{drawn}");
    }

    #[test]
    fn shows_no_more_than_somebody_reads() {
        let excerpt = Excerpt {
            sentence: "site.toml:1:1: wrong".to_owned(),
            help: "mend it".to_owned(),
            offset: 0,
            length: 1,
        };
        let render =
            |count| Excerpts::new("site.toml", "x\n".to_owned(), vec![excerpt.clone(); count]).render(false);
        assert!(!render(50).contains("more"));
        let text = render(9_000);
        assert_eq!(text.matches("wrong").count(), 50);
        assert!(text.ends_with("\nand 8950 more\n"), "{text}");
    }
}
