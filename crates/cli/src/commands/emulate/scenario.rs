//! `--scenario FILE`: tells what happens while it is played, and says in the end what became of it.

use std::time::Duration;

use busbar_emulator::{Emulation, Event, EventKind, Report};
use busbar_link::Endpoint;
use serde::Serialize;
use tokio::{
    select,
    time::{MissedTickBehavior, interval},
};

use crate::{failure::Failure, runtime::Stop, terminal};

/// How often somebody looks what has happened.
const LOOK: Duration = Duration::from_millis(100);

/// What `--json` prints in the end.
#[derive(Serialize)]
struct Played<'a> {
    urls: &'a [Endpoint],
    #[serde(flatten)]
    report: &'a Report,
}

/// Waits for the end of the scenario, or for a signal to stop, which ends it undecided.
pub(super) async fn play(emulation: &Emulation, stop: &mut Stop, json: bool) -> Result<(), Failure> {
    let mut ticks = interval(LOOK);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut told = 0;
    let title = report(emulation, |report| {
        let Report { title, controller, model, seed, .. } = report;
        format!("{:>9} s  {title}: {controller}, {model}, seed {seed}\n", "0.0")
    });
    terminal::error_text(&title.unwrap_or_default());
    loop {
        select! {
            () = stop.wait() => {
                terminal::message("the scenario was stopped before its end");
                return Ok(());
            }
            _ = ticks.tick() => {}
        }
        let news = report(emulation, |report| {
            let lines: String = report.events.iter().skip(told).map(line).collect();
            told = report.events.len();
            (lines, report.is_over().then(|| report.clone()))
        });
        let Some((lines, over)) = news else { return Ok(()) };
        terminal::error_text(&lines);
        if let Some(report) = over {
            return conclude(emulation, &report, json);
        }
    }
}

/// Looks at what has become of the scenario so far.
fn report<T>(emulation: &Emulation, look: impl FnOnce(&Report) -> T) -> Option<T> {
    emulation.controllers().first()?.with(|device| device.report().map(look))
}

fn conclude(emulation: &Emulation, report: &Report, json: bool) -> Result<(), Failure> {
    if json {
        terminal::print_json(&Played { urls: emulation.urls(), report })?;
    }
    let failures: Vec<_> = report.failures().map(|check| report.sentence(check)).collect();
    let (all, lasted) = (report.checks.len(), report.lasted.as_secs_f64());
    if failures.is_empty() {
        terminal::error_text(&format!("{lasted:9.1} s  all {all} expectations held\n"));
        return Ok(());
    }
    let failed = failures.len();
    terminal::error_text(&format!("{lasted:9.1} s  {failed} of {all} expectations failed\n"));
    for sentence in failures {
        terminal::message(&sentence);
    }
    Err(Failure::Reported)
}

/// An event as people read it.
fn line(event: &Event) -> String {
    let text = &event.text;
    let seconds = event.seconds();
    match event.kind {
        EventKind::Change => format!("{seconds:>9} s    {text}\n"),
        EventKind::Held => format!("{seconds:>9} s  held: {text}\n"),
        EventKind::Failed => format!("{seconds:>9} s  FAILED: {text}\n"),
        _ => format!("{seconds:>9} s  {text}\n"),
    }
}
