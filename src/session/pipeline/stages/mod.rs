//! The stages, one file each, and what several of them share.

pub(in crate::session::pipeline) mod animate;
pub(in crate::session::pipeline) mod check;
pub(in crate::session::pipeline) mod cloth;
pub(in crate::session::pipeline) mod cut;
pub(in crate::session::pipeline) mod evidence;
pub(in crate::session::pipeline) mod figure;
pub(in crate::session::pipeline) mod fit;
pub(in crate::session::pipeline) mod garment_file;
pub(in crate::session::pipeline) mod hair;
pub(in crate::session::pipeline) mod kinds;
pub(in crate::session::pipeline) mod labelling;
pub(in crate::session::pipeline) mod later_scans;
pub(in crate::session::pipeline) mod marks;
pub(in crate::session::pipeline) mod pose;
pub(in crate::session::pipeline) mod posed;
pub(in crate::session::pipeline) mod press;
pub(in crate::session::pipeline) mod register;
pub(in crate::session::pipeline) mod rig;
pub(in crate::session::pipeline) mod scan;
pub(in crate::session::pipeline) mod segment;
pub(in crate::session::pipeline) mod stack;
pub(in crate::session::pipeline) mod step_scan;
