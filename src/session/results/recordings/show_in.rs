//! The target of a recording: a viewer or a file.

use std::convert::Infallible;
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use std::str::FromStr;

/// The target of a recording: a viewer or a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ShowIn {
    /// The Rerun viewer that runs on this machine, or else a new one, which listens on this interface.
    Viewer(IpAddr),
    /// The viewer at this URL.
    ViewerAt(String),
    /// A file, to be opened later.
    File(PathBuf),
}

/// The interface on which a viewer listens that is started: nobody else can reach it.
const LOOPBACK: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);

impl ShowIn {
    /// Sets the interface on which a viewer that is started listens.
    pub fn with_bind(self, bind: Option<IpAddr>) -> Self {
        match (self, bind) {
            (Self::Viewer(_), Some(bind)) => Self::Viewer(bind),
            (other, _) => other,
        }
    }
}

impl FromStr for ShowIn {
    type Err = Infallible;

    /// Parses an empty text, a URL or a path.
    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(match text {
            "" => Self::Viewer(LOOPBACK),
            url if url.contains("://") => Self::ViewerAt(url.into()),
            path => Self::File(path.into()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_viewer_that_is_started_listens_on_the_loopback_interface_unless_told_otherwise() {
        let Ok(viewer) = "".parse::<ShowIn>();
        assert_eq!(viewer.clone().with_bind(None), ShowIn::Viewer(LOOPBACK));
        let all = IpAddr::V4(Ipv4Addr::UNSPECIFIED);
        assert_eq!(viewer.with_bind(Some(all)), ShowIn::Viewer(all));
        let Ok(file) = "fit.rrd".parse::<ShowIn>();
        assert_eq!(file.with_bind(Some(all)), ShowIn::File("fit.rrd".into()));
    }
}
