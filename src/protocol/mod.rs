//! JSON Lines spoken with other programs: recorded scenes in and trajectories out
//! ([`simulate`]), recorded episodes replayed ([`play_episodes`]), a task as an environment
//! that answers requests ([`serve()`]).
//!
//! The formats of scenes, levels and episodes are those of the recordings made in CREATE.

mod catalogue;
mod episode;
mod level;
mod lines;
mod recorded;
mod scene;
mod serve;

pub use catalogue::Catalogue;
pub use episode::{StepLine, play_actions, play_episodes, replay};
pub use lines::{LinesError, MAX_LINE};
pub use scene::simulate;
pub use serve::serve;
