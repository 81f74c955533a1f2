//! The server's side of transactions: bytes in, requests out, each of which knows how to be answered.

use std::time::Duration;

use crate::error::{DecodeError, EncodeError, Fault};
use crate::pdu::{EXCEPTION_BIT, Request, Response};
use crate::stream::{Cut, Framing, Losses, ServerDecoder};
use crate::{mbap, rtu};

/// How long a half frame may lie on an RTU line before it is dropped, unless told otherwise.
///
/// Longer than the 3.5 characters of the specification at any speed above 800 baud, because USB adapters deliver a
/// frame in pieces up to 16 ms apart.
pub const DEFAULT_QUIET: Duration = Duration::from_millis(50);

/// The server's end of one connection or one line.
///
/// Call [`receive`](Self::receive), then [`next_request`](Self::next_request) until it yields `None`, then look at
/// [`fault`](Self::fault).
#[derive(Clone, Debug)]
pub struct Server {
    framing: Framing,
    decoder: ServerDecoder,
    quiet: Duration,
    /// When bytes came last.
    heard: Duration,
}

impl Server {
    /// A server at the start of a connection.
    #[must_use]
    pub fn new(framing: Framing) -> Self {
        Self { framing, decoder: ServerDecoder::new(framing), quiet: DEFAULT_QUIET, heard: Duration::ZERO }
    }

    /// RTU: how long half a frame waits for its rest, in place of [`DEFAULT_QUIET`]. [`rtu::silence`] at least.
    #[must_use]
    pub fn with_quiet(mut self, quiet: Duration) -> Self {
        self.quiet = quiet;
        self
    }

    /// Takes bytes in. On RTU, half a frame that lay longer than the quiet period is dropped first.
    pub fn receive(&mut self, now: Duration, bytes: &[u8]) {
        if self.deadline().is_some_and(|deadline| now >= deadline) {
            self.silence();
        }
        self.heard = now;
        self.decoder.push(bytes);
    }

    /// The next request, or `None` when more bytes are needed.
    ///
    /// Requests to every unit are yielded; whose they are is the caller's to know, and so is that nobody answers a
    /// request to unit 0 on a serial line.
    pub fn next_request(&mut self) -> Option<Incoming<'_>> {
        let cut = self.next_cut()?;
        let frame = self.decoder.frame(&cut);
        let (&function, data) = frame.pdu.split_first()?;
        let (request, malformed) = match Request::decode(frame.pdu) {
            Ok(request) => (request, None),
            Err(error) => (Request::Other { function, data }, Some(error)),
        };
        Some(Incoming {
            framing: self.framing,
            transaction: frame.transaction,
            unit: frame.unit,
            request,
            malformed,
        })
    }

    /// RTU: nothing came for at least 3.5 characters. What has not become a request never will, but for functions
    /// whose length only silence tells: call [`next_request`](Self::next_request) afterwards.
    pub fn silence(&mut self) {
        self.decoder.silence();
    }

    /// RTU: when to call [`silence`](Self::silence) if no bytes come until then; `None` when nothing waits for it.
    #[must_use]
    pub fn deadline(&self) -> Option<Duration> {
        let waiting = self.framing == Framing::Rtu && self.decoder.is_waiting();
        waiting.then(|| self.heard.saturating_add(self.quiet))
    }

    /// Why the connection has to be closed, if it has; over TCP only. Requests before the fault were yielded; what
    /// follows it is dropped and counted.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.decoder.fault()
    }

    /// The connection was lost: forgets unfinished bytes and the fault, keeps the counts.
    pub fn reset(&mut self) {
        self.decoder.reset();
    }

    /// What was dropped so far.
    #[must_use]
    pub fn losses(&self) -> &Losses {
        self.decoder.losses()
    }

    /// The next frame with a function code that a client may send.
    fn next_cut(&mut self) -> Option<Cut> {
        loop {
            let cut = self.decoder.advance()?.ok()?;
            if matches!(self.decoder.frame(&cut).pdu, [1..EXCEPTION_BIT, ..]) {
                return Some(cut);
            }
            self.decoder.count_malformed();
        }
    }
}

/// A request that came, and the way back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Incoming<'a> {
    framing: Framing,
    /// The transaction id; 0 in RTU, which has none.
    pub transaction: u16,
    /// The unit it is for.
    pub unit: u8,
    /// What is asked.
    pub request: Request<'a>,
    /// The request has a function of ours and a body that does not fit it. `request` is then `Other` with that
    /// function code, and the standard's answer is exception 3 (V1.1b3, 7).
    pub malformed: Option<DecodeError>,
}

impl Incoming<'_> {
    /// Appends the frame that answers this request to `out`; answers to several may go out in one write.
    ///
    /// # Errors
    /// Any [`EncodeError`]; `out` is then as it was.
    pub fn respond(&self, response: &Response<'_>, out: &mut Vec<u8>) -> Result<(), EncodeError> {
        match self.framing {
            Framing::Tcp => mbap::encode_response(self.transaction, self.unit, response, out),
            Framing::Rtu => rtu::encode_response(self.unit, response, out),
        }
    }
}
