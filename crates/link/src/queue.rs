//! What waits for a wire, in which order, and who is to be woken when it is done.

use std::task::{Poll, Waker};
use std::time::Duration;

use crate::error::LinkError;
use crate::job::{Job, Outcome, Priority};

/// The class behind those of `Priority`: polls of units that have not answered for several times, or never did. One that
/// has waited long enough goes ahead of a poll, so that a busy wire finds out about them.
const PROBES: usize = Priority::COUNT;

/// But not before so many of its time-outs have passed since the last probe: those who answer keep most of the wire.
const PROBE_REST: u32 = 3;

/// A caller's claim on one outcome.
///
/// Not `Clone`: it ends with the outcome, or with `cancel`.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Ticket(usize);

impl Ticket {
    pub(crate) fn place(&self) -> Place {
        Place(self.0)
    }
}

/// A job's place in the queue, for the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place(usize);

/// When a job may leave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Turn {
    /// Now; of several the one with the least number goes first, and among equals the one that came first.
    Now(u64),
    /// Not before this.
    At(Duration),
}

/// What to do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pick {
    /// Send this job. It keeps its slot until it is finished or put back.
    Job(Place),
    /// Nobody's turn comes before this.
    Wait(Duration),
    /// Nobody waits.
    Nobody,
}

/// Jobs by priority. Within one, whose turn it is says the wire, which knows the units.
///
/// Slots are used again and the lists run through them, so a wire in its stride allocates nothing and touches little.
#[derive(Debug)]
pub(crate) struct Queue {
    slots: Vec<Slot>,
    waiting: [List; Priority::COUNT + 1],
    free: List,
    /// When the turn of a probe came last.
    probed: Option<Duration>,
    /// Most jobs that may wait in one priority, so that polling cannot shut out a command.
    capacity: usize,
}

impl Queue {
    pub(crate) fn new(capacity: usize) -> Self {
        Self { slots: Vec::new(), waiting: Default::default(), free: List::default(), probed: None, capacity }
    }

    /// Whether one more job of this priority may wait.
    pub(crate) fn room(&self, priority: Priority) -> Result<(), LinkError> {
        let probes = match priority {
            Priority::Poll => self.waiting[PROBES].length,
            _ => 0,
        };
        let waiting = self.waiting[priority.index()].length + probes;
        match waiting < self.capacity {
            true => Ok(()),
            false => Err(LinkError::QueueFull { waiting }),
        }
    }

    /// Puts a job behind the others of its priority. Ask for `room` first.
    pub(crate) fn push(&mut self, entry: Entry) -> Ticket {
        let class = entry.class();
        let index = match self.free.pop_front(&self.slots) {
            Some(index) => {
                let slot = &mut self.slots[index];
                slot.stage = Stage::Pending;
                slot.entry = entry;
                index
            }
            None => {
                if self.slots.is_empty() {
                    // Most wires never have more than one job at a time.
                    self.slots.reserve_exact(1);
                }
                self.slots.push(Slot { next: None, stage: Stage::Pending, entry, result: Ok(()) });
                self.slots.len() - 1
            }
        };
        self.waiting[class].push_back(&mut self.slots, index);
        Ticket(index)
    }

    /// The job whose turn it is, judged by `turn`. Where nobody's turn has come in a class, the next one uses the time.
    pub(crate) fn pick(&mut self, now: Duration, mut turn: impl FnMut(&Entry) -> Turn) -> Pick {
        let mut order = [0, 1, 2, PROBES];
        if self.probe_is_due(now) {
            order.swap(2, PROBES);
        }
        let mut wait: Option<Duration> = None;
        for class in order {
            match self.pick_in(class, &mut turn) {
                Pick::Job(place) => {
                    if class == PROBES {
                        self.probed = Some(now);
                    }
                    return Pick::Job(place);
                }
                Pick::Wait(until) => wait = Some(wait.map_or(until, |wait| wait.min(until))),
                Pick::Nobody => {}
            }
        }
        wait.map_or(Pick::Nobody, Pick::Wait)
    }

    fn pick_in(&mut self, class: usize, turn: &mut impl FnMut(&Entry) -> Turn) -> Pick {
        let Self { slots, waiting, .. } = self;
        let list = &mut waiting[class];
        let mut wait: Option<Duration> = None;
        let mut best: Option<(u64, Option<usize>, usize)> = None;
        let mut before = None;
        for index in list.indexes(slots) {
            match turn(&slots[index].entry) {
                Turn::Now(number) if best.is_none_or(|(least, ..)| number < least) => {
                    best = Some((number, before, index));
                }
                Turn::Now(_) => {}
                Turn::At(at) => wait = Some(wait.map_or(at, |wait| wait.min(at))),
            }
            before = Some(index);
        }
        match (best, wait) {
            (Some((_, before, index)), _) => {
                list.unlink(slots, before, index);
                Pick::Job(Place(index))
            }
            (None, Some(until)) => Pick::Wait(until),
            (None, None) => Pick::Nobody,
        }
    }

    /// Puts a popped job behind the others of its class: its next try.
    pub(crate) fn put_back(&mut self, place: Place) {
        if let Some(entry) = self.entry(place) {
            let class = entry.class();
            self.waiting[class].push_back(&mut self.slots, place.0);
        }
    }

    /// Whether a probe has waited long enough to go ahead of a poll.
    fn probe_is_due(&self, now: Duration) -> bool {
        let mut probes = self.waiting[PROBES].indexes(&self.slots).map(|index| &self.slots[index].entry);
        probes.any(|entry| {
            let rest = entry.job.timeout.saturating_mul(PROBE_REST);
            let rested = self.probed.is_none_or(|probed| now.saturating_sub(probed) >= rest);
            rested && entry.modest_until.is_some_and(|until| until <= now)
        })
    }

    /// A job that is not finished; none when its caller is gone.
    pub(crate) fn entry(&mut self, place: Place) -> Option<&mut Entry> {
        let slot = self.slots.get_mut(place.0)?;
        (slot.stage == Stage::Pending).then_some(&mut slot.entry)
    }

    /// Ends a popped job; its caller's waker goes to `wakes`.
    pub(crate) fn finish(&mut self, place: Place, result: Result<(), LinkError>, wakes: &mut Vec<Waker>) {
        let Some(slot) = self.slots.get_mut(place.0) else { return };
        match slot.stage {
            Stage::Pending => {
                slot.stage = Stage::Done;
                slot.result = result;
                wakes.extend(slot.entry.waker.take());
            }
            Stage::Abandoned => self.release(place.0),
            Stage::Done | Stage::Free => {}
        }
    }

    /// Ends every waiting job that `judge` has an error for.
    pub(crate) fn fail_waiting(
        &mut self,
        mut judge: impl FnMut(&Entry) -> Option<LinkError>,
        wakes: &mut Vec<Waker>,
    ) {
        for class in 0..self.waiting.len() {
            let mut whole = std::mem::take(&mut self.waiting[class]);
            while let Some(index) = whole.pop_front(&self.slots) {
                match judge(&self.slots[index].entry) {
                    Some(error) => self.finish(Place(index), Err(error), wakes),
                    None => self.waiting[class].push_back(&mut self.slots, index),
                }
            }
        }
    }

    /// Jobs that wait, popped ones not among them.
    pub(crate) fn waiting(&self) -> impl Iterator<Item = &Entry> {
        let indexes = self.waiting.iter().flat_map(|class| class.indexes(&self.slots));
        indexes.map(|index| &self.slots[index].entry)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.waiting.iter().all(|class| class.length == 0)
    }

    /// The outcome if there is one; otherwise `waker` will be woken for it.
    pub(crate) fn take(&mut self, ticket: &Ticket, waker: &Waker) -> Poll<Outcome> {
        let slot = &mut self.slots[ticket.0];
        if slot.stage != Stage::Done {
            match &mut slot.entry.waker {
                Some(known) => known.clone_from(waker),
                none => *none = Some(waker.clone()),
            }
            return Poll::Pending;
        }
        let outcome = Outcome {
            result: std::mem::replace(&mut slot.result, Ok(())),
            registers: std::mem::take(&mut slot.entry.job.registers),
            done: slot.entry.job.ask.done(),
        };
        self.release(ticket.0);
        Poll::Ready(outcome)
    }

    /// The caller is gone: a waiting job is forgotten, one on the wire runs to its end for nobody.
    pub(crate) fn cancel(&mut self, ticket: Ticket) {
        let index = ticket.0;
        let slot = &mut self.slots[index];
        slot.entry.waker = None;
        match slot.stage {
            Stage::Pending => {
                let class = slot.entry.class();
                match self.waiting[class].remove(&mut self.slots, index) {
                    true => self.release(index),
                    false => self.slots[index].stage = Stage::Abandoned,
                }
            }
            Stage::Done => self.release(index),
            Stage::Free | Stage::Abandoned => {}
        }
    }

    fn release(&mut self, index: usize) {
        self.slots[index].stage = Stage::Free;
        self.free.push_front(&mut self.slots, index);
    }
}

/// A job and its way through the queue.
#[derive(Debug)]
pub(crate) struct Entry {
    pub(crate) job: Job,
    /// When it was asked.
    pub(crate) since: Duration,
    /// How often it was sent.
    pub(crate) tries: u8,
    /// It polls a unit of which nobody knows whether it will answer, and lets polls of others go first until then.
    pub(crate) modest_until: Option<Duration>,
    pub(crate) waker: Option<Waker>,
}

impl Entry {
    fn class(&self) -> usize {
        match self.modest_until {
            Some(_) => PROBES,
            None => self.job.priority.index(),
        }
    }
}

/// Room for one job and then for its result. The entry of a free slot means nothing.
#[derive(Debug)]
struct Slot {
    /// Behind this one in whichever list it is.
    next: Option<usize>,
    stage: Stage,
    entry: Entry,
    result: Result<(), LinkError>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Free,
    /// Waiting, or popped and on the wire.
    Pending,
    /// On the wire, and its caller is gone.
    Abandoned,
    Done,
}

/// A list of slots, linked through them.
#[derive(Debug, Default)]
struct List {
    first: Option<usize>,
    last: usize,
    length: usize,
}

impl List {
    fn push_back(&mut self, slots: &mut [Slot], index: usize) {
        slots[index].next = None;
        match self.first {
            Some(_) => slots[self.last].next = Some(index),
            None => self.first = Some(index),
        }
        self.last = index;
        self.length += 1;
    }

    fn push_front(&mut self, slots: &mut [Slot], index: usize) {
        slots[index].next = self.first;
        if self.first.is_none() {
            self.last = index;
        }
        self.first = Some(index);
        self.length += 1;
    }

    fn pop_front(&mut self, slots: &[Slot]) -> Option<usize> {
        let index = self.first?;
        self.first = slots[index].next;
        self.length -= 1;
        Some(index)
    }

    /// Says whether it was there.
    fn remove(&mut self, slots: &mut [Slot], index: usize) -> bool {
        let mut whole = std::mem::take(self);
        let mut found = false;
        while let Some(other) = whole.pop_front(slots) {
            match other == index {
                true => found = true,
                false => self.push_back(slots, other),
            }
        }
        found
    }

    /// Takes one out that stands behind `before`.
    fn unlink(&mut self, slots: &mut [Slot], before: Option<usize>, index: usize) {
        let next = slots[index].next;
        match before {
            Some(before) => slots[before].next = next,
            None => self.first = next,
        }
        if next.is_none() {
            self.last = before.unwrap_or_default();
        }
        self.length -= 1;
    }

    fn indexes<'a>(&self, slots: &'a [Slot]) -> impl Iterator<Item = usize> + use<'a> {
        std::iter::successors(self.first, |index| slots[*index].next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::Ask;

    fn entry(priority: Priority, address: u16) -> Entry {
        let job = Job {
            unit: 1,
            ask: Ask::Holding { address, count: 1 },
            priority,
            timeout: Duration::from_secs(1),
            spacing: Duration::ZERO,
            short: false,
            registers: vec![address],
        };
        Entry { job, since: Duration::ZERO, tries: 0, modest_until: None, waker: None }
    }

    fn probe(address: u16) -> Entry {
        Entry { modest_until: Some(Duration::from_secs(10)), ..entry(Priority::Poll, address) }
    }

    fn address(entry: &Entry) -> u16 {
        entry.job.registers[0]
    }

    fn drain(queue: &mut Queue) -> Vec<u16> {
        drain_at(queue, Duration::ZERO)
    }

    fn drain_at(queue: &mut Queue, now: Duration) -> Vec<u16> {
        std::iter::from_fn(|| pop(queue, now).map(|place| address(queue.entry(place).unwrap()))).collect()
    }

    fn pop(queue: &mut Queue, now: Duration) -> Option<Place> {
        match queue.pick(now, |_| Turn::Now(0)) {
            Pick::Job(place) => Some(place),
            Pick::Wait(_) | Pick::Nobody => None,
        }
    }

    #[test]
    fn keeps_order_within_priority_whatever_leaves() {
        let mut queue = Queue::new(8);
        for first in 1..=4 {
            queue.push(entry(Priority::Poll, first));
        }
        let middle = queue.push(entry(Priority::Poll, 5));
        queue.push(entry(Priority::Poll, 6));
        let last = queue.push(entry(Priority::Poll, 7));
        queue.cancel(middle);
        queue.cancel(last);
        // Both slots are used again.
        queue.push(entry(Priority::Command, 8));
        queue.push(entry(Priority::Poll, 9));
        assert_eq!(queue.slots.len(), 7);
        assert_eq!(queue.waiting().map(address).collect::<Vec<_>>(), [8, 1, 2, 3, 4, 6, 9]);

        let mut wakes = Vec::new();
        queue.fail_waiting(|entry| address(entry).is_multiple_of(2).then_some(LinkError::Closed), &mut wakes);
        let first = pop(&mut queue, Duration::ZERO).unwrap();
        queue.put_back(first);
        assert_eq!(drain(&mut queue), [3, 9, 1], "a second try comes last");
        assert!(queue.is_empty());
    }

    #[test]
    fn probes_come_last_but_not_never() {
        let mut queue = Queue::new(4);
        let fill = |queue: &mut Queue| {
            for address in [1, 2] {
                queue.push(probe(address));
            }
            for (address, priority) in [(3, Priority::Poll), (4, Priority::Poll), (5, Priority::Person)] {
                queue.push(entry(priority, address));
            }
        };
        fill(&mut queue);
        assert_eq!(queue.room(Priority::Poll), Err(LinkError::QueueFull { waiting: 4 }));
        assert_eq!(drain_at(&mut queue, Duration::from_millis(9_999)), [5, 3, 4, 1, 2]);
        queue.push(entry(Priority::Poll, 0));
        assert_eq!(drain(&mut queue), [0]);
        // One that has waited long enough makes polls wait, and the next one not at once.
        fill(&mut queue);
        assert_eq!(drain_at(&mut queue, Duration::from_secs(13)), [5, 1, 3, 4, 2]);
        let gone = queue.push(probe(6));
        queue.cancel(gone);
        assert!(queue.is_empty());
    }

    #[test]
    fn takes_whose_turn_it_is_and_leaves_the_others_in_order() {
        let mut queue = Queue::new(8);
        for number in 1..=6 {
            queue.push(entry(Priority::Poll, number));
        }
        let at = Duration::from_secs;
        // Even ones wait for their own second, odd ones go backwards.
        let turn = |entry: &Entry| match address(entry) {
            number if number % 2 == 0 => Turn::At(at(number.into())),
            number => Turn::Now(100 - u64::from(number)),
        };
        for number in [5, 3, 1] {
            let Pick::Job(place) = queue.pick(at(0), turn) else { panic!("nobody's turn") };
            assert_eq!(address(queue.entry(place).unwrap()), number);
        }
        assert_eq!(queue.pick(at(0), turn), Pick::Wait(at(2)));
        queue.push(entry(Priority::Person, 8));
        assert_eq!(queue.pick(at(0), turn), Pick::Wait(at(2)), "whichever class it is");
        queue.push(entry(Priority::Poll, 9));
        assert_eq!(drain(&mut queue), [8, 2, 4, 6, 9], "nobody was lost");
        assert_eq!(queue.pick(at(0), turn), Pick::Nobody);
    }

    #[test]
    fn gives_the_buffer_back_with_the_result() {
        let mut queue = Queue::new(1);
        let ticket = queue.push(entry(Priority::Person, 7));
        assert_eq!(queue.room(Priority::Person), Err(LinkError::QueueFull { waiting: 1 }));
        assert_eq!(queue.room(Priority::Poll), Ok(()));
        let place = pop(&mut queue, Duration::ZERO).unwrap();
        queue.finish(place, Err(LinkError::Closed), &mut Vec::new());
        // What ends twice keeps its first end.
        queue.finish(place, Ok(()), &mut Vec::new());
        let Poll::Ready(outcome) = queue.take(&ticket, Waker::noop()) else {
            panic!("not done");
        };
        assert_eq!(outcome, Outcome { result: Err(LinkError::Closed), registers: vec![7], done: 0 });
        assert_eq!(queue.push(entry(Priority::Poll, 8)), ticket, "its slot is free");
    }
}
