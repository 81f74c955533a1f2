//! The nearest word to a misspelt one, for remedies.

use std::cmp::Reverse;

/// Nobody meant another word by one that is longer, in characters.
const LONGEST: usize = 100;

/// The candidate that differs least, and of those the one that begins alike for longest, if it is near enough to be
/// meant and no other one is as near.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = word.chars().count();
    if length > LONGEST {
        return None;
    }
    let limit = (length / 3).max(1);
    let begin_alike =
        |candidate: &str| word.chars().zip(candidate.chars()).take_while(|(a, b)| a == b).count();
    let near = candidates
        .into_iter()
        .map(|candidate| (distance(word, candidate), candidate))
        // A word of which nothing is left is another word.
        .filter(|(distance, _)| *distance <= limit && *distance < length)
        .map(|(distance, candidate)| ((distance, Reverse(begin_alike(candidate))), candidate));
    let (mut least, mut meant) = (None, None);
    for (rank, candidate) in near {
        if least.is_none_or(|least| rank < least) {
            (least, meant) = (Some(rank), Some(candidate));
        } else if least == Some(rank) {
            meant = meant.filter(|other| *other == candidate);
        }
    }
    meant
}

/// How many letters have to be put in, taken out, replaced, or swapped with their neighbour.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut before: Vec<usize> = Vec::new();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for i in 0..a.len() {
        let mut next = vec![i + 1];
        for j in 0..b.len() {
            let replaced = row[j] + usize::from(a[i] != b[j]);
            let mut least = replaced.min(row[j + 1] + 1).min(next[j] + 1);
            if i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j] {
                least = least.min(before[j - 1] + 1);
            }
            next.push(least);
        }
        before = std::mem::replace(&mut row, next);
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_was_meant() {
        let words = ["genset_l1_voltage", "genset_l2_voltage", "unit_mode"];
        assert_eq!(nearest("genset_l1_voltge", words), Some("genset_l1_voltage"));
        assert_eq!(nearest("unitmode", words), Some("unit_mode"));
        assert_eq!(nearest("oil", words), None);
        assert_eq!(nearest("", words), None);
        assert_eq!(nearest("x", ["w"]), None);
        assert_eq!(nearest("genset_l_voltage", words), None, "either of two");
        assert_eq!(
            nearest("breaker.gen.closed", ["breaker.tie.closed", "breaker.genset.closed"]),
            Some("breaker.genset.closed")
        );
        assert_eq!(nearest("unitmode", ["unit_mode", "unit_mode"]), Some("unit_mode"));
    }

    #[test]
    fn a_slip_is_one_step() {
        for word in ["unti", "uni", "unitt", "unat", "nuit"] {
            assert_eq!(
                (distance(word, "unit"), nearest(word, ["name", "unit"])),
                (1, Some("unit")),
                "{word}"
            );
        }
        assert_eq!((distance("unit", "unit"), distance("", "unit"), distance("name", "unit")), (0, 4, 4));
    }
}
