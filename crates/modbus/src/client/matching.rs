//! Which frame is the answer: the part of the client that looks at bytes.

use super::{Client, Counters, MAX_STRAYS, State, Stray};
use crate::error::{Fault, Mismatch};
use crate::mbap::{self, Front};
use crate::pdu::{EXCEPTION_BIT, Response};
use crate::stream::guess_response;

/// What one frame is to a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Answer,
    Echo,
    Late,
    WrongUnit,
    WrongFunction,
    WrongLength,
    WrongEcho,
}

impl Verdict {
    /// Judges a frame; one without a transaction id is RTU.
    fn of(state: &State, transaction: Option<u16>, unit: u8, pdu: &[u8]) -> Self {
        let State::Waiting(waiting) = state else {
            return Self::Late;
        };
        if transaction.is_some_and(|id| id != waiting.transaction) {
            return Self::Late;
        }
        if unit != waiting.unit {
            return Self::WrongUnit;
        }
        if !pdu.first().is_some_and(|function| waiting.expected.is_function(*function)) {
            return Self::WrongFunction;
        }
        let Ok(response) = Response::decode(pdu) else {
            return Self::WrongLength;
        };
        match waiting.expected.check(&response) {
            Ok(()) if waiting.echo && !matches!(response, Response::Exception { .. }) => Self::Echo,
            Ok(()) => Self::Answer,
            Err(Mismatch::Function { .. }) => Self::WrongFunction,
            Err(Mismatch::Length { .. }) => Self::WrongLength,
            Err(Mismatch::Echo { .. }) => Self::WrongEcho,
        }
    }

    /// Counts a frame that is no answer, and keeps whose it was.
    fn note(self, unit: u8, pdu: &[u8], counters: &mut Counters, strays: &mut Vec<Stray>) {
        self.count(counters);
        if matches!(self, Self::Answer | Self::Echo) {
            return;
        }
        let function = pdu.first().copied().unwrap_or_default();
        if strays.len() < MAX_STRAYS {
            strays.push(Stray {
                unit,
                function: function & !EXCEPTION_BIT,
                pdu_len: pdu.len(),
                exception: function & EXCEPTION_BIT != 0,
            });
        }
    }

    fn count(self, counters: &mut Counters) {
        let counter = match self {
            Self::Answer => return,
            Self::Echo => &mut counters.echoes,
            Self::Late => &mut counters.late,
            Self::WrongUnit => &mut counters.wrong_unit,
            Self::WrongFunction => &mut counters.wrong_function,
            Self::WrongLength => &mut counters.wrong_length,
            Self::WrongEcho => &mut counters.wrong_echo,
        };
        *counter += 1;
    }
}

impl Client {
    /// Whether these bytes brought the answer. Whole frames are judged where they lie; only the answer's PDU, and
    /// the beginning of a frame not yet whole, are copied.
    pub(super) fn receive_tcp(&mut self, bytes: &[u8]) -> bool {
        if self.fault.is_some() {
            self.counters.garbage_bytes += bytes.len() as u64;
            return false;
        }
        if self.unfinished.is_empty() {
            let (answered, used) = self.cut_tcp(bytes);
            self.unfinished.extend_from_slice(bytes.get(used..).unwrap_or_default());
            return answered;
        }
        let mut joined = std::mem::take(&mut self.unfinished);
        joined.extend_from_slice(bytes);
        let (answered, used) = self.cut_tcp(&joined);
        joined.drain(..used);
        self.unfinished = joined;
        answered
    }

    /// Judges all whole frames; says whether one was the answer, and how many bytes are done with.
    fn cut_tcp(&mut self, bytes: &[u8]) -> (bool, usize) {
        let mut answered = false;
        let mut used = 0;
        loop {
            let rest = bytes.get(used..).unwrap_or_default();
            match mbap::front(rest) {
                Front::Incomplete => return (answered, used),
                Front::Frame { header, len } => {
                    let pdu = rest.get(mbap::HEADER_LEN..len).unwrap_or_default();
                    let transaction = Some(header.transaction);
                    let verdict = Verdict::of(&self.state, transaction, header.unit, pdu);
                    answered |= settle(verdict, pdu, &mut self.state, &mut self.answer);
                    verdict.note(header.unit, pdu, &mut self.counters, &mut self.strays);
                    used += len;
                }
                Front::Foreign { len } => {
                    self.counters.wrong_protocol += 1;
                    used += len;
                }
                Front::Broken { found } => {
                    self.fault = Some(Fault::Length { found });
                    self.counters.garbage_bytes += rest.len() as u64;
                    return (answered, bytes.len());
                }
            }
        }
    }

    /// Judges all whole frames in the RTU buffer; says whether one was the answer.
    pub(super) fn cut_rtu(&mut self) -> bool {
        let mut answered = false;
        loop {
            let Some(frame) = self.cutter.next(|bytes, _| guess_response(bytes)) else {
                self.count_losses();
                return answered;
            };
            let frame = self.cutter.frame(&frame);
            let verdict = Verdict::of(&self.state, None, frame.unit, frame.pdu);
            answered |= settle(verdict, frame.pdu, &mut self.state, &mut self.answer);
            verdict.note(frame.unit, frame.pdu, &mut self.counters, &mut self.strays);
        }
    }

    /// Drops the bytes on an RTU line that are no frame yet.
    pub(super) fn discard_rtu(&mut self) {
        self.cutter.discard();
        self.count_losses();
    }

    fn count_losses(&mut self) {
        let losses = self.cutter.losses();
        self.counters.crc_errors = losses.crc_errors;
        self.counters.garbage_bytes = losses.garbage_bytes;
    }
}

/// Keeps the answer; says whether it was one.
fn settle(verdict: Verdict, pdu: &[u8], state: &mut State, answer: &mut Vec<u8>) -> bool {
    let State::Waiting(waiting) = state else {
        return false;
    };
    if verdict == Verdict::Echo {
        waiting.echo = false;
    }
    if verdict != Verdict::Answer {
        return false;
    }
    answer.clear();
    answer.extend_from_slice(pdu);
    *state = State::Answered(waiting.expected);
    true
}
