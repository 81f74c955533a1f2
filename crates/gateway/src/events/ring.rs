//! The latest events, numbered, and bounded in number and bytes; and who there is to hear them.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use super::event::Event;

/// Most events at a time.
pub(super) const MOST_EVENTS: usize = 16_384;

/// Most bytes that they may come to, all that is made of them included.
pub(super) const MOST_BYTES: usize = 16 << 20;

/// A reader that went away finds what it missed for so long, as a page does that is loaded anew.
pub(super) const GRACE: Duration = Duration::from_secs(60);

/// The latest events.
#[derive(Debug, Default)]
pub(super) struct Ring {
    events: VecDeque<Arc<Event>>,
    /// Number of the first of them, or of the next to come. Numbers are never used twice.
    first: u64,
    bytes: usize,
}

/// What came after a place is not all there any more.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Gone;

impl Ring {
    /// Number of the event to come.
    pub(super) fn next(&self) -> u64 {
        self.first + self.events.len() as u64
    }

    /// Puts an event behind the others; the oldest ones make room.
    pub(super) fn push(&mut self, event: Event) {
        self.bytes += event.weight();
        self.events.push_back(Arc::new(event));
        // One that is larger than the ring stays until the next comes: a reader at its end is not behind.
        while self.events.len() > MOST_EVENTS || (self.bytes > MOST_BYTES && self.events.len() > 1) {
            let Some(oldest) = self.events.pop_front() else { return };
            self.bytes -= oldest.weight();
            self.first += 1;
        }
    }

    /// Something happened that nobody was there to hear of.
    pub(super) fn pass(&mut self) {
        self.first = self.next() + 1;
        self.events = VecDeque::new();
        self.bytes = 0;
    }

    /// The events from a number on.
    pub(super) fn from(&self, number: u64) -> Result<impl Iterator<Item = &Arc<Event>>, Gone> {
        let skipped = number.checked_sub(self.first).and_then(|skipped| usize::try_from(skipped).ok());
        match skipped {
            Some(skipped) if skipped <= self.events.len() => Ok(self.events.range(skipped..)),
            _ => Err(Gone),
        }
    }

    #[cfg(test)]
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }
}

/// Who listens.
#[derive(Debug, Default)]
pub(super) struct Audience {
    readers: usize,
    /// When the last one left.
    left: Option<Duration>,
}

impl Audience {
    pub(super) fn enter(&mut self) {
        self.readers += 1;
        self.left = None;
    }

    pub(super) fn leave(&mut self, now: Duration) {
        self.readers = self.readers.saturating_sub(1);
        if self.readers == 0 {
            self.left = Some(now);
        }
    }

    /// Whether somebody listens, or may come back for what happens now.
    pub(super) fn listens(&self, now: Duration) -> bool {
        self.readers > 0 || self.left.is_some_and(|left| now < left + GRACE)
    }

    pub(super) fn readers(&self) -> usize {
        self.readers
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::event::Draft;

    fn event(number: u64, bytes: usize) -> Event {
        Draft::device((1, number), "device", &"x".repeat(bytes)).unwrap().with_id(&number.to_string())
    }

    fn sequences(ring: &Ring, number: u64) -> Result<Vec<u64>, Gone> {
        let sequence = |event: &Arc<Event>| match event.about {
            super::super::event::About::Device { sequence, .. } => sequence,
            _ => panic!("of a device"),
        };
        ring.from(number).map(|events| events.map(sequence).collect())
    }

    #[test]
    fn a_place_is_found_again_while_the_ring_holds_what_came_after_it() {
        let mut ring = Ring::default();
        assert_eq!((ring.next(), sequences(&ring, 0)), (0, Ok(vec![])));
        assert_eq!(sequences(&ring, 1), Err(Gone), "of another ring");
        for number in 0..3 {
            ring.push(event(number, 10));
        }
        assert_eq!(sequences(&ring, 0), Ok(vec![0, 1, 2]));
        assert_eq!(sequences(&ring, 2), Ok(vec![2]));
        assert_eq!((ring.next(), sequences(&ring, 3)), (3, Ok(vec![])));
        assert_eq!(sequences(&ring, 4), Err(Gone));
        assert_eq!(sequences(&ring, u64::MAX), Err(Gone));

        ring.pass();
        assert_eq!((ring.next(), ring.bytes()), (4, 0));
        assert_eq!(sequences(&ring, 3), Err(Gone), "nobody knows what happened");
        assert_eq!(sequences(&ring, 4), Ok(vec![]));
    }

    #[test]
    fn it_is_bounded_in_number_and_in_bytes() {
        let mut ring = Ring::default();
        for number in 0..2 * MOST_EVENTS as u64 {
            ring.push(event(number, 0));
        }
        assert!(ring.events.len() <= MOST_EVENTS && ring.bytes() <= MOST_BYTES);
        let mut ring = Ring::default();
        for number in 0..1_000 {
            ring.push(event(number, 100_000));
            assert!(ring.bytes() <= MOST_BYTES);
        }
        assert!(ring.events.len() > 10, "{}", ring.events.len());
        assert_eq!((ring.next(), sequences(&ring, 999)), (1_000, Ok(vec![999])));
        let weights: usize = ring.events.iter().map(|event| event.weight()).sum();
        assert_eq!(ring.bytes(), weights);

        ring.push(event(1_000, MOST_BYTES));
        assert_eq!(sequences(&ring, 1_000), Ok(vec![1_000]), "who was at its end gets it all the same");
        ring.push(event(1_001, 0));
        assert_eq!((sequences(&ring, 1_000), sequences(&ring, 1_001)), (Err(Gone), Ok(vec![1_001])));
        assert!(ring.bytes() < 10_000);
    }

    #[test]
    fn somebody_who_left_may_come_back() {
        let at = Duration::from_secs;
        let mut audience = Audience::default();
        assert!(!audience.listens(at(0)), "nobody was ever there");
        audience.enter();
        audience.enter();
        audience.leave(at(5));
        assert!(audience.listens(at(1_000)));
        audience.leave(at(1_000));
        assert!(audience.listens(at(1_059)) && !audience.listens(at(1_060)));
        audience.enter();
        assert_eq!((audience.readers(), audience.listens(at(2_000))), (1, true));
    }
}
