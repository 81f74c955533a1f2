//! Checks of the remote commands.

use super::Check;
use super::conditions::Comparison;
use super::layout::Layout;
use crate::command::{
    Arg, ArgChoice, ArgValues, Command, Evidence, Hold, Proof, ProofStep, Step, Write, WriteValue,
};
use crate::file::{ArgFile, At, CommandFile, HoldFile, ProofFile, StepFile, WriteFile};
use crate::joined::{Joined, JoinedParts};
use crate::profile::Wire;
use crate::terms::ArgKind;

/// What function 5 can write.
const COIL_VALUES: [u16; 2] = [0xFF00, 0x0000];

/// What the parts of a command may refer to.
pub(super) struct Scope<'s> {
    pub(super) layout: &'s Layout,
    pub(super) joined: &'s [Joined],
    pub(super) wire: Option<&'s Wire>,
    pub(super) args: &'s [Arg],
}

impl<'a> Check<'a> {
    /// Every command.
    pub(super) fn commands(
        &mut self,
        layout: &Layout,
        joined: &[Joined],
        wire: Option<&Wire>,
    ) -> Vec<Command> {
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
            let args = self.args(&command.args);
            let scope = Scope { layout, joined, wire, args: &args };
            commands.extend(self.command(command, &scope));
        }
        commands
    }

    fn command(&mut self, file: &At<CommandFile>, scope: &Scope<'_>) -> Option<Command> {
        let require = self.conditions(&file.require, scope);
        let already = self.conditions(&file.already, scope);
        let hold = file.hold.as_ref().map(|hold| self.hold(hold, scope));
        let steps = self.steps(file, scope);
        let proof = self.proof(file, scope);
        Some(Command {
            id: file.id.clone(),
            name: file.name.clone(),
            risk: file.risk,
            role: file.role,
            confirm: file.confirm,
            page: file.page,
            args: scope.args.to_vec(),
            require,
            already,
            hold,
            steps: steps?,
            proof: proof?,
        })
    }

    fn steps(&mut self, file: &At<CommandFile>, scope: &Scope<'_>) -> Option<Vec<Step>> {
        match (&file.write, &file.steps) {
            (Some(write), None) => {
                let write = self.write(write, scope)?;
                let (require, already, proof) = (Vec::new(), Vec::new(), Vec::new());
                Some(vec![Step { require, already, hold: None, write, proof }])
            }
            (None, Some(steps)) if !steps.is_empty() => {
                if let (Some(_), Some(own)) = (&file.hold, &steps[0].hold) {
                    self.note(
                        &own.span,
                        "two holds before the first write",
                        "keep the hold of the command or the hold of its first step",
                    );
                }
                let steps: Vec<_> = steps.iter().map(|step| self.step(step, scope)).collect();
                steps.into_iter().collect()
            }
            _ => {
                self.note(
                    &file.id.span,
                    format!("`{}` has nothing to send, or says so twice", *file.id),
                    "write either write, or steps with at least one step",
                );
                None
            }
        }
    }

    fn step(&mut self, file: &At<StepFile>, scope: &Scope<'_>) -> Option<Step> {
        let require = self.conditions(&file.require, scope);
        let already = self.conditions(&file.already, scope);
        let hold = file.hold.as_ref().map(|hold| self.hold(hold, scope));
        let write = self.write(&file.write, scope);
        let proof: Vec<_> = file.proof.iter().map(|step| self.proof_step(step, scope)).collect();
        Some(Step { require, already, hold, write: write?, proof: proof.into_iter().collect::<Option<_>>()? })
    }

    fn hold(&mut self, file: &At<HoldFile>, scope: &Scope<'_>) -> Hold {
        if *file.within_s == 0 {
            self.note(&file.within_s.span, "a hold within no time", "write how long it may take");
        }
        let (files, any) = if file.any.is_empty() { (&file.all, false) } else { (&file.any, true) };
        if file.all.is_empty() == file.any.is_empty() {
            self.note(&file.span, "a hold waits for all of a list or for any", "write one of all and any");
        }
        let conditions = self.hold_conditions(files, scope);
        Hold { conditions, any, within_s: *file.within_s }
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
            let values = match (&file.choices, file.min, file.max, &file.kind) {
                (Some(choices), None, None, None) => self.arg_choices(choices),
                (None, Some(min), Some(max), None) if min <= max => ArgValues::Range(min..=max),
                (None, None, None, Some(kind)) if **kind == ArgKind::Time => {
                    args.push(self.time(file));
                    continue;
                }
                _ => {
                    self.note(
                        &file.span,
                        format!("nothing says what `{}` can be, or two things do", *file.name),
                        "write choices, or min and max, or kind",
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

    fn time(&mut self, file: &At<ArgFile>) -> Arg {
        let now = file.default.as_ref().is_some_and(|default| default.as_str() == "now");
        if let Some(default) = file.default.as_ref().filter(|_| !now) {
            self.note(
                &default.span,
                format!("`{}` cannot be `{}`", *file.name, **default),
                "write default = \"now\", or leave it out",
            );
        }
        Arg { name: file.name.clone(), values: ArgValues::Time { now }, default: None }
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

    fn write(&mut self, file: &At<WriteFile>, scope: &Scope<'_>) -> Option<Write> {
        let function = *file.function;
        let known = scope.wire.is_none_or(|wire| wire.functions.contains(&function));
        if !matches!(function, 5 | 6 | 16) || !known {
            self.note(
                &file.function.span,
                format!("function {function} writes nothing on this device"),
                "write 5, 6 or 16, one that wire.functions lists",
            );
            return None;
        }
        let arg = match &file.arg {
            Some(name) => Some(self.arg_number(name, scope.args)?),
            None => None,
        };
        let value = match (&file.value, &file.value_by) {
            (Some(value), None) => WriteValue::Fixed(**value),
            (None, Some(by)) => WriteValue::By {
                point: self.readable_point(&by.point, scope.layout)?,
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
            self.coil_write(file);
        } else {
            self.register_write(file, scope.layout);
        }
        Some(Write { function, address: *file.address, value, arg })
    }

    fn coil_write(&mut self, file: &At<WriteFile>) {
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

    fn proof(&mut self, file: &At<CommandFile>, scope: &Scope<'_>) -> Option<Proof> {
        match (&file.proof, &file.no_proof) {
            (Some(steps), None) if !steps.is_empty() => {
                let steps: Vec<_> = steps.iter().map(|step| self.proof_step(step, scope)).collect();
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

    fn proof_step(&mut self, file: &At<ProofFile>, scope: &Scope<'_>) -> Option<ProofStep> {
        if *file.within_s == 0 {
            self.note(&file.within_s.span, "a proof within no time", "write how long it may take");
        }
        if let Some(tolerance) = file.tolerance_s.as_ref().filter(|_| file.joined.is_none()) {
            self.note(&tolerance.span, "tolerance_s means nothing here", "remove it, or write joined");
        }
        let what = match (&file.point, file.device, &file.joined) {
            (Some(_), None, None) => Evidence::Point(self.condition(&Comparison::of_proof(file), scope)?),
            (None, Some(device), None) if !compares(file) && file.equals_arg.is_none() => {
                Evidence::Device(device)
            }
            (None, None, Some(joined)) if !compares(file) => self.clock_proof(file, joined, scope)?,
            _ => {
                self.note(
                    &file.span,
                    "a proof step looks at a point, at the device or at a joined clock",
                    "write point with one comparison, device alone, or joined with equals_arg",
                );
                return None;
            }
        };
        Some(ProofStep { what, within_s: *file.within_s })
    }

    fn clock_proof(
        &mut self,
        file: &At<ProofFile>,
        name: &At<String>,
        scope: &Scope<'_>,
    ) -> Option<Evidence> {
        let is_clock = |joined: &Joined| matches!(joined.parts, JoinedParts::Clock { .. });
        let joined = scope.joined.iter().position(|joined| joined.signal == **name && is_clock(joined));
        let Some(joined) = joined else {
            self.note(
                &name.span,
                format!("`{}` is no joined clock", **name),
                "name the signal of a [[joined]] with year to second",
            );
            return None;
        };
        let time = |name: &At<String>| scope.args.iter().position(|arg| is_time(arg) && arg.name == **name);
        let (Some(arg), Some(tolerance_s)) = (file.equals_arg.as_ref().and_then(time), &file.tolerance_s)
        else {
            self.note(
                &file.span,
                "the clock is compared with no time",
                "write equals_arg = the name of an argument of kind time, and tolerance_s",
            );
            return None;
        };
        Some(Evidence::Clock { joined, arg, tolerance_s: **tolerance_s })
    }
}

fn is_time(arg: &Arg) -> bool {
    matches!(arg.values, ArgValues::Time { .. })
}

/// Compares a point with something other than an argument.
fn compares(file: &ProofFile) -> bool {
    file.bit.is_some()
        || file.equals.is_some()
        || file.not_equals.is_some()
        || file.between.is_some()
        || file.changes.is_some()
}
