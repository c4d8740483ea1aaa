//! What the program tells of its work: machine, scene, statistics, benchmarks, dumps.

pub mod baseline;
pub mod bench;
pub mod bench_export;
pub mod bench_table;
pub mod chart;
pub mod diff;
pub mod experiment;
pub mod head;
pub mod html;
pub mod machine;
pub mod model;
pub mod occupancy_chart;
pub mod paper;
pub mod ray_dump;
pub mod reference;
pub mod render;
pub mod scene;
pub mod search;
pub mod statistics;
pub mod study;
pub mod sweep;
pub mod tracing;
pub mod verify;
