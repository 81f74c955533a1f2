//! A 128 x 64 picture and a 5 x 7 font of our own, for panels that show their display over the wire.

pub(crate) const WIDTH: usize = 128;
pub(crate) const HEIGHT: usize = 64;
/// Columns of text, one pixel between letters.
pub(crate) const COLUMNS: usize = WIDTH / 6;

/// Pixels by row and column; (0, 0) is the top left corner.
#[derive(Clone, Debug)]
pub(crate) struct Canvas {
    /// One bit a pixel, the leftmost column lowest.
    rows: [u128; HEIGHT],
}

impl Canvas {
    pub(crate) fn new() -> Self {
        Self { rows: [0; HEIGHT] }
    }

    #[cfg(test)]
    pub(crate) fn is_set(&self, x: usize, y: usize) -> bool {
        x < WIDTH && self.rows.get(y).is_some_and(|row| row >> x & 1 == 1)
    }

    /// Writes one line of text, `line` 0 to 7; what does not fit is cut.
    pub(crate) fn text(&mut self, line: usize, column: usize, text: &str) {
        let letters = text.chars().take(COLUMNS.saturating_sub(column));
        for (position, letter) in (column..).zip(letters) {
            for (y, bits) in glyph(letter).into_iter().enumerate() {
                let Some(row) = self.rows.get_mut(line * 8 + y) else { return };
                // The font is written as it looks: its leftmost pixel is the highest of five bits.
                *row |= u128::from(bits.reverse_bits() >> 3) << (position * 6);
            }
        }
    }

    /// Writes text that ends at the right edge.
    pub(crate) fn text_right(&mut self, line: usize, text: &str) {
        let length = text.chars().count().min(COLUMNS);
        self.text(line, COLUMNS - length, text);
    }

    /// Lights a pixel; what lies outside is cut.
    pub(crate) fn dot(&mut self, x: usize, y: usize) {
        if let Some(row) = self.rows.get_mut(y).filter(|_| x < WIDTH) {
            *row |= 1 << x;
        }
    }

    /// Fills a rectangle.
    pub(crate) fn fill(&mut self, x: usize, y: usize, width: usize, height: usize) {
        for y in y..y + height {
            for x in x..x + width {
                self.dot(x, y);
            }
        }
    }

    /// Draws the edge of a rectangle.
    pub(crate) fn frame(&mut self, x: usize, y: usize, width: usize, height: usize) {
        self.fill(x, y, width, 1);
        self.fill(x, y + height.saturating_sub(1), width, 1);
        self.fill(x, y, 1, height);
        self.fill(x + width.saturating_sub(1), y, 1, height);
    }

    /// Turns light and dark round in one line of text.
    pub(crate) fn invert(&mut self, line: usize) {
        for row in self.rows.iter_mut().skip(line * 8).take(8) {
            *row = !*row;
        }
    }

    /// The picture in the order of the D-series display buffer, the high byte of each register first.
    ///
    /// 8 pages of 64 registers; a register holds two columns of 8 pixels, its low byte the left one; the lowest bit
    /// of page 0 is the bottom row. The manual gives no order: this one was seen on a D-502.
    pub(crate) fn datakom_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(WIDTH * HEIGHT / 8);
        for page in 0..HEIGHT / 8 {
            let rows: [u128; 8] = std::array::from_fn(|bit| self.rows[HEIGHT - 1 - 8 * page - bit]);
            for x in (0..WIDTH).step_by(8) {
                let columns = transposed(rows.map(|row| (row >> x) as u8));
                for pair in columns.chunks_exact(2) {
                    bytes.extend_from_slice(&[pair[1], pair[0]]);
                }
            }
        }
        bytes
    }
}

/// Rows of eight pixels as columns: bit `c` of byte `r` becomes bit `r` of byte `c`.
///
/// The picture is taken for every image of the registers; pixel by pixel it would cost more than all the rest.
fn transposed(rows: [u8; 8]) -> [u8; 8] {
    let mut block = u64::from_le_bytes(rows);
    // Bits change places across the diagonal, then pairs of them, then fours.
    for (distance, mask) in [(7, 0x00AA_00AA_00AA_00AA), (14, 0x0000_CCCC_0000_CCCC), (28, 0xF0F0_F0F0)] {
        let differing = (block ^ (block >> distance)) & mask;
        block ^= differing ^ (differing << distance);
    }
    block.to_le_bytes()
}

/// Rows of a letter from the top, five pixels each; a letter the font does not have is a box.
fn glyph(letter: char) -> [u8; 7] {
    match letter.to_ascii_uppercase() {
        ' ' => [0; 7],
        'A' => [0b01110, 0b10001, 0b10001, 0b11111, 0b10001, 0b10001, 0b10001],
        'B' => [0b11110, 0b10001, 0b10001, 0b11110, 0b10001, 0b10001, 0b11110],
        'C' => [0b01110, 0b10001, 0b10000, 0b10000, 0b10000, 0b10001, 0b01110],
        'D' => [0b11110, 0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b11110],
        'E' => [0b11111, 0b10000, 0b10000, 0b11110, 0b10000, 0b10000, 0b11111],
        'F' => [0b11111, 0b10000, 0b10000, 0b11110, 0b10000, 0b10000, 0b10000],
        'G' => [0b01110, 0b10001, 0b10000, 0b10011, 0b10001, 0b10001, 0b01110],
        'H' => [0b10001, 0b10001, 0b10001, 0b11111, 0b10001, 0b10001, 0b10001],
        'I' => [0b01110, 0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110],
        'J' => [0b00111, 0b00010, 0b00010, 0b00010, 0b00010, 0b10010, 0b01100],
        'K' => [0b10001, 0b10010, 0b10100, 0b11000, 0b10100, 0b10010, 0b10001],
        'L' => [0b10000, 0b10000, 0b10000, 0b10000, 0b10000, 0b10000, 0b11111],
        'M' => [0b10001, 0b11011, 0b10101, 0b10101, 0b10001, 0b10001, 0b10001],
        'N' => [0b10001, 0b11001, 0b11001, 0b10101, 0b10011, 0b10011, 0b10001],
        'O' => [0b01110, 0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b01110],
        'P' => [0b11110, 0b10001, 0b10001, 0b11110, 0b10000, 0b10000, 0b10000],
        'Q' => [0b01110, 0b10001, 0b10001, 0b10001, 0b10101, 0b10010, 0b01101],
        'R' => [0b11110, 0b10001, 0b10001, 0b11110, 0b10100, 0b10010, 0b10001],
        'S' => [0b01111, 0b10000, 0b10000, 0b01110, 0b00001, 0b00001, 0b11110],
        'T' => [0b11111, 0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0b00100],
        'U' => [0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b01110],
        'V' => [0b10001, 0b10001, 0b10001, 0b10001, 0b01010, 0b01010, 0b00100],
        'W' => [0b10001, 0b10001, 0b10001, 0b10101, 0b10101, 0b11011, 0b10001],
        'X' => [0b10001, 0b10001, 0b01010, 0b00100, 0b01010, 0b10001, 0b10001],
        'Y' => [0b10001, 0b10001, 0b01010, 0b00100, 0b00100, 0b00100, 0b00100],
        'Z' => [0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b10000, 0b11111],
        '0' => [0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110],
        '1' => [0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110],
        '2' => [0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111],
        '3' => [0b11110, 0b00001, 0b00001, 0b01110, 0b00001, 0b00001, 0b11110],
        '4' => [0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010],
        '5' => [0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110],
        '6' => [0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110],
        '7' => [0b11111, 0b00001, 0b00010, 0b00100, 0b00100, 0b01000, 0b01000],
        '8' => [0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110],
        '9' => [0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100],
        '.' => [0, 0, 0, 0, 0, 0b00110, 0b00110],
        ',' => [0, 0, 0, 0, 0b00110, 0b00110, 0b00100],
        ':' => [0, 0b00110, 0b00110, 0, 0b00110, 0b00110, 0],
        '-' => [0, 0, 0, 0b11111, 0, 0, 0],
        '/' => [0b00001, 0b00001, 0b00010, 0b00100, 0b01000, 0b10000, 0b10000],
        '%' => [0b11001, 0b11001, 0b00010, 0b00100, 0b01000, 0b10011, 0b10011],
        '+' => [0, 0b00100, 0b00100, 0b11111, 0b00100, 0b00100, 0],
        '=' => [0, 0, 0b11111, 0, 0b11111, 0, 0],
        '>' => [0b01000, 0b00100, 0b00010, 0b00001, 0b00010, 0b00100, 0b01000],
        '!' => [0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0, 0b00100],
        '(' => [0b00010, 0b00100, 0b01000, 0b01000, 0b01000, 0b00100, 0b00010],
        ')' => [0b01000, 0b00100, 0b00010, 0b00010, 0b00010, 0b00100, 0b01000],
        _ => [0b11111, 0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b11111],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(canvas: &Canvas, columns: usize, rows: usize) -> Vec<String> {
        (0..rows)
            .map(|y| (0..columns).map(|x| if canvas.is_set(x, y) { '#' } else { '.' }).collect())
            .collect()
    }

    #[test]
    fn letters_stand_upright_from_the_left() {
        let mut canvas = Canvas::new();
        canvas.text(0, 0, "F1");
        assert_eq!(
            drawn(&canvas, 12, 8),
            [
                "#####...#...",
                "#......##...",
                "#.......#...",
                "####....#...",
                "#.......#...",
                "#.......#...",
                "#......###..",
                "............",
            ]
        );
    }

    #[test]
    fn a_frame_is_hollow_and_nothing_is_drawn_outside() {
        let mut canvas = Canvas::new();
        canvas.frame(1, 1, 4, 3);
        canvas.fill(127, 63, 5, 5);
        canvas.dot(128, 0);
        canvas.dot(0, 64);
        assert_eq!(drawn(&canvas, 6, 5), ["......", ".####.", ".#..#.", ".####.", "......"]);
        assert!(canvas.is_set(127, 63) && !canvas.is_set(126, 63));
    }

    #[test]
    fn text_beyond_the_edges_is_cut() {
        let mut canvas = Canvas::new();
        canvas.text(0, 20, "AB");
        canvas.text(9, 0, "A");
        canvas.text(0, 40, "A");
        canvas.text_right(7, "a text that is much longer than a line");
        assert!((126..128).all(|x| !canvas.is_set(x, 0)));
        assert!(canvas.is_set(1, 56), "the line starts at the left edge");
    }

    #[test]
    fn eight_rows_become_eight_columns() {
        let rows = [0b1000_0001, 2, 0, 0b0101_0101, 0, 0, 0xFF, 0x80];
        let columns = transposed(rows);
        for (r, row) in rows.into_iter().enumerate() {
            for (c, column) in columns.into_iter().enumerate() {
                assert_eq!(row >> c & 1, column >> r & 1, "{r} {c}");
            }
        }
        assert_eq!(transposed(columns), rows);
    }

    #[test]
    fn the_buffer_starts_at_the_bottom_left_with_the_left_column_in_the_low_byte() {
        let mut canvas = Canvas::new();
        canvas.rows[63] = 0b01; // bottom left
        canvas.rows[62] = 0b10; // one up, one right
        canvas.rows[0] = 1 << 127; // top right
        let bytes = canvas.datakom_bytes();
        assert_eq!(bytes.len(), 1024);
        assert_eq!(bytes[..2], [0b0000_0010, 0b0000_0001]);
        assert_eq!(bytes[1022..], [0b1000_0000, 0]);
        assert_eq!(bytes.iter().map(|byte| byte.count_ones()).sum::<u32>(), 3);
    }
}
