// Between the camera's thread and the estimator's: one place, and the newest bracket wins it.
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>

#include "camera/frame.hpp"

namespace lightwell {

/// The frames of one bracket, in order. Move-only, like the frames.
class Bracket {
 public:
  void clear() {
    while (size_ > 0) frames_[--size_] = Frame();
  }
  /// Only the first kMaxBracket are taken.
  void add(Frame frame) {
    if (size_ < frames_.size()) frames_[size_++] = std::move(frame);
  }
  [[nodiscard]] std::span<const Frame> frames() const { return {frames_.data(), size_}; }
  [[nodiscard]] bool empty() const { return size_ == 0; }

  Bracket() = default;
  Bracket(Bracket&& o) noexcept { *this = std::move(o); }
  Bracket& operator=(Bracket&& o) noexcept {
    clear();
    for (std::size_t i = 0; i < o.size_; ++i) frames_[i] = std::move(o.frames_[i]);
    size_ = o.size_;
    o.size_ = 0;
    return *this;
  }

 private:
  std::array<Frame, kMaxBracket> frames_;
  std::size_t size_ = 0;
};

/// Collects frames to brackets and keeps the newest whole one until it is taken.
class BracketSlot final : public FrameSink {
 public:
  void push(Frame frame) override;
  /// Until the whole bracket that waits was taken. After close(), until `stop`.
  [[nodiscard]] bool wait_for_space(std::stop_token stop) override;

  /// Waits for a whole bracket; false once close() was called.
  [[nodiscard]] bool take(Bracket& out);
  /// Wakes take() for good and gives back what is held.
  void close();

  struct Counts {
    std::uint64_t frames = 0, lost = 0, dropped = 0, incomplete = 0;
  };
  [[nodiscard]] Counts counts() const;

 private:
  /// Once a bracket, whichever of its exposures came. The bracket is known by its first exposure's number.
  void count_incomplete(std::uint64_t first_sequence);

  mutable std::mutex mutex_;
  std::condition_variable ready_;
  std::condition_variable_any space_available_;  ///< The one that waits with a stop_token.
  Bracket filling_, whole_;
  Counts counts_;
  std::uint64_t last_sequence_ = 0;
  std::optional<std::uint64_t> last_incomplete_;
  bool closed_ = false;
};

}  // namespace lightwell
