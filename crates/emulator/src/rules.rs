//! What a device's manual lets through: functions, lengths and addresses, before anything is read or done.

use busbar_modbus::{ExceptionCode, Registers, Request};
use busbar_profile::{OverRead, Wire};

/// More registers than fit one answer of the protocol; what a device does from there on is the maker's rule.
const MOST_REGISTERS: u16 = 125;

/// The only two values of function 5 (V1.1b3, 6.5).
pub(crate) const COIL_ON: u16 = 0xFF00;
pub(crate) const COIL_OFF: u16 = 0x0000;

/// Which registers and coils a device has.
pub(crate) trait Map {
    /// Whether all of `count` registers from `address` on may be read.
    fn is_readable(&self, address: u16, count: u16) -> bool;
    /// Whether a register may be written.
    fn is_writable(&self, address: u16) -> bool;
    /// Whether there is a coil that may be written.
    fn is_coil(&self, address: u16) -> bool;
}

/// The maker's own exception codes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refusals {
    /// A count of 0 or of more than the protocol allows.
    pub(crate) quantity: ExceptionCode,
    /// A write to a register that can only be read.
    pub(crate) protected: ExceptionCode,
}

/// A request that the device serves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Permitted<'a> {
    /// `count` registers, already cut to what the device answers.
    Read { address: u16, count: u16 },
    /// One register.
    Write { address: u16, value: u16 },
    /// One coil.
    WriteCoil { address: u16, on: bool },
    /// Several registers, every one of them writable.
    WriteSeveral { address: u16, registers: Registers<'a> },
}

/// Judges one request.
///
/// # Errors
/// The exception that the device answers.
pub(crate) fn permit<'a>(
    request: &Request<'a>,
    wire: &Wire,
    refusals: Refusals,
    map: &impl Map,
) -> Result<Permitted<'a>, ExceptionCode> {
    if !wire.functions.contains(&request.function()) {
        return Err(ExceptionCode::ILLEGAL_FUNCTION);
    }
    match *request {
        Request::ReadHoldingRegisters { address, count } | Request::ReadInputRegisters { address, count } => {
            if count == 0 || count > MOST_REGISTERS {
                return Err(refusals.quantity);
            }
            let count = match wire.over_read {
                OverRead::Truncate => count.min(wire.max_read),
                _ if count > wire.max_read => return Err(refusals.quantity),
                _ => count,
            };
            // Judged after the cut: what is not sent cannot be missing.
            match map.is_readable(address, count) {
                true => Ok(Permitted::Read { address, count }),
                false => Err(ExceptionCode::ILLEGAL_DATA_ADDRESS),
            }
        }
        Request::WriteSingleRegister { address, value } => {
            writable(map, refusals, address, 1)?;
            Ok(Permitted::Write { address, value })
        }
        Request::WriteSingleCoil { address, value } => {
            // The value before the address (V1.1b3, figure 15).
            let on = match value {
                COIL_ON => true,
                COIL_OFF => false,
                _ => return Err(ExceptionCode::ILLEGAL_DATA_VALUE),
            };
            match map.is_coil(address) {
                true => Ok(Permitted::WriteCoil { address, on }),
                false => Err(ExceptionCode::ILLEGAL_DATA_ADDRESS),
            }
        }
        Request::WriteMultipleRegisters { address, registers } => {
            let count = registers.len();
            if count == 0 || count > usize::from(wire.max_write) {
                return Err(refusals.quantity);
            }
            writable(map, refusals, address, count)?;
            Ok(Permitted::WriteSeveral { address, registers })
        }
        // A profile that lists another function needs a panel that has it.
        _ => Err(ExceptionCode::ILLEGAL_FUNCTION),
    }
}

fn writable(map: &impl Map, refusals: Refusals, address: u16, count: usize) -> Result<(), ExceptionCode> {
    let mut unknown = false;
    for register in usize::from(address)..usize::from(address) + count {
        let register = u16::try_from(register).map_err(|_| ExceptionCode::ILLEGAL_DATA_ADDRESS)?;
        if map.is_writable(register) {
            continue;
        }
        // One protected register speaks for the whole write, wherever it stands.
        if map.is_readable(register, 1) {
            return Err(refusals.protected);
        }
        unknown = true;
    }
    match unknown {
        true => Err(ExceptionCode::ILLEGAL_DATA_ADDRESS),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bank::Bank;

    const DATAKOM: Refusals =
        Refusals { quantity: ExceptionCode::ILLEGAL_DATA_ADDRESS, protected: ExceptionCode(10) };
    const SMARTGEN: Refusals = Refusals {
        quantity: ExceptionCode::ILLEGAL_DATA_VALUE,
        protected: ExceptionCode::ILLEGAL_DATA_ADDRESS,
    };

    /// What becomes of a request: so many registers, a write, or an exception.
    #[derive(Debug, PartialEq)]
    enum Verdict {
        Read(u16),
        Done,
        Exception(u8),
    }
    use Verdict::{Done, Exception, Read};

    struct Judge {
        bank: Bank,
        refusals: Refusals,
    }

    impl Judge {
        fn new(key: &str, refusals: Refusals) -> Self {
            Self { bank: Bank::new(busbar_profile::builtin(key).unwrap()), refusals }
        }

        fn judge(&self, request: Request<'_>) -> Verdict {
            match permit(&request, &self.bank.profile().wire, self.refusals, &self.bank) {
                Ok(Permitted::Read { count, .. }) => Read(count),
                Ok(_) => Done,
                Err(ExceptionCode(code)) => Exception(code),
            }
        }

        fn reads(&self, cases: &[(u16, u16, Verdict)]) {
            for (address, count, expected) in cases {
                let found = self.judge(Request::ReadHoldingRegisters { address: *address, count: *count });
                assert_eq!(found, *expected, "{count} from {address} ({address:04X})");
            }
        }

        fn coils(&self, cases: &[(u16, u16, Verdict)]) {
            for (address, value, expected) in cases {
                let found = self.judge(Request::WriteSingleCoil { address: *address, value: *value });
                assert_eq!(found, *expected, "{value:04X} to {address}");
            }
        }

        fn writes(&self, cases: &[(u16, Verdict)]) {
            for (address, expected) in cases {
                let found = self.judge(Request::WriteSingleRegister { address: *address, value: 1 });
                assert_eq!(found, *expected, "{address} ({address:04X})");
            }
        }

        /// Every function from 1 to 127 but these is an illegal one, whatever its body.
        fn knows_only(&self, functions: &[u8]) {
            for function in 1..=127 {
                let request = Request::Other { function, data: &[0, 0, 0, 1] };
                // A body that does not fit is judged before; here the function is all that counts.
                let allowed = self.bank.profile().wire.functions.contains(&function);
                assert_eq!(allowed, functions.contains(&function), "{function}");
                assert_eq!(self.judge(request), Exception(1), "{function}");
            }
            let bits = busbar_modbus::Bits::from_bytes(&[1]);
            for request in [
                Request::ReadCoils { address: 0, count: 1 },
                Request::ReadDiscreteInputs { address: 0, count: 1 },
                Request::ReadInputRegisters { address: 0, count: 1 },
                Request::WriteSingleCoil { address: 0, value: 0x1234 },
                Request::WriteSingleRegister { address: 0, value: 0 },
                Request::WriteMultipleCoils { address: 0, coils: bits },
                Request::WriteMultipleRegisters { address: 0, registers: Registers::from(&[0]) },
            ] {
                if !functions.contains(&request.function()) {
                    assert_eq!(self.judge(request), Exception(1), "{request:?}");
                }
            }
        }
    }

    #[test]
    fn a_datakom_d_cuts_reads_and_protects_registers() {
        let d = Judge::new("datakom-d", DATAKOM);
        d.knows_only(&[3, 6, 16]);
        d.reads(&[
            (10240, 16, Read(16)),
            (10240, 17, Read(16)),
            (10240, 125, Read(16)),
            (10240, 0, Exception(2)),
            (10240, 126, Exception(2)),
            (10240, 65535, Exception(2)),
            // Judged after the cut: 16 of these are there.
            (10536, 125, Read(16)),
            (10537, 125, Exception(2)),
            (8193, 1, Exception(2)),
        ]);
        d.writes(&[(8193, Done), (10240, Exception(10)), (8195, Exception(2))]);
        let several = |address, registers: &[u16]| {
            d.judge(Request::WriteMultipleRegisters { address, registers: Registers::from(registers) })
        };
        assert_eq!(several(8193, &[1, 2]), Done);
        assert_eq!(several(8193, &[]), Exception(2));
        assert_eq!(several(10240, &[0; 16]), Exception(10));
        assert_eq!(several(10240, &[0; 17]), Exception(2));
        assert_eq!(several(10239, &[0; 2]), Exception(10));
    }

    #[test]
    fn a_dkg_cuts_reads_and_writes_one_register() {
        let dkg = Judge::new("datakom-dkg705", DATAKOM);
        dkg.knows_only(&[3, 6]);
        dkg.reads(&[
            (0x0000, 16, Read(16)),
            (0x0000, 17, Read(16)),
            (0x0000, 125, Read(16)),
            (0x0000, 0, Exception(2)),
            (0x0000, 126, Exception(2)),
            (0x0028, 16, Read(16)),
            (0x0029, 16, Exception(2)),
            (0x0038, 1, Exception(2)),
            (0x0043, 1, Read(1)),
            (0x0044, 1, Exception(2)),
            (0x1003, 1, Exception(2)),
            (0x1029, 1, Exception(2)),
            (0x102D, 1, Read(1)),
            (0x102D, 2, Exception(2)),
            (0xFFFF, 16, Exception(2)),
        ]);
        dkg.writes(&[
            (0x0024, Done),
            (0x0029, Done),
            (0x0040, Done),
            (0x0000, Exception(10)),
            (0x003D, Exception(10)),
            (0x1005, Exception(10)),
            (0x0038, Exception(2)),
            (0x2000, Exception(2)),
        ]);
    }

    #[test]
    fn a_hat821si_refuses_long_reads_and_writes_coils() {
        let hat = Judge::new("smartgen-hat821si", SMARTGEN);
        hat.knows_only(&[3, 5]);
        hat.reads(&[
            (1000, 120, Read(120)),
            (1000, 121, Exception(3)),
            (1000, 125, Exception(3)),
            (1000, 126, Exception(3)),
            (1000, 0, Exception(3)),
            // The quantity is judged before the address.
            (9000, 0, Exception(3)),
            (9000, 121, Exception(3)),
            (499, 1, Exception(2)),
            (500, 1, Read(1)),
            (9000, 1, Exception(2)),
            (15004, 1, Exception(2)),
        ]);
        hat.coils(&[
            (15004, 0xFF00, Done),
            (15004, 0x0000, Done),
            (15004, 0x0001, Exception(3)),
            (15004, 0xFFFF, Exception(3)),
            (15004, 0x00FF, Exception(3)),
            (15087, 0xFF00, Done),
            (15003, 0xFF00, Exception(2)),
            (15010, 0x0000, Exception(2)),
            (15088, 0xFF00, Exception(2)),
            // The value is judged before the address.
            (15003, 0x1234, Exception(3)),
        ]);
    }

    #[test]
    fn an_acc1700_refuses_long_reads_and_writes_coils() {
        let acc = Judge::new("smartgen-acc1700", SMARTGEN);
        acc.knows_only(&[3, 5]);
        acc.reads(&[
            (0, 120, Read(120)),
            (0, 121, Exception(3)),
            (0, 125, Exception(3)),
            (0, 126, Exception(3)),
            (0, 0, Exception(3)),
            (80, 120, Read(120)),
            (81, 120, Exception(2)),
            (199, 1, Read(1)),
            (200, 1, Exception(2)),
        ]);
        acc.coils(&[
            (0, 0xFF00, Done),
            (3, 0x0000, Done),
            (3, 0x0100, Exception(3)),
            (2, 0xFF00, Exception(2)),
            (24, 0xFF00, Exception(2)),
            (24, 0xAAAA, Exception(3)),
        ]);
    }
}
