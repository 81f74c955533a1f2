//! `busbar command`: one remote command, sent once, and the verdict on it.

mod consent;
mod teller;

use std::{pin::pin, time::Duration};

use busbar_link::command as driver;
use busbar_profile::{
    Command, DateTime, Profile,
    command::{ArgValues, Arguments, Observed, ObservedShow, Report, Run, Seen, SeenShow, Sign, Verdict},
};
use jiff::{SignedDuration, Timestamp, Zoned};
use serde::Serialize;
use tokio::select;

use crate::{
    args,
    failure::Failure,
    people, profiles, runtime,
    table::{Align, Cell, Table},
    terminal, wall_clock, wire,
};
use teller::Teller;

/// What became of the command, as `--json` prints it.
#[derive(Serialize)]
struct Outcome<'a> {
    command: &'a str,
    verdict: Verdict,
    reason: &'a str,
    sent: u32,
    evidence: Vec<Evidence<'a>>,
    elapsed_ms: u64,
}

#[derive(Serialize)]
struct Evidence<'a> {
    #[serde(flatten)]
    shown: ObservedShow<'a>,
    ts: String,
}

pub(crate) fn run(args: &args::Order, json: bool) -> Result<(), Failure> {
    let profile = profiles::resolve(&args.key)?;
    let command = profiles::command(&profile, &args.name, &args.key)?;
    arguments(&profile, command, args)?;
    let unit = wire::unit(&profile, args.unit)?;
    wire::check_line(&profile, &args.to)?;
    let question = match args.yes {
        true => None,
        false => Some(consent::Question::new(&profile, command, unit, &args.to)?),
    };
    runtime::attended(async |mut stop| {
        if let Some(question) = question {
            select! {
                answer = question.ask() => answer?,
                () = stop.wait() => {
                    terminal::error_text("\n");
                    return interrupted(command, 0, Duration::ZERO, json);
                }
            }
        }
        // A time of now is now, however long the question waited.
        let arguments = self::arguments(&profile, command, args)?;
        let link = wire::open(&args.to, &args.wire, Some(&profile))?;
        let order = args.wire.word_order.unwrap_or(profile.wire.word_order);
        let run = Run::new(&profile, command, arguments, order);
        let mut teller = Teller::new(&link, &profile, command, json);
        let started = Timestamp::now();
        let report = {
            let mut running =
                pin!(driver::run_with(&link, unit, &profile, run, |progress| teller.tell(progress)));
            select! {
                report = &mut running => Some(report),
                () = stop.wait() => None,
            }
        };
        let Some(mut report) = report else {
            let elapsed = Timestamp::now().duration_since(started).unsigned_abs();
            return interrupted(command, teller.sent(), elapsed, json);
        };
        if let (true, Some(why)) = (report.verdict != Verdict::Done, teller.unread()) {
            report.reason.push_str(&format!(" {why}."));
        }
        tell(&profile, command, &report, started, json)
    })
}

fn arguments(profile: &Profile, command: &Command, args: &args::Order) -> Result<Arguments, Failure> {
    let takes_time = command.args.iter().any(|arg| matches!(arg.values, ArgValues::Time { .. }));
    let now = Zoned::now();
    let local = wall_clock::local(&now);
    let Some(local) = local.or_else(|| if takes_time { None } else { DateTime::new(2000, 1, 1, 0, 0, 0) })
    else {
        return Err(Failure::Failed(format!(
            "the clock of this machine says {}, which no controller can be set to; set it first",
            now.date()
        )));
    };
    let given = args.arguments.iter().map(|(name, value)| (name.as_str(), value.as_str()));
    command
        .arguments(given, local)
        .map_err(|error| Failure::Call(format!("{} of {}: {error}", command.id, profile.key)))
}

/// Ctrl-C: what has left cannot be taken back, and programs get a document all the same.
fn interrupted(command: &Command, sent: u32, elapsed: Duration, json: bool) -> Result<(), Failure> {
    let (verdict, message, reason) = match sent {
        0 => (Verdict::Refused, "interrupted: nothing was sent", "Nothing was sent: it was interrupted."),
        _ => (
            Verdict::Unknown,
            "interrupted: the command has left, is not taken back and may still take effect; read the state before anything else",
            "It was interrupted after the write had left, before anything showed what became of it.",
        ),
    };
    terminal::message(message);
    if json {
        terminal::print_json(&Outcome {
            command: &command.id,
            verdict,
            reason,
            sent,
            evidence: Vec::new(),
            elapsed_ms: millis(elapsed),
        })?;
    }
    Ok(())
}

fn millis(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

/// Prints the verdict; anything but `done` is a failure.
fn tell(
    profile: &Profile,
    command: &Command,
    report: &Report,
    started: Timestamp,
    json: bool,
) -> Result<(), Failure> {
    let model = report.model.as_deref();
    if json {
        let evidence = report.evidence.iter().map(|observed| {
            let after = SignedDuration::try_from(observed.at).unwrap_or_default();
            let ts = started.saturating_add(after).unwrap_or(started);
            Evidence { shown: observed.shown(profile, model), ts: format!("{ts:.3}") }
        });
        terminal::print_json(&Outcome {
            command: &command.id,
            verdict: report.verdict,
            reason: &report.reason,
            sent: report.sent,
            evidence: evidence.collect(),
            elapsed_ms: millis(report.elapsed),
        })?;
    } else {
        terminal::print(&text(profile, command, report, model))?;
        terminal::message(&format!(
            "{} sent, {} ms",
            people::count(report.sent as usize, "write"),
            report.elapsed.as_millis()
        ));
    }
    match report.verdict {
        Verdict::Done => Ok(()),
        _ => Err(Failure::Reported),
    }
}

/// The verdict for people: in a word, as sentences, and with what was seen.
fn text(profile: &Profile, command: &Command, report: &Report, model: Option<&str>) -> String {
    let style = terminal::style();
    let verdict = match report.verdict {
        Verdict::Done => "done",
        Verdict::Refused => "refused",
        Verdict::NoEffect => "no effect",
        Verdict::Unknown => "unknown",
    };
    let title = format!("{}: {verdict}", command.name);
    let title = match report.verdict {
        Verdict::Done => style.title(&title),
        Verdict::Unknown => style.caution(&title),
        _ => style.alarm(&title),
    };
    let mut text = format!("{title}\n{}\n", report.reason);
    if report.verdict == Verdict::Unknown && report.sent > 0 {
        text.push_str(
            "Nobody can tell whether it took effect: look at the controller before anything else, and do not simply send it again.\n",
        );
    }
    if !report.evidence.is_empty() {
        text.push('\n');
        text.push_str(&evidence(profile, report, model).render(style, terminal::width()));
    }
    text
}

/// What was seen before and after; what was seen, where nothing was sent.
fn evidence(profile: &Profile, report: &Report, model: Option<&str>) -> Table {
    let mut table = match report.sent {
        0 => Table::new([("SEEN", Align::Left), ("IS", Align::Left)]),
        _ => Table::new(["SEEN", "BEFORE", "", "AFTER"].map(|title| (title, Align::Left))),
    };
    for observed in &report.evidence {
        let shown = observed.shown(profile, model);
        let name = name(profile, observed, &shown).into();
        let unit = match observed.sign {
            Sign::Point { point, .. } => profile.points[point].unit.as_deref(),
            _ => None,
        };
        let before = value(shown.before, observed.before, unit);
        let after = value(shown.after, observed.after, unit);
        match report.sent {
            0 => table.row([name, if observed.after.is_some() { after } else { before }]),
            _ => table.row([name, before, Cell::dim("->"), after]),
        }
    }
    table
}

/// What a sign is called.
fn name(profile: &Profile, observed: &Observed, shown: &ObservedShow<'_>) -> String {
    match observed.sign {
        Sign::Point { point, bit: None } => profile.points[point].name.clone(),
        Sign::Point { point, bit: Some(bit) } => profile.points[point].bit_label(bit).into_owned(),
        Sign::Device => "The controller".to_owned(),
        _ => shown.id.clone().into_owned(),
    }
}

fn value(shown: Option<SeenShow<'_>>, seen: Option<Seen>, unit: Option<&str>) -> Cell {
    match shown {
        Some(SeenShow::Flag(on)) => if on { "on" } else { "off" }.into(),
        Some(SeenShow::Number(number)) => people::with_unit(number.to_string(), unit).into(),
        Some(SeenShow::Text(text)) => match seen {
            Some(Seen::Clock(_)) => text.replace('T', " ").into(),
            _ => text.into_owned().into(),
        },
        _ => Cell::dim("not read"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_local_time_is_that_of_the_zone() {
        let time = |text: &str| wall_clock::local(&text.parse().unwrap()).map(|time| time.to_string());
        assert_eq!(time("2026-07-01T23:30:59+03:00[Europe/Istanbul]").unwrap(), "2026-07-01T23:30:59");
        assert_eq!(time("1970-01-01T00:00:07+00:00[UTC]"), None);
    }
}
