//! The extension `SEAMWISE_progressive_mesh`, as somebody needs it who writes a reader.
//!
//! # What it is
//!
//! A .glb whose plain content is the coarsest level of an asset, valid for any reader, with the vertex
//! splits (Hoppe, "Progressive meshes", SIGGRAPH 1996) that lead from it to the source in the last buffer
//! view, at the end of the binary chunk. A prefix of them leads to a level between. The extension is listed
//! in `extensionsUsed` and never in `extensionsRequired`. A reader starts from nothing: the coarsest level is
//! told again at the head of the splits, with what is its own.
//!
//! A *point* is a position; a *wedge* is what a vertex has at a point, and belongs to one group: a
//! primitive. Points, wedges and triangles are numbered from 0 as they come, in each surface.
//!
//! # The object
//!
//! `extensions.SEAMWISE_progressive_mesh` of the document:
//!
//! | key | |
//! |---|---|
//! | `version` | 2 |
//! | `bufferView` | the view of the splits, the last of the document |
//! | `triangles` | those of the coarsest level, and of the source |
//! | `splits` | number of splits from the one to the other |
//! | `error` | the error of the coarsest level: root of the largest area-weighted cost, in the units of the meshes |
//! | `surfaces` | the surfaces |
//!
//! A surface has `uvSets`, `normal` and `color`: its wedges have a row of floats each, two for each UV set,
//! three if there are normals, and so many of `COLOR_0`. `position` and the entries of `row`, one for each
//! float, say how values are told: `step` and, if there is one, `grid`. `parts` are its primitives, a group
//! each: `mesh` and `primitive` name it in the document; `attributes` and `targets` are its attributes and
//! those of its morph targets, as `name`, `componentType`, `components`, `normalized`; `matrix`, if it is
//! there, brings positions and normals of the surface to those of the mesh. `POSITION`, `NORMAL`, `COLOR_0`
//! and `TEXCOORD_n` for n below `uvSets` are made of positions and rows; all others, `TANGENT` among them, and
//! those of morph targets, are *carried*: each wedge has their elements, one after the other.
//!
//! # Blocks
//!
//! The view holds blocks: a 32-bit length of the payload, the CRC-32 (of zlib) of the payload, both
//! little-endian, and the payload: for each column its length and, unless that is 0, the length of its
//! packed bytes and these; a packed length of 0 says that the column is stored as it is. Packed is raw
//! DEFLATE (RFC 1951). These lengths and all *numbers* are in groups of seven bits, the least first, with the
//! eighth bit set in all but the last. The first block is the coarsest level: a split of each surface in turn,
//! without step, error and count. Then come blocks of steps, and behind the last split the block of what the
//! source has beyond (see below). A block that is not whole, or whose checksum differs, ends what can be read.
//!
//! | column | |
//! |---|---|
//! | 0 | step: twice the surface; and 1 if it is taken back from a level |
//! | 1 | triangles that a split brings |
//! | 2 | by how much the bits of the error, as a 32-bit float, fall |
//! | 3 | the point that splits and 1; 0 for none |
//! | 4 | points of the wedges that are at it |
//! | 5 | wedges of the corners that are at it |
//! | 6 | groups of new triangles |
//! | 7 | wedges of their corners |
//! | 8 | points of new wedges |
//! | 9 | points and wedges by their numbers |
//! | 10, 11 | a byte each, how a position, or a row, is told: 0 to a step, 1 exactly, being the source's, 2 as it was told before |
//! | 12 | splits from a level to the one before it |
//! | 13 + 5 i | coordinate i: four columns for the bytes of exact values, the least first, and one of steps |
//! | 28 + 5 i | float i of rows, likewise |
//! | from 28 + 5 w | carried bytes, a column for each byte, group by group and surface by surface; w is the longest row |
//!
//! # A split
//!
//! 1. Take the corners at the point that splits, in their order there; their wedges in the order of the
//!    corners, each once, are the *moved* ones; the other two corners of each corner's triangle, in their
//!    order after it, give the *ring* of wedges and of points, each once.
//! 2. Each moved wedge gets a point by column 4.
//! 3. Each corner keeps its wedge (0 in column 5), gets a new one (1), whose point column 8 has, or the new one of
//!    this split of number symbol − 2.
//! 4. Each new triangle has a group and three wedges: a new one (0), one by its number in column 9 (1), or, with k
//!    = (symbol − 2) / 3 and r its remainder, the k-th moved one (r = 0), the k-th new one of this split
//!    (1), the k-th of the ring (2).
//! 5. A point is the one that splits (0), a new one (1), one by its number in column 9 (2), or, with k =
//!    (symbol − 3) / 2 and r its remainder, the k-th new one of this split (0), the k-th of the ring (1).
//! 6. The corners that were at the point go, in their order, to the points of their wedges, then those of
//!    the new triangles.
//! 7. Values follow: the position of the point that splits, expected where it was, p; those of new points, the
//!    first expected at 2 p minus its new position, all others at p, or at the point before if none splits;
//!    the rows of moved wedges, expected as they were; those of new wedges with what they carry. A
//!    wedge that a corner got is expected at twice the row that the corner's wedge had minus the one that
//!    it has now, if that one was moved. A new wedge of a new triangle is expected to be like the wedge of the
//!    corner before it in that triangle; of the first, like the first moved wedge if that is of the same group, else
//!    zero. Carried bytes are differences to those of the same wedge.
//!
//! # Values
//!
//! A point or wedge whose value in the source was told once has it known from then on, whatever it has in between: if
//! it comes to that value again (2 in columns 10 and 11), nothing more is told of it. The first time (1) a value of
//! the source is told by a difference d, as (d << 1) ^ (d >> 31): of the values times `grid`, rounded, if there is a
//! grid; else of the places of both floats in the order of all floats, b ^ ((b >> 31) >>> 1) of the bits b. Any other
//! value (0) is what is expected plus a number of steps, told as (d << 1) ^ (d >> 31), and a normal is then made a
//! unit vector.
//!
//! Of a normal the two that are expected to be smaller come first, in their order and in the columns of x and y, and
//! the one that is expected to be the largest, the first of equals, last and in those of z: once the others, a and
//! b, are known, it is expected at ±√(1 − a² − b²), with the sign that was expected before. `step` and `grid` are
//! those of its own.
//!
//! # Levels
//!
//! Where a surface is taken back from a level (an odd step), all its points and then all its wedges get
//! other values, expected at those they have; column 12 has the number n of its splits to the next such
//! step. After k of those, 0 < k < n, the surface is to be shown moved towards the level: each point by
//! (n − k) / n of what the point that it came from was moved by in this step, and rows likewise; a new
//! point came from the one that split, a wedge that a corner got from the wedge that the corner had. That makes the
//! way from level to level continuous, and each level what it was when it was made.
//!
//! # What the source has beyond
//!
//! Once all splits are done, a block of two columns follows. For each part there are, in column 0, numbers of
//! vertices, of corners and of corners of further triangles; for each corner the difference of its place
//! among the part's indices to the one before, and the vertex that it has; then the vertices of further corners.
//! Column 1 holds the vertices: elements of all attributes as they come out, floats where they are made of
//! positions and rows. So tangents that differ at one wedge and triangles without area come back.
//!
//! # Order
//!
//! With all splits done the source is there triangle for triangle and attribute for attribute. Triangles of a
//! primitive are in the order in which they came, each with its corners in their order; vertices in the
//! order in which those name them first, equal ones once. Vertices that no triangle names are gone.

/// The name of the extension.
pub const EXTENSION: &str = "SEAMWISE_progressive_mesh";

/// The version of the format that is read and written.
pub(super) const VERSION: u32 = 2;
