//! Checks of what an imitation is set to.

use std::collections::HashSet;

use super::Check;
use crate::file::SettingFile;
use crate::profile::Setting;

impl Check<'_> {
    pub(super) fn settings(&mut self) -> Vec<Setting> {
        let file = self.file;
        let mut ids: HashSet<&str> = HashSet::new();
        let points: HashSet<&str> =
            file.groups.iter().flat_map(|group| &group.points).map(|point| point.id.as_str()).collect();
        for setting in &file.emulator.settings {
            self.id(&setting.id);
            self.text(&setting.name, &setting.span, "name");
            if !ids.insert(&setting.id) {
                self.twice(&setting.id.span, &format!("the setting `{}`", *setting.id));
            }
            if points.contains(setting.id.as_str()) {
                self.note(
                    &setting.id.span,
                    format!("`{}` is a point as well", *setting.id),
                    "give the setting another id: both are set by `--set ID=VALUE`",
                );
            }
            self.setting_range(setting);
        }
        file.emulator.settings.iter().map(|setting| checked(setting)).collect()
    }

    fn setting_range(&mut self, setting: &SettingFile) {
        if setting.value.0 < setting.min.0 || setting.value.0 > setting.max.0 {
            self.note(
                &setting.value.span,
                format!(
                    "`{}` is set to {}, outside {} to {}",
                    *setting.id, setting.value.0, setting.min.0, setting.max.0
                ),
                "correct the value or its limits",
            );
        }
    }
}

fn checked(setting: &SettingFile) -> Setting {
    Setting {
        id: setting.id.clone(),
        name: setting.name.clone(),
        value: setting.value.0,
        min: setting.min.0,
        max: setting.max.0,
        unit: setting.unit.clone(),
    }
}
