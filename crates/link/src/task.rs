//! The task that owns a wire: it connects, keeps time, and does what `Wire` says. No rule lives here.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker, ready};
use std::time::Duration;

use busbar_modbus::Framing;
use tracing::{debug, info, warn};

use crate::clock::{Alarm, Precision};
use crate::endpoint::Endpoint;
use crate::error::Cause;
use crate::line::Line;
use crate::link::WireState;
use crate::options::Options;
use crate::shared::Shared;
use crate::stream::Stream;
use crate::trace::Tracer;
use crate::wire::Step;

/// The future behind one wire; it ends when the wire is closed.
pub(crate) struct Task {
    shared: Arc<Shared>,
    endpoint: Arc<Endpoint>,
    connect_timeout: Duration,
    attempt: Option<Attempt>,
    alarm: Alarm,
    framing: Framing,
    tracer: Option<Box<Tracer>>,
    told: Told,
}

/// Whether the log last said that the wire is up, if it said anything.
#[derive(Debug, Default)]
struct Told(Option<bool>);

impl Told {
    /// Whether the state is worth a line: a wire that stays down, or is up again before it was down, is not.
    fn is_new(&mut self, state: &WireState) -> bool {
        let up = match state {
            WireState::Connecting => return false,
            WireState::Connected => true,
            WireState::Down { .. } => false,
        };
        self.0.replace(up) != Some(up)
    }
}

/// An attempt to connect. Boxed: it is large and short-lived, and there may be thousands of idle wires.
struct Attempt(Pin<Box<dyn Future<Output = Result<Stream, Cause>> + Send>>);

impl Task {
    pub(crate) fn new(shared: Arc<Shared>, endpoint: Arc<Endpoint>, line: Line, options: Options) -> Self {
        let precision = match line.is_serial() {
            true => Precision::Fine,
            false => Precision::Coarse,
        };
        Self {
            alarm: Alarm::new(shared.opened(), precision),
            shared,
            endpoint,
            connect_timeout: options.connect_timeout,
            attempt: None,
            framing: line.framing,
            tracer: None,
            told: Told::default(),
        }
    }

    /// What became of the attempt to connect, if there is one and it has ended.
    fn poll_attempt(&mut self, cx: &mut Context<'_>) -> Option<Result<Stream, Cause>> {
        match self.attempt.as_mut()?.0.as_mut().poll(cx) {
            Poll::Ready(result) => {
                self.attempt = None;
                Some(result)
            }
            Poll::Pending => None,
        }
    }

    fn publish(&mut self, state: WireState) {
        let endpoint = &self.endpoint;
        match (&state, self.told.is_new(&state)) {
            (WireState::Connecting, _) => debug!(%endpoint, "connecting"),
            (WireState::Connected, true) => info!(%endpoint, "connected"),
            (WireState::Connected, false) => debug!(%endpoint, "connected"),
            (WireState::Down { reason, .. }, true) => warn!("{reason}"),
            (WireState::Down { reason, .. }, false) => debug!("{reason}"),
        }
        self.shared.publish(state);
    }
}

impl Future for Task {
    type Output = ();

    fn poll(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<()> {
        let task = &mut *self;
        loop {
            let connected = task.poll_attempt(cx);
            // Callers to wake once the lock is free.
            let mut wakes = Vec::new();
            let mut guarded = task.shared.lock();
            let step = guarded.turn(cx, || task.shared.now(), connected, &mut wakes);
            let now = task.shared.now();
            let news = guarded.news();
            let (seen, retraced) = (guarded.seen(), guarded.retraced());
            let busy = guarded.wire.is_busy();
            guarded.sleeps(cx.waker(), task.alarm.next(now, step.until()));
            drop(guarded);

            wakes.into_iter().for_each(Waker::wake);
            if let Some(state) = news {
                task.publish(state);
            }
            if let Some(trace) = retraced {
                task.tracer = trace.map(|trace| Box::new(Tracer::new(trace, task.framing)));
            }
            if let Some(tracer) = &mut task.tracer {
                seen.into_iter().for_each(|seen| tracer.show(now, seen));
                if !busy {
                    tracer.ended(now);
                }
            }
            match step {
                Step::Connect => {
                    let attempt = Stream::connect(Arc::clone(&task.endpoint), task.connect_timeout);
                    task.attempt = Some(Attempt(Box::pin(attempt)));
                }
                Step::Disconnect => {}
                Step::Send(until) | Step::Wait(until) => ready!(task.alarm.poll(cx, until)),
                Step::End => return Poll::Ready(()),
            }
        }
    }
}

/// Whoever still waits, for example when the runtime shuts down, learns that nobody will answer.
impl Drop for Task {
    fn drop(&mut self) {
        self.shared.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Outage;

    #[test]
    fn the_log_hears_of_each_change_once() {
        let down = || {
            let endpoint: Arc<Endpoint> = Arc::new("tcp://10.0.0.7".parse().unwrap());
            let reason = Outage { endpoint, cause: Cause::Refused };
            WireState::Down { reason, since: std::time::SystemTime::UNIX_EPOCH }
        };
        let mut told = Told::default();
        let states = [
            (WireState::Connecting, false),
            (down(), true),
            (down(), false),
            (WireState::Connected, true),
            (WireState::Connecting, false),
            (WireState::Connected, false),
            (WireState::Connecting, false),
            (down(), true),
            (down(), false),
        ];
        for (index, (state, new)) in states.iter().enumerate() {
            assert_eq!(told.is_new(state), *new, "{index}: {state:?}");
        }
    }

    #[test]
    fn is_small() {
        // Ten thousand wires have to fit into 60 MiB with everything else: 4 KiB each, buffers and runtime included.
        assert!(size_of::<Task>() + size_of::<Shared>() <= 1536);
    }
}
