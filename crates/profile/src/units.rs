//! The units that profiles may use, and which of them convert exactly.

use crate::number::{Number, Scale};

/// A unit: its name, what it measures, and how many of that quantity's base unit it is, as a fraction.
struct Unit {
    name: &'static str,
    quantity: &'static str,
    num: i64,
    den: i64,
}

const fn unit(name: &'static str, quantity: &'static str) -> Unit {
    Unit { name, quantity, num: 1, den: 1 }
}

const fn multiple(name: &'static str, quantity: &'static str, num: i64, den: i64) -> Unit {
    Unit { name, quantity, num, den }
}

const UNITS: &[Unit] = &[
    unit("V", "voltage"),
    unit("A", "current"),
    multiple("mA", "current", 1, 1000),
    unit("kW", "active power"),
    unit("kvar", "reactive power"),
    unit("kVA", "apparent power"),
    unit("kWh", "active energy"),
    unit("kvarh", "reactive energy"),
    unit("Hz", "frequency"),
    unit("deg", "angle"),
    unit("%", "share"),
    unit("degC", "temperature"),
    unit("kPa", "pressure"),
    multiple("bar", "pressure", 100, 1),
    unit("rpm", "speed"),
    unit("s", "time"),
    multiple("min", "time", 60, 1),
    multiple("h", "time", 3600, 1),
    multiple("d", "time", 86_400, 1),
    unit("L", "volume"),
    unit("L/h", "flow"),
    unit("ohm", "resistance"),
];

/// Whether profiles may use a unit.
pub(crate) fn is_known(name: &str) -> bool {
    find(name).is_some()
}

/// The names of all units.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    UNITS.iter().map(|unit| unit.name)
}

/// How a number in one unit becomes one in another; none where it does not, or not exactly.
pub(crate) fn conversion(from: &str, to: &str) -> Option<Scale> {
    if from == to {
        return Some(Scale::ONE);
    }
    let (from, to) = (find(from)?, find(to)?);
    if from.quantity != to.quantity {
        return None;
    }
    let scale = Scale::new(from.num * to.den, from.den * to.num, Number::ZERO)?;
    // A fraction without an end, such as seconds in hours, would not be exact.
    scale.linear(1).map(|_| scale)
}

fn find(name: &str) -> Option<&'static Unit> {
    UNITS.iter().find(|unit| unit.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn converts_what_is_exact() {
        let convert = |from, to, value: &str| {
            let number = conversion(from, to)?.apply(value.parse().unwrap())?;
            Some(number.to_string())
        };
        assert_eq!(convert("bar", "kPa", "4.25").as_deref(), Some("425"));
        assert_eq!(convert("kPa", "bar", "425").as_deref(), Some("4.25"));
        assert_eq!(convert("mA", "A", "12.5").as_deref(), Some("0.0125"));
        assert_eq!(convert("h", "min", "1.5").as_deref(), Some("90"));
        assert_eq!(convert("V", "V", "1").as_deref(), Some("1"));
        for (from, to) in [("s", "h"), ("V", "A"), ("kWh", "kvarh"), ("x", "V")] {
            assert_eq!(conversion(from, to), None, "{from} {to}");
        }
    }
}
