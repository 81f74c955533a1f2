//! The task that owns a wire: it connects, keeps time, and does what `Wire` says. No rule lives here.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker, ready};
use std::time::{Duration, SystemTime};

use tokio::net::{TcpStream, lookup_host};
use tokio::time::{Instant, Sleep, sleep_until, timeout};
use tracing::{info, warn};

use crate::endpoint::Endpoint;
use crate::error::Cause;
use crate::link::WireState;
use crate::options::Options;
use crate::shared::Shared;
use crate::trace::Tracer;
use crate::wire::{Phase, Step};

/// The future behind one wire; it ends when the wire is closed.
pub(crate) struct Task {
    shared: Arc<Shared>,
    endpoint: Arc<Endpoint>,
    connect_timeout: Duration,
    attempt: Option<Attempt>,
    alarm: Alarm,
    /// Callers to wake once the lock is free.
    wakes: Vec<Waker>,
    tracer: Option<Box<Tracer>>,
}

/// An attempt to connect. Boxed: it is large and short-lived, and there may be thousands of idle wires.
struct Attempt(Pin<Box<dyn Future<Output = Result<TcpStream, Cause>> + Send>>);

impl Task {
    pub(crate) fn new(shared: Arc<Shared>, endpoint: Arc<Endpoint>, options: Options) -> Self {
        Self {
            alarm: Alarm::new(shared.opened()),
            shared,
            endpoint,
            connect_timeout: options.connect_timeout,
            attempt: None,
            wakes: Vec::new(),
            tracer: options.trace.map(|trace| Box::new(Tracer::new(trace))),
        }
    }

    /// What became of the attempt to connect, if there is one and it has ended.
    fn poll_attempt(&mut self, cx: &mut Context<'_>) -> Option<Result<TcpStream, Cause>> {
        match self.attempt.as_mut()?.0.as_mut().poll(cx) {
            Poll::Ready(result) => {
                self.attempt = None;
                Some(result)
            }
            Poll::Pending => None,
        }
    }

    fn publish(&self, state: WireState) {
        match &state {
            WireState::Connecting => info!(endpoint = %self.endpoint, "connecting"),
            WireState::Connected => info!(endpoint = %self.endpoint, "connected"),
            WireState::Down { reason, .. } => warn!("{reason}"),
        }
        self.shared.state.send_if_modified(|current| {
            let mut state = state;
            if let (WireState::Down { since, .. }, WireState::Down { since: first, .. }) =
                (&mut state, &*current)
            {
                *since = *first;
            }
            let changed = *current != state;
            *current = state;
            changed
        });
    }
}

impl Future for Task {
    type Output = ();

    fn poll(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<()> {
        let task = &mut *self;
        loop {
            let connected = task.poll_attempt(cx);
            let now = task.shared.now();
            let mut guarded = task.shared.lock();
            let step = guarded.turn(cx, now, connected, &mut task.wakes);
            let news = guarded.wire.news().map(state_of);
            let seen = guarded.seen();
            guarded.sleeps(cx.waker(), task.alarm.next(now, step.until()));
            drop(guarded);

            while let Some(caller) = task.wakes.pop() {
                caller.wake();
            }
            if let Some(state) = news {
                task.publish(state);
            }
            if let Some(tracer) = &mut task.tracer {
                seen.into_iter().for_each(|seen| tracer.show(now, seen));
            }
            match step {
                Step::Connect => {
                    let attempt = connect(Arc::clone(&task.endpoint), task.connect_timeout);
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

/// One timer for the life of the wire.
///
/// Deadlines mostly move later and are mostly not reached. So an early alarm is left to ring and set anew then, which
/// costs one wake a time-out instead of two changes of the timer wheel an exchange.
struct Alarm {
    origin: Instant,
    sleep: Option<Pin<Box<Sleep>>>,
    set: Option<Duration>,
}

impl Alarm {
    fn new(origin: Instant) -> Self {
        Self { origin, sleep: None, set: None }
    }

    /// When it will ring if it is polled with `until` now.
    fn next(&self, now: Duration, until: Option<Duration>) -> Option<Duration> {
        let set = self.set.filter(|set| *set > now);
        set.into_iter().chain(until).min()
    }

    fn poll(&mut self, cx: &mut Context<'_>, until: Option<Duration>) -> Poll<()> {
        let Some(until) = until else {
            return Poll::Pending;
        };
        let at = self.origin + until;
        let sleep = self.sleep.get_or_insert_with(|| Box::pin(sleep_until(at)));
        loop {
            let set = match self.set {
                Some(set) if set <= until => set,
                _ => {
                    sleep.as_mut().reset(at);
                    self.set = Some(until);
                    until
                }
            };
            ready!(sleep.as_mut().poll(cx));
            self.set = None;
            if set == until {
                return Poll::Ready(());
            }
        }
    }
}

fn state_of(phase: &Phase) -> WireState {
    match phase {
        Phase::Connecting { .. } => WireState::Connecting,
        Phase::Connected => WireState::Connected,
        Phase::Down { reason, .. } => WireState::Down { reason: reason.clone(), since: SystemTime::now() },
    }
}

/// Connects to the first address of the host that takes us.
async fn connect(endpoint: Arc<Endpoint>, limit: Duration) -> Result<TcpStream, Cause> {
    let Endpoint::Tcp { host, port } = &*endpoint else {
        // `Link::open` lets nothing else through.
        return Err(Cause::Unreachable);
    };
    let attempt = async {
        let addresses = lookup_host((host.as_str(), *port)).await.map_err(|_| Cause::UnknownHost)?;
        let mut cause = Cause::UnknownHost;
        for address in addresses {
            match TcpStream::connect(address).await {
                Ok(stream) => {
                    stream.set_nodelay(true).map_err(|error| Cause::from(&error))?;
                    return Ok(stream);
                }
                Err(error) => cause = Cause::from(&error),
            }
        }
        Err(cause)
    };
    match timeout(limit, attempt).await {
        Ok(result) => result,
        Err(_) => Err(Cause::ConnectTimedOut { after: limit }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_small() {
        // Ten thousand wires have to fit into 60 MiB with everything else: 4 KiB each, buffers and runtime included.
        assert!(size_of::<Task>() + size_of::<Shared>() <= 1536);
    }
}
