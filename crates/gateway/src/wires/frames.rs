//! The frames of a wire in the log, where the site file or the command line asks for them.

use busbar_link::{Direction, Endpoint, Link, Trace};
use busbar_modbus::{Framing, Request, Response, mbap, rtu};
use jiff::{SignedDuration, Timestamp};

/// Logs every frame of a wire, with its time, from now on.
pub(crate) fn trace(id: &str, link: &Link) -> Trace {
    let wire = id.to_owned();
    let framing = match link.endpoint() {
        Endpoint::Rtu { .. } | Endpoint::RtuTcp { .. } => Framing::Rtu,
        _ => Framing::Tcp,
    };
    let opened = before(Timestamp::now(), link.statistics().open_for);
    Trace::new(move |event| {
        let at = SignedDuration::try_from(event.at).unwrap_or_default();
        let at = opened.saturating_add(at).unwrap_or(opened);
        let direction = match event.direction {
            Direction::Sent => "sent",
            Direction::Received => "received",
        };
        let hex: Vec<String> = event.bytes.iter().map(|byte| format!("{byte:02X}")).collect();
        let meaning = meaning(framing, event.direction, event.bytes);
        tracing::info!(
            target: "busbar::frames",
            wire,
            direction,
            at = format!("{at:.6}"),
            hex = hex.join(" "),
            "{meaning}"
        );
    })
}

fn before(now: Timestamp, ago: std::time::Duration) -> Timestamp {
    SignedDuration::try_from(ago).ok().and_then(|ago| now.checked_sub(ago).ok()).unwrap_or(now)
}

/// What a frame says, in one sentence.
fn meaning(framing: Framing, direction: Direction, bytes: &[u8]) -> String {
    let carried = match framing {
        Framing::Tcp => mbap::decode(bytes).map(|frame| (frame.header.unit, frame.pdu)),
        Framing::Rtu => rtu::decode(bytes).map(|frame| (frame.unit, frame.pdu)),
    };
    let (unit, pdu) = match carried {
        Ok(carried) => carried,
        Err(error) => return format!("no frame: {error}"),
    };
    let said = match direction {
        Direction::Sent => Request::decode(pdu).map(|request| asked(&request)),
        Direction::Received => Response::decode(pdu).map(|response| answered(&response)),
    };
    match said {
        Ok(said) => format!("unit {unit}: {said}"),
        Err(error) => format!("unit {unit}: {error}"),
    }
}

fn asked(request: &Request<'_>) -> String {
    match request {
        Request::ReadCoils { address, count } => format!("read {} from {address}", many(*count, "coil")),
        Request::ReadDiscreteInputs { address, count } => {
            format!("read {} from {address}", many(*count, "input"))
        }
        Request::ReadHoldingRegisters { address, count } => {
            format!("read {} from {address}", many(*count, "holding register"))
        }
        Request::ReadInputRegisters { address, count } => {
            format!("read {} from {address}", many(*count, "input register"))
        }
        Request::WriteSingleCoil { address, value } => format!("write {value:04X}h to coil {address}"),
        Request::WriteSingleRegister { address, value } => format!("write {value} to register {address}"),
        Request::WriteMultipleCoils { address, coils } => {
            format!("write {} from {address}", many(coils.len(), "coil"))
        }
        Request::WriteMultipleRegisters { address, registers } => {
            format!("write {} from {address}", many(registers.len(), "register"))
        }
        Request::Other { function, .. } => format!("function {function}"),
    }
}

fn answered(response: &Response<'_>) -> String {
    match response {
        Response::ReadCoils(bits) | Response::ReadDiscreteInputs(bits) => many(bits.len(), "bit"),
        Response::ReadHoldingRegisters(registers) | Response::ReadInputRegisters(registers) => {
            many(registers.len(), "register")
        }
        Response::WriteSingleCoil { address, .. } => format!("coil {address} written"),
        Response::WriteSingleRegister { address, .. } => format!("register {address} written"),
        Response::WriteMultipleCoils { address, count } => {
            format!("{} from {address} written", many(*count, "coil"))
        }
        Response::WriteMultipleRegisters { address, count } => {
            format!("{} from {address} written", many(*count, "register"))
        }
        Response::Exception { function, code } => {
            format!("function {function} refused with exception {} ({})", code.0, code.name())
        }
        Response::Other { function, .. } => format!("function {function}"),
    }
}

/// How many of what.
fn many(count: impl Into<usize>, what: &str) -> String {
    match count.into() {
        1 => format!("1 {what}"),
        count => format!("{count} {what}s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_says_what_it_is() {
        use Direction::{Received, Sent};
        let tcp = |pdu: &[u8]| [&[0, 1, 0, 0, 0, pdu.len() as u8 + 1, 7], pdu].concat();
        let serial = |pdu: &[u8]| {
            let body = [&[7], pdu].concat();
            [&body[..], &rtu::crc16(&body).to_le_bytes()].concat()
        };
        for (direction, pdu, meaning) in [
            (Sent, &[1, 0, 5, 0, 9][..], "unit 7: read 9 coils from 5"),
            (Sent, &[2, 0, 5, 0, 9], "unit 7: read 9 inputs from 5"),
            (Sent, &[3, 0x28, 6, 0, 2], "unit 7: read 2 holding registers from 10246"),
            (Sent, &[4, 0, 0, 0, 2], "unit 7: read 2 input registers from 0"),
            (Sent, &[5, 0, 3, 0xFF, 0], "unit 7: write FF00h to coil 3"),
            (Sent, &[6, 0x20, 1, 0, 4], "unit 7: write 4 to register 8193"),
            (Sent, &[15, 0, 1, 0, 3, 1, 5], "unit 7: write 3 coils from 1"),
            (Sent, &[16, 0, 9, 0, 2, 4, 0, 1, 0, 2], "unit 7: write 2 registers from 9"),
            (Sent, &[43, 14], "unit 7: function 43"),
            (Received, &[1, 1, 5], "unit 7: 8 bits"),
            (Sent, &[3, 0x28, 6, 0, 1], "unit 7: read 1 holding register from 10246"),
            (Received, &[3, 2, 8, 0xFE], "unit 7: 1 register"),
            (Received, &[3, 4, 8, 0xFE, 0, 0], "unit 7: 2 registers"),
            (Received, &[5, 0, 3, 0xFF, 0], "unit 7: coil 3 written"),
            (Received, &[6, 0x20, 1, 0, 4], "unit 7: register 8193 written"),
            (Received, &[15, 0, 1, 0, 3], "unit 7: 3 coils from 1 written"),
            (Received, &[16, 0, 9, 0, 2], "unit 7: 2 registers from 9 written"),
            (Received, &[0x83, 2], "unit 7: function 3 refused with exception 2 (illegal data address)"),
            (Received, &[43, 14], "unit 7: function 43"),
        ] {
            assert_eq!(super::meaning(Framing::Tcp, direction, &tcp(pdu)), meaning);
            assert_eq!(super::meaning(Framing::Rtu, direction, &serial(pdu)), meaning);
        }
        let mut broken = serial(&[3, 2, 0, 9]);
        broken[3] ^= 1;
        assert!(super::meaning(Framing::Rtu, Received, &broken).starts_with("no frame: "));
        assert!(super::meaning(Framing::Tcp, Received, b"HTTP/1.1").starts_with("no frame: "));
        assert!(super::meaning(Framing::Tcp, Received, &tcp(&[3, 4, 0])).starts_with("unit 7: "));
    }
}
