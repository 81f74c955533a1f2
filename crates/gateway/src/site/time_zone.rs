//! The time zone of a site: a name of the IANA database.

use busbar_profile::Collector;
use busbar_profile::text::shown;
use jiff::tz::TimeZoneDatabase;

use super::reader::Table;
use super::words::meant;

/// The name as the database spells it.
///
/// The database is the one in the binary: a file that is right here is right on every machine.
pub(super) fn read(site: &Table<'_, '_>, findings: &mut Collector<'_>) -> Option<String> {
    let text = site.string("time_zone", findings)?;
    let database = TimeZoneDatabase::bundled();
    let zone = database.get(&text.value).ok().filter(|zone| !zone.is_unknown());
    if let Some(name) = zone.as_ref().and_then(|zone| zone.iana_name()) {
        return Some(name.to_owned());
    }
    let names: Vec<String> = database
        .available()
        .map(|name| name.as_str().to_owned())
        // Places alone: the signs of the others are the other way round than people write them.
        .filter(|name| name.contains('/') && !name.starts_with("Etc/"))
        .collect();
    let remedy = match suggestion(&text.value, &names) {
        Some(name) => format!("did you mean \"{name}\"?"),
        None => "write its name in the IANA database, such as \"Europe/Berlin\" or \"UTC\"".to_owned(),
    };
    findings.add(text.span, format!("`{}` is no time zone", shown(&text.value)), remedy);
    None
}

/// The zone of that city, or the one that is spelt almost so.
fn suggestion<'a>(word: &str, names: &'a [String]) -> Option<&'a str> {
    let city = word.rsplit('/').next().unwrap_or(word).trim().replace(' ', "_");
    let of_city =
        |name: &&String| name.rsplit_once('/').is_some_and(|(_, last)| last.eq_ignore_ascii_case(&city));
    let near = || names.chunks(250).find_map(|names| meant(word, names.iter().map(String::as_str)));
    names.iter().find(of_city).map(String::as_str).or_else(near)
}
