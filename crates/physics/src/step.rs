//! One physics step in the engine's order: positions, detection with the tools' rules, sleeping, gravity, impulses.

use rapier2d::prelude::BoundingVolume;

use super::body::GROUND;
use super::broad::{Candidate, Extent};
use super::closest::Side;
use super::collide::collide;
use super::contact::{Contact, ITERATIONS, PERSISTENCE, State};
use super::joint;
use super::rules::Rule;
use super::touch::{ObjectId, Touch};
use super::world::World;

impl World {
    /// Advances by one physics step of 1/30 s.
    pub fn step(&mut self) {
        self.step += 1;
        self.unlink_contacts();
        for &body in &self.awake {
            self.bodies[body as usize].advance();
        }
        self.detect();
        self.update_sleep();
        self.forget_contacts();
        self.respond();
    }

    /// Unlinks the previous step's contacts from bodies that are awake.
    fn unlink_contacts(&mut self) {
        for &index in &self.order {
            let contact = &mut self.contacts[index as usize];
            contact.state = State::Lasting;
            if contact.bodies.iter().all(|&body| !self.bodies[body as usize].is_asleep()) {
                contact.linked = None;
            }
        }
        self.order.clear();
    }

    /// Finds the current contacts, which are solved in the order of detection.
    fn detect(&mut self) {
        self.touches.clear();
        self.moved.clear();
        for &index in &self.awake {
            let body = &self.bodies[index as usize];
            if let Some(outline) = &body.outline {
                let shape = &mut self.shapes[body.shape as usize];
                body.place(outline, &mut shape.outline);
                shape.bounds = shape.outline.bounds();
            }
        }
        let Self { broad, shapes, bodies, candidates, .. } = self;
        let extent = |shape: u32| {
            let shape = &shapes[shape as usize];
            Extent { bounds: shape.bounds, velocity: bodies[shape.body as usize].velocity }
        };
        broad.update(extent, candidates);
        for index in 0..self.candidates.len() {
            self.examine(self.candidates[index]);
        }
    }

    fn examine(&mut self, candidate: Candidate) {
        let Candidate { first, second, pair } = candidate;
        let (a, b) = (&self.shapes[first as usize], &self.shapes[second as usize]);
        if !a.bounds.intersects(&b.bounds) || a.body == b.body {
            return;
        }
        let (first, second) = if a.outline.rank() > b.outline.rank() { (second, first) } else { (first, second) };
        let (a, b) = (&self.shapes[first as usize], &self.shapes[second as usize]);
        let is_sensor = a.is_sensor || b.is_sensor;
        let touching = collide(
            Side { outline: &a.outline, bounds: &a.bounds, number: a.number },
            Side { outline: &b.outline, bounds: &b.bounds, number: b.number },
            self.broad.hint(pair),
            !is_sensor,
        );
        self.broad.set_hint(pair, touching.hint);
        if touching.points().is_empty() {
            return;
        }
        let owners = [a.owner, b.owner];
        let index = self.contact_between([first, second]);
        let (a, b) = (&self.shapes[first as usize], &self.shapes[second as usize]);
        let contact = &mut self.contacts[index as usize];
        contact.refresh([first, second], [a, b], &self.bodies, &touching);
        self.record_touch(owners);
        let is_kept = self.apply_rules(index, owners);
        let contact = &mut self.contacts[index as usize];
        contact.seen = self.step;
        if is_kept && !is_sensor {
            self.order.push(index);
        } else {
            contact.clear_points();
        }
    }

    /// The remembered contact of two shapes, or a new one.
    fn contact_between(&mut self, shapes: [u32; 2]) -> u32 {
        let found = self.contacts.iter().position(|contact| contact.is_cached && contact.is_between(shapes));
        if let Some(index) = found {
            return index as u32;
        }
        if let Some(free) = self.free_contacts.pop() {
            self.contacts[free as usize] = Contact::default();
            return free;
        }
        self.contacts.push(Contact::default());
        self.contacts.len() as u32 - 1
    }

    fn record_touch(&mut self, [a, b]: [ObjectId; 2]) {
        for (one, other) in [(a, b), (b, a)] {
            if let ObjectId::Ball(ball) = one {
                self.touches.push(Touch { ball, object: other });
            }
        }
    }

    /// Applies a tool's rules to a body that touches it. Returns whether the contact is kept.
    fn apply_rules(&mut self, index: u32, owners: [ObjectId; 2]) -> bool {
        let contact = &self.contacts[index as usize];
        let state = contact.state;
        let Some(acting) = Acting::of(owners, contact.bodies) else { return state != State::Ignored };
        let kind = self.tools[acting.tool].tool.kind;
        if let (State::New, Some(rule)) = (state, kind.row().begin)
            && !self.act(rule, acting)
        {
            self.contacts[index as usize].state = State::Ignored;
            self.moved.push(acting.touch());
        }
        if self.contacts[index as usize].state == State::Ignored {
            return false;
        }
        let is_kept = kind.row().pre_solve.is_none_or(|rule| self.act(rule, acting));
        if !is_kept && !kind.is_sensor() {
            self.moved.push(acting.touch());
        }
        is_kept
    }

    fn act(&mut self, rule: Rule, acting: Acting) -> bool {
        rule(&self.tools[acting.tool], &mut self.bodies[acting.body as usize])
    }

    /// Forgets contacts that have been lost for a while, except those between resting bodies.
    fn forget_contacts(&mut self) {
        for (index, contact) in self.contacts.iter_mut().enumerate() {
            if !contact.is_cached || contact.seen == self.step {
                continue;
            }
            let rests = |&body: &u32| body == GROUND as u32 || self.bodies[body as usize].is_asleep();
            if contact.bodies.iter().all(rests) {
                continue;
            }
            contact.state = State::Lost;
            if self.step - contact.seen >= PERSISTENCE {
                contact.is_cached = false;
                self.free_contacts.push(index as u32);
            }
        }
    }

    /// Applies gravity and the impulses of contacts and joints, then the rules that follow the solver.
    fn respond(&mut self) {
        let Self { bodies, contacts, order, joints, active_joints, awake, gravity, .. } = self;
        for &index in order.iter() {
            contacts[index as usize].prepare(bodies);
        }
        for &index in active_joints.iter() {
            joints[index as usize].prepare(bodies);
        }
        for &body in awake.iter() {
            bodies[body as usize].accelerate(*gravity);
        }
        for &index in order.iter() {
            contacts[index as usize].warm_start(bodies);
        }
        joint::warm_start(joints, active_joints, bodies);
        iterate(|| {
            let mut changed = false;
            for &index in order.iter() {
                changed |= contacts[index as usize].solve(bodies);
            }
            changed | joint::solve(joints, active_joints, bodies)
        });
        // Bias velocities do not depend on velocities, and seldom is an overlap so deep that it needs them.
        if order.iter().any(|&index| contacts[index as usize].overlaps()) {
            iterate(|| {
                let mut changed = false;
                for &index in order.iter() {
                    changed |= contacts[index as usize].separate(bodies);
                }
                changed
            });
        }
        for index in 0..self.order.len() {
            let contact = &self.contacts[self.order[index] as usize];
            let owners = contact.shapes.map(|shape| self.shapes[shape as usize].owner);
            let Some(acting) = Acting::of(owners, contact.bodies) else { continue };
            if let Some(rule) = self.tools[acting.tool].tool.kind.row().post_solve
                && self.act(rule, acting)
            {
                self.reset_idle(acting.body);
            }
        }
    }
}

/// Repeats an iteration of the solver, which returns whether it changed anything: if not, further iterations would not
/// either.
#[inline]
fn iterate(mut once: impl FnMut() -> bool) {
    for _ in 0..ITERATIONS {
        if !once() {
            break;
        }
    }
}

/// A tool and the ball or box that it acts on.
#[derive(Debug, Clone, Copy)]
struct Acting {
    tool: usize,
    ball: usize,
    body: u32,
}

impl Acting {
    /// The tool and body of a contact between a tool and a ball or box; other contacts have no rules.
    fn of(owners: [ObjectId; 2], bodies: [u32; 2]) -> Option<Self> {
        match owners {
            [ObjectId::Ball(ball), ObjectId::Tool(tool)] => Some(Self { tool, ball, body: bodies[0] }),
            [ObjectId::Tool(tool), ObjectId::Ball(ball)] => Some(Self { tool, ball, body: bodies[1] }),
            _ => None,
        }
    }

    fn touch(&self) -> Touch {
        Touch { ball: self.ball, object: ObjectId::Tool(self.tool) }
    }
}
