// Between values and wire bytes. proto/README.md is the specification.
//   Encoder            Descriptor -> bytes, no allocation once warm
//   decode_descriptor  bytes -> Descriptor, everything checked
//   descriptor_to_json the protobuf JSON of bytes
//   wire_error         what rounding to the wire can do to the irradiance
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
/// A longer message is refused unread.
inline constexpr std::size_t kMaxDescriptorBytes = 64 * 1024;

/// Turns descriptors into bytes, over and over, into memory that it keeps. One thread at a time.
class Encoder {
 public:
  Encoder();
  ~Encoder();
  Encoder(Encoder&&) noexcept;
  Encoder& operator=(Encoder&&) noexcept;

  /// The bytes live until the next call. invalid_argument for a value that the wire cannot hold: NaN or infinity
  /// anywhere but in the bound, a band or a number of lights beyond the caps, a light without direction.
  [[nodiscard]] Result<std::span<const std::byte>> encode(const Descriptor& descriptor);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// data_loss for bytes that are no message, invalid_argument for a message that breaks the specification (each check
/// names the field). Fields that this version does not know are passed over.
[[nodiscard]] Result<Descriptor> decode_descriptor(std::span<const std::byte> bytes);

/// The protobuf JSON mapping of a message, zero fields included.
[[nodiscard]] Result<std::string> descriptor_to_json(std::span<const std::byte> bytes);
/// The other way, for tools and tests.
[[nodiscard]] Result<std::string> descriptor_from_json(std::string_view json);

/// The largest error that encoding this descriptor can make in the irradiance: RMS over normals and channels,
/// relative to `rms_irradiance` (RMS over normals of the three channels together).
[[nodiscard]] double wire_error(const Descriptor& descriptor, double rms_irradiance);

}  // namespace lightwell
