//! Checks of the points against one another: ids, signals, timers, and who owns which bit of a register.

use std::collections::HashMap;

use super::Check;
use super::points::Draft;
use crate::codec::Codec;
use crate::file::At;
use crate::point::Point;
use crate::profile::{Group, Wire};
use crate::terms::DataType;
use crate::value::BitSet;

/// The points in their order, their groups and names.
pub(super) struct Layout {
    pub(super) points: Vec<Point>,
    pub(super) groups: Vec<Group>,
    /// Where a point stands; none for a point that has findings of its own.
    pub(super) by_id: HashMap<String, Option<usize>>,
}

impl<'a> Check<'a> {
    /// Every point, alone and against the others.
    pub(super) fn points(&mut self, wire: Option<&Wire>) -> Layout {
        let mut by_id = HashMap::new();
        let mut drafts = Vec::new();
        let file = self.file;
        for (group, head) in file.groups.iter().enumerate() {
            for point in &head.points {
                if by_id.insert(point.id.clone(), None).is_some() {
                    self.note(
                        &point.id.span,
                        format!("the point `{}` is there twice", *point.id),
                        "give each point an id of its own",
                    );
                    continue;
                }
                drafts.extend(self.point(point, group, wire));
            }
        }
        drafts.sort_by_key(|draft| (draft.point.address, draft.point.field.map_or(0, |(_, low)| low)));
        self.overlaps(&mut drafts);
        self.signals(&drafts);
        for (index, draft) in drafts.iter().enumerate() {
            by_id.insert(draft.point.id.clone(), Some(index));
        }
        let groups = self.groups(&by_id);
        let timers: Vec<_> = drafts.iter().map(|draft| draft.file.timer.as_ref()).collect();
        let points = drafts.iter().map(|draft| draft.point.clone()).collect();
        let mut layout = Layout { points, groups, by_id };
        self.timers(&timers, &mut layout);
        layout
    }

    fn groups(&mut self, by_id: &HashMap<String, Option<usize>>) -> Vec<Group> {
        let mut groups: Vec<Group> = Vec::with_capacity(self.file.groups.len());
        for group in &self.file.groups {
            self.id(&group.id);
            self.text(&group.title, &group.id.span, "title");
            if group.points.is_empty() {
                self.note(&group.id.span, format!("the group `{}` is empty", *group.id), "list its points");
            }
            if groups.iter().any(|other| other.id == *group.id) {
                self.note(
                    &group.id.span,
                    format!("the group `{}` is there twice", *group.id),
                    "give each group an id of its own",
                );
            }
            groups.push(Group {
                id: group.id.clone(),
                title: group.title.clone(),
                page: group.page,
                rate: group.rate,
                points: group.points.iter().filter_map(|point| *by_id.get(point.id.as_str())?).collect(),
            });
        }
        groups
    }

    /// Two points may share a register only as fields with disjoint bits.
    fn overlaps(&mut self, drafts: &mut [Draft<'_>]) {
        let mut longest = 0;
        for later in 0..drafts.len() {
            let address = drafts[later].point.address;
            // Only points that begin within the longest point before this one can reach it.
            for earlier in (0..later).rev() {
                if u32::from(drafts[earlier].point.address) + longest <= u32::from(address) {
                    break;
                }
                if drafts[earlier].point.last() >= address {
                    self.overlap(drafts, earlier, later);
                }
            }
            longest = longest.max(u32::from(drafts[later].point.registers));
        }
    }

    fn overlap(&mut self, drafts: &mut [Draft<'_>], earlier: usize, later: usize) {
        let (head, tail) = drafts.split_at_mut(later);
        let (one, other) = (&mut head[earlier], &mut tail[0]);
        let from = other.point.address;
        let to = one.point.last().min(other.point.last());
        for register in from..=to {
            let shared = claim(one, register) & claim(other, register);
            let both_sets = one.point.data_type == DataType::Bits && other.point.data_type == DataType::Bits;
            if shared != 0 || both_sets {
                self.note(
                    &other.file.at.span,
                    format!("`{}` overlaps `{}` in register {register}", other.point.id, one.point.id),
                    "correct `at`, `type` or `size`; fields of one register need masks that share no bit",
                );
                return;
            }
        }
        for register in from..=to {
            let (mine, others) = (claim(one, register), claim(other, register));
            give_away(one, register, others);
            give_away(other, register, mine);
        }
    }

    /// A signal is one thing of a device, so one point or bit carries it.
    fn signals(&mut self, drafts: &[Draft<'_>]) {
        let mut carriers: HashMap<&str, &str> = HashMap::new();
        for draft in drafts {
            let own = draft.file.signal.as_ref().map(|signal| (signal.as_str(), &signal.span));
            let span = draft.file.bits.as_ref().map_or(&draft.file.span, |bits| &bits.span);
            let flags = draft.point.bits.iter().filter_map(|bit| Some((bit.signal.as_deref()?, span)));
            for (signal, span) in own.into_iter().chain(flags) {
                if let Some(first) = carriers.insert(signal, &draft.point.id) {
                    self.note(
                        span,
                        format!("the signal `{signal}` is carried by `{first}` too"),
                        "keep it where the manual means it",
                    );
                }
            }
        }
    }

    fn timers(&mut self, timers: &[Option<&At<String>>], layout: &mut Layout) {
        for (index, timer) in timers.iter().enumerate() {
            let Some(timer) = timer else {
                continue;
            };
            let Some(target) = self.point_named(timer, layout) else {
                continue;
            };
            if !layout.points[target].data_type.is_numeric() {
                self.note(&timer.span, format!("`{}` is no number", ***timer), "name the point of the delay");
            }
            layout.points[index].timer = Some(target);
        }
    }
}

/// The bits of a register that a point owns.
fn claim(draft: &Draft<'_>, register: u16) -> u16 {
    let index = usize::from(register - draft.point.address);
    match &draft.point.codec {
        Codec::Number(codec) => codec.bits(),
        Codec::Choice(field, _) => field.bits(),
        Codec::Bits(_) => draft.claimed.register(index),
        _ => 0xFFFF,
    }
}

/// Bits of a register that belong to another point are not this one's.
fn give_away(draft: &mut Draft<'_>, register: u16, bits: u16) {
    let base = (register - draft.point.address) * 16;
    if let Codec::Bits(codec) = &mut draft.point.codec {
        let others: BitSet = (0..16).filter(|bit| bits >> bit & 1 == 1).map(|bit| base + bit).collect();
        codec.visible = codec.visible.difference(&others);
    }
}
