//! A body with something that is kept until its last byte was taken, or until its reader went away.

use std::pin::Pin;
use std::task::{Context, Poll};

use axum::body::{Body, Bytes, HttpBody};
use axum::response::Response;
use hyper::body::{Frame, SizeHint};

/// The answer that keeps `guard` for as long as it is on its way.
pub(crate) fn holding<G: Send + Unpin + 'static>(response: Response, guard: G) -> Response {
    response.map(|body| Body::new(Held { body, _guard: guard }))
}

struct Held<G> {
    body: Body,
    _guard: G,
}

impl<G: Unpin> HttpBody for Held<G> {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.body).poll_frame(cx)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// A body in pieces, so that what has not been taken yet stays where its guard is.
pub(crate) struct Pieces(pub(crate) Bytes);

/// Small enough that a piece waits in no buffer for long, large enough that few are needed.
const PIECE: usize = 16 * 1_024;

impl HttpBody for Pieces {
    type Data = Bytes;
    type Error = std::convert::Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        _: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Self::Error>>> {
        if self.0.is_empty() {
            return Poll::Ready(None);
        }
        let piece = self.0.len().min(PIECE);
        Poll::Ready(Some(Ok(Frame::data(self.0.split_to(piece)))))
    }

    fn is_end_stream(&self) -> bool {
        self.0.is_empty()
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.0.len() as u64)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use http_body_util::BodyExt;

    use super::*;

    #[tokio::test]
    async fn a_body_in_pieces_is_whole_and_lets_go_at_its_end() {
        let bytes: Bytes = (0..200_000).map(|i| i as u8).collect();
        let guard = Arc::new(());
        let response = Response::new(Body::new(Pieces(bytes.clone())));
        let mut held = holding(response, Arc::clone(&guard)).into_body();
        assert_eq!(held.size_hint().exact(), Some(200_000));
        let mut taken = Vec::new();
        let mut pieces = 0;
        while let Some(frame) = held.frame().await {
            taken.extend_from_slice(&frame.unwrap().into_data().unwrap());
            pieces += 1;
        }
        assert!(taken == bytes && pieces == 13);
        assert_eq!(Arc::strong_count(&guard), 2);
        drop(held);
        assert_eq!(Arc::strong_count(&guard), 1);
    }
}
