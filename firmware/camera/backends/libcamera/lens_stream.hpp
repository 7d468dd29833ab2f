// A lens that is a camera of libcamera: acquisition, configuration, buffers and requests.
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

/// Each buffer has its own libcamera request.
class LensStream final : public Lens {
 public:
  /// `name`: an id or number, see CameraSystem::find().
  LensStream(std::string name, int lens, std::shared_ptr<Mailbox> mailbox)
      : name_(std::move(name)), lens_(lens), mailbox_(std::move(mailbox)) {}
  ~LensStream() override;
  LensStream(const LensStream&) = delete;
  LensStream& operator=(const LensStream&) = delete;

  /// The first call returns not_found, with a list of all cameras, if there is no such camera.
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
  std::shared_ptr<CameraSystem>
      system_;  ///< Set by the first acquire(); destroyed after all members that use the camera.
  int watcher_ = 0;
  std::shared_ptr<::libcamera::Camera> camera_;
  std::string id_, model_;  ///< Empty until the first acquire().
  std::unique_ptr<::libcamera::CameraConfiguration> configuration_;
  ::libcamera::Stream* stream_ = nullptr;
  PictureLayout layout_;
  SelectedControls controls_;
  std::vector<std::string> notes_;
  bool settled_ = false;  ///< layout_ and controls_ are fixed by the first acquire().
  int session_ = 0;

  /// Several, because each allocates as many buffers as the pipeline chooses, for instance four.
  std::vector<std::unique_ptr<::libcamera::FrameBufferAllocator>> allocators_;
  std::vector<std::unique_ptr<::libcamera::Request>> requests_;  ///< One per buffer; the cookie is the buffer's index.
  std::shared_ptr<const BufferMemory> memory_;
  enum class BufferState : std::uint8_t { idle, queued, out };
  std::vector<BufferState> buffer_states_;  ///< By buffer.
  std::vector<int> idle_;                   ///< Oldest first.
  std::vector<bool> used_;                  ///< By buffer: the request needs reuse() before it is queued again.
  int queued_ = 0, depth_ = 0;
  std::optional<std::int32_t> requested_exposure_us_;  ///< Empty: no request since start().
};

}  // namespace lightwell::libcam
