//! TOML 1.1 that older editors refuse: the files keep to TOML 1.0.

use std::ops::Range;

/// Something of TOML 1.1 and what to write instead.
pub(super) struct Newer {
    pub(super) span: Range<usize>,
    pub(super) message: &'static str,
    pub(super) help: &'static str,
}

/// Everything in a text that TOML 1.0 does not have. The text should be valid TOML 1.1; of other text it finds nothing
/// reliable, but it ends.
pub(super) fn newer_than_1_0(text: &str) -> Vec<Newer> {
    let mut scanner = Scanner { text: text.as_bytes(), at: 0, open: Vec::new(), found: Vec::new() };
    scanner.run();
    scanner.found
}

struct Scanner<'a> {
    text: &'a [u8],
    at: usize,
    /// The brackets that are open, and where.
    open: Vec<u8>,
    found: Vec<Newer>,
}

impl Scanner<'_> {
    fn run(&mut self) {
        let mut comma = None;
        while let Some(&byte) = self.text.get(self.at) {
            let start = self.at;
            match byte {
                b'#' => self.skip_line(),
                b'"' | b'\'' => {
                    self.string(byte);
                    comma = None;
                }
                b'\n' if self.open.last() == Some(&b'{') => {
                    self.note(
                        start..start + 1,
                        "a line break inside { }",
                        "write the inline table on one line, as TOML 1.0 has it",
                    );
                    self.at += 1;
                    self.skip_space();
                }
                b'{' | b'[' => {
                    self.open.push(byte);
                    self.at += 1;
                    comma = None;
                }
                b'}' | b']' => {
                    if let (b'}', Some(comma)) = (byte, comma) {
                        self.note(
                            comma..comma + 1,
                            "a comma before the closing }",
                            "leave out the last comma of the inline table, as TOML 1.0 has it",
                        );
                    }
                    self.open.pop();
                    self.at += 1;
                    comma = None;
                }
                b',' => {
                    comma = Some(start);
                    self.at += 1;
                }
                b' ' | b'\t' | b'\r' | b'\n' => self.at += 1,
                _ => {
                    comma = None;
                    self.at += 1;
                }
            }
        }
    }

    /// Steps over a string; notes escapes that are new.
    fn string(&mut self, quote: u8) {
        let long = self.text[self.at..].starts_with(&[quote; 3]);
        self.at += if long { 3 } else { 1 };
        while let Some(&byte) = self.text.get(self.at) {
            if byte == b'\\' && quote == b'"' {
                if let Some(b'e' | b'x') = self.text.get(self.at + 1) {
                    self.note(
                        self.at..self.at + 2,
                        "an escape that TOML 1.0 does not have",
                        "write the character itself, or \\u and four hex digits",
                    );
                }
                self.at += 2;
                continue;
            }
            if !long && (byte == quote || byte == b'\n') {
                self.at += 1;
                return;
            }
            if long && self.text[self.at..].starts_with(&[quote; 3]) {
                self.at += 3;
                // A long string may end in one or two quotes of its own.
                while self.text.get(self.at) == Some(&quote) {
                    self.at += 1;
                }
                return;
            }
            self.at += 1;
        }
    }

    fn skip_line(&mut self) {
        while self.text.get(self.at).is_some_and(|byte| *byte != b'\n') {
            self.at += 1;
        }
    }

    /// One finding a run of lines is enough.
    fn skip_space(&mut self) {
        while self.text.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    fn note(&mut self, span: Range<usize>, message: &'static str, help: &'static str) {
        self.found.push(Newer { span, message, help });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str) -> Vec<(usize, &'static str)> {
        newer_than_1_0(text).into_iter().map(|newer| (newer.span.start, newer.message)).collect()
    }

    #[test]
    fn finds_what_is_newer() {
        assert_eq!(found("a = { b = 1,\n c = 2 }"), [(12, "a line break inside { }")]);
        assert_eq!(found("a = { b = 1, }"), [(11, "a comma before the closing }")]);
        assert_eq!(found(r#"a = "\x41""#), [(5, "an escape that TOML 1.0 does not have")]);
        assert_eq!(found("a = [{ b = [1,\n 2,\n] , }]"), [(21, "a comma before the closing }")]);
    }

    #[test]
    fn leaves_what_is_old() {
        for text in [
            "a = [\n  { b = 1 }, # {\n  { b = \"{,}\\\\\" },\n]",
            "a = { b = [\n1,\n2,\n] }",
            "a = '''\n{\n}'''\n[b]\nc = \"\"\"\n\"{\"\n\"\"\"\"",
            "a = '\\x'",
            "a = [\"\\\"{\", \"\\\"\",\n]",
            "\"",
            "}",
        ] {
            assert_eq!(found(text), [], "{text}");
        }
    }
}
