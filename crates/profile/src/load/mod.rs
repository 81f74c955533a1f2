//! From text to a checked profile or vocabulary.

mod commands;
mod conditions;
mod joined;
mod layout;
mod lint;
mod lists;
mod points;
mod scale;
mod settings;
mod shape;
mod vocabulary;
mod wire;

use std::ops::Range;
use std::sync::Arc;

use crate::file::{
    At, BitFile, ChoiceFile, CoilFile, CommandFile, GroupFile, JoinedFile, PointFile, ProfileFile,
    SettingFile,
};
use crate::findings::{Collector, Findings};
use crate::image::Outline;
use crate::profile::{Coil, Identity, IdentityModel, Manual, Profile};
use crate::suggest::nearest;
use crate::terms::DataType;
use crate::vocabulary::Vocabulary;

pub(crate) use vocabulary::parse as parse_vocabulary;

/// The version of the format that this build reads.
const FORMAT: u16 = 1;

/// The long lists of a profile, innermost first.
const PRUNES: &[shape::Prune] = &[
    |table, collector| shape::prune::<ChoiceFile>(table, &["choices", "*", "values"], collector),
    |table, collector| shape::prune::<BitFile>(table, &["bits", "*", "bits"], collector),
    |table, collector| shape::prune::<PointFile>(table, &["groups", "*", "points"], collector),
    |table, collector| shape::prune::<GroupFile>(table, &["groups"], collector),
    |table, collector| shape::prune::<JoinedFile>(table, &["joined"], collector),
    |table, collector| shape::prune::<CoilFile>(table, &["coils"], collector),
    |table, collector| shape::prune::<CommandFile>(table, &["commands"], collector),
    |table, collector| shape::prune::<SettingFile>(table, &["emulator", "settings"], collector),
];

/// Reads and checks a profile.
pub(crate) fn parse(file_name: &str, text: &str, vocabulary: &Vocabulary) -> Result<Profile, Findings> {
    let mut collector = Collector::new(file_name, text);
    let Some(file) = shape::read::<ProfileFile>(text, PRUNES, &mut collector) else {
        return Err(collector.into_findings());
    };
    let mut check = Check { collector, file: &file, vocabulary };
    check.head();
    let wire = check.wire();
    check.lists();
    let layout = check.points(wire.as_ref());
    let identity = check.identity(&layout);
    let coils = check.coils();
    let joined = check.joined(&layout);
    let commands = check.commands(&layout, &joined, wire.as_ref());
    let settings = check.settings(&layout);
    let Check { collector, .. } = check;
    let (Some(wire), true) = (wire, collector.is_empty()) else {
        return Err(collector.into_findings());
    };
    let layout::Layout { points, groups, by_id } = layout;
    let outline = Arc::new(Outline::new(&wire.readable, &points));
    Ok(Profile {
        key: file.key.clone(),
        vendor: file.vendor.clone(),
        models: file.models.clone(),
        kind: file.kind,
        manual: Manual { title: file.manual.title.clone(), revision: file.manual.revision.clone() },
        identity,
        wire,
        groups,
        points,
        coils,
        commands,
        settings,
        by_id: by_id.into_iter().filter_map(|(id, index)| Some((id, index?))).collect(),
        joined,
        outline,
    })
}

/// The checks of one file, and what they have found so far.
struct Check<'a> {
    collector: Collector<'a>,
    file: &'a ProfileFile,
    vocabulary: &'a Vocabulary,
}

impl Check<'_> {
    fn note(&mut self, span: &Range<usize>, message: impl Into<String>, help: impl Into<String>) {
        self.collector.add(span.clone(), message, help);
    }

    /// An id is what programs and people write: it must be plain.
    fn id(&mut self, id: &At<String>) {
        let mut bytes = id.bytes();
        let starts_well = bytes.next().is_some_and(|first| first.is_ascii_lowercase());
        if !starts_well || !bytes.all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_') {
            self.note(
                &id.span,
                format!("`{}` is not an id", **id),
                "write lower-case letters, digits and _, beginning with a letter",
            );
        }
    }

    /// A text that people read; `what` names it.
    fn text(&mut self, text: &str, span: &Range<usize>, what: &str) {
        if text.trim().is_empty() || text.trim() != text {
            self.note(
                span,
                format!("the {what} is empty or has spaces around it"),
                format!("write a {what} without spaces around it"),
            );
        }
    }

    fn head(&mut self) {
        let file = self.file;
        if *file.format != FORMAT {
            self.note(
                &file.format.span,
                format!("format {} is not known to this version", *file.format),
                format!("write format = {FORMAT}"),
            );
        }
        let key = &file.key;
        let is_plain = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-';
        if key.is_empty() || !key.bytes().all(is_plain) {
            self.note(
                &key.span,
                format!("`{}` is not a profile key", **key),
                "write lower-case letters, digits and hyphens, such as datakom-d",
            );
        }
        self.text(&file.vendor, &file.vendor.span, "vendor");
        if file.models.is_empty() {
            self.note(&file.models.span, "no model", "name the models that the manual covers");
        }
        if file.manual.title.trim().is_empty() {
            self.note(&key.span, "the manual has no title", "write its title under [manual]");
        }
    }

    fn identity(&mut self, layout: &layout::Layout) -> Option<Identity> {
        let file = self.file.identity.as_ref()?;
        let mut models: Vec<IdentityModel> = Vec::with_capacity(file.models.len());
        for model in &file.models {
            if models.iter().any(|other| other.value == model.value) {
                self.note(
                    &model.span,
                    format!("the code {:#06X} is there twice", model.value),
                    "keep one of the two",
                );
            }
            models.push(IdentityModel { value: model.value, model: model.model.clone() });
        }
        let point = self.point_named(&file.point, layout)?;
        let target = &layout.points[point];
        let is_code = target.data_type.is_numeric() || target.data_type == DataType::Choice;
        if target.registers != 1 || !is_code || !target.access.is_readable() {
            self.note(
                &file.point.span,
                format!("`{}` cannot tell the model", target.id),
                "name a number or choice of one register that can be read",
            );
        }
        Some(Identity { point, models })
    }

    /// Where a point stands; none if there is none of that name (noted) or it has findings of its own.
    fn point_named(&mut self, name: &At<String>, layout: &layout::Layout) -> Option<usize> {
        if let Some(index) = layout.by_id.get(name.as_str()) {
            return *index;
        }
        let help = match nearest(name, layout.by_id.keys().map(String::as_str)) {
            Some(meant) => format!("write `{meant}`"),
            None => "name a point of this file".to_owned(),
        };
        self.note(&name.span, format!("there is no point `{}`", **name), help);
        None
    }

    fn coils(&mut self) -> Vec<Coil> {
        let mut coils: Vec<Coil> = Vec::with_capacity(self.file.coils.len());
        for coil in &self.file.coils {
            self.id(&coil.id);
            self.text(&coil.name, &coil.span, "name");
            if coils.iter().any(|other| other.id == *coil.id) {
                self.note(
                    &coil.id.span,
                    format!("the coil `{}` is there twice", *coil.id),
                    "give each coil an id of its own",
                );
            }
            if coils.iter().any(|other| other.address == coil.at) {
                self.note(
                    &coil.span,
                    format!("coil {} is there twice", coil.at),
                    "correct the address, or remove one of the two",
                );
            }
            coils.push(Coil {
                address: coil.at,
                id: coil.id.clone(),
                name: coil.name.clone(),
                page: coil.page,
            });
        }
        coils.sort_by_key(|coil| coil.address);
        coils
    }
}
