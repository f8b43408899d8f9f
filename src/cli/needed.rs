//! `--model-error`: where it is told.

use serde_json::Value;

/// `result` with what was left off in it, where that was asked for.
pub fn with_model_error(mut result: Value, model_error: Option<&(Value, String)>) -> Value {
    if let Some((told, _)) = model_error {
        result["model_error"] = told.clone();
    }
    result
}
