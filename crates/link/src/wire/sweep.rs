//! The price of a line: how long a round of polls takes on each, with more units, and with dead ones among them.

use std::fmt::Write as _;

use super::sim::*;
use super::*;
use crate::endpoint::Serial;

/// Registers a read, as Datakom controllers have them at most.
const REGISTERS: u16 = 16;
const MINUTES: u64 = 10;

struct Place {
    name: &'static str,
    line: Line,
    medium: fn() -> Medium,
    timeout: Duration,
    /// What devices take to answer, beside the line.
    reaction: [Duration; 2],
}

fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

fn places() -> [Place; 3] {
    [
        Place {
            name: "RTU, 9600 8N1",
            line: Line::rtu(&Serial::default()),
            medium: || Medium::Line { character: Line::rtu(&Serial::default()).character },
            timeout: ms(1000),
            reaction: [ms(5), ms(15)],
        },
        Place {
            name: "TCP, 85 kbit/s, 600 ms, 5 % lost",
            line: Line::tcp(),
            medium: || Medium::Network {
                trip: ms(300),
                byte: Duration::from_nanos(8 * 1_000_000_000 / 85_000),
                lost_per_mille: 50,
                // What the peer's TCP waits before it sends once more.
                again: ms(900),
            },
            timeout: ms(3000),
            reaction: [ms(1), ms(1)],
        },
        Place {
            name: "TCP, Ethernet, 0.3 ms",
            line: Line::tcp(),
            medium: || Medium::Network {
                trip: Duration::from_micros(100),
                byte: Duration::ZERO,
                lost_per_mille: 0,
                again: Duration::ZERO,
            },
            timeout: ms(1000),
            reaction: [Duration::from_micros(100); 2],
        },
    ]
}

/// What became of the units that live.
struct Rounds {
    /// How long each round took.
    took: Vec<Duration>,
    answers: u64,
    failed: u64,
    statistics: Statistics,
}

/// Polls every living unit once a round, and a dead one whenever it may be. A round begins each `interval`, or when the
/// one before is over.
fn rounds(place: &Place, units: u8, dead: u8, interval: Duration) -> Rounds {
    let [least, most] = place.reaction;
    // The last ones are dead.
    let living = units - dead;
    let device = move |chance: &mut Chance, unit: u8| Fate {
        answers: (unit <= living).then(|| chance.between(least, most)),
        repeats: None,
    };
    let options = Options { timeout: place.timeout, ..Options::default() };
    let mut sim = Sim::new(place.line, &options, (place.medium)(), 7, device);
    let mut tickets: Vec<Option<Ticket>> = (0..units).map(|_| None).collect();
    let (mut took, mut answers, mut failed) = (Vec::new(), 0, 0);
    let mut began: Option<Duration> = None;
    let mut next = Duration::ZERO;
    let mut due = 0;
    while sim.now < Duration::from_secs(60 * MINUTES) {
        for (unit, ticket) in (1..).zip(&mut tickets) {
            let Some(outcome) = ticket.as_ref().and_then(|ticket| sim.outcome(ticket)) else { continue };
            *ticket = None;
            if unit <= living {
                due -= 1;
                answers += u64::from(outcome.result.is_ok());
                failed += u64::from(outcome.result.is_err());
            }
        }
        if due == 0
            && let Some(began) = began.take()
        {
            took.push(sim.now - began);
        }
        let new_round = began.is_none() && sim.now >= next;
        if new_round {
            (began, next) = (Some(sim.now), sim.now + interval);
        }
        for (unit, ticket) in (1..).zip(&mut tickets) {
            if ticket.is_none() && (unit > living || new_round) {
                *ticket = sim.submit(poll(unit, 0, REGISTERS, place.timeout)).ok();
                due += u64::from(unit <= living && ticket.is_some());
            }
        }
        let limit = if began.is_none() { next } else { sim.now + ms(100) };
        sim.advance(limit.min(sim.now + ms(100)));
    }
    Rounds { took, answers, failed, statistics: sim.wire.statistics(sim.now) }
}

/// Mean and longest round in milliseconds.
fn cell(place: &Place, units: u8, dead: u8) -> String {
    if dead >= units {
        return "-".to_owned();
    }
    let Rounds { took, failed, .. } = rounds(place, units, dead, ms(750));
    let mean = took.iter().sum::<Duration>() / u32::try_from(took.len()).unwrap();
    let longest = took.iter().max().copied().unwrap_or_default();
    let millis = |time: Duration| time.as_secs_f64() * 1000.0;
    let failed = if failed == 0 { String::new() } else { format!(" ({failed} failed)") };
    format!("{:.1} / {:.1}{failed}", millis(mean), millis(longest))
}

#[test]
fn a_round_of_polls_takes_what_the_line_takes() {
    let mut table = String::from(
        "Mean and longest round in ms, 16 registers a unit, ten minutes, a round each 750 ms at most\n",
    );
    for place in places() {
        writeln!(table, "\n{:34}{:>32}{:>32}{:>32}", place.name, "all alive", "1 dead", "4 dead").unwrap();
        for units in [1, 8, 32] {
            let name = format!("  {units} unit{}", if units == 1 { "" } else { "s" });
            write!(table, "{name:34}").unwrap();
            for dead in [0, 1, 4] {
                write!(table, "{:>32}", cell(&place, units, dead)).unwrap();
            }
            table.push('\n');
        }
    }
    assert!(
        table == include_str!("sweep.txt"),
        "no longer as crates/link/src/wire/sweep.txt has it:\n{table}"
    );
}

#[test]
fn one_dead_unit_among_eight_costs_the_others_no_more_than_its_slots() {
    let [serial, _, ethernet] = places();
    for place in [serial, ethernet] {
        // As fast as it goes on the serial line; on Ethernet twenty rounds a second.
        let interval = if place.line.is_rtu() { Duration::ZERO } else { ms(50) };
        let alone = rounds(&place, 7, 0, interval).answers;
        let beside = rounds(&place, 8, 1, interval);
        let dead = beside.statistics.units.last().unwrap();
        assert_eq!((dead.unit, dead.answers, beside.failed), (8, 0, 0), "{}", place.name);
        let slots = (dead.busy + dead.waiting).as_secs_f64() / beside.statistics.open_for.as_secs_f64();
        let lost = 1.0 - beside.answers as f64 / alone as f64;
        assert!(lost - slots < 0.02, "{}: {lost} lost, {slots} in slots", place.name);
        // The slots themselves are few: three time-outs to fall silent, and then 1, 2, 4, 8, 16, 30, 30 ... s.
        assert!(
            slots < 0.015 && dead.requests <= 3 + 5 + MINUTES * 2,
            "{}: {slots}, {}",
            place.name,
            dead.requests
        );
    }
}
