#include "reference/relight/path_tracer.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <thread>
#include <utility>

#include "reference/image_object/figurine.hpp"

namespace lightwell::reference {
namespace {

/// In front of the surface; subjects have a size of about 1.
constexpr double kRayOffset = 2e-4;
/// Paths go on with a probability from this bounce on.
constexpr int kRouletteStart = 3;
/// Share of rays that sample the diffuse reflection, where there is a coat.
constexpr double kDiffuseShare = 0.75;

/// PCG-XSH-RR (O'Neill 2014), one stream for each pixel.
class Random {
 public:
  Random(std::uint32_t seed, std::uint64_t stream) : increment_(2 * stream + 1) {
    (void)next();
    state_ += seed;
    (void)next();
  }
  double operator()() { return next() * 0x1p-32; }

 private:
  std::uint32_t next() {
    const std::uint64_t old = state_;
    state_ = old * 6364136223846793005ULL + increment_;
    const auto shifted = static_cast<std::uint32_t>(((old >> 18) ^ old) >> 27);
    const auto turn = static_cast<std::uint32_t>(old >> 59);
    return shifted >> turn | shifted << ((32 - turn) & 31);
  }
  std::uint64_t state_ = 0, increment_;
};

struct Axes {
  V3 x, y, z;

  explicit Axes(const V3& n) : z(n) {
    x = normalised(cross(std::abs(n.y) < 0.9 ? V3{0, 1, 0} : V3{1, 0, 0}, n));
    y = cross(z, x);
  }
  [[nodiscard]] V3 at(double sine, double azimuth, double cosine) const {
    return (sine * std::cos(azimuth)) * x + (sine * std::sin(azimuth)) * y + cosine * z;
  }
};

struct Vertex {
  V3 at, normal, facet, out;  ///< `out`: towards where the path comes from.
  TracedMaterial material;
};

double ggx(double nh, double alpha) {
  const double t = nh * nh * (alpha * alpha - 1) + 1;
  return alpha * alpha / (pi * t * t);
}

/// BRDF times cosine (Walter et al. 2007; Heitz 2014), and the density with which sample() takes `in`.
struct Scattering {
  Rgb value{};
  double density = 0;
};

Scattering scattering(const Vertex& v, const V3& in) {
  const double ni = dot(v.normal, in), no = std::max(1e-4, dot(v.normal, v.out));
  if (ni <= 0 || dot(v.facet, in) <= 0) return {};
  const V3 h = normalised(in + v.out);
  const double nh = std::max(0.0, dot(v.normal, h)), oh = std::max(1e-4, dot(v.out, h)),
               a2 = v.material.alpha * v.material.alpha;
  const bool coat = v.material.f0 > 0;
  const double fresnel = coat ? v.material.f0 + (1 - v.material.f0) * std::pow(1 - oh, 5) : 0;
  const double d = ggx(nh, v.material.alpha);
  const double masking = 0.5 / (ni * std::sqrt(no * no * (1 - a2) + a2) + no * std::sqrt(ni * ni * (1 - a2) + a2));
  Scattering out;
  for (std::size_t c = 0; c < 3; ++c)
    out.value[c] = ((1 - fresnel) * v.material.albedo[c] / pi + fresnel * d * masking) * ni;
  const double share = coat ? kDiffuseShare : 1;
  out.density = share * ni / pi + (1 - share) * d * nh / (4 * oh);
  return out;
}

V3 sample(const Vertex& v, Random& random) {
  const double pick = random(), u = random(), azimuth = 2 * pi * random();
  const Axes axes(v.normal);
  if (v.material.f0 <= 0 || pick < kDiffuseShare) return axes.at(std::sqrt(u), azimuth, std::sqrt(1 - u));
  const double cosine = std::sqrt((1 - u) / (1 + (v.material.alpha * v.material.alpha - 1) * u));
  const V3 h = axes.at(std::sqrt(std::max(0.0, 1 - cosine * cosine)), azimuth, cosine);
  return (2 * dot(v.out, h)) * h - v.out;
}

/// Irradiance at normal incidence at a point.
Rgb arriving(const TracedLight& light, const V3& at) {
  const V3 ray = at - light.position;
  const double falloff = 1 / dot(ray, ray);
  Rgb through{1, 1, 1};
  if (light.pattern != LightPattern::none) {
    const V3 axis = normalised(light.aim - light.position), right = normalised(cross(axis, V3{0, 1, 0}));
    const V3 up = cross(right, axis);
    const double depth = dot(ray, axis);
    if (depth <= 0) return {};
    const double k = 1 / (depth * light.half_width_tan);
    through = transmittance(light.pattern, k * dot(ray, right), k * dot(ray, up));
  }
  return {falloff * light.intensity[0] * through[0], falloff * light.intensity[1] * through[1],
          falloff * light.intensity[2] * through[2]};
}

void add(std::array<float, 3>& to, const Rgb& value, double weight) {
  for (std::size_t c = 0; c < 3; ++c) to[c] += static_cast<float>(weight * value[c]);
}

}  // namespace

struct PathTracer::Scene {
  TracedMesh mesh;
  MeshRays rays{mesh};

  explicit Scene(TracedMesh m) : mesh(std::move(m)) {}

  [[nodiscard]] std::optional<Vertex> hit(const V3& from, const V3& towards) const {
    const auto first = rays.first_hit(from, towards);
    if (!first) return std::nullopt;
    Vertex out;
    out.at = first->at;
    out.facet = first->facet;
    out.normal = first->normal;
    out.out = -1.0 * towards;
    out.material = mesh.material(first->triangle, out.at);
    return out;
  }

  [[nodiscard]] bool occluded(const Vertex& from, const V3& towards, double distance) const {
    return rays.occluded(from.at + kRayOffset * from.facet, towards, distance);
  }

  /// Direct light that a vertex reflects towards its `out`.
  [[nodiscard]] Rgb reflected(const Vertex& v, const TracedLight& light) const {
    const V3 gap = light.position - v.at;
    const double distance = length(gap);
    const V3 in = (1 / distance) * gap;
    const Scattering s = scattering(v, in);
    if (s.density <= 0) return {};
    const Rgb e = arriving(light, v.at);
    if (e[0] + e[1] + e[2] <= 0 || occluded(v, in, distance)) return {};
    return {s.value[0] * e[0], s.value[1] * e[1], s.value[2] * e[2]};
  }

  /// Adds the light of one path to a pixel.
  void trace_path(Vertex v, const std::vector<TracedLight>& lights, const TraceOptions& options, double weight,
                  std::size_t pixel, Random& random, TracedPictures& out) const {
    Rgb throughput{1, 1, 1};
    for (int bounce = 0;; ++bounce) {
      for (std::size_t k = 0; k < lights.size(); ++k) {
        Rgb light = reflected(v, lights[k]);
        for (std::size_t c = 0; c < 3; ++c) light[c] *= throughput[c];
        add(out.light[k][pixel], light, weight);
        if (bounce == 0) add(out.direct[k][pixel], light, weight);
      }
      if (bounce >= options.max_bounces) return;
      const V3 in = sample(v, random);
      const Scattering s = scattering(v, in);
      if (s.density <= 0) return;
      for (std::size_t c = 0; c < 3; ++c) throughput[c] *= s.value[c] / s.density;
      if (bounce >= kRouletteStart) {
        const double go_on = std::min(0.95, std::max({throughput[0], throughput[1], throughput[2]}));
        if (random() >= go_on) return;
        for (double& t : throughput) t /= go_on;
      }
      const auto next = hit(v.at + kRayOffset * v.facet, in);
      if (!next) return;
      v = *next;
    }
  }

  void trace_pixel(const TracedCamera& camera, const std::vector<TracedLight>& lights, const TraceOptions& options,
                   std::size_t pixel, TracedPictures& out) const {
    const int column = static_cast<int>(pixel) % camera.columns, row = static_cast<int>(pixel) / camera.columns;
    const auto towards = [&](double x, double y) {
      return normalised({column + x - 0.5 * camera.columns, 0.5 * camera.rows - row - y, -camera.focal_px});
    };
    const V3 middle = towards(0.5, 0.5);
    if (const auto at = hit(camera.eye, middle)) out.depth[pixel] = static_cast<float>(camera.eye.z - at->at.z);
    const int side = static_cast<int>(std::ceil(std::sqrt(options.samples) - 1e-9)), count = side * side;
    Random random(options.seed, pixel);
    int seen = 0;
    Rgb albedo{};
    V3 normal;
    for (int s = 0; s < count; ++s) {
      const double x = (s % side + random()) / side, y = (s / side + random()) / side;
      const auto first = hit(camera.eye, towards(x, y));
      if (!first) continue;
      ++seen;
      for (std::size_t c = 0; c < 3; ++c) albedo[c] += first->material.albedo[c];
      normal = normal + first->normal;
      trace_path(*first, lights, options, 1.0 / count, pixel, random, out);
    }
    if (seen == 0) return;
    out.coverage[pixel] = static_cast<float>(seen) / static_cast<float>(count);
    add(out.albedo[pixel], albedo, 1.0 / seen);
    const V3 unit = normalised(normal);
    add(out.normal[pixel], {unit.x, unit.y, unit.z}, 1);
  }
};

TracedMesh traced_figurine() {
  const FigurineMesh figurine = make_figurine();
  TracedMesh out{figurine, {}};
  out.material = [parts = figurine.parts](std::uint32_t triangle, const V3& at) {
    const FigurineMaterial material = figurine_material(parts[triangle], at);
    return TracedMaterial{material.albedo, material.alpha, 0.04};
  };
  return out;
}

PathTracer::PathTracer(TracedMesh mesh) : scene_(std::make_unique<Scene>(std::move(mesh))) {}
PathTracer::~PathTracer() = default;

const TracedMesh& PathTracer::mesh() const { return scene_->mesh; }

TracedPictures PathTracer::trace(const TracedCamera& camera, const std::vector<TracedLight>& lights,
                                 const TraceOptions& options) const {
  const auto pixels = static_cast<std::size_t>(camera.columns) * static_cast<std::size_t>(camera.rows);
  TracedPictures out;
  out.coverage.assign(pixels, 0);
  out.depth.assign(pixels, 0);
  out.albedo.assign(pixels, {});
  out.normal.assign(pixels, {});
  out.light.assign(lights.size(), out.albedo);
  out.direct.assign(lights.size(), out.albedo);
  const auto threads = static_cast<std::size_t>(options.threads);
  std::vector<std::thread> workers;
  for (std::size_t t = 0; t < threads; ++t)
    workers.emplace_back([&, t] {
      for (std::size_t p = t; p < pixels; p += threads) scene_->trace_pixel(camera, lights, options, p, out);
    });
  for (std::thread& worker : workers) worker.join();
  return out;
}

}  // namespace lightwell::reference
