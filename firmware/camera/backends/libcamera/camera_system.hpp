// The one CameraManager of this process, shared by all open backends, with its notifications; the memory of buffers.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backends/libcamera/compatibility.hpp"
#include "camera/backends/libcamera/lens.hpp"

namespace lightwell::libcam {

/// libcamera allows one manager per process. It runs while at least one backend is open.
class CameraSystem {
 public:
  /// unavailable if the manager does not start.
  [[nodiscard]] static Result<std::shared_ptr<CameraSystem>> get();
  /// All cameras must have been released by then.
  ~CameraSystem();

  /// Finds a camera by id, or by its number in `cam --list`, from 1. not_found lists all cameras.
  [[nodiscard]] Result<std::shared_ptr<::libcamera::Camera>> find(const std::string& name) const;
  /// Finds a camera by id; null if it is not connected.
  [[nodiscard]] std::shared_ptr<::libcamera::Camera> present(const std::string& id) const;

  /// `changed` is called on libcamera's thread when a camera comes or goes, until unwatch() has returned. It must not
  /// call libcamera.
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

/// The memory of a camera's buffers, mapped into this process once and for as long as it is in use. Mappings outlive
/// the buffers, the camera and the manager: a lent frame stays valid when its camera is unplugged.
class BufferMemory final : public PictureMemory {
 public:
  BufferMemory() = default;
  BufferMemory(const BufferMemory&) = delete;
  BufferMemory& operator=(const BufferMemory&) = delete;
  ~BufferMemory() override;

  /// Maps one more buffer. failed_precondition: its planes are not contiguous; resource_exhausted: it cannot be mapped.
  [[nodiscard]] Status add(const ::libcamera::FrameBuffer& buffer, const PictureLayout& layout);

  [[nodiscard]] std::span<const std::byte> picture(int buffer) const override {
    return buffers_[static_cast<std::size_t>(buffer)].picture;
  }
  /// Bracket each reading: synchronise caches on processors that are not coherent with the camera.
  void begin_reading(int buffer) const;
  void end_reading(int buffer) const override;

 private:
  struct Buffer {
    void* base = nullptr;
    std::size_t length = 0;
    int fd = -1;  ///< Duplicate, owned here.
    std::span<const std::byte> picture;
  };
  std::vector<Buffer> buffers_;
};

}  // namespace lightwell::libcam
