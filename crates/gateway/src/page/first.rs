//! The site as it stands now, as plain HTML in the document itself: there before any script, and without one.

use std::collections::BTreeMap;
use std::fmt::Write;

use jiff::Timestamp;
use serde::Serialize;

use super::tiles::{self, Tile};
use crate::api::types::{AlarmView, Class, Kind, PointsView, Quality, WireState};
use crate::device::{Device, points_view};
use crate::hub::Hub;

/// Most devices whose values are in the document: on a slow line every one of them costs a part of a second.
const MOST: usize = 24;

/// Most devices with which the page draws the diagram unasked, so that its first stream asks for what that shows.
const DRAWN: usize = 12;

/// Text as HTML, in content and in quotes.
struct Escaped<'a>(&'a str);

impl std::fmt::Display for Escaped<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut rest = self.0;
        while let Some(at) = rest.find(['&', '<', '>', '"', '\'']) {
            let (before, from) = rest.split_at(at);
            f.write_str(before)?;
            f.write_str(match from.as_bytes().first() {
                Some(b'&') => "&amp;",
                Some(b'<') => "&lt;",
                Some(b'>') => "&gt;",
                Some(b'"') => "&quot;",
                _ => "&#39;",
            })?;
            rest = from.get(1..).unwrap_or_default();
        }
        f.write_str(rest)
    }
}

/// The site now, and what the page needs to show more than that.
pub(super) fn html(hub: &Hub, now: Timestamp) -> String {
    let mut out = String::with_capacity(16 * 1024);
    // Writing to a string cannot fail.
    let _ = site(&mut out, hub, now);
    data(&mut out, "cards", &cards(hub));
    let table = hub.table();
    if !table.diagram.nodes.is_empty() && table.devices.len() <= DRAWN {
        data(&mut out, "diagram", &table.diagram);
    }
    out
}

/// What the page reads, under the id by which it finds it.
fn data(out: &mut String, id: &str, what: &impl Serialize) {
    // A text in it must not end the element.
    let json = serde_json::to_string(what).unwrap_or_default().replace('<', "\\u003c");
    let _ = write!(out, "<script type=\"application/json\" id=\"{id}\">{json}</script>");
}

/// What the cards show, by profile, so that the page need not ask for each device.
fn cards(hub: &Hub) -> BTreeMap<String, PointsView> {
    let mut cards = BTreeMap::new();
    for slot in &hub.table().devices {
        let profile = slot.lock().device.site().profile;
        cards.entry(profile.key.clone()).or_insert_with(|| {
            let mut points = points_view(profile).carrying(&tiles::signals(profile.kind.into()));
            // A card shows the label that came with the value.
            for point in points.groups.iter_mut().flat_map(|group| &mut group.points) {
                point.choices.clear();
            }
            points
        });
    }
    cards
}

fn site(out: &mut String, hub: &Hub, now: Timestamp) -> std::fmt::Result {
    let table = hub.table();
    let answering = table.devices.iter().filter(|slot| slot.lock().device.is_online()).count();
    let active = hub.alarms();
    let unsure = table.devices.iter().any(|slot| slot.lock().device.view().alarms_fault.is_some());
    writeln!(out, "<div id=\"first\">\n<h1>{}</h1>", Escaped(&hub.info().name))?;
    writeln!(
        out,
        "<p>As of {} UTC: <strong>{answering} of {}</strong> controllers answering</p>",
        now.strftime("%H:%M:%S"),
        table.devices.len()
    )?;
    out.push_str("<noscript><p>Without JavaScript nothing here changes by itself: load the page again for newer values.</p></noscript>\n");
    writeln!(out, "<p>{}</p>", alarms(&active, unsure))?;
    for wire in hub.wires().iter().filter(|wire| wire.state == WireState::Down).take(MOST) {
        let reason = wire.reason.as_deref().unwrap_or("not connected");
        writeln!(out, "<p><strong>Wire {} is down:</strong> {}</p>", Escaped(&wire.id), Escaped(reason))?;
    }
    out.push_str("<ul class=\"cards\">\n");
    for slot in table.devices.iter().take(MOST) {
        let live = slot.lock();
        device(out, &live.device)?;
    }
    out.push_str("</ul>\n");
    if table.devices.len() > MOST {
        writeln!(out, "<p>and {} more</p>", table.devices.len() - MOST)?;
    }
    out.push_str("</div>\n");
    Ok(())
}

fn device(out: &mut String, device: &Device) -> std::fmt::Result {
    let (view, active) = (device.view(), device.alarm_views());
    let model = view.model.clone().unwrap_or_else(|| view.models.join(" / "));
    let kind = match view.kind {
        Kind::Genset => "genset",
        Kind::TransferSwitch => "transfer switch",
        Kind::Compressor => "compressor",
    };
    writeln!(out, "<li class=\"panel\"><h2>{}</h2>", Escaped(&view.name))?;
    writeln!(out, "<p class=\"label\">{} {} · {kind}</p>", Escaped(&view.vendor), Escaped(&model))?;
    let state = view.state.as_ref().map_or("not known", |state| &state.label);
    let mode = view.mode.as_ref().map_or("not known", |mode| &mode.label);
    writeln!(
        out,
        "<p>State <strong>{}</strong> · Mode <strong>{}</strong></p>",
        Escaped(state),
        Escaped(mode)
    )?;
    match (&view.fault, view.last_seen) {
        (Some(fault), _) => writeln!(out, "<p><strong>{}</strong></p>", Escaped(fault))?,
        (None, None) => writeln!(out, "<p>No answer yet</p>")?,
        (None, Some(_)) => {}
    }
    writeln!(out, "<p>{}</p>\n<dl>", alarms(&active, view.alarms_fault.is_some()))?;
    for Tile { title, text, quality } in tiles::tiles(device) {
        let value = value(text.as_deref(), quality);
        writeln!(out, "<div><dt>{}</dt>{value}</div>", Escaped(title))?;
    }
    writeln!(out, "</dl></li>")
}

/// Nothing that is not good looks as if it were.
fn value(text: Option<&str>, quality: Quality) -> String {
    match (quality, text.map(Escaped)) {
        (Quality::Good, Some(text)) => format!("<dd>{text}</dd>"),
        (Quality::Stale, Some(text)) => format!("<dd class=\"stale\">{text} (stale)</dd>"),
        (Quality::Bad, Some(text)) => format!("<dd class=\"bad\"><s>{text}</s> (bad)</dd>"),
        (Quality::Bad, None) => "<dd class=\"none\">never read</dd>".to_owned(),
        (Quality::Stale, None) => "<dd class=\"none\">not read yet</dd>".to_owned(),
        (Quality::Good | Quality::Invalid, _) => "<dd class=\"none\">no data</dd>".to_owned(),
    }
}

/// How many, and the gravest; the list has the gravest first.
fn alarms(active: &[AlarmView], unsure: bool) -> String {
    let Some(first) = active.first() else {
        return if unsure { "Alarms not known" } else { "No active alarms" }.to_owned();
    };
    let class = match first.class {
        Class::Shutdown => "Shutdown",
        Class::LoadDump => "Load dump",
        Class::Trip => "Trip",
        Class::Warning => "Warning",
        Class::Indication | Class::Status => "Indication",
    };
    let count = match active.len() {
        1 => "1 active alarm".to_owned(),
        count => format!("{count} active alarms, the gravest"),
    };
    let doubt = if unsure { "; there may be more" } else { "" };
    format!("{count}: <strong>{class}: {}</strong>{doubt}", Escaped(&first.label))
}

#[cfg(test)]
mod tests {
    use busbar_profile::Rate;

    use super::*;
    use crate::stop;
    use crate::table::Table;
    use crate::testing::{answered, hub, profile, silence, table};

    const FAST: [u16; 12] = [5, 2, 7, 0, 2302, 0, 215, 0, 0, 0, 0, 0];

    fn now() -> Timestamp {
        "2026-11-23T10:15:30.5Z".parse().unwrap()
    }

    fn read(hub: &Hub, device: usize, registers: &[u16]) {
        hub.finish(&hub.table().devices[device], answered(Rate::Fast, &[(100, registers)]));
    }

    #[test]
    fn the_site_is_told_with_its_values_and_when_they_were() {
        let hub = hub(&["gen1", "gen2"], stop::channel().1);
        let mut alarmed = FAST;
        alarmed[10] = 1;
        read(&hub, 0, &alarmed);
        let html = html(&hub, now());
        for words in [
            "<h1>Test</h1>",
            "As of 10:15:30 UTC: <strong>1 of 2</strong> controllers answering",
            "<p>1 active alarm: <strong>Shutdown: Low oil pressure</strong>; there may be more</p>",
            "<h2>Genset 1</h2>",
            "<p class=\"label\">Acme T-1 / T-2 · genset</p>",
            "State <strong>Cranking</strong> · Mode <strong>MANUAL / RUN</strong>",
            "<dt>Genset voltage</dt><dd>230.2 V</dd>",
            "State <strong>not known</strong> · Mode <strong>not known</strong>",
            "<p>No answer yet</p>",
            "<p>Alarms not known</p>",
            "<dt>Genset voltage</dt><dd class=\"none\">not read yet</dd>",
        ] {
            assert!(html.contains(words), "{words}\n{html}");
        }
    }

    #[test]
    fn what_is_not_good_is_never_told_as_if_it_were() {
        let good = "<dd>";
        assert!(value(Some("230 V"), Quality::Good).starts_with(good));
        for quality in [Quality::Stale, Quality::Bad, Quality::Invalid] {
            for text in [Some("230 V"), None] {
                assert!(!value(text, quality).starts_with(good), "{quality:?}");
            }
        }
        let hub = hub(&["gen1"], stop::channel().1);
        read(&hub, 0, &FAST);
        hub.finish(&hub.table().devices[0], silence());
        let html = html(&hub, now());
        assert!(html.contains("<dd class=\"bad\"><s>230.2 V</s> (bad)</dd>"), "{html}");
        assert!(html.contains("Genset 1 cannot be read: ") && html.contains("0 of 1"), "{html}");
        assert!(html.contains("State <strong>not known</strong>"), "{html}");
    }

    #[test]
    fn names_are_text_however_they_look() {
        let name = format!("</script><script>alert('1')</script>&\"{}", "x".repeat(200));
        let hub = Hub::new(Table { name, ..table(&["gen1"]) }, stop::channel().1);
        let html = html(&hub, now());
        assert!(!html.contains("<script>"), "{html}");
        assert!(
            html.contains("&lt;/script&gt;&lt;script&gt;alert(&#39;1&#39;)&lt;/script&gt;&amp;&quot;xxx")
        );
        assert_eq!(html.matches("</script>").count(), 1);
    }

    #[test]
    fn of_many_devices_some_are_told_and_the_rest_is_counted() {
        let ids: Vec<String> = (0..40).map(|id| format!("gen{id}")).collect();
        let hub = hub(&ids.iter().map(String::as_str).collect::<Vec<_>>(), stop::channel().1);
        let html = html(&hub, now());
        assert_eq!(html.matches("<h2>").count(), MOST);
        assert!(html.contains("<p>and 16 more</p>") && html.contains("0 of 40"), "{html}");
        assert_eq!(html.matches("\"tiny\":").count(), 1, "a profile once");
    }

    #[test]
    fn the_page_learns_how_the_site_is_connected() {
        use crate::api::types::{DiagramView, NodeKind, NodeView};
        let of = |ids: &[&str]| {
            let name = "</script><b>".to_owned();
            let node =
                NodeView { id: "n".to_owned(), kind: NodeKind::Bus, name, device: None, signals: None };
            let diagram = DiagramView { nodes: vec![node], connections: vec![] };
            html(&Hub::new(Table { diagram, ..table(ids) }, stop::channel().1), now())
        };
        let html = of(&["gen1"]);
        let (_, json) = html.split_once("id=\"diagram\">").unwrap();
        let diagram: serde_json::Value =
            serde_json::from_str(json.strip_suffix("</script>").unwrap()).unwrap();
        assert_eq!(diagram["nodes"][0]["name"], "</script><b>");
        let many: Vec<String> = (0..=DRAWN).map(|id| format!("gen{id}")).collect();
        assert!(!of(&many.iter().map(String::as_str).collect::<Vec<_>>()).contains("id=\"diagram\""));
    }

    #[test]
    fn the_page_learns_what_the_cards_show() {
        let hub = hub(&["gen1"], stop::channel().1);
        let html = html(&hub, now());
        let (_, json) = html.split_once("id=\"cards\">").unwrap();
        let cards: serde_json::Value = serde_json::from_str(json.strip_suffix("</script>").unwrap()).unwrap();
        let tiny = &cards[&profile().key];
        assert_eq!(tiny["groups"][0]["points"][0]["signal"], "genset.l1.voltage");
        assert_eq!(tiny["groups"].as_array().unwrap().len(), 1, "{tiny}");
    }
}
