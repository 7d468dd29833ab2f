in vec3 at, facing, along;
in vec2 texel;
in float handedness;
#ifdef VERTEX_LIGHTING
in vec3 lit;
#endif

uniform vec3 eye;
uniform sampler2D color_texture;   // Linear after sampling; white where the material has none.
uniform sampler2D normal_texture;
uniform float normal_scale;        // 0: no normal map.

out vec4 color;

void main() {
#ifdef VERTEX_LIGHTING
  color = vec4(lit, 1.0);
#else
  // Towards the eye also on the back of a surface without thickness.
  vec3 plane = normalize(cross(dFdx(at), dFdy(at)));
  if (dot(plane, eye - at) < 0.0) plane = -plane;
  vec3 n = normalize(facing);
  if (dot(n, plane) < 0.0) n = -n;
  vec3 u = normalize(along - n * dot(n, along));
  if (normal_scale > 0.0) {
    vec3 t = texture(normal_texture, texel).xyz * 2.0 - 1.0;
    n = normalize(normal_scale * (t.x * u + t.y * handedness * cross(n, u)) + t.z * n);
    u = normalize(u - n * dot(n, u));
  }
  color = vec4(shade(at, n, plane, u, eye, base_color * texture(color_texture, texel).rgb), 1.0);
#endif
}
