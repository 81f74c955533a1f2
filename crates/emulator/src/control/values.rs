//! What a client would read of a controller: signals of the vocabulary, points, and single bits of points.

use std::sync::Arc;

use axum::Json as Answer;
use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::extract::{Path, Query, State};
use axum::http::StatusCode;
use serde::{Deserialize, Serialize};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{ObjectBuilder, OneOfBuilder, Schema, Type};
use utoipa::{IntoParams, PartialSchema, ToSchema};

use super::problem::Problem;
use super::site::{Site, named};
use crate::device::Device;
use crate::facts::{Fact, FactKind, Subject};

/// Which values are wanted.
#[derive(Clone, Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct ValuesQuery {
    /// Only these, with commas between them: signals of the vocabulary, ids of points, and `point.bit` for single
    /// bits. Every signal that the controller has where none is named.
    #[param(example = "state.engine,fuel_level,warning_alarms.low_fuel_level")]
    name: Option<String>,
}

/// One value as a client reads it now.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(super) struct ValueView {
    /// As it was asked for.
    #[schema(examples("state.engine"))]
    name: String,
    /// A number, a word, or true and false; null where nobody can tell.
    #[schema(required)]
    value: Shown,
    /// Unit of a number; null where it has none.
    #[schema(required, examples("kW"))]
    unit: Option<&'static str>,
}

/// A fact, as JSON has it.
#[derive(Clone, Debug, Serialize)]
#[serde(transparent)]
struct Shown(Fact);

/// What a client would read now.
///
/// Numbers are in the unit of the signal or point, states in the words of the vocabulary or the ids of the point.
#[utoipa::path(
    get, path = "/api/v1/controllers/{controller}/values", tag = "controllers",
    params(("controller" = String, Path, description = "Its id", example = "genset-1"), ValuesQuery),
    responses((status = OK, body = Vec<ValueView>, description = "Its values, in the order in which they are named")),
)]
pub(super) async fn values(
    State(site): State<Arc<Site>>,
    id: Result<Path<String>, PathRejection>,
    query: Result<Query<ValuesQuery>, QueryRejection>,
) -> Result<Answer<Vec<ValueView>>, Problem> {
    let controller = &site.one(&named(id)?)?.controller;
    let Query(ValuesQuery { name }) = query.map_err(|rejection| {
        let why = rejection.body_text();
        let why = why.strip_prefix("Failed to deserialize query string: ").unwrap_or(&why);
        let detail = format!("the query is not understood: {why}; name is all it may hold");
        Problem::new(StatusCode::BAD_REQUEST, detail)
    })?;
    let profile = controller.with(|device| device.profile());
    let subjects = match name {
        None => Subject::signals(profile).collect(),
        Some(names) => names
            .split(',')
            .map(|name| Subject::find(profile, name.trim()))
            .collect::<Result<Vec<_>, _>>()
            .map_err(|error| Problem::new(StatusCode::BAD_REQUEST, error.to_string()))?,
    };
    // One image of all of them.
    Ok(Answer(
        controller.with(|device| subjects.iter().map(|subject| ValueView::of(subject, device)).collect()),
    ))
}

impl ValueView {
    fn of(subject: &Subject, device: &Device) -> Self {
        let unit = match subject.kind() {
            FactKind::Number { unit } => *unit,
            FactKind::Words(_) | FactKind::Flag => None,
        };
        Self { name: subject.name().to_owned(), value: Shown(subject.fact(device)), unit }
    }
}

impl PartialSchema for Shown {
    fn schema() -> RefOr<Schema> {
        let one = |kind| Schema::Object(ObjectBuilder::new().schema_type(kind).build());
        let kinds = [Type::Number, Type::String, Type::Boolean, Type::Null];
        kinds.into_iter().fold(OneOfBuilder::new(), |either, kind| either.item(one(kind))).into()
    }
}

impl ToSchema for Shown {}
