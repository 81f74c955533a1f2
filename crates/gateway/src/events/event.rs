//! One event as text, written once for all readers, and the part of it that a reader wants.

use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use axum::body::Bytes;
use busbar_profile::{Profile, Rate};
use serde::Serialize;

use super::deflate;
use super::filter::Wanted;
use crate::api::types::Time;
use crate::device::{Changes, Device};

/// So many readers' choices of an event are kept; who chooses otherwise pays for it alone.
const MOST_CHOICES: usize = 2;

/// The text of one or more events, compressed at most once.
#[derive(Debug, Clone)]
pub(super) struct Frame(Arc<Text>);

#[derive(Debug)]
struct Text {
    plain: Bytes,
    packed: OnceLock<Bytes>,
}

impl Frame {
    fn new(plain: Vec<u8>) -> Self {
        Self(Arc::new(Text { plain: plain.into(), packed: OnceLock::new() }))
    }

    pub(super) fn plain(&self) -> &Bytes {
        &self.0.plain
    }

    pub(super) fn packed(&self) -> &Bytes {
        self.0.packed.get_or_init(|| deflate::piece(&self.0.plain))
    }
}

/// What an event is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum About {
    /// One device.
    Device {
        key: u64,
        /// Counts up for each device.
        sequence: u64,
    },
    /// What is known of the site file.
    Site,
    /// The devices and wires themselves are others, for the so-manieth time.
    Exchanged(u64),
}

/// An event before it has its place among the others.
#[derive(Debug)]
pub(crate) struct Draft {
    about: About,
    /// All but its id and the blank line that ends it.
    text: Vec<u8>,
    parts: Option<Parts>,
}

/// Where in the text of a `values` event its values are.
#[derive(Debug)]
struct Parts {
    profile: &'static Profile,
    rate: Rate,
    /// What is behind `"changed":[`.
    changed: Row,
    /// What is behind `"joined":[`.
    joined: Row,
}

/// The elements of an array, with a comma between each two.
#[derive(Debug)]
struct Row {
    start: usize,
    /// What it is of and where its text ends.
    ends: Vec<(usize, usize)>,
}

impl Draft {
    /// A finished round of one rate.
    pub(crate) fn values(
        (key, sequence): (u64, u64),
        device: &Device,
        (rate, ts): (Rate, Time),
        changes: &Changes,
    ) -> Option<Self> {
        #[derive(Serialize)]
        struct Head<'a> {
            device: &'a str,
            rate: crate::api::types::Rate,
            ts: Time,
        }
        let head = Head { device: &device.site().id, rate: rate.into(), ts };
        let mut text = Vec::new();
        begin(&mut text, "values", &head).ok()?;
        text.pop();
        text.extend_from_slice(b",\"changed\":[");
        let changed = changes.values.iter().filter(|point| device.shows(**point));
        let changed = row(&mut text, changed.map(|point| (*point, device.value(*point)))).ok()?;
        text.extend_from_slice(b"],\"joined\":[");
        let joined = changes.joined.iter().map(|signal| (*signal, device.joined(*signal)));
        let joined = row(&mut text, joined).ok()?;
        text.extend_from_slice(b"]}");
        let parts = Some(Parts { profile: device.site().profile, rate, changed, joined });
        Some(Self { about: About::Device { key, sequence }, text, parts })
    }

    /// What is wholly for everybody who hears of the device.
    pub(crate) fn device((key, sequence): (u64, u64), name: &str, data: &impl Serialize) -> Option<Self> {
        let mut text = Vec::new();
        begin(&mut text, name, data).ok()?;
        Some(Self { about: About::Device { key, sequence }, text, parts: None })
    }

    pub(crate) fn site(data: &impl Serialize) -> Option<Self> {
        let mut text = Vec::new();
        begin(&mut text, "site", data).ok()?;
        Some(Self { about: About::Site, text, parts: None })
    }

    /// Is never sent: a snapshot is, in its place.
    pub(crate) fn exchanged(generation: u64) -> Self {
        Self { about: About::Exchanged(generation), text: Vec::new(), parts: None }
    }

    pub(super) fn with_id(mut self, id: &str) -> Event {
        let end = self.text.len();
        ended(&mut self.text, Some(id));
        self.text.shrink_to_fit();
        Event {
            about: self.about,
            frame: Frame::new(self.text),
            end,
            parts: self.parts,
            choices: Mutex::default(),
        }
    }
}

/// An event in its place.
#[derive(Debug)]
pub(super) struct Event {
    pub(super) about: About,
    frame: Frame,
    /// Where its id begins.
    end: usize,
    parts: Option<Parts>,
    /// What those of them who are many have chosen of it; none where it is nothing to them.
    choices: Mutex<Vec<(u64, Option<Frame>)>>,
}

impl Event {
    /// What it may take of memory, all that is made of it later included.
    pub(super) fn weight(&self) -> usize {
        let rows = self.parts.as_ref().map_or(0, |parts| parts.changed.ends.len() + parts.joined.ends.len());
        size_of::<Self>()
            + rows * size_of::<(usize, usize)>()
            // Plain and compressed.
            + (self.frame.plain().len() + size_of::<Text>()) * 2 * (1 + MOST_CHOICES)
    }

    /// The whole of it.
    pub(super) fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Whose values it holds; none where it is whole for everybody.
    pub(super) fn profile(&self) -> Option<&'static Profile> {
        self.parts.as_ref().map(|parts| parts.profile)
    }

    /// What is wanted of it; none where nothing is.
    pub(super) fn choice(&self, wanted: &Arc<Wanted>) -> Option<Frame> {
        let Some(parts) = &self.parts else { return Some(self.frame.clone()) };
        let known = |choices: &[(u64, Option<Frame>)]| {
            choices.iter().find(|(id, _)| *id == wanted.id).map(|(_, frame)| frame.clone())
        };
        if let Some(frame) = known(&self.choices.lock().unwrap_or_else(PoisonError::into_inner)) {
            return frame;
        }
        let frame = self.choose(parts, wanted);
        // Kept for the others who want the same, if there are any.
        if Arc::strong_count(wanted) > 1 {
            let mut choices = self.choices.lock().unwrap_or_else(PoisonError::into_inner);
            if choices.len() < MOST_CHOICES && known(&choices).is_none() {
                choices.push((wanted.id, frame.clone()));
            }
        }
        frame
    }

    fn choose(&self, parts: &Parts, wanted: &Wanted) -> Option<Frame> {
        let plain = self.frame.plain();
        let changed = parts.changed.elements(|point| wanted.has_point(point));
        let joined = parts.joined.elements(|signal| wanted.has_joined(signal));
        if changed.is_empty() && joined.is_empty() && !wanted.has_rate(parts.rate) {
            return None;
        }
        if (changed.len(), joined.len()) == (parts.changed.ends.len(), parts.joined.ends.len()) {
            return Some(self.frame.clone());
        }
        let mut text = plain[..parts.changed.start].to_vec();
        let mut put = |elements: Vec<Range<usize>>, behind: Range<usize>| {
            for (place, element) in elements.into_iter().enumerate() {
                if place > 0 {
                    text.push(b',');
                }
                text.extend_from_slice(&plain[element]);
            }
            text.extend_from_slice(&plain[behind]);
        };
        put(changed, parts.changed.end()..parts.joined.start);
        put(joined, parts.joined.end()..self.end);
        text.extend_from_slice(&plain[self.end..]);
        Some(Frame::new(text))
    }
}

impl Row {
    fn end(&self) -> usize {
        self.ends.last().map_or(self.start, |(_, end)| *end)
    }

    fn elements(&self, wanted: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
        let starts = std::iter::once(self.start).chain(self.ends.iter().map(|(_, end)| end + 1));
        let elements = starts.zip(&self.ends);
        elements.filter(|(_, (of, _))| wanted(*of)).map(|(start, (_, end))| start..*end).collect()
    }
}

/// Appends one whole event. JSON has no line breaks of its own, so one `data` line holds it.
///
/// Our types serialise; should one ever not, its event is left out rather than sent broken.
pub(super) fn put(out: &mut Vec<u8>, name: &str, data: &impl Serialize, id: Option<&str>) {
    let start = out.len();
    match begin(out, name, data) {
        Ok(()) => ended(out, id),
        Err(_) => out.truncate(start),
    }
}

fn begin(out: &mut Vec<u8>, name: &str, data: &impl Serialize) -> serde_json::Result<()> {
    out.extend_from_slice(b"event: ");
    out.extend_from_slice(name.as_bytes());
    out.extend_from_slice(b"\ndata: ");
    serde_json::to_writer(out, data)
}

/// Appends what ends an event.
pub(super) fn ended(out: &mut Vec<u8>, id: Option<&str>) {
    if let Some(id) = id {
        out.extend_from_slice(b"\nid: ");
        out.extend_from_slice(id.as_bytes());
    }
    out.extend_from_slice(b"\n\n");
}

/// Appends the elements of an array, and keeps where they are.
fn row<T: Serialize>(
    out: &mut Vec<u8>,
    elements: impl Iterator<Item = (usize, T)>,
) -> serde_json::Result<Row> {
    let mut row = Row { start: out.len(), ends: Vec::new() };
    for (of, element) in elements {
        if !row.ends.is_empty() {
            out.push(b',');
        }
        serde_json::to_writer(&mut *out, &element)?;
        row.ends.push((of, out.len()));
    }
    row.ends.shrink_to_fit();
    Ok(row)
}
