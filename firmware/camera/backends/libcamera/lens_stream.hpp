// One of libcamera's cameras as a lens: acquired, configured, its buffers mapped, its requests queued and read.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backends/libcamera/buffer_memory.hpp"
#include "camera/backends/libcamera/camera_system.hpp"
#include "camera/backends/libcamera/compatibility.hpp"
#include "camera/backends/libcamera/lens.hpp"
#include "camera/backends/libcamera/mailbox.hpp"

namespace lightwell::libcam {

/// Buffers are requests of libcamera's, one each.
class LensStream final : public Lens {
 public:
  /// `name` as CameraSystem::find() takes it.
  LensStream(std::string name, int lens, std::shared_ptr<Mailbox> mailbox)
      : name_(std::move(name)), lens_(lens), mailbox_(std::move(mailbox)) {}
  ~LensStream() override;
  LensStream(const LensStream&) = delete;
  LensStream& operator=(const LensStream&) = delete;

  /// not_found the first time where there is no such camera, with all that there are.
  [[nodiscard]] Status acquire(const LibcameraOptions& options, int lendable) override;
  void release() override;
  [[nodiscard]] bool acquired() const override { return camera_ != nullptr; }
  [[nodiscard]] bool present() const override;
  [[nodiscard]] Status start() override;
  void stop() override;

  [[nodiscard]] const std::string& id() const override { return id_; }
  [[nodiscard]] const std::string& model() const override { return model_; }
  [[nodiscard]] const PictureLayout& layout() const override { return layout_; }
  [[nodiscard]] const SelectedControls& controls() const override { return controls_; }
  [[nodiscard]] const std::vector<std::string>& notes() const override { return notes_; }
  [[nodiscard]] std::shared_ptr<const PictureMemory> memory() const override { return memory_; }
  [[nodiscard]] int buffers() const override { return static_cast<int>(requests_.size()); }
  [[nodiscard]] int session() const override { return session_; }

  [[nodiscard]] bool full() const override { return queued_ == depth_ || idle_.empty(); }
  [[nodiscard]] bool queue(std::int32_t exposure_us) override;
  [[nodiscard]] Picture collect(int buffer) override;
  void make_idle(int buffer) override;

 private:
  [[nodiscard]] Status configure(const LibcameraOptions& options, int buffers_wanted);
  [[nodiscard]] Status allocate(int buffers_wanted);
  void write_controls(::libcamera::ControlList& list) const;

  const std::string name_;
  const int lens_;
  const std::shared_ptr<Mailbox> mailbox_;
  std::shared_ptr<CameraSystem> system_;  ///< From the first acquire() on; goes after all that is the camera's.
  int watcher_ = 0;
  std::shared_ptr<::libcamera::Camera> camera_;
  std::string id_, model_;  ///< Empty until the first acquire().
  std::unique_ptr<::libcamera::CameraConfiguration> configuration_;
  ::libcamera::Stream* stream_ = nullptr;
  PictureLayout layout_;
  SelectedControls controls_;
  std::vector<std::string> notes_;
  bool settled_ = false;  ///< layout_ and controls_ are what was promised.
  int session_ = 0;

  /// Each allocates what the pipeline thinks enough, which may be four.
  std::vector<std::unique_ptr<::libcamera::FrameBufferAllocator>> allocators_;
  std::vector<std::unique_ptr<::libcamera::Request>> requests_;  ///< One a buffer, whose index is its cookie.
  std::shared_ptr<const BufferMemory> memory_;
  enum class BufferState : std::uint8_t { idle, queued, out };
  std::vector<BufferState> buffer_states_;  ///< Of each buffer.
  std::vector<int> idle_;     ///< Oldest first.
  std::vector<bool> used_;    ///< The request has to be made new again.
  int queued_ = 0, depth_ = 0;
  std::optional<std::int32_t> requested_exposure_us_;  ///< Nothing: no request since start().
};

}  // namespace lightwell::libcam
