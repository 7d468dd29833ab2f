// One stored descriptor with the values that queries need: environment map, reconstruction, rotation of lights.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/harmonics.hpp>
#include <lightwell/reconstruction.hpp>
#include <lightwell/time.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "core/irradiance_rows.hpp"

namespace lightwell::core {

/// A whole map and the descriptor to which it belongs.
struct EnvironmentSnapshot {
  EnvironmentMap map;
  EnvironmentMap mirror;  ///< first_level_with_lights(map) where it has lights in texels; otherwise without levels.
  std::uint64_t sequence = 0;
  ProbeTime mid_exposure;
  Units units = Units::relative;
  std::uint32_t probe_id = 0;
  std::uint32_t calibration_id = 0;
  Quat probe_origin;  ///< Rotation of T_probe_origin.
};

/// Rotates directions of the map from the probe's axes at its time into those of `descriptor`. A map comes from light
/// in a room where the origin does not turn: it is the probe itself, or a plane around which the probe moves.
[[nodiscard]] inline Quat map_rotation(const Descriptor& descriptor, const EnvironmentSnapshot& map) {
  return descriptor.T_probe_origin.rotation * map.probe_origin.inverse();
}

/// Assembles the current map of one probe from descriptors with a whole map, with changes, or without a map. One
/// thread.
class EnvironmentAssembler {
 public:
  /// Processes a received descriptor. False if it has changes to a whole map that was not received; then the current
  /// map is kept. True also for a descriptor without a map.
  bool take(const Descriptor& descriptor);

  /// The newest map if it applies to `descriptor`: same probe, calibration and units, not newer, and not older than
  /// kMaxIntervals of its key intervals. Null otherwise.
  [[nodiscard]] std::shared_ptr<const EnvironmentSnapshot> map_for(const Descriptor& descriptor) const;

 private:
  static constexpr std::int64_t kMaxIntervals = 3;

  std::shared_ptr<const EnvironmentSnapshot> key_;     ///< The last whole map, without changes.
  std::shared_ptr<const EnvironmentSnapshot> newest_;  ///< The last whole map with the last changes, if any.
};

/// The reconstruction of a descriptor's radiance, computed when the first query needs it: reconstruct() takes hundreds
/// of microseconds, and irradiance does not need it. Derived values (between two descriptors, in a rotated frame)
/// transform the reconstructions of the received descriptors, which takes microseconds. All const functions may be
/// called by any thread; none waits for another thread, none allocates.
class LazyReconstruction {
 public:
  using Pointer = std::shared_ptr<const LazyReconstruction>;

  explicit LazyReconstruction(const RadianceSh& sh) : sh_(sh) {}
  /// interpolated(a, b, f).
  LazyReconstruction(Pointer a, Pointer b, float f) : a_(std::move(a)), b_(std::move(b)), f_(f) {}
  /// rotated(from, q). A rotation of a rotation refers to the unrotated ones: no chain grows.
  LazyReconstruction(const Pointer& from, Quat q);

  /// Null where it was not computed yet. Counts as a query.
  [[nodiscard]] const RadianceReconstruction* ready() const;
  /// Computes and keeps it. If another thread is keeping its own result at this moment, this one is only returned.
  [[nodiscard]] RadianceReconstruction compute() const;
  /// Whether a query came, to this or to one derived from it.
  [[nodiscard]] bool queried() const { return queried_.load(std::memory_order_relaxed); }

 private:
  enum class State : std::uint8_t { empty, writing, ready };

  [[nodiscard]] RadianceReconstruction value() const;

  RadianceSh sh_;  // Of a received descriptor: a_ is null.
  Pointer a_, b_;  // Of a derived one; b_ is null where there is one source.
  float f_ = 0;
  std::optional<Quat> q_;
  mutable std::atomic<bool> queried_ = false;
  mutable std::atomic<State> state_ = State::empty;
  mutable RadianceReconstruction kept_;
};

/// While an application queries radiance(), the reader thread computes what the next query needs; it computes nothing
/// for one that queries irradiance alone. The reader thread's own.
class ReconstructAhead {
 public:
  /// Descriptors in succession whose radiance nobody queries, after which it computes nothing: an application may
  /// render less often than descriptors come.
  static constexpr unsigned kMaxWithoutQuery = 16;

  /// A descriptor was published: its reconstruction and that of the one before, null where there is none.
  void published(const LazyReconstruction* before, const LazyReconstruction* newest);

 private:
  unsigned without_query_ = kMaxWithoutQuery;
};

/// Immutable once shared. Holds what is the same for all queries, computed once by prepare().
struct Sample {
  Descriptor descriptor;
  IrradianceSh irradiance;                     ///< irradiance_of(descriptor.radiance): without the lights.
  std::vector<ReceiverLight> receiver_lights;  ///< receiver_lights(descriptor.lights).
  HostTime mid_exposure;
  Duration time_uncertainty;  ///< Maximum error of mid_exposure.
  HostTime received;
  std::size_t encoded_bytes = 0;
  /// The environment map at that time, from this or an earlier message; null if there is none.
  std::shared_ptr<const EnvironmentSnapshot> environment;
  /// For radiance() without a map; null if there is a map.
  LazyReconstruction::Pointer reconstruction;
  /// The probe's mounting, as long as `descriptor` is in the probe's frame; null if the probe reported none.
  std::shared_ptr<const UncertainPose> T_world_probe;
  Quat environment_rotation;  ///< Rotates directions of the map into the frame of `descriptor`.
};

/// Recomputes `irradiance` and `receiver_lights` after a change of the descriptor.
inline void prepare(Sample& sample) {
  sample.irradiance = irradiance_of(sample.descriptor.radiance);
  sample.receiver_lights = receiver_lights(sample.descriptor.lights);
}

/// Call it after `environment` is set.
inline void add_reconstruction(Sample& sample) {
  if (sample.environment == nullptr)
    sample.reconstruction = std::make_shared<const LazyReconstruction>(sample.descriptor.radiance);
}

/// A sample without time, bytes or reconstruction.
[[nodiscard]] inline Sample sample_of(Descriptor descriptor) {
  Sample sample;
  sample.descriptor = std::move(descriptor);
  prepare(sample);
  return sample;
}

/// Transports the covariance of a direction, given in tangent_basis(from), by the rotation q into tangent_basis(to),
/// where `to` is approximately rotate(q, from). tangent_basis() does not commute with rotations, so the components
/// change even if the ellipse only moves with the direction.
[[nodiscard]] std::array<float, 3> transport_covariance(const std::array<float, 3>& covariance, Vec3f from, Quat q,
                                                        Vec3f to);

/// The light in a frame rotated by q: p_new = q p_old.
[[nodiscard]] Light rotate_light(const Light& light, Quat q);

/// The light's direction covariance plus that due to the rotation covariance of a pose. Both are in the light's current
/// frame.
[[nodiscard]] std::array<float, 3> add_pose_noise(const Light& light, const PoseCovariance& covariance);

}  // namespace lightwell::core
