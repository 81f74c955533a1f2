//! Any text as a profile.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| busbar_fuzz::profiles::profile_text(bytes));
