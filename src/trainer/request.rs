//! What other processes ask of a training, as what its own process would ask.

use super::run_loop::Control;
use crate::run::Request;

/// The control that does what is asked.
///
/// # Errors
/// What is wrong with the request, in one line.
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
