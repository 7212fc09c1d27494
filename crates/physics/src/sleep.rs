//! Sleeping: a group of bodies connected by contacts and joints that have all been idle long enough is no longer
//! simulated, until something awake touches one of them.
//!
//! A body that falls asleep leaves the lists of bodies, contacts and joints, where the last entry takes its place,
//! and returns to their ends when it wakes; its shape moves to the tree of resting shapes. As in the engine, these
//! orders affect later results.

use super::body::{Body, GROUND, other_body};
use super::broad::Extent;
use super::units::DT;
use super::world::World;

/// Idle time before bodies sleep, in seconds: nine steps.
const IDLE_TIME: f64 = 0.3;

impl World {
    /// Updates idle times, wakes bodies touched by awake ones and puts idle groups to sleep.
    pub(super) fn update_sleep(&mut self) {
        let gained = self.gravity.length_squared() * (DT * DT);
        for &body in &self.awake {
            self.bodies[body as usize].count_idle(gained);
        }
        self.link_contacts();
        if self.awake.iter().all(|&body| self.bodies[body as usize].idle < IDLE_TIME) {
            return;
        }
        let mut index = 0;
        while index < self.awake.len() {
            let body = self.awake[index];
            if self.bodies[body as usize].root.is_none() {
                self.gather(body, body);
                let group = self.group(body);
                if group.iter().all(|&member| self.bodies[member as usize].idle >= IDLE_TIME) {
                    group.into_iter().for_each(|member| self.put_to_sleep(member));
                    continue;
                }
            }
            index += 1;
            let body = &mut self.bodies[body as usize];
            (body.root, body.next) = (None, None);
        }
    }

    /// Links the contacts of this step to their bodies, and wakes the sleeping ones.
    fn link_contacts(&mut self) {
        for index in 0..self.order.len() {
            let contact = self.order[index] as usize;
            for body in self.contacts[contact].bodies {
                if self.bodies[body as usize].is_asleep() {
                    self.wake(body);
                }
            }
            self.links += 1;
            self.contacts[contact].linked = Some(self.links);
        }
    }

    /// Contacts linked to a body, newest first.
    fn linked(&self, body: u32) -> Vec<u32> {
        let is_linked = |index: &u32| {
            let contact = &self.contacts[*index as usize];
            contact.linked.is_some() && contact.involves(body)
        };
        let mut linked: Vec<u32> = (0..self.contacts.len() as u32).filter(is_linked).collect();
        linked.sort_by_key(|&index| std::cmp::Reverse(self.contacts[index as usize].linked));
        linked
    }

    /// Joints of a body, newest first.
    fn joints_of(&self, body: u32) -> impl Iterator<Item = u32> {
        let joints = &self.joints;
        (0..joints.len() as u32).rev().filter(move |&joint| joints[joint as usize].bodies.contains(&body))
    }

    /// Adds a body and all bodies connected to it to the group of `root`, depth first.
    fn gather(&mut self, root: u32, body: u32) {
        if body == GROUND as u32 || self.bodies[body as usize].root.is_some() {
            return;
        }
        self.bodies[body as usize].root = Some(root);
        if body != root {
            let next = self.bodies[root as usize].next.replace(body);
            self.bodies[body as usize].next = next;
        }
        for contact in self.linked(body) {
            self.gather(root, other_body(self.contacts[contact as usize].bodies, body));
        }
        let joints: Vec<u32> = self.joints_of(body).collect();
        for joint in joints {
            self.gather(root, other_body(self.joints[joint as usize].bodies, body));
        }
    }

    /// The bodies of a group, its root first.
    fn group(&self, root: u32) -> Vec<u32> {
        std::iter::successors(Some(root), |&body| self.bodies[body as usize].next).collect()
    }

    /// The contacts and the joints that are stored with a body: its first body stores each; if that is the ground, the
    /// other does.
    fn stored_with(&self, body: u32) -> (Vec<u32>, Vec<u32>) {
        let is_stored = |[first, _]: [u32; 2]| first == body || first == GROUND as u32;
        let contacts =
            self.linked(body).into_iter().filter(|&contact| is_stored(self.contacts[contact as usize].bodies));
        let joints = self.joints_of(body).filter(|&joint| is_stored(self.joints[joint as usize].bodies));
        (contacts.collect(), joints.collect())
    }

    fn put_to_sleep(&mut self, body: u32) {
        swap_out(&mut self.awake, body);
        let shape = self.bodies[body as usize].shape;
        if let Some(found) = self.shapes.get(shape as usize) {
            let (number, bounds) = (found.number, found.bounds);
            self.broad.remove_moving(shape);
            self.broad.insert_resting(shape, number, bounds);
        }
        let (contacts, joints) = self.stored_with(body);
        for contact in contacts {
            self.contacts[contact as usize].is_cached = false;
            swap_out(&mut self.order, contact);
        }
        joints.into_iter().for_each(|joint| swap_out(&mut self.active_joints, joint));
    }

    /// Wakes a sleeping body and its group.
    pub(super) fn wake(&mut self, body: u32) {
        let Some(root) = self.bodies[body as usize].root else { return };
        for member in self.group(root) {
            let found = &mut self.bodies[member as usize];
            (found.idle, found.root, found.next) = (0.0, None, None);
            self.restore(member);
        }
        self.reset_idle(body);
    }

    fn restore(&mut self, body: u32) {
        self.awake.push(body);
        let Body { shape, velocity, .. } = self.bodies[body as usize];
        if let Some(found) = self.shapes.get(shape as usize) {
            let (number, extent) = (found.number, Extent { bounds: found.bounds, velocity });
            self.broad.remove_resting(shape);
            self.broad.insert_moving(shape, number, &extent);
        }
        let (contacts, joints) = self.stored_with(body);
        for index in contacts {
            let contact = &mut self.contacts[index as usize];
            (contact.is_cached, contact.seen) = (true, self.step);
            self.order.push(index);
        }
        self.active_joints.extend(joints);
    }

    /// Resets the idle time of a body that a rule has changed, and of the bodies that touch it.
    pub(super) fn reset_idle(&mut self, body: u32) {
        self.bodies[body as usize].idle = 0.0;
        for index in 0..self.contacts.len() {
            let contact = self.contacts[index];
            if contact.linked.is_some() && contact.involves(body) {
                self.bodies[other_body(contact.bodies, body) as usize].idle = 0.0;
            }
        }
    }
}

/// Removes an entry; the last entry takes its place.
fn swap_out(list: &mut Vec<u32>, entry: u32) {
    if let Some(index) = list.iter().position(|&other| other == entry) {
        list.swap_remove(index);
    }
}
