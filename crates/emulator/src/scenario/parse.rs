//! Text to conditions and expectations, with every mistake at its place.

use std::ops::Range;
use std::time::Duration;

use busbar_profile::text::{duration, in_words, shown};
use busbar_profile::{Number, Profile, nearest};

use super::condition::{Comparison, Condition};
use crate::device::STEP;
use crate::facts::{FactKind, Subject};

/// Longest condition, in bytes: what is deeper nested than this nobody reads.
const LONGEST: usize = 500;

/// What is wrong with a condition: where in its text, what, and what to write instead.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Mistake {
    pub(super) span: Range<usize>,
    pub(super) message: String,
    pub(super) help: String,
}

/// An expectation as it is written: a condition, and how long it has.
#[derive(Clone, Debug)]
pub(super) struct Wish {
    pub(super) condition: Condition,
    /// It has to hold at one moment within this time.
    pub(super) within: Option<Duration>,
    /// From that moment on, or from now, it has to go on holding for this time.
    pub(super) lasting: Option<Duration>,
}

/// A condition alone.
pub(super) fn condition(profile: &'static Profile, text: &str) -> Result<Condition, Mistake> {
    let mut parser = Parser::new(profile, text)?;
    let condition = parser.either()?;
    match parser.peek() {
        None => Ok(condition),
        Some(token) if matches!(token.text, "within" | "for") => {
            let help = "write `within = \"30s\"` as a key of the step, or the condition as `expect`";
            Err(token.mistake(format!("`{}` belongs to expectations", token.text), help))
        }
        Some(token) => Err(token.mistake(format!("`{}` is one too many", shown(token.text)), JOIN)),
    }
}

/// A condition, then `within` and a duration, then `for` and a duration, both optional.
pub(super) fn wish(profile: &'static Profile, text: &str) -> Result<Wish, Mistake> {
    let mut parser = Parser::new(profile, text)?;
    let condition = parser.either()?;
    let within = parser.time("within")?;
    let lasting = parser.time("for")?;
    match parser.peek() {
        None => Ok(Wish { condition, within, lasting }),
        Some(token) => Err(token.mistake(
            format!("`{}` is one too many", shown(token.text)),
            "join conditions with `and` or `or`; `within 10s` and `for 30s` end an expectation, in this order",
        )),
    }
}

/// Words that no name stands for.
const KEYWORDS: [&str; 4] = ["and", "or", "within", "for"];
const JOIN: &str = "join conditions with `and` or `or`";

/// A piece of the text: a name, a number, a word, an operator or a parenthesis.
#[derive(Clone, Copy, Debug)]
struct Token<'t> {
    text: &'t str,
    at: usize,
}

impl Token<'_> {
    fn mistake(&self, message: impl Into<String>, help: impl Into<String>) -> Mistake {
        Mistake { span: self.at..self.at + self.text.len(), message: message.into(), help: help.into() }
    }

    /// Whether it is a name, a word, a number or a duration.
    fn is_word(&self) -> bool {
        self.text.chars().all(is_word_char)
    }
}

fn is_word_char(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '.' | '-' | '+')
}

fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let same = |allowed: fn(char) -> bool| rest.find(|c| !allowed(c)).unwrap_or(rest.len());
        let length = match first {
            c if c.is_whitespace() => same(char::is_whitespace),
            c if is_word_char(c) => same(is_word_char),
            '=' | '!' | '<' | '>' | '&' | '|' => same(|c| matches!(c, '=' | '!' | '<' | '>' | '&' | '|')),
            c => c.len_utf8(),
        };
        let (token, after) = rest.split_at(length);
        if !first.is_whitespace() {
            tokens.push(Token { text: token, at: text.len() - rest.len() });
        }
        rest = after;
    }
    tokens
}

struct Parser<'t> {
    profile: &'static Profile,
    tokens: Vec<Token<'t>>,
    next: usize,
    end: usize,
}

impl<'t> Parser<'t> {
    fn new(profile: &'static Profile, text: &'t str) -> Result<Self, Mistake> {
        if text.len() > LONGEST {
            return Err(Mistake {
                span: 0..text.len(),
                message: format!("this condition has {} characters", text.chars().count()),
                help: format!("shorten it to {LONGEST}, or make several of it"),
            });
        }
        Ok(Self { profile, tokens: tokens(text), next: 0, end: text.len() })
    }

    fn peek(&self) -> Option<Token<'t>> {
        self.tokens.get(self.next).copied()
    }

    fn take(&mut self, text: &str) -> bool {
        let there = self.peek().is_some_and(|token| token.text == text);
        self.next += usize::from(there);
        there
    }

    /// The next token, or a mistake at the end of the text.
    fn token(&mut self, wanted: &str) -> Result<Token<'t>, Mistake> {
        let token = self.peek().ok_or_else(|| Mistake {
            span: self.end..self.end,
            message: "the condition ends too early".to_owned(),
            help: format!("add {wanted}"),
        })?;
        self.next += 1;
        Ok(token)
    }

    fn either(&mut self) -> Result<Condition, Mistake> {
        let mut condition = self.both()?;
        while self.take("or") {
            condition = Condition::Or(Box::new(condition), Box::new(self.both()?));
        }
        Ok(condition)
    }

    fn both(&mut self) -> Result<Condition, Mistake> {
        let mut condition = self.single()?;
        while self.take("and") {
            condition = Condition::And(Box::new(condition), Box::new(self.single()?));
        }
        Ok(condition)
    }

    fn single(&mut self) -> Result<Condition, Mistake> {
        if self.take("not") {
            return Ok(Condition::Not(Box::new(self.single()?)));
        }
        let first = self.token("what is compared, such as `state.engine == loaded`")?;
        if first.text == "(" {
            let condition = self.either()?;
            let close = self.token("the closing parenthesis")?;
            return match close.text {
                ")" => Ok(condition),
                _ => Err(close.mistake("a parenthesis is open here", "close it, or join with `and` or `or`")),
            };
        }
        if first.text.parse::<Number>().is_ok() {
            return Err(first.mistake(
                format!("`{}` stands where a name is expected", shown(first.text)),
                "write the name first, such as `fuel.level > 5`",
            ));
        }
        if !first.is_word() || KEYWORDS.contains(&first.text) {
            return Err(first.mistake(
                format!("`{}` stands where a name is expected", shown(first.text)),
                "write what is compared, such as `state.engine == loaded`, or a flag alone",
            ));
        }
        let subject = Subject::find(self.profile, first.text).map_err(|error| {
            let (message, help) = error.parts();
            first.mistake(message, help)
        })?;
        self.comparison(first, subject)
    }

    fn comparison(&mut self, name: Token<'t>, subject: Subject) -> Result<Condition, Mistake> {
        let operator = self.peek().filter(|token| !token.is_word() && !matches!(token.text, "(" | ")"));
        let Some(operator) = operator else {
            return match subject.kind() {
                FactKind::Flag => Ok(Condition::Flag(subject)),
                kind => Err(name.mistake(
                    format!("`{}` is {} and stands alone", name.text, describe(kind)),
                    format!("compare it, such as `{} {}`", name.text, example(kind)),
                )),
            };
        };
        self.next += 1;
        let Some(comparison) = Comparison::of(operator.text) else {
            return Err(operator.mistake(
                format!("`{}` compares nothing", shown(operator.text)),
                "write ==, !=, <, <=, > or >=; conditions are joined with `and` and `or`",
            ));
        };
        let value = self.token("what it is compared with")?;
        match subject.kind() {
            FactKind::Flag => Err(value.mistake(
                format!("`{}` is a flag, which is compared with nothing", name.text),
                format!("write `{0}`, or `not {0}`", name.text),
            )),
            FactKind::Number { unit } => match value.text.parse::<Number>() {
                Ok(number) => {
                    self.no_unit(&subject)?;
                    Ok(Condition::Number(subject, comparison, number))
                }
                Err(_) => Err(value.mistake(
                    format!("`{}` is a number, `{}` is none", name.text, shown(value.text)),
                    match unit {
                        Some(unit) => format!("write a number in {unit}, without the unit"),
                        None => "write a number".to_owned(),
                    },
                )),
            },
            FactKind::Words(_) => word(subject, (operator, comparison), value),
        }
    }

    /// A unit behind a number is one too many.
    fn no_unit(&self, subject: &Subject) -> Result<(), Mistake> {
        let FactKind::Number { unit: Some(unit) } = subject.kind() else { return Ok(()) };
        match self.peek() {
            Some(token) if token.text == ")" || KEYWORDS.contains(&token.text) => Ok(()),
            Some(token) => Err(token.mistake(
                format!("`{}` is one too many", shown(token.text)),
                format!("leave a unit out, `{}` is in {unit}; {JOIN}", subject.name()),
            )),
            None => Ok(()),
        }
    }

    /// A duration behind a keyword, if the keyword is there.
    fn time(&mut self, keyword: &str) -> Result<Option<Duration>, Mistake> {
        if !self.take(keyword) {
            return Ok(None);
        }
        let token = self.token("a duration, such as 10s")?;
        match duration(token.text) {
            Some(time) if time < STEP => Err(token.mistake(
                format!("`{keyword}` is {}", token.text),
                format!("give it {} or more, or leave it out", in_words(STEP)),
            )),
            Some(time) => Ok(Some(time)),
            None => Err(token.mistake(
                format!("`{}` is no duration", shown(token.text)),
                "write a number and ms, s, min or h without a blank, such as 10s",
            )),
        }
    }
}

fn word(
    subject: Subject,
    (operator, comparison): (Token<'_>, Comparison),
    value: Token<'_>,
) -> Result<Condition, Mistake> {
    let equal = match comparison {
        Comparison::Equal => true,
        Comparison::NotEqual => false,
        _ => {
            let message = format!("`{}` is a word, which has no order", subject.name());
            return Err(operator.mistake(message, "write == or !="));
        }
    };
    let FactKind::Words(words) = subject.kind() else {
        return Err(value.mistake("there are no words", "compare something else"));
    };
    match words.iter().copied().find(|word| *word == value.text) {
        Some(word) => Ok(Condition::Word { subject, word, equal }),
        None => Err(value.mistake(
            format!("`{}` is never `{}`", subject.name(), shown(value.text)),
            match nearest(value.text, words.iter().copied()) {
                Some(word) => format!("did you mean `{word}`?"),
                None => format!("write one of: {}", words.join(", ")),
            },
        )),
    }
}

fn describe(kind: &FactKind) -> &'static str {
    match kind {
        FactKind::Number { .. } => "a number",
        FactKind::Words(_) => "a word",
        FactKind::Flag => "a flag",
    }
}

fn example(kind: &FactKind) -> String {
    match kind {
        FactKind::Words(words) => format!("== {}", words.first().unwrap_or(&"word")),
        _ => "> 0".to_owned(),
    }
}
