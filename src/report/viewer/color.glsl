// Between light and the numbers of a screen, and colors for numbers.

vec3 to_linear(vec3 srgb) {
  return mix(srgb / 12.92, pow((srgb + 0.055) / 1.055, vec3(2.4)), step(0.04045, srgb));
}

vec3 to_srgb(vec3 linear) {
  return mix(linear * 12.92, 1.055 * pow(max(linear, 0.0), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, linear));
}

/** A colour, in sRGB, for each whole number, unlike those of its neighbours. */
vec3 color_of_number(int number) {
  uint hash = uint(number + 1) * 2654435761u;
  hash = (hash ^ (hash >> 15)) * 2246822519u;
  hash ^= hash >> 13;
  float hue = float(hash & 1023u) / 1024.0;
  float light = 0.62 + 0.3 * float((hash >> 10) & 255u) / 255.0;
  vec3 wheel = clamp(abs(fract(hue + vec3(0.0, 2.0, 1.0) / 3.0) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
  return mix(vec3(1.0), wheel, 0.55) * light;
}

/** A colour, in sRGB, for a share of the most: the legend of the page has the same. */
vec3 color_of_share(float share) {
  const vec3 stops[5] = vec3[5](
    vec3(0.169, 0.361, 0.541), vec3(0.431, 0.706, 0.643), vec3(0.961, 0.918, 0.722),
    vec3(0.910, 0.522, 0.239), vec3(0.647, 0.059, 0.149));
  float at = clamp(share, 0.0, 1.0) * 4.0;
  int stop = min(int(at), 3);
  return mix(stops[stop], stops[stop + 1], at - float(stop));
}
