//! `busbar watch`: points read again and again, until Ctrl-C.
//!
//! On a terminal a table is drawn anew in its place; elsewhere each change is a line; with `--json` each round is one.

mod screen;
mod state;

use std::{future::Future, pin::pin, time::Duration};

use busbar_link::Link;
use busbar_profile::{Profile, WordOrder};
use jiff::Timestamp;
use tokio::{
    select,
    time::{Instant, MissedTickBehavior, interval, sleep_until},
};

use super::read;
use crate::{args, failure::Failure, people, profiles, runtime, terminal, wire};
use screen::Screen;
use state::State;

/// Ages are drawn anew so often.
const TICK: Duration = Duration::from_secs(1);

pub(crate) fn run(args: &args::Watch, json: bool) -> Result<(), Failure> {
    let profile = profiles::resolve(&args.key)?;
    let points = match args.points.as_slice() {
        [] => None,
        ids => Some(profiles::points(&profile, ids, &args.key)?),
    };
    let unit = wire::unit(&profile, args.unit)?;
    wire::check_line(&profile, &args.from)?;
    runtime::attended(async |mut stop| {
        let link = wire::open(&args.from, &args.wire, Some(&profile))?;
        let order = args.wire.word_order.unwrap_or(profile.wire.word_order);
        let state = State::new(&profile, points, wire::cost(link.endpoint(), &profile), order, args.every);
        // Frames on the same terminal would run through the table.
        let in_place = !json && terminal::can_redraw() && !(args.wire.trace && terminal::error_is_terminal());
        let view = match (json, in_place) {
            (true, _) => View::Json,
            (_, true) => View::Table(Screen::new(format!("{}, unit {unit}, {}", profile.key, args.from))),
            _ => View::Lines,
        };
        let mut watch = Watch { profile: &profile, unit, link, order, state, view, outage: None };
        select! {
            done = watch.rounds(args.every) => return done,
            () = stop.wait() => {}
        }
        watch.end()
    })
}

/// How it is shown.
enum View {
    Table(Screen),
    Lines,
    Json,
}

/// A device under watch.
struct Watch<'p> {
    profile: &'p Profile,
    unit: u8,
    link: Link,
    order: WordOrder,
    state: State<'p>,
    view: View,
    /// Why the device does not answer, as it was told last.
    outage: Option<String>,
}

impl Watch<'_> {
    /// Round after round; comes back only where standard output is gone.
    async fn rounds(&mut self, every: Duration) -> Result<(), Failure> {
        let started = Instant::now();
        let mut due = started;
        loop {
            let points = self.state.due(started.elapsed());
            let mut harvest = self.state.harvest(&points);
            let (link, profile, unit) = (self.link.clone(), self.profile, self.unit);
            self.meanwhile(read::gather(&link, profile, unit, &mut harvest)).await?;

            let answers = harvest.answers();
            if let View::Json = self.view {
                let model = self.state.model_in(&harvest).map(str::to_owned);
                terminal::print_json(&read::timed(
                    profile,
                    &self.state.watched(&points),
                    &harvest,
                    self.order,
                    model.as_deref(),
                ))?;
            }
            let changed = self.state.take(&points, harvest, started.elapsed());
            self.tell_outage(answers);
            self.show(&changed)?;

            due = (due + every).max(Instant::now());
            self.meanwhile(sleep_until(due)).await?;
        }
    }

    /// Waits, and lets the ages on the screen grow.
    async fn meanwhile(&mut self, work: impl Future<Output = ()>) -> Result<(), Failure> {
        let mut work = pin!(work);
        let mut ticks = interval(TICK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        ticks.tick().await;
        loop {
            select! {
                () = &mut work => return Ok(()),
                _ = ticks.tick() => {
                    if let View::Table(screen) = &mut self.view {
                        screen.draw(&self.state, Timestamp::now())?;
                    }
                }
            }
        }
    }

    /// Shows a round that is over, in which these points have changed.
    fn show(&mut self, changed: &[usize]) -> Result<(), Failure> {
        let now = Timestamp::now();
        match &mut self.view {
            View::Table(screen) => screen.draw(&self.state, now)?,
            View::Json => {}
            View::Lines => {
                let mut text = String::new();
                for index in changed {
                    if let Some(seen) = self.state.seen(*index, now) {
                        let value = people::line(seen.point, &seen.reading);
                        let note = seen.note();
                        let note = if note.is_empty() { String::new() } else { format!("  ({note})") };
                        text.push_str(&format!("{:.3}  {}  {value}{note}\n", seen.at, seen.point.id));
                    }
                }
                terminal::print(&text)?;
            }
        }
        Ok(())
    }

    /// Says on standard error when the device falls silent and when it is back; the table says it itself.
    fn tell_outage(&mut self, answers: usize) {
        let outage = match answers {
            0 => self.state.reason().map(str::to_owned),
            _ => None,
        };
        if outage == self.outage || matches!(self.view, View::Table(_)) {
            return;
        }
        match &outage {
            Some(reason) => terminal::message(reason),
            None => terminal::message(&format!("unit {} answers again", self.unit)),
        }
        self.outage = outage;
    }

    fn end(&self) -> Result<(), Failure> {
        if let View::Table(screen) = &self.view {
            screen.end()?;
        }
        Ok(())
    }
}
