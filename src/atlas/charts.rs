//! UV triangles of primitives, and the texels of an image that filtering inside them reads.

use glam::{Affine2, Vec2};
use seamwise_texture::{
    Footprint, MipReads, Validity, Wrap, charts_share_from, color_charts, count_reads,
};

use crate::document::asset::Asset;
use crate::document::primitive::Primitive;
use crate::error::Result;

/// The counts of texels that filtering inside charts reads.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reads {
    /// Counts at each mip level, the image first.
    pub mips: Vec<MipReads>,
    /// The first mip level with a texel made from two charts, whose colors no repair keeps apart.
    pub shared_from: Option<usize>,
}

impl Reads {
    /// A message: from which mip level on charts share texels.
    pub(crate) fn sharing(&self) -> String {
        match self.shared_from {
            Some(mip) => format!("charts share texels from mip {mip} on"),
            None => "no charts share texels".to_owned(),
        }
    }
}

/// UV triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Charts {
    /// One per vertex, after the texture's own transform.
    pub uvs: Vec<Vec2>,
    /// Indices into `uvs`.
    pub triangles: Vec<[u32; 3]>,
}

impl Charts {
    /// The charts of a primitive in a UV set, moved by `transform`; `None` if it lacks the set.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) if positions, UVs or indices are malformed.
    pub fn read(
        asset: &Asset,
        primitive: &Primitive,
        uv_set: usize,
        transform: Affine2,
    ) -> Result<Option<Self>> {
        let vertices = primitive.positions(asset)?.len();
        let name = format!("TEXCOORD_{uv_set}");
        let Some(uvs) = primitive.floats(asset, &name, 2, vertices)? else {
            return Ok(None);
        };
        let uvs =
            uvs.as_chunks().0.iter().map(|&uv| transform.transform_point2(Vec2::from_array(uv)));
        let triangles = primitive.triangles(asset, vertices)?;
        Ok(Some(Self { uvs: uvs.collect(), triangles }))
    }

    /// The counts of texels that filtering inside the charts reads of an image with this mask.
    pub fn reads(&self, validity: &Validity, wrap: [Wrap; 2], footprint: Footprint) -> Reads {
        let Self { uvs, triangles } = self;
        let size = [validity.width(), validity.height()];
        Reads {
            mips: count_reads(validity, wrap, uvs, triangles, footprint),
            shared_from: charts_share_from(size, wrap, uvs, triangles),
        }
    }

    /// Whether all of them are colors in an image of this size: see [`color_charts`].
    pub fn are_colors(&self, size: [usize; 2]) -> bool {
        let count = self.uvs.len();
        let sound = self.triangles.iter().filter(|t| t.iter().all(|&uv| (uv as usize) < count));
        let corners: Vec<_> = sound.map(|t| t.map(|uv| self.uvs[uv as usize])).collect();
        color_charts(size, &corners).iter().all(Option::is_some)
    }

    /// Adds the charts of another primitive, which share no UVs with those here.
    pub fn append(&mut self, other: Self) {
        let first = self.uvs.len() as u32;
        self.uvs.extend(other.uvs);
        self.triangles.extend(other.triangles.iter().map(|uvs| uvs.map(|uv| first + uv)));
    }
}
