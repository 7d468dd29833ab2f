#include "structure/skeletons/estimator/constant_estimator.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "estimate/frames/row_reader.hpp"

namespace lightwell {
namespace {

class ConstantEstimator final : public Estimator {
 public:
  ConstantEstimator(const RigParameters& rig, RigTable table, const ConstantOptions& options)
      : rig_(rig),
        table_(std::move(table)),
        reader_(rig_, table_),
        config_(options.config),
        probe_id_(options.probe_id),
        calibration_id_(calibration_identity(rig)) {
    if (rig.nits_per_unit > 0) scale_ = {Units::absolute, rig.nits_per_unit};
  }

  Status estimate(std::span<const Frame> bracket, Descriptor& out) override {
    // Checks the frames. An estimator that uses them goes on with reader_.read().
    if (Status s = reader_.bind(bracket); !s.ok()) return s;
    out = {};
    estimate::fill_header(bracket, {scale_.units, probe_id_, calibration_id_, config_.setting}, out);
    const auto mean = static_cast<float>(scale_.factor * std::sqrt(4 * std::numbers::pi));
    out.radiance.c[0] = {mean, mean, mean};
    out.flags.set(Flag::unsure);
    out.bound.total = std::numeric_limits<float>::infinity();
    return {};
  }

  // EstimatorKind::constant, were step 1 possible outside of the enum.
  EstimatorKind kind() const override { return EstimatorKind::panorama; }
  Status configure(const EstimatorConfig& config) override {
    if (Status s = config.validate(kind()); !s.ok()) return s;
    config_ = config;
    return {};
  }
  void set_scale(RadianceScale scale) override { scale_ = scale; }
  RadianceScale scale() const override { return scale_; }

 private:
  RigParameters rig_;
  RigTable table_;
  estimate::RowReader reader_;
  EstimatorConfig config_;
  std::uint32_t probe_id_, calibration_id_;
  RadianceScale scale_;
};

}  // namespace

Result<std::unique_ptr<Estimator>> make_constant_estimator(const RigParameters& rig, const ConstantOptions& options) {
  if (Status s = options.config.validate(EstimatorKind::panorama); !s.ok()) return s;
  Result<RigTable> table = make_rig_table(rig);
  if (!table) return table.status();
  return std::unique_ptr<Estimator>(std::make_unique<ConstantEstimator>(rig, std::move(*table), options));
}

}  // namespace lightwell
