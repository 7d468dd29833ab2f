#include "estimate/specular/specular_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "estimate/common/error_bound.hpp"
#include "estimate/frames/row_reader.hpp"
#include "estimate/panorama/panorama_estimator.hpp"
#include "estimate/specular/captured_plane.hpp"
#include "estimate/specular/environment_picture.hpp"

namespace lightwell {
namespace {

/// Smallest share of the directions above specular::kGrazing_rad for which a bound is stated, and for which the lights
/// are complete.
constexpr double kMinSeen = 0.03, kCompleteSeen = 0.75;
/// Largest standard deviation of the scale for which the light counts as sure.
constexpr double kMaxScaleSigma = 0.25;
/// Error of the irradiance by directions that were not seen, relative to their share. Their total is limited by the
/// irradiance that the diffuse texture shows; their distribution is a guess.
constexpr double kGuessError = 0.25;
/// Error of the irradiance by the division of recovered light among saturated lights, relative to their share.
constexpr double kRecoveredError = 0.75;
/// Largest share of recovered light for which the light counts as sure.
constexpr double kMaxRecovered = 0.25;
/// Error of the irradiance by the deconvolution: light at the edges of what a lobe resolves.
constexpr double kDeconvolutionError = 0.03;
/// Standard deviation of a light's direction: of the alignment and the grid, relative to the lobe's half width, and
/// relative to the light's radius (a part of a window may be saturated, or in directions that no frame saw).
constexpr double kDirectionSigma_rad = 0.009, kLobeSigma = 0.1, kExtentSigma = 0.25;

class SpecularEstimatorImpl final : public SpecularEstimator {
 public:
  SpecularEstimatorImpl(const RigParameters& rig, const GlossyPlane& plane, std::unique_ptr<BodyFinder> finder,
                        std::unique_ptr<Estimator> panorama, const SpecularOptions& options)
      : rig_(rig),
        plane_(plane),
        finder_(std::move(finder)),
        panorama_(std::move(panorama)),
        options_(options),
        reader_(rig_),
        capture_(rig_, options.capture),
        calibration_id_(calibration_identity(rig)) {
    if (plane.white_albedo) white_ = {*plane.white_albedo, specular::kGivenAlbedoSigma};
    plane_out_.info.capture = options.plane_capture;
    set_scale(rig.nits_per_unit > 0 ? RadianceScale{Units::absolute, rig.nits_per_unit} : RadianceScale{});
  }

  Status estimate(std::span<const Frame> bracket, Descriptor& out) override;

  EstimatorKind kind() const override { return EstimatorKind::specular; }
  Status configure(const EstimatorConfig& config) override {
    if (Status s = config.validate(kind()); !s.ok()) return s;
    if (Status s = panorama_->configure(panorama_config(config)); !s.ok()) return s;
    options_.config = config;
    return {};
  }
  void set_scale(RadianceScale scale) override { panorama_->set_scale(scale); }
  RadianceScale scale() const override { return panorama_->scale(); }
  const CapturedPlane* captured_plane() override;
  const specular::PlaneCapture& capture() const override { return capture_; }
  const specular::GlossEstimate* gloss() const override { return estimator_->last(); }
  bool estimating() const override { return estimator_->running(); }
  void finish() override {
    capture_.solve(kFinalSweeps);
    estimator_.emplace();
    begin_light(specular::RoughnessMode::search);
    estimator_->step(specular::WorkBudget::kUnlimited);
  }

  /// The options of the estimator that describes the environment: it has no noise that needs smoothing.
  [[nodiscard]] static EstimatorConfig panorama_config(const EstimatorConfig& config) {
    EstimatorConfig out;
    out.band = config.band;
    out.max_lights = config.max_lights;
    out.panorama.smoothing = Smoothing::none;
    // All lights that were found: objects on the plane cast shadows.
    out.panorama.epsilon = 0;
    out.panorama.environment_edge = config.specular.environment_edge;
    return out;
  }

 private:
  static constexpr int kFinalSweeps = 3;

  struct FoundPlane {
    UncertainPose probe_plane;
    ProbeTime mid_exposure;
    int lens = 0;
    bool ambiguous = false;
  };
  /// In the first frame of the bracket that shows it.
  [[nodiscard]] Result<FoundPlane> find_plane(std::span<const Frame> bracket);
  void begin_light(specular::RoughnessMode mode);
  /// A step of the environment's estimate, or the start of another one.
  void continue_light();
  void adjust(const FoundPlane& found, const specular::GlossEstimate& gloss, Descriptor& out) const;

  RigParameters rig_;
  GlossyPlane plane_;
  std::unique_ptr<BodyFinder> finder_;
  std::unique_ptr<Estimator> panorama_;  ///< Of EnvironmentPicture.
  SpecularOptions options_;
  estimate::RowReader reader_;
  specular::PlaneCapture capture_;
  std::optional<specular::GlossEstimator> estimator_{std::in_place};  ///< Always has a value.
  specular::EnvironmentPicture picture_;
  specular::WhiteAlbedo white_;
  CapturedPlane plane_out_;  ///< Identity, time and pose are set by estimate(), all else by captured_plane().
  std::uint32_t calibration_id_, frames_ = 0;
  int since_begin_ = 0, sweeps_at_begin_ = 0, restarts_ = 0;
  /// Exposure (s) times gain of the first frame: the unit of the captured radiance is its full scale.
  double exposure_ = 0;
};

Result<SpecularEstimatorImpl::FoundPlane> SpecularEstimatorImpl::find_plane(std::span<const Frame> bracket) {
  for (const Frame& frame : bracket)
    for (const View& view : frame.views()) {
      const Result<std::optional<DetectedBody>> found = finder_->find(view, frame.info);
      if (!found) return found.status();
      if (*found) return FoundPlane{(*found)->probe_body, frame.info.mid_exposure, view.lens, (*found)->ambiguous};
    }
  return Status(StatusCode::not_found, "no pose of the plane '" + plane_.name +
                                           "' was found: its tags are not in the picture, too small, dark or blurred, "
                                           "or they contradict each other");
}

void SpecularEstimatorImpl::begin_light(specular::RoughnessMode mode) {
  const specular::ReflectanceSeparation& separation = capture_.separation();
  estimator_->begin(separation.specular(), separation.diffuse(), white_, mode);
  since_begin_ = 0;
  sweeps_at_begin_ = separation.sweeps();
}

void SpecularEstimatorImpl::continue_light() {
  ++since_begin_;
  if (estimator_->running()) {
    estimator_->step(options_.light_operations);
    return;
  }
  const bool is_new = capture_.separation().sweeps() != sweeps_at_begin_;
  const bool is_due = gloss() == nullptr || since_begin_ >= options_.frames_between_estimates;
  if (estimator_->searching() || (is_new && is_due)) begin_light(specular::RoughnessMode::track);
}

Status SpecularEstimatorImpl::estimate(std::span<const Frame> bracket, Descriptor& out) {
  if (Status s = reader_.bind(bracket); !s.ok()) return s;
  const Result<FoundPlane> found = find_plane(bracket);
  if (!found) return found.status();
  if (exposure_ == 0) exposure_ = bracket.front().info.exposure_s * bracket.front().info.gain;
  // A mirrored attitude would spoil the texture.
  if (!found->ambiguous && capture_.add(reader_, found->lens, found->probe_plane, frames_, exposure_).stored) {
    plane_out_.info.mid_exposure = found->mid_exposure;
    plane_out_.info.T_probe_plane = found->probe_plane.pose;
  }
  if (capture_.restarts() != restarts_) {
    // What was estimated is the former light.
    restarts_ = capture_.restarts();
    estimator_.emplace();
    sweeps_at_begin_ = capture_.separation().sweeps();
  }
  ++frames_;
  continue_light();
  const specular::GlossEstimate* estimated = gloss();
  std::optional<specular::GlossEstimate> uniform;
  if (estimated == nullptr) uniform = specular::uniform_estimate(capture_.separation().diffuse(), white_);
  if (estimated == nullptr && !uniform)
    return Status(StatusCode::not_found, "the plane '" + plane_.name +
                                             "' has not been seen yet: its tags are in the "
                                             "picture, its surface is not, or it is saturated or covered");
  const specular::GlossEstimate& gloss = estimated != nullptr ? *estimated : *uniform;
  picture_.render(gloss, found->probe_plane.pose);
  FrameInfo info = bracket.front().info;
  info.exposure_s = exposure_, info.gain = 1, info.row_readout = {};
  info.bracket_index = 0, info.bracket_size = 1;
  const Frame environment = picture_.frame(info);
  if (Status s = panorama_->estimate({&environment, 1}, out); !s.ok()) return s;
  estimate::fill_header(bracket, {scale().units, options_.probe_id, calibration_id_, options_.config.setting}, out);
  adjust(*found, gloss, out);
  return {};
}

const CapturedPlane* SpecularEstimatorImpl::captured_plane() {
  if (!plane_out_.info.T_probe_plane) return nullptr;
  plane_out_.info.units = scale().units;
  specular::fill_captured_plane(capture_, gloss(), static_cast<float>(scale().factor / exposure_), plane_out_);
  return &plane_out_;
}

/// What the description of the environment's picture does not know: how the environment was found.
void SpecularEstimatorImpl::adjust(const FoundPlane& found, const specular::GlossEstimate& gloss,
                                   Descriptor& out) const {
  out.T_probe_origin = found.probe_plane.pose;
  out.flicker = Flicker::unknown;
  // Half of the sphere is the plane.
  out.coverage = static_cast<float>(0.5 + 0.5 * gloss.seen);
  out.saturated = static_cast<float>(gloss.saturated * 0.5 * gloss.seen / (0.5 + 0.5 * gloss.seen));
  if (gloss.seen < kMinSeen || !gloss.glossy) out.flags.set(Flag::unseen);
  if (gloss.saturated > 0) {
    out.flags.set(Flag::clipped);
    if (gloss.glossy) out.flags.set(Flag::recovered);
  }
  if (!gloss.glossy || gloss.provisional || found.ambiguous || gloss.scale_sigma > kMaxScaleSigma ||
      gloss.seen < kCompleteSeen || gloss.recovered > kMaxRecovered)
    out.flags.set(Flag::unsure);
  const double half_width = SpecularBrdf::half_width_rad(gloss.alpha);
  for (Light& light : out.lights) {
    const auto [uu, uv, vv] = direction_covariance(vec_cast<double>(light.direction), found.probe_plane.covariance);
    const double extent = kExtentSigma * static_cast<double>(light.angular_radius_rad);
    const double sigma = std::hypot(kDirectionSigma_rad, kLobeSigma * half_width, extent);
    light.direction_covariance[0] += static_cast<float>(uu + sigma * sigma);
    light.direction_covariance[1] += static_cast<float>(uv);
    light.direction_covariance[2] += static_cast<float>(vv + sigma * sigma);
  }
  const ErrorBound& picture = out.bound;
  out.bound = estimate::error_bound({.truncation = static_cast<double>(picture.truncation),
                                     .sampling = static_cast<double>(picture.sampling) + kGuessError * gloss.guessed +
                                                 kRecoveredError * gloss.recovered,
                                     .noise = kDeconvolutionError + gloss.scale_sigma,
                                     .quantization = static_cast<double>(picture.quantization),
                                     .smoothing = static_cast<double>(picture.smoothing)},
                                    out.flags);
}

}  // namespace

Result<std::unique_ptr<SpecularEstimator>> make_specular_estimator(const RigParameters& rig, const GlossyPlane& plane,
                                                                   std::unique_ptr<BodyFinder> finder,
                                                                   const SpecularOptions& options) {
  if (finder == nullptr) return invalid_argument("finder: none is given");
  if (Status s = rig.validate(); !s.ok()) return s;
  if (Status s = plane.validate(); !s.ok()) return s;
  if (Status s = options.config.validate(EstimatorKind::specular); !s.ok()) return s;
  if (const int edge = options.capture.texels.edge; edge < 8 || edge > 256 || edge % specular::kTileEdge != 0)
    return invalid_argument("capture.texels.edge must be a multiple of 4, 8 to 256");
  if (options.frames_between_estimates < 1) return invalid_argument("frames_between_estimates must be at least 1");
  if (options.light_operations < 1) return invalid_argument("light_operations must be at least 1");
  if (options.plane_capture == 0) return invalid_argument("plane_capture must not be 0");
  SpecularOptions with_size = options;
  with_size.capture.texels.size_m = plane.side_m;
  PanoramaOptions panorama;
  panorama.config = SpecularEstimatorImpl::panorama_config(options.config);
  panorama.probe_id = options.probe_id;
  Result<std::unique_ptr<Estimator>> described = make_panorama_estimator(specular::EnvironmentPicture::rig(), panorama);
  if (!described) return described.status();
  return std::unique_ptr<SpecularEstimator>(
      std::make_unique<SpecularEstimatorImpl>(rig, plane, std::move(finder), std::move(*described), with_size));
}

}  // namespace lightwell
