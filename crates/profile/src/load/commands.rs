//! Checks of the remote commands.

use std::ops::Range;

use super::Check;
use super::layout::Layout;
use crate::command::{
    Arg, ArgChoice, ArgValues, Command, Condition, Evidence, Proof, ProofStep, Test, Write, WriteValue,
};
use crate::file::{ArgFile, At, CommandFile, ConditionFile, ProofFile, WriteFile};
use crate::profile::Wire;
use crate::terms::DataType;

/// What function 5 can write.
const COIL_VALUES: [u16; 2] = [0xFF00, 0x0000];

/// The parts of a condition, which a proof step spells alike.
struct Comparison<'a> {
    span: &'a Range<usize>,
    point: &'a At<String>,
    bit: Option<&'a At<u16>>,
    equals: Option<u32>,
    not_equals: Option<u32>,
    between: Option<&'a At<(u32, u32)>>,
    equals_arg: Option<&'a At<String>>,
    changes: Option<&'a At<bool>>,
}

impl<'a> Check<'a> {
    /// Every command.
    pub(super) fn commands(&mut self, layout: &Layout, wire: Option<&Wire>) -> Vec<Command> {
        let file = self.file;
        let mut commands: Vec<Command> = Vec::with_capacity(file.commands.len());
        for command in &file.commands {
            self.id(&command.id);
            self.text(&command.name, &command.id.span, "name");
            if file
                .commands
                .iter()
                .any(|other| other.id == command.id && other.span.start < command.span.start)
            {
                self.note(
                    &command.id.span,
                    format!("the command `{}` is there twice", *command.id),
                    "give each command an id of its own",
                );
            }
            commands.extend(self.command(command, layout, wire));
        }
        commands
    }

    fn command(&mut self, file: &At<CommandFile>, layout: &Layout, wire: Option<&Wire>) -> Option<Command> {
        let args = self.args(&file.args);
        let require = self.conditions(&file.require, &args, layout);
        let already = self.conditions(&file.already, &args, layout);
        let write = self.write(&file.write, &args, layout, wire);
        let proof = self.proof(file, &args, layout);
        Some(Command {
            id: file.id.clone(),
            name: file.name.clone(),
            risk: file.risk,
            role: file.role,
            confirm: file.confirm,
            page: file.page,
            args,
            require,
            already,
            write: write?,
            proof: proof?,
        })
    }

    fn args(&mut self, files: &[At<ArgFile>]) -> Vec<Arg> {
        let mut args: Vec<Arg> = Vec::with_capacity(files.len());
        for file in files {
            self.id(&file.name);
            if args.iter().any(|other| other.name == *file.name) {
                self.note(
                    &file.name.span,
                    format!("the argument `{}` is there twice", *file.name),
                    "give each argument a name of its own",
                );
            }
            let values = match (&file.choices, file.min, file.max) {
                (Some(choices), None, None) => self.arg_choices(choices),
                (None, Some(min), Some(max)) if min <= max => ArgValues::Range(min..=max),
                _ => {
                    self.note(
                        &file.span,
                        format!("nothing says what `{}` can be", *file.name),
                        "write either choices, or min and max",
                    );
                    ArgValues::Range(0..=u16::MAX)
                }
            };
            let mut arg = Arg { name: file.name.clone(), values, default: None };
            if let Some(default) = &file.default {
                arg.default = arg.parse(default);
                if arg.default.is_none() {
                    self.note(
                        &default.span,
                        format!("`{}` cannot be `{}`", *file.name, **default),
                        "write what a person could write there",
                    );
                }
            }
            args.push(arg);
        }
        args
    }

    fn arg_choices(&mut self, files: &At<Vec<At<crate::file::ArgChoiceFile>>>) -> ArgValues {
        let mut choices: Vec<ArgChoice> = Vec::with_capacity(files.len());
        if files.is_empty() {
            self.note(&files.span, "an argument that can be nothing", "list what it can be");
        }
        for file in files.iter() {
            self.id(&file.id);
            if choices.iter().any(|other| other.id == *file.id || other.value == file.value) {
                self.note(
                    &file.span,
                    format!("`{}` or its value is there twice", *file.id),
                    "give each choice an id and a value of its own",
                );
            }
            choices.push(ArgChoice { id: file.id.clone(), value: file.value });
        }
        ArgValues::Choices(choices)
    }

    fn write(
        &mut self,
        file: &At<WriteFile>,
        args: &[Arg],
        layout: &Layout,
        wire: Option<&Wire>,
    ) -> Option<Write> {
        let function = *file.function;
        let known = wire.is_none_or(|wire| wire.functions.contains(&function));
        if !matches!(function, 5 | 6 | 16) || !known {
            self.note(
                &file.function.span,
                format!("function {function} writes nothing on this device"),
                "write 5, 6 or 16, one that wire.functions lists",
            );
            return None;
        }
        let arg = match &file.arg {
            Some(name) => Some(self.arg_named(name, args)?),
            None => None,
        };
        let value = match (&file.value, &file.value_by) {
            (Some(value), None) => WriteValue::Fixed(**value),
            (None, Some(by)) => WriteValue::By {
                point: self.readable_point(&by.point, layout)?,
                values: by.values.iter().map(|when| (when.when, when.value)).collect(),
            },
            (None, None) if arg.is_some() => WriteValue::Fixed(0),
            _ => {
                self.note(
                    &file.span,
                    "the write has no value, or two",
                    "write one of value and value_by, or arg alone",
                );
                return None;
            }
        };
        if function == 5 {
            self.coil_write(file, layout);
        } else {
            self.register_write(file, layout);
        }
        Some(Write { function, address: *file.address, value, arg })
    }

    fn coil_write(&mut self, file: &At<WriteFile>, _: &Layout) {
        if !self.file.coils.iter().any(|coil| coil.at == *file.address) {
            self.note(
                &file.address.span,
                format!("there is no coil {}", *file.address),
                "correct the address, or add the coil to `coils`",
            );
        }
        let plain = file.value.as_ref().is_some_and(|value| COIL_VALUES.contains(value));
        if !plain || file.arg.is_some() {
            self.note(
                &file.span,
                "function 5 cannot write this",
                "write value = 0xFF00 or value = 0x0000, without arg",
            );
        }
    }

    fn register_write(&mut self, file: &At<WriteFile>, layout: &Layout) {
        let address = *file.address;
        let writable = layout
            .points
            .iter()
            .any(|point| point.access.is_writable() && (point.address..=point.last()).contains(&address));
        if !writable {
            self.note(
                &file.address.span,
                format!("no point that can be written stands at {address}"),
                "correct the address, or add the point with access = \"w\"",
            );
        }
    }

    fn proof(&mut self, file: &At<CommandFile>, args: &[Arg], layout: &Layout) -> Option<Proof> {
        match (&file.proof, &file.no_proof) {
            (Some(steps), None) if !steps.is_empty() => {
                let steps: Vec<_> = steps.iter().map(|step| self.proof_step(step, args, layout)).collect();
                Some(Proof::Steps(steps.into_iter().collect::<Option<_>>()?))
            }
            (None, Some(reason)) => {
                self.text(reason, &reason.span, "reason");
                Some(Proof::None { reason: (**reason).clone() })
            }
            _ => {
                self.note(
                    &file.id.span,
                    format!("nothing says whether `{}` can be proved", *file.id),
                    "write either proof, with at least one step, or no_proof with the reason",
                );
                None
            }
        }
    }

    fn proof_step(&mut self, file: &At<ProofFile>, args: &[Arg], layout: &Layout) -> Option<ProofStep> {
        if *file.within_s == 0 {
            self.note(&file.within_s.span, "a proof within no time", "write how long it may take");
        }
        let what = match (&file.point, file.device) {
            (Some(point), None) => Evidence::Point(self.condition(
                &Comparison {
                    span: &file.span,
                    point,
                    bit: file.bit.as_ref(),
                    equals: file.equals,
                    not_equals: file.not_equals,
                    between: file.between.as_ref(),
                    equals_arg: file.equals_arg.as_ref(),
                    changes: file.changes.as_ref(),
                },
                args,
                layout,
            )?),
            (None, Some(device)) if !compares(file) => Evidence::Device(device),
            _ => {
                self.note(
                    &file.span,
                    "a proof step looks at a point or at the device",
                    "write point with one comparison, or device alone",
                );
                return None;
            }
        };
        Some(ProofStep { what, within_s: *file.within_s })
    }

    fn conditions(&mut self, files: &[At<ConditionFile>], args: &[Arg], layout: &Layout) -> Vec<Condition> {
        let mut conditions = Vec::with_capacity(files.len());
        for file in files {
            conditions.extend(self.condition(
                &Comparison {
                    span: &file.span,
                    point: &file.point,
                    bit: file.bit.as_ref(),
                    equals: file.equals,
                    not_equals: file.not_equals,
                    between: file.between.as_ref(),
                    equals_arg: file.equals_arg.as_ref(),
                    changes: None,
                },
                args,
                layout,
            ));
        }
        conditions
    }

    fn condition(&mut self, file: &Comparison<'_>, args: &[Arg], layout: &Layout) -> Option<Condition> {
        let point = self.readable_point(file.point, layout)?;
        let limit = self.compared(file, point, layout)?;
        let mut tests = Vec::new();
        tests.extend(file.equals.map(Test::Equals));
        tests.extend(file.not_equals.map(Test::NotEquals));
        tests.extend(file.between.map(|range| Test::Between(range.0..=range.1)));
        if let Some(name) = file.equals_arg {
            tests.push(Test::EqualsArg(self.arg_named(name, args)?));
        }
        if file.changes.is_some_and(|changes| **changes) {
            tests.push(Test::Changes);
        }
        let (Some(test), true) = (tests.pop(), tests.is_empty()) else {
            self.note(
                file.span,
                format!("`{}` is compared with nothing, or with two things", **file.point),
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
                file.span,
                format!("`{}` can never be compared so", **file.point),
                format!("write raw codes from 0 to {limit}"),
            );
        }
        Some(Condition { point, bit: file.bit.map(|bit| **bit), test })
    }

    /// The greatest raw code that a comparison can meet; notes what cannot be compared.
    fn compared(&mut self, file: &Comparison<'_>, point: usize, layout: &Layout) -> Option<u32> {
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
                self.note(
                    &file.point.span,
                    format!("`{}` is a set of bits", target.id),
                    "add bit = its number",
                );
                None
            }
            (kind, None) if kind.is_numeric() || kind == DataType::Choice => {
                Some(if target.registers == 2 { u32::MAX } else { 0xFFFF })
            }
            (kind, _) => {
                self.note(
                    file.span,
                    format!("a point of type {kind} cannot be compared so"),
                    "name a number, a choice, or one bit of a set",
                );
                None
            }
        }
    }

    fn readable_point(&mut self, name: &At<String>, layout: &Layout) -> Option<usize> {
        let point = self.point_named(name, layout)?;
        if !layout.points[point].access.is_readable() {
            self.note(&name.span, format!("`{}` cannot be read", **name), "name a point that can");
            return None;
        }
        Some(point)
    }

    fn arg_named(&mut self, name: &At<String>, args: &[Arg]) -> Option<usize> {
        let index = args.iter().position(|arg| arg.name == **name);
        if index.is_none() {
            self.note(&name.span, format!("the command has no argument `{}`", **name), "name one of `args`");
        }
        index
    }
}

fn compares(file: &ProofFile) -> bool {
    file.bit.is_some()
        || file.equals.is_some()
        || file.not_equals.is_some()
        || file.between.is_some()
        || file.equals_arg.is_some()
        || file.changes.is_some()
}
