layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;
layout(location = 3) in vec4 tangent;

uniform mat4 world_object, clip_world;
uniform mat3 world_normal;
uniform vec3 eye;

out vec3 at, facing, along;
out vec2 texel;
out float handedness;
#ifdef VERTEX_LIGHTING
out vec3 lit;
#endif

void main() {
  vec4 world = world_object * vec4(position, 1.0);
  at = world.xyz;
  facing = normalize(world_normal * normal);
  along = mat3(world_object) * tangent.xyz;
  handedness = tangent.w;
  texel = uv;
#ifdef VERTEX_LIGHTING
  vec3 n = dot(facing, eye - at) < 0.0 ? -facing : facing;
  lit = shade(at, n, n, normalize(along), eye, base_color);
#endif
  gl_Position = clip_world * world;
}
