//! Alarms that are injected: the panel takes them for its own, whatever the plant says.

use busbar_profile::text::shown;
use busbar_profile::{Class, Profile, nearest};

/// What an alarm is called whichever maker the controller is of, and the alarms that are meant by it: of each controller
/// at most one, of the class that it usually has.
const EVERYDAY: [(&str, &[&str]); 11] = [
    (
        "coolant_temperature_high",
        &[
            "shutdown_alarms.high_engine_temperature",
            "shutdown_alarms_1.high_coolant_temperature",
            "shutdown_alarms_2.high_engine_temperature_shutdown",
        ],
    ),
    (
        "coolant_level_low",
        &["shutdown_alarms.low_coolant_level", "shutdown_alarms_1.low_coolant_level_input_shutdown"],
    ),
    (
        "oil_pressure_low",
        &[
            "shutdown_alarms.low_oil_pressure",
            "shutdown_alarms_1.low_oil_pressure",
            "shutdown_alarms_2.low_engine_oil_pressure_shutdown",
        ],
    ),
    (
        "overspeed",
        &[
            "shutdown_alarms.genset_high_rpm",
            "shutdown_alarms_2.genset_high_rpm",
            "shutdown_alarms_1.overspeed_shutdown",
        ],
    ),
    (
        "underspeed",
        &[
            "shutdown_alarms.genset_low_rpm",
            "shutdown_alarms_2.genset_low_rpm",
            "shutdown_alarms_1.underspeed_shutdown",
        ],
    ),
    (
        "start_failure",
        &[
            "shutdown_alarms.fail_to_start",
            "shutdown_alarms_2.fail_to_start",
            "shutdown_alarms_1.start_failure_shutdown",
        ],
    ),
    (
        "stop_failure",
        &[
            "shutdown_alarms.fail_to_stop",
            "shutdown_alarms_2.fail_to_stop",
            "warning_alarms_1.stop_failure_warning",
        ],
    ),
    ("fuel_level_low", &["warning_alarms.low_fuel_level", "warning_alarms_2.low_fuel_level"]),
    (
        "battery_voltage_low",
        &[
            "warning_alarms.low_battery_voltage",
            "warning_alarms_3.low_battery_voltage",
            "warning_alarms_1.battery_undervoltage_warning",
        ],
    ),
    (
        "charge_failure",
        &[
            "warning_alarms.low_charge_voltage",
            "warning_alarms_3.charge_fail",
            "warning_alarms_1.charging_failure_warning",
        ],
    ),
    (
        "overload",
        &["load_dump_alarms.over_load", "load_dump_alarms.genset_excess_power", "alarms_2.overload"],
    ),
];

/// An alarm of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Alarm {
    /// Id of the point that holds it.
    pub point: &'static str,
    /// Number of its bit there.
    pub bit: u16,
    /// Id of its bit.
    pub id: &'static str,
    /// What people call it.
    pub label: &'static str,
    /// How serious it is.
    pub class: Class,
}

/// An alarm was not injected; everything is as it was.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InjectError {
    /// The controller has no such alarm.
    #[error("the controller has no alarm `{}`; {}", shown(.name), meant(.nearest, .key))]
    Unknown {
        /// What was asked for.
        name: String,
        /// What was perhaps meant.
        nearest: Vec<String>,
        /// Key of the controller's profile.
        key: &'static str,
    },
    /// Several points have a bit of that name.
    #[error("there are several alarms `{}`; choose {}", shown(.name), .candidates.join(" or "))]
    Ambiguous {
        /// What was asked for.
        name: String,
        /// All of them, by point.
        candidates: Vec<String>,
    },
    /// The imitation works this alarm out from others.
    #[error("`{}` follows from other alarms; inject one of those", shown(.name))]
    Derived {
        /// What was asked for.
        name: String,
    },
}

/// Every alarm of a controller: named bits that are more than a status.
pub(crate) fn alarms(profile: &'static Profile) -> impl Iterator<Item = Alarm> {
    profile.points.iter().filter(|point| point.access.is_readable()).flat_map(|point| {
        point.bits.iter().filter_map(move |bit| {
            let class = bit.class.filter(|class| *class != Class::Status)?;
            Some(Alarm { point: &point.id, bit: bit.bit, id: &bit.id, label: &bit.label, class })
        })
    })
}

/// The alarm of a name: the id of its bit where only one point has it, `point.bit`, or what it is called whichever maker
/// the controller is of.
pub(crate) fn find(profile: &'static Profile, name: &str) -> Result<Alarm, InjectError> {
    let found: Vec<_> = alarms(profile).filter(|alarm| alarm.id == name || full(alarm) == name).collect();
    match found.as_slice() {
        [alarm] => Ok(*alarm),
        [] => everyday(profile, name).ok_or_else(|| unknown(profile, name)),
        several => Err(InjectError::Ambiguous {
            name: name.to_owned(),
            candidates: several.iter().map(full).collect(),
        }),
    }
}

fn full(alarm: &Alarm) -> String {
    format!("{}.{}", alarm.point, alarm.id)
}

fn everyday(profile: &'static Profile, name: &str) -> Option<Alarm> {
    let (_, meant) = EVERYDAY.iter().find(|(everyday, _)| *everyday == name)?;
    alarms(profile).find(|alarm| meant.contains(&full(alarm).as_str()))
}

/// What there is to say of an alarm that the controller does not have; of a wrong letter, every alarm that has the right
/// one.
fn unknown(profile: &'static Profile, name: &str) -> InjectError {
    let names = EVERYDAY.iter().map(|(name, _)| *name).filter(|name| everyday(profile, name).is_some());
    let bit = name.split_once('.').map_or(name, |(_, bit)| bit);
    let near = nearest(bit, alarms(profile).map(|alarm| alarm.id).chain(names));
    let mut meant: Vec<_> =
        alarms(profile).filter(|alarm| Some(alarm.id) == near).map(|alarm| full(&alarm)).collect();
    if meant.is_empty() {
        meant.extend(near.map(str::to_owned));
    }
    InjectError::Unknown { name: name.to_owned(), nearest: meant, key: &profile.key }
}

fn meant(nearest: &[String], key: &str) -> String {
    match nearest {
        [] => format!("`busbar profile show {key}` lists the bits with a class"),
        nearest => format!("did you mean {}?", nearest.join(" or ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profile(key: &str) -> &'static Profile {
        busbar_profile::builtin(key).unwrap()
    }

    #[test]
    fn an_everyday_name_means_one_alarm_of_each_controller_that_has_it() {
        for (name, meant) in EVERYDAY {
            let of = |key| alarms(profile(key)).filter(|alarm| meant.contains(&full(alarm).as_str())).count();
            let counts: Vec<_> = busbar_profile::builtins().iter().map(|profile| of(&*profile.key)).collect();
            assert!(counts.iter().all(|count| *count <= 1), "{name}: {counts:?}");
            assert_eq!(counts.iter().sum::<usize>(), meant.len(), "{name} means what no controller has");
        }
        let meant = |key, name| find(profile(key), name).map(|alarm| full(&alarm));
        let name = "coolant_temperature_high";
        assert_eq!(meant("datakom-d", name).unwrap(), "shutdown_alarms.high_engine_temperature");
        assert_eq!(meant("datakom-dkg705", name).unwrap(), "shutdown_alarms_1.high_coolant_temperature");
        assert!(
            matches!(meant("smartgen-hat821si", name), Err(InjectError::Unknown { .. })),
            "it has no engine"
        );
        assert_eq!(meant("smartgen-hat821si", "overload").unwrap(), "alarms_2.overload", "its own word");
    }

    #[test]
    fn the_guide_names_every_everyday_name() {
        let guide = include_str!("../../../docs/scenarios.md");
        for (name, _) in EVERYDAY {
            assert!(guide.contains(&format!("`{name}`")), "docs/scenarios.md lacks {name}");
        }
    }

    #[test]
    fn a_wrong_name_gets_the_right_ones() {
        let said = |name| find(profile("datakom-d"), name).unwrap_err().to_string();
        assert_eq!(
            said("high_engine_temprature"),
            "the controller has no alarm `high_engine_temprature`; did you mean shutdown_alarms.high_engine_temperature or \
             load_dump_alarms.high_engine_temperature or warning_alarms.high_engine_temperature?"
        );
        assert_eq!(
            said("oil_presure_low"),
            "the controller has no alarm `oil_presure_low`; did you mean oil_pressure_low?"
        );
        assert_eq!(
            said("\u{1B}[2J"),
            "the controller has no alarm `\\u{1b}[2J`; `busbar profile show datakom-d` lists the bits with a class"
        );
    }
}
