// The real plane: the factor of its picture. Irradiance with the objects / irradiance without them.
in vec3 at;
in vec2 on_plane;

uniform mat4 world_plane;
uniform sampler2D residual_ratio;  // Of the residual's irradiance, over a rectangle of the plane.
uniform vec2 residual_centre;      // Its middle on the plane, m.
uniform float residual_half;       // m; 0: no texture.
uniform float strength, gain, alpha_cutoff;
uniform int alpha_test;

out vec4 factor;

void main() {
  vec3 n = normalize(world_plane[1].xyz);
  if (alpha_test != 0) {
    float visible = light_count > 0 ? visibility(0, at, n, incident(0, at)) : 1.0;
    factor = vec4(vec3(visible < alpha_cutoff ? 1.0 - strength : 1.0), 1.0);
    return;
  }
  vec3 whole = max(texture(irradiance_map, n).rgb, 0.0), left = whole;
  if (residual_half > 0.0) {
    vec2 v = (on_plane - residual_centre) / residual_half;
    float edge = max(abs(v.x), abs(v.y));
    // What the texture still darkens at its border fades out.
    vec3 ratio = texture(residual_ratio, 0.5 + 0.5 * v).rgb;
    left *= mix(ratio, vec3(1.0), smoothstep(0.8, 1.0, edge));
  }
  for (int i = 0; i < light_count; ++i) {
    Incident light = incident(i, at);
    vec3 e = light.irradiance * cap_irradiance(dot(n, light.towards), light.radius);
    whole += e;
    if (max(e.r, max(e.g, e.b)) > 0.0) left += e * visibility(i, at, n, light);
  }
  vec3 ratio = mix(vec3(1.0), left / max(whole, vec3(1e-20)), greaterThan(whole, vec3(1e-20)));
  factor = vec4(1.0 - strength * (1.0 - pow(max(ratio, 0.0), vec3(gain))), 1.0);
}
