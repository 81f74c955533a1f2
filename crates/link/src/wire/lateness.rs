//! A million exchanges with answers that are late, doubled or lost: nobody is given the answer to another question.

use super::sim::*;
use super::*;

const UNITS: u8 = 6;
const CALLERS: usize = 12;
const TIMEOUT: Duration = Duration::from_millis(100);

/// What a caller asked.
enum Asked {
    Read { unit: u8, address: u16, count: u16 },
    Write(u16),
}

/// What came of it.
#[derive(Debug, Default, PartialEq, Eq)]
struct Tally {
    wrong: u64,
    right: u64,
    /// Writes that were called done, and were not.
    untrue: u64,
}

fn play(line: Line, medium: Medium, exchanges: u64) -> (Tally, Statistics) {
    let is_rtu = line.is_rtu();
    let options = Options { timeout_floor: TIMEOUT / 5, ..Options::default() };
    let device = move |chance: &mut Chance, _: u8| Fate {
        answers: match chance.below(100) {
            0..2 => None,
            // Late by up to twice the time-out.
            2..12 => Some(chance.between(Duration::ZERO, TIMEOUT * 3)),
            _ => Some(chance.between(Duration::from_millis(1), Duration::from_millis(8))),
        },
        // On a line nothing tells a copy from an answer but that it comes at once; over TCP it may come any time.
        repeats: chance.happens(30).then(|| match is_rtu {
            true => Duration::ZERO,
            false => chance.between(Duration::ZERO, TIMEOUT * 3),
        }),
    };
    let mut sim = Sim::new(line, &options, medium, 4, device);
    let mut callers: Vec<Option<(Ticket, Asked)>> = (0..CALLERS).map(|_| None).collect();
    let mut tally = Tally::default();
    let mut value: u16 = 0;
    while sim.wire.started < exchanges {
        for caller in &mut callers {
            if let Some((ticket, asked)) = caller {
                let Some(outcome) = sim.outcome(ticket) else { continue };
                judge(&mut tally, asked, &outcome, &sim.written);
            }
            let unit = 1 + u8::try_from(sim.chance.below(UNITS.into())).unwrap();
            let (job, asked) = if sim.chance.happens(20) {
                value = value.wrapping_add(1);
                (command(unit, 7, value, TIMEOUT), Asked::Write(value))
            } else {
                // Few lengths, so that many questions look alike.
                let count = 1 + u16::try_from(sim.chance.below(2)).unwrap();
                let address = u16::try_from(sim.chance.below(200)).unwrap();
                (poll(unit, address, count, TIMEOUT), Asked::Read { unit, address, count })
            };
            *caller = sim.submit(job).ok().map(|ticket| (ticket, asked));
        }
        let recent = sim.written.len().saturating_sub(1000);
        if recent > 1000 {
            sim.written.drain(..recent);
        }
        // Those who were refused try again soon.
        let limit = sim.now + Duration::from_millis(50);
        sim.advance(limit);
    }
    (tally, sim.wire.statistics(sim.now))
}

fn judge(tally: &mut Tally, asked: &Asked, outcome: &Outcome, written: &[u16]) {
    if outcome.result.is_err() {
        return;
    }
    match *asked {
        Asked::Read { unit, address, count } => {
            let expected = (address..address + count).map(|address| register(unit, address));
            match outcome.registers.iter().copied().eq(expected) {
                true => tally.right += 1,
                false => tally.wrong += 1,
            }
        }
        Asked::Write(value) if written.contains(&value) => tally.right += 1,
        Asked::Write(_) => tally.untrue += 1,
    }
}

fn check(name: &str, line: Line, medium: Medium) {
    const EXCHANGES: u64 = 500_000;
    let (tally, seen) = play(line, medium, EXCHANGES);
    assert_eq!((tally.wrong, tally.untrue), (0, 0), "{name}: {tally:?}");
    // It was worth playing: much was late and much was right.
    assert!(
        tally.right > EXCHANGES / 2 && seen.late > EXCHANGES / 50,
        "{name}: {tally:?}, {} late",
        seen.late
    );
    assert!(seen.timeouts > EXCHANGES / 20 && seen.held > 0, "{name}: {} time-outs", seen.timeouts);
}

#[test]
fn a_late_answer_is_nobody_elses_on_a_serial_line() {
    // Fast, so that time-outs and lateness are long beside it.
    let character = Duration::from_nanos(86_806);
    let line = Line { framing: busbar_modbus::Framing::Rtu, character, silence: Duration::from_micros(1750) };
    check("serial", line, Medium::Line { character });
}

#[test]
fn a_late_answer_is_nobody_elses_over_tcp() {
    let trip = Duration::from_micros(150);
    let medium = Medium::Network { trip, byte: Duration::ZERO, lost_per_mille: 0, again: Duration::ZERO };
    check("TCP", Line::tcp(), medium);
}
