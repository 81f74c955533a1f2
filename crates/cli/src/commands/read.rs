//! `busbar read`: points read once.

use std::{collections::BTreeMap, time::Instant};

use busbar_link::Link;
use busbar_profile::{Point, Profile, Quality, Reading, WordOrder, no_reading, plan::Planner, reading};
use jiff::Timestamp;
use serde::Serialize;

use crate::{
    args,
    failure::Failure,
    harvest::Harvest,
    people, profiles, runtime,
    table::{Align, Cell, Table},
    terminal, wire,
};

/// A reading with its time and the reason where there is none, as `--json` prints it.
#[derive(Serialize)]
pub(super) struct Timed<'a> {
    #[serde(flatten)]
    reading: Reading<'a>,
    ts: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    #[serde(skip)]
    point: &'a Point,
}

pub(crate) fn run(args: &args::Read, json: bool) -> Result<(), Failure> {
    let profile = profiles::resolve(&args.key)?;
    let points = points(&profile, args)?;
    let unit = wire::unit(&profile, args.unit)?;
    wire::check_line(&profile, &args.from)?;
    runtime::once(async {
        let link = wire::open(&args.from, &args.wire, Some(&profile))?;
        let started = Instant::now();
        let mut harvest = Harvest::new(
            &profile,
            Planner::new(&profile, wire::cost(link.endpoint(), &profile)),
            &with_identity(&profile, &points),
        );
        gather(&link, &profile, unit, &mut harvest).await;
        report(&profile, &points, &harvest, args, json)?;
        if !json && harvest.answers() > 0 {
            let points = people::count(points.len(), "point");
            let answers = people::count(harvest.answers(), "answer");
            terminal::message(&format!("{points} in {answers}, {} ms", started.elapsed().as_millis()));
        }
        match points.iter().all(|point| harvest.registers(*point).is_some()) {
            true => Ok(()),
            false => Err(Failure::Reported),
        }
    })
}

/// The points asked for as indexes in address order; all readable ones when none is named.
fn points(profile: &Profile, args: &args::Read) -> Result<Vec<usize>, Failure> {
    if args.points.is_empty() {
        let readable = profile.points.iter().enumerate().filter(|(_, point)| point.access.is_readable());
        return Ok(readable.map(|(index, _)| index).collect());
    }
    profiles::points(profile, &args.points, &args.key)
}

/// The points and, where a label depends on the model, the one that tells it.
pub(super) fn with_identity(profile: &Profile, points: &[usize]) -> Vec<usize> {
    let mut points = points.to_vec();
    if let Some(identity) = &profile.identity
        && points.iter().filter_map(|index| profile.points.get(*index)).any(Point::depends_on_model)
    {
        points.push(identity.point);
    }
    points
}

/// Does all the reads that are still to do.
pub(super) async fn gather(link: &Link, profile: &Profile, unit: u8, harvest: &mut Harvest<'_>) {
    while let Some(read) = harvest.next() {
        match link.read_registers(unit, read.function, read.address, read.count).await {
            Ok(registers) => harvest.answered(read, &registers, Timestamp::now()),
            Err(error) => {
                harvest.failed(read, &error, &wire::sentence(&error, Some(profile)), Timestamp::now())
            }
        }
    }
}

fn report(
    profile: &Profile,
    points: &[usize],
    harvest: &Harvest<'_>,
    args: &args::Read,
    json: bool,
) -> Result<(), Failure> {
    let order = args.wire.word_order.unwrap_or(profile.wire.word_order);
    let identity = profile.identity.as_ref().map(|identity| identity.point);
    let model = profiles::model(profile, |_| harvest.registers(identity?));
    let readings = timed(profile, points, harvest, order, model);
    if json {
        terminal::print_json(&readings)?;
    } else if harvest.answers() > 0 {
        terminal::print(&table(profile, &readings))?;
    }
    say_why(&readings);
    Ok(())
}

/// What a harvest brought of these points.
pub(super) fn timed<'a>(
    profile: &'a Profile,
    points: &[usize],
    harvest: &'a Harvest<'_>,
    order: WordOrder,
    model: Option<&str>,
) -> Vec<Timed<'a>> {
    points
        .iter()
        .filter_map(|index| {
            let point = profile.points.get(*index)?;
            let last = harvest.last(*index);
            let ts = last.map_or_else(Timestamp::now, |done| done.at);
            let (reading, error) = match harvest.registers(*index) {
                Some(raw) => (reading(point, &point.decode(raw, order), raw, model), None),
                None => (no_reading(point, Quality::Bad), last.and_then(|done| done.error.clone())),
            };
            Some(Timed { reading, ts: format!("{ts:.3}"), error, point })
        })
        .collect()
}

/// One sentence for each reason why points were not read.
fn say_why(readings: &[Timed<'_>]) {
    let mut reasons: BTreeMap<&str, Vec<&Point>> = BTreeMap::new();
    for reading in readings {
        if let Some(error) = &reading.error {
            reasons.entry(error).or_default().push(reading.point);
        }
    }
    for (reason, points) in reasons {
        let which = match points.as_slice() {
            points if points.len() == readings.len() => String::new(),
            points if points.len() <= 3 => {
                format!(
                    "{} not read: ",
                    points.iter().map(|point| point.id.as_str()).collect::<Vec<_>>().join(", ")
                )
            }
            [first, .., last] => {
                format!("{} points from {} to {} not read: ", points.len(), first.address, last.address)
            }
            _ => String::new(),
        };
        terminal::message(&format!("{which}{reason}"));
    }
}

fn table(profile: &Profile, readings: &[Timed<'_>]) -> String {
    let mut table = Table::new([
        ("ADDRESS", Align::Right),
        ("NAME", Align::Left),
        ("VALUE", Align::Left),
        ("POINT", Align::Left),
    ])
    .optional(&["POINT"]);
    let width = people::number_width(readings.iter().map(|timed| (timed.point, &timed.reading)));
    for group in &profile.groups {
        let own = |reading: &&Timed<'_>| profile.group(reading.point).id == group.id;
        if readings.iter().any(|reading| own(&reading)) {
            table.title(group.title.as_str());
        }
        for Timed { reading, point, .. } in readings.iter().filter(own) {
            let mut lines = people::lines(point, reading, width).into_iter();
            table.row([
                Cell::dim(point.address.to_string()),
                point.name.as_str().into(),
                lines.next().unwrap_or_default(),
                Cell::dim(point.id.as_str()),
            ]);
            for line in lines {
                table.row([Cell::default(), Cell::default(), line, Cell::default()]);
            }
        }
    }
    table.render(terminal::style(), terminal::width())
}
