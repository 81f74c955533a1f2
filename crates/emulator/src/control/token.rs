//! What a client must show where others than this machine can reach the control.

use std::fmt;
use std::sync::Arc;

/// Fewer characters can be guessed.
const SHORTEST: usize = 16;

/// A secret that clients show as `Authorization: Bearer`.
#[derive(Clone)]
pub struct Token(Arc<str>);

/// A text that cannot be a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a token has at least {SHORTEST} characters, all of them visible ASCII without spaces")]
pub struct TokenError;

impl Token {
    /// A token of this text.
    ///
    /// # Errors
    /// It is too short, or no header could carry it.
    pub fn new(text: &str) -> Result<Self, TokenError> {
        let fits = text.len() >= SHORTEST && text.bytes().all(|byte| byte.is_ascii_graphic());
        if fits { Ok(Self(text.into())) } else { Err(TokenError) }
    }

    /// Whether what was shown is the token; how long that takes does not tell how much of it is right.
    pub(super) fn is(&self, shown: &[u8]) -> bool {
        let own = self.0.as_bytes();
        let differing = own.iter().zip(shown).fold(0, |differing, (one, other)| differing | (one ^ other));
        own.len() == shown.len() && differing == 0
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(…)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_long_and_visible() {
        for wrong in ["", "short", "fifteen-letters", "sixteen letters!!", "sixteen-létters-é"] {
            assert_eq!(Token::new(wrong).unwrap_err(), TokenError, "{wrong}");
        }
        let token = Token::new("sixteen-letters!").unwrap();
        assert!(token.is(b"sixteen-letters!"));
        for wrong in [&b""[..], b"sixteen-letters", b"sixteen-letters?", b"sixteen-letters!!"] {
            assert!(!token.is(wrong));
        }
        assert_eq!(format!("{token:?}"), "Token(…)");
    }
}
