//! gzip whose parts are made once and sent to many.
//!
//! A deflate stream is a row of blocks. Each piece in here is blocks that refer to nothing before them and end on a
//! byte, so pieces can follow each other in any stream, in any order. What is a reader's own is the envelope: ten bytes
//! at the start, and length and checksum at the end.

use std::cell::RefCell;

use axum::body::Bytes;
use flate2::{Compress, Compression, Crc, FlushCompress, Status};

/// Deflate, no name, no time, any system.
const HEAD: [u8; 10] = [0x1F, 0x8B, 8, 0, 0, 0, 0, 0, 0, 0xFF];

/// An empty block of fixed codes that is the last one.
const LAST: [u8; 2] = [0x03, 0x00];

/// What a stored block holds at most.
const MOST_STORED: usize = 0xFFFF;

/// Whether an `Accept-Encoding` allows gzip.
pub(super) fn accepts_gzip(header: &str) -> bool {
    let named = |name: &str| {
        header.split(',').find_map(|coding| {
            let mut parts = coding.split(';').map(str::trim);
            parts.next().filter(|coding| coding.eq_ignore_ascii_case(name))?;
            let weight = parts.find_map(|part| part.strip_prefix("q=").or(part.strip_prefix("Q=")));
            Some(weight.is_none_or(|weight| weight.parse::<f32>().is_ok_and(|weight| weight > 0.0)))
        })
    };
    named("gzip").or_else(|| named("x-gzip")).or_else(|| named("*")).unwrap_or(false)
}

/// Compresses bytes by themselves.
pub(super) fn piece(bytes: &[u8]) -> Bytes {
    thread_local! {
        /// Costs some 300 KB, so there is one for each thread and not one for each reader.
        static DEFLATE: RefCell<Compress> = RefCell::new(Compress::new(Compression::default(), false));
    }
    let compressed = DEFLATE.with(|deflate| compress(&mut deflate.borrow_mut(), bytes));
    compressed.unwrap_or_else(|| stored(bytes)).into()
}

fn compress(deflate: &mut Compress, bytes: &[u8]) -> Option<Vec<u8>> {
    deflate.reset();
    let mut out = Vec::with_capacity(bytes.len() / 2 + 64);
    loop {
        let taken = usize::try_from(deflate.total_in()).ok()?;
        match deflate.compress_vec(bytes.get(taken..)?, &mut out, FlushCompress::Full) {
            Ok(Status::Ok | Status::BufError) if out.len() < out.capacity() => return Some(out),
            // More is to come.
            Ok(Status::Ok | Status::BufError) => out.reserve(bytes.len() / 2 + 64),
            Ok(Status::StreamEnd) | Err(_) => return None,
        }
    }
}

/// The same without compression, which cannot fail.
fn stored(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(bytes.len() + 5 * (bytes.len() / MOST_STORED + 1));
    for block in bytes.chunks(MOST_STORED) {
        // Fits by the size of the chunks.
        let length = u16::try_from(block.len()).unwrap_or(u16::MAX);
        out.push(0);
        out.extend(length.to_le_bytes());
        out.extend((!length).to_le_bytes());
        out.extend(block);
    }
    out
}

/// The envelope of one reader's stream.
#[derive(Debug)]
pub(super) struct Envelope(Crc);

impl Envelope {
    /// What the stream begins with.
    pub(super) fn begin(out: &mut Vec<u8>) -> Self {
        out.extend(HEAD);
        Self(Crc::new())
    }

    /// These bytes went out, compressed.
    pub(super) fn sent(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// What the stream ends with.
    pub(super) fn end(&self, out: &mut Vec<u8>) {
        out.extend(LAST);
        out.extend(self.0.sum().to_le_bytes());
        out.extend(self.0.amount().to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use flate2::read::GzDecoder;

    use super::*;

    fn noise(length: usize) -> Vec<u8> {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        (0..length).map(|_| next()).collect()
    }

    fn stream(parts: &[(&[u8], Bytes)]) -> Vec<u8> {
        let mut out = Vec::new();
        let mut envelope = Envelope::begin(&mut out);
        for (plain, packed) in parts {
            out.extend(packed);
            envelope.sent(plain);
        }
        envelope.end(&mut out);
        out
    }

    #[test]
    fn pieces_can_follow_each_other_in_any_order() {
        let (long, mixed) = (vec![b'a'; 100_000], noise(70_000));
        let plain: [&[u8]; 6] = [b"event: values\n\n", &long, &mixed, b"", b"x", b"event: values\n\n"];
        for shift in 0..plain.len() {
            let mut parts: Vec<_> = plain.iter().map(|bytes| (*bytes, piece(bytes))).collect();
            parts.rotate_left(shift);
            let whole: Vec<u8> = parts.iter().flat_map(|(bytes, _)| bytes.to_vec()).collect();
            let mut read = Vec::new();
            GzDecoder::new(&*stream(&parts)).read_to_end(&mut read).unwrap();
            assert!(read == whole, "turned by {shift}");
        }
    }

    #[test]
    fn every_piece_can_be_read_as_it_comes() {
        let mut packed = Vec::new();
        Envelope::begin(&mut packed);
        let text = b"event: device\ndata: {}\n\n";
        packed.extend(piece(text));
        // Nothing comes behind it yet, and still it is all there.
        let mut read = vec![0; text.len()];
        GzDecoder::new(&*packed).read_exact(&mut read).unwrap();
        assert_eq!(read, text);
    }

    #[test]
    fn what_cannot_be_compressed_is_stored() {
        for length in [0, 1, MOST_STORED, MOST_STORED + 1, 200_000] {
            let bytes = noise(length);
            let mut read = Vec::new();
            GzDecoder::new(&*stream(&[(&bytes, stored(&bytes).into())])).read_to_end(&mut read).unwrap();
            assert!(read == bytes, "{length}");
        }
    }

    #[test]
    fn gzip_is_for_those_who_want_it() {
        for header in
            ["gzip", "gzip, deflate, br", "br;q=1.0, GZIP;q=0.5", "*", "identity, x-gzip", "*;q=0, gzip"]
        {
            assert!(accepts_gzip(header), "{header}");
        }
        for header in
            ["", "br", "gzip;q=0", "gzip; q=0.000", "identity", "gzip;q=0, *", "gzipped", "*;q=0", "gzip;q=x"]
        {
            assert!(!accepts_gzip(header), "{header}");
        }
    }
}
