//! All integration tests in one program: it links once, and its tests share the sessions that are slow to build.
//! `cargo test --release readme::` runs one file's tests.

mod accuracy;
mod animate;
mod animate_cloth;
mod bad_input;
mod body_models;
mod broken_scans;
mod cli;
mod common;
mod covered;
mod drive;
mod durability;
mod foreign;
mod foreign_motion;
mod foreign_segment;
mod frozen;
mod hair;
mod history;
mod laws;
mod outfit;
mod output_files;
mod painted_kinds;
mod painted_masks;
mod pipeline;
mod readme;
mod realism;
mod record_and_watch;
mod replay;
mod rgbd;
mod smpl_family;
mod stage_versions;
mod stages;
mod step_editing;
mod textured;
mod verdicts;
mod weights_picture;
