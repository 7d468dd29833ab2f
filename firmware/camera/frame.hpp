// A frame: one capture as the camera delivers it, one picture a lens, lent to whoever holds it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stop_token>
#include <utility>

#include <lightwell/pixel.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

/// A rig has at most so many lenses.
inline constexpr int kMaxLenses = 2;
/// A bracket has at most so many exposures.
inline constexpr int kMaxBracket = 8;

/// What one lens saw. `data` is borrowed from the camera.
struct View {
  int lens = 0;  ///< Number of the lens in the rig's calibration.
  PixelFormat format = PixelFormat::rgb8;
  int width = 0, height = 0;
  std::size_t stride = 0;  ///< Bytes from row to row.
  std::span<const std::byte> data;
};

struct FrameInfo {
  std::uint64_t sequence = 0;  ///< Grows by one a frame; a gap is a frame that the camera lost.
  ProbeTime mid_exposure;      ///< Of the centre row where the shutter rolls.
  ProbeTime delivered;         ///< When the backend handed the frame over.
  double exposure_s = 0;       ///< What was in force for this frame, not what was asked for.
  double gain = 1;             ///< Linear.
  Duration row_readout;        ///< From one row's exposure to the next row's; zero for a global shutter.
  int bracket_index = 0;       ///< Place in the cycle of exposures, 0 to bracket_size - 1.
  int bracket_size = 1;
};

/// Whoever lent a frame's memory.
class FrameOwner {
 public:
  /// The frame of this slot is no longer looked at. Any thread; never blocks for long.
  virtual void release(int slot) = 0;

 protected:
  ~FrameOwner() = default;
};

/// Metadata and borrowed pictures. Moving hands the loan on; the destructor gives the memory back to the backend.
/// A frame must not outlive the backend that made it.
class Frame {
 public:
  Frame() = default;
  Frame(FrameOwner& owner, int slot) : owner_(&owner), slot_(slot) {}
  Frame(Frame&& o) noexcept { swap(o); }
  Frame& operator=(Frame&& o) noexcept {
    Frame taken(std::move(o));
    swap(taken);
    return *this;
  }
  ~Frame() {
    if (owner_ != nullptr) owner_->release(slot_);
  }

  FrameInfo info;

  /// The pictures, in the order of the lenses.
  [[nodiscard]] std::span<const View> views() const { return {views_.data(), view_count_}; }
  /// Only the first kMaxLenses are taken.
  void add_view(const View& view) {
    if (view_count_ < views_.size()) views_[view_count_++] = view;
  }

 private:
  void swap(Frame& o) noexcept {
    std::swap(info, o.info);
    std::swap(views_, o.views_);
    std::swap(view_count_, o.view_count_);
    std::swap(owner_, o.owner_);
    std::swap(slot_, o.slot_);
  }

  std::array<View, kMaxLenses> views_{};
  std::size_t view_count_ = 0;
  FrameOwner* owner_ = nullptr;
  int slot_ = 0;
};

/// Where frames go.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// Called from the backend's one thread, in order of sequence. Returns at once: it must not wait for the estimate.
  virtual void push(Frame frame) = 0;
  /// For cameras without a rate of their own, before each push and from the same thread: waits while a frame pushed now
  /// would replace one that nobody has taken yet. False once `stop` is requested.
  [[nodiscard]] virtual bool wait_for_space(std::stop_token stop) { return !stop.stop_requested(); }
};

}  // namespace lightwell
