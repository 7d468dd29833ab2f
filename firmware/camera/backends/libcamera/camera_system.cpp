#include "camera/backends/libcamera/camera_system.hpp"

#include <cerrno>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <iostream>
#include <unistd.h>
#include <utility>

#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <lightwell/text.hpp>

#include "imaging/pixel_layout.hpp"

namespace lightwell::libcam {
namespace {

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
/// own log variables is set. Levels can only be set after the first message, so the log is off during startup.
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

/// Whether two descriptors, which may be duplicates, refer to the same file.
bool same_file(int a, int b) {
  struct stat sa {
  }, sb{};
  return a == b || (::fstat(a, &sa) == 0 && ::fstat(b, &sb) == 0 && sa.st_dev == sb.st_dev && sa.st_ino == sb.st_ino);
}

void synchronize(int fd, std::uint64_t flags) {
  dma_buf_sync sync{};
  sync.flags = flags;
  // Memory that needs no synchronisation refuses the call, so errors are ignored.
  (void)::ioctl(fd, DMA_BUF_IOCTL_SYNC, &sync);
}

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
  if (const auto number = parse_number<std::size_t>(name); number && *number >= 1 && *number <= all.size())
    return all[*number - 1];
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

BufferMemory::~BufferMemory() {
  for (const Buffer& b : buffers_) {
    ::munmap(b.base, b.length);
    ::close(b.fd);
  }
}

Status BufferMemory::add(const ::libcamera::FrameBuffer& buffer, const PictureLayout& layout) {
  const std::vector<BufferPlane> planes = planes_of(buffer);
  const std::size_t rows_end = layout.stride * static_cast<std::size_t>(layout.height);
  const std::size_t bytes = picture_bytes(layout.format, layout.stride, layout.height);
  if (planes.size() != pixel_layout(layout.format).planes)
    return {StatusCode::failed_precondition, "a picture of " + std::string(to_string(layout.format)) + " has " +
                                                 std::to_string(planes.size()) + " planes: ask for another format="};
  if (planes.size() == 2 && (!same_file(planes[0].fd, planes[1].fd) || planes[1].offset != planes[0].offset + rows_end))
    return {StatusCode::failed_precondition,
            "the two planes of " + std::string(to_string(layout.format)) +
                " lie apart in memory, which would need a copy: ask for another format= or size"};
  const std::size_t end = planes.back().offset + planes.back().length;
  if (end < planes[0].offset + bytes)
    return {StatusCode::failed_precondition, "buffers of " + std::to_string(end - planes[0].offset) +
                                                 " bytes are too small for a picture of " + std::to_string(bytes)};
  Buffer b;
  b.length = end;
  b.fd = ::fcntl(planes[0].fd, F_DUPFD_CLOEXEC, 0);
  b.base = b.fd < 0 ? MAP_FAILED : ::mmap(nullptr, b.length, PROT_READ, MAP_SHARED, b.fd, 0);
  if (b.base == MAP_FAILED) {
    const int error = errno;
    if (b.fd >= 0) ::close(b.fd);
    return {StatusCode::resource_exhausted, std::string("a buffer cannot be mapped: ") + std::strerror(error)};
  }
  b.picture = {static_cast<const std::byte*>(b.base) + planes[0].offset, bytes};
  buffers_.push_back(b);
  return {};
}

void BufferMemory::begin_reading(int buffer) const {
  synchronize(buffers_[static_cast<std::size_t>(buffer)].fd, DMA_BUF_SYNC_START | DMA_BUF_SYNC_READ);
}

void BufferMemory::end_reading(int buffer) const {
  synchronize(buffers_[static_cast<std::size_t>(buffer)].fd, DMA_BUF_SYNC_END | DMA_BUF_SYNC_READ);
}

}  // namespace lightwell::libcam
