//! What a wire has counted since it was opened.

use std::collections::BTreeMap;
use std::time::Duration;

/// Everything a wire counts, as one consistent copy.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Statistics {
    /// Frames sent, each try of a read by itself.
    pub requests: u64,
    /// Answers that were ours, exceptions included.
    pub answers: u64,
    /// Requests that had no answer in time.
    pub timeouts: u64,
    /// Reads that were sent once more, after a time-out or a drop.
    pub retries: u64,
    /// Exceptions by code.
    pub exceptions: BTreeMap<u8, u64>,
    /// Well formed answers that came after their time was up.
    pub late: u64,
    /// Answers to our transaction from another unit.
    pub wrong_unit: u64,
    /// Answers to our transaction with another function.
    pub wrong_function: u64,
    /// Answers to our transaction with more or less data than was asked for.
    pub wrong_length: u64,
    /// Confirmations of another address, value or count than was written.
    pub wrong_echo: u64,
    /// Frames of another protocol than Modbus.
    pub wrong_protocol: u64,
    /// Frames with a bad checksum (RTU).
    pub crc_errors: u64,
    /// Bytes that belong to no frame.
    pub garbage_bytes: u64,
    /// Connections made after the first one.
    pub reconnects: u64,
    /// Bytes sent.
    pub bytes_sent: u64,
    /// Bytes received.
    pub bytes_received: u64,
    /// Polls of silent units that were answered at once, without a frame.
    pub held: u64,
    /// Own requests that a converter sent back, and that were taken out of what it sent.
    pub echoes: u64,
    /// Time from a request to its answer.
    pub latency: Latency,
    /// How long the wire has been open.
    pub open_for: Duration,
    /// How long bytes were on the line, both ways, by its speed; zero where that is not known, as on TCP.
    pub busy: Duration,
    /// How long answers were waited for, their own bytes not counted.
    pub waiting: Duration,
    /// The same by unit, in the order of their ids; those that were never asked are not among them.
    pub units: Vec<UnitStatistics>,
}

impl Statistics {
    /// Adds what was counted for a unit to the sums.
    pub(crate) fn add(&mut self, unit: UnitStatistics) {
        self.requests += unit.requests;
        self.answers += unit.answers;
        self.timeouts += unit.timeouts;
        self.retries += unit.retries;
        self.held += unit.held;
        self.bytes_sent += unit.bytes_sent;
        self.bytes_received += unit.bytes_received;
        self.waiting += unit.waiting;
        self.latency.add(&unit.latency);
        for (code, count) in &unit.exceptions {
            *self.exceptions.entry(*code).or_default() += count;
        }
        self.units.push(unit);
    }
}

/// What a wire has counted for one of its units.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct UnitStatistics {
    /// Its id.
    pub unit: u8,
    /// What it did when it was asked last.
    pub state: UnitState,
    /// Frames sent to it, each try of a read by itself.
    pub requests: u64,
    /// Its answers, exceptions included.
    pub answers: u64,
    /// Requests that it did not answer in time.
    pub timeouts: u64,
    /// Reads that were sent once more, after a time-out or a drop.
    pub retries: u64,
    /// Polls that were answered at once while it was silent, without a frame.
    pub held: u64,
    /// Its exceptions by code.
    pub exceptions: BTreeMap<u8, u64>,
    /// Frames with a bad checksum that came while its answer was due (RTU).
    pub crc_errors: u64,
    /// Bytes that belong to no frame and came while its answer was due (RTU).
    pub garbage_bytes: u64,
    /// Its frames that answered nothing any more.
    pub late: u64,
    /// Bytes sent to it.
    pub bytes_sent: u64,
    /// Bytes received while its answer was due.
    pub bytes_received: u64,
    /// Time from a request to its answer.
    pub latency: Latency,
    /// How long these bytes were on the line, by its speed; zero where that is not known, as on TCP.
    pub busy: Duration,
    /// How long its answers were waited for, their own bytes not counted.
    pub waiting: Duration,
}

/// What a unit did when it was asked last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum UnitState {
    /// It was not asked yet, or its first answer is still due.
    Unknown,
    /// It answered.
    Answering,
    /// It did not.
    Missing,
    /// It has not for several times, and is asked only now and then, so that the others keep their pace.
    Silent {
        /// How long until it is polled again; zero when the next poll goes through.
        next_probe: Duration,
    },
}

/// How long answers took.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Latency {
    // Nanoseconds: each unit of each wire has these.
    total: u64,
    min: u64,
    max: u64,
    buckets: [u64; Self::BOUNDS.len() + 1],
}

impl Latency {
    /// Upper bounds of the histogram's buckets, each inclusive; a last bucket has none.
    pub const BOUNDS: [Duration; 12] = [
        Duration::from_micros(100),
        Duration::from_micros(200),
        Duration::from_micros(500),
        Duration::from_millis(1),
        Duration::from_millis(2),
        Duration::from_millis(5),
        Duration::from_millis(10),
        Duration::from_millis(20),
        Duration::from_millis(50),
        Duration::from_millis(100),
        Duration::from_millis(200),
        Duration::from_millis(500),
    ];

    /// How many answers were measured.
    pub fn count(&self) -> u64 {
        self.buckets.iter().sum()
    }

    /// The shortest; none before the first answer.
    pub fn min(&self) -> Option<Duration> {
        (self.count() > 0).then_some(Duration::from_nanos(self.min))
    }

    /// All of them together.
    pub fn total(&self) -> Duration {
        Duration::from_nanos(self.total)
    }

    /// The mean; none before the first answer.
    pub fn mean(&self) -> Option<Duration> {
        self.total.checked_div(self.count()).map(Duration::from_nanos)
    }

    /// The longest; none before the first answer.
    pub fn max(&self) -> Option<Duration> {
        (self.count() > 0).then_some(Duration::from_nanos(self.max))
    }

    /// Answers a bucket, shortest first, with the bucket's upper bound.
    pub fn histogram(&self) -> impl Iterator<Item = (Option<Duration>, u64)> + '_ {
        let bounds = Self::BOUNDS.into_iter().map(Some).chain([None]);
        bounds.zip(self.buckets)
    }

    fn add(&mut self, other: &Self) {
        self.min = match (self.count(), other.count()) {
            (0, _) => other.min,
            (_, 0) => self.min,
            _ => self.min.min(other.min),
        };
        self.max = self.max.max(other.max);
        self.total = self.total.saturating_add(other.total);
        self.buckets.iter_mut().zip(other.buckets).for_each(|(bucket, count)| *bucket += count);
    }

    pub(crate) fn record(&mut self, latency: Duration) {
        let nanos = u64::try_from(latency.as_nanos()).unwrap_or(u64::MAX);
        self.min = match self.count() {
            0 => nanos,
            _ => self.min.min(nanos),
        };
        self.max = self.max.max(nanos);
        self.total = self.total.saturating_add(nanos);
        let bucket = Self::BOUNDS.partition_point(|bound| *bound < latency);
        self.buckets[bucket] += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_up_latency() {
        let mut latency = Latency::default();
        assert_eq!((latency.min(), latency.mean(), latency.max()), (None, None, None));

        for micros in [100, 101, 400, 600_000] {
            latency.record(Duration::from_micros(micros));
        }
        assert_eq!(latency.count(), 4);
        assert_eq!(latency.min(), Some(Duration::from_micros(100)));
        assert_eq!(latency.mean(), Some(Duration::from_nanos(150_150_250)));
        assert_eq!(latency.max(), Some(Duration::from_micros(600_000)));

        let filled: Vec<_> = latency.histogram().filter(|(_, count)| *count > 0).collect();
        assert_eq!(
            filled,
            [
                (Some(Duration::from_micros(100)), 1),
                (Some(Duration::from_micros(200)), 1),
                (Some(Duration::from_micros(500)), 1),
                (None, 1),
            ]
        );

        let mut sum = Latency::default();
        sum.add(&latency);
        sum.add(&Latency::default());
        assert_eq!(sum, latency);
        sum.add(&latency);
        assert_eq!((sum.count(), sum.min(), sum.mean()), (8, latency.min(), latency.mean()));
    }
}
