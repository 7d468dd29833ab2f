// The process's one CameraManager, shared by all backends that are open, and its news of cameras that come and go.
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

/// libcamera allows one manager in a process. It runs from the first open backend to the last.
class CameraSystem {
 public:
  /// unavailable where the manager does not start.
  [[nodiscard]] static Result<std::shared_ptr<CameraSystem>> get();
  /// All cameras have been let go of by then.
  ~CameraSystem();
  CameraSystem(const CameraSystem&) = delete;
  CameraSystem& operator=(const CameraSystem&) = delete;

  /// By id, or by its number in `cam --list`, which counts from 1. not_found names all that there are.
  [[nodiscard]] Result<std::shared_ptr<::libcamera::Camera>> find(const std::string& name) const;
  /// By id; null where it is away.
  [[nodiscard]] std::shared_ptr<::libcamera::Camera> present(const std::string& id) const;

  /// `changed` is called on libcamera's thread whenever a camera has come or gone, until unwatch() has returned. It
  /// must not call libcamera.
  [[nodiscard]] int watch(std::function<void()> changed);
  void unwatch(int watcher);

 private:
  CameraSystem() = default;
  void notify_watchers();

  ::libcamera::CameraManager manager_;
  std::mutex mutex_;  ///< Guards the two below; held while watchers are told.
  int next_watcher_ = 0;
  std::map<int, std::function<void()>> watchers_;
};

}  // namespace lightwell::libcam
