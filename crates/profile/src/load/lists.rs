//! Checks of the named lists of codes and bits, for themselves and for the point that uses them.

use std::collections::HashSet;
use std::ops::Range;

use super::Check;
use crate::file::{At, BitFile, BitListFile, ChoiceListFile, PointFile};
use crate::point::{Bit, Choice, Clear};
use crate::suggest::nearest;
use crate::terms::SignalKind;
use crate::value::BitSet;

/// Choices in ascending order, and the reserved ranges.
type Choices = (Vec<Choice>, Vec<(u32, u32)>);

impl Check<'_> {
    /// Every list for itself.
    pub(super) fn lists(&mut self) {
        let file = self.file;
        let points = || file.groups.iter().flat_map(|group| &group.points);
        for (name, list) in &file.choices {
            self.id(name);
            if !points().any(|point| point.choices.as_ref() == Some(name)) {
                self.unused(name, "choices");
            }
            self.choice_list(name, list);
        }
        for (name, list) in &file.bits {
            self.id(name);
            if !points().any(|point| point.bits.as_ref() == Some(name)) {
                self.unused(name, "bits");
            }
            self.bit_list(name, list);
        }
    }

    fn unused(&mut self, name: &At<String>, key: &str) {
        self.note(
            &name.span,
            format!("no point uses the list `{}`", **name),
            format!("remove it, or name it in a point: {key} = \"{}\"", **name),
        );
    }

    fn choice_list(&mut self, name: &At<String>, list: &ChoiceListFile) {
        if list.values.is_empty() {
            self.note(&name.span, format!("the list `{}` is empty", **name), "list its codes");
        }
        let mut codes = HashSet::new();
        let mut ids = HashSet::new();
        for choice in &list.values {
            self.id(&choice.id);
            self.text(&choice.label, &choice.span, "label");
            if !codes.insert(choice.value) {
                self.twice(&choice.span, &format!("the code {}", choice.value));
            }
            if !ids.insert(choice.id.as_str()) {
                self.twice(&choice.id.span, &format!("the id `{}`", *choice.id));
            }
            for model in choice.by_model.keys() {
                self.model(model);
            }
        }
        for range in &list.reserved {
            let (first, last) = **range;
            self.range(range, first > last);
            if let Some(code) = codes.iter().find(|code| (first..=last).contains(*code)) {
                self.named_and_reserved(range, &format!("the code {code}"));
            }
        }
    }

    fn bit_list(&mut self, name: &At<String>, list: &BitListFile) {
        if list.bits.is_empty() {
            self.note(&name.span, format!("the list `{}` is empty", **name), "list its bits");
        }
        let mut numbers = HashSet::new();
        let mut ids = HashSet::new();
        for bit in &list.bits {
            self.id(&bit.id);
            self.text(&bit.label, &bit.span, "label");
            if !numbers.insert(bit.bit) {
                self.twice(&bit.span, &format!("bit {}", bit.bit));
            }
            if !ids.insert(bit.id.as_str()) {
                self.twice(&bit.id.span, &format!("the id `{}`", *bit.id));
            }
            if let Some(signal) = &bit.signal {
                self.signal_of_kind(signal, SignalKind::Flag, "a bit");
            }
            self.clear(bit, list);
        }
        for range in &list.reserved {
            let (first, last) = **range;
            self.range(range, first > last);
            if let Some(bit) = numbers.iter().find(|bit| (first..=last).contains(*bit)) {
                self.named_and_reserved(range, &format!("bit {bit}"));
            }
        }
    }

    /// A clear bit tells the state only where no other bit does.
    fn clear(&mut self, bit: &BitFile, list: &BitListFile) {
        let Some(clear) = &bit.clear else {
            return;
        };
        self.text(&clear.label, &clear.span, "label");
        if bit.state.is_none() {
            let help = "add the state that the set bit stands for, or remove `clear`";
            self.note(&clear.span, "a state while it is clear, and none while it is set", help);
        } else if bit.state.as_ref() == Some(&clear.state) {
            let help = "correct one of the two";
            self.note(&clear.span, "the same state while it is set and while it is clear", help);
        }
        if list.bits.iter().filter(|other| other.state.is_some() || other.clear.is_some()).count() > 1 {
            let help = "remove `clear`, or the state of the other bits";
            self.note(&clear.span, "a clear bit tells nothing where other bits have states too", help);
        }
    }

    pub(super) fn twice(&mut self, span: &Range<usize>, what: &str) {
        self.note(span, format!("{what} is there twice in this list"), "correct one of the two");
    }

    fn range<T>(&mut self, range: &At<T>, is_backwards: bool) {
        if is_backwards {
            self.note(&range.span, "the range runs backwards", "write [first, last]");
        }
    }

    fn named_and_reserved<T>(&mut self, range: &At<T>, what: &str) {
        self.note(
            &range.span,
            format!("{what} is named and reserved"),
            "take it out of the list or out of this range",
        );
    }

    fn model(&mut self, model: &At<String>) {
        let identity = self.file.identity.as_ref();
        let known = identity.iter().flat_map(|identity| &identity.models).map(|known| &known.model);
        let mut known = known.chain(self.file.models.iter());
        if !known.any(|known| known == &**model) {
            self.note(
                &model.span,
                format!("`{}` is not a model of this profile", **model),
                "write a model of `models` or `[identity]`",
            );
        }
    }

    /// The choices of a point, in ascending order, and its reserved codes; `max` is the greatest code that fits.
    pub(super) fn choices_of(&mut self, point: &PointFile, max: u32) -> Option<Choices> {
        let Some(name) = &point.choices else {
            return Some(Default::default());
        };
        let file = self.file;
        let Some(list) = file.choices.get(name.as_str()) else {
            self.no_list(name, "choices", nearest(name, file.choices.keys().map(|key| key.as_str())));
            return None;
        };
        let mut choices = Vec::with_capacity(list.values.len());
        for choice in &list.values {
            if choice.value > max {
                self.note(
                    &choice.span,
                    format!(
                        "the code {} does not fit into `{}`, which ends at {max}",
                        choice.value, *point.id
                    ),
                    "correct the code, or the mask or type of the point",
                );
            }
            self.state(choice.state.as_ref(), point);
            choices.push(Choice {
                value: choice.value,
                id: choice.id.clone(),
                label: choice.label.clone(),
                by_model: choice
                    .by_model
                    .iter()
                    .map(|(model, label)| (model.to_string(), label.clone()))
                    .collect(),
                state: choice.state.as_deref().cloned(),
                timed: choice.timed.unwrap_or(true),
            });
        }
        choices.sort_by_key(|choice| choice.value);
        Some((choices, list.reserved.iter().map(|range| **range).collect()))
    }

    /// The named bits of a point, in ascending order, and its reserved ones.
    pub(super) fn bits_of(&mut self, point: &PointFile, size: u16) -> Option<(Vec<Bit>, BitSet)> {
        let Some(name) = &point.bits else {
            return Some(Default::default());
        };
        let file = self.file;
        let Some(list) = file.bits.get(name.as_str()) else {
            self.no_list(name, "bits", nearest(name, file.bits.keys().map(|key| key.as_str())));
            return None;
        };
        let class = point.class.as_deref().copied();
        let mut bits = Vec::with_capacity(list.bits.len());
        for bit in &list.bits {
            if bit.bit >= size {
                self.outside(&bit.span, &format!("bit {}", bit.bit), point, size);
            }
            self.state(bit.state.as_ref(), point);
            self.state(bit.clear.as_ref().map(|clear| &clear.state), point);
            bits.push(Bit {
                bit: bit.bit,
                id: bit.id.clone(),
                label: bit.label.clone(),
                class: bit.class.or(class),
                signal: bit.signal.as_deref().cloned(),
                state: bit.state.as_deref().cloned(),
                clear: bit
                    .clear
                    .as_ref()
                    .map(|clear| Clear { label: clear.label.clone(), state: String::clone(&clear.state) }),
                doubt: bit.doubt.clone(),
            });
        }
        bits.sort_by_key(|bit| bit.bit);
        let classed = bits.iter().filter(|bit| bit.class.is_some()).count();
        if classed != 0 && classed != bits.len() {
            self.note(
                &name.span,
                format!("some bits of `{}` have a class and some have none", *point.id),
                "add `class` to the point for those that have none of their own",
            );
        }
        let mut reserved = BitSet::EMPTY;
        for range in &list.reserved {
            let (first, last) = **range;
            if last >= size {
                self.outside(&range.span, &format!("the reserved bit {last}"), point, size);
            }
            // Never past the set, whatever the text says.
            (first..=last.min(BitSet::CAPACITY - 1)).for_each(|bit| reserved.insert(bit));
        }
        Some((bits, reserved))
    }

    fn no_list(&mut self, name: &At<String>, table: &str, meant: Option<&str>) {
        let help = match meant {
            Some(meant) => format!("write \"{meant}\""),
            None => format!("add [{table}.{}]", **name),
        };
        self.note(&name.span, format!("there is no list [{table}.{}]", **name), help);
    }

    fn outside(&mut self, span: &Range<usize>, what: &str, point: &PointFile, size: u16) {
        self.note(
            span,
            format!("{what} is outside the {size} bits of `{}`", *point.id),
            "correct the number of the bit, or the size of the point",
        );
    }

    /// A state is a word of the signal of the point that uses the list.
    fn state(&mut self, state: Option<&At<String>>, point: &PointFile) {
        let Some(state) = state else {
            return;
        };
        let signal = point.signal.as_ref().map(|signal| self.vocabulary.signal(signal));
        let words = match signal {
            Some(Some(signal)) if signal.kind == SignalKind::Words => &signal.words,
            // A signal that does not exist has been noted already.
            Some(None) => return,
            _ => {
                self.note(
                    &state.span,
                    format!("`{}` has no signal of words for this state", *point.id),
                    "give the point a signal such as state.engine or mode, or remove the state",
                );
                return;
            }
        };
        if !words.contains(&**state) {
            self.note(
                &state.span,
                format!("`{}` is not a word of the point's signal", **state),
                format!("write one of: {}", words.join(", ")),
            );
        }
    }
}
