//! What may have been meant by a wrong word of the file.

use busbar_profile::nearest;

/// Nobody meant another word by one that is longer.
const LONGEST: usize = 60;
/// More than this are not listed in a sentence.
const MOST_LISTED: usize = 12;
/// Among more than this nobody looks for what was meant: a large file with many mistakes is still read at once.
const MOST_COMPARED: usize = 500;

/// What to write instead of a word that is none of these.
pub(super) fn remedy<'a, I>(word: &str, known: I) -> String
where
    I: IntoIterator<Item = &'a str>,
    I::IntoIter: ExactSizeIterator + Clone,
{
    let known = known.into_iter();
    match meant(word, known.clone()) {
        Some(known) => format!("did you mean `{known}`?"),
        None => format!("write one of: {}", listed(known)),
    }
}

/// The known word that was meant, as far as that can be told.
pub(super) fn meant<'a, I>(word: &str, known: I) -> Option<&'a str>
where
    I: IntoIterator<Item = &'a str>,
    I::IntoIter: ExactSizeIterator + Clone,
{
    let known = known.into_iter();
    if word.len() > LONGEST || known.len() > MOST_COMPARED {
        return None;
    }
    let same = known.clone().find(|known| known.eq_ignore_ascii_case(word));
    same.or_else(|| begun(word, known.clone())).or_else(|| nearest(word, known))
}

/// The only word that begins so: one that was broken off.
fn begun<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let mut begun = known.filter(|known| word.len() >= 3 && known.starts_with(word));
    begun.next().filter(|_| begun.next().is_none())
}

/// Words in a row, and how many are left out.
pub(super) fn listed<'a>(words: impl ExactSizeIterator<Item = &'a str>) -> String {
    let more = words.len().saturating_sub(MOST_LISTED);
    let words: Vec<&str> = words.take(MOST_LISTED).collect();
    match more {
        0 => words.join(", "),
        more => format!("{} and {more} more", words.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_meant() {
        let known = ["gen1", "gen2", "ats"];
        assert_eq!(remedy("GEN2", known), "did you mean `gen2`?");
        assert_eq!(remedy("gne1", known), "did you mean `gen1`?");
        assert_eq!(remedy("gen3", known), "write one of: gen1, gen2, ats", "either of two");
        assert_eq!(remedy("datakom-dkg", ["datakom-d", "datakom-dkg705"]), "did you mean `datakom-dkg705`?");
        assert_eq!(remedy("gen", known), "write one of: gen1, gen2, ats");
        assert_eq!(remedy("boiler", known), "write one of: gen1, gen2, ats");
        let many: Vec<String> = (0..501).map(|i| format!("gen{i}")).collect();
        let many = || many.iter().map(String::as_str);
        assert_eq!(remedy("GEN7", many().take(500)), "did you mean `gen7`?");
        assert_eq!(
            remedy("GEN7", many()),
            "write one of: gen0, gen1, gen2, gen3, gen4, gen5, gen6, gen7, gen8, gen9, gen10, gen11 and 489 more"
        );
        assert_eq!(listed(many().take(12)).matches("more").count(), 0);
    }
}
