//! The display over the wire: what stands on its pages, read back as pixels and letters.

use std::collections::HashMap;

use busbar_profile::Value;

use super::set;
use crate::site::{CHANNEL_SELECT, RUN, STOP, Site, TEST};

const NEXT: u16 = 1 << 7;
const PREVIOUS: u16 = 1 << 8;
const UP: u16 = 1 << 9;
const DOWN: u16 = 1 << 10;
const LONG: u16 = 1 << 14;

/// 64 rows of 128 pixels from the top, in the order that `domain.md` decided: pages from the bottom, two columns a
/// register, the low byte left.
fn pixels(site: &Site) -> Vec<Vec<bool>> {
    let Some(Value::Bytes(bytes)) = site.decode("lcd").value else { panic!("no picture") };
    (0..64)
        .map(|y: usize| {
            let (page, bit) = ((63 - y) / 8, (63 - y) % 8);
            (0..128).map(|x: usize| bytes[page * 128 + (x ^ 1)] >> bit & 1 == 1).collect()
        })
        .collect()
}

/// The letters of a line, learned from the display itself: a cell of 6 x 8 pixels each, inverted or not.
fn cells(site: &Site, line: usize) -> Vec<Vec<bool>> {
    let pixels = pixels(site);
    let inverted = pixels[line * 8 + 7][127];
    (0..21)
        .map(|column| {
            (0..7)
                .flat_map(|y| (0..5).map(move |x| (line * 8 + y, column * 6 + x)))
                .map(|(y, x)| pixels[y][x] != inverted)
                .collect()
        })
        .collect()
}

/// A font that knows the letters of texts which are known to stand somewhere.
struct Reader(HashMap<Vec<bool>, char>);

impl Reader {
    fn new() -> Self {
        let mut font = HashMap::new();
        let mut site = Site::quiet();
        let mut learn = |site: &Site, line: usize, text: &str| {
            for (cell, letter) in cells(site, line).into_iter().zip(text.chars()) {
                let known = font.entry(cell).or_insert(letter);
                assert_eq!(*known, letter, "two letters look alike");
            }
        };
        // Labels of the profile, as the display writes them.
        learn(&site, 0, "D-500            AUTO");
        learn(&site, 1, "GENSET AT REST       ");
        learn(&site, 7, "NO ALARMS            ");
        site.press(TEST);
        site.pass_seconds(1);
        learn(&site, 0, "D-500            TEST");
        learn(&site, 1, "WAIT BEFORE FUEL     ");
        site.press(STOP);
        learn(&site, 0, "D-500            STOP");
        site.pass_seconds(1);
        site.device.inject("warning_alarms.high_oil_pressure", true).unwrap();
        site.device.inject("warning_alarms.communication_lost", true).unwrap();
        site.device.inject("warning_alarms.excitation_lost", true).unwrap();
        site.pass_seconds(1);
        learn(&site, 2, "W HIGH OIL PRESSURE  ");
        learn(&site, 3, "W EXCITATION LOST    ");
        learn(&site, 4, "W COMMUNICATION LOST ");
        Self(font)
    }

    fn line(&self, site: &Site, line: usize) -> String {
        let letters = cells(site, line);
        letters
            .iter()
            .map(|cell| self.0.get(cell).copied().unwrap_or('?'))
            .collect::<String>()
            .trim_end()
            .to_owned()
    }
}

#[test]
fn every_page_bears_the_model_and_the_mode() {
    let reader = Reader::new();
    let mut site = Site::quiet();
    let mut pages = std::collections::BTreeSet::new();
    for _ in 0..10 {
        assert_eq!(reader.line(&site, 0), "D-500            AUTO");
        pages.insert(pixels(&site));
        site.press(DOWN);
        pages.insert(pixels(&site));
        site.press(UP);
        site.press(NEXT);
    }
    assert!(pages.len() >= 15, "{}", pages.len());
    let first = Site::quiet();
    assert_eq!(pixels(&site), pixels(&first), "the last group is followed by the first");
    site.press(PREVIOUS);
    assert_ne!(pixels(&site), pixels(&first));
    site.press(PREVIOUS | LONG);
    assert_eq!(pixels(&site), pixels(&first), "held, it goes home");
}

#[test]
fn the_status_follows_the_register() {
    let reader = Reader::new();
    let mut site = Site::quiet();
    assert_eq!(reader.line(&site, 1), "GENSET AT REST");
    site.press(TEST);
    site.walk_to(1);
    assert_eq!(reader.line(&site, 1), "WAIT BEFORE FUEL");
}

#[test]
fn the_page_of_alarms_comes_by_itself_and_lists_the_gravest_first() {
    let reader = Reader::new();
    let mut site = Site::quiet();
    site.device.inject("warning_alarms.low_oil_pressure", true).unwrap();
    site.pass_seconds(1);
    assert_eq!(reader.line(&site, 2), "W LOW OIL PRESSURE");
    site.device.inject("shutdown_alarms.fail_to_start", true).unwrap();
    site.pass_seconds(1);
    assert_eq!(reader.line(&site, 2), "S FAIL TO START");
    assert_eq!(reader.line(&site, 3), "W LOW OIL PRESSURE");
    site.press(PREVIOUS | LONG);
    assert_eq!(reader.line(&site, 1), "GENSET AT REST");
    assert_ne!(reader.line(&site, 7), "NO ALARMS");
    site.press(NEXT | LONG);
    assert_eq!(reader.line(&site, 2), "S FAIL TO START");

    // More than a page holds are turned with the arrows.
    for id in ["low_battery_voltage", "over_load", "over_current", "fail_to_stop", "excitation_lost"] {
        site.device.inject(&format!("warning_alarms.{id}"), true).unwrap();
    }
    site.pass_seconds(1);
    assert_eq!(reader.line(&site, 2), "S FAIL TO START");
    site.press(DOWN);
    assert_eq!(reader.line(&site, 2), "W EXCITATION LOST");
    site.press(DOWN);
    assert_eq!(reader.line(&site, 2), "S FAIL TO START");
}

#[test]
fn the_scope_page_draws_the_trace_of_the_channel() {
    let mut site = Site::quiet();
    for _ in 0..5 {
        site.press(NEXT);
    }
    site.write(CHANNEL_SELECT, 0);
    let Some(Value::Trace(trace)) = site.decode("scope").value else { panic!("no trace") };
    let drawn = pixels(&site);
    let peak = trace.iter().map(|sample| f64::from(*sample).abs()).fold(0.0, f64::max);
    for (x, sample) in trace.iter().enumerate().take(99) {
        let y = (39.0 - f64::from(*sample) / peak * 22.0).round() as usize;
        assert!(drawn[y][14 + x], "sample {x} = {sample} is not at {y}");
    }
    let before = pixels(&site);
    site.write(CHANNEL_SELECT, 12);
    assert_ne!(pixels(&site), before);
}

#[test]
fn the_synchroscope_needs_two_sources() {
    let mut site = set(&[("no_break_transfer", "1"), ("synchronizing_time", "600")]);
    for _ in 0..4 {
        site.press(NEXT);
    }
    let needle = |site: &Site| (5..124).filter(|x| pixels(site)[52][*x]).map(|x| x as f64).sum::<f64>() / 3.0;
    assert_eq!(needle(&site), 0.0, "the genset stands");
    site.press(TEST);
    site.walk_to(9);
    assert!(needle(&site) > 4.0);
    site.walk_to(11);
    assert!((needle(&site) - 64.0).abs() < 5.0, "in step it stands in the middle: {}", needle(&site));
}

#[test]
fn the_mimic_shows_the_breakers() {
    let mut site = Site::quiet();
    site.press(DOWN);
    let at_rest = pixels(&site);
    assert!(at_rest[28][40] && !at_rest[28][86], "mains closed, genset open");
    site.press(RUN);
    site.walk_to(8);
    site.press(crate::site::GCB);
    site.walk_to(13);
    let loaded = pixels(&site);
    assert!(!loaded[28][40] && loaded[28][86], "the other way round");
}

#[test]
fn what_is_pinned_is_shown() {
    let reader = Reader::new();
    let mut site = set(&[("shutdown_alarms", "high_oil_pressure")]);
    site.press(NEXT | LONG);
    assert_eq!(reader.line(&site, 2), "S HIGH OIL PRESSURE");
}
