#include "app/preview.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "imaging/jpeg_encoder.hpp"

namespace lightwell {
namespace {

constexpr JpegOptions kJpeg{.quality = 80};

/// The frame with the median exposure; of an even number the shorter of the two. `bracket` is not empty.
const Frame& middle_exposure(std::span<const Frame> bracket) {
  std::array<const Frame*, kMaxBracket> frames{};
  const std::size_t n = std::min(bracket.size(), frames.size());
  std::transform(bracket.begin(), bracket.begin() + static_cast<std::ptrdiff_t>(n), frames.begin(),
                 [](const Frame& frame) { return &frame; });
  const auto middle = frames.begin() + static_cast<std::ptrdiff_t>((n - 1) / 2);
  std::nth_element(frames.begin(), middle, frames.begin() + static_cast<std::ptrdiff_t>(n),
                   [](const Frame* a, const Frame* b) {
                     return a->info.exposure_s * a->info.gain < b->info.exposure_s * b->info.gain;
                   });
  return **middle;
}

}  // namespace

Preview::Preview(const RigParameters& rig) : reducer_(rig), newest_(reducer_.blank()), encoding_(reducer_.blank()) {}

void Preview::offer(std::span<const Frame> bracket) {
  if (!requested_.load(std::memory_order_relaxed) || bracket.empty()) return;
  requested_.store(false, std::memory_order_relaxed);
  const std::lock_guard lock(copy_mutex_);
  reducer_.reduce(middle_exposure(bracket), newest_);
  newest_time_ = Clock::now();
  is_new_ = true;
}

Result<PreviewJpeg> Preview::request() {
  const std::lock_guard lock(encode_mutex_);
  const Clock::time_point now = Clock::now();
  bool encode = false;
  {
    const std::lock_guard copy_lock(copy_mutex_);
    encode = std::exchange(is_new_, false) && now - newest_time_ < kMaxAge;
    if (encode) {
      std::swap(newest_, encoding_);
      jpeg_time_ = newest_time_;
    }
  }
  if (encode) {
    const Image picture = encode_srgb(encoding_, reducer_.width(), reducer_.height());
    Result<std::vector<std::byte>> jpeg = encode_jpeg(picture.data, picture.width, picture.height, kJpeg);
    if (!jpeg) return jpeg.status();
    jpeg_ = std::make_shared<const std::vector<std::byte>>(std::move(*jpeg));
  }
  if (jpeg_ && now - jpeg_time_ < kMaxAge) return jpeg_;
  jpeg_.reset();
  if (now - jpeg_time_ >= kInterval) requested_.store(true, std::memory_order_relaxed);
  return PreviewJpeg();
}

}  // namespace lightwell
