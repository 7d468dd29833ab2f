#include "camera/backends/libcamera/camera_system.hpp"

#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <utility>

#include <lightwell/text.hpp>

namespace lightwell::libcam {
namespace {

/// A camera's number in `cam --list`, from 1; 0: the name is not a number.
std::size_t number_in(const std::string& name) { return parse_number<std::size_t>(name).value_or(0); }

/// Serialises managers: a new one must not start before the previous one has ended, possibly on another thread.
struct ManagerLifetime {
  std::mutex mutex;
  std::condition_variable gone;
  bool alive = false;
  std::weak_ptr<CameraSystem> running;
};
ManagerLifetime& manager_lifetime() {
  // Never destroyed, because a backend may outlive static objects.
  static ManagerLifetime& lifetime = *new ManagerLifetime;
  return lifetime;
}

/// Silences libcamera's log, because libraries do not log and errors are returned as Status; not if one of libcamera's
/// own log variables is set. Log levels can only be set after libcamera's first message, so the log is off during
/// startup.
class ScopedLogSilencer {
 public:
  ScopedLogSilencer()
      : wanted_(std::getenv("LIBCAMERA_LOG_LEVELS") == nullptr && std::getenv("LIBCAMERA_LOG_FILE") == nullptr) {
    if (wanted_) (void)::libcamera::logSetTarget(::libcamera::LoggingTargetNone);
  }
  ScopedLogSilencer(const ScopedLogSilencer&) = delete;
  ScopedLogSilencer& operator=(const ScopedLogSilencer&) = delete;
  ~ScopedLogSilencer() {
    if (!wanted_) return;
    (void)::libcamera::logSetStream(&std::cerr);
    ::libcamera::logSetLevel("Camera", "ERROR");
  }

 private:
  const bool wanted_;
};

}  // namespace

Result<std::shared_ptr<CameraSystem>> CameraSystem::get() {
  ManagerLifetime& lifetime = manager_lifetime();
  std::unique_lock lock(lifetime.mutex);
  while (true) {
    if (std::shared_ptr<CameraSystem> system = lifetime.running.lock()) return system;
    if (!lifetime.alive) break;
    lifetime.gone.wait(lock);
  }
  const ScopedLogSilencer while_starting;
  std::unique_ptr<CameraSystem> system(new CameraSystem);
  const auto on_change = [s = system.get()](const std::shared_ptr<::libcamera::Camera>&) { s->notify_watchers(); };
  // Connected for the manager's whole lifetime, because libcamera's signals must not be disconnected while they may be
  // emitted. cameraRemoved follows Camera::disconnected immediately and covers all cameras.
  system->manager_.cameraAdded.connect(system.get(), on_change);
  system->manager_.cameraRemoved.connect(system.get(), on_change);
  if (const int error = system->manager_.start(); error != 0)
    return Status(StatusCode::unavailable, "libcamera " + release() + " does not start: " + std::strerror(-error) +
                                               "; are /sys and /dev there, and udev?");
  lifetime.alive = true;
  const auto end = [](CameraSystem* last) {
    delete last;
    ManagerLifetime& l = manager_lifetime();
    const std::lock_guard ended(l.mutex);
    l.alive = false;
    l.gone.notify_all();
  };
  std::shared_ptr<CameraSystem> shared(system.release(), end);
  lifetime.running = shared;
  return shared;
}

CameraSystem::~CameraSystem() { manager_.stop(); }

Result<std::shared_ptr<::libcamera::Camera>> CameraSystem::find(const std::string& name) const {
  const std::vector<std::shared_ptr<::libcamera::Camera>> all = manager_.cameras();
  for (const auto& camera : all)
    if (camera->id() == name) return camera;
  if (const std::size_t number = number_in(name); number >= 1 && number <= all.size()) return all[number - 1];
  std::string list;
  for (std::size_t i = 0; i < all.size(); ++i)
    list += (i == 0 ? "" : "; ") + std::to_string(i + 1) + ": '" + all[i]->id() + "' (" + model_of(*all[i]) + ")";
  return Status(StatusCode::not_found,
                "libcamera: no camera '" + name + "'; libcamera " + release() + " found " +
                    (all.empty() ? "none: is one connected, and may this user open /dev/media* and /dev/video* "
                                   "(group video)?"
                                 : list));
}

std::shared_ptr<::libcamera::Camera> CameraSystem::present(const std::string& id) const {
  for (const auto& camera : manager_.cameras())
    if (camera->id() == id) return camera;
  return nullptr;
}

int CameraSystem::watch(std::function<void()> changed) {
  const std::lock_guard lock(mutex_);
  watchers_.emplace(next_watcher_, std::move(changed));
  return next_watcher_++;
}

void CameraSystem::unwatch(int watcher) {
  const std::lock_guard lock(mutex_);
  watchers_.erase(watcher);
}

void CameraSystem::notify_watchers() {
  const std::lock_guard lock(mutex_);
  for (const auto& [number, changed] : watchers_) changed();
}

}  // namespace lightwell::libcam
