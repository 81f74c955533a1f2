//! A controller's reference page: everything its profile knows, as Markdown tables; committed under `docs/profiles/`.

use crate::command::{
    Arg, ArgRef, ArgValues, Command, Condition, Evidence, Hold, Proof, ProofStep, Subject, Test, Write,
    WriteValue,
};
use crate::number::{Number, Scale};
use crate::plan::{Cost, plan};
use crate::point::{Bit, Point};
use crate::profile::{Group, Profile};
use crate::terms::{Class, Confirm, DeviceProof, Kind, OverRead, Rate};

/// Opens every page.
const MADE: &str = "<!-- Made from the profiles: UPDATE=1 cargo test -p busbar-profile --test page -->\n";

/// The list of all pages.
pub fn index(profiles: &[Profile]) -> String {
    let mut table =
        Table::new(&["Profile", "Controller", "Kind", "Points", "Bits", "Coils", "Commands", "Manual"]);
    for profile in profiles {
        table.row([
            format!("[{key}]({key}.md)", key = profile.key),
            escape(&format!("{} {}", profile.vendor, profile.models.join(", "))),
            kind(profile.kind).to_owned(),
            profile.points.len().to_string(),
            bits(profile).to_string(),
            profile.coils.len().to_string(),
            profile.commands.len().to_string(),
            manual(profile),
        ]);
    }
    format!(
        "{MADE}\n# Controllers\n\nWhat Busbar knows of each controller, point by point, with the page of the manual it \
         comes from. [Adding a controller](../adding-a-controller.md) takes a folder and no code.\n\n{}",
        table.render()
    )
}

/// The page of a controller.
pub fn markdown(profile: &Profile) -> String {
    let lists = Lists::new(profile);
    let mut text = format!(
        "{MADE}\n# {} {}\n\nProfile `{}`: {}, {} points, {} bits, {} coils, {} commands. Manual: {}.\n\n\
         Addresses are as on the wire; 4xxxx is the number of a PLC program; \"page\" is a page of the manual.\n",
        escape(&profile.vendor),
        escape(&profile.models.join(", ")),
        profile.key,
        kind(profile.kind),
        profile.points.len(),
        bits(profile),
        profile.coils.len(),
        profile.commands.len(),
        manual(profile),
    );
    section(&mut text, "Wire", &wire(profile));
    section(&mut text, "Readable registers", &readable(profile));
    text.push_str("\n## Points\n");
    for group in &profile.groups {
        text.push_str(&points(profile, group, &lists));
    }
    section(&mut text, "Codes", &lists.codes());
    section(&mut text, "Bits", &lists.bits());
    section(&mut text, "Joined signals", &joined(profile));
    section(&mut text, "Coils", &coils(profile));
    section(&mut text, "Commands", &commands(profile));
    text
}

/// A titled part, where there is something in it.
fn section(text: &mut String, title: &str, part: &str) {
    if !part.is_empty() {
        text.push_str(&format!("\n## {title}\n\n{part}"));
    }
}

fn wire(profile: &Profile) -> String {
    let wire = &profile.wire;
    let at_most = |registers: u16, more: &str| match registers {
        0 => "none".to_owned(),
        _ => format!("{registers} at most{more}"),
    };
    let long = match wire.over_read {
        OverRead::Truncate => "; longer reads are cut",
        OverRead::Refuse => "; longer reads are refused",
    };
    let unit = wire.unit.default.map(|unit| format!(", {unit} as delivered")).unwrap_or_default();
    let mut table = Table::new(&["Rule", "Value"]);
    let mut rule = |name: &str, value: String| table.row([name.to_owned(), value]);
    rule("Transports", list(&wire.transports));
    rule("Unit id", format!("{} to {}{unit}", wire.unit.min, wire.unit.max));
    rule("Functions", list(&wire.functions));
    rule("Registers a read", at_most(wire.max_read, long));
    rule("Registers a write", at_most(wire.max_write, ""));
    rule("Word order of 32-bit numbers", wire.word_order.to_string());
    rule("Pause after a read", format!("{} ms", wire.spacing_ms));
    rule("Answers no sooner than", format!("{} ms", wire.answer_delay_ms));
    rule("Time-out", format!("{} ms", wire.timeout_ms));
    rule("Baud", list(&wire.serial.baud));
    rule("Parity, stop bits", format!("{}; {}", list(&wire.serial.parity), list(&wire.serial.stop)));
    rule("All points but image and trace, 9600 8N1", refresh(profile));
    for exception in &wire.exceptions {
        rule(&format!("Exception {}", exception.code), escape(&exception.name));
    }
    if let Some(identity) = &profile.identity {
        let models =
            identity.models.iter().map(|known| format!("{:04X}h {}", known.value, escape(&known.model)));
        let models: Vec<_> = models.collect();
        rule("Model", format!("by {}: {}", code(&profile.points[identity.point].id), models.join(", ")));
    }
    table.render()
}

/// What one reading of everything takes.
fn refresh(profile: &Profile) -> String {
    let points = (0..profile.points.len()).filter(|index| !profile.points[*index].data_type.is_bulk());
    let reads = plan(profile, &points.collect::<Vec<_>>());
    let characters: u64 = reads.iter().map(|read| read.characters()).sum();
    let time = Cost::rtu(9600, 10, profile.wire.answer_delay()).total(&reads);
    let tenths = (time + 50_000) / 100_000;
    format!("{} reads, {characters} characters, {}.{} ms", reads.len(), tenths / 10, tenths % 10)
}

fn readable(profile: &Profile) -> String {
    let mut table = Table::new(&["First", "Last", "Registers"]);
    for &(first, last) in &profile.wire.readable {
        let count = u32::from(last) - u32::from(first) + 1;
        table.row([address(first), address(last), count.to_string()]);
    }
    table.render()
}

/// One group's table, in the order of the file.
fn points(profile: &Profile, group: &Group, lists: &Lists<'_>) -> String {
    let page = group.page.map(|page| format!(", page {page}")).unwrap_or_default();
    let mut table = Table::new(&[
        "Address",
        "4xxxx",
        "Registers",
        "Point",
        "Name",
        "Type",
        "Scale",
        "Unit",
        "Access",
        "Signal",
        "Page",
        "Notes",
    ]);
    for point in group.points.iter().map(|index| &profile.points[*index]) {
        table.row([
            address(point.address),
            point.plc_number().to_string(),
            point.registers.to_string(),
            code(&point.id),
            escape(&point.name),
            kind_of_value(point),
            point.scale.map(scale).unwrap_or_default(),
            point.unit.as_deref().map(escape).unwrap_or_default(),
            point.access.to_string(),
            point.signal.as_deref().map(code).unwrap_or_default(),
            point.page.map(|page| page.to_string()).unwrap_or_default(),
            notes(profile, point, group, lists),
        ]);
    }
    format!("\n### {}\n\nRead {}{page}.\n\n{}", escape(&group.title), rate(group.rate), table.render())
}

/// The type, and the bits of the register where it does not take all.
fn kind_of_value(point: &Point) -> String {
    match point.field {
        Some((high, low)) => format!("{}, bits {high} to {low}", point.data_type),
        None => point.data_type.to_string(),
    }
}

/// How a raw number becomes a value: what is done to it.
pub fn scale(scale: Scale) -> String {
    let factor = match (scale.num(), scale.den()) {
        (1, 1) => String::new(),
        (1, den) => format!("/ {den}"),
        (num, 1) => format!("x {num}"),
        (num, den) => format!("x {num} / {den}"),
    };
    let offset = scale.offset().to_string();
    let text = match offset.strip_prefix('-') {
        _ if scale.offset() == Number::ZERO && factor.is_empty() => "1".to_owned(),
        _ if scale.offset() == Number::ZERO => factor,
        Some(less) => format!("{factor} - {less}"),
        None => format!("{factor} + {offset}"),
    };
    text.trim_start().to_owned()
}

fn notes(profile: &Profile, point: &Point, group: &Group, lists: &Lists<'_>) -> String {
    let mut notes = Vec::new();
    notes.extend(lists.link(point));
    if point.rate != group.rate {
        notes.push(format!("read {}", rate(point.rate)));
    }
    if point.hex {
        notes.push("hexadecimal".to_owned());
    }
    if let Some(timer) = point.timer {
        notes.push(format!("delay in {}", code(&profile.points[timer].id)));
    }
    if !point.sentinels.is_empty() {
        let words: Vec<_> = point.sentinels.iter().map(|word| format!("{word:X}h")).collect();
        notes.push(format!("no value: {}", words.join(", ")));
    }
    notes.extend(point.doubt.as_ref().map(|doubt| format!("in doubt: {}", escape(doubt))));
    notes.extend(point.verified.as_ref().map(|verified| format!("verified: {}", escape(verified))));
    notes.join("; ")
}

/// Points with the same codes or bits, described once.
struct Lists<'a>(Vec<Vec<&'a Point>>);

impl<'a> Lists<'a> {
    fn new(profile: &'a Profile) -> Self {
        let mut lists: Vec<Vec<&Point>> = Vec::new();
        for point in profile.points.iter().filter(|point| !point.choices.is_empty() || !point.bits.is_empty())
        {
            match lists.iter_mut().find(|list| list.first().is_some_and(|first| Self::alike(first, point))) {
                Some(list) => list.push(point),
                None => lists.push(vec![point]),
            }
        }
        Self(lists)
    }

    fn alike(a: &Point, b: &Point) -> bool {
        let same = |(a, b): (&Bit, &Bit)| {
            a.bit == b.bit && a.id == b.id && a.label == b.label && a.signal == b.signal
        };
        let classes = |(a, b): (&Bit, &Bit)| a.class == b.class;
        let bits = || a.bits.iter().zip(&b.bits);
        a.choices == b.choices
            && a.reserved_codes == b.reserved_codes
            && a.bits.len() == b.bits.len()
            && bits().all(same)
            // The class of a whole array stands above the table.
            && (bits().all(classes) || (one_class(a).is_some() && one_class(b).is_some()))
    }

    fn title(points: &[&Point]) -> String {
        let what = if points.iter().any(|point| point.bits.is_empty()) { "Codes" } else { "Bits" };
        let ids: Vec<_> = points.iter().map(|point| point.id.as_str()).collect();
        format!("{what} of {}", ids.join(", "))
    }

    /// From a point to its codes or bits.
    fn link(&self, point: &Point) -> Option<String> {
        let points = self.0.iter().find(|points| points.iter().any(|other| other.id == point.id))?;
        let what = if point.bits.is_empty() { "codes" } else { "bits" };
        // As GitHub makes anchors from titles: no commas, hyphens for blanks.
        let anchor = Self::title(points).to_lowercase().replace(',', "").replace(' ', "-");
        Some(format!("[{what}](#{anchor})"))
    }

    fn codes(&self) -> String {
        let mut text = String::new();
        for points in &self.0 {
            let Some(point) = points.first().filter(|point| !point.choices.is_empty()) else { continue };
            let mut table = Table::new(&["Code", "Id", "Label", "State", "Notes"]);
            for choice in &point.choices {
                let mut notes: Vec<_> =
                    choice.by_model.iter().map(|(model, label)| format!("{model}: {label}")).collect();
                if point.timer.is_some() && !choice.timed {
                    notes.push("shows no delay".to_owned());
                }
                table.row([
                    choice.value.to_string(),
                    code(&choice.id),
                    escape(&choice.label),
                    choice.state.clone().unwrap_or_default(),
                    escape(&notes.join("; ")),
                ]);
            }
            for (first, last) in &point.reserved_codes {
                let codes = if first == last { first.to_string() } else { format!("{first} to {last}") };
                table.row([codes, String::new(), "reserved".to_owned(), String::new(), String::new()]);
            }
            text.push_str(&under(points, table, text.is_empty()));
        }
        text
    }

    fn bits(&self) -> String {
        let mut text = String::new();
        for points in &self.0 {
            let Some(point) = points.first().filter(|point| !point.bits.is_empty()) else { continue };
            let mixed = one_class(point).is_none();
            let mut table = Table::new(&["Bit", "Id", "Label", "Class", "Signal", "State", "Notes"]);
            for bit in &point.bits {
                let class = bit.class.filter(|_| mixed).map(|class| class.to_string());
                let mut notes = Vec::new();
                if let Some(clear) = &bit.clear {
                    notes.push(format!("while clear: {} ({})", escape(&clear.label), clear.state));
                }
                if let Some(doubt) = &bit.doubt {
                    notes.push(format!("in doubt: {}", escape(doubt)));
                }
                table.row([
                    bit.bit.to_string(),
                    code(&bit.id),
                    escape(&bit.label),
                    class.unwrap_or_default(),
                    bit.signal.as_deref().map(code).unwrap_or_default(),
                    bit.state.clone().unwrap_or_default(),
                    notes.join("; "),
                ]);
            }
            text.push_str(&under(points, table, text.is_empty()));
        }
        text
    }
}

/// A list under the ids of the points that have it, and the class of those whose bits have all the same.
fn under(points: &[&Point], table: Table, first: bool) -> String {
    let classes: Vec<_> = points
        .iter()
        .filter_map(|point| Some(format!("{} {}", code(&point.id), one_class(point)??)))
        .collect();
    let classes =
        if classes.is_empty() { String::new() } else { format!("Class: {}.\n\n", classes.join(", ")) };
    let before = if first { "" } else { "\n" };
    format!("{before}### {}\n\n{classes}{}", Lists::title(points), table.render())
}

/// The class of all bits of a point, which may be none; none at all where they differ.
fn one_class(point: &Point) -> Option<Option<Class>> {
    let class = point.bits.first()?.class;
    point.bits.iter().all(|bit| bit.class == class).then_some(class)
}

fn joined(profile: &Profile) -> String {
    let mut table = Table::new(&["Signal", "Of the points"]);
    for joined in profile.joined() {
        let parts = joined.points().map(|index| code(&profile.points[index].id)).collect::<Vec<_>>();
        table.row([code(&joined.signal), parts.join(", ")]);
    }
    table.render()
}

fn coils(profile: &Profile) -> String {
    let mut table = Table::new(&["Address", "Id", "Name", "Page"]);
    for coil in &profile.coils {
        let page = coil.page.map(|page| page.to_string()).unwrap_or_default();
        table.row([address(coil.address), code(&coil.id), escape(&coil.name), page]);
    }
    table.render()
}

fn commands(profile: &Profile) -> String {
    let mut table = Table::new(&[
        "Command",
        "Name",
        "Arguments",
        "Risk",
        "Role",
        "Precondition",
        "Write",
        "Proof",
        "Page",
    ]);
    for command in &profile.commands {
        let role = match command.confirm {
            Some(Confirm::Typed) => format!("{}, typed confirmation", command.role),
            None => command.role.to_string(),
        };
        table.row([
            code(&command.id),
            escape(&command.name),
            command.args.iter().map(argument).collect::<Vec<_>>().join("; "),
            command.risk.to_string().replace('_', " "),
            role,
            precondition(profile, command),
            writes(profile, command),
            proof(profile, command),
            command.page.map(|page| page.to_string()).unwrap_or_default(),
        ]);
    }
    table.render()
}

fn argument(arg: &Arg) -> String {
    let (values, default) = match &arg.values {
        ArgValues::Choices(choices) => {
            let values: Vec<_> =
                choices.iter().map(|choice| format!("{} ({:04X}h)", choice.id, choice.value)).collect();
            let default = choices.iter().find(|choice| Some(choice.value) == arg.default);
            (values.join(", "), default.map(|choice| choice.id.clone()))
        }
        ArgValues::Range(range) => {
            (format!("{} to {}", range.start(), range.end()), arg.default.map(|value| value.to_string()))
        }
        ArgValues::Time { now } => ("a local date and time".to_owned(), now.then(|| "now".to_owned())),
    };
    let default = default.map(|default| format!(", else {default}")).unwrap_or_default();
    format!("{}: {values}{default}", code(&arg.name))
}

fn precondition(profile: &Profile, command: &Command) -> String {
    let all = |conditions: &[Condition]| {
        let conditions: Vec<_> =
            conditions.iter().map(|condition| self::condition(profile, command, condition)).collect();
        conditions.join(" and ")
    };
    let mut text = all(&command.require);
    if !command.already.is_empty() {
        let gap = if text.is_empty() { "" } else { "; " };
        text.push_str(&format!("{gap}nothing is sent where {}", all(&command.already)));
    }
    if let Some(hold) = &command.hold {
        let gap = if text.is_empty() { "" } else { "; " };
        text.push_str(&format!("{gap}waits until {}", self::hold(profile, command, hold)));
    }
    text
}

fn hold(profile: &Profile, command: &Command, hold: &Hold) -> String {
    let conditions: Vec<_> =
        hold.conditions.iter().map(|condition| self::condition(profile, command, condition)).collect();
    let between = if hold.any { " or " } else { " and " };
    format!("{}, at most {} s", conditions.join(between), hold.within_s)
}

/// A comparison, with the meaning of the code or the bit it compares.
fn condition(profile: &Profile, command: &Command, condition: &Condition) -> String {
    let (what, point) = match condition.subject {
        Subject::Arg(arg) => (argument_name(command, arg), None),
        Subject::Point { point, bit: Some(bit) } => {
            let point = &profile.points[point];
            let label = point.bit(bit).map(|bit| format!(" ({})", escape(&bit.label))).unwrap_or_default();
            (format!("{} bit {bit}{label}", code(&point.id)), None)
        }
        Subject::Point { point, bit: None } => {
            let point = &profile.points[point];
            (code(&point.id), Some(point))
        }
    };
    let named = |value: u32| match point.and_then(|point| point.choice(value)) {
        Some(choice) => format!("{value} ({})", escape(&choice.label)),
        None => value.to_string(),
    };
    match &condition.test {
        Test::Equals(value) => format!("{what} is {}", named(*value)),
        Test::NotEquals(value) => format!("{what} is not {}", named(*value)),
        Test::Between(range) => format!("{what} is {} to {}", named(*range.start()), named(*range.end())),
        Test::EqualsArg(arg) => format!("{what} is {}", argument_name(command, *arg)),
        Test::Changes => format!("{what} changes"),
    }
}

fn argument_name(command: &Command, arg: ArgRef) -> String {
    let name = &command.args[arg.arg].name;
    match arg.part {
        Some(part) => code(&format!("{name}.{part}")),
        None => code(name),
    }
}

/// The writes; the steps of a procedure with what lies between them.
fn writes(profile: &Profile, command: &Command) -> String {
    let all = |conditions: &[Condition]| {
        let conditions: Vec<_> =
            conditions.iter().map(|condition| self::condition(profile, command, condition)).collect();
        conditions.join(" and ")
    };
    let steps = command.steps.iter().enumerate().map(|(index, step)| {
        let mut text = String::new();
        if !step.already.is_empty() {
            text.push_str(&format!("unless {}, ", all(&step.already)));
        }
        if !step.require.is_empty() {
            text.push_str(&format!("only while {}, ", all(&step.require)));
        }
        if let Some(hold) = &step.hold {
            text.push_str(&format!("when {}, ", self::hold(profile, command, hold)));
        }
        text.push_str(&write(profile, command, &step.write));
        if !step.proof.is_empty() {
            text.push_str(&format!(", until {}", proof_steps(profile, command, &step.proof)));
        }
        if command.is_procedure() { format!("{}. {text}", index + 1) } else { text }
    });
    steps.collect::<Vec<_>>().join("; ")
}

/// One write; register and value as they go over the wire.
fn write(profile: &Profile, command: &Command, write: &Write) -> String {
    let Write { function, address, value, arg } = write;
    let arg = arg.map(|arg| argument_name(command, arg));
    let place = format!("function {function}, {}", self::address(*address));
    match (value, arg) {
        (WriteValue::Fixed(0), Some(arg)) => format!("{place}: {arg}"),
        (WriteValue::Fixed(value), None) => format!("{place}: {value:04X}h"),
        (WriteValue::Fixed(value), Some(arg)) => format!("{place}: {value:04X}h with {arg}"),
        (WriteValue::By { point, values }, arg) => {
            let values: Vec<_> =
                values.iter().map(|(when, value)| format!("{value:04X}h where it is {when:04X}h")).collect();
            let arg = arg.map(|arg| format!(" with {arg}")).unwrap_or_default();
            format!("{place}: by {} {}{arg}", code(&profile.points[*point].id), values.join(", "))
        }
    }
}

fn proof(profile: &Profile, command: &Command) -> String {
    match &command.proof {
        Proof::Steps(steps) => proof_steps(profile, command, steps),
        Proof::None { reason } => format!("none: {}", escape(reason)),
    }
}

fn proof_steps(profile: &Profile, command: &Command, steps: &[ProofStep]) -> String {
    let step = |step: &ProofStep| {
        let what = match &step.what {
            Evidence::Point(condition) => self::condition(profile, command, condition),
            Evidence::Clock { joined, arg, tolerance_s } => format!(
                "{} is {}, as it runs, to {tolerance_s} s",
                code(&profile.joined()[*joined].signal),
                code(&command.args[*arg].name)
            ),
            Evidence::Device(DeviceProof::SilentThenBack) => "the device is silent, then back".to_owned(),
        };
        format!("{what} within {} s", step.within_s)
    };
    steps.iter().map(step).collect::<Vec<_>>().join(", then ")
}

fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Genset => "genset",
        Kind::TransferSwitch => "transfer switch",
        Kind::Compressor => "compressor",
    }
}

fn rate(rate: Rate) -> &'static str {
    match rate {
        Rate::Fast => "often",
        Rate::Slow => "seldom",
        Rate::Once => "once",
        Rate::OnDemand => "on demand",
    }
}

fn manual(profile: &Profile) -> String {
    let revision =
        profile.manual.revision.as_ref().map(|revision| format!(", {revision}")).unwrap_or_default();
    escape(&format!("{}{revision}", profile.manual.title))
}

/// Every named bit of every point.
fn bits(profile: &Profile) -> usize {
    profile.points.iter().map(|point| point.bits.len()).sum()
}

fn address(address: u16) -> String {
    format!("{address} ({address:04X}h)")
}

fn list(items: &[impl ToString]) -> String {
    items.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

fn code(text: &str) -> String {
    format!("`{text}`")
}

/// Text as it is, whatever Markdown would make of it inside a table.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\n' => escaped.push(' '),
            '\\' | '|' | '<' | '>' | '*' | '_' | '[' | ']' | '`' | '~' => escaped.extend(['\\', c]),
            _ => escaped.push(c),
        }
    }
    escaped
}

/// A Markdown table that leaves out columns with nothing in them.
struct Table {
    heads: Vec<&'static str>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn new(heads: &[&'static str]) -> Self {
        Self { heads: heads.to_vec(), rows: Vec::new() }
    }

    fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.rows.push(cells.into());
    }

    /// The table; nothing where it has no rows.
    fn render(&self) -> String {
        let is_used = |column: &usize| self.rows.iter().any(|row| !row[*column].is_empty());
        let columns: Vec<usize> = (0..self.heads.len()).filter(is_used).collect();
        let line = |cell: &dyn Fn(usize) -> String| {
            let cells: Vec<_> = columns.iter().map(|column| cell(*column)).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        if columns.is_empty() {
            return String::new();
        }
        let mut text = line(&|column| self.heads[column].to_owned());
        text.push_str(&line(&|_| "---".to_owned()));
        text.extend(self.rows.iter().map(|row| line(&|column| row[column].clone())));
        text
    }
}
