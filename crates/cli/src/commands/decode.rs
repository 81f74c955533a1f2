//! `busbar decode`: registers to values.

use busbar_profile::{Point, Reading, decode_window, reading};

use crate::{
    args,
    failure::Failure,
    people, profiles,
    table::{Align, Cell, Table},
    terminal,
};

pub(crate) fn run(args: &args::Decode, json: bool) -> Result<(), Failure> {
    let profile = profiles::resolve(&args.key)?;
    let (address, registers) = (args.address, args.registers.as_slice());
    if usize::from(address) + registers.len() > 0x1_0000 {
        return Err(Failure::Call(format!(
            "{} registers from {address} on pass 65535, the last address; check ADDRESS",
            registers.len()
        )));
    }
    let order = args.word_order.unwrap_or(profile.wire.word_order);
    let decoded = decode_window(&profile, address, registers, order);
    let model = profiles::model(&profile, |identity| identity.within(address, registers));
    let readings: Vec<(&Point, Reading<'_>)> = decoded
        .iter()
        .filter_map(|(point, decoded)| {
            let raw = point.within(address, registers)?;
            Some((*point, reading(point, decoded, raw, model)))
        })
        .collect();
    if readings.is_empty() {
        terminal::message(&format!(
            "no point of {} lies wholly inside {address} to {}; \"busbar profile show {}\" lists them",
            profile.key,
            usize::from(address) + registers.len() - 1,
            args.key
        ));
    }
    if json {
        let readings: Vec<&Reading<'_>> = readings.iter().map(|(_, reading)| reading).collect();
        terminal::print_json(&readings)?;
    } else if !readings.is_empty() {
        terminal::print(&table(&readings))?;
    }
    Ok(())
}

fn table(readings: &[(&Point, Reading<'_>)]) -> String {
    let mut table = Table::new([
        ("ADDRESS", Align::Right),
        ("NAME", Align::Left),
        ("VALUE", Align::Left),
        ("RAW", Align::Left),
        ("POINT", Align::Left),
    ])
    .optional(&["RAW", "POINT"]);
    let width = people::number_width(readings.iter().map(|(point, reading)| (*point, reading)));
    for (point, reading) in readings {
        let raw: Vec<String> =
            reading.raw.iter().flat_map(|raw| raw.iter()).map(|register| format!("{register:04X}")).collect();
        let raw = match raw.as_slice() {
            [first, second, .., last] if raw.len() > 4 => format!("{first} {second} .. {last}"),
            _ => raw.join(" "),
        };
        let mut lines = people::lines(point, reading, width).into_iter();
        table.row([
            point.address.to_string().into(),
            point.name.as_str().into(),
            lines.next().unwrap_or_default(),
            Cell::dim(raw),
            Cell::dim(point.id.as_str()),
        ]);
        for line in lines {
            table.row([Cell::default(), Cell::default(), line, Cell::default(), Cell::default()]);
        }
    }
    table.render(terminal::style(), terminal::width())
}
