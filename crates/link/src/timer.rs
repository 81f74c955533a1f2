//! An alarm clock precise enough for a serial line, where a millisecond is a whole character.

use std::future::{Future, poll_fn};
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use tokio::time::{Sleep, sleep_until};

/// One timer, set as often as needed. It never rings early.
///
/// On Linux it is the kernel's own timer as a file, which rings to some ten microseconds and wakes the runtime as a
/// socket does; the runtime's wheel has steps of a millisecond. Elsewhere, and where the system has no more such timers,
/// it is the wheel.
#[derive(Debug)]
pub struct LineTimer {
    clock: Clock,
    at: Option<Instant>,
    /// The clock is set so much earlier, and the rest is waited out on the processor.
    lead: Duration,
}

#[derive(Debug)]
enum Clock {
    Wheel(Pin<Box<Sleep>>),
    #[cfg(target_os = "linux")]
    System(system::Clock),
}

impl LineTimer {
    /// A timer that is not set. It wants a tokio runtime.
    #[must_use]
    pub fn new() -> Self {
        Self { clock: Clock::new(), at: None, lead: Duration::ZERO }
    }

    /// Rings to some microseconds: the last `lead` of each wait is spent on the processor, for it may take the system so
    /// long to wake us. Longer than 100 microseconds makes others wait for nothing.
    #[must_use]
    pub fn with_lead(self, lead: Duration) -> Self {
        Self { lead, ..self }
    }

    /// Sets it anew.
    pub fn set(&mut self, at: Instant) {
        self.at = Some(at);
        self.clock.set(at.checked_sub(self.lead).unwrap_or(at));
    }

    /// Ready when it is time; until then the caller is woken for it. One that was never set is ready.
    pub fn poll(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        // The clock only wakes, and may ring for an earlier setting; the time says whether it is time.
        while let Some(rest) = self.rest() {
            if rest <= self.lead {
                std::hint::spin_loop();
            } else if self.clock.poll(cx).is_pending() {
                return Poll::Pending;
            }
        }
        Poll::Ready(())
    }

    /// Sets it and waits. May be dropped at any time.
    pub async fn until(&mut self, at: Instant) {
        self.set(at);
        poll_fn(|cx| self.poll(cx)).await;
    }

    fn rest(&self) -> Option<Duration> {
        let rest = self.at?.saturating_duration_since(Instant::now());
        (!rest.is_zero()).then_some(rest)
    }
}

impl Default for LineTimer {
    fn default() -> Self {
        Self::new()
    }
}

impl Clock {
    #[cfg(target_os = "linux")]
    fn new() -> Self {
        system::Clock::new().map_or_else(|_| Self::wheel(Instant::now()), Self::System)
    }

    #[cfg(not(target_os = "linux"))]
    fn new() -> Self {
        Self::wheel(Instant::now())
    }

    fn wheel(at: Instant) -> Self {
        Self::Wheel(Box::pin(sleep_until(at.into())))
    }

    fn set(&mut self, at: Instant) {
        match self {
            Self::Wheel(sleep) => sleep.as_mut().reset(at.into()),
            #[cfg(target_os = "linux")]
            Self::System(clock) => {
                if clock.set(at).is_err() {
                    *self = Self::wheel(at);
                }
            }
        }
    }

    fn poll(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        match self {
            Self::Wheel(sleep) => sleep.as_mut().poll(cx),
            #[cfg(target_os = "linux")]
            Self::System(clock) => clock.poll(cx),
        }
    }
}

/// The kernel's timer as a file.
#[cfg(target_os = "linux")]
mod system {
    use std::io;
    use std::os::fd::OwnedFd;
    use std::task::{Context, Poll, ready};
    use std::time::{Duration, Instant};

    use rustix::time::{
        Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, timerfd_create,
        timerfd_settime,
    };
    use tokio::io::Interest;
    use tokio::io::unix::AsyncFd;

    #[derive(Debug)]
    pub(super) struct Clock(AsyncFd<OwnedFd>);

    impl Clock {
        pub(super) fn new() -> io::Result<Self> {
            let flags = TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC;
            let file = timerfd_create(TimerfdClockId::Monotonic, flags)?;
            #[expect(deprecated, reason = "its successor is unsafe; an OwnedFd stays the same file")]
            let file = AsyncFd::with_interest(file, Interest::READABLE)?;
            Ok(Self(file))
        }

        pub(super) fn set(&mut self, at: Instant) -> io::Result<()> {
            // Zero would stop it.
            let wait = at.saturating_duration_since(Instant::now()).max(Duration::from_nanos(1));
            let once = Itimerspec {
                it_interval: Timespec { tv_sec: 0, tv_nsec: 0 },
                it_value: Timespec {
                    tv_sec: wait.as_secs().try_into().unwrap_or(i64::MAX),
                    tv_nsec: wait.subsec_nanos().into(),
                },
            };
            timerfd_settime(self.0.get_ref(), TimerfdTimerFlags::empty(), &once)?;
            Ok(())
        }

        /// Ready when it may have rung.
        pub(super) fn poll(&mut self, cx: &mut Context<'_>) -> Poll<()> {
            // The runtime is shutting down if this fails, and nobody waits any more.
            let Ok(mut guard) = ready!(self.0.poll_read_ready(cx)) else {
                return Poll::Pending;
            };
            let mut rings = [0; 8];
            let _ = guard.try_io(|file| Ok(rustix::io::read(file.get_ref(), &mut rings)?));
            Poll::Ready(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn never_rings_early() {
        for lead in [0, 80, 5000].map(Duration::from_micros) {
            let mut timer = LineTimer::new().with_lead(lead);
            poll_fn(|cx| timer.poll(cx)).await;
            for micros in [0, 20, 300, 300, 1_750, 3_646, 9_000] {
                let at = Instant::now() + Duration::from_micros(micros);
                timer.until(at).await;
                assert!(Instant::now() >= at, "{micros} us, lead {lead:?}");
            }
        }
    }

    #[tokio::test]
    async fn may_be_dropped_and_set_anew_either_way() {
        let mut timer = LineTimer::new();
        let start = Instant::now();
        let soon = start + Duration::from_millis(4);
        tokio::select! {
            biased;
            () = timer.until(start + Duration::from_secs(3600)) => panic!("an hour has not passed"),
            () = std::future::ready(()) => {}
        }
        timer.until(soon).await;
        assert!(Instant::now() >= soon);
        // What rang for the earlier setting is not taken for the later one.
        timer.set(soon);
        let later = Instant::now() + Duration::from_millis(3);
        timer.until(later).await;
        assert!(Instant::now() >= later);
    }

    #[tokio::test]
    async fn the_wheel_is_there_for_those_who_have_no_other() {
        let mut timer = LineTimer::new();
        timer.clock = Clock::wheel(Instant::now());
        let at = Instant::now() + Duration::from_millis(5);
        timer.until(at).await;
        assert!(Instant::now() >= at);
    }
}
