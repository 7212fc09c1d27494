//! Converts requests of other processes to controls.

use super::run_loop::Control;
use crate::run::Request;

/// The control for a request.
///
/// # Errors
/// A one-line description of what is wrong with the request.
pub(super) fn control(request: Request) -> Result<Control, String> {
    Ok(match request {
        Request::Pause => Control::Pause,
        Request::Resume => Control::Resume,
        Request::Advance { episodes } => Control::Advance(episodes),
        Request::Stop => Control::Stop { reason: "asked to by another process".to_owned() },
        Request::Epsilon { schedule } => {
            Control::SetSchedule(schedule.parse().map_err(|error| format!("epsilon: {error}"))?)
        }
    })
}
