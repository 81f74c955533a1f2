//! What holds for every profile, every value and every text.
#![cfg(test)]

use busbar_profile::{
    BitSet, DataType, EncodeError, Image, Number, Point, Profile, Quality, Value, WordOrder, builtins,
    decode_window, reading,
};
use proptest::prelude::*;
use proptest::sample::select;

const SOUND: &str = include_str!("sound.toml");

/// The built-in profiles, and one that has every data type.
fn profiles() -> Vec<Profile> {
    let sound = Profile::parse("sound.toml", SOUND).unwrap_or_else(|findings| panic!("{findings}"));
    assert!(DataType::ALL.iter().all(|kind| sound.points.iter().any(|point| point.data_type == *kind)));
    builtins().iter().cloned().chain([sound]).collect()
}

fn orders() -> impl Strategy<Value = WordOrder> {
    select(WordOrder::ALL)
}

/// A point of any profile and as many random registers.
fn points_with_registers() -> impl Strategy<Value = (Point, Vec<u16>)> {
    let points: Vec<Point> = profiles().into_iter().flat_map(|profile| profile.points).collect();
    select(points).prop_flat_map(|point| {
        // Every type's edges are more likely than chance would have them.
        let register = prop_oneof![
            any::<u16>(),
            select(&[0, 1, 0x7F, 0x80, 0xFF, 0x7FFE, 0x7FFF, 0x8000, 0xFFFE, 0xFFFF][..])
        ];
        let registers = prop::collection::vec(register, usize::from(point.registers));
        (Just(point), registers)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4096))]

    /// Encoding what was decoded and decoding it again is the same value, whatever the registers held before.
    #[test]
    fn decode_of_encode_is_identity((point, registers) in points_with_registers(), order in orders(), noise in any::<u16>()) {
        let decoded = point.decode(&registers, order);
        let Some(value) = &decoded.value else {
            prop_assert_eq!(decoded.quality, Quality::Invalid);
            prop_assert!(!point.sentinels.is_empty());
            let mut again = vec![noise; registers.len()];
            prop_assert_eq!(point.encode_invalid(order, &mut again), Ok(()));
            prop_assert_eq!(point.decode(&again, order), decoded);
            return Ok(());
        };
        let mut again = vec![noise; registers.len()];
        prop_assert_eq!(point.encode(value, order, &mut again), Ok(()));
        prop_assert_eq!(&point.decode(&again, order), &decoded);
    }

    /// Any number is either written to the nearest step or refused with the registers untouched.
    #[test]
    fn encoding_a_number_is_near_or_refused(
        (point, registers) in points_with_registers(),
        order in orders(),
        mantissa in prop_oneof![any::<i64>(), -100_000..100_000_i64],
        decimals in 0..=Number::MAX_DECIMALS,
    ) {
        let number = Number::new(mantissa, decimals).unwrap();
        let mut written = registers.clone();
        match point.encode(&Value::Number(number), order, &mut written) {
            Ok(()) => {
                let back = point.decode(&written, order).value.unwrap().as_number().unwrap();
                let scale = point.scale.map_or(1.0, |scale| scale.num() as f64 / scale.den() as f64);
                // A fraction of full scale does not terminate: it is shown rounded to 4 decimals.
                let fraction = matches!(point.data_type, DataType::Fraction8 | DataType::Fraction16);
                let near = scale * 0.501 + if fraction { 0.000_05 } else { 0.0 };
                prop_assert!((back.as_f64() - number.as_f64()).abs() <= near, "{number} became {back}");
            }
            Err(error) => {
                prop_assert_eq!(&written, &registers);
                let refused = matches!(error, EncodeError::Range { .. } | EncodeError::Kind { .. } | EncodeError::Sentinel { .. });
                prop_assert!(refused, "{error}");
            }
        }
    }

    /// A value of any kind and size is written or refused, never more.
    #[test]
    fn encoding_is_total((point, registers) in points_with_registers(), order in orders(), bytes in prop::collection::vec(any::<u8>(), 0..64), code in any::<u32>()) {
        let bits = BitSet::from_registers(&bytes.iter().map(|byte| u16::from(*byte) << 7).collect::<Vec<_>>());
        for value in [
            Value::Choice { code },
            Value::Bits(bits),
            Value::Codes(bytes.clone()),
            Value::Trace(bytes.iter().map(|byte| i16::from(*byte) - 128).collect()),
            Value::Bytes(bytes.clone()),
        ] {
            let mut written = registers.clone();
            match point.encode(&value, order, &mut written) {
                Ok(()) => prop_assert_eq!(point.decode(&written, order).value, Some(value)),
                Err(_) => prop_assert_eq!(&written, &registers),
            }
        }
    }

    /// Any window over any profile decodes, and prints, without a panic; a number never comes out of a sentinel.
    #[test]
    fn decoding_never_panics(profile in select(profiles()), address in any::<u16>(), registers in prop::collection::vec(any::<u16>(), 0..700), order in orders()) {
        for (point, decoded) in decode_window(&profile, address, &registers, order) {
            let raw = point.within(address, &registers).unwrap();
            let shown = serde_json::to_value(reading(point, &decoded, raw, None)).unwrap();
            prop_assert_eq!(shown["value"].is_null(), decoded.quality == Quality::Invalid);
            if let [word] = raw && !point.sentinels.is_empty() && point.field.is_none() && point.data_type == DataType::I16 {
                prop_assert_eq!(point.sentinels.contains(&u64::from(*word)), decoded.value.is_none());
            }
        }
        for point in &profile.points {
            prop_assert_eq!(point.decode(&registers, order).quality == Quality::Bad, registers.len() != usize::from(point.registers));
        }
    }

    /// What an image says has changed is what differs from before.
    #[test]
    fn an_image_tells_what_changed(profile in select(profiles()), stores in prop::collection::vec((any::<prop::sample::Index>(), prop::collection::vec(0..3_u16, 1..40)), 1..12)) {
        let mut image = Image::new(&profile);
        let readable: Vec<usize> = (0..profile.points.len()).filter(|index| profile.points[*index].access.is_readable()).collect();
        for (place, registers) in stores {
            let (first, _) = profile.wire.readable[place.index(profile.wire.readable.len())];
            let address = first.saturating_add(place.index(50) as u16).saturating_sub(5);
            let before: Vec<_> = readable.iter().map(|index| image.registers(*index).map(<[u16]>::to_vec)).collect();
            let mut changed = vec![usize::MAX];
            image.store(address, &registers, &mut changed);
            let expected: Vec<usize> = readable
                .iter()
                .zip(&before)
                .filter(|(index, before)| image.registers(**index) != before.as_deref())
                .map(|(index, _)| *index)
                .collect();
            prop_assert_eq!(&changed[1..], &expected[..]);
        }
    }

    /// Any text is refused with at least one finding inside it, and never a panic.
    #[test]
    fn parsing_never_panics(text in "\\PC{0,400}") {
        let findings = Profile::parse("x.toml", &text).unwrap_err();
        prop_assert!(findings.iter().all(|finding| finding.offset + finding.length <= text.len()));
        prop_assert!(!findings.is_empty());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// A good profile with a piece cut out, doubled or overwritten is read or refused, never a panic.
    #[test]
    fn a_damaged_profile_never_panics(start in any::<prop::sample::Index>(), len in 0..80_usize, insert in "[\\[\\]{}=,\"'#\\\\0-9a-z \n]{0,12}", repeat in any::<bool>()) {
        let text: Vec<char> = SOUND.chars().collect();
        let start = start.index(text.len());
        let end = (start + len).min(text.len());
        let mut damaged: String = text[..start].iter().collect();
        damaged.push_str(&insert);
        damaged.extend(&text[if repeat { start } else { end }..]);
        if let Err(findings) = Profile::parse("x.toml", &damaged) {
            for finding in &findings {
                prop_assert!(damaged.get(finding.offset..finding.offset + finding.length).is_some());
                prop_assert!(!finding.help.is_empty() && finding.line >= 1 && finding.column >= 1);
            }
        }
    }
}

/// Whoever answers one family's signature is no device of another.
#[test]
fn no_family_answers_the_signature_of_another() {
    use busbar_profile::signature::{answers, signature};
    for profile in builtins() {
        let signature = signature(profile, builtins());
        for reads in [&signature.first, &signature.second] {
            assert!(reads.iter().all(|read| answers(profile, *read) && read.count <= 4), "{}", profile.key);
            for other in builtins().iter().filter(|other| other.key != profile.key) {
                let refused = reads.iter().any(|read| !answers(other, *read));
                assert!(refused, "a {} answers {reads:?} of {}", other.key, profile.key);
            }
        }
    }
}
