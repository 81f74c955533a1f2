//! What must hold for any profile text and any registers, one function a fuzz target. The tests of `busbar-profile`
//! include this file to replay the corpus.

// Public for the fuzz targets; in a test it is a private module, and what fails there may panic.
#![allow(unreachable_pub, dead_code, clippy::expect_used, clippy::panic)]

use busbar_profile::{Access, Point, Profile, Quality, Value, WordOrder, builtins, decode_window, reading};

/// Any text is a profile or has findings, each with a place and a remedy; nothing panics.
pub fn profile_text(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match Profile::parse("fuzz.toml", text) {
        Ok(profile) => {
            let all: Vec<usize> = (0..profile.points.len()).collect();
            for read in busbar_profile::plan::plan(&profile, &all) {
                assert!(profile.wire.is_readable(read.address, read.count), "a read leaves the map");
                assert!(read.count >= 1 && read.count <= profile.wire.max_read);
            }
        }
        Err(findings) => {
            assert!(!findings.to_string().is_empty());
            for line in findings.to_string().lines() {
                assert!(!line.trim().is_empty());
            }
        }
    }
}

/// Registers at any address of any built-in profile: a sentinel never becomes a number, and what decodes and encodes
/// gives the same value again. The first bytes choose profile, word order and address; the rest are registers.
pub fn register_image(bytes: &[u8]) {
    let [profile, order, high, low, registers @ ..] = bytes else { return };
    let Some(profile) = builtins().get(usize::from(*profile) % builtins().len().max(1)) else { return };
    let order = if order % 2 == 0 { WordOrder::LowFirst } else { WordOrder::HighFirst };
    let registers: Vec<u16> =
        registers.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect();
    // The address counts from the first point, so that short inputs meet points.
    let base = profile.points.first().map_or(0, |point| point.address);
    let address = base.wrapping_add(u16::from_be_bytes([*high, *low]) % 4096);
    for (point, decoded) in decode_window(profile, address, &registers, order) {
        let from = usize::from(point.address - address);
        let raw = &registers[from..from + usize::from(point.registers)];
        let shown = serde_json::to_value(reading(point, &decoded, raw, None)).expect("a reading is JSON");
        match decoded.quality {
            Quality::Good => assert!(!shown["value"].is_null(), "{}: good without a value", point.id),
            _ => assert!(shown["value"].is_null(), "{}: a value that is not good", point.id),
        }
        if let Some(value) = &decoded.value {
            assert!(!is_sentinel(point, raw), "{}: a sentinel became a value", point.id);
            comes_back(point, value, raw, order);
        }
    }
}

/// Whether a one-register point holds one of its sentinels.
fn is_sentinel(point: &Point, raw: &[u16]) -> bool {
    matches!(raw, [word] if point.field.is_none() && point.sentinels.contains(&u64::from(*word)))
}

fn comes_back(point: &Point, value: &Value, raw: &[u16], order: WordOrder) {
    if point.access == Access::Write {
        return;
    }
    let mut again = raw.to_vec();
    if point.encode(value, order, &mut again).is_ok() {
        assert_eq!(point.decode(&again, order).value.as_ref(), Some(value), "{}", point.id);
    }
}
