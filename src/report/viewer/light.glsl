// The light of the tool's own renderer: glTF's metallic-roughness model (glTF 2.0 appendix B.3) under a
// key above the camera's left shoulder and a surrounding of two tones, its mirror image by the fit of
// Karis ("Physically based shading on mobile", 2014). The figures are those of `evaluate/light.rs`.

const float KEY = 0.55;
const float SKY = 0.45;
const float GROUND = 0.15;
const float DIELECTRIC = 0.04;
const float MIN_ROUGHNESS = 0.045;

struct Surface {
  vec3 base_color;
  float metallic;
  float roughness;
  float occlusion;
  vec3 normal;
  vec3 to_eye;
};

float between_tones(float t) { return mix(GROUND, SKY, t); }

float ggx(float n_half, float n_light, float n_eye, float alpha) {
  if (n_half <= 0.0) return 0.0;
  float squared = alpha * alpha;
  float denominator = n_half * n_half * (squared - 1.0) + 1.0;
  float to_light = n_light + sqrt(squared + (1.0 - squared) * n_light * n_light);
  float to_eye = n_eye + sqrt(squared + (1.0 - squared) * n_eye * n_eye);
  return squared / (denominator * denominator * to_light * to_eye);
}

vec3 environment_brdf(vec3 f0, float roughness, float n_eye) {
  float x = 1.0 - roughness;
  float a = min(x * x, exp2(-9.28 * n_eye)) * x + 0.0425 - 0.0275 * roughness;
  return max(f0 * (-1.04 * a + 1.04 - 0.572 * roughness) + (1.04 * a - 0.04 + 0.022 * roughness), 0.0);
}

/** The linear light that a point sends to the eye. `to_key`: unit; the zenith is +y. */
vec3 reflect_light(Surface s, vec3 to_key) {
  vec3 diffuse = s.base_color * (1.0 - s.metallic);
  vec3 f0 = DIELECTRIC * (1.0 - s.metallic) + s.base_color * s.metallic;
  float roughness = clamp(s.roughness, MIN_ROUGHNESS, 1.0);
  float n_eye = max(dot(s.normal, s.to_eye), 1e-4);
  float n_key = max(dot(s.normal, to_key), 0.0);
  float mirrored = 2.0 * dot(s.normal, s.to_eye) * s.normal.y - s.to_eye.y;
  float t = clamp(0.5 + 0.5 * mirrored / roughness, 0.0, 1.0);
  vec3 around = diffuse * between_tones(0.5 + 0.5 * s.normal.y)
    + environment_brdf(f0, roughness, n_eye) * between_tones(t * t * (3.0 - 2.0 * t));
  vec3 middle = to_key + s.to_eye;
  middle = dot(middle, middle) > 0.0 ? normalize(middle) : s.normal;
  float graze = pow(1.0 - clamp(dot(s.to_eye, middle), 0.0, 1.0), 5.0);
  vec3 fresnel = f0 + (1.0 - f0) * graze;
  float gloss = ggx(dot(s.normal, middle), n_key, n_eye, roughness * roughness);
  return around * s.occlusion + (diffuse * (1.0 - fresnel) + fresnel * gloss) * (KEY * n_key);
}
