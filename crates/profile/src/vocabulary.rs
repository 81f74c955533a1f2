//! The shared words for what controllers measure, so that one page and one rule serve every maker.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use crate::findings::Findings;
use crate::terms::SignalKind;

/// `profiles/vocabulary.toml`.
const BUILT_IN: &str = include_str!("../../../profiles/vocabulary.toml");

/// The signals that profiles may refer to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Vocabulary {
    signals: BTreeMap<String, Signal>,
}

impl Vocabulary {
    /// Reads and checks a vocabulary file.
    ///
    /// # Errors
    ///
    /// Everything that is wrong with the text, as far as it can be seen at once.
    pub fn parse(file_name: &str, text: &str) -> Result<Self, Findings> {
        let signals = crate::load::parse_vocabulary(file_name, text)?;
        Ok(Self { signals: signals.into_iter().map(|signal| (signal.id.clone(), signal)).collect() })
    }

    /// The signal of that id.
    pub fn signal(&self, id: &str) -> Option<&Signal> {
        self.signals.get(id)
    }

    /// Every signal, ordered by id.
    pub fn iter(&self) -> impl Iterator<Item = &Signal> {
        self.signals.values()
    }
}

/// One canonical signal.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Signal {
    /// `<object>.<part>.<quantity>`.
    pub id: String,
    /// What it carries.
    pub kind: SignalKind,
    /// Unit of a number; none for power factors and counts.
    pub unit: Option<String>,
    /// The words it can be.
    pub words: Vec<String>,
    /// What it means.
    pub meaning: String,
}

/// The vocabulary that is compiled in.
pub fn vocabulary() -> &'static Vocabulary {
    static VOCABULARY: LazyLock<Vocabulary> =
        LazyLock::new(|| Vocabulary::parse("profiles/vocabulary.toml", BUILT_IN).unwrap_or_default());
    &VOCABULARY
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_vocabulary_is_sound() {
        if let Err(findings) = Vocabulary::parse("profiles/vocabulary.toml", BUILT_IN) {
            panic!("{findings}");
        }
        assert_eq!(vocabulary().signal("mains.l1.voltage").unwrap().unit.as_deref(), Some("V"));
    }
}
