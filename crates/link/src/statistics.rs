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
    /// Our own requests that the adapter or converter sent back (RTU).
    pub echoes: u64,
    /// Connections made after the first one.
    pub reconnects: u64,
    /// Bytes sent.
    pub bytes_sent: u64,
    /// Bytes received.
    pub bytes_received: u64,
    /// Time from a request to its answer.
    pub latency: Latency,
}

/// How long answers took.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Latency {
    count: u64,
    total: Duration,
    min: Duration,
    max: Duration,
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
        self.count
    }

    /// The shortest; none before the first answer.
    pub fn min(&self) -> Option<Duration> {
        (self.count > 0).then_some(self.min)
    }

    /// The mean; none before the first answer.
    pub fn mean(&self) -> Option<Duration> {
        let nanos = self.total.as_nanos().checked_div(u128::from(self.count))?;
        Some(Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX)))
    }

    /// The longest; none before the first answer.
    pub fn max(&self) -> Option<Duration> {
        (self.count > 0).then_some(self.max)
    }

    /// Answers a bucket, shortest first, with the bucket's upper bound.
    pub fn histogram(&self) -> impl Iterator<Item = (Option<Duration>, u64)> + '_ {
        let bounds = Self::BOUNDS.into_iter().map(Some).chain([None]);
        bounds.zip(self.buckets)
    }

    pub(crate) fn record(&mut self, latency: Duration) {
        self.min = match self.count {
            0 => latency,
            _ => self.min.min(latency),
        };
        self.max = self.max.max(latency);
        self.total += latency;
        self.count += 1;
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
    }
}
