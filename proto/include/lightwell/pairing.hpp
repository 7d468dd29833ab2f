// What the two ends of a pairing compute: a shared key out of a short code, for those alone who both know it.
// Needs the library lightwell_pairing. Messages: proto/lightwell/v1/pairing.proto.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <lightwell/result.hpp>

namespace lightwell {

/// The port that pairing is served on where none is named.
inline constexpr int kDefaultPairingPort = 7421;

enum class PairingSide { client, probe };

/// One run of SPAKE2 (RFC 9382; P-256, SHA-256, HKDF, HMAC), for one code and one TLS certificate. Whoever does not
/// know the code learns nothing from it but whether one guess was right. One thread.
class PairingExchange {
 public:
  [[nodiscard]] static Result<PairingExchange> begin(PairingSide side, std::string_view code);
  PairingExchange(PairingExchange&&) noexcept;
  PairingExchange& operator=(PairingExchange&&) noexcept;
  ~PairingExchange();

  /// What the other side is sent, 65 bytes.
  [[nodiscard]] const std::string& share() const;
  /// Takes the other side's. `certificate_digest`: of the certificate that the probe shows in this connection
  /// (secrets.hpp). Two ends that saw different ones, because somebody stands between, do not come to the same key.
  /// data_loss where the share is no point of the curve, or one that would give the key away.
  [[nodiscard]] Status meet(std::string_view their_share, std::string_view certificate_digest);

  // After meet().

  /// Proves to the other side that this one knows the code.
  [[nodiscard]] const std::string& confirmation() const;
  /// Whether the other side knows it. In constant time.
  [[nodiscard]] bool confirms(std::string_view their_confirmation) const;
  /// Encrypts and authenticates (AES-256-GCM). Once in each exchange: the key is used for one message.
  [[nodiscard]] Result<std::string> seal(std::string_view plain) const;
  /// What the other side sealed. data_loss where a bit of it was changed.
  [[nodiscard]] Result<std::string> open(std::string_view sealed) const;

 private:
  struct State;
  explicit PairingExchange(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace lightwell
