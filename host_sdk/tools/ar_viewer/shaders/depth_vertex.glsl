layout(location = 0) in vec3 position;

uniform mat4 world_object;
uniform int index;

out float depth;

void main() {
  ViewerLight light = lights[index];
  vec3 q = (light.view * (world_object * vec4(position, 1.0))).xyz;
  depth = (q.z - light.map.y) / (light.map.z - light.map.y);
  bool near = light.irradiance_distance.w > 0.0;
  // Depth is linear; w divides the near light's coordinates alone.
  float w = near ? max(q.z, 1e-3 * light.map.y) : 1.0;
  gl_Position = vec4(q.xy / light.map.x, (2.0 * depth - 1.0) * w, w);
}
