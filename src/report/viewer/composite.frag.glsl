// A picture on the screen, or where it differs from another in sRGB luminance: from black over red and
// yellow to white at WHITE, as the report draws it.

const float WHITE = 0.125;

uniform sampler2D u_picture;
uniform sampler2D u_reference;
uniform bool u_difference;

in vec2 v_at;
out vec4 out_color;

float seen(sampler2D picture) {
  return to_srgb(vec3(dot(texture(picture, v_at).rgb, vec3(0.2126, 0.7152, 0.0722)))).r;
}

void main() {
  if (u_difference) {
    float thirds = 3.0 * abs(seen(u_picture) - seen(u_reference)) / WHITE;
    out_color = vec4(clamp(thirds - vec3(0.0, 1.0, 2.0), 0.0, 1.0), 1.0);
  } else {
    out_color = vec4(to_srgb(texture(u_picture, v_at).rgb), 1.0);
  }
}
