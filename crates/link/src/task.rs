//! The task that owns a wire: it connects, keeps time, and does what `Wire` says. No rule lives here.

use std::future::Future;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker, ready};
use std::time::{Duration, SystemTime};

use tokio::net::{TcpStream, lookup_host};
use tokio::time::{Instant, Sleep, sleep_until, timeout};
use tracing::{debug, info, warn};

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
            told: Told::default(),
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

    fn publish(&mut self, state: WireState) {
        let endpoint = &self.endpoint;
        match (&state, self.told.is_new(&state)) {
            (WireState::Connecting, _) => debug!(%endpoint, "connecting"),
            (WireState::Connected, true) => info!(%endpoint, "connected"),
            (WireState::Connected, false) => debug!(%endpoint, "connected"),
            (WireState::Down { reason, .. }, true) => warn!("{reason}"),
            (WireState::Down { reason, .. }, false) => debug!("{reason}"),
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

/// Connects to the host of the endpoint. To look its name up takes no longer than to connect.
async fn connect(endpoint: Arc<Endpoint>, limit: Duration) -> Result<TcpStream, Cause> {
    let Endpoint::Tcp { host, port } = &*endpoint else {
        // `Link::open` lets nothing else through.
        return Err(Cause::Unreachable);
    };
    let addresses = match timeout(limit, lookup_host((host.as_str(), *port))).await {
        Ok(Ok(addresses)) => addresses,
        Ok(Err(_)) | Err(_) => return Err(Cause::UnknownHost),
    };
    connect_to(addresses, limit).await
}

/// Connects to the first address that takes us. Each has the whole limit, so that one that is dead does not use up the
/// time of the next.
async fn connect_to(
    addresses: impl Iterator<Item = SocketAddr>,
    limit: Duration,
) -> Result<TcpStream, Cause> {
    let mut cause = Cause::UnknownHost;
    for address in addresses {
        cause = match timeout(limit, TcpStream::connect(address)).await {
            Ok(Ok(stream)) => {
                stream.set_nodelay(true).map_err(|error| Cause::from(&error))?;
                return Ok(stream);
            }
            Ok(Err(error)) => Cause::from(&error),
            Err(_) => Cause::ConnectTimedOut { after: limit },
        };
    }
    Err(cause)
}

#[cfg(test)]
mod tests {
    use std::io;

    use tokio::net::{TcpListener, TcpSocket};

    use super::*;
    use crate::error::Outage;

    #[test]
    fn the_log_hears_of_each_change_once() {
        let down = || {
            let endpoint: Arc<Endpoint> = Arc::new("tcp://10.0.0.7".parse().unwrap());
            let reason = Outage { endpoint, cause: Cause::Refused };
            WireState::Down { reason, since: SystemTime::UNIX_EPOCH }
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

    /// An address whose queue is full: attempts to connect to it hang.
    async fn dead_address() -> io::Result<(SocketAddr, impl Sized)> {
        let socket = TcpSocket::new_v4()?;
        socket.bind(SocketAddr::from(([127, 0, 0, 1], 0)))?;
        let listener = socket.listen(0)?;
        let address = listener.local_addr()?;
        let mut fillers = Vec::new();
        while let Ok(filler) = timeout(Duration::from_millis(100), TcpStream::connect(address)).await {
            fillers.push(filler?);
        }
        Ok((address, (listener, fillers)))
    }

    #[tokio::test]
    async fn a_dead_address_leaves_time_for_the_next() {
        let (dead, _filled) = dead_address().await.unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let good = listener.local_addr().unwrap();
        let limit = Duration::from_millis(200);
        let stream = connect_to([dead, good].into_iter(), limit).await.unwrap();
        assert_eq!(stream.peer_addr().unwrap(), good);
        let refused = connect_to([dead].into_iter(), limit).await.unwrap_err();
        assert_eq!(refused, Cause::ConnectTimedOut { after: limit });
    }

    #[test]
    fn is_small() {
        // Ten thousand wires have to fit into 60 MiB with everything else: 4 KiB each, buffers and runtime included.
        assert!(size_of::<Task>() + size_of::<Shared>() <= 1536);
    }
}
