// One-element buffer between the camera's thread and the estimator's: a newer bracket replaces one that waits.
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>

#include "imaging/frame.hpp"

namespace lightwell {

/// The frames of one bracket in the order of exposure. Move-only, like the frames.
class Bracket {
 public:
  void clear() {
    while (size_ > 0) frames_[--size_] = Frame();
  }
  /// Ignores frames beyond kMaxBracket.
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

/// Collects frames into brackets and keeps the newest complete one until it is taken.
class BracketSlot final : public FrameSink {
 public:
  void push(Frame frame) override;
  /// Waits until the complete bracket was taken; true then. False if `stop` was requested first; after close() it waits
  /// for `stop`.
  [[nodiscard]] bool wait_for_space(std::stop_token stop) override;

  /// Waits for a complete bracket; false once close() was called.
  [[nodiscard]] bool take(Bracket& out);
  /// Ends take() permanently and releases all frames.
  void close();

  struct Counts {
    std::uint64_t frames = 0, lost = 0, dropped = 0, incomplete = 0;
  };
  [[nodiscard]] Counts counts() const;

 private:
  /// Counts each incomplete bracket once. A bracket is identified by the sequence number of its first exposure.
  void count_incomplete(std::uint64_t first_sequence);

  mutable std::mutex mutex_;
  std::condition_variable ready_;
  std::condition_variable_any space_available_;  ///< Supports a stop_token.
  Bracket filling_, whole_;
  Counts counts_;
  std::uint64_t last_sequence_ = 0;
  std::optional<std::uint64_t> last_incomplete_;
  bool closed_ = false;
};

}  // namespace lightwell
