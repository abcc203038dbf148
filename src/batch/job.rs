//! An input of a batch.

use std::path::PathBuf;

use crate::bake::Input;
use crate::bake::baked::Record;
use crate::bake::digest::digest;
use crate::bake::input::stem;
use crate::bake::options::BakeOptions;

/// An input, and where its outputs go.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Job {
    /// The folder of the outputs.
    pub folder: PathBuf,
    /// The file.
    pub input: PathBuf,
    /// The beginning of the outputs' names: the input's stem, or its whole file name where the outputs
    /// of another input have that stem.
    pub name: String,
}

impl Job {
    /// An input whose outputs are called after its stem.
    pub fn new(folder: PathBuf, input: PathBuf) -> Self {
        Self { name: stem(&input), folder, input }
    }

    pub(super) fn source(&self) -> Input<'_> {
        Input::FileAs(&self.input, &self.name)
    }

    /// The files that it writes.
    pub fn outputs(&self, options: &BakeOptions) -> Vec<PathBuf> {
        self.source().outputs(&self.folder, options)
    }

    /// Whether its outputs are all there, whole, and those of this input, these options and this
    /// version.
    pub fn is_done(&self, options: &BakeOptions) -> bool {
        let input = self.source();
        let there = self.outputs(options).iter().all(|path| path.is_file());
        there
            && Record::read(&input.report(&self.folder)).is_some_and(|record| {
                // Textures beside a .gltf are told by the report alone.
                record.is_whole(&self.folder)
                    && digest(input, options).is_ok_and(|own| own == record.digest)
            })
    }
}
