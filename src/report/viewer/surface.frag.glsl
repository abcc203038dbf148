// The color of a point of a surface, in one of several shadings. Output: linear light.

const int LIT = 0, BASE_COLOR = 1, NORMALS = 2, FLAT = 3, SMOOTH = 4, TRIANGLES = 5, CHARTS = 6,
  CHECKER = 7, DISTANCE = 8;
// Slots of textures.
const int BASE = 0, PACKED = 1, NORMAL = 2, OCCLUSION = 3, EMISSIVE = 4;
const vec3 CLAY = vec3(0.42);

uniform int u_shading;
uniform bool u_wireframe;
uniform vec3 u_eye;
uniform vec3 u_to_key;

uniform vec4 u_base_color;
uniform float u_metallic;
uniform float u_roughness;
uniform float u_normal_scale;
uniform float u_occlusion_strength;
uniform vec3 u_emissive;
uniform int u_alpha_mode; // 0 opaque, 1 masked, 2 blended
uniform float u_alpha_cutoff;
uniform bool u_unlit;
uniform bool u_has_normal_map;
uniform bool u_has_uv;

uniform sampler2D u_texture_0;
uniform sampler2D u_texture_1;
uniform sampler2D u_texture_2;
uniform sampler2D u_texture_3;
uniform sampler2D u_texture_4;
uniform int u_uv_set[5];
uniform mat2 u_uv_matrix[5];
uniform vec2 u_uv_offset[5];

in vec3 v_position;
in vec3 v_normal;
in vec4 v_tangent;
in vec4 v_uvs;
in vec4 v_color;
in vec3 v_edges;
in float v_value;
flat in int v_triangle;
flat in float v_flat_value;

out vec4 out_color;

vec2 uv_of(int slot) {
  return u_uv_matrix[slot] * (u_uv_set[slot] == 0 ? v_uvs.xy : v_uvs.zw) + u_uv_offset[slot];
}

vec3 unit_or(vec3 direction, vec3 otherwise) {
  float squared = dot(direction, direction);
  return squared > 0.0 ? direction * inversesqrt(squared) : otherwise;
}

vec3 flat_normal(vec3 to_eye) {
  vec3 normal = unit_or(cross(dFdx(v_position), dFdy(v_position)), to_eye);
  return dot(normal, to_eye) < 0.0 ? -normal : normal;
}

/** The normal before the map or after it, towards the side that is seen. */
vec3 shading_normal(vec3 to_eye, bool mapped) {
  vec3 normal = v_normal;
  if (mapped && u_has_normal_map) {
    vec3 lean = (texture(u_texture_2, uv_of(NORMAL)).xyz * 2.0 - 1.0) * vec3(u_normal_scale, u_normal_scale, 1.0);
    // The sign is the same all over a triangle.
    vec3 bitangent = cross(v_normal, v_tangent.xyz) * (v_tangent.w < 0.0 ? -1.0 : 1.0);
    normal = v_tangent.xyz * lean.x + bitangent * lean.y + v_normal * lean.z;
  }
  return unit_or(gl_FrontFacing ? normal : -normal, to_eye);
}

vec3 lit(vec3 base, vec3 to_eye) {
  if (u_unlit) return base;
  vec4 packed = texture(u_texture_1, uv_of(PACKED));
  float occlusion = 1.0 + u_occlusion_strength * (texture(u_texture_3, uv_of(OCCLUSION)).r - 1.0);
  Surface surface = Surface(base, clamp(u_metallic * packed.b, 0.0, 1.0), clamp(u_roughness * packed.g, 0.0, 1.0),
    clamp(occlusion, 0.0, 1.0), shading_normal(to_eye, true), to_eye);
  return reflect_light(surface, u_to_key) + u_emissive * texture(u_texture_4, uv_of(EMISSIVE)).rgb;
}

vec3 clay(vec3 color, vec3 normal, vec3 to_eye) {
  return reflect_light(Surface(color, 0.0, 0.75, 1.0, normal, to_eye), u_to_key);
}

/** Squares of a sixteenth of the image, tinted by their place in it. */
vec3 checker() {
  if (!u_has_uv) return vec3(0.5);
  vec2 uv = uv_of(BASE);
  vec2 at = uv * 16.0;
  vec2 width = max(fwidth(at), 1e-6);
  // The box over a pixel of the square wave, so that far squares turn gray and do not shimmer.
  vec2 wave = (abs(fract((at - 0.5 * width) * 0.5) - 0.5) - abs(fract((at + 0.5 * width) * 0.5) - 0.5)) * 2.0 / width;
  float light = 0.55 + 0.25 * clamp(wave.x, -1.0, 1.0) * clamp(wave.y, -1.0, 1.0);
  vec2 place = fract(uv);
  return light * mix(vec3(1.0), vec3(place.x, 0.75 - 0.5 * place.x * place.y, place.y), 0.45);
}

/** How much of a pixel the edges of its triangle cover; less where triangles are too small to be told apart. */
float edge_share() {
  vec3 width = fwidth(v_edges);
  vec3 pixels = v_edges / max(width, 1e-6);
  float line = 1.0 - smoothstep(0.35, 1.25, min(pixels.x, min(pixels.y, pixels.z)));
  float largest = max(width.x, max(width.y, width.z));
  return line * clamp(1.4 - 1.6 * largest, 0.12, 1.0);
}

vec3 shade(vec3 base, vec3 to_eye) {
  if (u_shading == LIT) return lit(base, to_eye);
  if (u_shading == BASE_COLOR) return base;
  if (u_shading == NORMALS) return to_linear(0.5 + 0.5 * shading_normal(to_eye, true));
  if (u_shading == FLAT) return clay(CLAY, flat_normal(to_eye), to_eye);
  vec3 smooth_normal = shading_normal(to_eye, false);
  if (u_shading == SMOOTH) return clay(CLAY, smooth_normal, to_eye);
  if (u_shading == TRIANGLES) return clay(to_linear(color_of_number(v_triangle)), flat_normal(to_eye), to_eye);
  vec3 color = u_shading == CHARTS ? color_of_number(int(v_flat_value + 0.5))
    : u_shading == CHECKER ? checker() : color_of_share(v_value);
  return clay(to_linear(color), smooth_normal, to_eye) * 1.15;
}

void main() {
  vec4 base = u_base_color * v_color * texture(u_texture_0, uv_of(BASE));
  if (u_alpha_mode == 1 && base.a < u_alpha_cutoff) discard;
  if (u_alpha_mode == 2 && base.a < 1.0 / 255.0) discard;
  vec3 to_eye = unit_or(u_eye - v_position, vec3(0.0, 0.0, 1.0));
  vec3 color = clamp(shade(base.rgb, to_eye), 0.0, 1.0);
  bool is_glass = u_alpha_mode == 2 && u_shading <= BASE_COLOR;
  float alpha = is_glass ? clamp(base.a, 0.0, 1.0) : 1.0;
  if (u_wireframe) {
    float share = 0.85 * edge_share();
    vec3 line = dot(color, vec3(0.2126, 0.7152, 0.0722)) > 0.09 ? vec3(0.004) : vec3(0.75);
    color = mix(color, line, share);
    alpha = max(alpha, share);
  }
  out_color = vec4(color, alpha);
}
