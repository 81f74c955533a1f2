//! Whatever happens at the site and whichever keys are pressed: what must hold at every moment, and how it ends.

use std::collections::BTreeSet;
use std::time::Duration;

use busbar_profile::builtin;

use super::DatakomDkg705;
use super::levers;
use crate::bank::Bank;
use crate::levers::{Lever, Position};
use crate::panel::Panel;
use crate::random::Random;
use crate::settings::Settings;

const TENTH: Duration = Duration::from_millis(100);
const KEYS: [u16; 4] = [0x10, 0x20, 0x40, 0x80];
const AUTO: u16 = KEYS[0];
const PARALLEL: [u16; 4] = [6, 10, 14, 15];

struct Bench {
    unit: DatakomDkg705,
    bank: Bank,
    random: Random,
    seed: u64,
    /// Statuses that were seen.
    seen: BTreeSet<u16>,
}

impl Bench {
    fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let profile = builtin("datakom-dkg705").unwrap();
        let mut settings = Settings::of(profile);
        for id in
            ["no_break_transfer", "soft_transfer", "peak_lopping", "emergency_backup", "governor_control"]
        {
            settings.set(id, if random.between(0.0, 1.0) < 0.7 { "1" } else { "0" }).unwrap();
        }
        // So that it comes to peak lopping at the load of this site.
        settings.set("peak_lopping_start", "38").unwrap();
        settings.set("peak_lopping_stop", "20").unwrap();
        let unit = DatakomDkg705::new(seed, false, &settings);
        Self { unit, bank: Bank::new(profile), random, seed, seen: BTreeSet::new() }
    }

    fn below(&mut self, count: usize) -> usize {
        self.random.between(0.0, count as f64) as usize
    }

    /// Pulls a lever somewhere, or presses a key.
    fn act(&mut self) {
        if self.random.between(0.0, 1.0) < 0.3 {
            let key = KEYS[self.below(KEYS.len())];
            self.unit.write(0x0040, key);
            return;
        }
        let lever = levers::all()[self.below(levers::all().len())];
        // Most of the time things are as they should be.
        let to = match (self.random.between(0.0, 1.0) < 0.5).then(|| healthy(&lever)).flatten() {
            Some(position) => position,
            None => self.position(&lever),
        };
        self.unit.pull(lever.id, to);
    }

    fn position(&mut self, lever: &Lever) -> Position {
        let numbers = lever.numbers.filter(|_| lever.words.is_empty() || self.random.between(0.0, 1.0) < 0.5);
        match numbers {
            Some(numbers) => Position::Number(self.random.between(numbers.min, numbers.max)),
            None => Position::Word(lever.words[self.below(lever.words.len())].id),
        }
    }

    fn pass(&mut self, tenths: usize) {
        for _ in 0..tenths {
            self.unit.step(TENTH);
            self.seen.insert(self.status());
            self.holds();
        }
        self.unit.render(&mut self.bank);
        self.agrees();
    }

    fn status(&self) -> u16 {
        self.unit.sequence.operation().code()
    }

    fn place(&self) -> String {
        format!("seed {}, {:.1} s, status {}", self.seed, self.unit.plant.time, self.status())
    }

    fn holds(&self) {
        let (unit, controls) = (&self.unit, &self.unit.controls);
        assert!(!unit.plant.is_jolting(), "{}: joined out of step", self.place());
        let both = controls.genset_breaker && controls.mains_breaker;
        assert!(!both || PARALLEL.contains(&self.status()), "{}: both contactors", self.place());
        assert!(
            !controls.starter || !unit.plant.engine.is_running() || self.status() == 3,
            "{}",
            self.place()
        );
        if unit.is_locked() {
            assert!(!controls.genset_breaker && !controls.starter, "{}: a locked genset", self.place());
            assert!(!controls.fuel || !unit.alarms.shutdown(), "{}: fuel in a shutdown", self.place());
        }
    }

    /// What any client can check in one image.
    fn agrees(&self) {
        let of = |address: u16| self.bank.number_shown(address).unwrap();
        for (volts, lines, active, apparent, reactive) in
            [(0x0000, 0x000C, 0x001D, 0x0020, 0x0022), (0x0003, 0x000F, 0x0016, 0x0019, 0x001B)]
        {
            let (p, q, s) = (of(active), of(reactive), of(apparent));
            assert!((s - p.hypot(q)).abs() < 0.011, "{}: {p} {q} {s}", self.place());
            let phase = [0, 1, 2].map(|n| of(volts + n));
            for (n, (a, b)) in (0..).zip([(0, 1), (1, 2), (2, 0)]) {
                let (a, b) = (phase[a], phase[b]);
                let expected = (a * a + b * b + a * b).sqrt();
                assert!((of(lines + n) - expected).abs() < 0.2, "{}: {phase:?}", self.place());
            }
        }
        assert!((of(0x002A) / 30.0 - of(0x0013)).abs() < 0.07, "{}: rpm and frequency", self.place());
        assert_eq!(self.bank.refused(), 0, "{}: a value that fits nowhere", self.place());
    }
}

fn healthy(lever: &Lever) -> Option<Position> {
    match lever.id {
        "tank" => Some(Position::Number(80.0)),
        "service.hours" | "service.days" => Some(Position::Number(0.0)),
        _ => lever.words.first().map(|word| Position::Word(word.id)),
    }
}

#[test]
fn the_unit_holds_what_must_hold_and_comes_home() {
    let mut seen = BTreeSet::new();
    for seed in 0..40 {
        let mut bench = Bench::new(seed);
        for _ in 0..40 {
            bench.act();
            let tenths = 1 + bench.below(150);
            bench.pass(tenths);
        }
        for lever in levers::all() {
            bench.unit.pull(lever.id, healthy(lever).unwrap());
        }
        // What is still so, as a hot engine, comes back and is acknowledged again.
        let home = (0..60).any(|_| {
            if bench.unit.is_locked() || bench.unit.mode != super::Mode::Auto {
                bench.unit.write(0x0040, AUTO);
            }
            bench.pass(300);
            let plant = &bench.unit.plant;
            let peak = bench.status() == 15 && bench.unit.peak.lopping;
            let rests = bench.status() == 0 && plant.engine.speed == 0.0;
            (rests || peak) && plant.mains_breaker.closed && !bench.unit.is_locked()
        });
        assert!(home, "{}: {:?}", bench.place(), bench.unit.alarms.words());
        seen.append(&mut bench.seen);
    }
    assert_eq!(seen, (0..16).collect(), "it came everywhere");
}
