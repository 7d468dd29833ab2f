// Linear values of 8-bit codes in a form that vector units can look up.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace lightwell::estimate {

/// A quadratic for each 16 codes, in 1/65535 of full scale. With h = code / 16 and t = code % 16, the value of a code
/// is
///   base[h] + (rise[h] t) / 2^4 + (bend[h] t²) / 2^9, each quotient rounded down,
/// and exact[t] in one segment: that with a kink or a steep curvature, such as the beginning of the sRGB curve. There,
/// the other coefficients are 0.
struct CodeSegments {
  static constexpr std::size_t kLength = 16;

  /// 16 words, negative ones in two's complement, as low and high bytes: what byte shuffles of 128 bits select from.
  struct Words {
    alignas(kLength) std::array<std::uint8_t, kLength> low{}, high{};

    [[nodiscard]] std::uint16_t operator[](std::size_t i) const {
      return static_cast<std::uint16_t>(low[i] | high[i] << 8);
    }
    void set(std::size_t i, int word) {
      low[i] = static_cast<std::uint8_t>(word);
      high[i] = static_cast<std::uint8_t>(word >> 8);
    }
  };

  std::size_t exact_segment = 0;
  Words exact, base, rise, bend;

  [[nodiscard]] int value(std::size_t code) const;
};

/// Linear values of the 256 codes; full scale is 65535; 0 by default. The values are those of segments() where these
/// represent the curve, so that every vector unit computes the same sums, whichever form it reads.
class CodeTable {
 public:
  CodeTable() = default;
  /// `linear`: exact values, in [0, 65535]; values outside are clamped. The errors of neighbouring codes compensate
  /// each other, so that sums over several codes are more precise than a value, which is within kMaxSegmentError.
  explicit CodeTable(const std::array<double, 256>& linear);

  [[nodiscard]] std::uint16_t operator[](std::size_t code) const { return values_[code]; }
  [[nodiscard]] const std::array<std::uint16_t, 256>& values() const { return values_; }
  /// Null for a curve with two or more segments that quadratics do not represent within kMaxSegmentError.
  [[nodiscard]] const CodeSegments* segments() const { return segments_ ? &*segments_ : nullptr; }

 private:
  std::array<std::uint16_t, 256> values_{};
  std::optional<CodeSegments> segments_;
};

/// Largest error of a value, in 1/65535 of full scale. That of a rounded value is 1 with compensation; the values of
/// neighbouring codes of an sRGB camera differ by 19 or more.
inline constexpr double kMaxSegmentError = 1.5;

}  // namespace lightwell::estimate
