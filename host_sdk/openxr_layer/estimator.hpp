// A light estimator: XrLightEstimatorANDROID.
#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include <lightwell/lightwell.h>

#include "android_light_estimation.h"
#include "cube_renderer.hpp"
#include "instance.hpp"

namespace lightwell::xr {

/// The structures of one call of xrGetLightEstimateANDROID; a null pointer where the application did not chain one.
struct EstimateParts {
  XrLightEstimateANDROID* estimate = nullptr;
  XrDirectionalLightANDROID* directional = nullptr;
  XrAmbientLightANDROID* ambient = nullptr;
  XrSphericalHarmonicsANDROID* harmonics = nullptr;
  XrCubemapLightingDataANDROID* cube = nullptr;

  /// The state of each.
  void set_state(XrLightEstimateStateANDROID state) const;
};

class Estimator {
 public:
  /// `instance` outlives this; `session` is one of its sessions. Creates a space in the session. `cube`: nullptr for
  /// none.
  [[nodiscard]] static XrResult make(Instance& instance, XrSession session,
                                     const XrCubemapLightEstimatorCreateInfoANDROID* cube,
                                     std::shared_ptr<Estimator>& out);
  ~Estimator();
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;

  [[nodiscard]] Instance& instance() const { return instance_; }
  [[nodiscard]] XrSession session() const { return session_; }

  /// Fills the parts. Never waits for the network. An error is one of the runtime about space or time.
  [[nodiscard]] XrResult estimate(const XrLightEstimateGetInfoANDROID& request, const EstimateParts& parts);

 private:
  struct Release {
    void operator()(lw_lighting* lighting) const { lw_lighting_release(lighting); }
  };

  Estimator(Instance& instance, XrSession session) : instance_(instance), session_(session) {}
  /// T_space_reference; no value while it is not tracked.
  [[nodiscard]] XrResult locate(const XrLightEstimateGetInfoANDROID& request, std::optional<Pose>& out) const;

  Instance& instance_;
  const XrSession session_;
  XrSpace reference_ = XR_NULL_HANDLE;  ///< Configuration::space.
  std::unique_ptr<CubeRenderer> cube_;
  std::mutex mutex_;  ///< Guards the next one.
  std::unique_ptr<lw_lighting, Release> light_;
  bool counted_ = false;  ///< As a user of the source.
};

}  // namespace lightwell::xr
