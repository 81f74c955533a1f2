//! Any registers against every built-in profile.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| busbar_fuzz::profiles::register_image(bytes));
