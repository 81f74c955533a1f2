//! `busbar registers`: raw registers without a profile.

use busbar_link::LinkError;
use busbar_modbus::ExceptionCode;
use busbar_profile::WordOrder;
use serde::Serialize;

use crate::{
    args,
    failure::Failure,
    runtime,
    table::{Align, Cell, Table},
    terminal, wire,
};

/// What came, as `--json` prints it.
#[derive(Serialize)]
struct Registers<'a> {
    unit: u8,
    function: u8,
    address: u16,
    registers: &'a [u16],
}

pub(crate) fn run(args: &args::Registers, json: bool) -> Result<(), Failure> {
    let &args::Registers { address, count, unit, function, .. } = args;
    if u32::from(address) + u32::from(count) > 0x1_0000 {
        return Err(Failure::Call(format!(
            "{count} registers from {address} on pass 65535, the last address; ask for fewer"
        )));
    }
    runtime::once(async {
        let link = wire::open(&args.endpoint, &args.wire, None)?;
        let registers = link
            .read_registers(unit, function, address, count)
            .await
            .map_err(|error| Failure::Failed(wire::sentence(&error, None) + remedy(&error, function)))?;
        if json {
            terminal::print_json(&Registers { unit, function, address, registers: &registers })?;
        } else {
            terminal::print(&table(args, &registers))?;
        }
        if registers.len() < usize::from(count) {
            terminal::message(&format!(
                "the device answered {} of {count} registers; some controllers cut long reads, so ask for the rest from {} on",
                registers.len(),
                usize::from(address) + registers.len()
            ));
        }
        Ok(())
    })
}

/// What to try when the device is there and refuses.
fn remedy(error: &LinkError, function: u8) -> &'static str {
    match error {
        LinkError::Exception { code: ExceptionCode::ILLEGAL_FUNCTION, .. } if function == 4 => {
            "; try --function 3"
        }
        LinkError::Exception { code: ExceptionCode::ILLEGAL_FUNCTION, .. } => "; try --function 4",
        LinkError::Exception { code: ExceptionCode::ILLEGAL_DATA_ADDRESS, .. } => {
            "; it does not have all of these registers, check ADDRESS and COUNT"
        }
        _ => "",
    }
}

fn table(args: &args::Registers, registers: &[u16]) -> String {
    let order = args.wire.word_order.unwrap_or(WordOrder::LowFirst);
    let (area, title) = if args.function == 4 { (3, "3XXXX") } else { (4, "4XXXX") };
    let mut table = Table::new([
        ("ADDRESS", Align::Right),
        (title, Align::Right),
        ("HEX", Align::Left),
        ("UNSIGNED", Align::Right),
        ("SIGNED", Align::Right),
        (if order == WordOrder::LowFirst { "32 BIT, LOW FIRST" } else { "32 BIT, HIGH FIRST" }, Align::Right),
    ]);
    for (offset, register) in registers.iter().enumerate() {
        let address = usize::from(args.address) + offset;
        // Five digits end at address 9998.
        let first = if address <= 9998 { area * 10_000 + 1 } else { area * 100_000 + 1 };
        // Pairs from the first register on: where 32-bit values begin, only the manual knows.
        let pair = match (offset % 2, registers.get(offset + 1)) {
            (0, Some(next)) => {
                let (high, low) =
                    if order == WordOrder::LowFirst { (next, register) } else { (register, next) };
                (u32::from(*high) << 16 | u32::from(*low)).to_string()
            }
            _ => String::new(),
        };
        table.row([
            address.to_string().into(),
            Cell::dim((first + address).to_string()),
            format!("{register:04X}").into(),
            register.to_string().into(),
            register.cast_signed().to_string().into(),
            Cell::dim(pair),
        ]);
    }
    table.render(terminal::style(), terminal::width())
}
