//! One reader of the stream: the whole state first, then what changes, at its own pace.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use axum::body::Bytes;
use futures_util::FutureExt;
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};

use super::channel::Seat;
use super::deflate::{self, Envelope};
use super::event::{About, Event, Frame, put};
use super::filter::{View, Wish};
use super::whole::Whole;
use crate::api::types::ResumedEvent;
use crate::hub::Hub;
use crate::stop::Stop;

/// Proxies close what says nothing for long.
pub(super) const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// A reader that falls behind over and over is told the whole state no more often than that.
pub(super) const REST: Duration = Duration::from_secs(1);

/// What is handed over at a time, before compression, unless one event is larger.
const CHUNK: usize = 16 << 10;

/// So many events are taken out of the ring at a time.
const BATCH: u64 = 64;

/// One reader.
pub(super) struct Reader {
    hub: Arc<Hub>,
    wish: Wish,
    view: View,
    /// Which devices and wires it knows of; none where it came back and nobody asked it.
    generation: Option<u64>,
    phase: Phase,
    /// When the whole state was last begun.
    begun: Instant,
    /// When something was last said.
    spoke: Instant,
    /// Set when the stream is compressed.
    envelope: Option<Envelope>,
    /// What goes out before everything else, as it is.
    head: Vec<u8>,
    news: watch::Receiver<u64>,
    stop: Stop,
    _seat: Seat,
}

enum Phase {
    Returning(u64),
    Telling(Whole),
    Following(Follow),
    Resting(Instant),
    Ended,
}

/// A place in the ring.
struct Follow {
    position: u64,
    /// Until it is behind what the whole state may hold: by key of the device, the last event that is in it.
    seen: Option<(u64, HashMap<u64, u64>)>,
}

impl Reader {
    /// A reader that wants this, that has everything up to an event if it names one, and that understands gzip or not.
    pub(super) fn new(hub: Arc<Hub>, wish: Wish, last: Option<&str>, gzip: bool) -> Self {
        // First of all: from here on nothing happens without being written down.
        let seat = Seat::take(&hub);
        let (channel, stop) = (hub.channel(), hub.stop());
        let news = channel.news();
        let (generation, table) = (hub.generation(), hub.table());
        let view = wish.view(&table, &channel.choices);
        let mut head = Vec::new();
        let envelope = gzip.then(|| Envelope::begin(&mut head));
        let place = last.and_then(|id| channel.place(id));
        let (generation, phase) = match place {
            Some(place) => (None, Phase::Returning(place)),
            None => (Some(generation), Phase::Telling(Whole::snapshot(&hub, &table, &wish))),
        };
        let begun = Instant::now();
        Self {
            hub,
            wish,
            view,
            generation,
            phase,
            begun,
            spoke: begun,
            envelope,
            head,
            news,
            stop,
            _seat: seat,
        }
    }

    /// The next bytes to send; none at the end.
    pub(super) async fn next(&mut self) -> Option<Bytes> {
        loop {
            if self.stop.requested().now_or_never().is_some() {
                return self.end();
            }
            let announced = *self.news.borrow_and_update();
            let mut chunk = Chunk::default();
            self.fill(&mut chunk, announced);
            // What happens may all be nothing to this reader.
            if chunk.is_empty() && self.spoke + KEEP_ALIVE <= Instant::now() {
                chunk.own(&mut self.envelope, b": keep-alive\n\n".to_vec());
            }
            if let Some(bytes) = chunk.take(&mut self.head) {
                self.spoke = Instant::now();
                return Some(bytes);
            }
            let rest = match self.phase {
                Phase::Resting(until) => Some(until),
                _ => None,
            };
            tokio::select! {
                biased;
                () = self.stop.requested() => {}
                () = sleep_until(rest.unwrap_or(self.begun)), if rest.is_some() => {}
                _ = self.news.changed(), if rest.is_none() => {}
                () = sleep_until(self.spoke + KEEP_ALIVE) => {}
            }
        }
    }

    fn end(&mut self) -> Option<Bytes> {
        if matches!(self.phase, Phase::Ended) {
            return None;
        }
        self.phase = Phase::Ended;
        let mut end = std::mem::take(&mut self.head);
        self.envelope.as_ref()?.end(&mut end);
        Some(end.into())
    }

    /// Puts in what there is to send now, of the events those before a number.
    fn fill(&mut self, chunk: &mut Chunk, announced: u64) {
        // A turn that brings nothing leads to the next one, until there is nothing more.
        while chunk.is_empty() && self.turn(chunk, announced) {}
    }

    /// Whether another turn is worth while.
    fn turn(&mut self, chunk: &mut Chunk, announced: u64) -> bool {
        match std::mem::replace(&mut self.phase, Phase::Ended) {
            Phase::Returning(position) => {
                let mut text = Vec::new();
                put(&mut text, "resumed", &ResumedEvent {}, Some(&self.hub.channel().id(position)));
                chunk.own(&mut self.envelope, text);
                self.phase = Phase::Following(Follow { position, seen: None });
                true
            }
            Phase::Telling(whole) => {
                self.tell(whole, chunk);
                true
            }
            Phase::Following(follow) => self.follow(follow, chunk, announced),
            Phase::Resting(until) => {
                let rested = until <= Instant::now();
                match rested {
                    true => self.begin(),
                    false => self.phase = Phase::Resting(until),
                }
                rested
            }
            Phase::Ended => false,
        }
    }

    /// Goes on with the whole state.
    fn tell(&mut self, mut whole: Whole, chunk: &mut Chunk) {
        let mut text = Vec::new();
        while text.len() < CHUNK && !whole.is_done() {
            if whole.is_between_events() && self.generation != Some(self.hub.generation()) {
                break;
            }
            whole.tell(&self.hub, &self.view, &mut text);
        }
        chunk.own(&mut self.envelope, text);
        if whole.is_between_events() && self.generation != Some(self.hub.generation()) {
            self.begin();
        } else if whole.is_done() {
            let (position, seen) = whole.done();
            let follow = Follow { position, seen: Some((self.hub.channel().next(), seen)) };
            self.phase = Phase::Following(follow);
        } else {
            self.phase = Phase::Telling(whole);
        }
    }

    /// Begins with the whole state: of the devices it knows, or of the others that there are now.
    fn begin(&mut self) {
        let (generation, table) = (self.hub.generation(), self.hub.table());
        let whole = if self.generation == Some(generation) {
            Whole::again(&self.hub, &table, &self.wish)
        } else {
            self.view = self.wish.view(&table, &self.hub.channel().choices);
            self.generation = Some(generation);
            Whole::snapshot(&self.hub, &table, &self.wish)
        };
        self.begun = Instant::now();
        self.phase = Phase::Telling(whole);
    }

    /// Takes what is in the ring. False when the end of it is reached.
    fn follow(&mut self, mut follow: Follow, chunk: &mut Chunk, announced: u64) -> bool {
        let most = announced.saturating_sub(follow.position).min(BATCH);
        let Ok(events) = self.hub.channel().from(follow.position, most) else {
            self.behind();
            return true;
        };
        let more = most == BATCH;
        for event in events {
            if let About::Exchanged(generation) = event.about
                && self.generation != Some(generation)
            {
                self.begin();
                return true;
            }
            let frame = if follow.is_news(&event) { self.view.of(&event) } else { None };
            if frame.is_some_and(|frame| !chunk.shared(&mut self.envelope, &frame)) {
                break;
            }
            follow.position += 1;
        }
        if follow.seen.as_ref().is_some_and(|(until, _)| *until <= follow.position) {
            follow.seen = None;
        }
        self.phase = Phase::Following(follow);
        more
    }

    /// It missed something: the whole state takes its place, unless that was only just told.
    fn behind(&mut self) {
        let again = self.begun + REST;
        if again <= Instant::now() { self.begin() } else { self.phase = Phase::Resting(again) }
    }
}

impl Follow {
    /// Whether the whole state does not hold it already.
    fn is_news(&self, event: &Event) -> bool {
        match (event.about, &self.seen) {
            (About::Exchanged(_), _) => false,
            (About::Device { key, sequence }, Some((_, seen))) => {
                seen.get(&key).is_none_or(|seen| sequence > *seen)
            }
            _ => true,
        }
    }
}

/// What is handed over at a time.
#[derive(Default)]
struct Chunk {
    parts: Vec<Bytes>,
    size: usize,
}

impl Chunk {
    fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Puts in what others are sent as well; false when it has no room left.
    fn shared(&mut self, envelope: &mut Option<Envelope>, frame: &Frame) -> bool {
        if self.size > 0 && self.size + frame.plain().len() > CHUNK {
            return false;
        }
        self.size += frame.plain().len();
        self.parts.push(match envelope {
            Some(envelope) => {
                envelope.sent(frame.plain());
                frame.packed().clone()
            }
            None => frame.plain().clone(),
        });
        true
    }

    /// Puts in what is for this reader alone.
    fn own(&mut self, envelope: &mut Option<Envelope>, text: Vec<u8>) {
        if text.is_empty() {
            return;
        }
        self.size += text.len();
        self.parts.push(match envelope {
            Some(envelope) => {
                envelope.sent(&text);
                deflate::piece(&text)
            }
            None => text.into(),
        });
    }

    /// The bytes of it, with those before them; what others are sent as well is not copied if it is alone.
    fn take(self, head: &mut Vec<u8>) -> Option<Bytes> {
        let mut parts = self.parts;
        match parts.len() {
            0 => None,
            1 if head.is_empty() => parts.pop(),
            _ => {
                let mut whole = std::mem::take(head);
                whole.reserve(parts.iter().map(Bytes::len).sum());
                parts.iter().for_each(|part| whole.extend_from_slice(part));
                Some(whole.into())
            }
        }
    }
}
