//! Vertices that levels have in common with their source, stored once.
//!
//! Surfaces of the source over the same accessors, and the levels of these, become one pool: the
//! vertices of the coarsest level first, then what each finer level adds, and last what only the source
//! has. So a level reads a prefix of the pool, by accessors of its own length over the same buffer views,
//! and who streams a file needs no more than that prefix for it.
//!
//! A level's vertex is one of the source's if all that it carries is the same to the bit, but for −0;
//! normals may be a rounding apart, and of vertices that differ in tangents alone the one of the same
//! side and the nearest tangent is taken. What is not of the source, as everything that a polish has
//! moved, joins the pool as a vertex of its own. A pool that would not make the file smaller is not made.

mod columns;

use rustc_hash::{FxHashMap, FxHashSet};
use serde_json::{Value, json};

use crate::document::accessor::{self, Elements, Named};
use crate::document::asset::Asset;
use crate::document::edit::{Packer, index_size};
use crate::document::primitive::{Attributes, Primitive};
use crate::document::references::replaced_accessors;
use crate::error::Result;
use crate::level::AssetLevel;
use crate::level::part::LevelPart;
use columns::Columns;

/// The largest difference in components of a normal that was read, made a unit vector and rounded:
/// 0.06°.
const SAME_NORMAL: f32 = 1e-3;

/// A primitive of the source: its mesh, and its place there.
type Place = [usize; 2];

/// The pools of a document.
#[derive(Default)]
pub(crate) struct Shared {
    pools: Vec<Pool>,
    /// Accessors of the source that nothing refers to once the pools are there.
    pub(crate) replaced: Vec<usize>,
}

/// The primitives of levels over a pool instead of their own vertices: by level, mesh and place.
pub(crate) type SharedParts = FxHashMap<(usize, Place), Value>;

impl Shared {
    /// Finds the vertices that levels share with their source.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) if the document's accessors are malformed.
    pub(crate) fn find(asset: &Asset, levels: &[AssetLevel<'_>]) -> Result<Self> {
        let mut pools = Vec::new();
        for members in members(levels) {
            let places: FxHashSet<Place> = members.iter().map(Member::place).collect();
            let is_own = |primitive: &Primitive| places.contains(&place(primitive));
            let freed = replaced_accessors(asset, is_own)?;
            if let Some(pool) = Builder::new(asset, members)?.build()
                && pool.is_smaller(asset, &freed)?
            {
                pools.push(pool);
            }
        }
        let places: FxHashSet<Place> =
            pools.iter().flat_map(|pool| pool.sources.iter().map(|(own, _)| *own)).collect();
        let replaced = replaced_accessors(asset, |primitive| places.contains(&place(primitive)))?;
        Ok(Self { pools, replaced })
    }

    /// Writes the pools, and lets the source read them.
    pub(crate) fn write(&self, packer: &mut Packer) -> SharedParts {
        let mut parts = SharedParts::default();
        for pool in &self.pools {
            pool.write(packer, &mut parts);
        }
        parts
    }
}

fn place(primitive: &Primitive) -> Place {
    [primitive.mesh, primitive.index]
}

/// A surface of the source with its levels, none where there is nothing to share.
struct Member<'a> {
    primitive: &'a Primitive,
    levels: Vec<Option<&'a LevelPart>>,
}

impl Member<'_> {
    fn place(&self) -> Place {
        place(self.primitive)
    }
}

/// The surfaces of the source, those over the same accessors together.
fn members<'a>(levels: &'a [AssetLevel<'a>]) -> Vec<Vec<Member<'a>>> {
    let Some(finest) = levels.first() else { return Vec::new() };
    let mut groups: Vec<Vec<Member<'a>>> = Vec::new();
    let mut known: FxHashMap<(&Attributes, &Vec<Attributes>), usize> = FxHashMap::default();
    for (surface, mesh) in finest.meshes.iter().enumerate() {
        for (part, own) in mesh.geometry.parts.iter().enumerate() {
            let primitive = &own.primitive;
            let of_level =
                |level: &'a AssetLevel<'a>| level.meshes[surface].parts.as_ref()?[part].as_ref();
            let levels = levels.iter().map(of_level).collect();
            let next = groups.len();
            let key = (&primitive.attributes, &primitive.targets);
            let group = *known.entry(key).or_insert(next);
            if group == next {
                groups.push(Vec::new());
            }
            groups[group].push(Member { primitive, levels });
        }
    }
    groups
}

/// A pool as it grows.
struct Builder<'a> {
    members: Vec<Member<'a>>,
    columns: Columns,
    /// The source's indices, one list per member.
    sources: Vec<Vec<u32>>,
    /// Vertices by their keys.
    known: FxHashMap<Vec<u8>, Vec<u32>>,
}

impl<'a> Builder<'a> {
    fn new(asset: &Asset, members: Vec<Member<'a>>) -> Result<Self> {
        let columns = Columns::of_source(asset, members[0].primitive)?;
        let sources = members.iter().map(|member| {
            let at = format!("{}/indices", member.primitive.at);
            match member.primitive.indices {
                Some(index) => accessor::read(asset, index, &at)?.indices(&at),
                None => Ok((0..columns.count() as u32).collect()),
            }
        });
        let sources = sources.collect::<Result<_>>()?;
        let mut known: FxHashMap<Vec<u8>, Vec<u32>> = FxHashMap::default();
        for vertex in 0..columns.count() {
            known.entry(columns.key(vertex)).or_default().push(vertex as u32);
        }
        Ok(Self { members, columns, sources, known })
    }

    /// The pool, if any level can be a part of it.
    fn build(mut self) -> Option<Pool> {
        let mut parts = Vec::new();
        let members = std::mem::take(&mut self.members);
        for member in &members {
            for (level, part) in member.levels.iter().enumerate() {
                let columns = part.and_then(|part| Some((part, self.columns.of_level(part)?)));
                let Some((part, columns)) = columns else { continue };
                let vertices: Vec<u32> =
                    (0..columns.count()).map(|vertex| self.find(&columns, vertex)).collect();
                let indices: Vec<u32> =
                    part.indices.iter().map(|&index| vertices[index as usize]).collect();
                parts.push(Part { level, place: member.place(), own: columns.count(), indices });
            }
        }
        let sources = members.iter().map(Member::place).collect();
        (!parts.is_empty()).then(|| self.order(sources, parts))
    }

    /// The number of a level's vertex in the pool.
    fn find(&mut self, level: &Columns, vertex: usize) -> u32 {
        let near = |own: &[f32], other: &[f32]| {
            own.iter().zip(other).all(|(a, b)| (a - b).abs() <= SAME_NORMAL)
        };
        let [normal, tangent] = ["NORMAL", "TANGENT"].map(|name| level.row(name, vertex));
        let agreement = |&own: &u32| -> Option<f32> {
            let row = |name| self.columns.row(name, own as usize);
            if let (Some(a), Some(b)) = (&normal, row("NORMAL"))
                && !near(a, &b)
            {
                return None;
            }
            let (Some(a), Some(b)) = (&tangent, row("TANGENT")) else { return Some(0.0) };
            let cosine: f32 = a[..3].iter().zip(&b[..3]).map(|(a, b)| a * b).sum();
            (a[3] * b[3] > 0.0 && cosine.is_finite()).then_some(cosine)
        };
        let key = level.key(vertex);
        let candidates = self.known.get(&key).map(Vec::as_slice).unwrap_or_default();
        let scored = candidates.iter().filter_map(|own| Some((agreement(own)?, *own)));
        // The first of the best.
        let best = scored.reduce(|best, next| if next.0 > best.0 { next } else { best });
        if let Some((_, own)) = best {
            return own;
        }
        let new = self.columns.count() as u32;
        self.columns.append(level, vertex);
        self.known.entry(key).or_default().push(new);
        new
    }

    /// Brings the vertices into their order: what the coarsest level reads, as it names them, then what
    /// each finer one adds.
    fn order(self, sources: Vec<Place>, mut parts: Vec<Part>) -> Pool {
        let count = self.columns.count();
        let mut places: Vec<Option<u32>> = vec![None; count];
        let mut order: Vec<u32> = Vec::with_capacity(count);
        let mut put = |vertices: &mut dyn Iterator<Item = u32>, order: &mut Vec<u32>| {
            for vertex in vertices {
                places[vertex as usize].get_or_insert_with(|| {
                    order.push(vertex);
                    order.len() as u32 - 1
                });
            }
        };
        let levels = parts.iter().map(|part| part.level + 1).max().unwrap_or_default();
        let mut prefixes = vec![0; levels];
        for level in (0..levels).rev() {
            for part in parts.iter().filter(|part| part.level == level) {
                put(&mut part.indices.iter().copied(), &mut order);
            }
            prefixes[level] = order.len();
        }
        put(&mut (0..count as u32), &mut order);
        let place = |&vertex: &u32| places[vertex as usize].unwrap_or_default();
        for part in &mut parts {
            part.indices = part.indices.iter().map(place).collect();
        }
        let sources = sources.into_iter().zip(&self.sources);
        let sources =
            sources.map(|(own, indices)| (own, indices.iter().map(place).collect())).collect();
        Pool { columns: self.columns.reordered(&order), prefixes, parts, sources }
    }
}

/// A level's primitive over a pool.
struct Part {
    level: usize,
    place: Place,
    /// Number of its vertices without a pool.
    own: usize,
    indices: Vec<u32>,
}

/// Vertices, and the parts that read them.
struct Pool {
    columns: Columns,
    /// One per level: how many of the first vertices it reads.
    prefixes: Vec<usize>,
    parts: Vec<Part>,
    /// The source's indices.
    sources: Vec<(Place, Vec<u32>)>,
}

impl Pool {
    /// Whether a file with the pool is smaller than one without, in which each level has vertices of its
    /// own. `freed` are the source's accessors that go for the pool.
    fn is_smaller(&self, asset: &Asset, freed: &[usize]) -> Result<bool> {
        let size = self.columns.size();
        let own = |part: &Part| {
            part.own * size + part.indices.len() * index_size(part.own.saturating_sub(1) as u32)
        };
        let indices = |indices: &Vec<u32>| {
            indices.len() * index_size(indices.iter().copied().max().unwrap_or_default())
        };
        let apart: usize = self.parts.iter().map(own).sum();
        let stored = |own: &usize| accessor::stored_bytes(asset, &format!("/accessors/{own}"));
        let before = apart + freed.iter().map(stored).sum::<Result<usize>>()?;
        let lists = self.parts.iter().map(|part| &part.indices);
        let lists = lists.chain(self.sources.iter().map(|(_, list)| list)).map(indices);
        Ok(self.columns.count() * size + lists.sum::<usize>() < before)
    }

    fn write(&self, packer: &mut Packer, parts: &mut SharedParts) {
        let views: Vec<usize> =
            self.columns.all().map(|(_, elements)| packer.add_shared_view(elements)).collect();
        let mut lists: FxHashMap<&Vec<u32>, usize> = FxHashMap::default();
        let mut list = |packer: &mut Packer, indices| {
            *lists.entry(indices).or_insert_with(|| packer.add_indices(indices))
        };
        let whole = self.geometry(packer, &views, self.columns.count());
        for ([mesh, index], indices) in &self.sources {
            let indices = list(packer, indices);
            let at = format!("/meshes/{mesh}/primitives/{index}");
            if let Some(json) = packer.json().pointer_mut(&at) {
                apply(json, &whole, indices);
            }
        }
        let prefixes = self.prefixes.iter();
        let geometries: Vec<Value> =
            prefixes.map(|&count| self.geometry(packer, &views, count)).collect();
        for part in &self.parts {
            let mut json = json!({});
            apply(&mut json, &geometries[part.level], list(packer, &part.indices));
            parts.insert((part.level, part.place), json);
        }
    }

    /// The accessors of so many of the first vertices.
    fn geometry(&self, packer: &mut Packer, views: &[usize], count: usize) -> Value {
        let mut views = views.iter();
        let mut add = |named: &[Named]| {
            let columns = named.iter().zip(views.by_ref());
            let add = |((name, elements), &view): (&Named, &usize)| {
                let first = Elements {
                    bytes: elements.bytes[..count * elements.size()].to_vec(),
                    ..*elements
                };
                (name.clone(), json!(packer.add_elements(view, &first, name == "POSITION")))
            };
            Value::Object(columns.map(add).collect())
        };
        let mut json = json!({"attributes": add(&self.columns.attributes)});
        if !self.columns.targets.is_empty() {
            json["targets"] = self.columns.targets.iter().map(|own| add(own)).collect();
        }
        json
    }
}

/// Puts accessors into a primitive.
fn apply(primitive: &mut Value, geometry: &Value, indices: usize) {
    for (key, value) in geometry.as_object().into_iter().flatten() {
        primitive[key] = value.clone();
    }
    primitive["indices"] = json!(indices);
}
