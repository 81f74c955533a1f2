//! What the handles on a wire and its task share: the rules and the connection, behind one lock.

use std::mem::MaybeUninit;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::task::{Context, Poll, Waker, ready};
use std::time::{Duration, SystemTime};

use tokio::io::ReadBuf;
use tokio::sync::watch;
use tokio::time::Instant;

use crate::echo::EchoFilter;
use crate::error::Cause;
use crate::job::{Job, Outcome};
use crate::line::Line;
use crate::link::WireState;
use crate::port::Port;
use crate::queue::{Place, Ticket};
use crate::stream::Stream;
use crate::trace::{Seen, Trace};
use crate::wire::{Phase, Step, Wire};

/// More than any frame: a read that does not fill it has emptied the socket, and the runtime knows so without asking
/// the system again.
const READ_SPACE: usize = 512;

/// Reads in one go; a peer that sends without end must not keep others waiting.
const READS: usize = 16;

#[derive(Debug)]
pub(crate) struct Shared {
    /// Made when somebody first asks: it is large, and most wires of a large fleet are watched by nobody.
    state: OnceLock<watch::Sender<WireState>>,
    opened: Instant,
    guarded: Mutex<Guarded>,
}

impl Shared {
    pub(crate) fn new(wire: Wire, line: Line) -> Self {
        Self {
            state: OnceLock::new(),
            opened: Instant::now(),
            guarded: Mutex::new(Guarded {
                wire,
                port: Port::default(),
                echo: line.is_rtu().then(Box::default),
                reader: None,
                task: None,
                alarm: None,
                seen: None,
                retraced: None,
                down_since: None,
            }),
        }
    }

    /// The state of the connection from now on.
    pub(crate) fn subscribe(&self) -> watch::Receiver<WireState> {
        let mut guarded = self.lock();
        self.state.get_or_init(|| watch::Sender::new(guarded.state())).subscribe()
    }

    /// Tells those who watch of a new state.
    pub(crate) fn publish(&self, state: WireState) {
        if let Some(sender) = self.state.get() {
            sender.send_if_modified(|current| {
                let changed = *current != state;
                *current = state;
                changed
            });
        }
    }

    /// Nothing that can panic or block runs under this lock, so a poisoned one is still sound.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Guarded> {
        self.guarded.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// When the wire's time began.
    pub(crate) fn opened(&self) -> Instant {
        self.opened
    }

    /// The wire's time.
    pub(crate) fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    /// Takes a job in and gets it on its way.
    pub(crate) fn submit(&self, cx: &mut Context<'_>, job: Job) -> Result<Ticket, Outcome> {
        let mut wakes = Vec::new();
        let mut guarded = self.lock();
        let now = self.now();
        let ticket = guarded.wire.submit(now, job, cx.waker())?;
        guarded.dispatch(cx, || self.now(), ticket.place(), &mut wakes);
        drop(guarded);
        wakes.into_iter().for_each(Waker::wake);
        Ok(ticket)
    }

    /// The outcome of a job, once it is there.
    pub(crate) fn poll(&self, cx: &mut Context<'_>, ticket: &Ticket) -> Poll<Outcome> {
        let mut wakes = Vec::new();
        let mut guarded = self.lock();
        if guarded.reader == Some(ticket.place()) {
            // Nobody has to be woken who is awake.
            guarded.wire.forget_waker(ticket);
            guarded.read_answer(cx, || self.now(), &mut wakes);
        }
        let outcome = guarded.wire.take(ticket, cx.waker());
        drop(guarded);
        wakes.into_iter().for_each(Waker::wake);
        outcome
    }

    /// A caller is gone.
    pub(crate) fn cancel(&self, ticket: Ticket) {
        let mut guarded = self.lock();
        let mut task = None;
        if guarded.reader == Some(ticket.place()) {
            guarded.reader = None;
            task = guarded.task.take();
        }
        guarded.wire.cancel(ticket);
        drop(guarded);
        task.into_iter().for_each(Waker::wake);
    }

    /// Shows every frame from now on, or none any more.
    pub(crate) fn trace(&self, trace: Option<Trace>) {
        let mut guarded = self.lock();
        guarded.seen = trace.is_some().then(Vec::new);
        guarded.retraced = Some(trace);
        let task = guarded.task.take();
        drop(guarded);
        task.into_iter().for_each(Waker::wake);
    }

    /// Ends everything: the last handle is gone, or the task is.
    pub(crate) fn close(&self) {
        let mut wakes = Vec::new();
        let mut guarded = self.lock();
        guarded.wire.close(&mut wakes);
        guarded.port.close();
        wakes.extend(guarded.task.take());
        drop(guarded);
        wakes.into_iter().for_each(Waker::wake);
    }
}

/// The wire and its connection.
///
/// They are the task's. But a caller who finds the wire idle hands its frame to the system itself, and reads the answer
/// itself when it comes, by the same rules and under the same lock: that saves two changes of task an exchange, which
/// is what most of our own processor time would go to. The task takes the reading back
/// - when its alarm rings, which is set for each deadline,
/// - when somebody else wants the wire: a caller who forgets to poll its future holds up nobody but itself,
/// - when the caller is gone, and for everything out of the ordinary.
#[derive(Debug)]
pub(crate) struct Guarded {
    pub(crate) wire: Wire,
    port: Port,
    /// On RTU wires.
    echo: Option<Box<EchoFilter>>,
    /// The job whose caller is woken for its answer; otherwise the task is, or nobody while nothing is under way.
    reader: Option<Place>,
    /// How to wake the task; it puts a waker here before it sleeps.
    task: Option<Waker>,
    /// When the task wakes by itself, if nothing wakes it before.
    alarm: Option<Duration>,
    /// What went over the wire and has not been shown yet, if somebody wants to see it.
    seen: Option<Vec<Seen>>,
    /// Who is to be shown it from now on, until the task knows; none inside where nobody is.
    retraced: Option<Option<Trace>>,
    /// Since when the wire has been down, if it is.
    down_since: Option<SystemTime>,
}

impl Guarded {
    /// The task's turn: takes in what has come, and says what to do next.
    pub(crate) fn turn(
        &mut self,
        cx: &mut Context<'_>,
        clock: impl Fn() -> Duration,
        connected: Option<Result<Stream, Cause>>,
        wakes: &mut Vec<Waker>,
    ) -> Step {
        self.reader = None;
        match connected {
            None => {}
            Some(Ok(stream)) => {
                self.port.open(stream);
                self.wire.connected(clock());
            }
            Some(Err(cause)) => self.wire.refused(clock(), cause, wakes),
        }
        self.read_all(cx, &clock, wakes);
        // Later than what was read: silence is counted from then.
        let now = clock();
        // What has ended meanwhile must not leave any more: its caller knows that it has not.
        if self.port.is_blocked() && self.wire.is_busy() {
            match self.port.poll_rest(cx) {
                Poll::Ready(Ok(())) => self.wire.sent_rest(),
                Poll::Ready(Err(cause)) => self.lost(now, cause, wakes),
                Poll::Pending => self.wire.sent_only(self.port.sent()),
            }
        }

        let step = self.wire.step(now, &mut self.port.frame, wakes);
        match step {
            Step::Send(_) => {
                if !self.start() {
                    // Once more, to be told when the system takes the rest.
                    cx.waker().wake_by_ref();
                }
            }
            Step::Disconnect => self.close(),
            Step::Connect | Step::Wait(_) | Step::End => {}
        }
        step
    }

    /// The state of the connection, if it has changed since this was last asked.
    pub(crate) fn news(&mut self) -> Option<WireState> {
        self.wire.news().then(|| self.state())
    }

    fn state(&mut self) -> WireState {
        let state = match self.wire.phase() {
            Phase::Connecting { .. } => WireState::Connecting,
            Phase::Connected => WireState::Connected,
            Phase::Down { reason, .. } => {
                let since = *self.down_since.get_or_insert_with(SystemTime::now);
                return WireState::Down { reason: reason.clone(), since };
            }
        };
        self.down_since = None;
        state
    }

    /// The task sleeps until it is woken, or until `alarm`.
    pub(crate) fn sleeps(&mut self, task: &Waker, alarm: Option<Duration>) {
        self.alarm = alarm;
        match &mut self.task {
            Some(known) => known.clone_from(task),
            none => *none = Some(task.clone()),
        }
    }

    /// What went over the wire since this was last asked.
    pub(crate) fn seen(&mut self) -> Vec<Seen> {
        self.seen.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Who is to be shown what goes over the wire, if that has changed since this was last asked.
    pub(crate) fn retraced(&mut self) -> Option<Option<Trace>> {
        self.retraced.take()
    }

    /// Gets a job that was just taken in on its way, or the task to do so.
    fn dispatch(
        &mut self,
        cx: &mut Context<'_>,
        clock: impl Fn() -> Duration,
        place: Place,
        wakes: &mut Vec<Waker>,
    ) {
        let minded = match self.wire.is_busy() {
            // The task looks into the queue when the exchange ends, if the answer wakes it.
            true => self.reader.take().is_none(),
            false => self.seen.is_none() && self.start_here(cx, clock, place, wakes),
        };
        if !minded {
            wakes.extend(self.task.take());
        }
    }

    /// Sends the job from the caller's own task. Says whether the wire's task can sleep on.
    fn start_here(
        &mut self,
        cx: &mut Context<'_>,
        clock: impl Fn() -> Duration,
        place: Place,
        wakes: &mut Vec<Waker>,
    ) -> bool {
        // What lies there answers nothing that is asked now, and it may say that the connection is gone. After this
        // it is the caller who is woken.
        self.read_all(cx, &clock, wakes);
        let now = clock();
        let Some(until) = self.wire.start_next(now, &mut self.port.frame, wakes) else {
            return false;
        };
        let whole = self.start();
        if !whole || self.wire.under_way() != Some(place) {
            return false;
        }
        self.reader = Some(place);
        self.alarm.is_some_and(|alarm| now < alarm && alarm <= until)
    }

    /// Reads for the one exchange that is under way, from its caller's own task.
    fn read_answer(&mut self, cx: &mut Context<'_>, clock: impl Fn() -> Duration, wakes: &mut Vec<Waker>) {
        while self.wire.is_busy() {
            if self.read(cx, &clock, wakes).is_pending() {
                // Behind noise the line is looked at again before the deadline, and that is the task's.
                let Some(next) = self.wire.next_look() else { return };
                if self.alarm.is_none_or(|alarm| next < alarm) {
                    self.reader = None;
                    wakes.extend(self.task.take());
                }
                return;
            }
        }
        self.reader = None;
        if !self.wire.is_at_rest() {
            wakes.extend(self.task.take());
        }
    }

    fn read_all(&mut self, cx: &mut Context<'_>, clock: impl Fn() -> Duration, wakes: &mut Vec<Waker>) {
        for _ in 0..READS {
            if self.read(cx, &clock, wakes).is_pending() {
                return;
            }
        }
        cx.waker().wake_by_ref();
    }

    fn read(
        &mut self,
        cx: &mut Context<'_>,
        clock: impl Fn() -> Duration,
        wakes: &mut Vec<Waker>,
    ) -> Poll<()> {
        let mut space = [MaybeUninit::uninit(); READ_SPACE];
        let mut space = ReadBuf::uninit(&mut space);
        match ready!(self.port.poll_read(cx, &mut space)) {
            Ok(()) => {
                if let Some(seen) = &mut self.seen {
                    seen.push(Seen::Received(space.filled().to_vec()));
                }
                self.take_in(clock(), space.filled(), wakes);
            }
            Err(cause) => self.lost(clock(), cause, wakes),
        }
        Poll::Ready(())
    }

    /// Gives what came to the rules, without echoes.
    fn take_in(&mut self, now: Duration, bytes: &[u8], wakes: &mut Vec<Waker>) {
        let Some(filter) = &mut self.echo else {
            return self.wire.received(now, bytes, wakes);
        };
        let came = filter.received(bytes);
        self.wire.heard(now, bytes.len(), came.echo);
        let before = self.wire.answers();
        for bytes in [came.held, came.rest] {
            if !bytes.is_empty() {
                self.wire.received(now, bytes, wakes);
            }
        }
        if self.wire.answers() > before {
            filter.answered();
        }
        if !self.wire.is_busy() {
            let held = filter.give_up();
            if !held.is_empty() {
                self.wire.received(now, held, wakes);
            }
        }
    }

    /// Sends the frame, and says whether all of it has left; if not, the task sends the rest.
    fn start(&mut self) -> bool {
        if let Some(seen) = &mut self.seen {
            seen.push(Seen::Sent(self.port.frame.clone()));
        }
        if let Some(filter) = &mut self.echo
            && filter.sent(&self.port.frame)
        {
            self.wire.expect_echo();
        }
        let sent = self.port.start();
        let whole = !self.port.is_blocked();
        if !whole {
            self.wire.sent_only(sent);
        }
        whole
    }

    fn lost(&mut self, now: Duration, cause: Cause, wakes: &mut Vec<Waker>) {
        self.close();
        self.wire.lost(now, cause, wakes);
    }

    fn close(&mut self) {
        self.port.close();
        if let Some(filter) = &mut self.echo {
            filter.give_up();
        }
        if let Some(seen) = &mut self.seen {
            seen.push(Seen::Closed);
        }
    }
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use std::os::fd::AsFd;
    use std::sync::Arc;

    use rustix::event::{PollFd, PollFlags, poll};
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::net::{TcpListener, TcpStream};
    use tokio::time::timeout;

    use super::*;
    use crate::endpoint::Endpoint;
    use crate::error::LinkError;
    use crate::job::{Ask, Priority, Write};
    use crate::options::Options;

    const LATER: Duration = Duration::from_millis(10);

    /// A connection into which not one more byte fits, and its other end.
    async fn stuffed() -> (TcpStream, TcpStream, usize) {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let stream = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
        let peer = listener.accept().await.unwrap().0;
        let mut stuffed = 0;
        while timeout(Duration::from_millis(100), stream.writable()).await.is_ok() {
            stuffed += stream.try_write(&[0xEE; 65_536]).unwrap_or(0);
        }
        (stream, peer, stuffed)
    }

    #[tokio::test]
    async fn a_write_that_was_called_not_sent_does_not_leave_after_all() {
        let (stream, mut peer, stuffed) = stuffed().await;
        let same = stream.as_fd().try_clone_to_owned().unwrap();
        let endpoint: Arc<Endpoint> = Arc::new("tcp://192.0.2.1".parse().unwrap());
        let wire = Wire::new(endpoint, Line::tcp(), &Options::default());
        let shared = Shared::new(wire, Line::tcp());
        let mut cx = Context::from_waker(Waker::noop());
        let mut wakes = Vec::new();
        let job = Job {
            unit: 1,
            ask: Ask::Write(Write::Register { address: 8193, value: 4 }),
            priority: Priority::Command,
            timeout: Duration::from_secs(1),
            spacing: Duration::ZERO,
            short: false,
            registers: Vec::new(),
        };
        let mut turn = |connected| shared.lock().turn(&mut cx, || LATER, connected, &mut wakes);
        assert_eq!(turn(None), Step::Connect);
        turn(Some(Ok(Stream::Tcp(stream))));
        let ticket = shared.lock().wire.submit(LATER, job, Waker::noop()).unwrap();
        assert!(matches!(turn(None), Step::Send(_)) && shared.lock().port.is_blocked());

        // The peer breaks the protocol, and takes bytes again.
        peer.write_all(&[0, 1, 0, 0, 0xFF, 0xFF, 1]).await.unwrap();
        poll(&mut [PollFd::new(&same, PollFlags::IN)], None).unwrap();
        drop(same);
        let mut taken = vec![0; stuffed];
        peer.read_exact(&mut taken).await.unwrap();
        while turn(None) != Step::Disconnect {
            assert!(shared.lock().port.is_blocked(), "nothing may leave before it is decided");
            tokio::task::yield_now().await;
        }
        let outcome = shared.lock().wire.take(&ticket, Waker::noop()).map(|outcome| outcome.result);
        assert!(matches!(outcome, Poll::Ready(Err(LinkError::Down { .. }))), "{outcome:?}");
        let mut left = Vec::new();
        let _ = peer.read_to_end(&mut left).await;
        assert!(left.is_empty(), "{left:02X?} left");
    }
}
