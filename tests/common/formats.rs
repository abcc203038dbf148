//! Shapes as OBJ, PLY and OFF.

use std::fmt::Write;

use super::shapes::Shape;

/// An OBJ of a shape, its faces with the material `material`.
pub(crate) fn obj(shape: &Shape, material: &str) -> String {
    let mut text = String::from("# a shape\nmtllib shape.mtl\no shape\n");
    for [x, y, z] in &shape.positions {
        writeln!(text, "v {x} {y} {z}").expect("a text");
    }
    for [u, v] in &shape.uvs {
        writeln!(text, "vt {u} {}", 1.0 - v).expect("a text");
    }
    for [x, y, z] in &shape.normals {
        writeln!(text, "vn {x} {y} {z}").expect("a text");
    }
    writeln!(text, "usemtl {material}").expect("a text");
    for triangle in &shape.triangles {
        let [a, b, c] = triangle.map(|corner| corner + 1);
        writeln!(text, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}").expect("a text");
    }
    text
}

/// The encodings of a PLY.
pub(crate) const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

/// Numbers of a PLY in one of its encodings.
struct Numbers<'a> {
    encoding: &'a str,
    bytes: Vec<u8>,
}

impl Numbers<'_> {
    fn put(&mut self, text: &impl ToString, little: &[u8], big: &[u8]) {
        match self.encoding {
            "ascii" => self.bytes.extend(format!("{} ", text.to_string()).bytes()),
            "binary_big_endian" => self.bytes.extend(big),
            _ => self.bytes.extend(little),
        }
    }

    fn float(&mut self, x: f32) {
        self.put(&x, &x.to_le_bytes(), &x.to_be_bytes());
    }

    fn int(&mut self, x: i32) {
        self.put(&x, &x.to_le_bytes(), &x.to_be_bytes());
    }

    fn byte(&mut self, x: u8) {
        self.put(&x, &[x], &[x]);
    }

    fn end_row(&mut self) {
        if self.encoding == "ascii" {
            self.bytes.push(b'\n');
        }
    }
}

/// A PLY of a shape with normals, UVs and the colors of [`ply_color`].
pub(crate) fn ply(shape: &Shape, encoding: &str, comment: &str) -> Vec<u8> {
    let float = |names: &str| -> String {
        names.split(' ').map(|name| format!("property float {name}\n")).collect()
    };
    let header = format!(
        "ply\nformat {encoding} 1.0\n{comment}element vertex {}\n{}{}element face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        shape.positions.len(),
        float("x y z nx ny nz s t"),
        "property uchar red\nproperty uchar green\nproperty uchar blue\n",
        shape.triangles.len()
    );
    let mut numbers = Numbers { encoding, bytes: header.into_bytes() };
    for (at, position) in shape.positions.iter().enumerate() {
        let [u, v] = shape.uvs[at];
        position.iter().chain(&shape.normals[at]).for_each(|&x| numbers.float(x));
        [u, 1.0 - v].into_iter().for_each(|x| numbers.float(x));
        ply_color(at).into_iter().for_each(|x| numbers.byte(x));
        numbers.end_row();
    }
    for triangle in &shape.triangles {
        numbers.byte(3);
        triangle.iter().for_each(|&corner| numbers.int(corner as i32));
        numbers.end_row();
    }
    numbers.bytes
}

/// The color of a vertex, as sRGB bytes.
pub(crate) fn ply_color(vertex: usize) -> [u8; 3] {
    [(vertex * 7 % 256) as u8, 128, 255]
}

/// An OFF of a shape with normals and UVs.
pub(crate) fn off(shape: &Shape) -> String {
    let counts = [shape.positions.len(), shape.triangles.len()];
    let mut text = format!("STNOFF # a shape\n\n{} {} 0\n", counts[0], counts[1]);
    for (at, [x, y, z]) in shape.positions.iter().enumerate() {
        let ([nx, ny, nz], [u, v]) = (shape.normals[at], shape.uvs[at]);
        writeln!(text, "{x} {y} {z} {nx} {ny} {nz} {u} {}", 1.0 - v).expect("a text");
    }
    for [a, b, c] in &shape.triangles {
        writeln!(text, "3 {a} {b} {c} # a face").expect("a text");
    }
    text
}
