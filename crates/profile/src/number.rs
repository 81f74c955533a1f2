//! Exact decimal numbers and exact scales: what the manual prints is what comes out.

use std::cmp::Ordering;
use std::fmt;
use std::hash::{Hash, Hasher};
use std::str::FromStr;

use serde::{Serialize, Serializer};

/// 10^0 to 10^18, all that an `i64` holds.
const POWERS: [i64; 19] = {
    let mut powers = [1; 19];
    let mut i = 1;
    while i < 19 {
        powers[i] = powers[i - 1] * 10;
        i += 1;
    }
    powers
};

/// An exact decimal number: mantissa / 10^decimals.
///
/// Two numbers are equal when their values are, however many zeros they carry.
#[derive(Clone, Copy, Debug)]
pub struct Number {
    mantissa: i64,
    decimals: u8,
}

impl Number {
    /// The most decimals a number can have.
    pub const MAX_DECIMALS: u8 = 18;

    /// Zero.
    pub const ZERO: Self = Self::integer(0);

    /// `mantissa / 10^decimals`; none above [`Self::MAX_DECIMALS`].
    pub const fn new(mantissa: i64, decimals: u8) -> Option<Self> {
        if decimals > Self::MAX_DECIMALS {
            return None;
        }
        Some(Self { mantissa, decimals })
    }

    /// A whole number.
    pub const fn integer(value: i64) -> Self {
        Self { mantissa: value, decimals: 0 }
    }

    /// The nearest number with that many decimals; none for what is not finite or does not fit.
    pub fn from_f64(value: f64, decimals: u8) -> Option<Self> {
        let power = POWERS.get(usize::from(decimals))?;
        let scaled = (value * *power as f64).round_ties_even();
        // 2^63 itself does not fit, and NaN fails both comparisons.
        if !(scaled >= i64::MIN as f64 && scaled < -(i64::MIN as f64)) {
            return None;
        }
        Some(Self { mantissa: scaled as i64, decimals })
    }

    /// `decimals` must not be above [`Self::MAX_DECIMALS`]; the codec has checked its own when it was built.
    #[inline]
    pub(crate) const fn from_parts(mantissa: i64, decimals: u8) -> Self {
        Self { mantissa, decimals }
    }

    /// The digits without the point.
    pub const fn mantissa(self) -> i64 {
        self.mantissa
    }

    /// How many of the digits stand behind the point; may include zeros at the end.
    pub const fn decimals(self) -> u8 {
        self.decimals
    }

    /// The nearest binary number.
    pub fn as_f64(self) -> f64 {
        self.mantissa as f64 / self.power() as f64
    }

    /// The whole number, when it is one.
    pub const fn as_integer(self) -> Option<i64> {
        let shortest = self.shortest();
        match shortest.decimals {
            0 => Some(shortest.mantissa),
            _ => None,
        }
    }

    /// The same value without zeros at the end.
    pub const fn shortest(self) -> Self {
        let mut mantissa = self.mantissa;
        let mut decimals = self.decimals;
        while decimals > 0 && mantissa % 10 == 0 {
            mantissa /= 10;
            decimals -= 1;
        }
        Self { mantissa, decimals }
    }

    const fn power(self) -> i64 {
        POWERS[self.decimals as usize]
    }
}

impl From<i64> for Number {
    fn from(value: i64) -> Self {
        Self::integer(value)
    }
}

impl PartialEq for Number {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Number {}

impl PartialOrd for Number {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Number {
    fn cmp(&self, other: &Self) -> Ordering {
        if self.decimals == other.decimals {
            return self.mantissa.cmp(&other.mantissa);
        }
        // 63 bits times 10^18 stays below 127 bits.
        let left = i128::from(self.mantissa) * i128::from(other.power());
        let right = i128::from(other.mantissa) * i128::from(self.power());
        left.cmp(&right)
    }
}

impl Hash for Number {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let shortest = self.shortest();
        shortest.mantissa.hash(state);
        shortest.decimals.hash(state);
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shortest = self.shortest();
        let digits = shortest.mantissa.unsigned_abs();
        let power = shortest.power().unsigned_abs();
        let sign = if shortest.mantissa < 0 { "-" } else { "" };
        let whole = digits / power;
        match shortest.decimals {
            0 => write!(f, "{sign}{whole}"),
            decimals => write!(
                f,
                "{sign}{whole}.{fraction:0width$}",
                fraction = digits % power,
                width = usize::from(decimals)
            ),
        }
    }
}

impl Serialize for Number {
    /// An integer where it is one, else the shortest decimal fraction.
    ///
    /// Exact for mantissas below 2^53, which the loader guarantees for every point.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.as_integer() {
            Some(integer) => serializer.serialize_i64(integer),
            None => serializer.serialize_f64(self.as_f64()),
        }
    }
}

/// A text that is no decimal number, or has more digits than fit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` is not a decimal number such as -12.5, or has too many digits")]
pub struct ParseNumberError {
    /// The text.
    pub text: String,
}

impl FromStr for Number {
    type Err = ParseNumberError;

    fn from_str(text: &str) -> Result<Self, ParseNumberError> {
        parse_decimal(text).ok_or_else(|| ParseNumberError { text: text.to_owned() })
    }
}

fn parse_decimal(text: &str) -> Option<Number> {
    let (sign, digits) = match text.as_bytes().first()? {
        b'-' => (-1, &text[1..]),
        b'+' => (1, &text[1..]),
        _ => (1, text),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, "0"));
    let is_digits = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    if !is_digits(whole) || !is_digits(fraction) {
        return None;
    }
    let fraction = fraction.trim_end_matches('0');
    let mut mantissa: i64 = 0;
    for digit in whole.bytes().chain(fraction.bytes()) {
        mantissa = mantissa.checked_mul(10)?.checked_add(sign * i64::from(digit - b'0'))?;
    }
    Number::new(mantissa, u8::try_from(fraction.len()).ok()?)
}

/// How a raw number becomes a value: `raw x num / den + offset`, in lowest terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Scale {
    num: i64,
    den: i64,
    offset: Number,
}

impl Scale {
    /// Value is the raw number itself.
    pub const ONE: Self = Self { num: 1, den: 1, offset: Number::ZERO };

    /// Lowest terms of `num / den`; none unless both are positive.
    pub const fn new(num: i64, den: i64, offset: Number) -> Option<Self> {
        if num <= 0 || den <= 0 {
            return None;
        }
        let divisor = gcd(num, den);
        Some(Self { num: num / divisor, den: den / divisor, offset })
    }

    /// The register holds the value times `coeff`.
    pub fn from_coeff(coeff: Number, offset: Number) -> Option<Self> {
        let coeff = coeff.shortest();
        Self::new(coeff.power(), coeff.mantissa, offset)
    }

    /// The value is the register times `ratio`.
    pub fn from_ratio(ratio: Number, offset: Number) -> Option<Self> {
        let ratio = ratio.shortest();
        Self::new(ratio.mantissa, ratio.power(), offset)
    }

    /// Numerator, positive.
    pub const fn num(self) -> i64 {
        self.num
    }

    /// Denominator, positive.
    pub const fn den(self) -> i64 {
        self.den
    }

    /// What is added last.
    pub const fn offset(self) -> Number {
        self.offset
    }

    /// The scale as one multiplication: none where the fraction has no end or a mantissa would pass 2^53 for raw
    /// numbers up to `largest_raw`.
    pub(crate) fn linear(self, largest_raw: u32) -> Option<Linear> {
        let mut decimals = self.offset.shortest().decimals;
        let multiplier = loop {
            let scaled = i128::from(self.num) * i128::from(*POWERS.get(usize::from(decimals))?);
            if scaled % i128::from(self.den) == 0 {
                break i64::try_from(scaled / i128::from(self.den)).ok()?;
            }
            decimals += 1;
        };
        let offset = self.offset.shortest();
        let addend = offset.mantissa.checked_mul(POWERS[usize::from(decimals - offset.decimals)])?;
        let largest = i64::from(largest_raw).checked_mul(multiplier)?.checked_add(addend.checked_abs()?)?;
        if largest >= 1 << 53 {
            return None;
        }
        Some(Linear { multiplier, addend, decimals })
    }

    /// The scale applied to a number, exact; none where it does not fit or has no end.
    pub fn apply(self, number: Number) -> Option<Number> {
        let mut decimals = u32::from(number.decimals);
        let mut scaled = i128::from(number.mantissa) * i128::from(self.num);
        while scaled % i128::from(self.den) != 0 {
            scaled = scaled.checked_mul(10)?;
            decimals += 1;
        }
        let product = scaled / i128::from(self.den);
        let offset = self.offset.shortest();
        let common = decimals.max(u32::from(offset.decimals));
        let sum = product.checked_mul(10_i128.checked_pow(common - decimals)?)?.checked_add(
            i128::from(offset.mantissa)
                .checked_mul(10_i128.checked_pow(common - u32::from(offset.decimals))?)?,
        )?;
        Number::new(i64::try_from(sum).ok()?, u8::try_from(common).ok()?)
    }
}

/// A scale made ready for the hot path: `mantissa = raw x multiplier + addend`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Linear {
    pub(crate) multiplier: i64,
    pub(crate) addend: i64,
    pub(crate) decimals: u8,
}

impl Linear {
    /// The raw number itself.
    pub(crate) const ONE: Self = Self { multiplier: 1, addend: 0, decimals: 0 };

    #[inline]
    pub(crate) const fn apply(self, raw: i64) -> Number {
        Number::from_parts(raw * self.multiplier + self.addend, self.decimals)
    }

    /// The nearest raw number, halves to the even one; none where it is far beyond any register.
    pub(crate) fn invert(self, value: Number) -> Option<i64> {
        if let Some(finer) = self.decimals.checked_sub(value.decimals) {
            let scaled = value.mantissa.checked_mul(POWERS[usize::from(finer)])?.checked_sub(self.addend)?;
            if self.multiplier == 1 {
                return Some(scaled);
            }
        }
        // (value - addend / 10^d) x 10^d / multiplier, over one denominator.
        let power = i128::from(POWERS[usize::from(self.decimals)]);
        let own = i128::from(value.power());
        let scaled = i128::from(value.mantissa) * power - i128::from(self.addend) * own;
        i64::try_from(divide_half_even(scaled, i128::from(self.multiplier) * own)).ok()
    }
}

/// `numerator / denominator` to the nearest integer, halves to the even one; the denominator is positive.
pub(crate) const fn divide_half_even(numerator: i128, denominator: i128) -> i128 {
    let floor = numerator.div_euclid(denominator);
    let twice_rest = numerator.rem_euclid(denominator) * 2;
    if twice_rest > denominator || (twice_rest == denominator && floor % 2 != 0) { floor + 1 } else { floor }
}

const fn gcd(a: i64, b: i64) -> i64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(text: &str) -> Number {
        text.parse().unwrap()
    }

    #[test]
    fn prints_without_trailing_zeros() {
        for (mantissa, decimals, text, json) in [
            (2302, 1, "230.2", "230.2"),
            (2300, 1, "230", "230"),
            (-5, 2, "-0.05", "-0.05"),
            (0, 4, "0", "0"),
            (501961, 4, "50.1961", "50.1961"),
            (i64::MIN, 18, "-9.223372036854775808", "-9.223372036854776"),
        ] {
            let number = Number::new(mantissa, decimals).unwrap();
            assert_eq!(number.to_string(), text);
            assert_eq!(serde_json::to_string(&number).unwrap(), json);
        }
        assert_eq!(Number::new(1, 19), None);
    }

    #[test]
    fn parses_decimals_exactly() {
        assert_eq!(number("0.1"), Number::from_parts(1, 1));
        assert_eq!(number("-40.50"), Number::from_parts(-405, 1));
        for text in ["", "-", ".5", "5.", "1e3", "0x10", "1_000", "99999999999999999999", "é"] {
            assert!(text.parse::<Number>().is_err(), "{text}");
        }
    }

    #[test]
    fn compares_by_value() {
        assert_eq!(Number::from_parts(50, 1), Number::integer(5));
        assert!(number("4.999") < Number::integer(5));
        assert!(number("-1") < number("0.5"));
    }

    #[test]
    fn rounds_floats_to_even() {
        assert_eq!(Number::from_f64(230.25, 1), Some(number("230.2")));
        assert_eq!(Number::from_f64(f64::NAN, 1), None);
        assert_eq!(Number::from_f64(1e300, 0), None);
        assert_eq!(Number::from_f64(9_223_372_036_854_775_808.0, 0), None);
    }

    #[test]
    fn scales_are_in_lowest_terms() {
        let scale = |num, den| {
            let scale = Scale::new(num, den, Number::ZERO).unwrap();
            (scale.num(), scale.den())
        };
        assert_eq!(scale(100, 255), (20, 51));
        let coeff = |text| {
            let scale = Scale::from_coeff(number(text), Number::ZERO).unwrap();
            (scale.num(), scale.den())
        };
        assert_eq!(coeff("10"), (1, 10));
        assert_eq!(coeff("0.02"), (50, 1));
        assert_eq!(coeff("0.5"), (2, 1));
        assert_eq!(Scale::from_coeff(number("0"), Number::ZERO), None);
        assert_eq!(Scale::from_ratio(number("-1"), Number::ZERO), None);
        let ratio = Scale::from_ratio(number("0.1"), Number::ZERO).unwrap();
        assert_eq!((ratio.num(), ratio.den()), (1, 10));
    }

    #[test]
    fn linear_form_is_exact() {
        let linear = |num, den, offset: &str| Scale::new(num, den, number(offset)).unwrap().linear(u32::MAX);
        assert_eq!(linear(1, 10, "0").unwrap().apply(276), number("27.6"));
        assert_eq!(linear(1, 8, "0").unwrap().apply(1), number("0.125"));
        assert_eq!(linear(1, 1, "-40").unwrap().apply(0), number("-40"));
        assert_eq!(linear(1, 8, "-0.5").unwrap().apply(3), number("-0.125"));
        assert_eq!(linear(1, 3, "0"), None);
        assert_eq!(linear(i64::MAX, 1, "0"), None);
    }

    #[test]
    fn inverts_to_the_nearest_even_raw() {
        let linear = Scale::new(1, 10, Number::integer(-40)).unwrap().linear(65535).unwrap();
        assert_eq!(linear.invert(number("-40")), Some(0));
        assert_eq!(linear.invert(number("-39.9")), Some(1));
        assert_eq!(linear.invert(number("-39.95")), Some(0));
        assert_eq!(linear.invert(number("-39.85")), Some(2));
        assert_eq!(linear.invert(number("-40.06")), Some(-1));
        assert_eq!(linear.invert(Number::integer(i64::MAX)), None);
        let eighths = Scale::new(1, 8, Number::ZERO).unwrap().linear(65535).unwrap();
        assert_eq!(eighths.invert(number("0.5")), Some(4));
        assert_eq!(eighths.invert(number("0.1875")), Some(2));
    }

    #[test]
    fn applies_scales_to_numbers() {
        let to_kpa = Scale::new(100, 1, Number::ZERO).unwrap();
        assert_eq!(to_kpa.apply(number("4.25")), Some(Number::integer(425)));
        let third = Scale::new(1, 3, Number::ZERO).unwrap();
        assert_eq!(third.apply(number("1")), None);
        assert_eq!(third.apply(number("0.3")), Some(number("0.1")));
    }
}
