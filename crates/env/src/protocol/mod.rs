//! JSON Lines interfaces to other programs: simulating recorded scenes ([`simulate`]), replaying recorded episodes
//! ([`play_episodes`]), and serving a task as an environment ([`serve()`]).
//!
//! Scenes, levels and episodes have the formats of the recordings made in CREATE.

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
