// SPAKE2 (RFC 9382, section 3) as functions of explicit scalars and points: P256-SHA256-HKDF-HMAC.
#pragma once

#include <string>
#include <string_view>

#include <lightwell/pairing.hpp>
#include <lightwell/result.hpp>

namespace lightwell::pairing {

/// Scalars are 32 bytes, big-endian, below the group's order.
inline constexpr std::size_t kScalarBytes = 32;
/// An uncompressed point.
inline constexpr std::size_t kShareBytes = 65;

/// The scalar w of a password: its HKDF, reduced modulo the group's order (section 3.2; 48 bytes make the bias
/// negligible). No slow hash: the code is worthless after the pairing window, and before that can only be guessed
/// online.
[[nodiscard]] Result<std::string> scalar_of_code(std::string_view code);
/// A random scalar x or y: uniform, not zero.
[[nodiscard]] Result<std::string> random_scalar();

/// pA = x P + w M of the client, pB = y P + w N of the probe (section 3.3).
[[nodiscard]] Result<std::string> share_of(PairingSide side, std::string_view w, std::string_view secret);

struct Identities {
  std::string a, b;
};

struct Spake2Keys {
  std::string ke;                              ///< 16 bytes.
  std::string confirmation_a, confirmation_b;  ///< 32 bytes each.
};

/// Sections 3.3 and 4. data_loss if `theirs` is not a point of the curve, or K is the point at infinity.
[[nodiscard]] Result<Spake2Keys> keys_of(PairingSide side, std::string_view w, std::string_view secret,
                                         std::string_view own_share, std::string_view their_share,
                                         const Identities& identities);

}  // namespace lightwell::pairing
