//! Mistakes in files, shown where they stand: file, line, column, the source underlined, and what to write instead.

use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode};

/// Mistakes that are shown; who has mended these will see the others.
const MOST_SHOWN: usize = 50;

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
        Self { source: NamedSource::new(file, text), excerpts }
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
            if handler.render_report(&mut text, &shown).is_err() {
                text.push_str(&format!("{}; {}\n", excerpt.sentence, excerpt.help));
            }
        }
        if let Some(more) = self.excerpts.len().checked_sub(MOST_SHOWN).filter(|more| *more > 0) {
            text.push_str(&format!("\nand {more} more\n"));
        }
        text
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
