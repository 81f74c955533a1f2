//! Places for readers of the event stream. When all are taken, whoever has the most gives one to whoever has fewer.

use std::collections::HashMap;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};

use axum::body::{Body, Bytes, HttpBody};
use axum::http::Extensions;
use axum::response::Response;
use hyper::body::{Frame, SizeHint};
use tokio::sync::oneshot;

/// Who asks, as far as addresses tell: one address, or one network of IPv6, of which a single machine may have all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Peer(IpAddr);

impl Peer {
    pub(crate) fn of(address: IpAddr) -> Self {
        match address.to_canonical() {
            IpAddr::V6(address) => Self(Ipv6Addr::from_bits(address.to_bits() >> 64 << 64).into()),
            address => Self(address),
        }
    }

    /// Who sent a request; those of whom nothing is known are one.
    pub(crate) fn in_request(extensions: &Extensions) -> Self {
        extensions.get().copied().unwrap_or(Self(Ipv4Addr::UNSPECIFIED.into()))
    }

    /// Who among all of these is there most often, and how often.
    pub(crate) fn most_frequent(peers: impl Iterator<Item = Self>) -> Option<(Self, usize)> {
        let mut counts: HashMap<Self, usize> = HashMap::new();
        peers.for_each(|peer| *counts.entry(peer).or_default() += 1);
        counts.into_iter().max_by_key(|(_, count)| *count)
    }
}

/// All places, and who has them.
#[derive(Debug)]
pub(crate) struct Streams {
    most: usize,
    taken: Mutex<Taken>,
}

#[derive(Debug, Default)]
struct Taken {
    next: u64,
    /// In the order in which they were taken.
    places: Vec<(u64, Peer, oneshot::Sender<()>)>,
}

impl Streams {
    pub(crate) fn new(most: usize) -> Arc<Self> {
        Arc::new(Self { most, taken: Mutex::default() })
    }

    /// A place, or none when nobody has more of them than this one would.
    pub(crate) fn take(self: &Arc<Self>, peer: Peer) -> Option<Place> {
        let mut taken = self.taken();
        if taken.places.len() >= self.most {
            let (greedy, most) = Peer::most_frequent(taken.places.iter().map(|(_, peer, _)| *peer))?;
            let own = taken.places.iter().filter(|(_, other, _)| *other == peer).count();
            if most <= own + 1 {
                return None;
            }
            let oldest = taken.places.iter().position(|(_, peer, _)| *peer == greedy)?;
            // Its reader hears of it, for this is the sending half.
            taken.places.remove(oldest);
        }
        let (end, ended) = oneshot::channel();
        let id = taken.next;
        taken.next += 1;
        taken.places.push((id, peer, end));
        Some(Place { id, streams: Arc::clone(self), ended })
    }

    fn taken(&self) -> MutexGuard<'_, Taken> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// One place, free again when it is dropped.
#[derive(Debug)]
pub(crate) struct Place {
    id: u64,
    streams: Arc<Streams>,
    /// Ready once somebody else has it.
    ended: oneshot::Receiver<()>,
}

impl Place {
    /// The answer that has this place, and breaks off when it loses it.
    pub(crate) fn hold(self, response: Response) -> Response {
        response.map(|body| Body::new(Placed { body, place: self }))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.streams.taken().places.retain(|(id, ..)| *id != self.id);
    }
}

struct Placed {
    body: Body,
    place: Place,
}

impl HttpBody for Placed {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        if Pin::new(&mut self.place.ended).poll(cx).is_ready() {
            return Poll::Ready(Some(Err(axum::Error::new("its place was given to another reader"))));
        }
        Pin::new(&mut self.body).poll_frame(cx)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peer(address: &str) -> Peer {
        Peer::of(address.parse().unwrap())
    }

    #[test]
    fn one_machine_is_one_peer() {
        assert_eq!(peer("192.0.2.7"), peer("::ffff:192.0.2.7"));
        assert_eq!(peer("2001:db8:0:1::1"), peer("2001:db8:0:1:ffff::2"));
        assert_ne!(peer("2001:db8:0:1::1"), peer("2001:db8:0:2::1"));
        assert_ne!(peer("192.0.2.7"), peer("192.0.2.8"));
    }

    #[test]
    fn who_has_many_places_gives_one_to_who_has_few() {
        let streams = Streams::new(4);
        let (greedy, modest) = (peer("192.0.2.1"), peer("192.0.2.2"));
        let mut held: Vec<Place> = (0..4).map(|_| streams.take(greedy).unwrap()).collect();
        assert!(streams.take(greedy).is_none(), "nobody has more than it");
        let mut theirs = vec![streams.take(modest).unwrap()];
        theirs.push(streams.take(modest).unwrap());
        assert!(streams.take(modest).is_none() && streams.take(greedy).is_none(), "two each");
        let ended: Vec<bool> =
            held.iter_mut().map(|place| place.ended.try_recv().is_err_and(is_closed)).collect();
        assert_eq!(ended, [true, true, false, false], "the oldest went");
        // One that has lost its place gives none back.
        held.drain(..2);
        assert!(streams.take(modest).is_none());
        drop(held);
        assert!(streams.take(modest).is_some());
    }

    fn is_closed(error: oneshot::error::TryRecvError) -> bool {
        error == oneshot::error::TryRecvError::Closed
    }
}
