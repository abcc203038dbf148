//! The plain lists that a primitive is made of.

/// Positions and attributes of a primitive's vertices; the list of an attribute that they lack is empty.
#[derive(Clone, Debug, Default)]
pub(super) struct Vertices {
    /// Not finite where no face is.
    pub(super) positions: Vec<[f64; 3]>,
    /// Of unit length; NaN where they are to be computed from the faces.
    pub(super) normals: Vec<[f32; 3]>,
    /// Counting downward.
    pub(super) uvs: Vec<[f32; 2]>,
    /// In linear light.
    pub(super) colors: Vec<[f32; 4]>,
}

/// Triangles of one material.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    pub(super) vertices: Vertices,
    pub(super) triangles: Vec<u32>,
    /// Its number in the document; matte and white if there is none.
    pub(super) material: Option<usize>,
}

impl Part {
    /// Whether a corner of a face has a place.
    pub(super) fn is_placed(position: &[f64; 3]) -> bool {
        position.iter().all(|x| x.is_finite())
    }

    /// Drops the vertices that are nowhere; no face has them.
    pub(super) fn drop_unplaced(&mut self) {
        let Vertices { positions, normals, uvs, colors } = &mut self.vertices;
        let placed: Vec<bool> = positions.iter().map(Self::is_placed).collect();
        if !placed.contains(&false) {
            return;
        }
        let mut count = 0;
        let number = |&is_placed: &bool| {
            count += u32::from(is_placed);
            count.saturating_sub(1)
        };
        let numbers: Vec<u32> = placed.iter().map(number).collect();
        self.triangles.iter_mut().for_each(|vertex| *vertex = numbers[*vertex as usize]);
        fn keep<T>(list: &mut Vec<T>, placed: &[bool]) {
            let mut own = placed.iter();
            list.retain(|_| own.next().copied().unwrap_or(false));
        }
        keep(positions, &placed);
        keep(normals, &placed);
        keep(uvs, &placed);
        keep(colors, &placed);
    }
}
