#include "estimate/marker/marker_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include <lightwell/direction_covariance.hpp>
#include <lightwell/harmonics.hpp>

#include "calibration/lens_table.hpp"
#include "estimate/common/descriptor_header.hpp"
#include "estimate/common/light_tracker.hpp"
#include "estimate/common/row_reader.hpp"
#include "estimate/marker/max_entropy_radiance.hpp"
#include "estimate/marker/ground_reflection.hpp"

namespace lightwell {
namespace {

/// Constants of harmonics: proto/README.md.
constexpr double kY0 = 0.28209479177387814, kY1 = 0.48860251190291992;
/// Darker than so many times what rounding and noise hide, nothing is told.
constexpr double kMinSignalToNoise = 3;
/// What is not modelled (paper that is not quite matte, lamps that are not points) is never better than this in a
/// direction, rad.
constexpr double kMinDirectionSigma_rad = 0.005;
/// Where so large a share of the patches is something else, what stands before the body or throws its shadow on it may
/// be before the table and the lamp as well, and what is left may be explained by a lamp that is not there.
constexpr double kMaxOccludedFraction = 0.25;
/// Variance of a direction of which nothing is known, rad².
constexpr double kUnknownDirectionVariance = 1;
/// Paper that is white: what saturated patches are taken for in a lower bound.
constexpr double kWhitePaperAlbedo = 0.8;

/// Of light that only faces tell of, whose cosine hides what is finer.
constexpr int kMaxEntropyBand = 4;

float rounded(double v) { return static_cast<float>(v); }

class MarkerEstimatorImpl final : public MarkerEstimator {
 public:
  MarkerEstimatorImpl(const RigParameters& rig, RigTable table, const MarkerBody& body, std::unique_ptr<BodyFinder> finder,
         const MarkerOptions& options)
      : rig_(rig),
        table_(std::move(table)),
        body_(body),
        finder_(std::move(finder)),
        options_(options),
        reader_(rig_, table_),
        sampler_(max_image_width(table_), options.sampler),
        calibration_id_(calibration_identity(rig)) {
    if (rig.nits_per_unit > 0) scale_ = {Units::absolute, rig.nits_per_unit};
    for (const LensParameters& lens : rig_.lenses) models_.emplace_back(lens);
    apply_options();
  }

  Status estimate(std::span<const Frame> bracket, Descriptor& out) override;

  EstimatorKind kind() const override { return EstimatorKind::marker; }
  Status configure(const EstimatorConfig& config) override {
    if (Status s = config.validate(kind()); !s.ok()) return s;
    options_.config = config;
    apply_options();
    return {};
  }
  void set_scale(RadianceScale scale) override {
    scale_ = scale;
    previous_.reset();
  }
  RadianceScale scale() const override { return scale_; }
  const MarkerReport& report() const override { return report_; }

 private:
  void apply_options() {
    finder_->set_decimation({options_.config.marker.search_decimation, options_.config.marker.decimation});
    sampler_.set_max_faces(options_.config.marker.max_faces);
  }
  /// Finds the body in one of the bracket's pictures; the lens that sees it.
  [[nodiscard]] Result<int> find(std::span<const Frame> bracket);
  void inflate_covariance_if_occluded();
  void add_pose_covariance();
  void fill_descriptor(Descriptor& out);
  void fill_ambient(Descriptor& out);
  void compute_error_bound(Descriptor& out) const;

  RigParameters rig_;
  RigTable table_;
  MarkerBody body_;
  std::unique_ptr<BodyFinder> finder_;
  MarkerOptions options_;
  estimate::RowReader reader_;
  marker::MarkerSampler sampler_;
  std::vector<CameraModel> models_;
  estimate::LightTracker tracker_;
  RadianceScale scale_;
  marker::Shading shading_;
  std::optional<marker::LightingEstimate> previous_;
  MarkerReport report_;
  std::uint32_t calibration_id_;
};

Result<int> MarkerEstimatorImpl::find(std::span<const Frame> bracket) {
  for (const Frame& frame : bracket) {
    for (const View& view : frame.views()) {
      const Result<std::optional<DetectedBody>> found = finder_->find(view, frame.info);
      if (!found) return found.status();
      if (!*found) continue;
      report_.body = **found;
      return view.lens;
    }
  }
  previous_.reset();
  return Status(StatusCode::not_found,
                "no tag of the body '" + body_.name + "' is in the picture, or too small, dark or blurred to be read");
}

Status MarkerEstimatorImpl::estimate(std::span<const Frame> bracket, Descriptor& out) {
  if (Status s = reader_.bind(bracket); !s.ok()) return s;
  const Result<int> seen = find(bracket);
  if (!seen) return seen.status();
  const auto lens = static_cast<std::size_t>(*seen);
  const LensParameters& parameters = rig_.lenses[lens];
  const marker::PosedBody placed(body_, parameters, models_[lens], report_.body.probe_body.pose);
  report_.counts =
      sampler_.sample(reader_, *seen, parameters.width, parameters.height, body_, placed, scale_.factor, 3, shading_);
  marker::estimate_ground_reflection(shading_);
  // A camera of one colour, or light of one: channels that are alike in every sample need no fit of their own.
  const auto grey = [](const marker::SurfaceSample& s) {
    const auto [least, most] = std::minmax({s.irradiance[0], s.irradiance[1], s.irradiance[2]});
    return most - least <= 1e-6 * most;
  };
  if (std::all_of(shading_.samples.begin(), shading_.samples.end(), grey)) shading_.channels = 1;

  marker::LightingEstimateOptions choice = options_.choice;
  choice.max_lights = std::min({choice.max_lights, options_.config.max_lights, static_cast<int>(kMaxLights)});
  report_.light = marker::estimate_lighting(shading_, choice, previous_ ? &*previous_ : nullptr);
  previous_ = report_.light;
  inflate_covariance_if_occluded();
  add_pose_covariance();

  estimate::fill_header(bracket, {scale_.units, options_.probe_id, calibration_id_, options_.config.setting}, out);
  out.flicker = Flicker::unknown;
  out.environment.reset();
  fill_descriptor(out);
  compute_error_bound(out);
  return {};
}

/// What is left of a body that much lies over tells no direction.
void MarkerEstimatorImpl::inflate_covariance_if_occluded() {
  const marker::SampleCounts& counts = report_.counts;
  if (counts.uneven + counts.covered + report_.light.outliers <= kMaxOccludedFraction * counts.patches) return;
  report_.light.unsure = true;
  report_.light.placed = false;
  for (marker::LightEstimate& lamp : report_.light.lights) {
    lamp.unsure = true;
    lamp.direction_covariance[0] += kUnknownDirectionVariance;
    lamp.direction_covariance[2] += kUnknownDirectionVariance;
  }
}

/// Normals are as wrong as the body's attitude is, and so are directions.
void MarkerEstimatorImpl::add_pose_covariance() {
  const PoseCovariance& c = report_.body.probe_body.covariance;
  for (marker::LightEstimate& lamp : report_.light.lights) {
    const auto [uu, uv, vv] = direction_covariance(lamp.lamp.direction, c);
    lamp.direction_covariance[0] += uu + kMinDirectionSigma_rad * kMinDirectionSigma_rad;
    lamp.direction_covariance[1] += uv;
    lamp.direction_covariance[2] += vv + kMinDirectionSigma_rad * kMinDirectionSigma_rad;
  }
}

void MarkerEstimatorImpl::fill_descriptor(Descriptor& out) {
  marker::LightingEstimate& light = report_.light;
  const marker::SampleCounts& counts = report_.counts;
  out.flags = {};
  // What shines on the side that is turned away from the lens is never seen.
  out.flags.set(Flag::unseen);
  if (counts.clipped > 0) out.flags.set(Flag::clipped);
  if (counts.cleaned > 0) out.flags.set(Flag::cleaned);
  const bool dark = !(counts.brightest > kMinSignalToNoise * counts.hidden) || !(counts.brightest > 0);
  if (dark) out.flags.set(Flag::dark);
  if (light.unsure || report_.body.ambiguous || dark) out.flags.set(Flag::unsure);
  if (dark) {
    light = {};
    light.unsure = true;
  } else if (shading_.samples.empty()) {
    // Everything that was seen is saturated: at least this much comes from all around.
    for (double& v : light.ambient[0]) v = std::numbers::pi * counts.brightest / kWhitePaperAlbedo;
  }

  fill_ambient(out);
  out.lights.clear();
  for (const marker::LightEstimate& lamp : light.lights) {
    Light one;
    one.direction = vec_cast<float>(lamp.lamp.direction);
    const marker::Rgb& e = lamp.lamp.irradiance;
    if (!(e[0] + e[1] + e[2] > 0)) continue;
    one.irradiance = {rounded(e[0]), rounded(e[1]), rounded(e[2])};
    one.direction_covariance = {rounded(lamp.direction_covariance[0]), rounded(lamp.direction_covariance[1]),
                                rounded(lamp.direction_covariance[2])};
    out.lights.push_back(one);
  }
  tracker_.assign(out.lights, out.time.mid_exposure);
  const marker::SphereCoverage shares = marker::sphere_coverage(sampler_.surfaces());
  out.coverage = rounded(shares.coverage);
  out.saturated = rounded(shares.saturated);
}

/// What comes from all around, and what is left to lamps of which nobody is sure.
void MarkerEstimatorImpl::fill_ambient(Descriptor& out) {
  marker::LightingEstimate& light = report_.light;
  out.radiance = {};
  out.radiance_step = 0;
  if (light.unsure && !light.placed) {
    // Lamps that explain the faces may be anywhere, and light what lies between the faces in as many ways.
    std::vector<Vec3d> toward;
    for (const marker::LightEstimate& lamp : light.lights) toward.push_back(lamp.lamp.direction);
    const auto even =
        marker::max_entropy_radiance(light.inliers, options_.choice.errors, toward, std::min(options_.config.band, kMaxEntropyBand));
    if (even) {
      out.radiance = even->radiance;
      for (std::size_t k = 0; k < light.lights.size(); ++k) light.lights[k].lamp.irradiance = even->lights[k];
      const auto sum = [](const marker::LightEstimate& lamp) {
        return lamp.lamp.irradiance[0] + lamp.lamp.irradiance[1] + lamp.lamp.irradiance[2];
      };
      std::ranges::stable_sort(light.lights, std::ranges::greater{}, sum);
      return;
    }
  }
  out.radiance.band = 1;
  // ambient[1..3] are x, y, z; band 1 is in the order y, z, x.
  constexpr std::array<std::size_t, 4> kOrder = {0, 2, 3, 1};
  for (std::size_t i = 0; i < 4; ++i) {
    const double factor = i == 0 ? 1 / (std::numbers::pi * kY0) : 1.5 / (std::numbers::pi * kY1);
    const marker::Rgb& from = light.ambient[kOrder[i]];
    out.radiance.c[i] = {rounded(from[0] * factor), rounded(from[1] * factor), rounded(from[2] * factor)};
  }
}

void MarkerEstimatorImpl::compute_error_bound(Descriptor& out) const {
  // Of what is never seen no bound speaks; the parts are of the normals that were.
  out.bound = {};
  out.bound.total = std::numeric_limits<float>::infinity();
  double squares = 0, noise = 0;
  for (const marker::SurfaceSample& s : shading_.samples)
    squares += s.irradiance[1] * s.irradiance[1], noise += s.sigma[1] * s.sigma[1];
  if (!(squares > 0)) return;
  out.bound.noise = rounded(3 * std::sqrt(noise / squares));
  out.bound.sampling =
      rounded(3 * std::hypot(options_.choice.errors.surface_relative_sigma, options_.choice.errors.surface_sigma_floor));
}

}  // namespace

Result<std::unique_ptr<MarkerEstimator>> make_marker_estimator(const RigParameters& rig, const MarkerBody& body,
                                                               std::unique_ptr<BodyFinder> finder,
                                                               const MarkerOptions& options) {
  if (Status s = options.config.validate(EstimatorKind::marker); !s.ok()) return s;
  if (Status s = body.validate(); !s.ok()) return s;
  if (finder == nullptr) return Status(StatusCode::invalid_argument, "a marker needs a finder of its body");
  bool any = body.ball.has_value();
  for (const MarkerFace& face : body.faces) any = any || !face.patches.empty();
  if (!any)
    return Status(StatusCode::invalid_argument,
                  "the body '" + body.name + "' has neither patches nor a ball: nothing tells light");
  Result<RigTable> table = make_rig_table(rig);
  if (!table) return table.status();
  return std::unique_ptr<MarkerEstimator>(
      std::make_unique<MarkerEstimatorImpl>(rig, std::move(*table), body, std::move(finder), options));
}

}  // namespace lightwell
