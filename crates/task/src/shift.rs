//! The order of the parts of a scene, their positions and random shifts.

use rand::Rng;
use rand::seq::SliceRandom;

use super::objects::Region;
use super::part::{Offset, Part, Shift};
use super::schema::Task;

impl Task {
    /// The scene's parts in the order in which they are added to the world.
    pub fn parts(&self) -> Vec<Part> {
        let mut parts = self.order.clone();
        let missing: Vec<Part> = self.default_parts().filter(|part| !parts.contains(part)).collect();
        parts.extend(missing);
        parts
    }

    /// The scene's parts in the order of a task that sets none.
    pub fn default_parts(&self) -> impl Iterator<Item = Part> {
        let marker_subgoals = self.marker.as_ref().map_or(0, |marker| marker.subgoals.len());
        [Part::Target]
            .into_iter()
            .chain(self.marker.is_some().then_some(Part::Marker))
            .chain([Part::Goal])
            .chain((0..self.balls.len()).map(Part::Ball))
            .chain((0..self.boxes.len()).map(Part::Box))
            .chain((0..self.subgoals.len()).map(Part::Subgoal))
            .chain((0..marker_subgoals).map(Part::MarkerSubgoal))
            .chain((0..self.tools.len()).map(Part::Tool))
    }

    /// Removes a deleted tool or subgoal from the order and the random shifts; later indices move down by one.
    pub(super) fn forget(&mut self, gone: Part) {
        for parts in self.shifts.iter_mut().map(|shift| &mut shift.parts).chain([&mut self.order]) {
            parts.retain(|part| *part != gone);
            for part in parts {
                match (part, gone) {
                    (Part::Tool(index), Part::Tool(gone)) | (Part::Subgoal(index), Part::Subgoal(gone))
                        if *index > gone =>
                    {
                        *index -= 1;
                    }
                    _ => {}
                }
            }
        }
    }

    /// The task with these subgoals in place of its own, which leave the order and the random shifts.
    #[must_use]
    pub fn with_subgoals(mut self, subgoals: Vec<Region>) -> Self {
        (0..self.subgoals.len()).rev().for_each(|index| self.forget(Part::Subgoal(index)));
        Self { subgoals, ..self }
    }

    /// Draws the random shifts, in order, normalised.
    pub fn draw_shifts(&self, rng: &mut impl Rng) -> Vec<[f32; 2]> {
        let draw = |shift: &Shift| match &shift.by {
            Offset::Uniform { x, y } => [x, y].map(|[low, high]| rng.gen_range(*low..=*high)),
            Offset::OneOf(choices) => choices.choose(rng).copied().unwrap_or_default(),
        };
        self.shifts.iter().map(draw).collect()
    }

    /// The task with its random shifts applied; shifts without an offset are dropped.
    pub fn shifted(&self, offsets: &[[f32; 2]]) -> Self {
        let mut task = self.clone();
        for (shift, [x, y]) in std::mem::take(&mut task.shifts).into_iter().zip(offsets) {
            for part in shift.parts {
                if let Some(position) = task.position_mut(part) {
                    *position = [position[0] + x, position[1] + y];
                }
            }
        }
        task
    }

    /// The position of a part, mutable; None if there is no such part.
    pub fn position_mut(&mut self, part: Part) -> Option<&mut [f32; 2]> {
        match part {
            Part::Target => Some(&mut self.ball.position),
            Part::Marker => self.marker.as_mut().map(|marker| &mut marker.ball.position),
            Part::Goal => Some(&mut self.goal.position),
            Part::Ball(index) => self.balls.get_mut(index).map(|ball| &mut ball.position),
            Part::Box(index) => self.boxes.get_mut(index).map(|moving| &mut moving.position),
            Part::Tool(index) => self.tools.get_mut(index).map(|tool| &mut tool.position),
            Part::Subgoal(index) => self.subgoals.get_mut(index).map(|region| &mut region.position),
            Part::MarkerSubgoal(index) => self
                .marker
                .as_mut()
                .and_then(|marker| marker.subgoals.get_mut(index))
                .map(|region| &mut region.position),
        }
    }
}
