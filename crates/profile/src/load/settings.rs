//! Checks of what an imitation is set to.

use std::collections::HashSet;

use super::Check;
use super::layout::Layout;
use crate::file::SettingFile;
use crate::number::Number;
use crate::point::Point;
use crate::profile::Setting;
use crate::terms::WordOrder;
use crate::value::Value;

impl Check<'_> {
    pub(super) fn settings(&mut self, layout: &Layout) -> Vec<Setting> {
        let file = self.file;
        let mut ids: HashSet<&str> = HashSet::new();
        for setting in &file.emulator.settings {
            self.id(&setting.id);
            self.text(&setting.name, &setting.span, "name");
            if !ids.insert(&setting.id) {
                self.twice(&setting.id.span, &format!("the setting `{}`", *setting.id));
            }
            self.setting_range(setting);
            // None for a point that has findings of its own.
            if let Some(&Some(index)) = layout.by_id.get(setting.id.as_str()) {
                self.parameter(setting, &layout.points[index]);
            }
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

    /// A setting with the id of a point is a parameter of the controller: `--set ID=VALUE` sets it, and the point's
    /// register shows what it is set to.
    fn parameter(&mut self, setting: &SettingFile, point: &Point) {
        let shows = point.data_type.is_numeric() && point.access.is_readable() && !point.access.is_writable();
        if !shows {
            self.note(
                &setting.id.span,
                format!("`{}` is a point as well, and cannot show a setting", *setting.id),
                "give the setting another id: only a number that clients read and never write shows one",
            );
            return;
        }
        if setting.unit != point.unit {
            let unit = point.unit.as_ref().map_or_else(|| "no unit".to_owned(), |unit| format!("`{unit}`"));
            self.note(
                &setting.id.span,
                format!("the point `{}` shows this setting in another unit", *setting.id),
                format!("give the setting the point's unit, {unit}"),
            );
        }
        for number in [&setting.value, &setting.min, &setting.max] {
            if !holds(point, number.0) {
                self.note(
                    &number.span,
                    format!("the register of `{}` cannot hold {}", *setting.id, number.0),
                    "correct the number: the point shows what the setting is set to",
                );
            }
        }
    }
}

/// Whether the register of a point holds a number to the last digit.
fn holds(point: &Point, number: Number) -> bool {
    let mut registers = vec![0; usize::from(point.registers)];
    let encoded = point.encode(&Value::Number(number), WordOrder::LowFirst, &mut registers);
    let shown = point.decode(&registers, WordOrder::LowFirst).value.and_then(|value| value.as_number());
    encoded.is_ok() && shown == Some(number)
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
