//! When a wire wakes by itself: a timer that is cheap, or one that is precise.

use std::future::Future;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use tokio::time::{Instant, Sleep, sleep_until};

use crate::timer::LineTimer;

/// How long it may take the system to wake us, which on a serial line is waited out instead.
const LEAD: Duration = Duration::from_micros(80);

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
    /// To some microseconds, where the system can: a silence of 3.65 ms must not become 5.
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
    Line(Box<LineTimer>),
}

impl Timer {
    fn new(precision: Precision, at: Instant) -> Self {
        match precision {
            Precision::Coarse => Self::Wheel(Box::pin(sleep_until(at))),
            Precision::Fine => Self::Line(Box::new(LineTimer::new().with_lead(LEAD))),
        }
    }

    fn set(&mut self, at: Instant) {
        match self {
            Self::Wheel(sleep) => sleep.as_mut().reset(at),
            Self::Line(timer) => timer.set(at.into_std()),
        }
    }

    fn poll(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        match self {
            Self::Wheel(sleep) => sleep.as_mut().poll(cx),
            Self::Line(timer) => timer.poll(cx),
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
