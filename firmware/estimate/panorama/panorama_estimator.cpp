#include "estimate/panorama/panorama_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <lightwell/codec.hpp>
#include <numbers>
#include <string>

#include "calibration/lens_table.hpp"
#include "estimate/common/decompose.hpp"
#include "estimate/common/light_tracker.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/light_finder.hpp"
#include "estimate/panorama/row_reader.hpp"

namespace lightwell {
namespace {

using namespace estimate;

constexpr double kSphere = 4 * std::numbers::pi;
constexpr double kBlockRad = 1.6 * std::numbers::pi / 180;

/// Relative error of the irradiance of a smooth sphere through pixels and blocks of finite size; measured on the eight
/// panoramas, see estimate/README.md.
constexpr double kSmoothSampling = 1e-3;
/// What pixels themselves cost: edges of what is bright fall anywhere within them. Relative error per square radian.
constexpr double kPixelSampling = 0.5;

/// Side of a pixel of mean solid angle, rad.
double pixel_side(const RigTable& table) {
  double pixels = 0;
  for (const LensTable& lens : table.lenses)
    for (const float sr : lens.solid_angle) pixels += sr > 0 ? 1 : 0;
  return std::sqrt(table.covered_sr / std::max(1.0, pixels));
}

/// The power of two nearest to kBlockRad in pixels of this rig.
int default_edge(const RigTable& table) {
  const double exponent = std::round(std::log2(std::max(1.0, kBlockRad / pixel_side(table))));
  return 1 << static_cast<int>(std::clamp(exponent, 0.0, 6.0));
}

/// What three deviations of the lights' directions do to the irradiance. Moving a light by delta changes the irradiance
/// by E delta times the slope of a clipped cosine, whose mean square over all normals is 1/6.
IrradianceRms misplaced(std::span<const Light> lights) {
  IrradianceRms sum;
  for (const Light& light : lights) {
    const double moved2 = light.direction_covariance[0] + light.direction_covariance[2];
    for (int k = 0; k < 3; ++k) {
      const double e2 = 9 * moved2 / 6 * light.irradiance[k] * light.irradiance[k];
      sum.plain += e2 / 3;
      sum.weighted += kLuminanceWeights[k] * e2;
    }
  }
  return {std::sqrt(sum.plain), std::sqrt(sum.weighted)};
}

class PanoramaEstimator final : public Estimator {
 public:
  PanoramaEstimator(const RigParameters& rig, RigTable table, const PanoramaOptions& options)
      : rig_(rig),
        table_(std::move(table)),
        layout_(table_, options.block_edge > 0 ? options.block_edge : default_edge(table_)),
        grid_(layout_.make_grid(table_)),
        reader_(rig_, table_),
        pass_(table_, layout_),
        sums_(layout_.size()),
        finder_(table_, layout_),
        config_(options.config),
        pixel_rad_(pixel_side(table_)),
        probe_id_(options.probe_id),
        calibration_id_(calibration_identity(rig)) {
    if (rig.nits_per_unit > 0) scale_ = {Units::absolute, rig.nits_per_unit};
    moved_.reserve(layout_.size());
    lights_.reserve(kMaxLights + 1);
  }

  Status estimate(std::span<const Frame> bracket, Descriptor& out) override;

  Status configure(const EstimatorConfig& config) override {
    if (Status s = config.validate(); !s.ok()) return s;
    config_ = config;
    return {};
  }

  void set_scale(RadianceScale scale) override { scale_ = scale; }
  RadianceScale scale() const override { return scale_; }

 private:
  void judge(const Decomposition& parts, Descriptor& out) const;
  [[nodiscard]] double unevenly_filled() const;

  RigParameters rig_;
  RigTable table_;
  BlockLayout layout_;
  CellGrid grid_;
  RowReader reader_;
  BlockPass pass_;
  BlockSums sums_;
  LightFinder finder_;
  LightTracker tracker_;
  EstimatorConfig config_;
  RadianceScale scale_;
  double pixel_rad_;
  std::uint32_t probe_id_, calibration_id_;
  Projection projection_;
  std::vector<CellGrid::Moved> moved_;
  std::vector<Light> lights_;
};

Status PanoramaEstimator::estimate(std::span<const Frame> bracket, Descriptor& out) {
  if (Status s = reader_.bind(bracket); !s.ok()) return s;
  pass_.run(reader_, sums_);
  double luminance = 0;
  for (const CellSum& s : sums_.sum) luminance += s.luminance();
  const double seen = std::max(grid_.covered_sr(), 1e-12);
  finder_.find(reader_, sums_, grid_, static_cast<float>(luminance / seen), config_, lights_, moved_);
  grid_.project(sums_.sum, moved_, projection_);

  // Scaled before anything else is derived, so that lights, rest and bound speak of the same units.
  const auto factor = static_cast<float>(scale_.factor);
  for (auto& c : projection_.c)
    for (double& v : c) v *= scale_.factor;
  for (Light& light : lights_) light.irradiance = light.irradiance * factor;
  const Decomposition parts = decompose(projection_, lights_, config_.band);
  tracker_.assign(lights_);

  const FrameInfo& first = bracket.front().info;
  const FrameInfo& last = bracket.back().info;
  // Of the capture, not of the frame: a bracket is one, and no gap follows it.
  out.sequence = first.sequence / bracket.size();
  out.time.mid_exposure = first.mid_exposure + Duration{(last.mid_exposure - first.mid_exposure).ns / 2};
  out.time.delivered_after = last.delivered - out.time.mid_exposure;
  out.time.encoded_after = out.time.delivered_after;
  out.units = scale_.units;
  out.radiance = parts.rest;
  out.lights.assign(lights_.begin(), lights_.end());
  out.environment.reset();
  out.coverage = static_cast<float>(std::clamp(grid_.covered_sr() / kSphere, 0.0, 1.0));
  out.saturated = static_cast<float>(std::clamp(sums_.clipped_sr / seen, 0.0, 1.0));
  out.probe_id = probe_id_;
  out.calibration_id = calibration_id_;
  judge(parts, out);
  return {};
}

/// Luminance times the angle by which it sits beside the middle of its block, summed over the blocks that were taken as
/// evenly filled. Moving energy by an angle changes the irradiance by no more than misplaced() says, whichever way
/// it goes: a sum of amounts bounds the amount of the sum.
double PanoramaEstimator::unevenly_filled() const {
  double sum = 0;
  std::size_t next = 0;
  for (std::size_t block = 0; block < sums_.sum.size(); ++block) {
    if (next < moved_.size() && moved_[next].cell == block) {
      ++next;
      continue;
    }
    const double luminance = sums_.sum[block].luminance();
    if (luminance > 0) sum += luminance * std::hypot(sums_.offset_x[block], sums_.offset_y[block]);
  }
  return sum * pixel_rad_ * scale_.factor;
}

void PanoramaEstimator::judge(const Decomposition& parts, Descriptor& out) const {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  out.flags = {};
  out.bound = {};
  if (!grid_.whole_sphere()) out.flags.set(Flag::unseen);
  if (sums_.clipped_sr > 0) out.flags.set(Flag::clipped);
  if (sums_.counts.cleaned > 0) out.flags.set(Flag::cleaned);
  const double rms = std::min(parts.whole.plain, parts.whole.weighted);
  if (!(rms > 0)) {
    out.flags.set(Flag::dark);
    out.bound.total = static_cast<float>(kInfinite);
    return;
  }
  // Independent noise of pixels reaches the irradiance through the mean square of a clipped cosine, 1/6.
  const double spread = std::sqrt(sums_.noise / 6) * scale_.factor / rms;
  // A radiance that is hidden everywhere alike is a quarter of its integral in irradiance.
  const double noise = 3 * spread + sums_.bias / 4 * scale_.factor / rms;
  const double truncation = relative(parts.truncation, parts.whole);
  const double sampling = kSmoothSampling + kPixelSampling * pixel_rad_ * pixel_rad_ +
                          (grid_.fitted() ? 0 : grid_.unevenness()) + unevenly_filled() / std::sqrt(6.0) / rms +
                          relative(misplaced(out.lights), parts.whole);
  const double quantization = wire_error(out, rms);
  out.bound.truncation = static_cast<float>(truncation);
  out.bound.sampling = static_cast<float>(sampling);
  out.bound.noise = static_cast<float>(noise);
  out.bound.quantization = static_cast<float>(quantization);
  // The parts may have causes in the same scene: they add up.
  const bool unbounded = out.flags.has(Flag::unseen) || out.flags.has(Flag::clipped);
  out.bound.total = static_cast<float>(unbounded ? kInfinite : truncation + sampling + noise + quantization);
}

}  // namespace

Result<std::unique_ptr<Estimator>> make_panorama_estimator(const RigParameters& rig, const PanoramaOptions& options) {
  if (Status s = options.config.validate(); !s.ok()) return s;
  const int edge = options.block_edge;
  if (edge < 0 || edge > 64 || (edge & (edge - 1)) != 0)
    return Status(StatusCode::invalid_argument, "block_edge is " + std::to_string(edge) +
                                                    "; it must be 0 or a power of two up to 64");
  Result<RigTable> table = make_rig_table(rig);
  if (!table) return table.status();
  if (!(table->covered_sr > 0))
    return Status(StatusCode::invalid_argument, "calibration: no pixel sees anything; check fx, fy, cx, cy");
  return std::unique_ptr<Estimator>(std::make_unique<PanoramaEstimator>(rig, std::move(*table), options));
}

}  // namespace lightwell
