// The handles of the process: which instance a session or a light estimator belongs to.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "android_light_estimation.h"
#include "estimator.hpp"
#include "instance.hpp"

namespace lightwell::xr {

/// Finds nothing for handles that were destroyed or never created: numbers of estimators are not used twice. Any
/// thread.
class Registry {
 public:
  /// The one of this process.
  static Registry& get();

  void add(std::shared_ptr<Instance> instance);
  void add(XrSession session, XrInstance instance);
  [[nodiscard]] XrLightEstimatorANDROID add(std::shared_ptr<Estimator> estimator);

  /// Null if it is unknown.
  [[nodiscard]] std::shared_ptr<Instance> instance(XrInstance handle) const;
  [[nodiscard]] std::shared_ptr<Instance> instance_of(XrSession session) const;
  [[nodiscard]] std::shared_ptr<Estimator> estimator(XrLightEstimatorANDROID handle) const;

  /// Removes the estimator and returns it, null if it is unknown.
  std::shared_ptr<Estimator> remove(XrLightEstimatorANDROID handle);
  /// Removes the session, and destroys its estimators.
  void remove(XrSession session);
  /// Removes the instance with its sessions and returns it, null if it is unknown. Destroys its estimators.
  std::shared_ptr<Instance> remove(XrInstance instance);

 private:
  mutable std::mutex mutex_;
  std::unordered_map<XrInstance, std::shared_ptr<Instance>> instances_;
  std::unordered_map<XrSession, XrInstance> sessions_;
  std::unordered_map<XrLightEstimatorANDROID, std::shared_ptr<Estimator>> estimators_;
  std::uintptr_t last_estimator_ = 0;
};

}  // namespace lightwell::xr
