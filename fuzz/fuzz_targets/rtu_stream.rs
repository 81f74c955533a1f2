//! Any bytes from a serial line, in any pieces, to a server.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| busbar_fuzz::frames::rtu_stream(bytes));
