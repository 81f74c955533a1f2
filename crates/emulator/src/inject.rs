//! Alarms that are injected: the panel takes them for its own, whatever the plant says.

use busbar_profile::{Class, Profile, nearest};

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
    #[error("the controller has no alarm `{name}`{}; `busbar profile show` lists the bits with a class", meant(.nearest.as_ref()))]
    Unknown {
        /// What was asked for.
        name: String,
        /// What was perhaps meant.
        nearest: Option<String>,
    },
    /// Several points have a bit of that name.
    #[error("there are several alarms `{name}`; choose {}", .candidates.join(" or "))]
    Ambiguous {
        /// What was asked for.
        name: String,
        /// All of them, by point.
        candidates: Vec<String>,
    },
    /// The imitation works this alarm out from others.
    #[error("`{name}` follows from other alarms; inject one of those")]
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

/// The alarm of a name: the id of its bit where only one point has it, else `point.bit`.
pub(crate) fn find(profile: &'static Profile, name: &str) -> Result<Alarm, InjectError> {
    let full = |alarm: &Alarm| format!("{}.{}", alarm.point, alarm.id);
    let found: Vec<_> = alarms(profile).filter(|alarm| alarm.id == name || full(alarm) == name).collect();
    match found.as_slice() {
        [alarm] => Ok(*alarm),
        [] => {
            let ids = alarms(profile).map(|alarm| alarm.id);
            Err(InjectError::Unknown {
                name: name.to_owned(),
                nearest: nearest(name, ids).map(str::to_owned),
            })
        }
        several => Err(InjectError::Ambiguous {
            name: name.to_owned(),
            candidates: several.iter().map(full).collect(),
        }),
    }
}

fn meant(nearest: Option<&String>) -> String {
    nearest.map(|nearest| format!(", did you mean `{nearest}`?")).unwrap_or_default()
}
