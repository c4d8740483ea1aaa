//! Latency under load: equation (1) of Zhu and Deng 2013, and how long requests queue.

/// Terms of equation (1), core cycles and miss rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Amat {
    /// Latency of the L1.
    pub l1: f64,
    /// Latency of the L2, without the network.
    pub l2: f64,
    /// Latency of memory, without the network.
    pub dram: f64,
    /// Latency of the network, queues included.
    pub traffic: f64,
    /// Miss rate of the L1.
    pub l1_miss: f64,
    /// Miss rate of the L2.
    pub l2_miss: f64,
}

impl Amat {
    /// Mean latency of an access: T = t_L1 + a_L1 [t_traf + t_L2 - t_L1 + a_L2 (t_dram - t_L2)].
    pub fn mean(&self) -> f64 {
        self.l1 + self.l1_miss * (self.traffic + self.l2 - self.l1 + self.l2_miss * (self.dram - self.l2))
    }
}

/// A closed network: customers that think, then queue at one of several equal servers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// Customers in all.
    pub customers: f64,
    /// Cycles from being served to asking again, without any queue.
    pub think: f64,
    /// Servers, among which customers spread evenly.
    pub servers: f64,
    /// Cycles of service, fixed.
    pub service: f64,
}

impl Stage {
    /// Services a cycle of all servers together.
    ///
    /// An M/D/1 queue in which each server's utilization rho satisfies x = rho (z + 1 + rho / (2 (1 - rho))), with
    /// x customers a server and thinking time z in units of the service: Little's law with the mean wait of
    /// M/D/1. It is a quadratic whose smaller root is below 1 for any load, so there is nothing to iterate.
    pub fn throughput(&self) -> f64 {
        self.utilization() * self.servers / self.service
    }

    /// Fraction of time a server works.
    pub fn utilization(&self) -> f64 {
        let x = self.customers / self.servers;
        let z = self.think / self.service;
        let b = 1.0 + z + x;
        2.0 * x / (b + (b * b - 2.0 * x * (1.0 + 2.0 * z)).max(0.0).sqrt())
    }

    /// Mean cycles in the queue: what Little's law leaves of a customer's round.
    pub fn wait(&self) -> f64 {
        let throughput = self.throughput();
        if throughput == 0.0 {
            return 0.0;
        }
        (self.customers / throughput - self.think - self.service).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The case for which fermi.md reports that naive iteration fails.
    fn stage(sms: f64) -> Stage {
        Stage { customers: 64.0 * sms, think: 295.0, servers: 1.0, service: 4.545 / 12.0 }
    }

    #[test]
    fn equation_1_is_as_by_hand() {
        let amat = Amat { l1: 5.0, l2: 130.0, dram: 250.0, traffic: 20.0, l1_miss: 0.2, l2_miss: 0.5 };
        // 5 + 0.2 (20 + 130 - 5 + 0.5 x 120) = 5 + 0.2 x 205
        assert!((amat.mean() - 46.0).abs() < 1e-12);
        assert_eq!(Amat { l1_miss: 0.0, ..amat }.mean(), 5.0);
    }

    #[test]
    fn throughput_is_finite_monotone_and_below_capacity_from_1_to_10000_sms() {
        let mut previous = 0.0;
        for sms in 1..=10_000 {
            let s = stage(f64::from(sms));
            let now = s.throughput();
            assert!(now.is_finite() && now >= previous && now * s.service / s.servers <= 1.0, "{sms}: {now}");
            assert!(s.wait().is_finite());
            previous = now;
        }
    }

    #[test]
    fn the_closed_form_satisfies_its_equation() {
        for sms in [1.0, 8.0, 15.0, 100.0] {
            let s = stage(sms);
            let rho = s.utilization();
            let x = rho * (s.think / s.service + 1.0 + rho / (2.0 * (1.0 - rho)));
            assert!((x * s.servers / s.customers - 1.0).abs() < 1e-6, "{sms}");
        }
    }

    #[test]
    fn an_idle_stage_has_no_wait() {
        let s = Stage { customers: 0.0, think: 10.0, servers: 1.0, service: 1.0 };
        assert_eq!((s.throughput(), s.wait()), (0.0, 0.0));
    }
}
