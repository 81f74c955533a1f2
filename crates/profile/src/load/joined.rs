//! Checks of the joined signals.

use super::Check;
use super::layout::Layout;
use crate::file::{At, JoinedFile};
use crate::joined::{Joined, JoinedParts};
use crate::number::{Number, Scale};
use crate::terms::SignalKind;

/// The unit of a joined number.
const HOURS: &str = "h";

impl Check<'_> {
    /// Every joined signal.
    pub(super) fn joined(&mut self, layout: &Layout) -> Vec<Joined> {
        let file = self.file;
        let mut all: Vec<Joined> = Vec::with_capacity(file.joined.len());
        for joined in &file.joined {
            let carrier = layout.points.iter().find(|point| {
                let own = point.signal.as_ref() == Some(&joined.signal);
                own || point.bits.iter().any(|bit| bit.signal.as_ref() == Some(&joined.signal))
            });
            let twice = all.iter().any(|other| other.signal == *joined.signal);
            if let Some(carrier) =
                carrier.map(|point| point.id.as_str()).or(twice.then_some("another joined one"))
            {
                self.note(
                    &joined.signal.span,
                    format!("the signal `{}` is carried by `{carrier}` too", *joined.signal),
                    "keep it at the joined one; parts have no signal, or one of their own",
                );
            }
            all.extend(self.join(joined, layout));
        }
        all
    }

    fn join(&mut self, file: &At<JoinedFile>, layout: &Layout) -> Option<Joined> {
        let Some(signal) = self.vocabulary.signal(&file.signal) else {
            self.note(
                &file.signal.span,
                format!("the vocabulary has no signal `{}`", *file.signal),
                "name a signal of kind clock, or a number in h",
            );
            return None;
        };
        let parts = match signal.kind {
            SignalKind::Clock => self.clock(file, layout)?,
            SignalKind::Number if signal.unit.as_deref() == Some(HOURS) => self.hours(file, layout)?,
            _ => {
                self.note(
                    &file.signal.span,
                    format!("`{}` cannot be joined", *file.signal),
                    "name a signal of kind clock, or a number in h",
                );
                return None;
            }
        };
        Some(Joined { signal: file.signal.clone(), parts })
    }

    fn hours(&mut self, file: &At<JoinedFile>, layout: &Layout) -> Option<JoinedParts> {
        let calendar = [&file.year, &file.month, &file.day, &file.hour, &file.minute, &file.second];
        let (Some(hours), Some(minutes), true) =
            (&file.hours, &file.minutes, calendar.iter().all(|part| part.is_none()))
        else {
            self.note(
                &file.span,
                "hours are not joined of this",
                "write hours and minutes, and seconds where there are any",
            );
            return None;
        };
        let seconds = match &file.seconds {
            Some(seconds) => Some(self.part(seconds, Some("s"), layout)?),
            None => None,
        };
        Some(JoinedParts::Hours {
            hours: self.part(hours, Some(HOURS), layout)?,
            minutes: self.part(minutes, Some("min"), layout)?,
            seconds,
        })
    }

    fn clock(&mut self, file: &At<JoinedFile>, layout: &Layout) -> Option<JoinedParts> {
        let spans = [&file.hours, &file.minutes, &file.seconds];
        let (Some(year), Some(month), Some(day), Some(hour), Some(minute), Some(second), true) = (
            &file.year,
            &file.month,
            &file.day,
            &file.hour,
            &file.minute,
            &file.second,
            spans.iter().all(|part| part.is_none()),
        ) else {
            self.note(
                &file.span,
                "a clock is not joined of this",
                "write year, month, day, hour, minute and second",
            );
            return None;
        };
        Some(JoinedParts::Clock {
            year: self.part(year, None, layout)?,
            month: self.part(month, None, layout)?,
            day: self.part(day, None, layout)?,
            hour: self.part(hour, None, layout)?,
            minute: self.part(minute, None, layout)?,
            second: self.part(second, None, layout)?,
        })
    }

    /// A part must be whole and, where it is a span of time, in its unit.
    fn part(&mut self, name: &At<String>, unit: Option<&str>, layout: &Layout) -> Option<usize> {
        let index = self.readable_point(name, layout)?;
        let point = &layout.points[index];
        let whole = Scale::new(1, 1, Number::ZERO);
        let is_whole = point.data_type.is_numeric() && (point.scale.is_none() || point.scale == whole);
        if !is_whole || unit.is_some_and(|unit| point.unit.as_deref() != Some(unit)) {
            let in_unit = unit.map(|unit| format!(" in {unit}")).unwrap_or_default();
            self.note(
                &name.span,
                format!("`{}` is no whole number{in_unit}", **name),
                format!("name a point of a number at coeff or ratio 1{in_unit}"),
            );
            return None;
        }
        Some(index)
    }
}
