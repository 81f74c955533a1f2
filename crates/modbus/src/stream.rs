//! Frames cut out of a stream of bytes, however it arrives in pieces.
//!
//! The decoders of a server and of a listener stand here; a client's is part of [`crate::client`], because it knows
//! what it asked. The same bytes give the same frames in whatever pieces they come. What is no frame is dropped and
//! counted. Nothing is allocated a frame: a decoder holds at most one frame of unfinished bytes beside what was
//! pushed last.

mod cut;
mod listener;

use std::ops::Range;

pub(crate) use cut::{Guess, RtuCutter, guess_response};
pub use listener::{Heard, Kind, ListenerDecoder};

use crate::error::Fault;
use cut::{TcpCutter, guess_request};

/// How frames are set apart. Exhaustive on purpose: Modbus ASCII is not spoken here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Framing {
    /// Unit id, PDU and CRC-16, on a serial line or tunnelled through TCP.
    Rtu,
    /// MBAP header and PDU.
    Tcp,
}

/// One frame of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// The transaction id of the MBAP header; 0 in RTU, which has none.
    pub transaction: u16,
    /// The unit id.
    pub unit: u8,
    /// 1 to 253 bytes.
    pub pdu: &'a [u8],
}

/// What was dropped, and why. Counters only grow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Losses {
    /// Bytes that belong to no frame.
    pub garbage_bytes: u64,
    /// RTU: a frame was due and its check sum was wrong. Counted once until the stream is in step again.
    pub crc_errors: u64,
    /// TCP: whole frames with a protocol identifier other than 0.
    pub wrong_protocol: u64,
    /// Whole frames with a function code that no client sends: 0 or above 127. Only a server looks at it, decoders
    /// leave this at 0.
    pub malformed: u64,
}

/// Cuts what clients send into requests.
///
/// Call [`push`](Self::push), then [`next_frame`](Self::next_frame) until it yields `None`.
#[derive(Clone, Debug)]
pub struct ServerDecoder(Cutter);

impl ServerDecoder {
    /// A decoder at the start of a stream.
    #[must_use]
    pub fn new(framing: Framing) -> Self {
        Self(Cutter::new(framing))
    }

    /// Takes bytes in. They are kept until `next_frame` has seen them.
    pub fn push(&mut self, bytes: &[u8]) {
        self.0.push(bytes);
    }

    /// The next frame, or `None` when more bytes are needed.
    ///
    /// RTU: functions 1 to 6, 15 and 16 end by their length. Any other ends by silence, so it is yielded only after
    /// [`silence`](Self::silence).
    ///
    /// # Errors
    /// [`Fault`], over TCP only and once: close the connection. What follows is dropped and counted.
    pub fn next_frame(&mut self) -> Option<Result<Frame<'_>, Fault>> {
        let cut = self.advance()?;
        Some(cut.map(|cut| self.frame(&cut)))
    }

    /// RTU: nothing came for at least 3.5 characters, so what has not become a frame never will. Call
    /// [`next_frame`](Self::next_frame) afterwards. Over TCP silence means nothing.
    pub fn silence(&mut self) {
        self.0.silence();
    }

    /// The connection was lost: forgets unfinished bytes and the fault, keeps the counts.
    pub fn reset(&mut self) {
        self.0.reset();
    }

    /// Whether there are bytes that have not become a frame yet.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        self.0.is_waiting()
    }

    /// Why the connection has to be closed, if it has.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.0.fault()
    }

    /// What was dropped so far.
    #[must_use]
    pub fn losses(&self) -> &Losses {
        self.0.losses()
    }

    /// Like `next_frame`, without holding on to the bytes.
    pub(crate) fn advance(&mut self) -> Option<Result<Cut, Fault>> {
        self.0.next(|bytes, _| guess_request(bytes))
    }

    pub(crate) fn frame(&self, cut: &Cut) -> Frame<'_> {
        self.0.frame(cut)
    }

    pub(crate) fn count_malformed(&mut self) {
        self.0.losses_mut().malformed += 1;
    }
}

/// Where a frame lies in the buffer; good until the next push.
#[derive(Clone, Debug)]
pub(crate) struct Cut {
    transaction: u16,
    unit: u8,
    pdu: Range<usize>,
}

impl Cut {
    fn of<'a>(&self, bytes: &'a [u8]) -> Frame<'a> {
        Frame {
            transaction: self.transaction,
            unit: self.unit,
            pdu: bytes.get(self.pdu.clone()).unwrap_or_default(),
        }
    }
}

/// One of the two ways to cut.
#[derive(Clone, Debug)]
enum Cutter {
    Rtu(RtuCutter),
    Tcp(TcpCutter),
}

impl Cutter {
    fn new(framing: Framing) -> Self {
        match framing {
            Framing::Rtu => Self::Rtu(RtuCutter::default()),
            Framing::Tcp => Self::Tcp(TcpCutter::default()),
        }
    }

    fn push(&mut self, bytes: &[u8]) {
        match self {
            Self::Rtu(cutter) => cutter.push(bytes),
            Self::Tcp(cutter) => cutter.push(bytes),
        }
    }

    /// `guess` judges RTU bytes and is told whether they end in silence.
    fn next(&mut self, guess: impl FnMut(&[u8], bool) -> Guess) -> Option<Result<Cut, Fault>> {
        match self {
            Self::Rtu(cutter) => cutter.next(guess).map(Ok),
            Self::Tcp(cutter) => cutter.next(),
        }
    }

    fn frame(&self, cut: &Cut) -> Frame<'_> {
        match self {
            Self::Rtu(cutter) => cutter.frame(cut),
            Self::Tcp(cutter) => cutter.frame(cut),
        }
    }

    fn silence(&mut self) {
        if let Self::Rtu(cutter) = self {
            cutter.silence();
        }
    }

    fn reset(&mut self) {
        match self {
            Self::Rtu(cutter) => cutter.reset(),
            Self::Tcp(cutter) => cutter.reset(),
        }
    }

    fn is_waiting(&self) -> bool {
        match self {
            Self::Rtu(cutter) => cutter.is_waiting(),
            Self::Tcp(cutter) => cutter.is_waiting(),
        }
    }

    fn fault(&self) -> Option<Fault> {
        match self {
            Self::Rtu(_) => None,
            Self::Tcp(cutter) => cutter.fault(),
        }
    }

    fn losses(&self) -> &Losses {
        match self {
            Self::Rtu(cutter) => cutter.losses(),
            Self::Tcp(cutter) => cutter.losses(),
        }
    }

    fn losses_mut(&mut self) -> &mut Losses {
        match self {
            Self::Rtu(cutter) => cutter.losses_mut(),
            Self::Tcp(cutter) => cutter.losses_mut(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rtu::crc16;

    const READ: [u8; 8] = [0x01, 0x03, 0x00, 0x20, 0x00, 0x10, 0x45, 0xCC];
    const WRITE: [u8; 8] = [0x01, 0x06, 0x00, 0x40, 0x00, 0x10, 0x89, 0xD2];

    #[test]
    fn rtu_frames_split_at_every_byte() {
        let write_many = sealed(&[0x11, 0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02]);
        let stream = [&READ[..], &write_many, &WRITE].concat();
        for at in 0..=stream.len() {
            let mut decoder = ServerDecoder::new(Framing::Rtu);
            decoder.push(&stream[..at]);
            let mut frames = drain(&mut decoder);
            decoder.push(&stream[at..]);
            frames.extend(drain(&mut decoder));
            assert_eq!(
                frames,
                [
                    (0, 1, READ[1..6].to_vec()),
                    (0, 0x11, write_many[1..11].to_vec()),
                    (0, 1, WRITE[1..6].to_vec())
                ],
                "split at {at}"
            );
            assert_eq!(*decoder.losses(), Losses::default());
        }
    }

    #[test]
    fn rtu_resynchronises_behind_garbage() {
        // Noise, the end of another frame, a frame with a wrong check sum, the beginning of one. What looks like a
        // frame where one is due counts as damaged.
        let cases: [(&[u8], u64); 6] = [
            (&[0x00], 1),
            (&[0xFF, 0x55], 0),
            (&[0x10, 0x45, 0xCC], 0),
            (&[0x01, 0x03, 0x00, 0x20, 0x00, 0x10, 0xCC, 0x45], 1),
            (&[0x02, 0x03], 1),
            (&[0x11], 1),
        ];
        for (garbage, crc_errors) in cases {
            let mut decoder = ServerDecoder::new(Framing::Rtu);
            decoder.push(garbage);
            decoder.push(&READ);
            assert_eq!(drain(&mut decoder), [(0, 1, READ[1..6].to_vec())], "{garbage:02X?}");
            let losses = Losses { garbage_bytes: garbage.len() as u64, crc_errors, ..Losses::default() };
            assert_eq!(*decoder.losses(), losses, "{garbage:02X?}");
        }
    }

    #[test]
    fn rtu_half_a_frame_dies_by_silence() {
        let mut decoder = ServerDecoder::new(Framing::Rtu);
        // Function 16 announces 200 bytes that never come, and hides the request behind it until the line is silent.
        decoder.push(&[0x01, 0x10, 0x00, 0x00, 0x00, 0x64, 0xC8]);
        decoder.push(&READ);
        assert_eq!(drain(&mut decoder), []);
        assert!(decoder.is_waiting());
        decoder.silence();
        decoder.push(&WRITE);
        assert_eq!(drain(&mut decoder), [(0, 1, READ[1..6].to_vec()), (0, 1, WRITE[1..6].to_vec())]);
        assert_eq!(decoder.losses().garbage_bytes, 7);
        decoder.push(&READ[..7]);
        decoder.silence();
        assert_eq!(drain(&mut decoder), []);
        assert_eq!((decoder.losses().garbage_bytes, decoder.is_waiting()), (14, false));
    }

    #[test]
    fn rtu_other_functions_end_by_silence() {
        let report = sealed(&[0x0A, 0x11]);
        let mut decoder = ServerDecoder::new(Framing::Rtu);
        decoder.push(&[0x55]);
        decoder.push(&report);
        assert_eq!(drain(&mut decoder), []);
        decoder.silence();
        assert_eq!(drain(&mut decoder), [(0, 0x0A, vec![0x11])]);
        assert_eq!(decoder.losses().garbage_bytes, 1);
        // Without silence between, a frame that tells its length wins.
        decoder.push(&report);
        decoder.push(&READ);
        assert_eq!(drain(&mut decoder), [(0, 1, READ[1..6].to_vec())]);
        assert_eq!(decoder.losses().garbage_bytes, 5);
    }

    #[test]
    fn rtu_holds_no_more_than_a_frame() {
        let mut decoder = ServerDecoder::new(Framing::Rtu);
        for _ in 0..1000 {
            // Any two of these may begin an open frame.
            decoder.push(&[0x55; 64]);
            assert_eq!(drain(&mut decoder), []);
        }
        assert!(decoder.losses().garbage_bytes >= 64_000 - 256);
        decoder.silence();
        assert_eq!(drain(&mut decoder), []);
        assert_eq!(decoder.losses().garbage_bytes, 64_000);
    }

    #[test]
    fn tcp_frames_split_at_every_byte() {
        let one = [0, 1, 0, 0, 0, 6, 0x11, 3, 0, 0x20, 0, 0x10];
        let two = [0xFF, 0xFF, 0, 0, 0, 2, 0, 7];
        let stream = [&one[..], &two].concat();
        for at in 0..=stream.len() {
            let mut decoder = ServerDecoder::new(Framing::Tcp);
            decoder.push(&stream[..at]);
            let mut frames = drain(&mut decoder);
            decoder.push(&stream[at..]);
            frames.extend(drain(&mut decoder));
            assert_eq!(frames, [(1, 0x11, one[7..].to_vec()), (0xFFFF, 0, vec![7])], "split at {at}");
            assert_eq!(*decoder.losses(), Losses::default());
        }
    }

    #[test]
    fn tcp_skips_another_protocol() {
        let mut decoder = ServerDecoder::new(Framing::Tcp);
        decoder.push(&[0, 1, 0, 1, 0, 3, 1, 2, 3]);
        decoder.push(&[0, 2, 0, 0, 0, 2, 1, 7]);
        assert_eq!(drain(&mut decoder), [(2, 1, vec![7])]);
        assert_eq!(*decoder.losses(), Losses { wrong_protocol: 1, ..Losses::default() });
    }

    #[test]
    fn tcp_breaks_at_a_length_that_cannot_be() {
        for found in [0, 1, 255, 256, 0xFFFF] {
            let [high, low] = u16::to_be_bytes(found);
            let mut decoder = ServerDecoder::new(Framing::Tcp);
            decoder.push(&[0, 2, 0, 0, 0, 2, 1, 7]);
            decoder.push(&[0, 3, 0, 0, high, low, 1]);
            assert!(matches!(decoder.next_frame(), Some(Ok(_))));
            assert_eq!(decoder.next_frame(), Some(Err(Fault::Length { found })));
            assert_eq!(decoder.next_frame(), None);
            decoder.push(&[0, 2, 0, 0, 0, 2, 1, 7]);
            assert_eq!(decoder.next_frame(), None);
            assert_eq!((decoder.fault(), decoder.is_waiting()), (Some(Fault::Length { found }), false));
            assert_eq!(decoder.losses().garbage_bytes, 7 + 8);

            decoder.reset();
            decoder.push(&[0, 2, 0, 0, 0, 2, 1, 7]);
            assert_eq!(drain(&mut decoder), [(2, 1, vec![7])]);
        }
    }

    type Owned = (u16, u8, Vec<u8>);

    fn drain(decoder: &mut ServerDecoder) -> Vec<Owned> {
        let mut frames = Vec::new();
        while let Some(frame) = decoder.next_frame() {
            let frame = frame.unwrap();
            frames.push((frame.transaction, frame.unit, frame.pdu.to_vec()));
        }
        frames
    }

    fn sealed(body: &[u8]) -> Vec<u8> {
        [body, &crc16(body).to_le_bytes()].concat()
    }
}
