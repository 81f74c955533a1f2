//! The clock of this machine, as the controllers know one: local time without a zone.

use busbar_profile::DateTime;
use jiff::Zoned;

/// A moment by its own local time, where that is one that a controller's clock can show.
pub(crate) fn local(moment: &Zoned) -> Option<DateTime> {
    let part = |part: i8| u16::try_from(part).ok();
    DateTime::new(
        u16::try_from(moment.year()).ok()?,
        part(moment.month())?,
        part(moment.day())?,
        part(moment.hour())?,
        part(moment.minute())?,
        part(moment.second().min(59))?,
    )
}
