#include "estimate/marker/marker_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimate/common/error_bound.hpp"
#include "estimate/common/light_tracker.hpp"
#include "estimate/frames/row_reader.hpp"
#include "estimate/marker/ambient_radiance.hpp"
#include "estimate/marker/light_follower.hpp"

namespace lightwell {
namespace {

/// The frame is dark where the brightest patch is below this multiple of the bias near black.
constexpr double kMinSignalToNoise = 3;
/// Added to each direction's standard deviation: paper is not quite Lambertian, lights are not points.
constexpr double kMinDirectionSigma_rad = 0.02;
/// Largest standard deviation of a direction, that of the body's attitude included, which is certain: 5.3 degrees.
constexpr double kMaxCertainSigma_rad = 0.092;
/// Standard deviation of a light's position across its direction, which counts in that limit alone. A light that is
/// fitted as near may be sheen, a wide lamp, or two lamps: the covariance is that of errors in the mean, but large
/// errors are several times as frequent as of distant lights (the README's section Random scenes).
constexpr double kLightPositionSigma_m = 0.02;
/// Standard deviation of a ball's place on its sheet, along each axis: as of faces (BodyPoseOptions).
constexpr double kBallShiftSigma_m = 0.25e-3;
/// Largest share of patches that may be occluded, nonuniform or outliers. Above it, the occluder may also hide the
/// ground plane or a light, and the remaining samples may be explained by a light that does not exist.
constexpr double kMaxOccludedFraction = 0.25;
/// Variance of an unknown direction, rad².
constexpr double kUnknownDirectionVariance = 1;
/// Albedo that is assumed for saturated patches in a lower bound of the irradiance.
constexpr double kWhitePaperAlbedo = 0.8;

/// Standard deviation of the vignetting of a lens that is calibrated without it: loss per squared angle from the axis,
/// 1/rad². 0.5 is a quarter at 40 degrees; natural vignetting alone (cos^4, Ray 2002, "Applied photographic optics")
/// would be 2, and most cameras correct a part of it.
constexpr double kVignettingSigma = 0.5;

bool has_vignetting(const LensParameters& lens) {
  return std::ranges::any_of(lens.photometry.vignetting, [](double v) { return v != 0; });
}

float rounded(double v) { return static_cast<float>(v); }

class MarkerEstimatorImpl final : public MarkerEstimator {
 public:
  MarkerEstimatorImpl(const RigParameters& rig, const MarkerBody& body, std::unique_ptr<BodyFinder> finder,
                      const MarkerOptions& options)
      : rig_(rig),
        body_(body),
        finder_(std::move(finder)),
        options_(options),
        reader_(rig_),
        sampler_(std::ranges::max(rig.lenses, {}, &LensParameters::width).width, options.sampler),
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
    follower_.reset();
  }
  RadianceScale scale() const override { return scale_; }
  const MarkerReport& report() const override { return report_; }

 private:
  void apply_options() {
    finder_->set_decimation({options_.config.marker.search_decimation, options_.config.marker.decimation});
    sampler_.set_max_faces(options_.config.marker.max_faces);
  }
  /// Finds the body in the first frame of the bracket that shows it, and returns the index of the lens.
  [[nodiscard]] Result<int> find_body(std::span<const Frame> bracket);
  void inflate_covariance_if_occluded();
  void add_pose_covariance();
  void fill_descriptor(Descriptor& out);
  void fill_distance(const marker::LightEstimate& light_estimate, Light& out) const;
  [[nodiscard]] estimate::BoundParts bound_parts() const;

  RigParameters rig_;
  MarkerBody body_;
  std::unique_ptr<BodyFinder> finder_;
  MarkerOptions options_;
  estimate::RowReader reader_;
  marker::MarkerSampler sampler_;
  std::vector<CameraModel> models_;
  estimate::LightTracker tracker_;
  RadianceScale scale_;
  marker::Shading shading_;
  marker::LightFollower follower_;
  MarkerReport report_;
  std::uint32_t calibration_id_;
};

Result<int> MarkerEstimatorImpl::find_body(std::span<const Frame> bracket) {
  for (const Frame& frame : bracket) {
    for (const View& view : frame.views()) {
      const Result<std::optional<DetectedBody>> found = finder_->find(view, frame.info);
      if (!found) return found.status();
      if (!*found) continue;
      report_.body = **found;
      return view.lens;
    }
  }
  follower_.reset();
  return Status(StatusCode::not_found, "no pose of the body '" + body_.name +
                                           "' was found: its tags are not in the picture, too small, dark or blurred, "
                                           "or they contradict each other");
}

Status MarkerEstimatorImpl::estimate(std::span<const Frame> bracket, Descriptor& out) {
  if (Status s = reader_.bind(bracket); !s.ok()) return s;
  const Result<int> found_lens = find_body(bracket);
  if (!found_lens) return found_lens.status();
  const auto lens = static_cast<std::size_t>(*found_lens);
  const LensParameters& parameters = rig_.lenses[lens];
  const marker::PosedBody posed_body(body_, parameters, models_[lens], report_.body.probe_body.pose);
  report_.counts = sampler_.sample(reader_, *found_lens, parameters.width, parameters.height, body_, posed_body,
                                   scale_.factor, report_.body.blur_px.value_or(0), 3, shading_);
  // Float pixels are radiance: nothing is left to correct.
  const bool is_radiance = bracket.front().views().front().format == PixelFormat::rgb_f32;
  shading_.vignetting_sigma = is_radiance || has_vignetting(parameters) ? 0 : kVignettingSigma;
  marker::estimate_ground_reflection(shading_);
  // Channels that are equal in every sample (a grey camera, or grey light) are fitted once.
  const auto grey = [](const marker::SurfaceSample& s) {
    const auto [least, most] = std::minmax({s.irradiance[0], s.irradiance[1], s.irradiance[2]});
    return most - least <= 1e-6 * most;
  };
  if (std::all_of(shading_.samples.begin(), shading_.samples.end(), grey)) shading_.channels = 1;

  report_.light = follower_.estimate({.time = bracket.front().info.mid_exposure,
                                      .probe_body = report_.body.probe_body.pose.rotation,
                                      .to_lens = posed_body.lens(),
                                      .ambiguous = report_.body.ambiguous},
                                     shading_, std::min(marker::kMaxPointLights, options_.config.max_lights));
  inflate_covariance_if_occluded();
  add_pose_covariance();

  estimate::fill_header(bracket, {scale_.units, options_.probe_id, calibration_id_, options_.config.setting}, out);
  out.T_probe_origin = posed_body.probe_origin();
  out.flicker = Flicker::unknown;
  out.environment.reset();
  fill_descriptor(out);
  // Flag::unseen is always set: there is no finite bound for directions that were not observed.
  out.bound = estimate::error_bound(bound_parts(), out.flags);
  return {};
}

/// Directions are not reliable where a large part of the body is occluded.
void MarkerEstimatorImpl::inflate_covariance_if_occluded() {
  const marker::SampleCounts& counts = report_.counts;
  if (counts.nonuniform + counts.occluded + report_.light.outliers <= kMaxOccludedFraction * counts.patches) return;
  report_.light.uncertain = true;
  report_.light.localized = false;
  for (marker::LightEstimate& light_estimate : report_.light.lights) {
    light_estimate.uncertain = true;
    light_estimate.direction_covariance[0] += kUnknownDirectionVariance;
    light_estimate.direction_covariance[2] += kUnknownDirectionVariance;
  }
}

/// The error of the body's attitude rotates all directions. A ball that is glued beside its place has other normals at
/// the same pixels: turned by the shift divided by its radius. A light above kMaxCertainSigma_rad becomes uncertain.
void MarkerEstimatorImpl::add_pose_covariance() {
  const PoseCovariance& c = report_.body.probe_body.covariance;
  const double turn = body_.ball ? kBallShiftSigma_m / body_.ball->radius_m : 0;
  const double every = kMinDirectionSigma_rad * kMinDirectionSigma_rad + turn * turn;
  for (marker::LightEstimate& light_estimate : report_.light.lights) {
    const auto [uu, uv, vv] = direction_covariance(light_estimate.light.direction, c);
    light_estimate.direction_covariance[0] += uu + every;
    light_estimate.direction_covariance[1] += uv;
    light_estimate.direction_covariance[2] += vv + every;
    const double of_position = kLightPositionSigma_m * light_estimate.light.inverse_distance;
    if (!(std::hypot(marker::worst_sigma(light_estimate.direction_covariance), of_position) <= kMaxCertainSigma_rad))
      light_estimate.uncertain = true;
  }
  if (!report_.light.lights.empty() && report_.light.lights[0].uncertain) report_.light.uncertain = true;
}

void MarkerEstimatorImpl::fill_descriptor(Descriptor& out) {
  marker::LightingEstimate& lighting = report_.light;
  const marker::SampleCounts& counts = report_.counts;
  out.flags = {};
  // Light on the side that is turned away from the lens is not observed.
  out.flags.set(Flag::unseen);
  if (counts.clipped > 0) out.flags.set(Flag::clipped);
  if (counts.invalid_pixels > 0) out.flags.set(Flag::cleaned);
  const bool dark = !(counts.brightest > kMinSignalToNoise * counts.near_black_bias) || !(counts.brightest > 0);
  if (dark) out.flags.set(Flag::dark);
  const bool blurred = report_.body.blur_px.value_or(0) > marker::kMaxBlur_px;
  if (lighting.uncertain || report_.body.ambiguous || dark || blurred) out.flags.set(Flag::unsure);
  if (dark) {
    lighting = {};
    lighting.uncertain = true;
  } else if (shading_.samples.empty()) {
    // All patches are saturated: a lower bound of the ambient irradiance.
    for (double& v : lighting.ambient[0]) v = std::numbers::pi * counts.brightest / kWhitePaperAlbedo;
  }

  out.radiance = marker::ambient_radiance(lighting, options_.config.band);
  out.radiance_step = 0;
  out.lights.clear();
  for (const marker::LightEstimate& light_estimate : lighting.lights) {
    Light one;
    one.direction = vec_cast<float>(light_estimate.light.direction);
    const marker::Rgb& e = light_estimate.light.irradiance;
    if (!(e[0] + e[1] + e[2] > 0)) continue;
    one.irradiance = {rounded(e[0]), rounded(e[1]), rounded(e[2])};
    one.direction_covariance = {rounded(light_estimate.direction_covariance[0]),
                                rounded(light_estimate.direction_covariance[1]),
                                rounded(light_estimate.direction_covariance[2])};
    fill_distance(light_estimate, one);
    out.lights.push_back(one);
  }
  tracker_.assign(out.lights, out.time.mid_exposure);
  const marker::SphereCoverage shares = marker::sphere_coverage(sampler_.surfaces());
  out.coverage = rounded(shares.coverage);
  out.saturated = rounded(shares.saturated);
}

/// Sets the distance where it is observable, and the light's direction and the body's attitude are known.
void MarkerEstimatorImpl::fill_distance(const marker::LightEstimate& light_estimate, Light& out) const {
  if (!light_estimate.distance_observable || light_estimate.uncertain || report_.body.ambiguous) return;
  out.distance_m = rounded(light_estimate.distance_m());
  out.distance_sigma_m = rounded(light_estimate.distance_sigma_m());
}

/// The parts refer to the normals that were observed.
estimate::BoundParts MarkerEstimatorImpl::bound_parts() const {
  double squares = 0, noise = 0;
  for (const marker::SurfaceSample& s : shading_.samples)
    squares += s.irradiance[1] * s.irradiance[1], noise += s.sigma[1] * s.sigma[1];
  if (!(squares > 0)) return {};
  return {.sampling = 3 * std::hypot(marker::kSurfaceRelativeSigma, marker::kSurfaceSigmaFloor),
          .noise = 3 * std::sqrt(noise / squares)};
}

}  // namespace

Result<std::unique_ptr<MarkerEstimator>> make_marker_estimator(const RigParameters& rig, const MarkerBody& body,
                                                               std::unique_ptr<BodyFinder> finder,
                                                               const MarkerOptions& options) {
  if (Status s = options.config.validate(EstimatorKind::marker); !s.ok()) return s;
  if (Status s = rig.validate(); !s.ok()) return s;
  if (Status s = body.validate(); !s.ok()) return s;
  if (finder == nullptr) return invalid_argument("make_marker_estimator: the body finder is null");
  bool any = body.ball.has_value();
  for (const MarkerFace& face : body.faces) any = any || !face.patches.empty();
  if (!any)
    return invalid_argument("the body '" + body.name +
                            "' has neither patches nor a ball: light cannot be measured from it");
  return std::unique_ptr<MarkerEstimator>(std::make_unique<MarkerEstimatorImpl>(rig, body, std::move(finder), options));
}

}  // namespace lightwell
