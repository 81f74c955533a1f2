//! The controllers that can be controlled, by id.

use axum::extract::Path;
use axum::extract::rejection::PathRejection;
use axum::http::StatusCode;

use super::problem::Problem;
use crate::device::Device;
use crate::server::Controller;

/// One controller under an id.
#[derive(Clone, Debug)]
pub struct Imitated {
    /// What addresses call it, such as `genset-1`.
    pub id: String,
    /// What people call it.
    pub name: String,
    /// It.
    pub controller: Controller,
}

/// All of them, in the order in which people are shown them.
#[derive(Debug)]
pub(super) struct Site {
    imitated: Vec<Imitated>,
}

impl Site {
    pub(super) fn new(imitated: Vec<Imitated>) -> Self {
        for each in &imitated {
            each.controller.with(Device::remember);
        }
        Self { imitated }
    }

    pub(super) fn all(&self) -> &[Imitated] {
        &self.imitated
    }

    /// The one that a path names.
    pub(super) fn one(&self, id: &str) -> Result<&Imitated, Problem> {
        self.imitated.iter().find(|imitated| imitated.id == id).ok_or_else(|| {
            let known: Vec<_> = self.imitated.iter().map(|imitated| imitated.id.as_str()).collect();
            let detail = format!("there is no controller {id}; there is {}", known.join(", "));
            Problem::new(StatusCode::NOT_FOUND, detail)
        })
    }
}

/// What a path names; one that is no text names nothing.
pub(super) fn named<T>(path: Result<Path<T>, PathRejection>) -> Result<T, Problem> {
    path.map(|Path(named)| named).map_err(|_| {
        let detail =
            "the address is no UTF-8 text, so it names nothing; api/v1/controllers lists what there is";
        Problem::new(StatusCode::BAD_REQUEST, detail)
    })
}
