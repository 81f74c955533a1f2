//! The knives: where in a buffer the next frame lies, for both framings.

use super::{Cut, Frame, Losses};
use crate::error::Fault;
use crate::mbap::{self, Front};
use crate::pdu::EXCEPTION_BIT;
use crate::pdu::function::*;
use crate::rtu::{MAX_FRAME, MIN_FRAME, crc16};

/// What RTU bytes from one place on may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Guess {
    /// A frame of so many bytes; its check sum is right.
    Frame(usize),
    /// Perhaps the beginning of a frame.
    Incomplete,
    /// Perhaps a frame of a function whose length only silence tells.
    Open,
    /// As long as a frame, but its check sum is wrong.
    Damaged,
    /// No frame begins here.
    Nothing,
}

/// How long a frame is that begins with these bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Extent {
    /// So many bytes, check sum included.
    Known(usize),
    /// More bytes are needed to tell.
    Unknown,
    /// Silence tells.
    Open,
    /// There is no such frame.
    None,
}

/// Bytes of a frame that has two words after its function code.
const PLAIN: usize = 8;
/// Bytes around the data of a read's answer: unit, function, byte count, check sum.
const AROUND_READ: usize = 5;
/// Bytes around the data of functions 15 and 16: unit, function, address, quantity, byte count, check sum.
const AROUND_WRITE: usize = 9;
/// Bytes of an exception: unit, function, code, check sum.
const EXCEPTION: usize = 5;

/// How long the request is that begins here.
pub(super) fn request_extent(bytes: &[u8]) -> Extent {
    match bytes {
        [_, 0 | EXCEPTION_BIT..=u8::MAX, ..] => Extent::None,
        [_, READ_COILS..=WRITE_SINGLE_REGISTER, ..] => Extent::Known(PLAIN),
        [_, WRITE_MULTIPLE_COILS | WRITE_MULTIPLE_REGISTERS, rest @ ..] => match rest.get(4) {
            Some(count) => counted(AROUND_WRITE, *count),
            None => Extent::Unknown,
        },
        [_, _, ..] => Extent::Open,
        _ => Extent::Unknown,
    }
}

/// How long the response is that begins here.
pub(super) fn response_extent(bytes: &[u8]) -> Extent {
    match bytes {
        [_, 0 | EXCEPTION_BIT, ..] => Extent::None,
        [_, EXCEPTION_BIT..=u8::MAX, ..] => Extent::Known(EXCEPTION),
        [_, READ_COILS..=READ_INPUT_REGISTERS] => Extent::Unknown,
        [_, READ_COILS..=READ_INPUT_REGISTERS, count, ..] => counted(AROUND_READ, *count),
        [
            _,
            WRITE_SINGLE_COIL | WRITE_SINGLE_REGISTER | WRITE_MULTIPLE_COILS | WRITE_MULTIPLE_REGISTERS,
            ..,
        ] => Extent::Known(PLAIN),
        [_, _, ..] => Extent::Open,
        _ => Extent::Unknown,
    }
}

fn counted(around: usize, count: u8) -> Extent {
    let len = around + usize::from(count);
    if len > MAX_FRAME {
        return Extent::None;
    }
    Extent::Known(len)
}

/// Whether bytes that extend so far are a frame.
pub(super) fn judge(bytes: &[u8], extent: Extent) -> Guess {
    match extent {
        Extent::Known(len) => match bytes.get(..len) {
            None => Guess::Incomplete,
            // The check sum of a frame with its own check sum is 0.
            Some(frame) if crc16(frame) == 0 => Guess::Frame(len),
            Some(_) => Guess::Damaged,
        },
        Extent::Unknown => Guess::Incomplete,
        Extent::Open => Guess::Open,
        Extent::None => Guess::Nothing,
    }
}

pub(super) fn guess_request(bytes: &[u8]) -> Guess {
    judge(bytes, request_extent(bytes))
}

pub(crate) fn guess_response(bytes: &[u8]) -> Guess {
    judge(bytes, response_extent(bytes))
}

/// Cuts RTU frames. Every place is a possible beginning; the check sum decides.
///
/// A place that may begin a frame not yet whole is waited for. One that may begin an open frame is not, for in a
/// stream of garbage nearly every place could: it is remembered, the search goes on behind it, and it gets its chance
/// when silence ends the bytes. What is found depends on the bytes and on the silences only, never on the pieces.
#[derive(Clone, Debug)]
pub(crate) struct RtuCutter {
    bytes: Vec<u8>,
    /// Everything before is done with.
    start: usize,
    /// Everything before begins no frame, open ones excepted.
    scan: usize,
    /// The first place that may begin an open frame.
    open: Option<usize>,
    /// The bytes before this were followed by silence.
    silence: Option<usize>,
    /// Nothing was dropped since the last frame or silence.
    in_step: bool,
    losses: Losses,
}

impl Default for RtuCutter {
    fn default() -> Self {
        Self {
            bytes: Vec::new(),
            start: 0,
            scan: 0,
            open: None,
            silence: None,
            in_step: true,
            losses: Losses::default(),
        }
    }
}

impl RtuCutter {
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        self.compact();
        self.bytes.extend_from_slice(bytes);
    }

    /// Moves the unfinished bytes to the front.
    fn compact(&mut self) {
        let gone = self.start;
        if gone == 0 {
            return;
        }
        self.bytes.drain(..gone);
        self.start = 0;
        self.scan -= gone;
        self.open = self.open.map(|at| at - gone);
        self.silence = self.silence.map(|at| at - gone);
    }

    /// Everything pushed so far is followed by silence.
    pub(crate) fn silence(&mut self) {
        self.silence = Some(self.bytes.len());
    }

    /// Drops what is unfinished, counted: a new exchange begins.
    pub(crate) fn discard(&mut self) {
        self.drop_to(self.bytes.len());
        self.silence = None;
    }

    /// Forgets what is unfinished: a new connection begins.
    pub(crate) fn reset(&mut self) {
        let losses = self.losses;
        let mut bytes = std::mem::take(&mut self.bytes);
        bytes.clear();
        *self = Self { bytes, losses, ..Self::default() };
    }

    pub(crate) fn frame(&self, cut: &Cut) -> Frame<'_> {
        cut.of(&self.bytes)
    }

    pub(crate) fn is_waiting(&self) -> bool {
        self.start < self.bytes.len()
    }

    pub(crate) fn losses(&self) -> &Losses {
        &self.losses
    }

    pub(super) fn losses_mut(&mut self) -> &mut Losses {
        &mut self.losses
    }

    /// Where the next frame lies. `guess` judges the bytes from one place on, and is told whether they end in
    /// silence, so that waiting for more is vain.
    pub(crate) fn next(&mut self, mut guess: impl FnMut(&[u8], bool) -> Guess) -> Option<Cut> {
        loop {
            let silent = self.silence.is_some();
            let end = self.silence.unwrap_or(self.bytes.len());
            if silent && let Some(open) = self.open {
                self.scan = open;
            }
            while self.scan < end {
                let rest = self.bytes.get(self.scan..end).unwrap_or_default();
                match guess(rest, silent) {
                    Guess::Frame(len) => return Some(self.take(len)),
                    Guess::Incomplete if !silent => {
                        self.trim(end);
                        return None;
                    }
                    Guess::Open if silent && is_frame(rest) => return Some(self.take(rest.len())),
                    Guess::Open if !silent => {
                        self.open.get_or_insert(self.scan);
                    }
                    Guess::Damaged if self.in_step => self.losses.crc_errors += 1,
                    _ => {}
                }
                self.in_step = false;
                self.scan += 1;
            }
            if !silent {
                self.trim(end);
                return None;
            }
            self.drop_to(end);
            self.silence = None;
        }
    }

    /// The frame of `len` bytes that begins at `scan`; what stands before it is garbage.
    fn take(&mut self, len: usize) -> Cut {
        let frame = self.scan..self.scan + len;
        self.drop_to(frame.start);
        self.start = frame.end;
        self.scan = frame.end;
        Cut {
            transaction: 0,
            unit: self.bytes.get(frame.start).copied().unwrap_or_default(),
            // Unit and check sum stand around the PDU.
            pdu: frame.start + 1..frame.end - 2,
        }
    }

    /// Everything before `place` is done with and was no frame; a frame may begin there.
    fn drop_to(&mut self, place: usize) {
        self.losses.garbage_bytes += (place - self.start) as u64;
        self.start = place;
        self.scan = place;
        self.open = None;
        self.in_step = true;
    }

    /// Drops what can no longer become a frame.
    fn trim(&mut self, end: usize) {
        // An open frame longer than any frame is none.
        let oldest = end.saturating_sub(MAX_FRAME).min(self.scan);
        self.open = self.open.map(|at| at.max(oldest)).filter(|at| *at < self.scan);
        let keep = self.open.unwrap_or(self.scan);
        self.losses.garbage_bytes += (keep - self.start) as u64;
        self.start = keep;
    }
}

/// Whether all these bytes, ended by silence, are one frame.
fn is_frame(bytes: &[u8]) -> bool {
    (MIN_FRAME..=MAX_FRAME).contains(&bytes.len()) && crc16(bytes) == 0
}

/// Cuts Modbus TCP frames. A length that cannot be breaks the stream for good.
#[derive(Clone, Debug, Default)]
pub(super) struct TcpCutter {
    bytes: Vec<u8>,
    /// Everything before is done with.
    start: usize,
    fault: Option<Fault>,
    losses: Losses,
}

impl TcpCutter {
    pub(super) fn push(&mut self, bytes: &[u8]) {
        if self.fault.is_some() {
            self.losses.garbage_bytes += bytes.len() as u64;
            return;
        }
        self.bytes.drain(..self.start);
        self.start = 0;
        self.bytes.extend_from_slice(bytes);
    }

    pub(super) fn reset(&mut self) {
        self.bytes.clear();
        self.start = 0;
        self.fault = None;
    }

    pub(super) fn frame(&self, cut: &Cut) -> Frame<'_> {
        cut.of(&self.bytes)
    }

    pub(super) fn is_waiting(&self) -> bool {
        self.start < self.bytes.len()
    }

    pub(super) fn fault(&self) -> Option<Fault> {
        self.fault
    }

    pub(super) fn losses(&self) -> &Losses {
        &self.losses
    }

    pub(super) fn losses_mut(&mut self) -> &mut Losses {
        &mut self.losses
    }

    pub(super) fn next(&mut self) -> Option<Result<Cut, Fault>> {
        loop {
            let rest = self.bytes.get(self.start..).unwrap_or_default();
            match mbap::front(rest) {
                Front::Incomplete => return None,
                Front::Frame { header, len } => {
                    let pdu = self.start + mbap::HEADER_LEN..self.start + len;
                    self.start += len;
                    return Some(Ok(Cut { transaction: header.transaction, unit: header.unit, pdu }));
                }
                Front::Foreign { len } => {
                    self.losses.wrong_protocol += 1;
                    self.start += len;
                }
                Front::Broken { found } => {
                    let fault = Fault::Length { found };
                    self.losses.garbage_bytes += rest.len() as u64;
                    self.start = self.bytes.len();
                    self.fault = Some(fault);
                    return Some(Err(fault));
                }
            }
        }
    }
}
