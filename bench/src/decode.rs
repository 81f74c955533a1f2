//! Decode, encode and plan: nanoseconds a point through a profile, beside the same arithmetic in plain Rust.

use std::error::Error;
use std::hint::black_box;
use std::time::{Duration, Instant};

use busbar_profile::plan::{Cost, Planner};
use busbar_profile::{Access, Image, Point, Profile, Value, builtin};

/// Each figure is the least of this many rounds: what the code takes when nothing else has the processor.
const ROUNDS: usize = 25;
const REPEATS: usize = 200;

/// Prints the table.
pub(crate) fn run() -> Result<(), Box<dyn Error>> {
    let profile = builtin("datakom-d").ok_or("the built-in profile datakom-d is missing")?;
    let registers: Vec<u16> = (0..=u16::MAX).map(|address| address.wrapping_mul(40_503) >> 3).collect();
    let numeric: Vec<&Point> = readable(profile).filter(|point| is_number(point, &registers)).collect();
    let all: Vec<&Point> = readable(profile).collect();

    println!("Through the profile datakom-d, the least of {ROUNDS} rounds");
    let by_hand = each(numeric.len(), || plain(&numeric, &registers));
    row("decode a number, plain Rust", by_hand, "ns a point", None);
    let number = each(numeric.len(), || numbers(profile, &numeric, &registers));
    row("decode a number, with scale and quality", number, "ns a point", Some("3"));
    let image = each(1, || decode(profile, &all, &registers));
    row("decode a whole image, arrays and display", image / 1_000.0, "us", Some("2"));
    row("encode a number", encode(profile, &numeric, &registers), "ns a point", Some("3"));
    row("store 16 unchanged registers", store(profile, &registers), "ns", None);
    row("plan 10,000 points", plan() / 1_000_000.0, "ms", Some("10"));
    Ok(())
}

fn row(what: &str, figure: f64, unit: &str, target: Option<&str>) {
    let target = target.map(|target| format!("   (target {target})")).unwrap_or_default();
    println!("  {what:<44}{figure:>8.2} {unit}{target}");
}

fn readable(profile: &Profile) -> impl Iterator<Item = &Point> {
    profile.points.iter().filter(|point| point.access != Access::Write)
}

fn is_number(point: &Point, registers: &[u16]) -> bool {
    let value = point.decode(of(point, registers), busbar_profile::WordOrder::LowFirst).value;
    matches!(value, Some(Value::Number(_)))
}

fn of<'a>(point: &Point, registers: &'a [u16]) -> &'a [u16] {
    let from = usize::from(point.address);
    &registers[from..from + usize::from(point.registers)]
}

/// Nanoseconds of one of the `count` things that `work` does.
fn each(count: usize, mut work: impl FnMut()) -> f64 {
    let mut least = Duration::MAX;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        for _ in 0..REPEATS {
            work();
        }
        least = least.min(start.elapsed());
    }
    least.as_secs_f64() * 1e9 / (REPEATS * count) as f64
}

/// What the profile does, with everything known beforehand: two registers to a number divided by its coefficient.
fn plain(points: &[&Point], registers: &[u16]) {
    for point in points {
        let raw = match *of(point, registers) {
            [low, high] => u32::from(high) << 16 | u32::from(low),
            [word] => u32::from(word),
            _ => 0,
        };
        black_box(f64::from(raw) / 10.0);
    }
}

/// What a reader of numbers takes from a reading: the exact number and its quality.
fn numbers(profile: &Profile, points: &[&Point], registers: &[u16]) {
    for point in points {
        let decoded = point.decode(of(point, registers), profile.wire.word_order);
        if let Some(Value::Number(number)) = decoded.value {
            black_box(number);
        }
        black_box(decoded.quality);
    }
}

fn decode(profile: &Profile, points: &[&Point], registers: &[u16]) {
    for point in points {
        black_box(&point.decode(of(point, registers), profile.wire.word_order));
    }
}

fn encode(profile: &Profile, points: &[&Point], registers: &[u16]) -> f64 {
    let order = profile.wire.word_order;
    let values: Vec<(&Point, Value)> = points
        .iter()
        .filter_map(|point| Some((*point, point.decode(of(point, registers), order).value?)))
        .collect();
    let mut written = [0; 2];
    each(values.len(), || {
        for (point, value) in &values {
            let room = &mut written[..usize::from(point.registers)];
            let _ = black_box(point.encode(value, order, room));
        }
    })
}

fn store(profile: &Profile, registers: &[u16]) -> f64 {
    let mut image = Image::new(profile);
    let mut changed = Vec::new();
    let address = 10_240;
    let window = &registers[usize::from(address)..usize::from(address) + 16];
    each(1, || {
        changed.clear();
        image.store(address, window, &mut changed);
        black_box(&changed);
    })
}

/// Nanoseconds for a plan of 10,000 points of one or two registers with holes between them.
fn plan() -> f64 {
    let planner = Planner::over(&[(0, 49_999)], 120, Cost::rtu(9_600, 10, Duration::ZERO));
    let items: Vec<(u16, u16)> =
        (0..10_000_u16).map(|index| (index * 5 - index % 3, 1 + index % 2)).collect();
    let mut least = Duration::MAX;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        black_box(planner.reads(items.iter().copied()));
        least = least.min(start.elapsed());
    }
    least.as_secs_f64() * 1e9
}
