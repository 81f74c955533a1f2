//! `busbar plan`: the reads that would be sent, and what they cost.

use busbar_link::{Endpoint, Serial};
use busbar_profile::{
    Number, Point, Profile,
    plan::{Planner, Read, items},
};
use serde::{Serialize, Serializer};

use crate::{
    args,
    failure::Failure,
    profiles,
    table::{Align, Cell, Table},
    terminal, wire,
};

/// The plan as `--json` prints it. Over a network nothing but the bytes is known beforehand: the times are null.
#[derive(Serialize)]
struct Plan {
    requests: Vec<Request>,
    characters: u64,
    baud: Option<u32>,
    wire_ms: Option<Time>,
    best_ms: Option<Time>,
    refresh_ms: Option<Time>,
}

#[derive(Serialize)]
struct Request {
    function: u8,
    address: u16,
    count: u16,
}

pub(crate) fn run(args: &args::Plan, json: bool) -> Result<(), Failure> {
    let profile = profiles::resolve(&args.key)?;
    let points = points(&profile, args)?;
    let endpoint = args.endpoint.clone().unwrap_or_else(usual_line);
    let cost = wire::cost(&endpoint, &profile);
    let planner = Planner::new(&profile, cost);
    let reads = planner.reads(items(&profile, &points));
    let serial = match &endpoint {
        Endpoint::Rtu { serial, .. } => Some(serial),
        _ => None,
    };
    let wire = cost.total(&reads);
    let spacing = u64::from(profile.wire.spacing_ms) * 1_000_000 * reads.len() as u64;
    let plan = Plan {
        requests: reads
            .iter()
            .map(|read| Request { function: read.function, address: read.address, count: read.count })
            .collect(),
        characters: reads.iter().map(|read| characters(&endpoint, *read)).sum(),
        baud: serial.map(|serial| serial.baud),
        wire_ms: serial.map(|_| Time(wire)),
        best_ms: serial.map(|_| Time(planner.least(items(&profile, &points)))),
        refresh_ms: serial.map(|_| Time(wire.saturating_add(spacing))),
    };
    if json {
        return Ok(terminal::print_json(&plan)?);
    }
    let times = |read: &Read| serial.map(|_| Time(cost.of(read.count)));
    let text = table(&profile, &points, &reads, times) + "\n" + &totals(&profile, &endpoint, &plan);
    Ok(terminal::print(&text)?)
}

/// The points asked for as indexes in address order; all readable ones but image and trace when none is named.
fn points(profile: &Profile, args: &args::Plan) -> Result<Vec<usize>, Failure> {
    if !args.points.is_empty() {
        return profiles::points(profile, &args.points, &args.key);
    }
    let polled = |point: &Point| point.access.is_readable() && !point.data_type.is_bulk();
    let points = profile.points.iter().enumerate().filter(|(_, point)| polled(point));
    Ok(points.map(|(index, _)| index).collect())
}

/// The line that every controller of this kind has: 9600 8N1.
fn usual_line() -> Endpoint {
    Endpoint::Rtu { path: String::new(), serial: Serial::default() }
}

/// Characters on a serial line, bytes on a network, of a request and its answer.
fn characters(endpoint: &Endpoint, read: Read) -> u64 {
    match endpoint {
        // A converter passes RTU frames through.
        Endpoint::Rtu { .. } | Endpoint::RtuTcp { .. } => read.characters(),
        _ => read.tcp_bytes(),
    }
}

/// Each request and what it brings of the points asked for.
fn table(
    profile: &Profile,
    points: &[usize],
    reads: &[Read],
    time: impl Fn(&Read) -> Option<Time>,
) -> String {
    let mut table = Table::new([
        ("FUNCTION", Align::Right),
        ("ADDRESS", Align::Right),
        ("COUNT", Align::Right),
        ("MS", Align::Right),
        ("POINTS", Align::Right),
        ("BRINGS", Align::Left),
    ])
    .optional(&["FUNCTION"]);
    for read in reads {
        let brought: Vec<&Point> = points
            .iter()
            .filter_map(|index| profile.points.get(*index))
            .filter(|point| point.address <= read.address + (read.count - 1) && point.last() >= read.address)
            .collect();
        let brings = match brought.as_slice() {
            [] => String::new(),
            [point] if !read.covers(point.address, point.registers) => format!("a part of {}", point.id),
            [point] => point.id.clone(),
            [first, .., last] => format!("{} to {}", first.id, last.id),
        };
        table.row([
            read.function.to_string().into(),
            read.address.to_string().into(),
            read.count.to_string().into(),
            time(read).map(|time| time.tenths()).unwrap_or_default().into(),
            brought.len().to_string().into(),
            Cell::dim(brings),
        ]);
    }
    table.render(terminal::style(), terminal::width())
}

/// What all requests take together.
fn totals(profile: &Profile, endpoint: &Endpoint, plan: &Plan) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| text.push_str(&format!("  {name:<16}  {value}\n"));
    line("requests", plan.requests.len().to_string());
    let (Endpoint::Rtu { serial, .. }, Some(wire), Some(best), Some(refresh)) =
        (endpoint, plan.wire_ms, plan.best_ms, plan.refresh_ms)
    else {
        line("bytes", plan.characters.to_string());
        line("wire time", "depends on the network".to_owned());
        return text;
    };
    let delay = profile.wire.answer_delay_ms;
    line("characters", plan.characters.to_string());
    line(
        "line",
        format!(
            "{} baud, {} bits a character, answers after {delay} ms",
            serial.baud,
            serial.bits_per_character()
        ),
    );
    line("wire time", format!("{} ms", wire.tenths()));
    line("least possible", format!("{} ms, {}", best.tenths(), share(best, wire)));
    let spacing = match profile.wire.spacing_ms {
        0 => "no pause between reads".to_owned(),
        spacing => format!("{spacing} ms pause after each read"),
    };
    line("full refresh", format!("{} ms, {spacing}", refresh.tenths()));
    text
}

/// How near the plan comes to the best there is.
fn share(best: Time, wire: Time) -> String {
    if wire.0 == 0 {
        return "nothing to read".to_owned();
    }
    let per_mille = u128::from(best.0) * 1000 / u128::from(wire.0);
    format!("the plan reaches {} % of it", Number::new(per_mille as i64, 1).unwrap_or(Number::ZERO))
}

/// Nanoseconds, printed as milliseconds with one decimal.
#[derive(Clone, Copy)]
struct Time(u64);

impl Time {
    fn number(self) -> Number {
        let tenths = self.0.saturating_add(50_000) / 100_000;
        Number::new(i64::try_from(tenths).unwrap_or(i64::MAX), 1).unwrap_or(Number::ZERO)
    }

    /// The decimal stands there even where it is zero, so that columns align.
    fn tenths(self) -> String {
        let number = self.number();
        format!("{}.{}", number.mantissa() / 10, number.mantissa() % 10)
    }
}

impl Serialize for Time {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.number().serialize(serializer)
    }
}
