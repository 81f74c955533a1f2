//! Checks of scales, units and signals.

use super::Check;
use crate::file::{At, Decimal, PointFile};
use crate::number::{Linear, Number, Scale};
use crate::suggest::nearest;
use crate::terms::{DataType, SignalKind};
use crate::units;
use crate::vocabulary::Signal;

/// The greatest raw number of any type.
const LARGEST_RAW: u32 = u32::MAX;

impl<'a> Check<'a> {
    /// The scale of a point and its fast form; the raw number where the file gives none.
    pub(super) fn scale(&mut self, point: &PointFile) -> Option<(Option<Scale>, Linear)> {
        match *point.data_type {
            DataType::Fraction8 => return Some((Scale::new(100, 255, Number::ZERO), Linear::ONE)),
            DataType::Fraction16 => return Some((Scale::new(100, 65535, Number::ZERO), Linear::ONE)),
            _ => {}
        }
        if let (Some(_), Some(ratio)) = (&point.coeff, &point.ratio) {
            self.note(&ratio.span, "coeff and ratio at once", "keep the one that the manual prints");
            return None;
        }
        let offset = point.offset.as_ref().map_or(Number::ZERO, |offset| offset.0);
        let (scale, factor) = match (&point.coeff, &point.ratio, &point.offset) {
            (Some(coeff), ..) => (Scale::from_coeff(coeff.0, offset), coeff),
            (_, Some(ratio), _) => (Scale::from_ratio(ratio.0, offset), ratio),
            (_, _, Some(at)) => (Scale::new(1, 1, offset), at),
            _ => return Some((None, Linear::ONE)),
        };
        self.exact(scale, factor)
    }

    fn exact(&mut self, scale: Option<Scale>, factor: &At<Decimal>) -> Option<(Option<Scale>, Linear)> {
        let Some(scale) = scale else {
            self.note(&factor.span, format!("a scale of {}", factor.0), "write a number above 0");
            return None;
        };
        if let Some(linear) = scale.linear(LARGEST_RAW) {
            return Some((Some(scale), linear));
        }
        let message = match scale.linear(1) {
            None => format!("1 / {} has no end as a decimal number", factor.0),
            Some(_) => format!("with {} a number would have more than 15 digits", factor.0),
        };
        self.note(&factor.span, message, "write the factor that the manual prints, as coeff or as ratio");
        None
    }

    /// The unit of a point is known and goes with a scale.
    pub(super) fn unit(&mut self, point: &PointFile, scale: Option<Scale>) {
        let Some(unit) = &point.unit else {
            return;
        };
        if !units::is_known(unit) {
            let names: Vec<_> = units::names().collect();
            let help = match names.iter().find(|name| name.eq_ignore_ascii_case(unit)) {
                Some(meant) => format!("write \"{meant}\""),
                None => format!("write one of: {}", names.join(", ")),
            };
            self.note(&unit.span, format!("the unit `{}` is not known", **unit), help);
        }
        if scale.is_none() {
            self.note(
                &unit.span,
                "a unit without a scale",
                "add coeff = 1 if the manual prints x1, else remove the unit",
            );
        }
    }

    /// The signal of a point exists and fits; gives the way from the point's unit to the signal's.
    pub(super) fn signal(&mut self, point: &PointFile, scale: Option<Scale>) -> Option<Scale> {
        let at = point.signal.as_ref()?;
        if !point.data_type.is_numeric() {
            self.signal_of_kind(at, SignalKind::Words, &format!("a point of type {}", *point.data_type));
            return None;
        }
        let signal = self.signal_of_kind(at, SignalKind::Number, "a number")?;
        if scale.is_none() {
            self.note(
                &at.span,
                "a signal without a scale",
                "add coeff = 1 if the manual prints x1, else remove the signal",
            );
            return None;
        }
        let unit = point.unit.as_ref().map(|unit| unit.as_str());
        let way = match (unit, signal.unit.as_deref()) {
            (None, None) => Some(Scale::ONE),
            (Some(from), Some(to)) => units::conversion(from, to),
            _ => None,
        };
        if way.is_none() && unit.is_none_or(units::is_known) {
            self.note(
                &at.span,
                format!(
                    "{} does not convert exactly to {}, the unit of `{}`",
                    unit.unwrap_or("no unit"),
                    signal.unit.as_deref().unwrap_or("no unit"),
                    signal.id
                ),
                "write another signal, correct the unit, or remove the signal",
            );
        }
        way
    }

    /// The signal of that name, if it is of a kind; notes what is wrong.
    pub(super) fn signal_of_kind(
        &mut self,
        at: &At<String>,
        kind: SignalKind,
        carrier: &str,
    ) -> Option<&'a Signal> {
        let vocabulary = self.vocabulary;
        let Some(signal) = vocabulary.signal(at) else {
            let help = match nearest(at, vocabulary.iter().map(|signal| signal.id.as_str())) {
                Some(meant) => format!("write \"{meant}\", or remove the signal"),
                None => "write an id of profiles/vocabulary.toml, or remove the signal".to_owned(),
            };
            self.note(&at.span, format!("the signal `{}` is not in the vocabulary", **at), help);
            return None;
        };
        if signal.kind != kind {
            self.note(
                &at.span,
                format!("`{}` is of kind {}, and {carrier} needs {kind}", **at, signal.kind),
                format!("write a signal of kind {kind}, or remove the signal"),
            );
            return None;
        }
        Some(signal)
    }
}
