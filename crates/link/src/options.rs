//! How a wire behaves: time-outs, retries, back-off.

use std::time::Duration;

use crate::trace::Trace;

/// How a wire behaves. The defaults suit a controller on a local network.
#[derive(Clone, Debug)]
pub struct Options {
    /// How long an attempt to connect to one address may take. A host name may have several, and each is tried so long;
    /// to look them up may take as long again.
    pub connect_timeout: Duration,
    /// How long each try of a request waits for its answer at most. Writes, the first requests to a unit and
    /// second tries wait so long; other reads wait as the unit's measured latency suggests.
    pub timeout: Duration,
    /// The shortest that a read waits for its answer, however fast the unit is. From `timeout` on, latency changes
    /// nothing.
    pub timeout_floor: Duration,
    /// Least time between the end of one exchange and the next request, whichever unit it is for. For the pause that
    /// one unit wants, see [`Link::with_spacing`](crate::Link::with_spacing).
    pub spacing: Duration,
    /// How often a read is sent again after a time-out or a drop. A unit that did not answer last time gets one try
    /// while others on the wire answer. Writes are never sent again.
    pub retries: u8,
    /// Most requests that may wait in each class of priority.
    pub queue: usize,
    /// After so many time-outs in a row the connection is taken for dead and made anew, unless a unit that may still
    /// answer was not asked among them, and not before as many whole time-outs have passed. A serial line is no connection, and is never taken for dead.
    pub timeouts_to_drop: u32,
    /// How long to wait before a connection that failed is tried again, or one that dropped before it had proved good.
    pub backoff: Backoff,
    /// How long a unit that is silent is left alone between two polls, while others on the wire answer.
    pub probes: Backoff,
    /// Sees every frame, both ways. [`Link::trace`](crate::Link::trace) changes it later.
    pub trace: Option<Trace>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            connect_timeout: Duration::from_secs(3),
            timeout: Duration::from_secs(1),
            // SmartGen asks for more than 200 ms; the time of the characters comes on top.
            timeout_floor: Duration::from_millis(200),
            spacing: Duration::ZERO,
            retries: 1,
            queue: 64,
            timeouts_to_drop: 3,
            backoff: Backoff::default(),
            probes: Backoff { first: Duration::from_secs(1), max: Duration::from_secs(30) },
            trace: None,
        }
    }
}

/// A wait that doubles with each failure, up to a limit. It has no jitter: each wire is one client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Backoff {
    /// After the first failure.
    pub first: Duration,
    /// The longest.
    pub max: Duration,
}

impl Backoff {
    /// The wait after so many failures in a row.
    pub fn delay(self, failures: u32) -> Duration {
        let doubled = 2_u32.saturating_pow(failures.saturating_sub(1));
        self.first.saturating_mul(doubled).min(self.max)
    }
}

/// From 0.2 s to 10 s.
impl Default for Backoff {
    fn default() -> Self {
        Self { first: Duration::from_millis(200), max: Duration::from_secs(10) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backs_off_by_doubling() {
        let delays: Vec<_> =
            [0, 1, 2, 3, 6, 7, 40].map(|failures| Backoff::default().delay(failures).as_millis()).into();
        assert_eq!(delays, [200, 200, 400, 800, 6400, 10_000, 10_000]);
    }
}
