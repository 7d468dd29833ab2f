// The material: the weighted sum of material.hpp.
uniform vec3 base_color;
uniform float lambert, blinn_phong, shininess, anisotropic, n_u, n_v;
uniform float reflection, refraction, ior, fresnel, fresnel_power;
uniform float metal_rough, metallic, roughness;

uniform samplerCube environment_map;  // Level l: radiance(d, l / environment_levels), without the lights, or with those that its texels show.
uniform float environment_levels;     // Index of the last level; 0: one level for every roughness, and the lights are in it.
uniform samplerCube objects_map;      // The other objects from this one's middle; premultiplied, A: coverage.
uniform float objects_edge;           // Texels; 0: no map.
uniform sampler2D split_sum_table;    // Factor of F0 and offset, by cosine and roughness.

// radiance(d, roughness) of a cap of uniform radiance per vector irradiance, sr^-1. In the stereographic projection around d,
// t = tan(angle / 2), the GGX lobe is cos(angle) / (alpha² + t²)² per area, and caps are discs. A second stereographic
// projection, of t / alpha, makes the integral of the fraction the share of the sphere that a cap of radius psi / 2 covers;
// the cosine is replaced by its mean over the cap.
float cap_radiance(float angle, float radius, float alpha) {
  float a = clamp(alpha, 1e-3, 0.98), rho = max(radius, 1e-3);
  float cosine = cap_irradiance(cos(angle), rho);
  float low = 0.5 * (angle - rho), high = 0.5 * min(angle + rho, 3.1);
  float psi = atan((tan(high) - tan(low)) * a, a * a + tan(high) * tan(low));
  float covered = sin(0.5 * psi) * sin(0.5 * psi);
  // Integral of the lobe over the sphere: 2 pi x / (alpha² + beta (1 - x))² for x from 0 to 1.
  float a2 = a * a, beta = 0.5 * (1.0 - a2), whole = a2 + beta;
  float norm = 2.0 * kPi * ((1.0 / a2 - 1.0 / whole) / beta - (log(whole / a2) + a2 / whole - 1.0) / (beta * beta));
  // cosine / (2 pi (1 - cos rho)) is the mean cosine times the radiance of the cap.
  return 4.0 * kPi / a2 * covered * cosine / (norm * 4.0 * kPi * sin(0.5 * rho) * sin(0.5 * rho));
}

// Radiance from the direction d at this roughness; visible[i]: share of light i that arrives.
vec3 environment(vec3 p, vec3 d, float r, float visible[kMaxLights]) {
  float alpha = r * r;
  vec3 sum = textureLod(environment_map, d, r * environment_levels).rgb;
  if (environment_levels > 0.0) {
    float other_levels = clamp((r - first_level.x) / (first_level.y - first_level.x), 0.0, 1.0);
    for (int i = 0; i < light_count; ++i) {
      Incident light = incident(i, p);
      float angle = acos(clamp(dot(d, light.towards), -1.0, 1.0));
      float share = lights[i].position.w > 0.0 ? other_levels : 1.0;
      sum += light.irradiance * (visible[i] * share * cap_radiance(angle, light.radius, alpha));
    }
  }
  if (objects_edge > 0.0) {
    // The level whose texel has the lobe's solid angle, 4 pi alpha².
    vec4 near = textureLod(objects_map, d, max(log2(2.45 * objects_edge * max(alpha, 1e-6)), 0.0));
    sum = near.rgb + (1.0 - near.a) * sum;
  }
  return sum;
}

float schlick(float f0, float cosine, float power) { return f0 + (1.0 - f0) * pow(clamp(1.0 - cosine, 0.0, 1.0), power); }

// Ashikhmin & Shirley 2000, "An Anisotropic Phong BRDF Model", eq. 4, per F.
float anisotropic_brdf(vec3 n, vec3 u, vec3 to_light, vec3 to_eye) {
  vec3 h = normalize(to_light + to_eye), v = cross(n, u);
  float nh = max(dot(n, h), 0.0), hu = dot(h, u), hv = dot(h, v), kh = max(dot(to_eye, h), 1e-3);
  float exponent = (n_u * hu * hu + n_v * hv * hv) / max(1.0 - nh * nh, 1e-6);
  return sqrt((n_u + 1.0) * (n_v + 1.0)) / (8.0 * kPi) * pow(nh, exponent) /
         (kh * max(max(dot(n, to_light), dot(n, to_eye)), 1e-2));
}

// Radiance towards the eye. n: shading normal; plane: normal of the surface for shadows, towards the eye; u: tangent.
vec3 shade(vec3 p, vec3 n, vec3 plane, vec3 u, vec3 eye, vec3 base) {
  vec3 to_eye = normalize(eye - p);
  float nv = max(dot(n, to_eye), 0.0);
  vec3 f0 = mix(vec3(0.04), base, metallic);
  vec3 irradiance = max(textureLod(irradiance_map, n, 0.0).rgb, 0.0);
  vec3 sum = vec3(0.0);
  float visible[kMaxLights];
  for (int i = 0; i < kMaxLights; ++i) visible[i] = 0.0;
  for (int i = 0; i < light_count; ++i) {
    Incident light = incident(i, p);
    float received = cap_irradiance(dot(n, light.towards), light.radius);
    if (received <= 0.0) continue;
    visible[i] = visibility(i, p, plane, light);
    vec3 e = light.irradiance * (received * visible[i]);
    irradiance += e;
    vec3 h = normalize(light.towards + to_eye);
    if (blinn_phong > 0.0)
      sum += blinn_phong * (shininess + 8.0) / (8.0 * kPi) * pow(max(dot(n, h), 0.0), shininess) * e;
    if (anisotropic > 0.0) {
      float kh = max(dot(to_eye, h), 0.0);
      sum += anisotropic * (f0 + (1.0 - f0) * pow(1.0 - kh, 5.0)) * anisotropic_brdf(n, u, light.towards, to_eye) * e;
    }
  }
  sum += (lambert + metal_rough * (1.0 - metallic)) * base / kPi * irradiance;
  vec3 mirrored = reflect(-to_eye, n);
  float f = schlick(pow((ior - 1.0) / (ior + 1.0), 2.0), nv, fresnel_power);
  if (reflection > 0.0 || metal_rough > 0.0) {
    vec3 radiance = environment(p, mirrored, roughness, visible);
    vec2 split = textureLod(split_sum_table, vec2(nv, roughness), 0.0).rg;
    sum += (reflection * mix(1.0, f, fresnel) + metal_rough * (f0 * split.x + split.y)) * radiance;
  }
  if (refraction > 0.0) {
    float all[kMaxLights];
    for (int i = 0; i < kMaxLights; ++i) all[i] = 1.0;
    sum += refraction * mix(1.0, 1.0 - f, fresnel) * base * environment(p, refract(-to_eye, n, 1.0 / ior), roughness, all);
  }
  return sum;
}
