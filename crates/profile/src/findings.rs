//! What is wrong with a file, where, and what to write instead.

use std::fmt;
use std::ops::Range;

/// One mistake in a profile, vocabulary or site file.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Finding {
    /// The file, as the caller named it.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Where the marked text begins, in bytes.
    pub offset: usize,
    /// How long the marked text is, in bytes; 0 where it is a place.
    pub length: usize,
    /// What is wrong.
    pub message: String,
    /// What to write instead, as a sentence.
    pub help: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, line, column, message, help, .. } = self;
        write!(f, "{file}:{line}:{column}: {message}; {help}")
    }
}

/// Everything found in one file, in the order of the text; never empty as an error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Findings {
    findings: Vec<Finding>,
}

impl Findings {
    /// The findings one by one.
    pub fn iter(&self) -> std::slice::Iter<'_, Finding> {
        self.findings.iter()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.findings.len()
    }

    /// Whether there is none; an error always has one.
    pub fn is_empty(&self) -> bool {
        self.findings.is_empty()
    }
}

impl<'a> IntoIterator for &'a Findings {
    type Item = &'a Finding;
    type IntoIter = std::slice::Iter<'a, Finding>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl IntoIterator for Findings {
    type Item = Finding;
    type IntoIter = std::vec::IntoIter<Finding>;

    fn into_iter(self) -> Self::IntoIter {
        self.findings.into_iter()
    }
}

impl fmt::Display for Findings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, finding) in self.findings.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{finding}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Findings {}

/// Collects findings while a text is read.
#[derive(Debug)]
pub struct Collector<'a> {
    file: &'a str,
    text: &'a str,
    findings: Vec<Finding>,
}

impl<'a> Collector<'a> {
    /// Nothing found yet in `text`; `file` is what the findings call it.
    pub fn new(file: &'a str, text: &'a str) -> Self {
        Self { file, text, findings: Vec::new() }
    }

    /// Notes a mistake; a span outside the text is brought back into it.
    pub fn add(&mut self, span: Range<usize>, message: impl Into<String>, help: impl Into<String>) {
        let offset = floor_char_boundary(self.text, span.start);
        let end = floor_char_boundary(self.text, span.end.max(offset));
        self.findings.push(Finding {
            file: self.file.to_owned(),
            // Counted in the end, for all of them together.
            line: 0,
            column: 0,
            offset,
            length: end - offset,
            message: message.into(),
            help: help.into(),
        });
    }

    /// The text of a span, if it is short and on one line.
    pub(crate) fn excerpt(&self, span: &Range<usize>) -> Option<&'a str> {
        let excerpt = self.text.get(span.clone())?;
        let is_short = !excerpt.is_empty() && excerpt.len() <= 40 && !excerpt.contains('\n');
        is_short.then_some(excerpt)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.findings.is_empty()
    }

    /// `Err` when anything was found.
    pub fn finish(self) -> Result<(), Findings> {
        if self.is_empty() { Ok(()) } else { Err(self.into_findings()) }
    }

    /// The findings in the order of the text, each once.
    pub(crate) fn into_findings(mut self) -> Findings {
        self.findings.sort_by_key(|finding| finding.offset);
        self.findings.dedup();
        let (mut line, mut column, mut seen) = (1, 1, 0);
        for finding in &mut self.findings {
            let mut since = &self.text[seen..finding.offset];
            if let Some(newline) = since.rfind('\n') {
                line += since.matches('\n').count();
                column = 1;
                since = &since[newline + 1..];
            }
            // No editor counts a byte order mark.
            column += since.trim_start_matches('\u{FEFF}').chars().count();
            seen = finding.offset;
            (finding.line, finding.column) = (line, column);
        }
        Findings { findings: self.findings }
    }
}

fn floor_char_boundary(text: &str, index: usize) -> usize {
    let mut index = index.min(text.len());
    while !text.is_char_boundary(index) {
        index -= 1;
    }
    index
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_lines_and_characters() {
        let text = "key = 1\nµ = \"é\"\n";
        let mut collector = Collector::new("a.toml", text);
        let at = text.find("\"é\"").unwrap();
        collector.add(at..at + 4, "this is wrong", "write something else");
        collector.add(0..3, "so is this", "leave it out");
        collector.add(1000..2000, "and the end", "add to it");
        let findings = collector.into_findings();
        assert_eq!(
            findings.to_string(),
            "a.toml:1:1: so is this; leave it out\n\
             a.toml:2:5: this is wrong; write something else\n\
             a.toml:3:1: and the end; add to it"
        );
        let finding = findings.iter().nth(1).unwrap();
        assert_eq!((finding.offset, finding.length), (at, 4));
    }

    #[test]
    fn a_byte_order_mark_is_no_column() {
        let text = "\u{FEFF}key = 1\r\nkey = 2\r\n";
        let mut collector = Collector::new("a.toml", text);
        for at in [text.find('2').unwrap(), text.find('1').unwrap(), 0, 0] {
            collector.add(at..at + 1, "wrong", "mend it");
        }
        let places: Vec<_> = collector.into_findings().iter().map(|f| (f.line, f.column)).collect();
        assert_eq!(places, [(1, 1), (1, 7), (2, 7)]);
    }
}
