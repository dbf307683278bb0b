//! The files of a session: artefacts by the hash of their content, durable writes, the lock, the journal and the
//! history. Knows stages by name only.

mod artefacts;
mod derived;
pub(in crate::session) mod durable;
mod failures;
mod hash;
mod history;
pub(in crate::session) mod journal;
mod lock;
mod manifest;
mod memory;
mod parent;
mod state;
mod stream;
mod timings;
mod warning;

pub(in crate::session) use artefacts::Health;
pub use artefacts::{Kept, Store};
pub(in crate::session) use derived::Derived;
pub(in crate::session) use durable::{
    UNFINISHED, begin_file, folder_of, not_a_file, open_file, place_whole, read_file, stage_whole, sweep, sync_folder,
    write_new, write_whole, write_whole_with,
};
pub use failures::Failure;
pub(in crate::session) use failures::Failures;
pub use hash::ContentHash;
pub(in crate::session) use hash::HashingWriter;
pub use history::{Branch, Entry, History, MAIN_BRANCH};
pub(in crate::session) use journal::BrokenLine;
pub use journal::{Change, JournalLook, Move};
pub(in crate::session) use lock::Lock;
pub(in crate::session) use manifest::{MANIFEST, Manifest};
pub use memory::Memory;
pub(in crate::session) use parent::{check_folder, check_parent, no_folder};
pub(in crate::session) use state::SCHEMA;
pub use state::{Measures, StageRecord, State, StepRecord, name_and_unit};
pub(in crate::session) use stream::{NamedReader, StreamError, copy_stream, read_failed, stream_error};
pub use timings::Timings;
pub use warning::Warning;
