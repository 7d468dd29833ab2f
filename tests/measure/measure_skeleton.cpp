// Prints one JSON object per line for every figure of topic `skeleton` that needs no other process:
//   {"figure": NAME, "value": NUMBER}
// Seeds and scenes are fixed here; limits are in tests/figure_topics/skeleton.py.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <numbers>
#include <string>

#include <lightwell/codec.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/time.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/output.hpp"
#include "reference/bright_region.hpp"
#include "reference/ggx.hpp"
#include "reference/harmonics.hpp"
#include "reference/irradiance.hpp"
#include "sim/panorama.hpp"
#include "sim/scene.hpp"
#include "sim/sensor.hpp"

namespace {

using namespace lightwell;
using measure::print_figure;
namespace ref = reference;

[[noreturn]] void fail(const Status& s) {
  std::fprintf(stderr, "measure_skeleton: %s\n", s.message().c_str());
  std::exit(1);
}

struct Seen {
  std::vector<std::vector<float>> pixels;
  Frame frame;
};

Seen see(const sim::Scene& scene, const sim::SceneState& state, const RigParameters& rig) {
  Seen out;
  out.frame.info.exposure_s = 1;
  for (const LensParameters& lens : rig.lenses)
    out.pixels.push_back(sim::render_radiance(scene, state, lens, sim::samples_for(lens, scene.panorama(state))));
  for (std::size_t k = 0; k < rig.lenses.size(); ++k)
    out.frame.add_view({static_cast<int>(k), PixelFormat::rgb_f32, rig.lenses[k].width, rig.lenses[k].height,
                        packed_stride(PixelFormat::rgb_f32, rig.lenses[k].width),
                        std::as_bytes(std::span(out.pixels[k]))});
  return out;
}

Descriptor estimate(Estimator& estimator, const Frame& frame) {
  Descriptor d;
  if (const Status s = estimator.estimate(std::span(&frame, 1), d); !s.ok()) fail(s);
  return d;
}

/// The light as an application receives it: over the wire, through the SDK.
Lighting delivered(const Descriptor& d) {
  Encoder encoder;
  const auto bytes = encoder.encode(d);
  if (!bytes) fail(bytes.status());
  Result<Descriptor> back = decode_descriptor(*bytes);
  if (!back) fail(back.status());
  return Lighting::of(std::move(*back));
}

ref::IrradianceError error_of(const Lighting& lighting, const std::vector<ref::V3>& normals,
                              const std::vector<ref::Rgb>& truth, Quat to_probe = {}) {
  std::vector<ref::Rgb> got;
  for (const ref::V3& n : normals) {
    const Irradiance e = lighting.irradiance(vec_cast<float>(rotate(to_probe, Vec3d{n.x, n.y, n.z}))).value;
    got.push_back({e.r, e.g, e.b});
  }
  return ref::irradiance_error(truth, got);
}

std::unique_ptr<Estimator> estimator_of(const RigParameters& rig) {
  Result<std::unique_ptr<Estimator>> made = make_panorama_estimator(rig, {});
  if (!made) fail(made.status());
  return std::move(*made);
}

void real_panoramas() {
  const RigParameters rig = *sim::make_rig("pair", 640, 480, PixelFormat::rgb_f32);
  const auto estimator = estimator_of(rig);
  const auto normals = ref::fibonacci_normals(2048);
  for (const char* name : {"city", "courtyard", "forest", "interior", "night", "studio", "sunrise", "sunset"}) {
    const Result<std::string> path = sim::scene_path(name);
    if (!path) fail(path.status());
    Result<sim::Panorama> panorama = sim::load_panorama(*path);
    if (!panorama) fail(panorama.status());
    const ref::Panorama world{panorama->width, panorama->height, {panorama->rgb.begin(), panorama->rgb.end()}};
    const sim::Scene scene(std::move(*panorama));
    const Seen seen = see(scene, scene.state_at(0), rig);
    const Lighting lighting = delivered(estimate(*estimator, seen.frame));
    const ref::IrradianceError e = error_of(lighting, normals, ref::irradiance_at(world, normals));
    print_figure(std::string("irradiance_error.") + name, e.rms);
    print_figure(std::string("bound_over_error.") + name,
                 lighting.descriptor().bound.total / std::max(e.rms, e.luminance_weighted));
    const auto brightest = ref::bright_region(world);
    print_figure(std::string("peak_to_mean.") + name, brightest->peak_to_mean);
    double nearest = 180;
    for (const Light& l : lighting.lights())
      nearest = std::min(nearest, ref::angle_deg({l.direction.x, l.direction.y, l.direction.z}, brightest->direction));
    print_figure(std::string("light_direction_deg.") + name, nearest);

    // The probe is rotated by 77 degrees about an oblique axis; the light, rotated back, is compared with the same
    // truth.
    sim::SceneState turned = scene.state_at(0);
    turned.yaw_rad = 77 * std::numbers::pi / 180;
    turned.rotation_world_probe = Quat::about({0, 1, 0}, turned.yaw_rad);
    const Seen again = see(scene, turned, rig);
    const ref::IrradianceError t = error_of(delivered(estimate(*estimator, again.frame)), normals,
                                            ref::irradiance_at(world, normals), turned.rotation_world_probe.inverse());
    print_figure(std::string("irradiance_error_turned.") + name, t.rms);
  }
}

void constant_panorama() {
  const RigParameters rig = *sim::make_rig("pair", 640, 480, PixelFormat::rgb_f32);
  const sim::Scene scene(sim::from_function(256, [](Vec3d) { return Radiance{3, 2, 1}; }));
  const Seen seen = see(scene, scene.state_at(0), rig);
  const Lighting lighting = delivered(estimate(*estimator_of(rig), seen.frame));
  print_figure("constant.band", lighting.descriptor().radiance.band);
  print_figure("constant.lights", static_cast<double>(lighting.lights().size()));
}

/// Largest deviation from the definitions, relative to the largest value of the scene; before the wire.
void analytic_scenes() {
  const auto directions = ref::fibonacci_normals(500);
  const auto vec = [](const ref::V3& d) {
    return Vec3f{static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z)};
  };
  const double roughness[] = {0.1, 0.25, 0.5, 0.75, 1.0};

  double worst = 0;
  Descriptor constant;
  constant.radiance.c[0].r = static_cast<float>(2 * std::sqrt(4 * std::numbers::pi));
  const Lighting flat = Lighting::of(constant);
  for (const ref::V3& d : directions) {
    worst = std::max(worst, std::abs(flat.irradiance(vec(d)).value.r / (2 * std::numbers::pi) - 1));
    for (const double r : roughness)
      worst = std::max(worst, std::abs(flat.radiance(vec(d), static_cast<float>(r)).value.r / 2.0 - 1));
  }
  print_figure("analytic.constant", worst);

  worst = 0;
  for (const ref::V3& towards : ref::fibonacci_normals(10)) {
    Descriptor d;
    Light light;
    light.direction = vec(towards);
    light.irradiance.r = 1;
    d.lights = {light};
    const Lighting lighting = Lighting::of(d);
    for (const ref::V3& n : directions) {
      const double c = ref::dot(n, towards);
      worst = std::max(worst, std::abs(lighting.irradiance(vec(n)).value.r - std::max(0.0, c)));
      for (const double r : roughness) {
        const ref::GgxKernel kernel(r);
        worst =
            std::max(worst, std::abs(lighting.radiance(vec(n), static_cast<float>(r)).value.r - kernel.at_cosine(c)) /
                                kernel.at_cosine(1));
      }
    }
  }
  print_figure("analytic.directional", worst);

  // A clamped cosine has all even bands; a descriptor holds its bands up to 6.
  worst = 0;
  double worst_single = 0;
  const auto single = [&](const std::vector<double>& coefficients) {
    Descriptor d;
    d.radiance.band = 6;
    for (std::size_t i = 0; i < 49; ++i) d.radiance.c[i].r = static_cast<float>(coefficients[i]);
    const Lighting lighting = Lighting::of(d);
    // radiance() is the series itself if every band is sent and nothing rings: for a uniform sky.
    std::vector<double> on_sky = coefficients;
    for (std::size_t i = 0; i < 49; ++i) {
      on_sky[i] += i == 0 ? 10 : 0.002;
      d.radiance.c[i].r = static_cast<float>(on_sky[i]);
    }
    const Lighting sky = Lighting::of(d);
    double deviation = 0;
    for (const ref::V3& n : directions) {
      const std::vector<double> y = ref::harmonics(n, 6);
      double e = 0;
      for (std::size_t i = 0; i < 49; ++i)
        e += ref::cosine_lobe(static_cast<int>(std::sqrt(static_cast<double>(i)))) * coefficients[i] * y[i];
      deviation = std::max(deviation, std::abs(lighting.irradiance(vec(n)).value.r - e) / std::numbers::pi);
      for (const double r : roughness) {
        static std::vector<std::vector<double>> k;
        if (k.empty())
          for (const double q : roughness) k.push_back(ref::ggx_legendre(q, 6));
        const auto which =
            static_cast<std::size_t>(std::find(std::begin(roughness), std::end(roughness), r) - std::begin(roughness));
        double l = 0;
        for (std::size_t i = 0; i < 49; ++i)
          l += k[which][static_cast<std::size_t>(std::sqrt(static_cast<double>(i)))] * on_sky[i] * y[i];
        deviation = std::max(deviation, std::abs(sky.radiance(vec(n), static_cast<float>(r)).value.r - l));
      }
    }
    return deviation;
  };
  for (std::size_t i = 0; i < 49; ++i) {
    std::vector<double> c(49);
    c[i] = 1;
    worst_single = std::max(worst_single, single(c));
  }
  print_figure("analytic.single_harmonics", worst_single);
  std::vector<double> lobe(49);
  const std::vector<double> axis = ref::harmonics(ref::normalised({0.3, -0.5, 0.8}), 6);
  for (std::size_t i = 0; i < 49; ++i)
    lobe[i] = ref::cosine_lobe(static_cast<int>(std::sqrt(static_cast<double>(i)))) * axis[i];
  print_figure("analytic.cosine_lobe", single(lobe));
}

/// The same from images: error of the estimated coefficients for single harmonics, relative to the largest coefficient;
/// before the wire.
void estimated_harmonics() {
  const RigParameters rig = *sim::make_rig("pair", 640, 480, PixelFormat::rgb_f32);
  PanoramaOptions options;
  options.config.band = 6;
  options.config.max_lights = 0;
  options.config.panorama.epsilon = 0;  // Send all bands; otherwise those that irradiance does not need are left out.
  auto estimator = make_panorama_estimator(rig, options);
  const Result<RigTable> table = make_rig_table(rig);
  if (!estimator || !table) fail(estimator.status());
  double worst = 0;
  for (std::size_t i = 0; i < 49; ++i) {
    Seen seen;
    seen.frame.info.exposure_s = 1;
    for (const LensTable& lens : table->lenses) {
      std::vector<float>& pixels = seen.pixels.emplace_back(3 * lens.direction.size());
      for (std::size_t p = 0; p < lens.direction.size(); ++p) {
        const Vec3f& d = lens.direction[p];
        const auto v = lens.solid_angle[p] > 0 ? static_cast<float>(2 + ref::harmonics({d.x, d.y, d.z}, 6)[i]) : 0.0F;
        pixels[3 * p] = pixels[3 * p + 1] = pixels[3 * p + 2] = v;
      }
    }
    for (std::size_t k = 0; k < rig.lenses.size(); ++k)
      seen.frame.add_view(
          {static_cast<int>(k), PixelFormat::rgb_f32, 640, 480, 12 * 640, std::as_bytes(std::span(seen.pixels[k]))});
    const Descriptor d = estimate(**estimator, seen.frame);
    const double pedestal = 2 * std::sqrt(4 * std::numbers::pi);
    for (std::size_t j = 0; j < 49; ++j) {
      const double truth = (j == 0 ? pedestal : 0) + (i == j ? 1 : 0);
      worst = std::max(worst, std::abs(d.radiance.c[j].g - truth) / pedestal);
    }
  }
  print_figure("estimated.single_harmonics", worst);
}

/// GB/s of memcpy over buffers larger than the caches, for comparison with the times of this run.
void memory_speed() {
  std::vector<std::byte> from(64 << 20, std::byte{1}), to(64 << 20);
  double best = 0;
  for (int i = 0; i < 5; ++i) {
    const std::int64_t start = monotonic_now_ns();
    std::memcpy(to.data(), from.data(), from.size());
    best = std::max(best, static_cast<double>(from.size()) / static_cast<double>(monotonic_now_ns() - start));
  }
  print_figure("memcpy_gb_per_s", best + (to[1] == std::byte{1} ? 0 : 1));
}

}  // namespace

int main() {
  memory_speed();
  constant_panorama();
  analytic_scenes();
  estimated_harmonics();
  real_panoramas();
  return 0;
}
