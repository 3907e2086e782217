//! Numbers that may be undefined, as data.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// What is not finite is stored as nothing and read as NaN, because JSON knows neither NaN nor infinities.
pub(crate) fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    value.is_finite().then_some(*value).serialize(serializer)
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}
