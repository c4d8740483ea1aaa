use super::*;

fn sm(rule: Rule, shared_kib: u32) -> Sm {
    let settings = [format!("sm.shared_kib={shared_kib}")];
    Sm { rule, ..Machine::named("gtx480", &settings).unwrap().sm }
}

fn blocks_and_warps(rule: Rule, shared_kib: u32, (threads, registers, shared): (u32, u32, u32)) -> (u32, u32) {
    let o = occupancy(&sm(rule, shared_kib), Demand { registers, threads, shared });
    (o.blocks, o.warps)
}

#[test]
fn the_worked_examples_are_exact() {
    for (demand, shared_kib, expected) in [
        ((192, 21, 0), 48, (7, 42)),
        ((288, 21, 0), 48, (4, 36)),
        ((192, 42, 3000), 48, (4, 24)),
        ((128, 32, 6200), 48, (7, 28)),
        ((128, 32, 6200), 16, (2, 8)),
        ((256, 63, 0), 48, (2, 16)),
        ((1024, 33, 0), 48, (0, 0)),
    ] {
        assert_eq!(blocks_and_warps(Rule::Cuda, shared_kib, demand), expected, "{demand:?}");
    }
    assert_eq!(blocks_and_warps(Rule::Gpgpusim, 48, (192, 42, 3000)), (3, 18));
}

#[test]
fn the_reference_runs_hold_5_blocks_limited_by_registers() {
    for rule in [Rule::Cuda, Rule::Gpgpusim] {
        let o = occupancy(&sm(rule, 48), Demand { registers: 47, threads: 128, shared: 0 });
        assert_eq!(o, Occupancy { blocks: 5, warps: 20, limiter: Limiter::Registers });
    }
}

#[test]
fn the_rules_differ_in_62_of_2016_cases() {
    let rules = [sm(Rule::Cuda, 48), sm(Rule::Gpgpusim, 48)];
    let cases = (1..=32).flat_map(|t| (1..=63).map(move |r| Demand { registers: r, threads: 32 * t, shared: 0 }));
    let differ = cases.filter(|&demand| {
        let [a, b] = rules.each_ref().map(|sm| occupancy(sm, demand));
        a.blocks != b.blocks
    });
    assert_eq!(differ.count(), 62);
}

#[test]
fn each_limit_is_named() {
    for ((threads, registers, shared), limiter) in [
        ((256, 40, 0), Limiter::Registers),
        ((768, 10, 0), Limiter::Warps),
        ((32, 16, 0), Limiter::Blocks),
        ((64, 16, 20_000), Limiter::Shared),
    ] {
        assert_eq!(occupancy(&sm(Rule::Cuda, 48), Demand { registers, threads, shared }).limiter, limiter);
    }
}
