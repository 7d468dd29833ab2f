// The one CameraManager of the process, shared by all open backends, and its notifications of connected and
// disconnected cameras.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backends/libcamera/compatibility.hpp"

namespace lightwell::libcam {

/// libcamera allows one manager per process. It runs while at least one backend is open.
class CameraSystem {
 public:
  /// unavailable if the manager does not start.
  [[nodiscard]] static Result<std::shared_ptr<CameraSystem>> get();
  /// All cameras must have been released by then.
  ~CameraSystem();
  CameraSystem(const CameraSystem&) = delete;
  CameraSystem& operator=(const CameraSystem&) = delete;

  /// Finds a camera by id, or by its number in `cam --list`, from 1. not_found lists all cameras.
  [[nodiscard]] Result<std::shared_ptr<::libcamera::Camera>> find(const std::string& name) const;
  /// Finds a camera by id; null if it is not connected.
  [[nodiscard]] std::shared_ptr<::libcamera::Camera> present(const std::string& id) const;

  /// `changed` is called on libcamera's thread whenever a camera was connected or disconnected, until unwatch() has
  /// returned. It must not call libcamera.
  [[nodiscard]] int watch(std::function<void()> changed);
  void unwatch(int watcher);

 private:
  CameraSystem() = default;
  void notify_watchers();

  ::libcamera::CameraManager manager_;
  std::mutex mutex_;  ///< Guards the two members below; held while watchers are notified.
  int next_watcher_ = 0;
  std::map<int, std::function<void()>> watchers_;
};

}  // namespace lightwell::libcam
