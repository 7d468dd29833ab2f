#include "estimate/panorama/panorama_estimator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/descriptor_optimizer.hpp"
#include "estimate/common/environment_lights.hpp"
#include "estimate/common/environment_updates.hpp"
#include "estimate/common/error_bound.hpp"
#include "estimate/common/light_tracker.hpp"
#include "estimate/common/size_budget.hpp"
#include "estimate/common/smoother.hpp"
#include "estimate/frames/flicker.hpp"
#include "estimate/frames/row_reader.hpp"
#include "estimate/panorama/grey_patch_reader.hpp"
#include "estimate/panorama/light_finder.hpp"
#include "estimate/panorama/light_texels.hpp"
#include "estimate/panorama/row_profiler.hpp"
#include "estimate/panorama/sphere_integrator.hpp"
#include "estimate/panorama/texel_sums.hpp"

namespace lightwell {
namespace {

using namespace estimate;

/// Approximate edge of a block. Smaller blocks take more time and have the same error (lightwell-eval --pareto).
constexpr double kBlockRad = 3.2 * std::numbers::pi / 180;
constexpr int kMaxBlockEdge = 16;
/// Smallest share of the light that moves between the exposures of a bracket, or that changed where an interleaved
/// frame did not read, for which `moved` is set.
constexpr double kMotionThreshold = 0.005;

/// The power of two nearest to kBlockRad in pixels of this rig.
int default_edge(const RigTable& table) {
  const double exponent = std::round(std::log2(std::max(1.0, kBlockRad / pixel_side(table))));
  return std::min(kMaxBlockEdge, 1 << static_cast<int>(std::clamp(exponent, 0.0, 6.0)));
}

/// `block_edge`: 0 selects it.
std::unique_ptr<SphereIntegrator> make_integrator(const RigParameters& rig, const RigTable& table, int block_edge) {
  int edge = block_edge > 0 ? block_edge : default_edge(table);
  auto out = std::make_unique<SphereIntegrator>(rig, table, edge);
  // With coarse pixels, blocks may be too few for the least-squares fit: halve their edge.
  while (block_edge == 0 && edge > 1 && out->grid().whole_sphere() && !out->grid().fitted())
    out = std::make_unique<SphereIntegrator>(rig, table, edge /= 2);
  return out;
}

IntegrationErrors errors_of(const FrameIntegral& integral, const DetectedLights& found) {
  const BlockTotals& blocks = integral.blocks;
  return {blocks.noise,   blocks.bias,       integral.centroid_offset, found.chroma_edge_error + integral.shared_chroma,
          integral.stale, blocks.row_error()};
}

/// The core of a light has at least this part of its peak (light_finder.hpp).
constexpr float kCoreFraction = 0.5F;
constexpr std::size_t kMaxWatched = 8192;
/// Wider cores, sr, are spread over the groups of the rotation, each of which shows a change of the light.
constexpr double kMaxWatchedCore_sr = 0.08;

/// Largest possible error of a block that is read in part, relative to all light, as a part of epsilon.
constexpr double kRowErrorShare = 0.005;

Projection scaled(Projection projection, double factor) {
  for (auto& c : projection.c)
    for (double& v : c) v *= factor;
  return projection;
}

/// Sets the fields that describe what was measured. `scene`: in the units of the integral times `factor`.
void describe_measurement(const FrameIntegral& integral, const Projection& scene, double factor,
                          const RelativeErrors& errors, Descriptor& out) {
  const BlockSums& blocks = integral.blocks;
  out.coverage = static_cast<float>(std::clamp(integral.observed_sr / kSphere, 0.0, 1.0));
  out.saturated = static_cast<float>(std::clamp(blocks.clipped_sr / std::max(integral.observed_sr, 1e-12), 0.0, 1.0));
  out.flags = {};
  if (integral.observed_sr < kFullCoverage * kSphere) out.flags.set(Flag::unseen);
  if (integral.filled) out.flags.set(Flag::filled);
  if (blocks.clipped_sr > 0) out.flags.set(Flag::clipped);
  if (blocks.counts.invalid_pixels > 0) out.flags.set(Flag::cleaned);
  const auto& mean = scene.c[0];
  const double luminance = std::sqrt(kSphere) * luminance_of(mean[0], mean[1], mean[2]);
  if (blocks.motion_luminance * factor > kMotionThreshold * luminance || errors.stale > kMotionThreshold)
    out.flags.set(Flag::moved);
  if (errors.dark()) out.flags.set(Flag::dark);
}

/// Smallest share of the saturated solid angle that must belong to lights.
constexpr double kMinExplainedFraction = 0.75;
/// A block belongs to a light within twice its radius plus this angle, about the width of a block.
constexpr float kMargin_rad = 0.035F;
/// Smallest share of the assigned saturated solid angle of a clipped light; less is the glow of another light.
constexpr double kMinLightFraction = 0.02;

/// Assigns the saturated pixels of a frame to lights. Fills `tracks` with the tracks of the lights to which saturated
/// blocks belong. Leaves it empty where less than three quarters of the saturated solid angle belongs to lights.
/// `lights`: strongest first. Returns the index of the strongest one in `tracks`, or -1.
int find_clipped_lights(const BlockSums& sums, const CellGrid& grid, std::span<const Light> lights,
                        std::vector<std::uint32_t>& tracks) {
  tracks.clear();
  if (!(sums.clipped_sr > 0)) return -1;
  const std::size_t count = std::min<std::size_t>(lights.size(), kMaxLights + 1);
  std::array<float, kMaxLights + 1> cos_reach{};
  for (std::size_t k = 0; k < count; ++k)
    cos_reach[k] = std::cos(std::min(2 * lights[k].angular_radius_rad + kMargin_rad, 3.0F));
  std::array<double, kMaxLights + 1> clipped_sr{};
  double explained_sr = 0;
  for (std::size_t block = 0; block < sums.clipped.size(); ++block) {
    if (!(sums.clipped[block] > 0)) continue;
    std::size_t nearest = count;
    float best = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const float within = dot(lights[k].direction, grid.direction(block)) - cos_reach[k];
      if (within < 0 || (nearest < count && within <= best)) continue;
      nearest = k;
      best = within;
    }
    if (nearest == count) continue;
    clipped_sr[nearest] += sums.clipped[block];
    explained_sr += sums.clipped[block];
  }
  if (explained_sr < kMinExplainedFraction * sums.clipped_sr) return -1;
  int strongest = -1;
  for (std::size_t k = 0; k < count; ++k) {
    if (!(clipped_sr[k] > kMinLightFraction * explained_sr)) continue;
    if (tracks.empty()) strongest = static_cast<int>(k);
    tracks.push_back(lights[k].track);
  }
  return strongest;
}

class PanoramaEstimator final : public Estimator {
 public:
  PanoramaEstimator(const RigParameters& rig, RigTable table, const PanoramaOptions& options)
      : rig_(rig),
        table_(std::move(table)),
        reader_(rig_, table_),
        integrator_(make_integrator(rig_, table_, options.block_edge)),
        finder_(table_, integrator_->layout(), integrator_->grid()),
        profiler_(rig_, table_, integrator_->layout(), integrator_->grid()),
        constant_sampling_(constant_sampling_error(integrator_->grid(), pixel_side(table_))),
        config_(config_for_setting(options.config)),
        probe_id_(options.probe_id),
        calibration_id_(calibration_identity(rig)) {
    if (rig.nits_per_unit > 0) scale_ = {Units::absolute, rig.nits_per_unit};
    if (options.grey_patch) patch_.emplace(*options.grey_patch, table_, integrator_->layout());
    lights_.reserve(kMaxLights + 1);
    clipped_tracks_.reserve(kMaxLights + 1);
    clipped_.reserve(kMaxLights + 1);
    watched_.reserve(kMaxWatched);
    core_.reserve(kMaxWatched);
    residual_sums_.reserve(integrator_->cell_directions().size());
    reset_mapper();
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
  const DetectedLights& find_lights(const FrameIntegral& integral);
  /// Of interleaved frames: the core of each light that is not wide, and the blocks around it, are read in the next
  /// frame.
  void watch_lights(const BlockSums& blocks, const DetectedLights& found);
  [[nodiscard]] OptimizerOptions limits(const RelativeErrors& errors) const;
  [[nodiscard]] Flicker detect_flicker(std::span<const Frame> bracket, const FrameIntegral& integral);
  void reset_mapper();
  void update_map(const FrameIntegral& integral, std::size_t exposures, const DetectedLights& found, Descriptor& out);
  double recover_clipped(Descriptor& out);

  RigParameters rig_;
  RigTable table_;
  RowReader reader_;
  std::unique_ptr<SphereIntegrator> integrator_;
  LightFinder finder_;
  RowProfiler profiler_;
  double constant_sampling_;
  std::optional<EnvironmentMapper> mapper_;
  std::optional<TexelSums> texel_sums_;  ///< Of the mapper's texels, where pixels resolve them.
  std::optional<LightSubtraction> light_subtraction_;
  std::optional<LightTexels> light_texels_;
  bool mapper_is_new_ = true;  ///< None of its maps was sent yet.
  std::vector<CellSum> residual_sums_;
  std::vector<std::uint32_t> watched_;  ///< Blocks with the cores of the lights, and around them.
  std::vector<std::uint32_t> core_;     ///< The same of one light.
  FlickerDetector flicker_;
  bool flicker_of_brackets_ = false;  ///< The detector's frames are exposures of brackets.
  LightTracker tracker_;
  Smoother smoother_;
  DescriptorOptimizer optimizer_;
  OptimizedDescriptor optimized_;
  EstimatorConfig config_;  ///< With the limits of its setting applied.
  RadianceScale scale_;
  std::uint32_t probe_id_, calibration_id_;
  std::vector<Light> lights_;  ///< Of the current frame, in the descriptor's units.
  std::optional<GreyPatchReader> patch_;
  std::vector<std::uint32_t> clipped_tracks_;  ///< Of the clipped lights of the current frame.
  std::vector<ClippedLight> clipped_;          ///< Of the last estimate.
  Recovery recovery_;
};

Status PanoramaEstimator::estimate(std::span<const Frame> bracket, Descriptor& out) {
  if (Status s = reader_.bind(bracket); !s.ok()) return s;
  fill_header(bracket, {scale_.units, probe_id_, calibration_id_, config_.setting}, out);
  const FrameIntegral& integral =
      integrator_->integrate(reader_, bracket, config_.panorama.unseen,
                             {config_.panorama.interleave, kRowErrorShare * config_.panorama.epsilon});
  const DetectedLights& found = find_lights(integral);
  if (integral.interleaved) watch_lights(integral.blocks, found);
  const IntegrationErrors integration_errors = errors_of(integral, found);

  // From here on, scene and lights have the descriptor's units.
  Projection scene = scaled(integral.projection, scale_.factor);
  lights_ = found.lights;
  for (Light& light : lights_) light.irradiance = light.irradiance * static_cast<float>(scale_.factor);
  tracker_.assign(lights_, out.time.mid_exposure);
  // Only lights that are sent can be recovered.
  const int clipped = find_clipped_lights(integral.blocks, integrator_->grid(), lights_, clipped_tracks_);
  const int required = clipped >= 0 ? clipped : found.required;

  IrradianceRms smoothed;
  if (config_.panorama.smoothing == Smoothing::one_euro)
    smoothed = smoother_.apply(scene, lights_, out.time.mid_exposure, noise_rms(integration_errors) * scale_.factor);

  const RelativeErrors errors = relative_errors(scene, integration_errors, scale_.factor, constant_sampling_);
  describe_measurement(integral, scene, scale_.factor, errors, out);
  out.flicker = detect_flicker(bracket, integral);
  OptimizerOptions limits = this->limits(errors);
  SizeBudget budget;
  if (limits.max_bytes > 0) {
    budget = divide_bytes(limits.max_bytes, out, largest_bound(out.flags, errors, lights_, smoothed));
    limits.max_bytes = budget.lights_and_radiance;
  }
  optimizer_.optimize(scene, lights_, required, limits, out.lights, optimized_);

  out.radiance = optimized_.residual;
  out.radiance_step = optimized_.step;
  update_map(integral, bracket.size(), found, out);
  const double recovery_uncertainty = recover_clipped(out);
  out.bound = error_bound(out, errors, optimized_, smoothed, recovery_uncertainty);
  if (limits.max_bytes > 0) limit_size(budget.bound, out.bound);
  return {};
}

/// Searches for no more lights than can save bytes.
const DetectedLights& PanoramaEstimator::find_lights(const FrameIntegral& integral) {
  const DetectedLights& found = finder_.find_brightest(reader_, integral, config_);
  const RelativeErrors errors = relative_errors(integral.projection, errors_of(integral, found), 1, constant_sampling_);
  const Light* brightest = found.lights.empty() ? nullptr : &found.lights.front();
  return finder_.find_others(reader_, optimizer_.max_lights_to_find(integral.projection, brightest, limits(errors)));
}

void PanoramaEstimator::watch_lights(const BlockSums& blocks, const DetectedLights& found) {
  watched_.clear();
  double unread = 0;
  for (const std::uint8_t region : found.region) {
    // Parts are sorted by region.
    const auto parts = std::ranges::equal_range(found.parts, region, {}, &DetectedLights::Part::region);
    float largest = 0;
    for (const DetectedLights::Part& part : parts) largest = std::max(largest, blocks.peak[part.block]);
    core_.clear();
    for (const DetectedLights::Part& part : parts)
      if (blocks.peak[part.block] >= kCoreFraction * largest && core_.size() < core_.capacity())
        core_.push_back(part.block);
    // A block may have several parts.
    const auto sort_blocks = [](std::vector<std::uint32_t>& all) {
      std::ranges::sort(all);
      all.erase(std::unique(all.begin(), all.end()), all.end());
    };
    sort_blocks(core_);
    double core_sr = 0;
    for (const std::uint32_t block : core_) core_sr += static_cast<double>(integrator_->grid().solid_angle(block));
    if (core_sr > kMaxWatchedCore_sr) continue;
    for (std::size_t k = core_.size(); k-- > 0;) {
      const std::span<const std::uint32_t> around = finder_.neighbours(core_[k]);
      if (core_.size() + around.size() <= core_.capacity()) core_.insert(core_.end(), around.begin(), around.end());
    }
    sort_blocks(core_);
    double all = 0, read = 0;
    for (const DetectedLights::Part& part : parts) {
      const auto light = static_cast<double>(part.light.luminance());
      all += light;
      if (std::ranges::binary_search(core_, part.block)) read += light;
    }
    if (!(read > 0) || watched_.size() + core_.size() > watched_.capacity()) continue;
    unread = std::max(unread, all / read - 1);
    watched_.insert(watched_.end(), core_.begin(), core_.end());
  }
  integrator_->watch(watched_, unread);
}

OptimizerOptions PanoramaEstimator::limits(const RelativeErrors& errors) const {
  return {config_.band,
          config_.max_lights,
          config_.panorama.epsilon,
          config_.panorama.radiance_epsilon,
          errors.expected(),
          static_cast<std::size_t>(config_.panorama.max_bytes)};
}

Flicker PanoramaEstimator::detect_flicker(std::span<const Frame> bracket, const FrameIntegral& integral) {
  const bool brackets = bracket.size() > 1;
  if (flicker_of_brackets_ != brackets || integral.interleaved) flicker_.reset();
  flicker_of_brackets_ = brackets;
  // The rows of an interleaved frame were read at different times.
  if (integral.interleaved) return flicker_.state();
  if (!brackets) return flicker_.add(bracket[0].info, profiler_.profile(bracket[0], integral.blocks));
  for (const Frame& exposure : bracket) (void)flicker_.add(exposure.info, profiler_.profile(exposure));
  return flicker_.state();
}

void PanoramaEstimator::reset_mapper() {
  light_texels_.reset();
  light_subtraction_.reset();
  texel_sums_.reset();
  mapper_.reset();
  mapper_is_new_ = true;
  if (config_.panorama.environment_edge == 0) return;
  mapper_.emplace(integrator_->cell_directions(), integrator_->cell_solid_angles(), config_.panorama.environment_edge,
                  EnvironmentUpdateOptions{.rate_hz = config_.panorama.environment_rate});
  if (!TexelSums::resolved(table_, mapper_->grid())) return;
  texel_sums_.emplace(table_, integrator_->layout(), mapper_->grid());
  light_subtraction_.emplace(mapper_->grid());
  light_texels_.emplace(table_, integrator_->layout(), integrator_->grid(), mapper_->grid(),
                        config_.panorama.environment_edge);
}

/// The map shows the texels without the lights that are sent, and the cells where no pixels fill a texel.
void PanoramaEstimator::update_map(const FrameIntegral& integral, std::size_t exposures, const DetectedLights& found,
                                   Descriptor& out) {
  // Changes refer to maps of the same mapper.
  if (!mapper_ || mapper_is_new_) out.environment.reset();
  if (!mapper_) return;
  mapper_is_new_ = false;
  residual_sums_.clear();
  std::span<Rgbx> texels;
  LightsInTexels shown;
  if (mapper_->due(out.time.mid_exposure)) {
    residual_sums_ = integral.blocks.sum;
    for (std::size_t k = 0; k < lights_.size(); ++k)
      if (std::ranges::find(out.lights, lights_[k].track, &Light::track) != out.lights.end())
        found.subtract(k, residual_sums_);
    residual_sums_.insert(residual_sums_.end(), integral.unseen.begin(), integral.unseen.end());
    if (texel_sums_) {
      texels = texel_sums_->run(reader_, exposures);
      light_texels_->begin(texels);
      const bool recovers = patch_.has_value() || recovery_.count > 0;
      const auto per_unit = static_cast<float>(1 / scale_.factor);
      for (const Light& light : out.lights) {
        const auto removal = light_subtraction_->removal(light, per_unit, texels);
        // Texels do not hold what was recovered of saturated pixels.
        if (!recovers || std::ranges::find(clipped_tracks_, light.track) == clipped_tracks_.end())
          light_texels_->add(light, per_unit, removal, reader_);
        LightSubtraction::subtract(removal, texels);
      }
      shown = light_texels_->chosen();
    }
  }
  mapper_->update(residual_sums_, texels, shown, scale_.factor, out.time.mid_exposure, out.environment);
}

/// Sets clipped_, and the irradiance of clipped lights where it is known. Returns its uncertainty, see RecoveryResult.
double PanoramaEstimator::recover_clipped(Descriptor& out) {
  clipped_.clear();
  for (const std::uint32_t track : clipped_tracks_)
    for (const Light& light : out.lights)
      if (light.track == track) clipped_.push_back({track, light.irradiance});
  if (clipped_.size() != clipped_tracks_.size()) clipped_.clear();
  // Where the patch cannot be read, the previous recovery is kept.
  if (patch_ && !clipped_.empty())
    if (const std::optional<DiffuseConstraint> reading = patch_->read(reader_, scale_.factor))
      (void)recover(out, clipped_, *reading, recovery_);
  const RecoveryResult recovered = apply(recovery_, clipped_, out);
  if (recovered.all) out.flags.set(Flag::recovered);
  return recovered.uncertainty;
}

}  // namespace

Result<std::unique_ptr<Estimator>> make_panorama_estimator(const RigParameters& rig, const PanoramaOptions& options) {
  if (Status s = options.config.validate(EstimatorKind::panorama); !s.ok()) return s;
  const int edge = options.block_edge;
  if (edge < 0 || edge > kMaxBlockEdge || (edge & (edge - 1)) != 0)
    return invalid_argument("block_edge is " + std::to_string(edge) + "; it must be 0 or a power of two up to 16");
  if (options.grey_patch)
    if (Status s = options.grey_patch->validate(rig); !s.ok()) return s;
  Result<RigTable> table = make_rig_table(rig);
  if (!table) return table.status();
  if (!(table->covered_sr > 0)) return invalid_argument("calibration: no pixel has a direction; check fx, fy, cx, cy");
  return std::unique_ptr<Estimator>(std::make_unique<PanoramaEstimator>(rig, std::move(*table), options));
}

}  // namespace lightwell
