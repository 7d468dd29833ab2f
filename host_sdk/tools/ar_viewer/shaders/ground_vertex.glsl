layout(location = 0) in vec2 corner;  // -1..1 along X and Z of the plane.

uniform mat4 world_plane, clip_world;
uniform vec2 half_size;

out vec3 at;
out vec2 on_plane;

void main() {
  on_plane = corner * half_size;
  vec4 world = world_plane * vec4(on_plane.x, 0.0, on_plane.y, 1.0);
  at = world.xyz;
  gl_Position = clip_world * world;
}
