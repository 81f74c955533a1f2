//! The picture in a display buffer of the D-series: 128 x 64 pixels in 512 registers.
//!
//! The manual gives no pixel order. Eight pages of 64 registers, two columns a register with the low byte the left one,
//! and the lowest page at the bottom, is what a driver found on a D-502; if that is wrong elsewhere, it is turned here.

/// Columns of the display.
pub const WIDTH: usize = 128;
/// Rows of the display.
pub const HEIGHT: usize = 64;

/// Whether the pixel `x` from the left, `y` from the top is dark; false outside the display or the registers.
pub fn pixel(registers: &[u16], x: usize, y: usize) -> bool {
    place(x, y)
        .is_some_and(|(register, bit)| registers.get(register).is_some_and(|word| word >> bit & 1 == 1))
}

/// Makes a pixel dark or light; nothing outside the display or the registers.
pub fn set_pixel(registers: &mut [u16], x: usize, y: usize, dark: bool) {
    let Some((register, bit)) = place(x, y) else {
        return;
    };
    if let Some(word) = registers.get_mut(register) {
        *word = *word & !(1 << bit) | u16::from(dark) << bit;
    }
}

/// The register and bit of a pixel.
const fn place(x: usize, y: usize) -> Option<(usize, usize)> {
    if x >= WIDTH || y >= HEIGHT {
        return None;
    }
    let from_bottom = HEIGHT - 1 - y;
    let (page, bit) = (from_bottom / 8, from_bottom % 8);
    Some((page * (WIDTH / 2) + x / 2, bit + 8 * (x % 2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_stand_where_the_driver_found_them() {
        for (x, y, register, word) in [
            (0, 63, 0, 0x0001),
            (1, 63, 0, 0x0100),
            (127, 63, 63, 0x0100),
            (0, 56, 0, 0x0080),
            (0, 55, 64, 0x0001),
            (0, 0, 448, 0x0080),
            (127, 0, 511, 0x8000),
        ] {
            let mut registers = [0; 512];
            set_pixel(&mut registers, x, y, true);
            assert_eq!(registers[register], word, "{x} {y}");
            assert!(pixel(&registers, x, y));
            set_pixel(&mut registers, x, y, false);
            assert_eq!(registers, [0; 512]);
        }
    }

    #[test]
    fn every_pixel_has_a_bit_of_its_own() {
        let mut registers = [0; 512];
        for (x, y) in (0..WIDTH).flat_map(|x| (0..HEIGHT).map(move |y| (x, y))) {
            set_pixel(&mut registers, x, y, true);
        }
        assert_eq!(registers, [0xFFFF; 512]);
        set_pixel(&mut registers, WIDTH, 0, false);
        assert!(!pixel(&registers, 0, HEIGHT) && !pixel(&[], 0, 0));
    }
}
