//! `busbar frame`: one frame, RTU or TCP, taken apart.

use busbar_profile::Profile;

use crate::{
    anatomy::{Anatomy, Kind, Transport, Values, take_apart},
    args,
    failure::Failure,
    profiles, terminal,
};

pub(crate) fn run(args: &args::Frame, json: bool) -> Result<(), Failure> {
    let profile = args.profile.as_deref().map(profiles::resolve).transpose()?;
    let bytes = bytes(&args.hex)?;
    let mut frame = take_apart(&bytes).map_err(|wrong| {
        Failure::Failed(format!("{wrong}; check that all bytes of one frame were copied"))
    })?;
    if let Some(profile) = &profile {
        name_exception(&mut frame, profile);
    }
    if json {
        terminal::print_json(&frame)?;
    } else {
        terminal::print(&people(&frame, bytes.len(), profile.as_deref()))?;
    }
    match frame.wrong_crc {
        None => Ok(()),
        Some((found, computed)) => Err(Failure::Failed(format!(
            "the CRC is wrong: the frame ends in {} and its bytes give {}; suspect the line, or a byte that was copied wrong",
            on_the_wire(found),
            on_the_wire(computed)
        ))),
    }
}

/// The bytes of all arguments together: pairs of hex digits, with or without blanks, colons or `0x` between them.
fn bytes(arguments: &[String]) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    let words = arguments.iter().flat_map(|argument| argument.split([' ', '\t', '\n', '\r', ':', '-', ',']));
    for word in words.filter(|word| !word.is_empty()) {
        let digits = word.strip_prefix("0x").or_else(|| word.strip_prefix("0X")).unwrap_or(word);
        if let Some(wrong) = digits.chars().find(|c| !c.is_ascii_hexdigit()) {
            return Err(Failure::Call(format!(
                "\"{wrong}\" in \"{word}\" is no hex digit; write bytes as 01 03 00 20 or 01030020"
            )));
        }
        if digits.is_empty() || !digits.len().is_multiple_of(2) {
            return Err(Failure::Call(format!(
                "\"{word}\" has {} hex digits; write two for each byte, 01 and not 1",
                digits.len()
            )));
        }
        let pairs = (0..digits.len()).step_by(2).filter_map(|at| digits.get(at..at + 2));
        bytes.extend(pairs.filter_map(|pair| u8::from_str_radix(pair, 16).ok()));
    }
    Ok(bytes)
}

/// Puts the maker's name of an exception in place of the standard's.
fn name_exception(frame: &mut Anatomy, profile: &Profile) {
    if let Some(exception) = &mut frame.content.exception
        && let Some(name) = profile.exception_name(exception.code)
    {
        exception.name = name.to_owned();
    }
}

fn people(frame: &Anatomy, length: usize, profile: Option<&Profile>) -> String {
    let style = terminal::style();
    let mut lines = vec![match (frame.transport, frame.wrong_crc) {
        (Transport::Tcp, _) => style.title(&format!("TCP frame, {length} bytes")),
        (Transport::Rtu, None) => style.title(&format!("RTU frame, {length} bytes, CRC right")),
        (Transport::Rtu, Some(_)) => style.alarm(&format!("RTU frame, {length} bytes, CRC wrong")),
    }];
    let mut field = |name: &str, text: String| lines.push(format!("  {name:<12}  {text}"));
    if let Some(transaction) = frame.transaction {
        field("transaction", transaction.to_string());
    }
    field("unit", frame.unit.to_string());
    field("function", format!("{} ({})", frame.function, function_name(frame.function)));
    field("kind", kind_name(frame.kind).to_owned());
    let content = &frame.content;
    if let Some(address) = content.address {
        field("address", format!("{address} ({address:04X}h)"));
    }
    if let Some(count) = content.count {
        field("count", count.to_string());
    }
    if let Some(value) = content.value {
        field("value", format!("{value} ({value:04X}h)"));
    }
    match &content.values {
        Some(Values::Registers(registers)) => field("values", words(registers)),
        Some(Values::Coils(coils)) => field("values", states(coils)),
        None => {}
    }
    if let Some(registers) = &content.registers {
        field("registers", words(registers));
    }
    if let Some(bits) = &content.bits {
        field("bits", states(bits));
    }
    if let Some(exception) = &content.exception {
        field("exception", format!("{} ({})", exception.code, exception.name));
    }
    if let Some(data) = &content.data {
        field("data", data.clone());
    }
    if let Some(points) = profile.and_then(|profile| points(frame, profile)) {
        field("points", points);
    }
    lines.join("\n") + "\n"
}

/// The names of the points that a request for registers touches.
fn points(frame: &Anatomy, profile: &Profile) -> Option<String> {
    let registers = match (&frame.content.values, frame.content.count) {
        (Some(Values::Registers(registers)), _) => registers.len(),
        (None, Some(count)) => usize::from(count),
        _ => 1,
    };
    if !matches!(frame.function, 3 | 4 | 6 | 16) {
        return None;
    }
    let start = usize::from(frame.content.address?);
    let touched = |address: u16, length: u16| {
        let address = usize::from(address);
        address < start + registers && start < address + usize::from(length)
    };
    let names: Vec<&str> = profile
        .points
        .iter()
        .filter(|point| touched(point.address, point.registers))
        .map(|point| point.id.as_str())
        .collect();
    Some(if names.is_empty() { format!("none that {} knows", profile.key) } else { names.join(", ") })
}

fn words(registers: &[u16]) -> String {
    let hex: Vec<String> = registers.iter().map(|register| format!("{register:04X}")).collect();
    let decimal: Vec<String> = registers.iter().map(u16::to_string).collect();
    match registers {
        [] => "none".to_owned(),
        _ => format!("{} ({})", hex.join(" "), decimal.join(" ")),
    }
}

fn states(bits: &[bool]) -> String {
    let groups: Vec<String> =
        bits.chunks(8).map(|byte| byte.iter().map(|bit| if *bit { '1' } else { '0' }).collect()).collect();
    format!("{} (first to last)", groups.join(" "))
}

fn kind_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Request => "request",
        Kind::Response => "response",
        Kind::RequestOrResponse => "request or response, which look alike",
        Kind::Exception => "exception",
    }
}

fn function_name(function: u8) -> &'static str {
    match function {
        1 => "read coils",
        2 => "read discrete inputs",
        3 => "read holding registers",
        4 => "read input registers",
        5 => "write single coil",
        6 => "write single register",
        15 => "write multiple coils",
        16 => "write multiple registers",
        _ => "not taken apart",
    }
}

/// A CRC as its bytes stand on the wire, low byte first.
fn on_the_wire(crc: u16) -> String {
    let [low, high] = crc.to_le_bytes();
    format!("{low:02X} {high:02X}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_bytes_as_people_write_them() {
        let take = |text: &str| bytes(&[text.to_owned()]).ok();
        for text in [
            "01 03 00 20",
            "01030020",
            "0103 0020",
            "0x01 0x03 0x00 0x20",
            "01:03:00:20",
            "01-03-00-20",
            "01,03,00,20\n",
        ] {
            assert_eq!(take(text), Some(vec![1, 3, 0, 0x20]), "{text}");
        }
        for text in ["1 3", "010", "0x", "01 0g", "01 é3"] {
            assert_eq!(take(text), None, "{text}");
        }
    }
}
