#include "core/sample.hpp"

#include <cmath>

namespace lightwell::core {

bool EnvironmentAssembler::take(const Descriptor& descriptor) {
  if (!descriptor.environment) return true;
  const EnvironmentMap& came = *descriptor.environment;
  auto kept = std::make_shared<EnvironmentSnapshot>();
  kept->sequence = descriptor.sequence;
  kept->mid_exposure = descriptor.time.mid_exposure;
  kept->units = descriptor.units;
  kept->probe_id = descriptor.probe_id;
  kept->calibration_id = descriptor.calibration_id;
  kept->probe_origin = descriptor.T_probe_origin.rotation;
  if (came.whole())
    kept->map = came;
  else if (!key_ || !apply_changes(key_->map, came, kept->map))
    return false;
  if (!kept->map.light_tracks.empty()) kept->mirror = first_level_with_lights(kept->map);
  newest_ = std::move(kept);
  if (came.whole()) key_ = newest_;
  return true;
}

std::shared_ptr<const EnvironmentSnapshot> EnvironmentAssembler::map_for(const Descriptor& descriptor) const {
  if (!newest_ || newest_->units != descriptor.units || newest_->probe_id != descriptor.probe_id ||
      newest_->calibration_id != descriptor.calibration_id)
    return nullptr;
  const Duration older = descriptor.time.mid_exposure - newest_->mid_exposure;
  const std::int64_t longest_ns = kMaxIntervals * std::int64_t{newest_->map.key_interval_ms} * 1'000'000;
  if (older < Duration{} || older > Duration{longest_ns}) return nullptr;
  return newest_;
}

LazyReconstruction::LazyReconstruction(const Pointer& from, Quat q)
    : a_(from->a_ ? from->a_ : from), b_(from->b_), f_(from->f_), q_(from->q_ ? q * *from->q_ : q) {}

const RadianceReconstruction* LazyReconstruction::ready() const {
  // Most queries find it set: a store by every thread that shades would pass the cache line round.
  if (!queried()) queried_.store(true, std::memory_order_relaxed);
  return state_.load(std::memory_order_acquire) == State::ready ? &kept_ : nullptr;
}

RadianceReconstruction LazyReconstruction::value() const {
  const RadianceReconstruction* const kept = ready();
  return kept != nullptr ? *kept : compute();
}

RadianceReconstruction LazyReconstruction::compute() const {
  RadianceReconstruction result = a_ ? a_->value() : reconstruct(sh_);
  if (b_) result = interpolated(result, b_->value(), f_);
  if (q_) result = rotated(result, *q_);
  State empty = State::empty;
  if (state_.compare_exchange_strong(empty, State::writing, std::memory_order_acquire)) {
    kept_ = result;
    state_.store(State::ready, std::memory_order_release);
  }
  return result;
}

void ReconstructAhead::published(const LazyReconstruction* before, const LazyReconstruction* newest) {
  without_query_ = before != nullptr && before->queried() ? 0 : without_query_ + 1;
  if (newest != nullptr && without_query_ < kMaxWithoutQuery) (void)newest->compute();
}

std::array<float, 3> transport_covariance(const std::array<float, 3>& covariance, Vec3f from, Quat q, Vec3f to) {
  const auto old_basis = tangent_basis(vec_cast<double>(from));
  const auto new_basis = tangent_basis(vec_cast<double>(to));
  const Vec3d u = rotate(q, old_basis[0]), v = rotate(q, old_basis[1]);
  const double uu = covariance[0], uv = covariance[1], vv = covariance[2];
  const auto moment = [&](Vec3d a, Vec3d b) {
    return uu * dot(u, a) * dot(u, b) + uv * (dot(u, a) * dot(v, b) + dot(v, a) * dot(u, b)) +
           vv * dot(v, a) * dot(v, b);
  };
  return {static_cast<float>(moment(new_basis[0], new_basis[0])),
          static_cast<float>(moment(new_basis[0], new_basis[1])),
          static_cast<float>(moment(new_basis[1], new_basis[1]))};
}

Light rotate_light(const Light& light, Quat q) {
  Light out = light;
  out.direction = vec_cast<float>(normalized(rotate(q, vec_cast<double>(light.direction))));
  out.direction_covariance = transport_covariance(light.direction_covariance, light.direction, q, out.direction);
  return out;
}

std::array<float, 3> add_pose_noise(const Light& light, const PoseCovariance& covariance) {
  const auto [uu, uv, vv] = direction_covariance(vec_cast<double>(light.direction), covariance);
  const auto& own = light.direction_covariance;
  if (!std::isfinite(uu)) return {static_cast<float>(uu), 0, static_cast<float>(vv)};
  return {own[0] + static_cast<float>(uu), own[1] + static_cast<float>(uv), own[2] + static_cast<float>(vv)};
}

}  // namespace lightwell::core
