//! Responses: what a server answers, to bytes and back.

use super::function::*;
use super::request::{byte, check_count, check_function, check_len};
use super::{
    Bits, EXCEPTION_BIT, ExceptionCode, Expected, MAX_PDU, MAX_READ_BITS, MAX_READ_REGISTERS, Registers,
    Request, word,
};
use crate::error::{DecodeError, EncodeError, Mismatch};

/// Bytes of a response that repeats two words: functions 5, 6, 15 and 16.
const ECHO_LEN: usize = 5;
/// Bytes of an exception response: function with its exception bit, code.
const EXCEPTION_LEN: usize = 2;

/// A response PDU (Modbus Application Protocol V1.1b3, 6 and 7).
///
/// Exhaustive on purpose: `Other` carries what has no variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Response<'a> {
    /// Function 1 (V1.1b3, 6.1). Decoded, it has eight for every byte that came.
    ReadCoils(Bits<'a>),
    /// Function 2 (V1.1b3, 6.2). Decoded, it has eight for every byte that came.
    ReadDiscreteInputs(Bits<'a>),
    /// Function 3 (V1.1b3, 6.3).
    ReadHoldingRegisters(Registers<'a>),
    /// Function 4 (V1.1b3, 6.4).
    ReadInputRegisters(Registers<'a>),
    /// Function 5: the request again (V1.1b3, 6.5).
    WriteSingleCoil {
        /// The coil.
        address: u16,
        /// The word as it stands on the wire.
        value: u16,
    },
    /// Function 6: the request again (V1.1b3, 6.6).
    WriteSingleRegister {
        /// The register.
        address: u16,
        /// Its value.
        value: u16,
    },
    /// Function 15: where and how many (V1.1b3, 6.11).
    WriteMultipleCoils {
        /// The first coil.
        address: u16,
        /// How many were written.
        count: u16,
    },
    /// Function 16: where and how many (V1.1b3, 6.12).
    WriteMultipleRegisters {
        /// The first register.
        address: u16,
        /// How many were written.
        count: u16,
    },
    /// The device refused (V1.1b3, 7).
    Exception {
        /// The function refused, without the exception bit 80h.
        function: u8,
        /// Why.
        code: ExceptionCode,
    },
    /// Any other function, its data as bytes.
    Other {
        /// The function code, 1 to 127.
        function: u8,
        /// What follows it, at most 252 bytes.
        data: &'a [u8],
    },
}

impl<'a> Response<'a> {
    /// Takes a PDU apart. Never yields `Other` for a function that has a variant.
    ///
    /// # Errors
    /// Any [`DecodeError`]. A read of nothing (byte count 0) is well-formed; [`Response::answers`] refuses it.
    pub fn decode(pdu: &'a [u8]) -> Result<Self, DecodeError> {
        let Some((&function, data)) = pdu.split_first() else {
            return Err(DecodeError::Empty);
        };
        if pdu.len() > MAX_PDU {
            return Err(DecodeError::TooLong { found: pdu.len() });
        }
        Ok(match function {
            0 | EXCEPTION_BIT => return Err(DecodeError::Function { found: function }),
            EXCEPTION_BIT.. => {
                check_exact(pdu, EXCEPTION_LEN)?;
                Self::Exception {
                    function: function & !EXCEPTION_BIT,
                    code: ExceptionCode(data.first().copied().unwrap_or_default()),
                }
            }
            READ_COILS => Self::ReadCoils(Bits::from_bytes(decode_data(pdu)?)),
            READ_DISCRETE_INPUTS => Self::ReadDiscreteInputs(Bits::from_bytes(decode_data(pdu)?)),
            READ_HOLDING_REGISTERS => Self::ReadHoldingRegisters(decode_registers(pdu)?),
            READ_INPUT_REGISTERS => Self::ReadInputRegisters(decode_registers(pdu)?),
            WRITE_SINGLE_COIL => {
                let (address, value) = decode_echo(pdu)?;
                Self::WriteSingleCoil { address, value }
            }
            WRITE_SINGLE_REGISTER => {
                let (address, value) = decode_echo(pdu)?;
                Self::WriteSingleRegister { address, value }
            }
            WRITE_MULTIPLE_COILS => {
                let (address, count) = decode_echo(pdu)?;
                Self::WriteMultipleCoils { address, count }
            }
            WRITE_MULTIPLE_REGISTERS => {
                let (address, count) = decode_echo(pdu)?;
                Self::WriteMultipleRegisters { address, count }
            }
            _ => Self::Other { function, data },
        })
    }

    /// Appends the PDU to `out`.
    ///
    /// # Errors
    /// Any [`EncodeError`]; `out` is then as it was.
    pub fn encode(&self, out: &mut Vec<u8>) -> Result<(), EncodeError> {
        let function = self.function();
        match *self {
            Self::ReadCoils(bits) | Self::ReadDiscreteInputs(bits) => {
                check_count(function, bits.len(), MAX_READ_BITS)?;
                out.extend_from_slice(&[function, byte(bits.byte_len())]);
                bits.append_to(out);
            }
            Self::ReadHoldingRegisters(registers) | Self::ReadInputRegisters(registers) => {
                check_count(function, registers.len(), MAX_READ_REGISTERS)?;
                out.extend_from_slice(&[function, byte(2 * registers.len())]);
                registers.append_to(out);
            }
            Self::WriteSingleCoil { address, value: second }
            | Self::WriteSingleRegister { address, value: second }
            | Self::WriteMultipleCoils { address, count: second }
            | Self::WriteMultipleRegisters { address, count: second } => {
                let [a, b] = address.to_be_bytes();
                let [c, d] = second.to_be_bytes();
                out.extend_from_slice(&[function, a, b, c, d]);
            }
            Self::Exception { function, code } => {
                check_function(function)?;
                out.extend_from_slice(&[function | EXCEPTION_BIT, code.0]);
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

    /// The function code, without the exception bit.
    #[must_use]
    pub fn function(&self) -> u8 {
        match *self {
            Self::ReadCoils(_) => READ_COILS,
            Self::ReadDiscreteInputs(_) => READ_DISCRETE_INPUTS,
            Self::ReadHoldingRegisters(_) => READ_HOLDING_REGISTERS,
            Self::ReadInputRegisters(_) => READ_INPUT_REGISTERS,
            Self::WriteSingleCoil { .. } => WRITE_SINGLE_COIL,
            Self::WriteSingleRegister { .. } => WRITE_SINGLE_REGISTER,
            Self::WriteMultipleCoils { .. } => WRITE_MULTIPLE_COILS,
            Self::WriteMultipleRegisters { .. } => WRITE_MULTIPLE_REGISTERS,
            Self::Exception { function, .. } | Self::Other { function, .. } => function,
        }
    }

    /// Whether this answers the request: same function, writes confirmed word for word, a read with just as much data
    /// as was asked for. An exception of the same function always does.
    ///
    /// # Errors
    /// The first [`Mismatch`] found.
    pub fn answers(&self, request: &Request<'_>) -> Result<(), Mismatch> {
        Expected::of(request).check(self)
    }

    /// Like [`answers`](Self::answers), but a read of registers may also be **short, if not empty**: Datakom
    /// controllers send the first 16 of a longer read. Only the caller can know that its device does so; from any
    /// other a short answer is a wrong one.
    ///
    /// # Errors
    /// The first [`Mismatch`] found.
    pub fn answers_in_part(&self, request: &Request<'_>) -> Result<(), Mismatch> {
        Expected::of(request).or_short().check(self)
    }
}

/// The data behind a byte count, which must be true.
fn decode_data(pdu: &[u8]) -> Result<&[u8], DecodeError> {
    let Some((&[function, declared], data)) = pdu.split_first_chunk::<2>() else {
        check_exact(pdu, 2)?;
        return Ok(&[]);
    };
    if data.len() != usize::from(declared) {
        return Err(DecodeError::Length { function, expected: 2 + usize::from(declared), found: pdu.len() });
    }
    Ok(data)
}

fn decode_registers(pdu: &[u8]) -> Result<Registers<'_>, DecodeError> {
    let data = decode_data(pdu)?;
    if data.len() % 2 != 0 {
        return Err(DecodeError::ByteCount {
            function: pdu.first().copied().unwrap_or_default(),
            expected: data.len() + 1,
            found: data.len(),
        });
    }
    Ok(Registers::from_bytes(data))
}

fn decode_echo(pdu: &[u8]) -> Result<(u16, u16), DecodeError> {
    check_exact(pdu, ECHO_LEN)?;
    Ok((word(pdu, 1), word(pdu, 3)))
}

fn check_exact(pdu: &[u8], expected: usize) -> Result<(), DecodeError> {
    if pdu.len() != expected {
        return Err(DecodeError::Length {
            function: pdu.first().copied().unwrap_or_default(),
            expected,
            found: pdu.len(),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_standards_examples_both_ways() {
        let words = [0x022B, 0x0000, 0x0064];
        let code = ExceptionCode::ILLEGAL_DATA_ADDRESS;
        let cases: [(&str, &[u8], Response<'_>); 11] = [
            ("6.1", &[1, 3, 0xCD, 0x6B, 0x05], Response::ReadCoils(Bits::from_bytes(&[0xCD, 0x6B, 0x05]))),
            (
                "6.2",
                &[2, 3, 0xAC, 0xDB, 0x35],
                Response::ReadDiscreteInputs(Bits::from_bytes(&[0xAC, 0xDB, 0x35])),
            ),
            ("6.3", &[3, 6, 2, 0x2B, 0, 0, 0, 0x64], Response::ReadHoldingRegisters((&words).into())),
            ("6.4", &[4, 2, 0x00, 0x0A], Response::ReadInputRegisters((&[10]).into())),
            ("6.5", &[5, 0, 0xAC, 0xFF, 0], Response::WriteSingleCoil { address: 0xAC, value: 0xFF00 }),
            ("6.6", &[6, 0, 1, 0, 3], Response::WriteSingleRegister { address: 1, value: 3 }),
            ("6.11", &[15, 0, 0x13, 0, 10], Response::WriteMultipleCoils { address: 0x13, count: 10 }),
            ("6.12", &[16, 0, 1, 0, 2], Response::WriteMultipleRegisters { address: 1, count: 2 }),
            ("7", &[0x81, 2], Response::Exception { function: 1, code }),
            ("7, unknown code", &[0xFF, 99], Response::Exception { function: 127, code: ExceptionCode(99) }),
            ("6.7", &[7, 0x6D], Response::Other { function: 7, data: &[0x6D] }),
        ];
        for (clause, pdu, response) in cases {
            assert_eq!(Response::decode(pdu), Ok(response), "{clause}");
            let mut out = vec![0xEE];
            assert_eq!(response.encode(&mut out), Ok(()), "{clause}");
            assert_eq!(out, [&[0xEE], pdu].concat(), "{clause}");
            assert_eq!(response.function(), pdu[0] & 0x7F, "{clause}");
        }
    }

    #[test]
    fn rejects_what_is_no_response() {
        let too_long = [0x03; 254];
        let cases: [(&[u8], DecodeError); 10] = [
            (&[], DecodeError::Empty),
            (&too_long, DecodeError::TooLong { found: 254 }),
            (&[0x00], DecodeError::Function { found: 0 }),
            (&[0x80, 1], DecodeError::Function { found: 0x80 }),
            (&[0x83], DecodeError::Length { function: 0x83, expected: 2, found: 1 }),
            (&[0x83, 2, 0], DecodeError::Length { function: 0x83, expected: 2, found: 3 }),
            (&[0x03], DecodeError::Length { function: 3, expected: 2, found: 1 }),
            (&[0x03, 4, 0, 0, 0], DecodeError::Length { function: 3, expected: 6, found: 5 }),
            (&[0x04, 3, 0, 0, 0], DecodeError::ByteCount { function: 4, expected: 4, found: 3 }),
            (&[0x06, 0, 1, 0], DecodeError::Length { function: 6, expected: 5, found: 4 }),
        ];
        for (pdu, error) in cases {
            assert_eq!(Response::decode(pdu), Err(error), "{pdu:02X?}");
        }
    }

    #[test]
    fn refuses_to_encode_what_the_standard_forbids() {
        let words = [0; 126];
        let bytes = [0; 253];
        let count = |function, found, max| EncodeError::Count { function, found, min: 1, max };
        let code = ExceptionCode(1);
        let cases = [
            (Response::ReadCoils(Bits::from_bytes(&[])), count(1, 0, 2000)),
            (Response::ReadDiscreteInputs(Bits::from_bytes(&bytes)), count(2, 2024, 2000)),
            (Response::ReadHoldingRegisters((&[]).into()), count(3, 0, 125)),
            (Response::ReadInputRegisters((&words).into()), count(4, 126, 125)),
            (Response::Exception { function: 0, code }, EncodeError::Function { found: 0 }),
            (Response::Exception { function: 0x83, code }, EncodeError::Function { found: 0x83 }),
            (Response::Other { function: 0x80, data: &[] }, EncodeError::Function { found: 0x80 }),
            (Response::Other { function: 7, data: &bytes }, EncodeError::TooLong { found: 254 }),
        ];
        for (response, error) in cases {
            let mut out = vec![0xEE];
            assert_eq!(response.encode(&mut out), Err(error));
            assert_eq!(out, [0xEE], "{error}");
        }
    }

    #[test]
    fn a_read_of_registers_may_be_short_where_that_is_allowed_and_nothing_else() {
        let read = Request::ReadHoldingRegisters { address: 0x2800, count: 3 };
        let length = |found| Err(Mismatch::Length { expected: 6, found });
        for (words, whole, part) in [
            (&[][..], length(0), length(0)),
            (&[1], length(2), Ok(())),
            (&[1, 2], length(4), Ok(())),
            (&[1, 2, 3], Ok(()), Ok(())),
            (&[0; 4], length(8), length(8)),
        ] {
            let response = Response::ReadHoldingRegisters(words.into());
            assert_eq!(response.answers(&read), whole, "{words:?}");
            assert_eq!(response.answers_in_part(&read), part, "{words:?}");
        }
        let coils = Request::ReadCoils { address: 0, count: 9 };
        for (bytes, verdict) in [
            (&[0_u8; 1][..], Err(Mismatch::Length { expected: 2, found: 1 })),
            (&[0; 2], Ok(())),
            (&[0; 3], Err(Mismatch::Length { expected: 2, found: 3 })),
        ] {
            let response = Response::ReadCoils(Bits::from_bytes(bytes));
            assert_eq!(response.answers(&coils), verdict, "{bytes:?}");
            assert_eq!(response.answers_in_part(&coils), verdict, "{bytes:?}");
        }
    }

    #[test]
    fn only_the_same_function_answers() {
        let read = Request::ReadHoldingRegisters { address: 0, count: 1 };
        let word = [7];
        let wrong = |found| Err(Mismatch::Function { expected: 3, found });
        let exception = |function| Response::Exception { function, code: ExceptionCode(2) };
        assert_eq!(exception(3).answers(&read), Ok(()));
        assert_eq!(exception(4).answers(&read), wrong(4));
        assert_eq!(Response::ReadInputRegisters((&word).into()).answers(&read), wrong(4));
        let other = Request::Other { function: 0x11, data: &[] };
        assert_eq!(Response::Other { function: 0x11, data: &[1, 2] }.answers(&other), Ok(()));
        assert_eq!(exception(0x11).answers(&other), Ok(()));
    }

    #[test]
    fn a_write_must_be_confirmed_word_for_word() {
        let words = [1, 2];
        let bits = Bits::new(&[0b11], 2).unwrap();
        let echo = |expected, found| Err(Mismatch::Echo { expected, found });
        let cases = [
            (
                Request::WriteSingleRegister { address: 0x2001, value: 4 },
                Response::WriteSingleRegister { address: 0x2001, value: 4 },
                Ok(()),
            ),
            (
                Request::WriteSingleRegister { address: 0x2001, value: 4 },
                Response::WriteSingleRegister { address: 0x2001, value: 8 },
                echo([0x20, 1, 0, 4], [0x20, 1, 0, 8]),
            ),
            (
                Request::WriteSingleCoil { address: 3, value: 0xFF00 },
                Response::WriteSingleCoil { address: 4, value: 0xFF00 },
                echo([0, 3, 0xFF, 0], [0, 4, 0xFF, 0]),
            ),
            (
                Request::WriteMultipleRegisters { address: 9, registers: (&words).into() },
                Response::WriteMultipleRegisters { address: 9, count: 2 },
                Ok(()),
            ),
            (
                Request::WriteMultipleRegisters { address: 9, registers: (&words).into() },
                Response::WriteMultipleRegisters { address: 9, count: 1 },
                echo([0, 9, 0, 2], [0, 9, 0, 1]),
            ),
            (
                Request::WriteMultipleCoils { address: 9, coils: bits },
                Response::WriteMultipleCoils { address: 9, count: 2 },
                Ok(()),
            ),
        ];
        for (request, response, verdict) in cases {
            assert_eq!(response.answers(&request), verdict, "{request:?}");
        }
    }
}
