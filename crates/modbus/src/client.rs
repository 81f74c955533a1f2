//! The client's side: one transaction at a time, and what may be taken for its answer.

mod matching;

use std::time::Duration;

use crate::error::{Fault, StartError};
use crate::mbap;
use crate::pdu::{Expected, Request, Response};
use crate::rtu;
use crate::stream::{Framing, RtuCutter};

/// How long an RTU line must be quiet after a time-out before the next request, unless told otherwise.
///
/// USB adapters deliver a frame in pieces up to 16 ms apart; this is three of them.
pub const DEFAULT_QUIET: Duration = Duration::from_millis(50);

/// What a call changed. Exhaustive on purpose: a caller must treat each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Nothing: wait for bytes or the deadline, if there is one.
    Pending,
    /// The answer is there: see [`Client::response`].
    Answered,
    /// The transaction ended without an answer.
    TimedOut,
    /// The connection is out of step and the transaction lost: close it, open another and call [`Client::reset`].
    Broken(Fault),
}

/// What came and was not taken for an answer. Counters only grow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Counters {
    /// Whole frames that came while none was waited for, and over TCP those of another transaction.
    pub late: u64,
    /// Answers of another unit.
    pub wrong_unit: u64,
    /// Answers to another function.
    pub wrong_function: u64,
    /// Answers with more or less data than was asked for, or with a wrong byte count.
    pub wrong_length: u64,
    /// Confirmations of another address, value or quantity than was sent.
    pub wrong_echo: u64,
    /// TCP: whole frames with a protocol identifier other than 0.
    pub wrong_protocol: u64,
    /// RTU: an answer was due and its check sum was wrong.
    pub crc_errors: u64,
    /// Bytes that belong to no frame.
    pub garbage_bytes: u64,
    /// RTU: own requests that came back and were not taken for their answers, see [`Client::ignore_echo`].
    pub echoes: u64,
}

/// A whole frame that was taken for no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stray {
    /// Who sent it.
    pub unit: u8,
    /// The function code, without the exception bit.
    pub function: u8,
    /// Bytes of its PDU.
    pub pdu_len: usize,
    /// Whether it is an exception.
    pub exception: bool,
}

/// So many strays are kept for [`Client::take_stray`]; more than that are only counted.
const MAX_STRAYS: usize = 16;

/// The client's end of one connection or one line.
///
/// One transaction at a time: [`start`](Self::start), then [`receive`](Self::receive) and [`expire`](Self::expire)
/// until one of them says that it ended.
#[derive(Clone, Debug)]
pub struct Client {
    framing: Framing,
    state: State,
    /// The id the next transaction gets.
    next_transaction: u16,
    /// TCP: the beginning of a frame whose rest has not come.
    unfinished: Vec<u8>,
    /// RTU: bytes that are not a frame yet.
    cutter: RtuCutter,
    /// The PDU that answered last.
    answer: Vec<u8>,
    quiet: Duration,
    /// RTU: no transaction starts before.
    quiet_until: Option<Duration>,
    fault: Option<Fault>,
    counters: Counters,
    strays: Vec<Stray>,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Idle,
    Waiting(Waiting),
    Answered(Expected),
}

/// What is waited for.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    transaction: u16,
    unit: u8,
    expected: Expected,
    deadline: Duration,
    /// The first copy of the request is its echo.
    echo: bool,
}

impl Client {
    /// A client at the start of a connection, whose first transaction has id 1.
    #[must_use]
    pub fn new(framing: Framing) -> Self {
        Self {
            framing,
            state: State::Idle,
            next_transaction: 1,
            unfinished: Vec::new(),
            cutter: RtuCutter::default(),
            answer: Vec::new(),
            quiet: DEFAULT_QUIET,
            quiet_until: None,
            fault: None,
            counters: Counters::default(),
            strays: Vec::new(),
        }
    }

    /// The id of the next transaction over TCP. They count up and wrap.
    #[must_use]
    pub fn with_transaction(mut self, transaction: u16) -> Self {
        self.next_transaction = transaction;
        self
    }

    /// RTU: how long the line must be quiet after a time-out, in place of [`DEFAULT_QUIET`].
    #[must_use]
    pub fn with_quiet(mut self, quiet: Duration) -> Self {
        self.quiet = quiet;
        self
    }

    /// Encodes the request into `out`, cleared first, and starts the clock: the answer must come before
    /// `now + timeout`. Send `out` at once and whole.
    ///
    /// # Errors
    /// Any [`StartError`]; nothing may be sent then, and `out` is empty.
    pub fn start(
        &mut self,
        now: Duration,
        unit: u8,
        request: &Request<'_>,
        timeout: Duration,
        out: &mut Vec<u8>,
    ) -> Result<(), StartError> {
        out.clear();
        if let Some(fault) = self.fault {
            return Err(StartError::Broken(fault));
        }
        if matches!(self.state, State::Waiting(_)) {
            return Err(StartError::Busy);
        }
        let transaction = self.next_transaction;
        match self.framing {
            Framing::Tcp => {
                mbap::encode_request(transaction, unit, request, out)?;
                self.next_transaction = transaction.wrapping_add(1);
            }
            Framing::Rtu => {
                if unit == 0 {
                    return Err(StartError::Broadcast);
                }
                if let Some(until) = self.quiet_until.filter(|until| now < *until) {
                    return Err(StartError::Draining { until });
                }
                rtu::encode_request(unit, request, out)?;
                self.quiet_until = None;
                self.discard_rtu();
            }
        }
        self.state = State::Waiting(Waiting {
            transaction,
            unit,
            expected: Expected::of(request),
            deadline: now.saturating_add(timeout),
            echo: false,
        });
        Ok(())
    }

    /// The transaction under way may also be answered by fewer registers than it asks for, if not by none.
    ///
    /// For devices that are known to cut long reads. From any other a short answer belongs to something else, so
    /// without this it is dropped and counted as a wrong length. To be called behind [`start`](Self::start), for each
    /// transaction anew.
    pub fn accept_short(&mut self) {
        if let State::Waiting(waiting) = &mut self.state {
            waiting.expected = waiting.expected.or_short();
        }
    }

    /// RTU, functions 5 and 6: the adapter sends our own request back, which looks just like its confirmation. The first
    /// such frame is not taken for it. To be called behind [`start`](Self::start), for each transaction anew.
    pub fn ignore_echo(&mut self) {
        if let State::Waiting(waiting) = &mut self.state {
            waiting.echo = true;
        }
    }

    /// Takes bytes in, in whatever pieces they come, and says what they changed.
    ///
    /// An answer that is in hand before the transaction was given up is taken, however late `now` is; without one,
    /// a `now` at or past the deadline gives the transaction up as [`expire`](Self::expire) does.
    pub fn receive(&mut self, now: Duration, bytes: &[u8]) -> Progress {
        let answered = match self.framing {
            Framing::Tcp => self.receive_tcp(bytes),
            Framing::Rtu => {
                if self.quiet_until.is_some() && !bytes.is_empty() {
                    self.quiet_until = Some(now.saturating_add(self.quiet));
                }
                self.cutter.push(bytes);
                self.cut_rtu()
            }
        };
        if answered {
            return Progress::Answered;
        }
        if let Some(fault) = self.fault {
            self.state = State::Idle;
            return Progress::Broken(fault);
        }
        self.expire(now)
    }

    /// RTU: nothing came for at least 3.5 characters. Ends the answer to a function whose length only silence tells,
    /// and gives up on half frames. Over TCP silence means nothing.
    pub fn silence(&mut self, now: Duration) -> Progress {
        if self.framing == Framing::Rtu {
            self.cutter.silence();
            if self.cut_rtu() {
                return Progress::Answered;
            }
        }
        self.expire(now)
    }

    /// Gives the transaction up when its deadline is reached; call it when [`deadline`](Self::deadline) comes. Never
    /// says `Answered`.
    ///
    /// On RTU the line is drained afterwards: a late answer looks like the next one, so nothing starts until the
    /// line was quiet, see [`quiet_until`](Self::quiet_until).
    pub fn expire(&mut self, now: Duration) -> Progress {
        let State::Waiting(waiting) = self.state else {
            return Progress::Pending;
        };
        if now < waiting.deadline {
            return Progress::Pending;
        }
        if self.framing == Framing::Rtu {
            self.discard_rtu();
            self.quiet_until = Some(now.saturating_add(self.quiet));
        }
        self.state = State::Idle;
        Progress::TimedOut
    }

    /// The answer, from [`Progress::Answered`] until the next start or reset. Coils and inputs are as many as were
    /// asked for, and registers too unless [`accept_short`](Self::accept_short) was called.
    #[must_use]
    pub fn response(&self) -> Option<Response<'_>> {
        let State::Answered(expected) = self.state else {
            return None;
        };
        let response = Response::decode(&self.answer).ok()?;
        let count = expected.bits().unwrap_or_default();
        Some(match response {
            Response::ReadCoils(bits) => Response::ReadCoils(bits.first(count)),
            Response::ReadDiscreteInputs(bits) => Response::ReadDiscreteInputs(bits.first(count)),
            other => other,
        })
    }

    /// When the transaction has to be given up; `None` when there is none.
    #[must_use]
    pub fn deadline(&self) -> Option<Duration> {
        match self.state {
            State::Waiting(waiting) => Some(waiting.deadline),
            _ => None,
        }
    }

    /// RTU after a time-out: the earliest instant at which a transaction may start. Bytes that come meanwhile are
    /// counted and move it.
    #[must_use]
    pub fn quiet_until(&self) -> Option<Duration> {
        self.quiet_until
    }

    /// Why the connection has to be closed, if it has; over TCP only.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// The connection was lost: forgets the transaction, unfinished bytes and the fault. Counters and transaction
    /// ids go on.
    pub fn reset(&mut self) {
        self.state = State::Idle;
        self.unfinished.clear();
        self.cutter.reset();
        self.quiet_until = None;
        self.fault = None;
    }

    /// A frame that was taken for no answer, the latest first, and each once. A scheduler sees by them whose late answer
    /// has come.
    pub fn take_stray(&mut self) -> Option<Stray> {
        self.strays.pop()
    }

    /// What came and was not taken for an answer.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.counters
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What goes in and out is scripted in `tests/script_client.rs`; here is what only the inside shows.
    #[test]
    fn a_whole_answer_is_copied_once_into_memory_already_there() {
        let mut client = Client::new(Framing::Tcp).with_transaction(0);
        let mut out = Vec::new();
        let mut answer = [0, 0, 0, 0, 0, 35, 1, 3, 32].to_vec();
        answer.resize(9 + 32, 0xAB);
        let request = Request::ReadHoldingRegisters { address: 0x2800, count: 16 };
        let mut capacities = None;
        for transaction in 0..100 {
            let started = client.start(Duration::ZERO, 1, &request, Duration::from_secs(1), &mut out);
            assert_eq!(started, Ok(()));
            answer[1] = transaction;
            assert_eq!(client.receive(Duration::ZERO, &answer), Progress::Answered);
            assert_eq!(client.unfinished.capacity(), 0);
            let now = (out.capacity(), client.answer.capacity());
            assert_eq!(*capacities.get_or_insert(now), now);
        }
    }
}
