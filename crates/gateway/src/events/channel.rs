//! What all readers share: the ring, and the beat at which they wake.

use std::hash::{BuildHasher, Hasher};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::{Notify, watch};

use super::event::{Draft, Event};
use super::filter::Choices;
use super::ring::{Audience, Gone, Ring};
use crate::hub::Hub;

/// Waking a reader costs a write on its socket, so many readers are told of several events at a time.
const PAUSE_EACH: Duration = Duration::from_micros(50);

/// Nobody has to wait longer than that.
const LONGEST_PAUSE: Duration = Duration::from_millis(50);

/// What happens, and who is told.
#[derive(Debug)]
pub(crate) struct Channel {
    /// Tells the ids of this gateway from those of one before it.
    epoch: u64,
    shared: Mutex<Shared>,
    /// What the readers want of each profile.
    pub(super) choices: Choices,
    /// There is something to tell.
    dirty: Notify,
    /// Number of the event to come.
    news: watch::Sender<u64>,
}

#[derive(Debug, Default)]
struct Shared {
    ring: Ring,
    audience: Audience,
}

impl Default for Channel {
    fn default() -> Self {
        Self {
            // Random keys make a random number.
            epoch: std::hash::RandomState::new().build_hasher().finish(),
            shared: Mutex::default(),
            choices: Choices::default(),
            dirty: Notify::new(),
            news: watch::Sender::new(0),
        }
    }
}

impl Channel {
    /// Whether what happens now is worth writing down; if not, it is noted that something did.
    pub(crate) fn listens(&self, now: Duration) -> bool {
        let mut shared = self.shared();
        let listens = shared.audience.listens(now);
        if !listens {
            shared.ring.pass();
        }
        listens
    }

    /// Tells everybody, in this order.
    pub(crate) fn tell(&self, drafts: impl IntoIterator<Item = Draft>) {
        {
            let mut shared = self.shared();
            for draft in drafts {
                let id = self.id(shared.ring.next() + 1);
                shared.ring.push(draft.with_id(&id));
            }
        }
        self.dirty.notify_one();
    }

    /// The id of a place: what is before that number is known.
    pub(super) fn id(&self, number: u64) -> String {
        format!("{:x}-{number}", self.epoch)
    }

    /// The place that an id stands for, if what came after it is still here.
    pub(super) fn place(&self, id: &str) -> Option<u64> {
        let (epoch, number) = id.split_once('-')?;
        let number = number.parse().ok()?;
        let ours = u64::from_str_radix(epoch, 16).is_ok_and(|epoch| epoch == self.epoch);
        (ours && self.shared().ring.from(number).is_ok()).then_some(number)
    }

    /// Number of the event to come.
    pub(super) fn next(&self) -> u64 {
        self.shared().ring.next()
    }

    /// Some events from a number on.
    pub(super) fn from(&self, number: u64, most: u64) -> Result<Vec<Arc<Event>>, Gone> {
        let most = usize::try_from(most).unwrap_or(usize::MAX);
        self.shared().ring.from(number).map(|events| events.take(most).cloned().collect())
    }

    /// Wakes whoever waits for more.
    pub(super) fn news(&self) -> watch::Receiver<u64> {
        self.news.subscribe()
    }

    fn shared(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Wakes the readers when there is something to tell, until the gateway ends.
pub(crate) async fn beat(hub: Arc<Hub>) {
    let mut stop = hub.stop();
    let channel = hub.channel();
    loop {
        tokio::select! {
            () = stop.requested() => return,
            () = channel.dirty.notified() => {}
        }
        let (next, readers) = {
            let shared = channel.shared();
            (shared.ring.next(), shared.audience.readers())
        };
        channel.news.send_replace(next);
        let pause = pause(readers);
        if !pause.is_zero() {
            tokio::time::sleep(pause).await;
        }
    }
}

/// How long so many readers are left alone after they were woken.
fn pause(readers: usize) -> Duration {
    let pause = PAUSE_EACH.saturating_mul(u32::try_from(readers).unwrap_or(u32::MAX));
    // A timer is no finer than that.
    if pause < Duration::from_millis(1) { Duration::ZERO } else { pause.min(LONGEST_PAUSE) }
}

/// A reader's place among the readers.
#[derive(Debug)]
pub(super) struct Seat(Arc<Hub>);

impl Seat {
    pub(super) fn take(hub: &Arc<Hub>) -> Self {
        hub.channel().shared().audience.enter();
        Self(Arc::clone(hub))
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let now = self.0.now();
        self.0.channel().shared().audience.leave(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_are_told_at_once_and_many_together() {
        let pauses = [0, 1, 10, 100, 1_000, 100_000].map(|readers| pause(readers).as_millis());
        assert_eq!(pauses, [0, 0, 0, 5, 50, 50]);
    }

    #[test]
    fn only_an_id_of_this_gateway_stands_for_a_place() {
        let (channel, other) = (Channel::default(), Channel::default());
        assert_eq!(channel.place(&channel.id(0)), Some(0));
        let epoch = channel.id(0).split_once('-').unwrap().0.to_owned();
        for id in [
            "",
            "-",
            "0",
            "-1",
            "x-0",
            &other.id(0),
            &channel.id(1),
            &channel.id(u64::MAX),
            &format!("{epoch}-"),
            &format!("{epoch}--1"),
            &format!("{epoch}-99999999999999999999999"),
            &"9".repeat(100_000),
        ] {
            assert_eq!(channel.place(id), None, "{id:.60}");
        }
    }
}
