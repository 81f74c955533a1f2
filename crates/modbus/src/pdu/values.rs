//! Views of registers and coils, wherever their bytes or words lie.

use std::fmt;
use std::iter::FusedIterator;
use std::slice;

/// Registers seen in place: in the big-endian bytes of a PDU, or in words of the caller.
///
/// Two views are equal when they hold the same values, whichever way they hold them.
#[derive(Clone, Copy)]
pub struct Registers<'a>(Words<'a>);

#[derive(Clone, Copy)]
enum Words<'a> {
    Wire(&'a [[u8; 2]]),
    Native(&'a [u16]),
}

impl<'a> Registers<'a> {
    /// Sees big-endian bytes as registers; an odd byte at the end is none.
    #[must_use]
    pub fn from_bytes(bytes: &'a [u8]) -> Self {
        Self(Words::Wire(bytes.as_chunks().0))
    }

    /// Number of registers.
    #[must_use]
    pub fn len(&self) -> usize {
        match self.0 {
            Words::Wire(words) => words.len(),
            Words::Native(words) => words.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The value of the register `index` places after the first.
    #[must_use]
    pub fn at(&self, index: usize) -> Option<u16> {
        match self.0 {
            Words::Wire(words) => words.get(index).map(|word| u16::from_be_bytes(*word)),
            Words::Native(words) => words.get(index).copied(),
        }
    }

    /// The values in address order.
    #[must_use]
    pub fn iter(&self) -> RegistersIter<'a> {
        RegistersIter(match self.0 {
            Words::Wire(words) => Walk::Wire(words.iter()),
            Words::Native(words) => Walk::Native(words.iter()),
        })
    }

    /// Appends the big-endian bytes.
    pub(super) fn append_to(&self, out: &mut Vec<u8>) {
        match self.0 {
            Words::Wire(words) => out.extend_from_slice(words.as_flattened()),
            Words::Native(words) => {
                let from = out.len();
                out.resize(from + 2 * words.len(), 0);
                let places = out[from..].as_chunks_mut().0;
                for (place, word) in places.iter_mut().zip(words) {
                    *place = word.to_be_bytes();
                }
            }
        }
    }
}

impl<'a> From<&'a [u16]> for Registers<'a> {
    fn from(words: &'a [u16]) -> Self {
        Self(Words::Native(words))
    }
}

impl<'a, const N: usize> From<&'a [u16; N]> for Registers<'a> {
    fn from(words: &'a [u16; N]) -> Self {
        Self(Words::Native(words))
    }
}

impl<'a> From<&'a Vec<u16>> for Registers<'a> {
    fn from(words: &'a Vec<u16>) -> Self {
        Self(Words::Native(words))
    }
}

impl<'a> IntoIterator for Registers<'a> {
    type Item = u16;
    type IntoIter = RegistersIter<'a>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl PartialEq for Registers<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

impl Eq for Registers<'_> {}

impl fmt::Debug for Registers<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

/// Iterator over the values of [`Registers`].
#[derive(Clone, Debug)]
pub struct RegistersIter<'a>(Walk<'a>);

#[derive(Clone, Debug)]
enum Walk<'a> {
    Wire(slice::Iter<'a, [u8; 2]>),
    Native(slice::Iter<'a, u16>),
}

impl Iterator for RegistersIter<'_> {
    type Item = u16;

    fn next(&mut self) -> Option<u16> {
        match &mut self.0 {
            Walk::Wire(words) => words.next().map(|word| u16::from_be_bytes(*word)),
            Walk::Native(words) => words.next().copied(),
        }
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        match &self.0 {
            Walk::Wire(words) => words.size_hint(),
            Walk::Native(words) => words.size_hint(),
        }
    }
}

impl ExactSizeIterator for RegistersIter<'_> {}
impl FusedIterator for RegistersIter<'_> {}

/// Coils or discrete inputs seen in place, eight a byte, the first in the lowest bit (V1.1b3, 6.1).
///
/// A response does not say how many it holds, only how many bytes: decoded, it has eight for every byte and the last
/// ones may be padding; [`Bits::first`] cuts them to the number asked. Two views are equal when they hold the same
/// states; bits beyond the last are not looked at and never sent.
#[derive(Clone, Copy)]
pub struct Bits<'a> {
    bytes: &'a [u8],
    count: usize,
}

impl<'a> Bits<'a> {
    /// The first `count` bits of `bytes`; `None` when there are fewer.
    #[must_use]
    pub fn new(bytes: &'a [u8], count: usize) -> Option<Self> {
        let bytes = bytes.get(..count.div_ceil(8))?;
        Some(Self { bytes, count })
    }

    /// All bits of `bytes`.
    #[must_use]
    pub fn from_bytes(bytes: &'a [u8]) -> Self {
        Self { bytes, count: bytes.len() * 8 }
    }

    /// Packs states into `buffer`, which is cleared first, and sees them there.
    #[must_use]
    pub fn pack(states: impl IntoIterator<Item = bool>, buffer: &'a mut Vec<u8>) -> Self {
        buffer.clear();
        let mut count = 0;
        for state in states {
            if count % 8 == 0 {
                buffer.push(0);
            }
            if let Some(last) = buffer.last_mut() {
                *last |= u8::from(state) << (count % 8);
            }
            count += 1;
        }
        Self { bytes: buffer, count }
    }

    /// Number of bits.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The state of the bit `index` places after the first.
    #[must_use]
    pub fn at(&self, index: usize) -> Option<bool> {
        if index >= self.count {
            return None;
        }
        let byte = self.bytes.get(index / 8)?;
        Some(byte >> (index % 8) & 1 == 1)
    }

    /// The first `count` of them; all when there are no more.
    #[must_use]
    pub fn first(&self, count: usize) -> Self {
        Self::new(self.bytes, count.min(self.count)).unwrap_or(*self)
    }

    /// The states in address order.
    #[must_use]
    pub fn iter(&self) -> BitsIter<'a> {
        BitsIter { bits: *self, next: 0 }
    }

    /// Bytes on the wire.
    pub(super) fn byte_len(&self) -> usize {
        self.bytes.len()
    }

    /// Appends the packed bytes, padding bits as 0 (V1.1b3, 6.1).
    pub(super) fn append_to(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(self.bytes);
        let used = self.count % 8;
        if used != 0
            && let Some(last) = out.last_mut()
        {
            *last &= 0xFF >> (8 - used);
        }
    }
}

impl<'a> IntoIterator for Bits<'a> {
    type Item = bool;
    type IntoIter = BitsIter<'a>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl PartialEq for Bits<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

impl Eq for Bits<'_> {}

impl fmt::Debug for Bits<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter().map(u8::from)).finish()
    }
}

/// Iterator over the states of [`Bits`].
#[derive(Clone, Debug)]
pub struct BitsIter<'a> {
    bits: Bits<'a>,
    next: usize,
}

impl Iterator for BitsIter<'_> {
    type Item = bool;

    fn next(&mut self) -> Option<bool> {
        let state = self.bits.at(self.next)?;
        self.next += 1;
        Some(state)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.bits.count - self.next;
        (left, Some(left))
    }
}

impl ExactSizeIterator for BitsIter<'_> {}
impl FusedIterator for BitsIter<'_> {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_are_equal_however_they_are_held() {
        let wire = Registers::from_bytes(&[0x12, 0x34, 0xFF, 0xFE]);
        let native = Registers::from(&[0x1234, 0xFFFE]);
        assert_eq!(wire, native);
        assert_ne!(wire, Registers::from(&[0x1234]));
        assert_ne!(wire, Registers::from(&[0x1234, 0xFEFF]));
        assert_eq!(wire.iter().collect::<Vec<_>>(), [0x1234, 0xFFFE]);
        assert_eq!((wire.len(), wire.at(1), wire.at(2)), (2, Some(0xFFFE), None));
        assert_eq!(native.iter().len(), 2);
        assert_eq!(format!("{wire:?}"), "[4660, 65534]");
    }

    #[test]
    fn an_odd_byte_is_no_register() {
        assert_eq!(Registers::from_bytes(&[0, 1, 2]), Registers::from(&[1]));
        assert!(Registers::from_bytes(&[1]).is_empty());
    }

    #[test]
    fn registers_append_big_endian() {
        for view in [Registers::from_bytes(&[0x12, 0x34, 0xAB, 0xCD]), Registers::from(&[0x1234, 0xABCD])] {
            let mut out = vec![0xEE];
            view.append_to(&mut out);
            assert_eq!(out, [0xEE, 0x12, 0x34, 0xAB, 0xCD]);
        }
    }

    #[test]
    fn bits_begin_at_the_lowest() {
        let bits = Bits::new(&[0b0000_0101, 0b0000_0010], 10).unwrap();
        let states: Vec<u8> = bits.iter().map(u8::from).collect();
        assert_eq!(states, [1, 0, 1, 0, 0, 0, 0, 0, 0, 1]);
        assert_eq!((bits.len(), bits.at(9), bits.at(10)), (10, Some(true), None));
        assert_eq!(bits.iter().len(), 10);
        assert!(Bits::new(&[0xFF], 9).is_none());
        assert!(Bits::new(&[], 0).unwrap().is_empty());
    }

    #[test]
    fn bits_beyond_the_last_do_not_count() {
        let clean = Bits::new(&[0x01], 3).unwrap();
        let dirty = Bits::new(&[0xF9], 3).unwrap();
        assert_eq!(clean, dirty);
        let mut out = Vec::new();
        dirty.append_to(&mut out);
        assert_eq!(out, [0x01]);
        assert_eq!(Bits::from_bytes(&[0xF9]).first(3), clean);
        assert_eq!(Bits::from_bytes(&[0xF9]).first(99).len(), 8);
        assert_ne!(Bits::from_bytes(&[0x01]), clean);
    }

    #[test]
    fn packs_states() {
        let mut buffer = vec![9, 9, 9];
        let states = [true, false, true, true, false, false, true, true, true, true];
        let bits = Bits::pack(states, &mut buffer);
        assert_eq!(bits.iter().collect::<Vec<_>>(), states);
        assert_eq!(buffer, [0xCD, 0x03]);
    }
}
