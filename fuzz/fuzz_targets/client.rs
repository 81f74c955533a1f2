//! Any exchange with any bytes as answers.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| busbar_fuzz::frames::client(bytes));
