//! What can be made to happen to a plant from outside: by the grid, by wear, by a person on site.
//!
//! Every plant has levers with a name each, and every lever has a position that is known at all times. What becomes of
//! a pulled lever is the plant's and the panel's affair: no lever writes a register.

use std::fmt;

use busbar_profile::text::shown;

/// How an event is told, and the word of the lever that it means: the mains fail, the mains return.
const TOLD: [(&str, &str); 2] = [("fails", "failed"), ("returns", "normal")];

/// One thing that can be made to happen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Lever {
    /// What scenarios and programs call it, such as `mains` or `breaker.genset`.
    pub id: &'static str,
    /// What people call it.
    pub name: &'static str,
    /// Words that it can be set to; the first is how a healthy plant has it.
    pub words: &'static [Word],
    /// Numbers that it can be set to.
    pub numbers: Option<Numbers>,
}

/// A word that a lever can be set to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Word {
    /// The word: lower case, digits and `_`.
    pub id: &'static str,
    /// What it does, for people.
    pub meaning: &'static str,
}

/// Numbers that a lever can be set to.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Numbers {
    /// Least.
    pub min: f64,
    /// Greatest.
    pub max: f64,
    /// Unit of both; empty for a count.
    pub unit: &'static str,
}

/// Where a lever stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Position {
    /// At one of its words.
    Word(&'static str),
    /// At a number in its range.
    Number(f64),
}

impl Lever {
    /// A lever of words alone.
    pub(crate) const fn of_words(id: &'static str, name: &'static str, words: &'static [Word]) -> Self {
        Self { id, name, words, numbers: None }
    }

    /// A lever that takes numbers, and words if there are any.
    pub(crate) const fn of_numbers(
        id: &'static str,
        name: &'static str,
        words: &'static [Word],
        (min, max): (f64, f64),
        unit: &'static str,
    ) -> Self {
        Self { id, name, words, numbers: Some(Numbers { min, max, unit }) }
    }

    /// A position given as text; of a lever with such words `fails` means `failed`, and `returns` `normal`.
    ///
    /// # Errors
    /// The lever has no such position.
    pub fn position(&self, text: &str) -> Result<Position, LeverError> {
        let word = |id: &str| self.words.iter().find(|word| word.id == id).map(|word| word.id);
        let told = || TOLD.iter().find(|(told, _)| *told == text).and_then(|(_, meant)| word(meant));
        if let Some(word) = word(text).or_else(told) {
            return Ok(Position::Word(word));
        }
        match (text.parse::<f64>(), self.numbers) {
            (Ok(number), Some(range)) if (range.min..=range.max).contains(&number) => {
                Ok(Position::Number(number))
            }
            _ => Err(LeverError::Position { lever: *self, text: text.to_owned() }),
        }
    }
}

impl Position {
    /// Whether it is the same, but for what a number loses on its way through a text.
    pub(crate) fn is_about(self, other: Self) -> bool {
        match (self, other) {
            (Self::Number(one), Self::Number(other)) => (one - other).abs() < 1e-6,
            (one, other) => one == other,
        }
    }
}

impl Word {
    pub(crate) const fn new(id: &'static str, meaning: &'static str) -> Self {
        Self { id, meaning }
    }
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Word(word) => f.write_str(word),
            Self::Number(number) => number.fmt(f),
        }
    }
}

/// A lever was not pulled; everything is as it was.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LeverError {
    /// The plant has no such lever.
    #[error("the plant has no `{}`; {}", shown(.id), has(.nearest.as_ref(), .known))]
    Unknown {
        /// What was asked for.
        id: String,
        /// What was perhaps meant.
        nearest: Option<&'static str>,
        /// Ids of its levers.
        known: Vec<&'static str>,
    },
    /// The lever has no such position.
    #[error("`{}` cannot be `{}`; {}", .lever.id, shown(.text), offers(.lever))]
    Position {
        /// The lever.
        lever: Lever,
        /// What was asked for.
        text: String,
    },
}

fn has(nearest: Option<&&'static str>, known: &[&str]) -> String {
    match nearest {
        Some(nearest) => format!("did you mean `{nearest}`?"),
        None => format!("it has {}", known.join(", ")),
    }
}

fn offers(lever: &Lever) -> String {
    let words: Vec<_> = lever.words.iter().map(|word| word.id).collect();
    let numbers = lever.numbers.map(|Numbers { min, max, unit }| {
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        format!("a number from {min} to {max}{unit}")
    });
    match (words.is_empty(), numbers) {
        (true, Some(numbers)) => format!("give {numbers}"),
        (false, Some(numbers)) => format!("choose {}, or {numbers}", words.join(", ")),
        (_, None) => format!("choose {}", words.join(", ")),
    }
}

#[cfg(test)]
impl Lever {
    /// A position by how far into its words and numbers it is, 0 to 1.
    pub(crate) fn at(&self, part: f64) -> Position {
        let kinds = self.words.len() + usize::from(self.numbers.is_some());
        let place = part * kinds as f64;
        match (self.words.get(place as usize), self.numbers) {
            (Some(word), _) => Position::Word(word.id),
            (None, Some(range)) => Position::Number(range.min + place.fract() * (range.max - range.min)),
            (None, None) => unreachable!("a lever has words or numbers"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOAD: Lever = Lever::of_numbers(
        "load",
        "Load",
        &[Word::new("varies", "Consumers come and go")],
        (0.0, 120.0),
        "kW",
    );

    #[test]
    fn an_event_is_told_as_people_tell_it() {
        const MAINS: Lever = Lever::of_words(
            "mains",
            "Mains",
            &[Word::new("normal", "There"), Word::new("failed", "Gone"), Word::new("sagging", "Low")],
        );
        assert_eq!(MAINS.position("fails"), Ok(Position::Word("failed")));
        assert_eq!(MAINS.position("returns"), Ok(Position::Word("normal")));
        for wrong in ["Fails", "fail", "sags"] {
            assert!(MAINS.position(wrong).is_err(), "{wrong}");
        }
        assert!(LOAD.position("fails").is_err(), "a load has no such word");
    }

    #[test]
    fn a_sentence_repeats_nothing_that_a_terminal_obeys() {
        let error = LOAD.position(&format!("\u{1B}[2J{}", "9".repeat(500))).unwrap_err().to_string();
        assert!(error.starts_with("`load` cannot be `\\u{1b}[2J999") && error.len() < 200, "{error}");
    }

    #[test]
    fn a_position_is_one_of_its_words_or_a_number_in_its_range() {
        assert_eq!(LOAD.position("varies"), Ok(Position::Word("varies")));
        assert_eq!(LOAD.position("66.5"), Ok(Position::Number(66.5)));
        for wrong in ["", "Varies", "121", "-1", "NaN", "inf", "1 kW"] {
            let error = LOAD.position(wrong).unwrap_err();
            assert_eq!(
                error.to_string(),
                format!("`load` cannot be `{wrong}`; choose varies, or a number from 0 to 120 kW")
            );
        }
    }
}
