//! One physics step in CREATE's order: positions, collision detection with the bucket's
//! capture, sleeping, gravity, impulses.

use rapier2d::parry::query;
use rapier2d::prelude::*;

use super::body::{Body, SLEEP_STEPS};
use super::contact::{Contact, Geometry, ITERATIONS};
use super::tool::{Tool, ToolKind};
use super::touch::{ObjectId, Touch};
use super::units::PHYSICS_DT;
use super::world::{StaticTool, World, reaches};

impl World {
    /// Advances by one physics step of 1/30 s in CREATE's order: positions, collision
    /// detection, sleeping, gravity, impulses.
    pub fn step(&mut self) {
        self.step += 1;
        for body in self.balls.iter_mut().filter(|body| !body.asleep) {
            body.advance();
        }
        self.detect();
        self.put_to_sleep();
        self.respond();
    }

    /// Finds what touches now. Contacts are solved in the order in which they are found.
    fn detect(&mut self) {
        self.touches.clear();
        std::mem::swap(&mut self.contacts, &mut self.previous);
        self.contacts.clear();
        self.wake_touched();
        for ball in 0..self.balls.len() {
            for other in ball + 1..self.balls.len() {
                self.detect_balls(ball, other);
            }
            // Before the tools: a bucket moves the ball it captures.
            for sensor in 0..self.sensor_count() {
                if self.touches_sensor(ball, sensor) {
                    self.touches.push(Touch { ball, object: ObjectId::Sensor(sensor) });
                }
            }
            for tool in 0..self.tools.len() {
                self.detect_tool(ball, tool);
            }
        }
        let step = self.step;
        self.contacts.extend(self.previous.iter().filter(|contact| contact.is_remembered(step)));
    }

    /// Wakes every sleeping ball that an awake one touches, and those that lean on it.
    fn wake_touched(&mut self) {
        while self.balls.iter().any(|body| body.asleep) {
            let touched = |&ball: &usize| {
                let is_awake_neighbour = |other: &Body| !other.asleep && gap(&self.balls[ball], other).1 < 0.0;
                self.balls[ball].asleep && self.balls.iter().any(is_awake_neighbour)
            };
            let Some(ball) = (0..self.balls.len()).find(touched) else { break };
            self.balls[ball].wake();
        }
    }

    fn detect_balls(&mut self, first: usize, second: usize) {
        let (a, b) = (&self.balls[first], &self.balls[second]);
        let (between, distance) = gap(a, b);
        if distance >= 0.0 {
            return;
        }
        let normal = between.normalize_or(Vector::X);
        let geometry = Geometry {
            normal,
            arm: normal * a.ball.radius,
            other_arm: -normal * b.ball.radius,
            distance,
            elasticity: a.ball.elasticity * b.ball.elasticity,
            friction: a.ball.friction * b.ball.friction,
        };
        self.touches.push(Touch { ball: first, object: ObjectId::Ball(second) });
        self.touches.push(Touch { ball: second, object: ObjectId::Ball(first) });
        self.remember(first, ObjectId::Ball(second), geometry);
    }

    fn detect_tool(&mut self, ball: usize, index: usize) {
        let body = &mut self.balls[ball];
        let StaticTool { tool, collider, bounds } = &*self.tools[index];
        if !reaches(body, bounds) {
            return;
        }
        let found = query::contact(collider.position(), collider.shape(), body.rigid.position(), &*body.shape, 0.0);
        // A ball against a convex shape is always supported.
        let Ok(Some(found)) = found else { return };
        self.touches.push(Touch { ball, object: ObjectId::Tool(index) });
        if tool.kind == ToolKind::Bucket && (body.captured || is_above(tool, body.rigid.translation())) {
            body.capture(tool);
            return;
        }
        let normal = -found.normal1;
        let geometry = Geometry {
            normal,
            arm: normal * body.ball.radius,
            other_arm: Vector::ZERO,
            distance: found.dist,
            elasticity: body.ball.elasticity * tool.elasticity,
            friction: body.ball.friction * tool.friction,
        };
        self.remember(ball, ObjectId::Tool(index), geometry);
    }

    fn remember(&mut self, ball: usize, object: ObjectId, geometry: Geometry) {
        let step = self.step;
        let known = self.previous.iter_mut().find(|contact| contact.is_between(ball, object));
        let mut new = Contact::new(ball, object);
        let contact = known.unwrap_or(&mut new);
        contact.refresh(geometry, step);
        self.contacts.push(*contact);
    }

    /// Balls that hang together and have all been idle long enough fall asleep.
    fn put_to_sleep(&mut self) {
        for (index, body) in self.balls.iter_mut().enumerate() {
            body.group = index;
            if !body.asleep {
                body.count_idle(self.gravity);
            }
        }
        if self.balls.iter().all(|body| body.asleep || body.idle < SLEEP_STEPS) {
            return;
        }
        let step = self.step;
        for contact in self.contacts.iter().filter(|contact| contact.is_active(step)) {
            if let ObjectId::Ball(other) = contact.object {
                let (from, to) = (self.balls[other].group, self.balls[contact.ball].group);
                self.balls.iter_mut().filter(|body| body.group == from).for_each(|body| body.group = to);
            }
        }
        for group in 0..self.balls.len() {
            let mut members = self.balls.iter_mut().filter(|body| body.group == group);
            if members.all(|body| body.asleep || body.idle >= SLEEP_STEPS) {
                self.balls.iter_mut().filter(|body| body.group == group).for_each(|body| body.asleep = true);
            }
        }
    }

    /// Gravity and the impulses of contacts.
    fn respond(&mut self) {
        let Self { balls, contacts, motions, step, .. } = self;
        motions.clear();
        motions.extend(balls.iter().map(Body::motion));
        // Balls in contact sleep together, so asking one of them is enough.
        let is_solved = |contact: &&mut Contact| contact.is_active(*step) && !balls[contact.ball].asleep;
        for contact in contacts.iter_mut().filter(is_solved) {
            contact.prepare(motions);
        }
        for (body, motion) in balls.iter().zip(motions.iter_mut()) {
            if !body.asleep {
                motion.velocity += self.gravity * PHYSICS_DT;
            }
        }
        for contact in contacts.iter_mut().filter(is_solved) {
            contact.warm_start(motions);
        }
        for _ in 0..ITERATIONS {
            for contact in contacts.iter_mut().filter(is_solved) {
                contact.solve(motions);
            }
        }
        for (body, motion) in balls.iter_mut().zip(motions.iter()) {
            body.set_motion(motion);
        }
    }
}

/// From one ball's centre to the other's, and the signed distance of their surfaces.
fn gap(a: &Body, b: &Body) -> (Vector, f32) {
    let between = b.rigid.translation() - a.rigid.translation();
    (between, between.length() - a.ball.radius - b.ball.radius)
}

/// Whether a centre is nearer to both upper corners of a bucket than to both lower
/// ones: above both diagonals in the bucket's own frame.
fn is_above(bucket: &Tool, centre: Vector) -> bool {
    let local = bucket.pose().inverse_transform_point(centre);
    local.y > local.x.abs()
}
