//! Requests: what a client asks, to bytes and back.

use super::function::*;
use super::{
    Bits, EXCEPTION_BIT, MAX_PDU, MAX_READ_BITS, MAX_READ_REGISTERS, MAX_WRITE_BITS, MAX_WRITE_REGISTERS,
    Registers, word,
};
use crate::error::{DecodeError, EncodeError};

/// Bytes of a request that has two words after its function code: functions 1 to 6.
const PLAIN_LEN: usize = 5;
/// Where the data of functions 15 and 16 begins: function, address, quantity, byte count.
const DATA: usize = 6;

/// A request PDU (Modbus Application Protocol V1.1b3, 6). Addresses are those of the protocol, from 0.
///
/// Exhaustive on purpose: `Other` carries what has no variant, and a server must answer every one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request<'a> {
    /// Function 1: `count` coils from `address`, 1 to 2000 (V1.1b3, 6.1).
    ReadCoils {
        /// The first coil.
        address: u16,
        /// How many.
        count: u16,
    },
    /// Function 2: `count` discrete inputs from `address`, 1 to 2000 (V1.1b3, 6.2).
    ReadDiscreteInputs {
        /// The first input.
        address: u16,
        /// How many.
        count: u16,
    },
    /// Function 3: `count` holding registers from `address`, 1 to 125 (V1.1b3, 6.3).
    ReadHoldingRegisters {
        /// The first register.
        address: u16,
        /// How many.
        count: u16,
    },
    /// Function 4: `count` input registers from `address`, 1 to 125 (V1.1b3, 6.4).
    ReadInputRegisters {
        /// The first register.
        address: u16,
        /// How many.
        count: u16,
    },
    /// Function 5: one coil (V1.1b3, 6.5).
    WriteSingleCoil {
        /// The coil.
        address: u16,
        /// The word as it stands on the wire: FF00h is on, 0000h is off, anything else is illegal and sent as given.
        value: u16,
    },
    /// Function 6: one holding register (V1.1b3, 6.6).
    WriteSingleRegister {
        /// The register.
        address: u16,
        /// Its new value.
        value: u16,
    },
    /// Function 15: 1 to 1968 coils from `address` (V1.1b3, 6.11).
    WriteMultipleCoils {
        /// The first coil.
        address: u16,
        /// Their new states.
        coils: Bits<'a>,
    },
    /// Function 16: 1 to 123 holding registers from `address` (V1.1b3, 6.12).
    WriteMultipleRegisters {
        /// The first register.
        address: u16,
        /// Their new values.
        registers: Registers<'a>,
    },
    /// Any other function, its data as bytes.
    Other {
        /// The function code, 1 to 127.
        function: u8,
        /// What follows it, at most 252 bytes.
        data: &'a [u8],
    },
}

impl<'a> Request<'a> {
    /// Takes a PDU apart. Never yields `Other` for a function that has a variant.
    ///
    /// # Errors
    /// Any [`DecodeError`]. Quantities are not judged, only that lengths and byte counts agree: a server decides
    /// which exception a quantity of 0 or 2000 deserves.
    pub fn decode(pdu: &'a [u8]) -> Result<Self, DecodeError> {
        let Some((&function, data)) = pdu.split_first() else {
            return Err(DecodeError::Empty);
        };
        if pdu.len() > MAX_PDU {
            return Err(DecodeError::TooLong { found: pdu.len() });
        }
        match function {
            0 | EXCEPTION_BIT.. => Err(DecodeError::Function { found: function }),
            READ_COILS..=WRITE_SINGLE_REGISTER => decode_plain(function, pdu),
            WRITE_MULTIPLE_COILS => {
                let count = word(pdu, 3);
                let packed = decode_data(pdu, usize::from(count).div_ceil(8))?;
                Ok(Self::WriteMultipleCoils {
                    address: word(pdu, 1),
                    coils: Bits::new(packed, count.into()).unwrap_or(Bits::from_bytes(packed)),
                })
            }
            WRITE_MULTIPLE_REGISTERS => {
                let count = word(pdu, 3);
                let bytes = decode_data(pdu, 2 * usize::from(count))?;
                Ok(Self::WriteMultipleRegisters {
                    address: word(pdu, 1),
                    registers: Registers::from_bytes(bytes),
                })
            }
            _ => Ok(Self::Other { function, data }),
        }
    }

    /// Appends the PDU to `out`.
    ///
    /// # Errors
    /// Any [`EncodeError`]; `out` is then as it was.
    pub fn encode(&self, out: &mut Vec<u8>) -> Result<(), EncodeError> {
        let function = self.function();
        let mut plain = |first: u16, second: u16| {
            let [a, b] = first.to_be_bytes();
            let [c, d] = second.to_be_bytes();
            out.extend_from_slice(&[function, a, b, c, d]);
        };
        match *self {
            Self::ReadCoils { address, count } | Self::ReadDiscreteInputs { address, count } => {
                check_count(function, count.into(), MAX_READ_BITS)?;
                plain(address, count);
            }
            Self::ReadHoldingRegisters { address, count } | Self::ReadInputRegisters { address, count } => {
                check_count(function, count.into(), MAX_READ_REGISTERS)?;
                plain(address, count);
            }
            Self::WriteSingleCoil { address, value } | Self::WriteSingleRegister { address, value } => {
                plain(address, value)
            }
            Self::WriteMultipleCoils { address, coils } => {
                let count = check_count(function, coils.len(), MAX_WRITE_BITS)?;
                plain(address, count);
                out.push(byte(coils.byte_len()));
                coils.append_to(out);
            }
            Self::WriteMultipleRegisters { address, registers } => {
                let count = check_count(function, registers.len(), MAX_WRITE_REGISTERS)?;
                plain(address, count);
                out.push(byte(2 * registers.len()));
                registers.append_to(out);
            }
            Self::Other { function, data } => {
                check_function(function)?;
                check_len(1 + data.len())?;
                out.push(function);
                out.extend_from_slice(data);
            }
        }
        Ok(())
    }

    /// The function code.
    #[must_use]
    pub fn function(&self) -> u8 {
        match *self {
            Self::ReadCoils { .. } => READ_COILS,
            Self::ReadDiscreteInputs { .. } => READ_DISCRETE_INPUTS,
            Self::ReadHoldingRegisters { .. } => READ_HOLDING_REGISTERS,
            Self::ReadInputRegisters { .. } => READ_INPUT_REGISTERS,
            Self::WriteSingleCoil { .. } => WRITE_SINGLE_COIL,
            Self::WriteSingleRegister { .. } => WRITE_SINGLE_REGISTER,
            Self::WriteMultipleCoils { .. } => WRITE_MULTIPLE_COILS,
            Self::WriteMultipleRegisters { .. } => WRITE_MULTIPLE_REGISTERS,
            Self::Other { function, .. } => function,
        }
    }

    /// Bytes of the PDU that answers in full; `None` where the function alone does not tell.
    #[must_use]
    pub fn response_len(&self) -> Option<usize> {
        match *self {
            Self::ReadCoils { count, .. } | Self::ReadDiscreteInputs { count, .. } => {
                Some(2 + usize::from(count).div_ceil(8))
            }
            Self::ReadHoldingRegisters { count, .. } | Self::ReadInputRegisters { count, .. } => {
                Some(2 + 2 * usize::from(count))
            }
            Self::WriteSingleCoil { .. }
            | Self::WriteSingleRegister { .. }
            | Self::WriteMultipleCoils { .. }
            | Self::WriteMultipleRegisters { .. } => Some(PLAIN_LEN),
            Self::Other { .. } => None,
        }
    }
}

fn decode_plain(function: u8, pdu: &[u8]) -> Result<Request<'_>, DecodeError> {
    if pdu.len() != PLAIN_LEN {
        return Err(DecodeError::Length { function, expected: PLAIN_LEN, found: pdu.len() });
    }
    let (address, second) = (word(pdu, 1), word(pdu, 3));
    Ok(match function {
        READ_COILS => Request::ReadCoils { address, count: second },
        READ_DISCRETE_INPUTS => Request::ReadDiscreteInputs { address, count: second },
        READ_HOLDING_REGISTERS => Request::ReadHoldingRegisters { address, count: second },
        READ_INPUT_REGISTERS => Request::ReadInputRegisters { address, count: second },
        WRITE_SINGLE_COIL => Request::WriteSingleCoil { address, value: second },
        _ => Request::WriteSingleRegister { address, value: second },
    })
}

/// The data of functions 15 and 16, whose byte count must be `expected` and true.
fn decode_data(pdu: &[u8], expected: usize) -> Result<&[u8], DecodeError> {
    let function = pdu.first().copied().unwrap_or_default();
    let Some((&[.., declared], data)) = pdu.split_first_chunk::<DATA>() else {
        return Err(DecodeError::Length { function, expected: DATA, found: pdu.len() });
    };
    let declared = usize::from(declared);
    if declared != expected {
        return Err(DecodeError::ByteCount { function, expected, found: declared });
    }
    if data.len() != declared {
        return Err(DecodeError::Length { function, expected: DATA + declared, found: pdu.len() });
    }
    Ok(data)
}

/// The number of items as the wire carries it, when the function allows it.
pub(super) fn check_count(function: u8, found: usize, max: usize) -> Result<u16, EncodeError> {
    match u16::try_from(found) {
        Ok(count) if (1..=max).contains(&found) => Ok(count),
        _ => Err(EncodeError::Count { function, found, min: 1, max }),
    }
}

pub(super) fn check_function(found: u8) -> Result<(), EncodeError> {
    match found {
        0 | EXCEPTION_BIT.. => Err(EncodeError::Function { found }),
        _ => Ok(()),
    }
}

pub(super) fn check_len(found: usize) -> Result<(), EncodeError> {
    if found > MAX_PDU {
        return Err(EncodeError::TooLong { found });
    }
    Ok(())
}

/// A byte count: the limits on items keep it at 250 or less.
pub(super) fn byte(count: usize) -> u8 {
    u8::try_from(count).unwrap_or(u8::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The examples of V1.1b3, one a function, with some that this crate carries as bytes.
    const EXAMPLES: [(&str, &[u8], Request<'_>); 10] = [
        ("6.1", &[0x01, 0x00, 0x13, 0x00, 0x13], Request::ReadCoils { address: 0x13, count: 0x13 }),
        ("6.2", &[0x02, 0x00, 0xC4, 0x00, 0x16], Request::ReadDiscreteInputs { address: 0xC4, count: 0x16 }),
        ("6.3", &[0x03, 0x00, 0x6B, 0x00, 0x03], Request::ReadHoldingRegisters { address: 0x6B, count: 3 }),
        ("6.4", &[0x04, 0x00, 0x08, 0x00, 0x01], Request::ReadInputRegisters { address: 8, count: 1 }),
        ("6.5", &[0x05, 0x00, 0xAC, 0xFF, 0x00], Request::WriteSingleCoil { address: 0xAC, value: 0xFF00 }),
        ("6.6", &[0x06, 0x00, 0x01, 0x00, 0x03], Request::WriteSingleRegister { address: 1, value: 3 }),
        ("6.7", &[0x07], Request::Other { function: 7, data: &[] }),
        ("6.13", &[0x11], Request::Other { function: 0x11, data: &[] }),
        ("6.8", &[0x08, 0, 0, 0xA5, 0x37], Request::Other { function: 8, data: &[0, 0, 0xA5, 0x37] }),
        ("6.21", &[0x2B, 0x0E, 1, 0], Request::Other { function: 0x2B, data: &[0x0E, 1, 0] }),
    ];

    #[test]
    fn the_standards_examples_both_ways() {
        let coils = Request::WriteMultipleCoils { address: 0x13, coils: bits(&[0xCD, 0x01], 10) };
        let registers = [0x000A, 0x0102];
        let registers = Request::WriteMultipleRegisters { address: 1, registers: (&registers).into() };
        let writes: [(&str, &[u8], Request<'_>); 2] = [
            ("6.11", &[0x0F, 0x00, 0x13, 0x00, 0x0A, 0x02, 0xCD, 0x01], coils),
            ("6.12", &[0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02], registers),
        ];
        for (clause, pdu, request) in EXAMPLES.into_iter().chain(writes) {
            assert_eq!(Request::decode(pdu), Ok(request), "{clause}");
            let mut out = vec![0xEE];
            assert_eq!(request.encode(&mut out), Ok(()), "{clause}");
            assert_eq!(out, [&[0xEE], pdu].concat(), "{clause}");
            assert_eq!(request.function(), pdu[0], "{clause}");
        }
    }

    #[test]
    fn decodes_quantities_that_a_server_must_refuse() {
        for count in [0, 126, 2000, 0xFFFF] {
            let [high, low] = u16::to_be_bytes(count);
            let request = Request::ReadHoldingRegisters { address: 0, count };
            assert_eq!(Request::decode(&[3, 0, 0, high, low]), Ok(request));
        }
        let nothing = Request::WriteMultipleRegisters { address: 7, registers: (&[]).into() };
        assert_eq!(Request::decode(&[0x10, 0, 7, 0, 0, 0]), Ok(nothing));
    }

    #[test]
    fn rejects_what_is_no_request() {
        let too_long = [0x10; 254];
        let cases: [(&[u8], DecodeError); 11] = [
            (&[], DecodeError::Empty),
            (&too_long, DecodeError::TooLong { found: 254 }),
            (&[0x00, 1], DecodeError::Function { found: 0 }),
            (&[0x83, 2], DecodeError::Function { found: 0x83 }),
            (&[0x03], DecodeError::Length { function: 3, expected: 5, found: 1 }),
            (&[0x03, 0, 0, 0, 1, 0], DecodeError::Length { function: 3, expected: 5, found: 6 }),
            (&[0x10, 0, 0, 0, 1], DecodeError::Length { function: 0x10, expected: 6, found: 5 }),
            (&[0x10, 0, 0, 0, 1, 2, 0], DecodeError::Length { function: 0x10, expected: 8, found: 7 }),
            (
                &[0x10, 0, 0, 0, 1, 3, 0, 0, 0],
                DecodeError::ByteCount { function: 0x10, expected: 2, found: 3 },
            ),
            (&[0x0F, 0, 0, 0, 9, 1, 0], DecodeError::ByteCount { function: 0x0F, expected: 2, found: 1 }),
            (
                &[0x10, 0, 0, 0xFF, 0xFF, 0xFE],
                DecodeError::ByteCount { function: 0x10, expected: 0x1FFFE, found: 0xFE },
            ),
        ];
        for (pdu, error) in cases {
            assert_eq!(Request::decode(pdu), Err(error), "{pdu:02X?}");
        }
    }

    #[test]
    fn refuses_to_encode_what_the_standard_forbids() {
        let words = [0; 124];
        let bytes = [0xFF; 253];
        let count = |function, found, max| EncodeError::Count { function, found, min: 1, max };
        let cases = [
            (Request::ReadCoils { address: 0, count: 0 }, count(1, 0, 2000)),
            (Request::ReadCoils { address: 0, count: 2001 }, count(1, 2001, 2000)),
            (Request::ReadDiscreteInputs { address: 0, count: 2001 }, count(2, 2001, 2000)),
            (Request::ReadHoldingRegisters { address: 0, count: 0 }, count(3, 0, 125)),
            (Request::ReadHoldingRegisters { address: 0, count: 126 }, count(3, 126, 125)),
            (Request::ReadInputRegisters { address: 0, count: 126 }, count(4, 126, 125)),
            (Request::WriteMultipleCoils { address: 0, coils: bits(&bytes, 1969) }, count(15, 1969, 1968)),
            (Request::WriteMultipleCoils { address: 0, coils: bits(&[], 0) }, count(15, 0, 1968)),
            (Request::WriteMultipleRegisters { address: 0, registers: (&words).into() }, count(16, 124, 123)),
            (Request::Other { function: 0, data: &[] }, EncodeError::Function { found: 0 }),
            (Request::Other { function: 0x80, data: &[] }, EncodeError::Function { found: 0x80 }),
            (Request::Other { function: 7, data: &bytes }, EncodeError::TooLong { found: 254 }),
        ];
        for (request, error) in cases {
            let mut out = vec![0xEE];
            assert_eq!(request.encode(&mut out), Err(error));
            assert_eq!(out, [0xEE], "{error}");
        }
    }

    #[test]
    fn the_largest_of_each_fits() {
        let words = [0xABCD; 123];
        let bytes = [0xFF; 252];
        let cases = [
            (Request::WriteMultipleCoils { address: 0, coils: bits(&bytes, 1968) }, 252),
            (Request::WriteMultipleRegisters { address: 0, registers: (&words).into() }, 252),
            (Request::Other { function: 0x65, data: &bytes }, 253),
        ];
        for (request, len) in cases {
            let mut out = Vec::new();
            assert_eq!(request.encode(&mut out), Ok(()));
            assert_eq!(out.len(), len);
            assert_eq!(Request::decode(&out), Ok(request));
        }
    }

    #[test]
    fn knows_how_long_the_answer_is() {
        let words = [0; 3];
        let cases = [
            (Request::ReadCoils { address: 0, count: 17 }, Some(5)),
            (Request::ReadDiscreteInputs { address: 0, count: 16 }, Some(4)),
            (Request::ReadHoldingRegisters { address: 0, count: 16 }, Some(34)),
            (Request::ReadInputRegisters { address: 0, count: 125 }, Some(252)),
            (Request::WriteSingleCoil { address: 0, value: 0 }, Some(5)),
            (Request::WriteSingleRegister { address: 0, value: 0 }, Some(5)),
            (Request::WriteMultipleCoils { address: 0, coils: bits(&[0], 1) }, Some(5)),
            (Request::WriteMultipleRegisters { address: 0, registers: (&words).into() }, Some(5)),
            (Request::Other { function: 7, data: &[] }, None),
        ];
        for (request, len) in cases {
            assert_eq!(request.response_len(), len, "{request:?}");
        }
    }

    fn bits(bytes: &[u8], count: usize) -> Bits<'_> {
        Bits::new(bytes, count).unwrap()
    }
}
