#version 300 es
// A corner of a triangle, in the world already.
precision highp float;

uniform mat4 u_view_projection;

layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in vec4 a_tangent;
layout(location = 3) in vec2 a_uv;
layout(location = 4) in vec2 a_uv1;
layout(location = 5) in vec4 a_color;
// A chart's number, or a distance.
layout(location = 6) in float a_value;

out vec3 v_position;
out vec3 v_normal;
out vec4 v_tangent;
out vec4 v_uvs;
out vec4 v_color;
out vec3 v_edges;
out float v_value;
flat out int v_triangle;
flat out float v_flat_value;

void main() {
  gl_Position = u_view_projection * vec4(a_position, 1.0);
  v_position = a_position;
  v_normal = a_normal;
  v_tangent = a_tangent;
  v_uvs = vec4(a_uv, a_uv1);
  v_color = a_color;
  v_value = a_value;
  v_flat_value = a_value;
  v_triangle = gl_VertexID / 3;
  int corner = gl_VertexID % 3;
  v_edges = vec3(corner == 0, corner == 1, corner == 2);
}
