// Encoding and decoding of descriptors. Specification: proto/README.md.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include <lightwell/descriptor.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

inline constexpr std::uint32_t kWireVersion = 1;
/// A longer message is rejected without decoding.
inline constexpr std::size_t kMaxDescriptorBytes = 64 * 1024;

/// Encodes descriptors into a buffer that it reuses; allocates nothing after the first calls. One thread at a time.
class Encoder {
 public:
  Encoder();
  ~Encoder();
  Encoder(Encoder&&) noexcept;
  Encoder& operator=(Encoder&&) noexcept;

  /// The returned bytes are valid until the next call. invalid_argument for a value that the wire format cannot hold:
  /// NaN or infinity anywhere but in the bound, a band or a number of lights above the limits, a light of zero
  /// direction. Direction covariances are rounded so that they stay positive semi-definite; an indefinite one is sent
  /// as the nearest that is not.
  [[nodiscard]] Result<std::span<const std::byte>> encode(const Descriptor& descriptor);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// data_loss for bytes that are not a message, invalid_argument, naming the field, for a message that violates the
/// specification. Unknown fields are ignored. Direction covariances are positive semi-definite: an indefinite one, as
/// old recordings hold, is replaced by the nearest in the Frobenius norm.
[[nodiscard]] Result<Descriptor> decode_descriptor(std::span<const std::byte> bytes);

/// The protobuf JSON mapping of a message, zero fields included.
[[nodiscard]] Result<std::string> descriptor_to_json(std::span<const std::byte> bytes);
/// The inverse, for tools and tests.
[[nodiscard]] Result<std::string> descriptor_from_json(std::string_view json);

/// Upper bound of the irradiance error due to encoding this descriptor: RMS over normals and channels, relative to
/// `rms_irradiance` (RMS over normals and the three channels).
[[nodiscard]] double wire_error(const Descriptor& descriptor, double rms_irradiance);

}  // namespace lightwell
