#include "registry.hpp"

#include <utility>
#include <vector>

namespace lightwell::xr {
namespace {

template <class Map>
auto found(const Map& map, const typename Map::key_type& key) {
  const auto at = map.find(key);
  return at == map.end() ? typename Map::mapped_type{} : at->second;
}

/// Moves the values for which `chosen` holds out of the map, so that they are destroyed without its lock.
template <class Map, class Chosen>
std::vector<typename Map::mapped_type> extract(Map& map, const Chosen& chosen) {
  std::vector<typename Map::mapped_type> out;
  for (auto at = map.begin(); at != map.end();) {
    if (!chosen(*at)) {
      ++at;
      continue;
    }
    out.push_back(std::move(at->second));
    at = map.erase(at);
  }
  return out;
}

}  // namespace

Registry& Registry::get() {
  static Registry registry;
  return registry;
}

void Registry::add(std::shared_ptr<Instance> instance) {
  const std::lock_guard lock(mutex_);
  const XrInstance handle = instance->runtime.instance;
  instances_[handle] = std::move(instance);
}

void Registry::add(XrSession session, XrInstance instance) {
  const std::lock_guard lock(mutex_);
  sessions_[session] = instance;
}

XrLightEstimatorANDROID Registry::add(std::shared_ptr<Estimator> estimator) {
  const std::lock_guard lock(mutex_);
  const auto handle = reinterpret_cast<XrLightEstimatorANDROID>(++last_estimator_);
  estimators_[handle] = std::move(estimator);
  return handle;
}

std::shared_ptr<Instance> Registry::instance(XrInstance handle) const {
  const std::lock_guard lock(mutex_);
  return found(instances_, handle);
}

std::shared_ptr<Instance> Registry::instance_of(XrSession session) const {
  const std::lock_guard lock(mutex_);
  return found(instances_, found(sessions_, session));
}

std::shared_ptr<Estimator> Registry::estimator(XrLightEstimatorANDROID handle) const {
  const std::lock_guard lock(mutex_);
  return found(estimators_, handle);
}

std::shared_ptr<Estimator> Registry::remove(XrLightEstimatorANDROID handle) {
  const std::lock_guard lock(mutex_);
  std::shared_ptr<Estimator> out = found(estimators_, handle);
  estimators_.erase(handle);
  return out;
}

void Registry::remove(XrSession session) {
  std::vector<std::shared_ptr<Estimator>> of_session;
  const std::lock_guard lock(mutex_);
  sessions_.erase(session);
  of_session = extract(estimators_, [&](const auto& entry) { return entry.second->session() == session; });
}

std::shared_ptr<Instance> Registry::remove(XrInstance instance) {
  std::shared_ptr<Instance> out;
  // Destroyed before the instance, which they use, and without the lock.
  std::vector<std::shared_ptr<Estimator>> of_instance;
  const std::lock_guard lock(mutex_);
  out = found(instances_, instance);
  instances_.erase(instance);
  (void)extract(sessions_, [&](const auto& entry) { return entry.second == instance; });
  of_instance = extract(estimators_, [&](const auto& entry) { return &entry.second->instance() == out.get(); });
  return out;
}

}  // namespace lightwell::xr
