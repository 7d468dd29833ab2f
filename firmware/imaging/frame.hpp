// A frame: one capture, one view per lens, in memory that is borrowed from the camera.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <utility>

#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

#include "imaging/pixel_layout.hpp"

namespace lightwell {

/// Largest number of lenses in a rig.
inline constexpr int kMaxLenses = 2;
/// Largest number of exposures in a bracket.
inline constexpr int kMaxBracket = 8;

/// The picture of one lens. `data` is borrowed from the camera.
struct View {
  int lens = 0;  ///< Index of the lens in the rig's calibration.
  PixelFormat format = PixelFormat::rgb8;
  int width = 0, height = 0;
  std::size_t stride = 0;  ///< Bytes between the starts of successive rows.
  std::span<const std::byte> data;
};

/// invalid_argument if the size does not fit the format (size_fits()), rows overlap, or `data` is shorter than the
/// picture. The message does not name the lens. Alignment is not checked.
[[nodiscard]] Status check_view(const View& view);

/// Code of pixel (x, y): of its luma or green, in a mosaic of its only sample. The format must not be of floats.
[[nodiscard]] inline unsigned code_at(const View& view, int x, int y) {
  const PixelLayout& layout = pixel_layout(view.format);
  const std::byte* at = view.data.data() + static_cast<std::size_t>(y) * view.stride +
                        static_cast<std::size_t>(x) * layout.pixel_bytes + layout.luma_offset;
  const auto low = std::to_integer<unsigned>(at[0]);
  return layout.sample_bytes == 1 ? low : low | std::to_integer<unsigned>(at[1]) << 8;
}

struct FrameInfo {
  std::uint64_t sequence = 0;  ///< Increases by one per frame; a gap is a lost frame.
  ProbeTime mid_exposure;      ///< Of the centre row if the shutter is a rolling one.
  ProbeTime delivered;         ///< When the backend called push().
  double exposure_s = 0;       ///< The exposure of this frame, which may differ from the request.
  double gain = 1;             ///< Linear.
  Duration row_readout;        ///< Delay between successive rows; zero for a global shutter.
  int bracket_index = 0;       ///< Index in the cycle of exposures, 0 to bracket_size - 1.
  int bracket_size = 1;
};

/// Owner of the memory that frames borrow.
class FrameOwner {
 public:
  /// The frame in this slot is no longer in use. Thread-safe; must not block for long.
  virtual void release(int slot) = 0;

 protected:
  ~FrameOwner() = default;
};

/// Metadata and borrowed pictures. Move-only; the destructor returns the memory to the backend, which must outlive it.
class Frame {
 public:
  Frame() = default;
  Frame(FrameOwner& owner, int slot) : loan_(&owner, {slot}) {}
  /// The other frame has no views afterwards.
  Frame(Frame&& o) noexcept
      : info(o.info), views_(o.views_), view_count_(std::exchange(o.view_count_, 0)), loan_(std::move(o.loan_)) {}
  Frame& operator=(Frame&& o) noexcept {
    info = o.info;
    views_ = o.views_;
    view_count_ = std::exchange(o.view_count_, 0);
    loan_ = std::move(o.loan_);
    return *this;
  }
  ~Frame() = default;

  FrameInfo info;

  /// In the order of the lenses.
  [[nodiscard]] std::span<const View> views() const { return {views_.data(), view_count_}; }
  /// Views beyond kMaxLenses are ignored.
  void add_view(const View& view) {
    if (view_count_ < views_.size()) views_[view_count_++] = view;
  }

 private:
  struct GiveBack {
    int slot;
    void operator()(FrameOwner* owner) const { owner->release(slot); }
  };

  std::array<View, kMaxLenses> views_{};
  std::size_t view_count_ = 0;
  std::unique_ptr<FrameOwner, GiveBack> loan_;
};

/// Receiver of frames.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// Called from one thread of the backend, in order of sequence. Must return without waiting for the estimator.
  virtual void push(Frame frame) = 0;
  /// Backends without a frame rate call it before each push, from the same thread: blocks while a frame pushed now
  /// would replace one that the consumer has not taken yet. False once `stop` is requested.
  [[nodiscard]] virtual bool wait_for_space(std::stop_token stop) { return !stop.stop_requested(); }
};

}  // namespace lightwell
