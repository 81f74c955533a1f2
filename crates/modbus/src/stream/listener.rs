//! A decoder that sees both directions and tells requests from responses by what went before.

use super::cut::{Extent, judge, request_extent, response_extent};
use super::{Cut, Cutter, Framing, Guess, Losses};
use crate::error::Fault;
use crate::pdu::function::{WRITE_SINGLE_COIL, WRITE_SINGLE_REGISTER};
use crate::pdu::{EXCEPTION_BIT, Expected, Request, Response};

/// TCP: how many requests may wait for their responses.
const REMEMBERED: usize = 16;

/// Which way a frame went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Kind {
    /// From the client.
    Request,
    /// From the server.
    Response,
    /// A whole frame whose PDU is neither.
    Unclear,
}

/// One frame that was overheard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heard<'a> {
    /// Which way it went.
    pub kind: Kind,
    /// The transaction id of the MBAP header; 0 in RTU, which has none.
    pub transaction: u16,
    /// The unit id.
    pub unit: u8,
    /// 1 to 253 bytes.
    pub pdu: &'a [u8],
}

/// Cuts what a listener hears on a line, or on a connection whose two directions are pushed a frame at a time.
///
/// Requests and responses of one function may look the same (all of functions 5 and 6, some of 1 to 4); the request
/// before decides: what may answer it is its response. A request repeated because nobody answered is therefore heard
/// as the response to the first where the two cannot be told apart.
///
/// Call [`push`](Self::push), then [`next_frame`](Self::next_frame) until it yields `None`.
#[derive(Clone, Debug)]
pub struct ListenerDecoder {
    cutter: Cutter,
    context: Context,
}

impl ListenerDecoder {
    /// A decoder at the start of a stream.
    #[must_use]
    pub fn new(framing: Framing) -> Self {
        Self {
            cutter: Cutter::new(framing),
            context: match framing {
                Framing::Rtu => Context::Line(None),
                Framing::Tcp => Context::Connection { asked: [None; REMEMBERED], next: 0 },
            },
        }
    }

    /// Takes bytes in, of either direction. They are kept until `next_frame` has seen them.
    pub fn push(&mut self, bytes: &[u8]) {
        self.cutter.push(bytes);
    }

    /// The next frame, or `None` when more bytes are needed.
    ///
    /// # Errors
    /// [`Fault`], over TCP only and once. What follows is dropped and counted.
    pub fn next_frame(&mut self) -> Option<Result<Heard<'_>, Fault>> {
        let context = &self.context;
        let mut likely = None;
        let cut = self.cutter.next(|bytes, silent| {
            let (guess, kind) = context.guess(bytes, silent);
            likely = kind;
            guess
        })?;
        Some(cut.map(|cut| self.heard(&cut, likely)))
    }

    /// RTU: nothing came for at least 3.5 characters, so what has not become a frame never will. Call
    /// [`next_frame`](Self::next_frame) afterwards. Over TCP silence means nothing.
    pub fn silence(&mut self) {
        self.cutter.silence();
    }

    /// Forgets unfinished bytes, the fault and what was asked; keeps the counts.
    pub fn reset(&mut self) {
        self.cutter.reset();
        self.context.forget();
    }

    /// Whether there are bytes that have not become a frame yet.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        self.cutter.is_waiting()
    }

    /// Why the stream cannot be followed any longer, if it cannot.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.cutter.fault()
    }

    /// What was dropped so far.
    #[must_use]
    pub fn losses(&self) -> &Losses {
        self.cutter.losses()
    }

    fn heard(&mut self, cut: &Cut, likely: Option<Kind>) -> Heard<'_> {
        let frame = self.cutter.frame(cut);
        let kind = match likely {
            Some(kind) => kind,
            None => self.context.kind(frame.transaction, frame.unit, frame.pdu),
        };
        self.context.learn(kind, frame.transaction, frame.unit, frame.pdu);
        Heard { kind, transaction: frame.transaction, unit: frame.unit, pdu: frame.pdu }
    }
}

/// What was asked and not answered yet.
#[derive(Clone, Debug)]
enum Context {
    /// A serial line has one request at a time.
    Line(Option<Asked>),
    Connection {
        asked: [Option<Asked>; REMEMBERED],
        /// The place to use next; the oldest is forgotten.
        next: usize,
    },
}

#[derive(Clone, Copy, Debug)]
struct Asked {
    transaction: u16,
    unit: u8,
    expected: Expected,
}

impl Asked {
    /// Whether unit, function, and transaction where there is one, are those asked.
    fn is_for(&self, transaction: u16, unit: u8, pdu: &[u8]) -> bool {
        let function = pdu.first().copied().unwrap_or_default();
        self.transaction == transaction && self.unit == unit && self.expected.is_function(function)
    }

    /// Whether the PDU answers what was asked.
    fn is_answered_by(&self, pdu: &[u8]) -> bool {
        Response::decode(pdu).is_ok_and(|response| self.expected.check(&response).is_ok())
    }
}

impl Context {
    fn forget(&mut self) {
        match self {
            Self::Line(asked) => *asked = None,
            Self::Connection { asked, .. } => *asked = [None; REMEMBERED],
        }
    }

    /// The request that a frame may be the response to.
    fn asked(&self, transaction: u16, unit: u8, pdu: &[u8]) -> Option<&Asked> {
        match self {
            Self::Line(asked) => asked.iter().find(|a| a.is_for(transaction, unit, pdu)),
            Self::Connection { asked, .. } => {
                let mut asked = asked.iter().flatten();
                asked.find(|a| a.is_for(transaction, unit, pdu))
            }
        }
    }

    /// What RTU bytes from one place on may be, and which way a frame there went.
    ///
    /// A response that fits the request before is looked for first. Otherwise the shorter reading comes first, for
    /// its check sum can be judged first.
    fn guess(&self, bytes: &[u8], silent: bool) -> (Guess, Option<Kind>) {
        let request = (Kind::Request, request_extent(bytes));
        let response = (Kind::Response, response_extent(bytes));
        let readings = if self.awaits(bytes) || is_shorter(response.1, request.1) {
            [response, request]
        } else {
            [request, response]
        };
        let mut verdict = Guess::Nothing;
        for (kind, extent) in readings {
            match judge(bytes, extent) {
                Guess::Frame(len) => {
                    let pdu = bytes.get(1..len - 2).unwrap_or_default();
                    return (Guess::Frame(len), Some(self.correct(kind, bytes, pdu)));
                }
                Guess::Incomplete if !silent => return (Guess::Incomplete, None),
                Guess::Nothing => {}
                other if verdict != Guess::Damaged => verdict = other,
                _ => {}
            }
        }
        (verdict, None)
    }

    /// Whether RTU bytes begin like the response to the last request.
    fn awaits(&self, bytes: &[u8]) -> bool {
        let [unit, pdu @ ..] = bytes else {
            return false;
        };
        let Some(asked) = self.asked(0, *unit, pdu) else {
            return false;
        };
        match pdu {
            [EXCEPTION_BIT..=u8::MAX, ..] => true,
            [_, count, ..] => asked.expected.check_data((*count).into()).is_ok(),
            _ => true,
        }
    }

    /// Functions 5 and 6 look alike in both directions: what repeats the request is its response, anything else
    /// is the next request.
    fn correct(&self, kind: Kind, bytes: &[u8], pdu: &[u8]) -> Kind {
        let looks_alike = matches!(pdu, [WRITE_SINGLE_COIL | WRITE_SINGLE_REGISTER, ..]);
        let unit = bytes.first().copied().unwrap_or_default();
        match self.asked(0, unit, pdu) {
            Some(asked) if looks_alike && !asked.is_answered_by(pdu) => Kind::Request,
            _ => kind,
        }
    }

    /// Which way a frame went whose bytes alone do not tell.
    fn kind(&self, transaction: u16, unit: u8, pdu: &[u8]) -> Kind {
        let asked = self.asked(transaction, unit, pdu);
        if asked.is_some_and(|asked| asked.is_answered_by(pdu)) {
            Kind::Response
        } else if Request::decode(pdu).is_ok() {
            Kind::Request
        } else if Response::decode(pdu).is_ok() {
            Kind::Response
        } else {
            Kind::Unclear
        }
    }

    /// Remembers a request until its response.
    fn learn(&mut self, kind: Kind, transaction: u16, unit: u8, pdu: &[u8]) {
        let request = match kind {
            Kind::Request => Request::decode(pdu).ok(),
            _ => None,
        };
        let now_asked = request.map(|request| {
            // Nobody tells a listener what the device does with long reads.
            let expected = Expected::of(&request).or_short();
            Asked { transaction, unit, expected }
        });
        match self {
            Self::Line(asked) if kind == Kind::Request => *asked = now_asked,
            Self::Line(asked) => {
                asked.take_if(|asked| asked.is_for(transaction, unit, pdu));
            }
            Self::Connection { asked, next } if kind == Kind::Request => {
                if let Some(place) = asked.get_mut(*next) {
                    *place = now_asked;
                }
                *next = (*next + 1) % REMEMBERED;
            }
            Self::Connection { asked, .. } => {
                let answered = asked.iter_mut().find(|a| a.is_some_and(|a| a.is_for(transaction, unit, pdu)));
                if let Some(place) = answered {
                    *place = None;
                }
            }
        }
    }
}

/// Whether one reading is certain to end before the other.
fn is_shorter(one: Extent, other: Extent) -> bool {
    match (one, other) {
        (Extent::Known(one), Extent::Known(other)) => one < other,
        (Extent::Known(_), _) => true,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{mbap, rtu};

    use Kind::{Request as Asked, Response as Answered};

    /// A label, PDUs, and which way each goes.
    type Case = (&'static str, &'static [&'static [u8]], &'static [Kind]);

    #[test]
    fn rtu_tells_requests_from_responses() {
        let cases: [Case; 10] = [
            ("a read", &[&[3, 0, 0x20, 0, 2], &[3, 4, 0, 1, 0, 2]], &[Asked, Answered]),
            ("a write and its echo", &[&[6, 0, 0x40, 0, 0x10], &[6, 0, 0x40, 0, 0x10]], &[Asked, Answered]),
            (
                "two writes, one unanswered",
                &[&[5, 0, 3, 0xFF, 0], &[5, 0, 4, 0xFF, 0], &[5, 0, 4, 0xFF, 0]],
                &[Asked, Asked, Answered],
            ),
            (
                "many registers",
                &[&[0x10, 0, 1, 0, 2, 4, 0, 1, 0, 2], &[0x10, 0, 1, 0, 2]],
                &[Asked, Answered],
            ),
            ("an exception", &[&[3, 0, 0, 0, 1], &[0x83, 2]], &[Asked, Answered]),
            // 17 coils take 3 bytes: the response is as long as a request.
            ("as long as a request", &[&[1, 0, 0, 0, 17], &[1, 3, 0xFF, 0xFF, 1]], &[Asked, Answered]),
            ("a response whose request was missed", &[&[3, 4, 0, 1, 0, 2]], &[Answered]),
            ("a confirmation whose request was missed", &[&[0x10, 0, 1, 0, 2]], &[Answered]),
            ("a read repeated", &[&[3, 0, 0x20, 0, 2], &[3, 0, 0x20, 0, 2]], &[Asked, Asked]),
            (
                "a short answer, then the next",
                &[&[3, 0x28, 0, 0, 40], &[3, 4, 0, 1, 0, 2], &[3, 0x28, 0, 0, 40]],
                &[Asked, Answered, Asked],
            ),
        ];
        for (label, pdus, kinds) in cases {
            let stream: Vec<u8> = pdus.iter().flat_map(|pdu| sealed(9, pdu)).collect();
            for at in 0..=stream.len() {
                let mut decoder = ListenerDecoder::new(Framing::Rtu);
                decoder.push(&stream[..at]);
                let mut heard = drain(&mut decoder);
                decoder.push(&stream[at..]);
                heard.extend(drain(&mut decoder));
                let expected: Vec<_> =
                    kinds.iter().zip(pdus).map(|(kind, pdu)| (*kind, 0, 9, pdu.to_vec())).collect();
                assert_eq!(heard, expected, "{label}, split at {at}");
                assert_eq!(*decoder.losses(), Losses::default(), "{label}");
            }
        }
    }

    #[test]
    fn rtu_silence_settles_what_looks_like_a_longer_response() {
        // 1020h: the request that follows an unanswered one looks like a response of 16 bytes.
        let stream = [sealed(1, &[3, 0x10, 0x20, 0, 16]), sealed(1, &[3, 0x10, 0x20, 0, 16])].concat();
        let mut decoder = ListenerDecoder::new(Framing::Rtu);
        decoder.push(&stream);
        assert_eq!(drain(&mut decoder).len(), 1);
        decoder.silence();
        assert_eq!(drain(&mut decoder), [(Asked, 0, 1, vec![3, 0x10, 0x20, 0, 16])]);
        assert_eq!(*decoder.losses(), Losses::default());
    }

    #[test]
    fn rtu_other_functions_end_by_silence() {
        let mut decoder = ListenerDecoder::new(Framing::Rtu);
        let mut heard = Vec::new();
        for pdu in [&[0x11][..], &[0x11, 2, 0x42, 0xFF]] {
            decoder.push(&sealed(7, pdu));
            heard.extend(drain(&mut decoder));
            decoder.silence();
            heard.extend(drain(&mut decoder));
        }
        assert_eq!(heard, [(Asked, 0, 7, vec![0x11]), (Answered, 0, 7, vec![0x11, 2, 0x42, 0xFF])]);
    }

    #[test]
    fn rtu_drops_garbage_and_counts_it() {
        let mut decoder = ListenerDecoder::new(Framing::Rtu);
        decoder.push(&[0x55, 0x60]);
        decoder.push(&sealed(1, &[3, 0, 0, 0, 1]));
        let mut damaged = sealed(1, &[3, 2, 0, 7]);
        damaged[3] ^= 1;
        decoder.push(&damaged);
        decoder.push(&sealed(1, &[3, 0, 0, 0, 1]));
        assert_eq!(drain(&mut decoder).len(), 2);
        assert_eq!(*decoder.losses(), Losses { garbage_bytes: 9, crc_errors: 1, ..Losses::default() });
    }

    #[test]
    fn tcp_pairs_by_transaction() {
        let mut decoder = ListenerDecoder::new(Framing::Tcp);
        let frames: [(u16, &[u8], Kind); 9] = [
            (1, &[6, 0, 1, 0, 1], Asked),
            (2, &[6, 0, 1, 0, 1], Asked),
            (2, &[6, 0, 1, 0, 1], Answered),
            (1, &[6, 0, 1, 0, 1], Answered),
            (3, &[3, 0, 0, 0, 1], Asked),
            (3, &[3, 2, 0, 7], Answered),
            (4, &[3, 2, 0, 7], Answered),
            (5, &[0x83, 2], Answered),
            (6, &[0x83, 2, 3], Kind::Unclear),
        ];
        for (transaction, pdu, kind) in frames {
            let mut bytes = Vec::new();
            let [high, low] = transaction.to_be_bytes();
            bytes.extend_from_slice(&[high, low, 0, 0, 0, pdu.len() as u8 + 1, 5]);
            bytes.extend_from_slice(pdu);
            assert!(mbap::decode(&bytes).is_ok());
            decoder.push(&bytes);
            assert_eq!(drain(&mut decoder), [(kind, transaction, 5, pdu.to_vec())]);
        }
    }

    #[test]
    fn tcp_forgets_the_oldest() {
        let mut decoder = ListenerDecoder::new(Framing::Tcp);
        let write = |id: u8| [0, id, 0, 0, 0, 6, 1, 6, 0, 1, 0, 1];
        for id in 0..=16 {
            decoder.push(&write(id));
        }
        assert!(drain(&mut decoder).iter().all(|heard| heard.0 == Asked));
        decoder.push(&write(1));
        decoder.push(&write(0));
        let kinds: Vec<Kind> = drain(&mut decoder).iter().map(|heard| heard.0).collect();
        assert_eq!(kinds, [Answered, Asked]);
    }

    #[test]
    fn a_reset_forgets_what_was_asked() {
        let mut decoder = ListenerDecoder::new(Framing::Rtu);
        let write = sealed(1, &[6, 0, 1, 0, 1]);
        decoder.push(&write);
        assert_eq!(drain(&mut decoder).len(), 1);
        decoder.push(&write[..5]);
        decoder.reset();
        decoder.push(&write);
        assert_eq!(drain(&mut decoder), [(Asked, 0, 1, vec![6, 0, 1, 0, 1])]);
    }

    type Owned = (Kind, u16, u8, Vec<u8>);

    fn drain(decoder: &mut ListenerDecoder) -> Vec<Owned> {
        let mut frames = Vec::new();
        while let Some(heard) = decoder.next_frame() {
            let heard = heard.unwrap();
            frames.push((heard.kind, heard.transaction, heard.unit, heard.pdu.to_vec()));
        }
        frames
    }

    fn sealed(unit: u8, pdu: &[u8]) -> Vec<u8> {
        let body = [&[unit], pdu].concat();
        let crc = rtu::crc16(&body);
        [&body[..], &crc.to_le_bytes()].concat()
    }
}
