// Discrete lights, their visibility, and the irradiance of a surface. World frame, metres; irradiances are times the
// exposure.
const int kMaxLights = 8;
const int kMaxCasters = 64;
const int kTaps = 64;
const float kPi = 3.14159265358979;

struct ViewerLight {
  vec4 towards_radius;       // xyz: unit direction towards it from the origin; w: angular radius there, rad.
  vec4 irradiance_distance;  // rgb: at normal incidence at the origin; w: distance from the origin, 0: distant.
  vec4 position;             // xyz of a near light; w: 1: texels of the environment map show it.
  mat4 view;                 // World to the light's axes: +Z along its travel. Origin: the middle of the objects; the near light.
  vec4 map;                  // x: half extent of the map, m (near light: tangent); y, z: least and largest depth, m; w: 0: no map.
};

layout(std140) uniform Lights {
  ViewerLight lights[kMaxLights];
  vec4 disc[kTaps];  // xy: points of the unit disc, of equal areas, in the order of a spiral.
  vec4 casters[kMaxCasters];  // Spheres around the objects: centre, radius.
  int light_count, caster_count;
  vec2 first_level;  // LightState::first_level.
};

uniform sampler2DArray shadow_maps;  // A layer for each light: depth / (largest - least); 1: empty.
uniform samplerCube irradiance_map;  // Of the residual, by normal.

// The light at a point: direction, angular radius, irradiance at normal incidence.
struct Incident {
  vec3 towards;
  float radius;
  vec3 irradiance;
};

Incident incident(int i, vec3 p) {
  ViewerLight light = lights[i];
  float distance_m = light.irradiance_distance.w;
  if (distance_m <= 0.0) return Incident(light.towards_radius.xyz, light.towards_radius.w, light.irradiance_distance.rgb);
  vec3 r = light.position.xyz - p;
  float ratio = distance_m / max(length(r), 1e-4 * distance_m);
  float radius = asin(min(sin(light.towards_radius.w) * ratio, 1.0));
  return Incident(normalize(r), radius, light.irradiance_distance.rgb * ratio * ratio);
}

// Irradiance of a receiver per vector irradiance of the cap, clipped at its horizon: cap_irradiance() of the SDK (Snyder
// 1996). Below 0.1 rad the flat disc, whose error is of the order of radius², because the closed form cancels in float.
float cap_irradiance(float cosine, float radius) {
  if (radius < 1e-4) return max(cosine, 0.0);
  float sine_r = sin(radius);
  if (radius < 0.1) {
    float x = clamp(cosine / sine_r, -1.0, 1.0);
    if (cosine >= sine_r) return cosine;
    float root = sqrt(max(1.0 - x * x, 0.0));
    return sine_r / kPi * (x * (0.5 * kPi + asin(x) + x * root) + 2.0 / 3.0 * root * root * root);
  }
  float omega = acos(clamp(cosine, -1.0, 1.0));
  if (omega <= 0.5 * kPi - radius) return cosine;
  if (omega >= 0.5 * kPi + radius) return 0.0;
  float cos_r = cos(radius), sin_w = sin(omega);
  float gamma = asin(clamp(cos_r / sin_w, -1.0, 1.0));
  float cos_g = cos(gamma), sin_g = sin(gamma);
  float g = -2.0 * sin_w * cos_r * cos_g + 0.5 * kPi - gamma + sin_g * cos_g;
  float h = cosine * (cos_g * sqrt(max(sine_r * sine_r - cos_g * cos_g, 0.0)) +
                      sine_r * sine_r * asin(clamp(cos_g / sine_r, -1.0, 1.0)));
  float full = kPi * sine_r * sine_r;
  float part = omega < 0.5 * kPi ? full * cosine + g - h : g + h;
  return max(part / full, 0.0);
}

// Least depth, in the light's axes, of a caster that can hide a part of the light from p; the depth of p itself if there is
// none.
float least_caster_depth(mat4 view, vec3 p, float depth, vec3 towards, float radius) {
  float nearest = depth, cos_r = cos(radius), sin_r = sin(radius);
  for (int k = 0; k < caster_count; ++k) {
    vec4 c = casters[k];
    vec3 v = c.xyz - p;
    float d = length(v);
    if (d > c.w) {
      // Outside the cone of the light, widened by the sphere.
      float sine = c.w / d, cosine = sqrt(1.0 - sine * sine);
      if (dot(v, towards) < d * (cosine * cos_r - sine * sin_r)) continue;
    }
    nearest = min(nearest, (view * vec4(c.xyz, 1.0)).z - c.w);
  }
  return nearest;
}

// Depth in the map, m; a large one where it is empty.
float map_depth(int i, vec2 at, vec4 map) {
  ivec2 texel = ivec2(floor((0.5 + 0.5 * at / map.x) * float(textureSize(shadow_maps, 0).x)));
  if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, textureSize(shadow_maps, 0).xy))) return 1e9;
  float depth = texelFetch(shadow_maps, ivec3(texel, i), 0).r;
  return depth < 1.0 ? mix(map.y, map.z, depth) : 1e9;
}

// Share of the light that reaches p, whose surface there has the normal n. Percentage-closer soft shadows (Fernando 2005):
// mean depth of the casters, then the share of the disc that they cover at that depth. Taps are compared with the plane of
// the surface, so that it does not shadow itself.
float visibility(int i, vec3 p, vec3 n, Incident light) {
  vec4 map = lights[i].map;
  if (map.w == 0.0) return 1.0;
  vec3 q = (lights[i].view * vec4(p, 1.0)).xyz;
  bool near = lights[i].irradiance_distance.w > 0.0;
  float least = max(least_caster_depth(lights[i].view, p, q.z, light.towards, light.radius), map.y);
  if (q.z <= least) return 1.0;
  vec2 centre = near ? q.xy / q.z : q.xy;
  // Radius of the disc in the map per depth between caster and p; a near light's is divided by both depths.
  float source = near ? lights[i].irradiance_distance.w * sin(lights[i].towards_radius.w) : tan(light.radius);
  float texel = 2.0 * map.x / float(textureSize(shadow_maps, 0).x);
  float search = max(source * (q.z - least) / (near ? q.z * least : 1.0), texel);
  vec3 m = mat3(lights[i].view) * n;
  m.z = min(m.z, -0.15);
  float offset = dot(m, q), bias = (near ? q.z : 1.0) * texel * (0.75 + length(m.xy) / -m.z);
  float sum = 0.0, found = 0.0;
  for (int k = 0; k < kTaps; k += 2) {
    vec2 at = centre + search * disc[k].xy;
    float z = map_depth(i, at, map);
    float plane = near ? offset / min(dot(m, vec3(at, 1.0)), -0.05) : (offset - dot(m.xy, at)) / m.z;
    if (z < plane - bias) {
      sum += z;
      found += 1.0;
    }
  }
  if (found == 0.0) return 1.0;
  if (found == float(kTaps / 2)) return 0.0;
  float caster = sum / found;
  float radius = max(source * (q.z - caster) / (near ? q.z * caster : 1.0), 0.75 * texel);
  float blocked = 0.0;
  for (int k = 0; k < kTaps; ++k) {
    vec2 at = centre + radius * disc[k].xy;
    float plane = near ? offset / min(dot(m, vec3(at, 1.0)), -0.05) : (offset - dot(m.xy, at)) / m.z;
    if (map_depth(i, at, map) < plane - bias) blocked += 1.0;
  }
  return 1.0 - blocked / float(kTaps);
}
