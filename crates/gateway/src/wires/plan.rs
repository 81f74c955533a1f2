//! What a device is polled with and what that takes of its wire, as the API shows it.

use busbar_link::Endpoint;
use busbar_profile::plan::{Cost, Read};

use super::line_cost;
use crate::api::types::{PlanView, PlannedRead, PlannedRound};
use crate::poll_plan::{self, Overview};
use crate::rates::Rates;
use crate::site::{Poll, SiteDevice};

pub(super) fn view(endpoint: &Endpoint, device: &SiteDevice, plan: &Overview) -> PlanView {
    let line =
        Line { is_tcp: matches!(endpoint, Endpoint::Tcp { .. }), cost: line_cost(endpoint, device.profile) };
    let spacing_ms = device.profile.wire.spacing_ms;
    let rounds: Vec<PlannedRound> = plan.rounds.iter().map(|round| line.round(round, device.poll)).collect();
    let pauses = |round: &PlannedRound| round.reads.len() as f64 * f64::from(spacing_ms);
    PlanView {
        device: device.id.clone(),
        unit: device.unit,
        spacing_ms,
        refresh_ms: rounds.last().and_then(|all| Some(tenths(all.ms? + pauses(all)))),
        load: load(&rounds),
        refused: plan.refused.iter().map(|read| line.read(*read, Rates::default())).collect(),
        rounds,
    }
}

/// A wire as plans are reckoned on it.
struct Line {
    is_tcp: bool,
    /// None where its speed is not known.
    cost: Option<Cost>,
}

impl Line {
    fn round(&self, round: &poll_plan::PlannedRound, poll: Poll) -> PlannedRound {
        let every = match round.rates.iter().last() {
            Some(busbar_profile::Rate::Fast) => Some(poll.fast),
            Some(busbar_profile::Rate::Slow) => Some(poll.slow),
            _ => None,
        };
        let reads: Vec<PlannedRead> =
            round.reads.iter().map(|(read, rates)| self.read(*read, *rates)).collect();
        let bare: Vec<Read> = round.reads.iter().map(|(read, _)| *read).collect();
        PlannedRound {
            rates: round.rates.iter().map(Into::into).collect(),
            every_s: every.map(|every| every.as_secs_f64()),
            characters: reads.iter().map(|read| read.characters).sum(),
            ms: self.cost.map(|cost| in_ms(cost.total(&bare))),
            reads,
        }
    }

    fn read(&self, read: Read, rates: Rates) -> PlannedRead {
        PlannedRead {
            function: read.function,
            address: read.address,
            count: read.count,
            rates: rates.iter().map(Into::into).collect(),
            characters: if self.is_tcp { read.tcp_bytes() } else { read.characters() },
            ms: self.cost.map(|cost| in_ms(cost.of(read.count))),
        }
    }
}

/// The share of the line's time that the rounds take. In the place of each round that comes more rarely there is one
/// less of those it stands in for.
fn load(rounds: &[PlannedRound]) -> Option<f64> {
    let mut share = 0.0;
    let mut before = 0.0;
    for round in rounds {
        let ms = round.ms?;
        if let Some(every) = round.every_s {
            share += (ms - before) / (every * 1_000.0);
            before = ms;
        }
    }
    Some((share * 10_000.0).round() / 10_000.0)
}

fn in_ms(nanoseconds: u64) -> f64 {
    tenths(nanoseconds as f64 / 1e6)
}

fn tenths(ms: f64) -> f64 {
    (ms * 10.0).round() / 10.0
}

#[cfg(test)]
mod tests {
    use busbar_profile::builtin;

    use super::*;
    use crate::poll_plan::PollPlan;
    use crate::testing::site_device;
    use crate::wires;

    fn shown(endpoint: &str, profile: &str, poll: Poll) -> PlanView {
        let endpoint: Endpoint = endpoint.parse().unwrap();
        let profile = builtin(profile).unwrap();
        let plan = PollPlan::new(profile, wires::cost(&endpoint, profile)).overview();
        view(&endpoint, &SiteDevice { profile, poll, ..site_device("dkg") }, &plan)
    }

    #[test]
    fn a_serial_plan_has_its_times() {
        let plan = shown("rtu:///dev/a", "datakom-dkg705", Poll::default());
        let all = plan.rounds.last().unwrap();
        // 13 characters and two a register at 960 a second, 4.3 ms before the answer, 3.65 ms behind it.
        let read = &all.reads[0];
        let expected = (13.0 + 2.0 * f64::from(read.count)) * 10.0 / 9.6 + 4.3 + 3.645_833;
        assert!((read.ms.unwrap() - expected).abs() < 0.1, "{read:?}: {expected}");
        assert_eq!(read.characters, 13 + 2 * u64::from(read.count));
        assert_eq!(all.characters, all.reads.iter().map(|read| read.characters).sum::<u64>());
        assert_eq!(plan.refresh_ms, all.ms);
        let load = plan.load.unwrap();
        let fast = plan.rounds[0].ms.unwrap() / 1_000.0;
        assert!(load >= fast && load < 1.0, "{load} of {fast}");
    }

    #[test]
    fn pauses_count_towards_a_refresh_and_not_towards_the_load() {
        let plan = shown("rtu:///dev/a", "smartgen-acc1700", Poll::default());
        let all = plan.rounds.last().unwrap();
        assert_eq!(plan.spacing_ms, 500);
        let pauses = 500.0 * all.reads.len() as f64;
        assert!((plan.refresh_ms.unwrap() - all.ms.unwrap() - pauses).abs() < 0.1);
        assert!(plan.load.unwrap() < 1.0);
    }

    #[test]
    fn over_tcp_bytes_are_counted_and_no_times_are_claimed() {
        let plan = shown("tcp://192.0.2.7", "datakom-d", Poll::default());
        assert_eq!((plan.refresh_ms, plan.load), (None, None));
        let read = &plan.rounds[0].reads[0];
        assert_eq!((read.ms, read.characters), (None, 21 + 2 * u64::from(read.count)));
        let tunnelled = shown("rtu+tcp://192.0.2.7", "datakom-d", Poll::default());
        let read = &tunnelled.rounds[0].reads[0];
        assert_eq!((read.ms, read.characters), (None, 13 + 2 * u64::from(read.count)));
    }

    #[test]
    fn the_rounds_say_how_often_they_come() {
        let poll = Poll { fast: std::time::Duration::from_millis(500), ..Poll::default() };
        let plan = shown("rtu:///dev/a", "datakom-d", poll);
        let every: Vec<Option<f64>> = plan.rounds.iter().map(|round| round.every_s).collect();
        assert_eq!(every, [Some(0.5), Some(10.0), None]);
    }
}
