//! One direction of the network: ports in, ports out, whole packets in turn.

use std::collections::VecDeque;

use super::memory::Request;

/// A packet and where it goes.
#[derive(Clone, Copy, Debug)]
struct Packet {
    request: Request,
    to: usize,
    flits: u64,
    /// Cycle from which it may leave its port.
    ready: u64,
}

/// A crossbar. Each port passes one flit a cycle; packets of a port leave in order, a port out takes those that
/// want it round robin, and a packet is not interrupted.
#[derive(Clone, Debug)]
pub struct Crossbar {
    latency: u64,
    gap: u64,
    capacity: usize,
    inputs: Vec<VecDeque<Packet>>,
    input_free: Vec<u64>,
    outputs: Vec<VecDeque<(u64, Request)>>,
    output_free: Vec<u64>,
    turn: Vec<usize>,
    waiting: usize,
    arriving: usize,
}

impl Crossbar {
    /// `latency` cycles without contention; `capacity` packets wait at a port.
    pub fn new(inputs: usize, outputs: usize, latency: u64, gap: u64, capacity: usize) -> Crossbar {
        Crossbar {
            latency,
            gap,
            capacity,
            inputs: vec![VecDeque::new(); inputs],
            input_free: vec![0; inputs],
            outputs: vec![VecDeque::new(); outputs],
            output_free: vec![0; outputs],
            turn: vec![0; outputs],
            waiting: 0,
            arriving: 0,
        }
    }

    /// Whether port `from` takes no more.
    pub fn full(&self, from: usize) -> bool {
        self.inputs[from].len() >= self.capacity
    }

    /// Whether nothing is on its way.
    pub fn idle(&self) -> bool {
        self.waiting + self.arriving == 0
    }

    /// Sends a packet of `flits`.
    pub fn push(&mut self, from: usize, to: usize, request: Request, flits: u64, now: u64) {
        self.inputs[from].push_back(Packet { request, to, flits, ready: now + 1 });
        self.waiting += 1;
    }

    /// Lets packets through.
    pub fn step(&mut self, now: u64) {
        if self.waiting == 0 {
            return;
        }
        let inputs = self.inputs.len();
        // For each port out, the first port in that wants it, counted from its turn.
        for from in 0..inputs {
            let Some(packet) = self.inputs[from].front() else { continue };
            let to = packet.to;
            if packet.ready > now || self.input_free[from] > now || self.output_free[to] > now {
                continue;
            }
            if self.outputs[to].len() >= self.capacity {
                continue;
            }
            let distance = |port: usize| (port + inputs - self.turn[to]) % inputs;
            let beaten = (0..inputs).any(|other| {
                other != from
                    && distance(other) < distance(from)
                    && self.input_free[other] <= now
                    && self.inputs[other].front().is_some_and(|p| p.to == to && p.ready <= now)
            });
            if beaten {
                continue;
            }
            if let Some(packet) = self.inputs[from].pop_front() {
                self.input_free[from] = now + packet.flits;
                self.output_free[to] = now + packet.flits + self.gap;
                self.turn[to] = (from + 1) % inputs;
                self.outputs[to].push_back((now + packet.flits - 1 + self.latency, packet.request));
                self.waiting -= 1;
                self.arriving += 1;
            }
        }
    }

    /// The packet that has arrived at port `to`.
    pub fn top(&self, to: usize, now: u64) -> Option<&Request> {
        self.outputs[to].front().filter(|(at, _)| *at <= now).map(|(_, request)| request)
    }

    /// Takes the packet that has arrived at port `to`.
    pub fn pop(&mut self, to: usize, now: u64) -> Option<Request> {
        self.top(to, now)?;
        self.arriving -= 1;
        self.outputs[to].pop_front().map(|(_, request)| request)
    }
}
