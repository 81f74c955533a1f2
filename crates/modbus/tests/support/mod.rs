//! What several test files need.

use std::time::Duration;

/// Bytes from hex digits; spaces are for the reader.
pub(crate) fn hex(text: &str) -> Vec<u8> {
    let digits: Vec<u8> = text.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
    assert!(digits.len().is_multiple_of(2), "half a byte in {text:?}");
    let digit = |byte: u8| {
        let value = (byte as char).to_digit(16);
        assert!(value.is_some(), "{:?} is no hex digit in {text:?}", byte as char);
        value.unwrap_or_default() as u8
    };
    digits.chunks(2).map(|pair| digit(pair[0]) << 4 | digit(pair[1])).collect()
}

/// Milliseconds of a script's clock.
#[allow(dead_code)] // Not every file has a clock.
pub(crate) fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}
