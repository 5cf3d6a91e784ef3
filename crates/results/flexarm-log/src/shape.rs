//! Sizes of a sample as given by the header, and the check of a sample.
//!
//! Start at [`Shape::of`]. Not here: names and order of columns (`table.rs`).

use std::path::Path;

use crate::{LogError, RunHeader, Sample, TwinSample};

/// Numbers of entries of every sample of a run.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    joints: usize,
    links: usize,
    elements: usize,
    stations: usize,
    contributors: usize,
    gauges: usize,
    pub(crate) has_rigid: bool,
    pub(crate) has_static: bool,
}

impl Shape {
    /// Returns the sizes of the samples that belong to a header.
    pub fn of(header: &RunHeader) -> Self {
        Self {
            joints: header.joints.len(),
            links: header.links.len(),
            elements: header.elements.len(),
            stations: header.bends.iter().map(|bend| bend.X_LS.len()).sum(),
            contributors: header.contributors.len(),
            gauges: header.gauges.len(),
            has_rigid: header.has_rigid,
            has_static: header.has_rigid && header.has_static,
        }
    }

    /// Checks the length of every list of the sample, so that the writers may index without checks.
    ///
    /// # Errors
    /// [`LogError::Shape`] for the first list of another length; `path` is the file of the message.
    pub fn check(&self, path: &Path, sample: &Sample) -> Result<(), LogError> {
        let twin = |twin: &TwinSample| {
            [
                ("q", twin.q.len(), self.joints),
                ("qdot", twin.qdot.len(), self.joints),
                ("effort", twin.effort.len(), self.joints),
                ("X_WL", twin.X_WL.len(), self.links),
            ]
        };
        let rigid = self.has_rigid.then(|| twin(&sample.rigid));
        let own = [
            ("elastic", sample.elastic.len(), self.elements),
            ("X_WS", sample.flexible.X_WS.len(), self.stations),
            ("contributions", sample.contributions.len(), self.contributors),
            ("gauges", sample.gauges.len(), self.gauges),
        ];
        let lists = twin(&sample.flexible).into_iter().chain(rigid.into_iter().flatten()).chain(own);

        for (what, found, expected) in lists {
            if found != expected {
                let (path, time_s) = (path.to_owned(), sample.time_s);
                return Err(LogError::Shape { path, time_s, what, found, expected });
            }
        }
        Ok(())
    }
}
