//! Tracing: every frame that crosses a wire, shown to whoever asked to see them.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

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

/// Cuts what comes in into frames again before it is shown: TCP keeps no boundaries.
#[derive(Debug)]
pub(crate) struct Tracer {
    trace: Trace,
    pending: Vec<u8>,
}

impl Tracer {
    pub(crate) fn new(trace: Trace) -> Self {
        Self { trace, pending: Vec::new() }
    }

    pub(crate) fn show(&mut self, at: Duration, seen: Seen) {
        match seen {
            Seen::Sent(bytes) => self.emit(at, Direction::Sent, &bytes),
            Seen::Received(bytes) => self.received(at, &bytes),
            Seen::Closed => self.closed(at),
        }
    }

    fn received(&mut self, at: Duration, bytes: &[u8]) {
        self.pending.extend_from_slice(bytes);
        let mut start = 0;
        while let Some(length) = whole_frame(&self.pending[start..]) {
            self.emit(at, Direction::Received, &self.pending[start..start + length]);
            start += length;
        }
        self.pending.drain(..start);
    }

    /// Whatever is left makes no frame any more, and is shown as it is.
    fn closed(&mut self, at: Duration) {
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

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    fn shown(chunks: &[&[u8]]) -> Vec<(u64, Vec<u8>)> {
        let seen = Arc::new(Mutex::new(Vec::new()));
        let sink = Arc::clone(&seen);
        let mut tracer = Tracer::new(Trace::new(move |event| {
            assert_eq!(event.direction, Direction::Received);
            let mut sink = sink.lock().unwrap();
            sink.push((event.at.as_millis() as u64, event.bytes.to_vec()));
        }));
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
}
