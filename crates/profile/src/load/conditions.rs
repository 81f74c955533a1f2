//! Checks of the comparisons in commands: what is compared, and with what.

use std::ops::Range;

use super::Check;
use super::commands::Scope;
use super::layout::Layout;
use crate::command::{Arg, ArgRef, ArgValues, Condition, Subject, Test};
use crate::file::{At, ConditionFile, HoldConditionFile, ProofFile};
use crate::terms::{DataType, TimePart};

/// The parts of a comparison, which preconditions, holds and proofs spell alike.
#[derive(Default)]
pub(super) struct Comparison<'a> {
    span: Range<usize>,
    point: Option<&'a At<String>>,
    arg: Option<&'a At<String>>,
    bit: Option<&'a At<u16>>,
    equals: Option<u32>,
    not_equals: Option<u32>,
    between: Option<&'a At<(u32, u32)>>,
    equals_arg: Option<&'a At<String>>,
    changes: Option<&'a At<bool>>,
}

impl<'a> Comparison<'a> {
    pub(super) fn of_proof(file: &'a At<ProofFile>) -> Self {
        Self {
            span: file.span.clone(),
            point: file.point.as_ref(),
            arg: None,
            bit: file.bit.as_ref(),
            equals: file.equals,
            not_equals: file.not_equals,
            between: file.between.as_ref(),
            equals_arg: file.equals_arg.as_ref(),
            changes: file.changes.as_ref(),
        }
    }

    fn of_condition(file: &'a At<ConditionFile>) -> Self {
        Self {
            span: file.span.clone(),
            point: Some(&file.point),
            bit: file.bit.as_ref(),
            equals: file.equals,
            not_equals: file.not_equals,
            between: file.between.as_ref(),
            equals_arg: file.equals_arg.as_ref(),
            ..Self::default()
        }
    }

    fn of_hold(file: &'a At<HoldConditionFile>) -> Self {
        Self {
            span: file.span.clone(),
            point: file.point.as_ref(),
            arg: file.arg.as_ref(),
            bit: file.bit.as_ref(),
            equals: file.equals,
            not_equals: file.not_equals,
            between: file.between.as_ref(),
            equals_arg: file.equals_arg.as_ref(),
            changes: None,
        }
    }
}

impl Check<'_> {
    pub(super) fn conditions(&mut self, files: &[At<ConditionFile>], scope: &Scope<'_>) -> Vec<Condition> {
        files.iter().filter_map(|file| self.condition(&Comparison::of_condition(file), scope)).collect()
    }

    pub(super) fn hold_conditions(
        &mut self,
        files: &[At<HoldConditionFile>],
        scope: &Scope<'_>,
    ) -> Vec<Condition> {
        files.iter().filter_map(|file| self.condition(&Comparison::of_hold(file), scope)).collect()
    }

    pub(super) fn condition(&mut self, file: &Comparison<'_>, scope: &Scope<'_>) -> Option<Condition> {
        let (name, subject, limit) = self.subject(file, scope)?;
        let mut tests = Vec::new();
        tests.extend(file.equals.map(Test::Equals));
        tests.extend(file.not_equals.map(Test::NotEquals));
        tests.extend(file.between.map(|range| Test::Between(range.0..=range.1)));
        if let Some(name) = file.equals_arg {
            tests.push(Test::EqualsArg(self.arg_number(name, scope.args)?));
        }
        if file.changes.is_some_and(|changes| **changes) {
            tests.push(Test::Changes);
        }
        let (Some(test), true) = (tests.pop(), tests.is_empty()) else {
            self.note(
                &file.span,
                format!("`{name}` is compared with nothing, or with two things"),
                "write one comparison: equals, not_equals, between, equals_arg, or in a proof changes = true",
            );
            return None;
        };
        let fits = match &test {
            Test::Equals(code) | Test::NotEquals(code) => *code <= limit,
            Test::Between(range) => !range.is_empty() && *range.end() <= limit,
            Test::EqualsArg(_) | Test::Changes => true,
        };
        if !fits {
            self.note(
                &file.span,
                format!("`{name}` can never be compared so"),
                format!("write raw codes from 0 to {limit}"),
            );
        }
        Some(Condition { subject, test })
    }

    /// What is compared, by which name, and the greatest raw code that the comparison can meet.
    fn subject<'n>(&mut self, file: &Comparison<'n>, scope: &Scope<'_>) -> Option<(&'n str, Subject, u32)> {
        match (file.point, file.arg) {
            (Some(name), None) => {
                let point = self.readable_point(name, scope.layout)?;
                let limit = self.compared(file, name, point, scope.layout)?;
                Some((name, Subject::Point { point, bit: file.bit.map(|bit| **bit) }, limit))
            }
            (None, Some(name)) if file.bit.is_none() => {
                let arg = self.arg_number(name, scope.args)?;
                let limit = arg.part.map_or(u16::MAX, |part| part.range().1);
                Some((name, Subject::Arg(arg), u32::from(limit)))
            }
            _ => {
                self.note(
                    &file.span,
                    "it is not clear what is compared",
                    "write point, or arg without a bit",
                );
                None
            }
        }
    }

    /// The greatest raw code that a comparison can meet; notes what cannot be compared.
    fn compared(
        &mut self,
        file: &Comparison<'_>,
        name: &At<String>,
        point: usize,
        layout: &Layout,
    ) -> Option<u32> {
        let target = &layout.points[point];
        match (target.data_type, file.bit) {
            (DataType::Bits, Some(bit)) => {
                if target.bit(**bit).is_none() {
                    self.note(
                        &bit.span,
                        format!("`{}` has no named bit {}", target.id, **bit),
                        "write the number of a bit of its list",
                    );
                    return None;
                }
                Some(1)
            }
            (DataType::Bits, None) => {
                self.note(&name.span, format!("`{}` is a set of bits", target.id), "add bit = its number");
                None
            }
            (kind, None) if kind.is_numeric() || kind == DataType::Choice => {
                Some(if target.registers == 2 { u32::MAX } else { 0xFFFF })
            }
            (kind, _) => {
                self.note(
                    &file.span,
                    format!("a point of type {kind} cannot be compared so"),
                    "name a number, a choice, or one bit of a set",
                );
                None
            }
        }
    }

    pub(super) fn readable_point(&mut self, name: &At<String>, layout: &Layout) -> Option<usize> {
        let point = self.point_named(name, layout)?;
        if !layout.points[point].access.is_readable() {
            self.note(&name.span, format!("`{}` cannot be read", **name), "name a point that can");
            return None;
        }
        Some(point)
    }

    /// The number that `NAME`, or `NAME.PART` of a time, stands for.
    pub(super) fn arg_number(&mut self, name: &At<String>, args: &[Arg]) -> Option<ArgRef> {
        let (head, part) = match name.split_once('.') {
            Some((head, part)) => (head, Some(part)),
            None => (name.as_str(), None),
        };
        let Some(arg) = args.iter().position(|arg| arg.name == head) else {
            self.note(&name.span, format!("the command has no argument `{head}`"), "name one of `args`");
            return None;
        };
        let is_time = matches!(args[arg].values, ArgValues::Time { .. });
        match (is_time, part.map(str::parse::<TimePart>)) {
            (false, None) => Some(ArgRef { arg, part: None }),
            (true, Some(Ok(part))) => Some(ArgRef { arg, part: Some(part) }),
            (false, Some(_)) => {
                self.note(
                    &name.span,
                    format!("`{head}` is a number without parts"),
                    format!("write `{head}`"),
                );
                None
            }
            (true, _) => {
                let parts: Vec<_> = TimePart::ALL.iter().map(|part| format!("{head}.{part}")).collect();
                self.note(
                    &name.span,
                    format!("`{}` is no number of the time `{head}`", **name),
                    format!("write one of: {}", parts.join(", ")),
                );
                None
            }
        }
    }
}
