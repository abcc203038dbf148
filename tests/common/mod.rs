//! What the tests share: small assets made in memory, temporary folders, and a reader of outputs
//! that owes nothing to the code under test.

#![allow(dead_code, reason = "each binary that takes this in uses a part of it")]

pub(crate) mod assets;
pub(crate) mod build;
pub(crate) mod files;
pub(crate) mod formats;
pub(crate) mod low_poly;
pub(crate) mod output;
pub(crate) mod pose;
pub(crate) mod rigs;
pub(crate) mod shapes;
pub(crate) mod textured;
pub(crate) mod tiffs;

use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

use seamwise::bake::options::{BakeOptions, Targets, Textures};
use seamwise::bake::{self, Input};
use seamwise::error::Result;
use seamwise::evaluate;
use seamwise::export::files::{Layout, OutputOptions};
use seamwise::progress::Progress;
use seamwise::report::BakeReport;
use seamwise::transfer::{BakeNormals, Sizes, TransferOptions};
use tempfile::TempDir;

use output::Output;

/// Real assets beside the checkout; `None`, with a message, where there are none.
pub(crate) fn shared_assets() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: ../shared/assets is absent");
    None
}

/// The checksum of a PNG chunk (ISO 3309).
pub(crate) fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        let shift = |crc: u32| if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 };
        (0..8).fold(crc ^ u32::from(byte), |crc, _| shift(crc))
    })
}

/// Numbers that are the same on every run (Vigna's splitmix64).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    pub(crate) fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }
}

/// The default options with shared textures, and a file of all levels besides.
pub(crate) fn chained() -> BakeOptions {
    let output = OutputOptions { layout: Layout::MsftLod, ..OutputOptions::default() };
    BakeOptions { output, textures: Textures::Repair, ..BakeOptions::default() }
}

/// Options that spend no time on measuring.
pub(crate) fn unmeasured() -> BakeOptions {
    BakeOptions { evaluate: None, ..chained() }
}

/// Options that make textures anew for levels of these shares of the triangles, and measure nothing.
pub(crate) fn transferred(ratios: &[f64], scale: f64, bake_normals: BakeNormals) -> BakeOptions {
    BakeOptions {
        targets: Targets::ratios(ratios.to_vec()).expect("shares from fine to coarse"),
        textures: Textures::Transfer(TransferOptions {
            sizes: Sizes::Scale(scale),
            bake_normals,
            ..TransferOptions::default()
        }),
        ..unmeasured()
    }
}

/// Options that measure roughly.
pub(crate) fn measured() -> BakeOptions {
    let evaluate = evaluate::Options {
        views: 4,
        resolution: 64,
        samples: 20_000,
        pixel_tolerance: 1.0,
        screen_height: 128,
    };
    BakeOptions { evaluate: Some(evaluate), ..chained() }
}

/// A bake and the folder it wrote into, which goes when this does.
pub(crate) struct Baked {
    pub(crate) folder: TempDir,
    pub(crate) report: BakeReport,
    pub(crate) stem: String,
}

impl Baked {
    /// Bakes an asset held in memory.
    pub(crate) fn bytes(name: &str, bytes: &[u8], options: &BakeOptions) -> Self {
        Self::input(Input::Bytes(bytes, name), options)
            .unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Bakes whatever it is given.
    pub(crate) fn input(input: Input<'_>, options: &BakeOptions) -> Result<Self> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let report = bake::bake(input, folder.path(), options, &Progress::hidden())?;
        Ok(Self { folder, report, stem: input.stem() })
    }

    /// The file of level 1, 2, …
    pub(crate) fn level_path(&self, level: usize) -> PathBuf {
        self.folder.path().join(format!("{}_lod{level}.glb", self.stem))
    }

    /// The file with the source and all levels.
    pub(crate) fn chain_path(&self) -> PathBuf {
        self.folder.path().join(format!("{}.glb", self.stem))
    }

    /// Level 1, 2, … as the gltf crate reads and validates it.
    pub(crate) fn level(&self, level: usize) -> Output {
        Output::read(&self.level_path(level))
    }

    /// All levels, the finest first.
    pub(crate) fn levels(&self) -> Vec<Output> {
        (1..=self.report.levels.len()).map(|level| self.level(level)).collect()
    }

    /// The file with the source and all levels.
    pub(crate) fn chain(&self) -> Output {
        Output::read(&self.chain_path())
    }

    /// Every file written, by name, in order.
    pub(crate) fn files(&self) -> Vec<(String, Vec<u8>)> {
        folder_files(self.folder.path())
    }
}

/// The files of a folder with their bytes, by name, in order.
pub(crate) fn folder_files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| {
            let path = entry.expect("an entry").path();
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            (name, std::fs::read(&path).expect("a file"))
        })
        .collect();
    files.sort();
    files
}

/// Runs `work`, and fails if it takes longer than `seconds` or panics.
pub(crate) fn within<T: Send + 'static>(
    seconds: u64,
    what: &str,
    work: impl FnOnce() -> T + Send + 'static,
) -> T {
    let (sender, receiver) = mpsc::channel();
    let worker = std::thread::spawn(move || {
        // The receiver is gone only if it gave up waiting.
        let _ = sender.send(work());
    });
    match receiver.recv_timeout(Duration::from_secs(seconds)) {
        Ok(result) => result,
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("{what}: not done after {seconds} s"),
        Err(mpsc::RecvTimeoutError::Disconnected) => match worker.join() {
            Err(panic) => std::panic::resume_unwind(panic),
            Ok(()) => unreachable!("a worker that ends well has sent its result"),
        },
    }
}
