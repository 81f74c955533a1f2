//! When a wire wakes by itself: a timer that is cheap, or one that is precise.

use std::future::Future;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use tokio::time::{Instant, Sleep, sleep_until};

/// One timer for the life of the wire.
///
/// Deadlines mostly move later and are mostly not reached. So an early alarm is left to ring and set anew then, which
/// costs one wake a time-out instead of two changes of the timer an exchange.
pub(crate) struct Alarm {
    origin: Instant,
    precision: Precision,
    timer: Option<Timer>,
    set: Option<Duration>,
}

/// How exactly an alarm rings. It never rings early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Precision {
    /// To the millisecond or two, from the runtime's timer wheel: there may be thousands.
    Coarse,
    /// To some ten microseconds, where the system can: a silence of 3.65 ms must not become 5.
    Fine,
}

impl Alarm {
    pub(crate) fn new(origin: Instant, precision: Precision) -> Self {
        Self { origin, precision, timer: None, set: None }
    }

    /// When it will ring if it is polled with `until` now.
    pub(crate) fn next(&self, now: Duration, until: Option<Duration>) -> Option<Duration> {
        let set = self.set.filter(|set| *set > now);
        set.into_iter().chain(until).min()
    }

    pub(crate) fn poll(&mut self, cx: &mut Context<'_>, until: Option<Duration>) -> Poll<()> {
        let Some(until) = until else {
            return Poll::Pending;
        };
        let at = self.origin + until;
        let precision = self.precision;
        let timer = self.timer.get_or_insert_with(|| Timer::new(precision, at));
        loop {
            let set = match self.set {
                Some(set) if set <= until => set,
                _ => {
                    timer.set(at);
                    self.set = Some(until);
                    until
                }
            };
            ready!(timer.poll(cx));
            self.set = None;
            if set == until {
                return Poll::Ready(());
            }
        }
    }
}

enum Timer {
    Wheel(Pin<Box<Sleep>>),
    #[cfg(target_os = "linux")]
    System(Box<system::Timer>),
}

impl Timer {
    fn new(precision: Precision, at: Instant) -> Self {
        match precision {
            Precision::Coarse => Self::Wheel(Box::pin(sleep_until(at))),
            Precision::Fine => Self::fine(at),
        }
    }

    /// A system that has no more such timers still has the wheel.
    #[cfg(target_os = "linux")]
    fn fine(at: Instant) -> Self {
        match system::Timer::new() {
            Ok(timer) => Self::System(Box::new(timer)),
            Err(_) => Self::Wheel(Box::pin(sleep_until(at))),
        }
    }

    #[cfg(not(target_os = "linux"))]
    fn fine(at: Instant) -> Self {
        Self::Wheel(Box::pin(sleep_until(at)))
    }

    fn set(&mut self, at: Instant) {
        match self {
            Self::Wheel(sleep) => sleep.as_mut().reset(at),
            #[cfg(target_os = "linux")]
            Self::System(timer) => {
                if timer.set(at).is_err() {
                    *self = Self::Wheel(Box::pin(sleep_until(at)));
                }
            }
        }
    }

    fn poll(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        match self {
            Self::Wheel(sleep) => sleep.as_mut().poll(cx),
            #[cfg(target_os = "linux")]
            Self::System(timer) => timer.poll(cx),
        }
    }
}

/// The kernel's own timer as a file: it rings to some ten microseconds and wakes the runtime like a socket.
#[cfg(target_os = "linux")]
mod system {
    use std::io;
    use std::os::fd::OwnedFd;
    use std::task::{Context, Poll, ready};

    use rustix::time::{
        Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, timerfd_create,
        timerfd_settime,
    };
    use tokio::io::Interest;
    use tokio::io::unix::AsyncFd;
    use tokio::time::Instant;

    pub(super) struct Timer {
        file: AsyncFd<OwnedFd>,
        at: Option<Instant>,
    }

    impl Timer {
        pub(super) fn new() -> io::Result<Self> {
            let flags = TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC;
            let file = timerfd_create(TimerfdClockId::Monotonic, flags)?;
            #[expect(deprecated, reason = "its successor is unsafe; an OwnedFd stays the same file")]
            let file = AsyncFd::with_interest(file, Interest::READABLE)?;
            Ok(Self { file, at: None })
        }

        pub(super) fn set(&mut self, at: Instant) -> io::Result<()> {
            // Zero would stop it.
            let wait = at.saturating_duration_since(Instant::now()).max(std::time::Duration::from_nanos(1));
            let once = Itimerspec {
                it_interval: Timespec { tv_sec: 0, tv_nsec: 0 },
                it_value: Timespec {
                    tv_sec: wait.as_secs().try_into().unwrap_or(i64::MAX),
                    tv_nsec: wait.subsec_nanos().into(),
                },
            };
            timerfd_settime(self.file.get_ref(), TimerfdTimerFlags::empty(), &once)?;
            self.at = Some(at);
            Ok(())
        }

        /// The file only wakes; the clock says whether it is time, so a ring of an earlier setting does no harm.
        pub(super) fn poll(&mut self, cx: &mut Context<'_>) -> Poll<()> {
            while self.at.is_some_and(|at| Instant::now() < at) {
                // The runtime is shutting down if this fails, and nobody waits any more.
                let Ok(mut guard) = ready!(self.file.poll_read_ready(cx)) else {
                    return Poll::Pending;
                };
                let mut rings = [0; 8];
                let _ = guard.try_io(|file| Ok(rustix::io::read(file.get_ref(), &mut rings)?));
            }
            Poll::Ready(())
        }
    }
}

#[cfg(test)]
mod tests {
    use std::future::poll_fn;

    use super::*;

    async fn rings(alarm: &mut Alarm, until: Duration) -> Duration {
        poll_fn(|cx| alarm.poll(cx, Some(until))).await;
        alarm.origin.elapsed()
    }

    #[tokio::test]
    async fn never_rings_early() {
        for precision in [Precision::Coarse, Precision::Fine] {
            let mut alarm = Alarm::new(Instant::now(), precision);
            for micros in [0, 300, 300, 1_750, 3_646, 3_647, 9_000] {
                let until = Duration::from_micros(micros);
                let rang = rings(&mut alarm, until).await;
                assert!(rang >= until, "{precision:?}: {rang:?} before {until:?}");
            }
        }
    }

    #[tokio::test]
    async fn follows_a_deadline_that_moves_either_way() {
        for precision in [Precision::Coarse, Precision::Fine] {
            let mut alarm = Alarm::new(Instant::now(), precision);
            let hour = Duration::from_secs(3600);
            let soon = Duration::from_millis(4);
            let mut polled = false;
            poll_fn(|cx| {
                let until = if polled { soon } else { hour };
                polled = true;
                match alarm.poll(cx, Some(until)) {
                    Poll::Pending if until == hour => {
                        assert_eq!(alarm.next(Duration::ZERO, Some(soon)), Some(soon));
                        cx.waker().wake_by_ref();
                        Poll::Pending
                    }
                    other => other,
                }
            })
            .await;
            assert!(alarm.origin.elapsed() >= soon);

            // An earlier setting rings, and the alarm goes on to the later one.
            let early = alarm.origin.elapsed() + Duration::from_millis(2);
            let late = early + Duration::from_millis(4);
            let mut polled = false;
            poll_fn(|cx| {
                let until = if polled { late } else { early };
                polled = true;
                alarm.poll(cx, Some(until))
            })
            .await;
            assert!(alarm.origin.elapsed() >= early);
            assert!(rings(&mut alarm, late).await >= late);
        }
    }
}
