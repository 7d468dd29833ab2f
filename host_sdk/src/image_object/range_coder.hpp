// Adaptive binary range coder (Martin 1979; carry propagation as in LZMA), with two adaptation rates for each context.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace lightwell::image_object {

/// Probability that a bit is 0: the mean of a fast and a slow estimate.
struct BitModel {
  std::uint16_t fast = 1U << 15, slow = 1U << 15;

  /// 16 bits, never 0 or 1.
  [[nodiscard]] std::uint32_t zero() const { return ((static_cast<std::uint32_t>(fast) + slow) >> 1) * 511 / 512 + 64; }
  void update(bool bit) {
    if (bit) {
      fast = static_cast<std::uint16_t>(fast - (fast >> 4));
      slow = static_cast<std::uint16_t>(slow - (slow >> 7));
    } else {
      fast = static_cast<std::uint16_t>(fast + ((65535 - fast) >> 4));
      slow = static_cast<std::uint16_t>(slow + ((65535 - slow) >> 7));
    }
  }
};

class RangeEncoder {
 public:
  void put(bool bit, BitModel& model) {
    const std::uint32_t bound = (range_ >> 16) * model.zero();
    if (bit) {
      low_ += bound;
      range_ -= bound;
    } else {
      range_ = bound;
    }
    model.update(bit);
    normalize();
  }
  /// A bit of which nothing is known.
  void put_raw(bool bit) {
    range_ >>= 1;
    if (bit) low_ += range_;
    normalize();
  }
  [[nodiscard]] std::string finish() {
    for (int i = 0; i < 5; ++i) shift();
    return std::move(out_);
  }

 private:
  void normalize() {
    while (range_ < 1U << 24) {
      range_ <<= 8;
      shift();
    }
  }
  void shift() {
    if (low_ < 0xFF000000U || low_ > 0xFFFFFFFFU) {
      const auto carry = static_cast<unsigned char>(low_ >> 32);
      if (started_) out_.push_back(static_cast<char>(cache_ + carry));
      started_ = true;
      for (; pending_ > 0; --pending_) out_.push_back(static_cast<char>(static_cast<unsigned char>(0xFF + carry)));
      cache_ = static_cast<unsigned char>(low_ >> 24);
    } else {
      ++pending_;
    }
    low_ = (low_ & 0x00FFFFFFU) << 8;
  }

  std::uint64_t low_ = 0;
  std::uint32_t range_ = 0xFFFFFFFFU;
  std::size_t pending_ = 0;
  unsigned char cache_ = 0;
  bool started_ = false;
  std::string out_;
};

class RangeDecoder {
 public:
  explicit RangeDecoder(std::span<const std::byte> in) : in_(in) {
    for (int i = 0; i < 4; ++i) code_ = code_ << 8 | next();
  }
  [[nodiscard]] bool get(BitModel& model) {
    const std::uint32_t bound = (range_ >> 16) * model.zero();
    const bool bit = code_ >= bound;
    if (bit) {
      code_ -= bound;
      range_ -= bound;
    } else {
      range_ = bound;
    }
    model.update(bit);
    normalize();
    return bit;
  }
  [[nodiscard]] bool get_raw() {
    range_ >>= 1;
    const bool bit = code_ >= range_;
    if (bit) code_ -= range_;
    normalize();
    return bit;
  }
  /// Whether more was read than there is: the input is truncated or damaged. Beyond its end the input reads as zeros.
  [[nodiscard]] bool overrun() const { return at_ > in_.size() + 4; }

 private:
  void normalize() {
    while (range_ < 1U << 24) {
      range_ <<= 8;
      code_ = code_ << 8 | next();
    }
  }
  std::uint32_t next() {
    const std::size_t at = at_++;
    return at < in_.size() ? std::to_integer<std::uint32_t>(in_[at]) : 0;
  }

  std::span<const std::byte> in_;
  std::size_t at_ = 0;
  std::uint32_t code_ = 0, range_ = 0xFFFFFFFFU;
};

}  // namespace lightwell::image_object
