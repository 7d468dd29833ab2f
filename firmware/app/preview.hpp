// The preview picture: a small copy of a frame when a client asks, encoded outside of the path of frames.
#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <span>

#include <lightwell/commands.hpp>

#include "app/small_picture.hpp"

namespace lightwell {

/// offer() is called from the pipeline's thread, request() from any other.
class Preview {
 public:
  /// Between the frames of two pictures, at least.
  static constexpr std::chrono::milliseconds kInterval{1000};
  /// Of a picture that a request gets; requests later than that wait for the next one.
  static constexpr std::chrono::milliseconds kMaxAge{100};

  explicit Preview(const RigParameters& rig);

  /// Copies the small picture of the bracket's middle exposure if one was requested; otherwise it reads one flag.
  void offer(std::span<const Frame> bracket);
  /// As Commands::preview(). Encodes on this thread.
  [[nodiscard]] Result<PreviewJpeg> request();

 private:
  using Clock = std::chrono::steady_clock;

  std::atomic<bool> requested_{false};
  const PictureReducer reducer_;

  std::mutex copy_mutex_;  ///< Guards the next three members.
  SmallPicture newest_;
  Clock::time_point newest_time_;
  bool is_new_ = false;  ///< `newest_` is not encoded yet.

  std::mutex encode_mutex_;  ///< Guards the members below. Locked before copy_mutex_.
  SmallPicture encoding_;
  Clock::time_point jpeg_time_;
  PreviewJpeg jpeg_;
};

}  // namespace lightwell
