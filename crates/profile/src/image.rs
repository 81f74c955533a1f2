//! The registers of one device, as far as they have been read, and which points a read has changed.

use std::ops::Range;
use std::sync::Arc;

use crate::point::Point;
use crate::profile::Profile;

/// The registers of one device over its readable ranges.
///
/// A client stores answers in it; an imitated device serves reads out of it. Devices of one profile share everything
/// but the registers: ten thousand of them have to fit into a small machine.
#[derive(Clone, Debug)]
pub struct Image {
    outline: Arc<Outline>,
    registers: Box<[u16]>,
    known: Known,
}

/// Where registers and points of a profile stand in an image.
#[derive(Debug)]
pub(crate) struct Outline {
    spans: Vec<Span>,
    /// Points over register `i` are `points[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    points: Vec<u32>,
    /// First register and length of each point, by its index in the profile; length 0 where it cannot be read.
    places: Vec<(u32, u32)>,
}

/// A readable range and where it begins among the registers.
#[derive(Clone, Copy, Debug)]
struct Span {
    first: u16,
    last: u16,
    base: usize,
}

impl Outline {
    pub(crate) fn new(readable: &[(u16, u16)], points: &[Point]) -> Self {
        let mut spans = Vec::with_capacity(readable.len());
        let mut len = 0;
        for &(first, last) in readable {
            spans.push(Span { first, last, base: len });
            len += usize::from(last - first) + 1;
        }
        let mut outline =
            Self { spans, starts: Vec::with_capacity(len + 1), points: Vec::new(), places: Vec::new() };
        outline.index(len, points);
        outline
    }

    fn index(&mut self, len: usize, points: &[Point]) {
        let mut over = vec![Vec::new(); len];
        for (index, point) in points.iter().enumerate() {
            let place = match self.position(point.address, usize::from(point.registers)) {
                Some(start) if point.access.is_readable() => (start, usize::from(point.registers)),
                _ => (0, 0),
            };
            for list in &mut over[place.0..place.0 + place.1] {
                list.push(index as u32);
            }
            self.places.push((place.0 as u32, place.1 as u32));
        }
        for list in over {
            self.starts.push(self.points.len() as u32);
            self.points.extend(list);
        }
        self.starts.push(self.points.len() as u32);
    }

    /// How many registers there are.
    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Where a window begins; none if it is empty or not inside one range.
    fn position(&self, address: u16, count: usize) -> Option<usize> {
        let after = self.spans.partition_point(|span| span.first <= address);
        let span = self.spans[..after].last()?;
        let end = usize::from(address) + count;
        if count == 0 || end > usize::from(span.last) + 1 {
            return None;
        }
        Some(span.base + usize::from(address - span.first))
    }
}

/// Which registers are known, a bit each.
#[derive(Clone, Debug)]
struct Known(Box<[u64]>);

impl Known {
    fn new(len: usize, known: bool) -> Self {
        let word = if known { u64::MAX } else { 0 };
        Self(vec![word; len.div_ceil(64)].into())
    }

    fn get(&self, slot: usize) -> bool {
        self.0[slot / 64] >> (slot % 64) & 1 == 1
    }

    fn set(&mut self, slot: usize) {
        self.0[slot / 64] |= 1 << (slot % 64);
    }

    fn all(&self, mut range: Range<usize>) -> bool {
        range.all(|slot| self.get(slot))
    }
}

impl Image {
    /// An image of which nothing has been read yet.
    pub fn new(profile: &Profile) -> Self {
        Self::filled(profile, false)
    }

    /// An image in which every register is known and 0: what an imitated device starts from.
    pub fn zeroed(profile: &Profile) -> Self {
        Self::filled(profile, true)
    }

    fn filled(profile: &Profile, known: bool) -> Self {
        let outline = Arc::clone(&profile.outline);
        let len = outline.len();
        Self { outline, registers: vec![0; len].into(), known: Known::new(len, known) }
    }

    /// Takes over the registers of an answer, and appends to `changed` the index of each point that is now wholly known
    /// and differs from before, in address order and each once.
    ///
    /// Registers outside the readable ranges are ignored.
    pub fn store(&mut self, address: u16, registers: &[u16], changed: &mut Vec<usize>) {
        let already = changed.len();
        let end = usize::from(address) + registers.len();
        for span in &self.outline.spans {
            let (first, last) = (usize::from(span.first), usize::from(span.last));
            let from = usize::from(address).max(first);
            let to = end.min(last + 1);
            if from >= to {
                continue;
            }
            let window = &registers[from - usize::from(address)..to - usize::from(address)];
            let base = span.base + from - first;
            let range = base..base + window.len();
            if self.registers[range.clone()] == *window && self.known.all(range) {
                continue;
            }
            for (slot, &register) in (base..).zip(window) {
                if self.known.get(slot) && self.registers[slot] == register {
                    continue;
                }
                self.registers[slot] = register;
                self.known.set(slot);
                let Outline { starts, points, .. } = &*self.outline;
                for &point in &points[starts[slot] as usize..starts[slot + 1] as usize] {
                    changed.push(point as usize);
                }
            }
        }
        // Few points stand over one register, so what repeats is close together once sorted.
        changed[already..].sort_unstable();
        let mut kept = already;
        for read in already..changed.len() {
            let point = changed[read];
            let is_new = kept == already || changed[kept - 1] != point;
            if is_new && self.is_known(point) {
                changed[kept] = point;
                kept += 1;
            }
        }
        changed.truncate(kept);
    }

    /// The registers of the point of that index in the profile; none until all of them have been read.
    pub fn registers(&self, point: usize) -> Option<&[u16]> {
        if !self.is_known(point) {
            return None;
        }
        let &(start, len) = self.outline.places.get(point)?;
        self.registers.get(start as usize..(start + len) as usize)
    }

    /// The registers of a point to write into; they are known from then on. None for a point that cannot be read.
    pub fn registers_mut(&mut self, point: usize) -> Option<&mut [u16]> {
        let &(start, len) = self.outline.places.get(point)?;
        if len == 0 {
            return None;
        }
        let range = start as usize..(start + len) as usize;
        range.clone().for_each(|slot| self.known.set(slot));
        self.registers.get_mut(range)
    }

    /// The registers of a window; none if it leaves the readable ranges or holds a register that is not known.
    pub fn window(&self, address: u16, count: u16) -> Option<&[u16]> {
        let start = self.outline.position(address, usize::from(count))?;
        let range = start..start + usize::from(count);
        if !self.known.all(range.clone()) {
            return None;
        }
        self.registers.get(range)
    }

    /// Forgets everything, as after a change of the device.
    pub fn clear(&mut self) {
        self.known = Known::new(self.registers.len(), false);
    }

    fn is_known(&self, point: usize) -> bool {
        self.outline
            .places
            .get(point)
            .is_some_and(|&(start, len)| len > 0 && self.known.all(start as usize..(start + len) as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Profile {
        let text = include_str!("../tests/sound.toml");
        Profile::parse("sound.toml", text).unwrap_or_else(|findings| panic!("{findings}"))
    }

    fn store(image: &mut Image, profile: &Profile, address: u16, registers: &[u16]) -> Vec<String> {
        let mut changed = Vec::new();
        image.store(address, registers, &mut changed);
        changed.into_iter().map(|index| profile.points[index].id.clone()).collect()
    }

    #[test]
    fn tells_which_points_changed() {
        let profile = sample();
        let mut image = Image::new(&profile);
        assert_eq!(store(&mut image, &profile, 0, &[2302, 7]), ["voltage"], "power is known by half");
        assert_eq!(store(&mut image, &profile, 0, &[2302, 7, 0, 45]), ["power", "oil_pressure"]);
        assert_eq!(store(&mut image, &profile, 0, &[2302, 8, 0, 45]), ["power"]);
        assert_eq!(store(&mut image, &profile, 0, &[2302, 8, 0, 45]), [""; 0]);
        assert_eq!(store(&mut image, &profile, 5, &[0x0102]), ["brand", "model"]);
    }

    #[test]
    fn keeps_what_was_read() {
        let profile = sample();
        let mut image = Image::new(&profile);
        let power = profile.point_index("power").unwrap();
        assert_eq!(image.registers(power), None);
        assert_eq!(image.window(0, 2), None);
        store(&mut image, &profile, 1, &[7, 1]);
        assert_eq!(image.registers(power), Some(&[7, 1][..]));
        assert_eq!(image.window(1, 2), Some(&[7, 1][..]));
        image.registers_mut(power).unwrap()[0] = 9;
        assert_eq!(image.window(1, 1), Some(&[9][..]));
        image.clear();
        assert_eq!(image.registers(power), None);
    }

    #[test]
    fn never_leaves_the_map() {
        let profile = sample();
        let mut image = Image::zeroed(&profile);
        assert_eq!(image.window(198, 3), Some(&[0; 3][..]));
        assert_eq!(image.window(198, 4), None);
        assert_eq!(image.window(250, 1), None);
        assert_eq!(image.window(0, 0), None);
        assert_eq!(image.window(65535, 2), None);
        // 300 to 511 and 512 to 1100 are one range.
        assert_eq!(image.window(500, 20).map(<[u16]>::len), Some(20));
        let changed = store(&mut image, &profile, 199, &[1; 500]);
        assert_eq!(changed, ["scope", "lcd"]);
        assert_eq!(store(&mut image, &profile, 65535, &[1, 2]), [""; 0]);
        let keys = profile.point_index("keys").unwrap();
        assert!(image.registers(keys).is_none() && image.registers_mut(keys).is_none());
        assert!(image.registers(usize::MAX).is_none());
    }
}
