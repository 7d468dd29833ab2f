#include "estimate/panorama/panorama_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include <lightwell/codec.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/descriptor_header.hpp"
#include "estimate/common/descriptor_optimizer.hpp"
#include "estimate/common/environment.hpp"
#include "estimate/common/flicker.hpp"
#include "estimate/common/light_tracker.hpp"
#include "estimate/common/row_reader.hpp"
#include "estimate/common/smoother.hpp"
#include "estimate/common/spectrum.hpp"
#include "estimate/panorama/clipped_lights.hpp"
#include "estimate/panorama/row_profiler.hpp"
#include "estimate/panorama/sphere_integrator.hpp"

namespace lightwell {
namespace {

using namespace estimate;

constexpr double kSphere = 4 * std::numbers::pi;
/// Approximate edge of a block. Smaller blocks take more time and have the same error (lightwell-eval --pareto).
constexpr double kBlockRad = 3.2 * std::numbers::pi / 180;
constexpr int kMaxBlockEdge = 16;

/// Relative error of the irradiance of a smooth sphere through pixels and blocks of finite size; measured on the eight
/// panoramas, see estimate/README.md.
constexpr double kSmoothSampling = 1e-3;
/// Relative error of the irradiance per squared side of a pixel, rad²: edges of bright regions fall anywhere in pixels.
constexpr double kPixelSampling = 0.5;

/// Expected error relative to the sampling part of the bound, which sums absolute values.
constexpr double kExpectedSamplingShare = 0.3;
/// Smallest share of the light in blocks with motion for which a bracket is flagged `moved`.
constexpr double kMotionThreshold = 0.005;

/// The power of two nearest to kBlockRad in pixels of this rig.
int default_edge(const RigTable& table) {
  const double exponent = std::round(std::log2(std::max(1.0, kBlockRad / pixel_side(table))));
  return std::min(kMaxBlockEdge, 1 << static_cast<int>(std::clamp(exponent, 0.0, 6.0)));
}

/// RMS change of the irradiance by three sigma of the lights' directions. Rotating a light of irradiance E by delta
/// changes the irradiance by E delta times the slope of a clipped cosine, whose mean square over all normals is 1/6.
IrradianceRms direction_error_rms(std::span<const Light> lights) {
  double squares[3] = {};
  for (const Light& light : lights) {
    const double direction_variance = light.direction_covariance[0] + light.direction_covariance[2];
    for (int k = 0; k < 3; ++k) squares[k] += 9 * direction_variance / 6 * light.irradiance[k] * light.irradiance[k];
  }
  return rms(squares);
}

class PanoramaEstimator final : public Estimator {
 public:
  PanoramaEstimator(const RigParameters& rig, RigTable table, const PanoramaOptions& options)
      : rig_(rig),
        table_(std::move(table)),
        reader_(rig_, table_),
        profiler_(rig_, table_),
        config_(config_for_setting(options.config)),
        pixel_rad_(pixel_side(table_)),
        probe_id_(options.probe_id),
        calibration_id_(calibration_identity(rig)) {
    if (rig.nits_per_unit > 0) scale_ = {Units::absolute, rig.nits_per_unit};
    integral_.lights.reserve(kMaxLights + 1);
    clipped_tracks_.reserve(kMaxLights + 1);
    clipped_.reserve(kMaxLights + 1);
    if (options.grey_patch) patch_.emplace(*options.grey_patch, table_), patch_normal_ = options.grey_patch->normal;
    int edge = options.block_edge > 0 ? options.block_edge : default_edge(table_);
    integrator_.emplace(rig_, table_, edge);
    // With coarse pixels, blocks may be too few for the least-squares fit: halve their edge.
    while (options.block_edge == 0 && edge > 1 && integrator_->grid().whole_sphere() && !integrator_->grid().fitted())
      integrator_.emplace(rig_, table_, edge /= 2);
    reset_mapper();
    residual_sums_.reserve(integrator_->cell_directions().size());
    for (std::size_t lens = 0; lens < table_.lenses.size(); ++lens)
      profile_[lens].reserve(static_cast<std::size_t>(table_.lenses[lens].height));
  }

  Status estimate(std::span<const Frame> bracket, Descriptor& out) override;

  EstimatorKind kind() const override { return EstimatorKind::panorama; }
  Status configure(const EstimatorConfig& config) override {
    if (Status s = config.validate(kind()); !s.ok()) return s;
    const bool map_options_changed = config.panorama.environment_edge != config_.panorama.environment_edge ||
                                     config.panorama.environment_rate != config_.panorama.environment_rate;
    config_ = config_for_setting(config);
    if (map_options_changed) reset_mapper();
    return {};
  }

  void set_scale(RadianceScale scale) override {
    scale_ = scale;
    smoother_.reset();
    recovery_ = {};
  }
  RadianceScale scale() const override { return scale_; }
  std::span<const ClippedLight> clipped_lights() const override { return clipped_; }
  void set_recovery(const Recovery& recovery) override { recovery_ = recovery; }

 private:
  /// Errors relative to the RMS irradiance. All zero where there is no light.
  struct RelativeErrors {
    double rms = 0;  ///< RMS irradiance, the denominator of the others; in units of the sums times `factor`.
    double noise = 0, near_black_bias = 0, sampling = 0;  ///< Noise: one sigma. Sampling: part of the bound.
  };
  [[nodiscard]] RelativeErrors relative_errors(double factor) const;
  [[nodiscard]] OptimizerOptions limits(const RelativeErrors& errors) const;
  [[nodiscard]] int light_search_limit();
  void reset_mapper();
  void make_map(Descriptor& out);
  [[nodiscard]] Flicker detect_flicker(std::span<const Frame> bracket);
  void update_errors(Descriptor& out);
  void find_clipped();
  void recover_clipped(Descriptor& out);
  void compute_error_bound(const IrradianceRms& smoothed, Descriptor& out) const;

  RigParameters rig_;
  RigTable table_;
  RowReader reader_;
  RowProfiler profiler_;
  std::optional<SphereIntegrator> integrator_;  ///< Always set.
  std::optional<EnvironmentMapper> mapper_;
  bool mapper_is_new_ = true;  ///< None of its maps was sent yet.
  FlickerDetector flicker_;
  bool flicker_of_brackets_ = false;  ///< The detector's frames are exposures of brackets.
  std::array<std::vector<float>, kMaxLenses> profile_;
  std::vector<CellSum> residual_sums_;
  LightTracker tracker_;
  Smoother smoother_;
  DescriptorOptimizer optimizer_;
  EstimatorConfig config_;  ///< With the limits of its setting applied.
  RadianceScale scale_;
  double pixel_rad_;
  std::uint32_t probe_id_, calibration_id_;
  FrameIntegral integral_;
  OptimizedDescriptor optimized_;
  RelativeErrors errors_;
  std::optional<GreyPatchReader> patch_;
  Vec3f patch_normal_;
  std::vector<std::uint32_t> clipped_tracks_;
  std::vector<ClippedLight> clipped_;  ///< Of the last estimate.
  Recovery recovery_;
  double recovery_error_ = 0;  ///< Of the recovered lights, relative to the RMS irradiance.
};

Status PanoramaEstimator::estimate(std::span<const Frame> bracket, Descriptor& out) {
  if (Status s = reader_.bind(bracket); !s.ok()) return s;
  integrator_->integrate(reader_, bracket, config_, integral_);
  integrator_->find_lights(reader_, light_search_limit(), integral_);

  // Scaled first, so that lights, residual and bound have the same units.
  const auto factor = static_cast<float>(scale_.factor);
  for (auto& c : integral_.projection.c)
    for (double& v : c) v *= scale_.factor;
  for (Light& light : integral_.lights) light.irradiance = light.irradiance * factor;
  fill_header(bracket, {scale_.units, probe_id_, calibration_id_, config_.setting}, out);

  tracker_.assign(integral_.lights, out.time.mid_exposure);
  find_clipped();

  // Independent noise of pixels affects the irradiance by the mean square of the clipped cosine, 1/6.
  const double noise_rms = std::sqrt(integrator_->sums().noise / 6) * scale_.factor;
  IrradianceRms smoothed;
  if (config_.panorama.smoothing == Smoothing::one_euro)
    smoothed = smoother_.apply(integral_.projection, integral_.lights, out.time.mid_exposure, noise_rms);

  update_errors(out);
  optimizer_.optimize(integral_.projection, integral_.lights, integral_.required_light, limits(errors_), out.lights,
                      optimized_);
  out.radiance = optimized_.residual;
  out.radiance_step = optimized_.step;
  make_map(out);
  out.coverage = static_cast<float>(std::clamp(integral_.observed_sr / kSphere, 0.0, 1.0));
  out.saturated =
      static_cast<float>(std::clamp(integrator_->sums().clipped_sr / std::max(integral_.observed_sr, 1e-12), 0.0, 1.0));
  out.flicker = detect_flicker(bracket);
  recover_clipped(out);
  compute_error_bound(smoothed, out);
  return {};
}

int PanoramaEstimator::light_search_limit() {
  return optimizer_.max_lights_to_find(
      integral_.projection, integral_.lights.empty() ? nullptr : &integral_.lights.front(), limits(relative_errors(1)));
}

void PanoramaEstimator::reset_mapper() {
  mapper_.reset();
  mapper_is_new_ = true;
  if (config_.panorama.environment_edge == 0) return;
  mapper_.emplace(integrator_->cell_directions(), integrator_->cell_solid_angles(), config_.panorama.environment_edge,
                  EnvironmentUpdateOptions{.rate_hz = config_.panorama.environment_rate});
}

void PanoramaEstimator::make_map(Descriptor& out) {
  // Changes refer to maps of the same mapper.
  if (!mapper_ || mapper_is_new_) out.environment.reset();
  if (!mapper_) return;
  mapper_is_new_ = false;
  residual_sums_.clear();
  if (mapper_->due(out.time.mid_exposure)) {
    std::array<std::size_t, kMaxLights> sent{};
    std::size_t count = 0;
    for (std::size_t k = 0; k < integral_.lights.size(); ++k)
      for (const Light& light : out.lights)
        if (light.track == integral_.lights[k].track && count < sent.size()) sent[count++] = k;
    integrator_->residual_cell_sums({sent.data(), count}, residual_sums_);
  }
  mapper_->update(residual_sums_, scale_.factor, out.time.mid_exposure, out.environment);
}

Flicker PanoramaEstimator::detect_flicker(std::span<const Frame> bracket) {
  // Merged rows of a bracket have no common time: each exposure is evaluated by itself.
  const bool brackets = bracket.size() > 1;
  if (flicker_of_brackets_ != brackets) flicker_.reset();
  flicker_of_brackets_ = brackets;
  if (brackets) {
    for (const Frame& exposure : bracket) (void)flicker_.add(exposure.info, profiler_.profile(exposure));
    return flicker_.state();
  }
  std::array<RowProfile, kMaxLenses> rows;
  const std::size_t lenses = bracket[0].views().size();
  if (lenses != table_.lenses.size()) return flicker_.state();
  for (std::size_t lens = 0; lens < lenses; ++lens) {
    integrator_->row_profile(static_cast<int>(lens), profile_[lens]);
    rows[lens] = {profile_[lens], table_.lenses[lens].height, integrator_->layout().edge()};
  }
  return flicker_.add(bracket[0].info, {rows.data(), lenses});
}

/// Sets the flags and errors_ that do not depend on the selection of lights and bands.
void PanoramaEstimator::update_errors(Descriptor& out) {
  out.flags = {};
  const BlockSums& sums = integrator_->sums();
  if (integral_.observed_sr < kFullCoverage * kSphere) out.flags.set(Flag::unseen);
  if (integral_.filled) out.flags.set(Flag::filled);
  if (sums.clipped_sr > 0) out.flags.set(Flag::clipped);
  if (sums.counts.invalid_pixels > 0) out.flags.set(Flag::cleaned);
  const auto& mean = integral_.projection.c[0];
  const double luminance = std::sqrt(kSphere) * luminance_of(mean[0], mean[1], mean[2]);
  if (sums.motion_luminance * scale_.factor > kMotionThreshold * luminance) out.flags.set(Flag::moved);
  errors_ = relative_errors(scale_.factor);
  if (!(errors_.rms > 0) || errors_.near_black_bias + 3 * errors_.noise >= 1) out.flags.set(Flag::dark);
}

PanoramaEstimator::RelativeErrors PanoramaEstimator::relative_errors(double factor) const {
  const BlockSums& sums = integrator_->sums();
  const IrradianceRms scene_rms = irradiance_rms(integral_.projection);
  RelativeErrors out;
  out.rms = std::min(scene_rms.plain, scene_rms.weighted);
  if (!(out.rms > 0)) return out;
  out.noise = std::sqrt(sums.noise / 6) * factor / out.rms;
  // A bias that is uniform over the sphere causes an irradiance of a quarter of its integral.
  out.near_black_bias = sums.bias / 4 * factor / out.rms;
  out.sampling = kSmoothSampling + kPixelSampling * pixel_rad_ * pixel_rad_ +
                 (integrator_->grid().fitted() ? 0 : integrator_->grid().gram_deviation()) +
                 (integral_.centroid_offset + integral_.chroma_edge_error) * factor / std::sqrt(6.0) / out.rms;
  return out;
}

OptimizerOptions PanoramaEstimator::limits(const RelativeErrors& errors) const {
  return {config_.band, config_.max_lights, config_.panorama.epsilon, config_.panorama.radiance_epsilon,
          std::hypot(errors.noise, kExpectedSamplingShare * errors.sampling)};
}

void PanoramaEstimator::find_clipped() {
  clipped_tracks_.clear();
  if (!(integrator_->sums().clipped_sr > 0)) return;
  find_clipped_lights(integrator_->sums(), integrator_->grid(), integral_.lights, clipped_tracks_);
  // Only lights that are sent can be recovered.
  if (!clipped_tracks_.empty())
    for (std::size_t k = integral_.lights.size(); k-- > 0;)
      if (integral_.lights[k].track == clipped_tracks_.front()) integral_.required_light = static_cast<int>(k);
}

void PanoramaEstimator::recover_clipped(Descriptor& out) {
  clipped_.clear();
  for (const std::uint32_t track : clipped_tracks_)
    for (const Light& light : out.lights)
      if (light.track == track) clipped_.push_back({track, light.irradiance});
  if (clipped_.size() != clipped_tracks_.size()) clipped_.clear();
  if (patch_ && !clipped_.empty()) {
    const std::optional<double> e = patch_->irradiance(reader_, integrator_->layout());
    // Where the patch cannot be read, the previous recovery is kept.
    if (e) (void)recover(out, clipped_, {patch_normal_, *e * scale_.factor}, recovery_);
  }
  const RecoveryResult recovered = apply(recovery_, clipped_, out);
  // A light affects the RMS irradiance by the root mean square of the clipped cosine, 1/sqrt(6).
  recovery_error_ = errors_.rms > 0 ? recovered.uncertainty / std::sqrt(6.0) / errors_.rms : 0;
  if (recovered.all) out.flags.set(Flag::recovered);
}

void PanoramaEstimator::compute_error_bound(const IrradianceRms& smoothed, Descriptor& out) const {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  out.bound = {};
  if (out.flags.has(Flag::dark)) {
    out.bound.total = static_cast<float>(kInfinite);
    return;
  }
  const double noise = 3 * errors_.noise + errors_.near_black_bias;
  const double truncation = relative(optimized_.truncation, optimized_.scene_rms);
  const double sampling =
      errors_.sampling + relative(direction_error_rms(out.lights), optimized_.scene_rms) + recovery_error_;
  const double quantization = wire_error(out, errors_.rms);
  // Smoothing removes noise; only the difference beyond three sigma of the noise can be light.
  const double smoothing = std::max(0.0, relative(smoothed, optimized_.scene_rms) - 3 * errors_.noise);
  out.bound.truncation = static_cast<float>(truncation);
  out.bound.sampling = static_cast<float>(sampling);
  out.bound.noise = static_cast<float>(noise);
  out.bound.quantization = static_cast<float>(quantization);
  out.bound.smoothing = static_cast<float>(smoothing);
  // The parts may be correlated: they are summed, not added in quadrature.
  const bool unbounded =
      out.flags.has(Flag::unseen) || (out.flags.has(Flag::clipped) && !out.flags.has(Flag::recovered));
  out.bound.total =
      static_cast<float>(unbounded ? kInfinite : truncation + sampling + noise + quantization + smoothing);
}

}  // namespace

Result<std::unique_ptr<Estimator>> make_panorama_estimator(const RigParameters& rig, const PanoramaOptions& options) {
  if (Status s = options.config.validate(EstimatorKind::panorama); !s.ok()) return s;
  const int edge = options.block_edge;
  if (edge < 0 || edge > kMaxBlockEdge || (edge & (edge - 1)) != 0)
    return Status(StatusCode::invalid_argument,
                  "block_edge is " + std::to_string(edge) + "; it must be 0 or a power of two up to 16");
  if (options.grey_patch)
    if (Status s = options.grey_patch->validate(rig); !s.ok()) return s;
  Result<RigTable> table = make_rig_table(rig);
  if (!table) return table.status();
  if (!(table->covered_sr > 0))
    return Status(StatusCode::invalid_argument, "calibration: no pixel has a direction; check fx, fy, cx, cy");
  return std::unique_ptr<Estimator>(std::make_unique<PanoramaEstimator>(rig, std::move(*table), options));
}

}  // namespace lightwell
