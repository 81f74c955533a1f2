//! What an imitated controller is set to: timers, thresholds and attempts, as the profile's emulator section has them
//! until somebody sets them otherwise.

use std::time::Duration;

use busbar_profile::text::shown;
use busbar_profile::{Number, Profile, Setting, nearest};

/// The settings of one controller.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// Key of the profile.
    key: &'static str,
    values: Vec<(&'static Setting, f64)>,
}

impl Settings {
    pub(crate) fn of(profile: &'static Profile) -> Self {
        let values = profile.settings.iter().map(|setting| (setting, setting.value.as_f64())).collect();
        Self { key: &profile.key, values }
    }

    /// All of them, each with what it is set to.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&'static Setting, f64)> {
        self.values.iter().copied()
    }

    /// What one is set to, in its unit. An id that the profile lacks is a fault of ours, and 0.
    pub(crate) fn number(&self, id: &str) -> f64 {
        let found = self.values.iter().find(|(setting, _)| setting.id == id);
        debug_assert!(found.is_some(), "the profile has no setting {id}");
        found.map_or(0.0, |(_, value)| *value)
    }

    /// What one with the unit s is set to.
    pub(crate) fn seconds(&self, id: &str) -> Duration {
        Duration::try_from_secs_f64(self.number(id)).unwrap_or_default()
    }

    /// Whether one without a unit is set to yes.
    pub(crate) fn is_on(&self, id: &str) -> bool {
        self.number(id) != 0.0
    }

    /// Sets one from text.
    pub(crate) fn set(&mut self, id: &str, text: &str) -> Result<(), SettingError> {
        let Some((setting, value)) = self.values.iter_mut().find(|(setting, _)| setting.id == id) else {
            let ids = || self.values.iter().map(|(setting, _)| setting.id.as_str());
            return Err(SettingError::Unknown {
                id: id.to_owned(),
                nearest: nearest(id, ids()).map(str::to_owned),
                key: self.key,
            });
        };
        let number =
            text.parse::<Number>().ok().filter(|number| (setting.min..=setting.max).contains(number));
        let Some(number) = number else {
            return Err(SettingError::Range { setting, text: text.to_owned() });
        };
        *value = number.as_f64();
        Ok(())
    }
}

/// A setting was not changed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SettingError {
    /// The controller has no such setting.
    #[error("the controller has no setting `{}`; {}", shown(.id), meant(.nearest.as_ref(), .key))]
    Unknown {
        /// What was asked for.
        id: String,
        /// What was perhaps meant.
        nearest: Option<String>,
        /// Key of the controller's profile.
        key: &'static str,
    },
    /// It cannot be set to that.
    #[error(
        "`{}` cannot be set to `{}`; choose a number from {} to {}{}",
        .setting.id, shown(.text), .setting.min, .setting.max,
        .setting.unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default()
    )]
    Range {
        /// The setting.
        setting: &'static Setting,
        /// What was asked for.
        text: String,
    },
}

fn meant(nearest: Option<&String>, key: &str) -> String {
    match nearest {
        Some(nearest) => format!("did you mean `{nearest}`?"),
        None => format!("docs/imitation/{key}.md lists them"),
    }
}
