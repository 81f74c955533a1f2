//! Contacts of the site on the unit's inputs, by the functions that the manual's list of flags has for them (page 18).

use crate::levers::{Lever, Position, Word};
use crate::plant;

const WORDS: [Word; 2] = [Word::new("off", "Open"), Word::new("on", "Closed")];

const OWN: [Lever; 5] = [
    Lever::of_words("input.protections_disabled", "Contact: protections disabled", &WORDS),
    Lever::of_words("input.auto_start_disabled", "Contact: automatic start disabled", &WORDS),
    Lever::of_words("input.force_to_start", "Contact: force to start", &WORDS),
    Lever::of_words("input.restore_inhibited", "Contact: automatic restore inhibited", &WORDS),
    Lever::of_words("input.loading_inhibited", "Contact: genset loading inhibited", &WORDS),
];

/// Those of the plant, then those of the contacts.
pub(super) const LEVERS: &[Lever] = &levers();

const fn levers() -> [Lever; plant::LEVERS.len() + OWN.len()] {
    let mut all = [OWN[0]; plant::LEVERS.len() + OWN.len()];
    let mut place = 0;
    while place < all.len() {
        all[place] = match place.checked_sub(plant::LEVERS.len()) {
            Some(own) => OWN[own],
            None => plant::LEVERS[place],
        };
        place += 1;
    }
    all
}

/// Which of them are closed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Contacts {
    /// What would trip the genset is a warning.
    pub(super) protections_disabled: bool,
    /// AUTO starts nothing.
    pub(super) auto_start_disabled: bool,
    /// AUTO takes the load, whatever the mains are.
    pub(super) force_to_start: bool,
    /// AUTO gives no load back to the mains.
    pub(super) restore_inhibited: bool,
    /// The genset takes no load.
    pub(super) loading_inhibited: bool,
}

impl Contacts {
    /// In the order of the inputs.
    pub(super) fn all(self) -> [bool; OWN.len()] {
        [
            self.protections_disabled,
            self.auto_start_disabled,
            self.force_to_start,
            self.restore_inhibited,
            self.loading_inhibited,
        ]
    }

    /// Where the lever of one stands; none where it is none of theirs.
    pub(super) fn lever(mut self, id: &str) -> Option<Position> {
        let closed = *self.contact(id)?;
        Some(Position::Word(WORDS[usize::from(closed)].id))
    }

    /// Opens or closes one; false where the lever is none of theirs.
    pub(super) fn pull(&mut self, id: &str, to: Position) -> bool {
        let Some(contact) = self.contact(id) else { return false };
        *contact = to == Position::Word(WORDS[1].id);
        true
    }

    fn contact(&mut self, id: &str) -> Option<&mut bool> {
        Some(match id {
            "input.protections_disabled" => &mut self.protections_disabled,
            "input.auto_start_disabled" => &mut self.auto_start_disabled,
            "input.force_to_start" => &mut self.force_to_start,
            "input.restore_inhibited" => &mut self.restore_inhibited,
            "input.loading_inhibited" => &mut self.loading_inhibited,
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_contact_has_a_lever_of_its_own() {
        assert!(LEVERS.starts_with(plant::LEVERS));
        for (number, lever) in OWN.iter().enumerate() {
            let mut contacts = Contacts::default();
            assert_eq!(contacts.lever(lever.id), Some(Position::Word("off")), "{}", lever.id);
            assert!(contacts.pull(lever.id, Position::Word("on")));
            assert_eq!(contacts.lever(lever.id), Some(Position::Word("on")), "{}", lever.id);
            let closed: Vec<_> = (0..OWN.len()).filter(|other| contacts.all()[*other]).collect();
            assert_eq!(closed, [number], "{}", lever.id);
        }
        assert!(!Contacts::default().pull("mains", Position::Word("failed")));
    }

    #[test]
    fn the_page_lists_them() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/imitation/datakom-d.md");
        let page = std::fs::read_to_string(path).unwrap();
        let listed: Vec<_> = page.lines().filter_map(|line| line.strip_prefix("| `input.")).collect();
        assert_eq!(listed.len(), OWN.len());
        for (row, lever) in listed.iter().zip(OWN) {
            assert!(
                lever.id.strip_prefix("input.").is_some_and(|id| row.starts_with(id)),
                "{}: {row}",
                lever.id
            );
        }
    }
}
