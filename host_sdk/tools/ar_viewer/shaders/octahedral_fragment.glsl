// A face of a level of the environment map: radiance(d, roughness) of the descriptor's octahedral map
// (lightwell/environment.hpp), times a factor, plus a constant.
uniform sampler2D map_texels;  // The texels of all levels in the order of the map, row by row.
uniform ivec2 edges, first_texels;  // Of the two levels between which the roughness is.
uniform float upper_share;
uniform mat3 map_world, world_face;
uniform int face_edge;
uniform float factor;
uniform vec3 constant;

out vec4 color;

vec3 texel(int level, int i, int j) {
  int edge = edges[level];
  // Beyond an edge of the square the sphere continues at the same edge with the order of texels reversed.
  if (i < 0 || i >= edge) {
    i = i < 0 ? -1 - i : 2 * edge - 1 - i;
    j = edge - 1 - j;
  }
  if (j < 0 || j >= edge) {
    j = j < 0 ? -1 - j : 2 * edge - 1 - j;
    i = edge - 1 - i;
  }
  int k = first_texels[level] + j * edge + i, width = textureSize(map_texels, 0).x;
  return texelFetch(map_texels, ivec2(k % width, k / width), 0).rgb;
}

vec3 bilinear(int level, vec2 uv) {
  vec2 at = uv * float(edges[level]) - 0.5, corner = floor(at), f = at - corner;
  int i = int(corner.x), j = int(corner.y);
  return mix(mix(texel(level, i, j), texel(level, i + 1, j), f.x), mix(texel(level, i, j + 1), texel(level, i + 1, j + 1), f.x),
             f.y);
}

void main() {
  vec2 on_face = 2.0 * gl_FragCoord.xy / float(face_edge) - 1.0;
  vec3 d = map_world * (world_face * vec3(on_face, 1.0));
  vec2 p = d.xz / (abs(d.x) + abs(d.y) + abs(d.z));
  if (d.y < 0.0) p = (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
  vec2 uv = 0.5 * (p + 1.0);
  vec3 radiance = bilinear(0, uv);
  if (upper_share > 0.0) radiance = mix(radiance, bilinear(1, uv), upper_share);
  color = vec4(radiance * factor + constant, 1.0);
}
