// Round-trip error of pixels through direction and back, over the whole image of published lenses; and errors of light
// directions through calibrated lenses. One JSON object per line for tests/figures: figure, value.
//   measure_models
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "calibration/model/camera_model.hpp"
#include "estimate/panorama/panorama_estimator.hpp"
#include "firmware/calibration/lens_trials.hpp"
#include "fixtures/published_lenses.hpp"
#include "measure/output.hpp"
#include "sim/panorama.hpp"
#include "sim/scene.hpp"

namespace {

using namespace lightwell;
using measure::print_figure;
constexpr double kDegree = std::numbers::pi / 180;

double largest_miss(const LensParameters& lens) {
  const CameraModel model(lens);
  double worst = 0;
  int seen = 0;
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      const PixelPosition p{static_cast<double>(x), static_cast<double>(y)};
      const auto d = model.unproject(p);
      if (!d) continue;
      const auto back = model.project(*d);
      if (!back) return INFINITY;
      worst = std::max(worst, std::hypot(back->x - p.x, back->y - p.y));
      ++seen;
    }
  }
  return seen > 0 ? worst : INFINITY;
}

/// Largest difference of the estimated direction of a lamp of one degree, at several angles, between the true lens and
/// a calibration of it.
double worst_lamp(calibration::LensKind kind, std::uint32_t seed) {
  const LensParameters truth = shown::lens_of(kind);
  const Result<calibration::GeometryFit> fit =
      calibrate_geometry(shown::one_lens(truth, {.seed = seed}), {.kind = kind});
  if (!fit) return INFINITY;
  RigParameters rig{{truth}, 0};
  rig.lenses[0].model = fit->lenses[0].model;
  const Result<std::unique_ptr<Estimator>> estimator = make_panorama_estimator(rig, {});
  if (!estimator) return INFINITY;
  double worst = 0;
  for (const double theta : {5.0, 50.0, 88.0}) {
    const double t = theta * kDegree, phi = 2.0 * seed + t;
    const Vec3d to{std::sin(t) * std::cos(phi), std::sin(t) * std::sin(phi), -std::cos(t)};
    const sim::Scene scene(sim::from_function(2048, [&](Vec3d d) {
      const float l = angle_between(d, to) < 0.5 * kDegree ? 20'000.0F : 1.0F;
      return Radiance{l, l, l};
    }));
    const std::vector<float> radiance = sim::render_radiance(scene, scene.state_at(0), truth, 4);
    Frame frame;
    frame.info.exposure_s = 1;
    frame.add_view({0, PixelFormat::rgb_f32, truth.width, truth.height,
                    packed_stride(PixelFormat::rgb_f32, truth.width), std::as_bytes(std::span(radiance))});
    Descriptor d;
    if (!(*estimator)->estimate(std::span(&frame, 1), d).ok() || d.lights.empty()) return INFINITY;
    worst = std::max(worst, angle_between(vec_cast<double>(d.lights[0].direction), to));
  }
  return worst / kDegree;
}

}  // namespace

int main() {
  double worst_px = 0;
  for (const test::PublishedLens& published : test::published_lenses())
    worst_px = std::max(worst_px, largest_miss(published.lens));
  print_figure("models.published", static_cast<double>(test::published_lenses().size()));
  print_figure("models.double_px", worst_px);
  using calibration::LensKind;
  for (const auto& [name, kind] : {std::pair{"kannala_brandt", LensKind::kannala_brandt},
                                   {"double_sphere", LensKind::double_sphere},
                                   {"mei", LensKind::mei}}) {
    double worst = 0;
    for (std::uint32_t seed = 1; seed <= 2; ++seed) worst = std::max(worst, worst_lamp(kind, seed));
    print_figure(std::string("light_deg.") + name, worst);
  }
  return 0;
}
