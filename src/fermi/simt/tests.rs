use super::*;
use crate::fermi::kernel::{Block, Kernel};
use crate::fermi::launch::{Launch, Stage, Work, Workload};
use crate::shared::{LEAF_BIT, LEAF_COUNT_SHIFT, STEP_PUSHED};
use crate::trace::StepTrace;

const WHILE: &str = "while-while";
const SPECULATIVE: &str = "speculative-while-while";
const A: u32 = LEAF_BIT | 1 << LEAF_COUNT_SHIFT;
const B: u32 = LEAF_BIT | 2 << LEAF_COUNT_SHIFT | 8;

fn trace(rays: &[&[u32]]) -> StepTrace {
    let mut trace = StepTrace { starts: vec![0], steps: Vec::new() };
    for steps in rays {
        trace.steps.extend(*steps);
        trace.starts.push(trace.steps.len() as u64);
    }
    trace
}

/// Blocks of the first warp, with their lanes and the number of lines of each of their memory instructions.
fn run(trace: &StepTrace, children: &[[u32; 2]], name: &str) -> Vec<(Block, u8, Vec<u32>)> {
    let workload = Workload { trace, children, triangles: 16, cut: None };
    let kernel = Kernel::named(name, &[]).unwrap();
    let launch = Launch { kernel: &kernel, workload, work: Work::Rays, virtual_caches: false, stage: Stage::Traverse };
    let mut warp = Warp::new(&launch, Layout::new(&workload, 64), 0, 0, 0);
    let (mut batch, mut all) = (Batch::default(), Vec::new());
    loop {
        warp.advance(&mut batch);
        if batch.segments.is_empty() {
            return all;
        }
        for s in &batch.segments {
            let memory = &batch.memory[s.memory.0 as usize..s.memory.1 as usize];
            all.push((s.block, s.lanes, memory.iter().map(|op| op.lines.1 - op.lines.0).collect()));
        }
    }
}

#[test]
fn a_warp_runs_its_loops_as_by_hand() {
    use Block::*;
    // Lane 0 meets both children of node 0, lane 1 none, lane 2 is at once without steps.
    let trace = trace(&[&[STEP_PUSHED, A, B], &[0], &[]]);
    let expected = vec![
        (Entry, 3, vec![1, 1, 1]),
        (Outer, 2, vec![]),
        (Node, 2, vec![1, 1, 1]),
        (Descend, 1, vec![1]),
        (Push, 1, vec![1]),
        (Pop, 1, vec![1]),
        (NodeEnd, 2, vec![]),
        (Leaf, 1, vec![]),
        (Triangle, 1, vec![1, 1, 1]),
        (LeafPop, 1, vec![1]),
        (Leaf, 1, vec![]),
        (Triangle, 1, vec![1, 1, 1]),
        (Triangle, 1, vec![1, 1, 1]),
        (LeafPop, 1, vec![1]),
        (OuterEnd, 2, vec![]),
        (Exit, 3, vec![1]),
    ];
    assert_eq!(run(&trace, &[[A, B]], WHILE), expected);
}

#[test]
fn lanes_on_different_lines_and_depths_are_accesses_of_their_own() {
    // Nodes 1 and 2 lie on lines of their own (two nodes a line: 0 and 1, 2 and 3).
    let children = [[1, 2], [A, B], [A, B]];
    let trace = trace(&[&[0, 1, A], &[0, 2, A], &[STEP_PUSHED, 1, A, 2]]);
    let all = run(&trace, &children, WHILE);
    let second_node = all.iter().filter(|(block, ..)| *block == Block::Node).nth(1).unwrap();
    assert_eq!(second_node, &(Block::Node, 3, vec![2, 2, 2]));
    // Lane 2 has an entry on its stack, the others have none.
    let pop = all.iter().find(|(block, ..)| *block == Block::LeafPop).unwrap();
    assert_eq!(pop, &(Block::LeafPop, 3, vec![2]));
}

#[test]
fn a_speculative_lane_puts_its_leaf_off_until_all_have_one() {
    let children = [[1, 2], [A, B], [A, B]];
    // Lane 0 finds its leaf a node earlier than lane 1.
    let trace = trace(&[&[STEP_PUSHED, 1, A, 2, B], &[0, 2, B]]);
    let count = |name, block| run(&trace, &children, name).iter().filter(|(b, ..)| *b == block).count();
    for name in [WHILE, SPECULATIVE] {
        let tests: u32 = run(&trace, &children, name)
            .iter()
            .filter(|(block, ..)| *block == Block::Triangle)
            .map(|&(_, lanes, _)| u32::from(lanes))
            .sum();
        assert_eq!(tests, 5, "{name}: one triangle of A, two of B, two of B");
    }
    assert!(count(SPECULATIVE, Block::Outer) <= count(WHILE, Block::Outer));
}

#[test]
fn a_marked_leaf_is_read_once_more_than_it_has_triangles() {
    use Block::*;
    // Lane 0 has one triangle, lane 1 two, both at their first leaf.
    let trace = trace(&[&[0, A], &[0, B]]);
    let all = run(&trace, &[[A, B]], SPECULATIVE);
    let leaf: Vec<(Block, u8, usize)> =
        all.iter().filter(|run| matches!(run.0, Mark | Triangle)).map(|run| (run.0, run.1, run.2.len())).collect();
    let expected = [(Mark, 2, 1), (Triangle, 2, 2), (Mark, 2, 1), (Triangle, 1, 2), (Mark, 1, 1)];
    assert_eq!(leaf, expected);
}

#[test]
fn lanes_side_by_side_make_a_request() {
    // 16-byte words of one line, by half of the lanes: quarter warps with an active lane ask for it one by one.
    let lines = |request, lanes: u32, access| {
        let mut batch = Batch::default();
        batch.clear(request);
        batch.segment(Block::Node, lanes);
        batch.access(access, (0..lanes.count_ones()).map(|_| 256), 16);
        batch.lines.len()
    };
    let load = Access::Load;
    assert_eq!([lines(512, u32::MAX, load), lines(128, u32::MAX, load), lines(128, 0xffff, load)], [1, 4, 2]);
    assert_eq!([lines(128, 0x0101_0101, load), lines(128, 0xff, load)], [4, 1]);
    assert_eq!(lines(128, u32::MAX, Access::Texture), 1);
}

#[test]
fn stores_of_a_part_of_a_line_are_as_small_as_they_can_be() {
    let bytes = |addresses: &[u64]| {
        let mut batch = Batch::default();
        batch.clear(512);
        batch.segment(Block::Push, (1 << addresses.len()) - 1);
        batch.access(Access::Push, addresses.iter().copied(), 4);
        batch.memory[0].bytes
    };
    assert_eq!([bytes(&[0, 28]), bytes(&[28, 32]), bytes(&[60, 64]), bytes(&[96, 124])], [32, 64, 128, 32]);
}
