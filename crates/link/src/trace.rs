//! Tracing: every frame that crosses a wire, shown to whoever asked to see them.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use busbar_modbus::{Framing, rtu};

const HEADER: usize = 6;

/// A callback that sees every frame of a wire, both ways.
///
/// It runs in the wire's task between two frames, so it must be quick and must not block.
#[derive(Clone)]
pub struct Trace(Arc<dyn Fn(&TraceEvent<'_>) + Send + Sync>);

impl Trace {
    /// Calls `show` for every frame.
    pub fn new(show: impl Fn(&TraceEvent<'_>) + Send + Sync + 'static) -> Self {
        Self(Arc::new(show))
    }
}

impl fmt::Debug for Trace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Trace")
    }
}

/// One frame on the wire, or bytes that make none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct TraceEvent<'a> {
    /// Time since the wire was opened: when the last byte was handed over or came.
    pub at: Duration,
    /// Which way it went.
    pub direction: Direction,
    /// The bytes as they were on the wire.
    pub bytes: &'a [u8],
}

/// Which way a frame went. Exhaustive: a wire has two ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From us to the device.
    Sent,
    /// From the device to us.
    Received,
}

/// What happened on a wire that is traced, until it can be shown.
#[derive(Debug)]
pub(crate) enum Seen {
    Sent(Vec<u8>),
    Received(Vec<u8>),
    Closed,
}

/// Cuts what comes in into frames again before it is shown: neither TCP nor a serial adapter keeps boundaries.
#[derive(Debug)]
pub(crate) struct Tracer {
    trace: Trace,
    framing: Framing,
    pending: Vec<u8>,
    /// RTU: the request under way, which may come back.
    asked: Vec<u8>,
}

impl Tracer {
    pub(crate) fn new(trace: Trace, framing: Framing) -> Self {
        Self { trace, framing, pending: Vec::new(), asked: Vec::new() }
    }

    pub(crate) fn show(&mut self, at: Duration, seen: Seen) {
        match seen {
            Seen::Sent(bytes) => {
                if self.framing == Framing::Rtu {
                    self.flush(at);
                }
                self.emit(at, Direction::Sent, &bytes);
                self.asked = bytes;
            }
            Seen::Received(bytes) => self.received(at, &bytes),
            Seen::Closed => self.flush(at),
        }
    }

    /// Nothing is under way. On RTU what is left makes no answer; over TCP the rest of a frame may still come.
    pub(crate) fn ended(&mut self, at: Duration) {
        if self.framing == Framing::Rtu && !self.asked.is_empty() {
            self.flush(at);
            self.asked.clear();
        }
    }

    fn received(&mut self, at: Duration, bytes: &[u8]) {
        self.pending.extend_from_slice(bytes);
        let mut start = 0;
        while let Some(length) = self.whole(&self.pending[start..]) {
            self.emit(at, Direction::Received, &self.pending[start..start + length]);
            start += length;
        }
        self.pending.drain(..start);
    }

    /// How many bytes to show at once.
    fn whole(&self, bytes: &[u8]) -> Option<usize> {
        match self.framing {
            Framing::Tcp => whole_frame(bytes),
            Framing::Rtu if !self.asked.is_empty() && bytes.starts_with(&self.asked) => {
                Some(self.asked.len())
            }
            Framing::Rtu => whole_answer(bytes),
        }
    }

    /// Whatever is left makes no frame any more, and is shown as it is.
    fn flush(&mut self, at: Duration) {
        if !self.pending.is_empty() {
            self.emit(at, Direction::Received, &self.pending);
            self.pending.clear();
        }
    }

    fn emit(&self, at: Duration, direction: Direction, bytes: &[u8]) {
        (self.trace.0)(&TraceEvent { at, direction, bytes });
    }
}

/// How many bytes to show at once: one MBAP frame, or all of them when they are none.
fn whole_frame(bytes: &[u8]) -> Option<usize> {
    let [_, _, protocol_high, protocol_low, high, low] = *bytes.first_chunk::<HEADER>()?;
    let length = usize::from(u16::from_be_bytes([high, low]));
    if (protocol_high, protocol_low) != (0, 0) || !(2..=254).contains(&length) {
        return Some(bytes.len());
    }
    Some(HEADER + length).filter(|whole| *whole <= bytes.len())
}

/// How long the RTU answer is that begins here, once all of it is there and its check sum is right.
fn whole_answer(bytes: &[u8]) -> Option<usize> {
    let [_, function, count] = *bytes.first_chunk::<3>()?;
    let length = match function {
        0x80.. => 5,
        1..=4 => 5 + usize::from(count),
        _ => 8,
    };
    bytes.get(..length).filter(|frame| rtu::crc16(frame) == 0).map(|_| length)
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    type Shown = Arc<Mutex<Vec<(u64, Vec<u8>)>>>;

    /// A tracer, and what came in as it shows it.
    fn tracer(framing: Framing) -> (Tracer, Shown) {
        let seen = Shown::default();
        let sink = Arc::clone(&seen);
        let trace = Trace::new(move |event| {
            if event.direction == Direction::Received {
                let mut sink = sink.lock().unwrap();
                sink.push((event.at.as_millis() as u64, event.bytes.to_vec()));
            }
        });
        (Tracer::new(trace, framing), seen)
    }

    fn shown(chunks: &[&[u8]]) -> Vec<(u64, Vec<u8>)> {
        let (mut tracer, seen) = tracer(Framing::Tcp);
        for (at, chunk) in (1..).zip(chunks) {
            tracer.show(Duration::from_millis(at), Seen::Received(chunk.to_vec()));
        }
        tracer.show(Duration::from_millis(99), Seen::Closed);
        seen.lock().unwrap().clone()
    }

    #[test]
    fn shows_frames_however_they_were_cut() {
        const ONE: &[u8] = &[0, 1, 0, 0, 0, 3, 1, 0x83, 2];
        const TWO: &[u8] = &[0, 2, 0, 0, 0, 5, 1, 3, 2, 0xBE, 0xEF];
        let glued = [ONE, TWO].concat();

        assert_eq!(shown(&[ONE]), [(1, ONE.to_vec())]);
        assert_eq!(shown(&[&glued]), [(1, ONE.to_vec()), (1, TWO.to_vec())]);
        assert_eq!(
            shown(&[&glued[..4], &glued[4..12], &glued[12..]]),
            [(2, ONE.to_vec()), (3, TWO.to_vec())]
        );
        assert_eq!(shown(&[&TWO[..7]]), [(99, TWO[..7].to_vec())]);
        assert_eq!(shown(&[b"HTTP/1.1 400", ONE]), [(1, b"HTTP/1.1 400".to_vec()), (2, ONE.to_vec())]);
    }

    /// What is shown of an RTU exchange that ends at 98.
    fn shown_on_rtu(asked: &[u8], chunks: &[&[u8]]) -> Vec<(u64, Vec<u8>)> {
        let (mut tracer, seen) = tracer(Framing::Rtu);
        tracer.show(Duration::ZERO, Seen::Sent(asked.to_vec()));
        for (at, chunk) in (1..).zip(chunks) {
            tracer.show(Duration::from_millis(at), Seen::Received(chunk.to_vec()));
        }
        tracer.ended(Duration::from_millis(98));
        tracer.show(Duration::from_millis(99), Seen::Closed);
        seen.lock().unwrap().clone()
    }

    #[test]
    fn shows_rtu_frames_whole() {
        let frame = |body: &[u8]| [body, &rtu::crc16(body).to_le_bytes()].concat();
        let asked = frame(&[1, 3, 0x28, 0x06, 0, 2]);
        let answer = frame(&[1, 3, 4, 0x08, 0xFE, 0, 0]);
        let refused = frame(&[1, 0x83, 2]);
        let echoed = [asked.clone(), answer.clone()].concat();
        let noisy = [&[0xFF][..], &answer].concat();

        assert_eq!(shown_on_rtu(&asked, &[&answer[..4], &answer[4..]]), [(2, answer.clone())]);
        assert_eq!(shown_on_rtu(&asked, &[&refused]), [(1, refused.clone())]);
        assert_eq!(
            shown_on_rtu(&asked, &[&echoed[..5], &echoed[5..10], &echoed[10..]]),
            [(2, asked.clone()), (3, answer.clone())]
        );
        assert_eq!(shown_on_rtu(&asked, &[&noisy]), [(98, noisy.clone())]);
        assert_eq!(shown_on_rtu(&asked, &[&answer[..6]]), [(98, answer[..6].to_vec())]);
        assert_eq!(shown_on_rtu(&[], &[&answer[..6], &answer[6..]]), [(2, answer.clone())]);
    }
}
