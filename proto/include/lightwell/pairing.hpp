// Password-authenticated key exchange for pairing: both sides derive a shared key from a short code. Needs the library
// lightwell_pairing. Messages: proto/lightwell/v1/pairing.proto.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <lightwell/result.hpp>

namespace lightwell {

/// Default port of the pairing service.
inline constexpr int kDefaultPairingPort = 7421;

enum class PairingSide { client, probe };

struct SealedMessage;

/// Operations of both sides after the key exchange.
class PairingChannel {
 public:
  PairingChannel(PairingChannel&&) noexcept;
  PairingChannel& operator=(PairingChannel&&) noexcept;
  ~PairingChannel();

  /// Whether the peer's confirmation proves that it knows the code. Constant time.
  [[nodiscard]] bool confirms(std::string_view their_confirmation) const;
  /// Decrypts the peer's sealed message. data_loss if it was modified.
  [[nodiscard]] Result<std::string> open(std::string_view sealed) const;

 protected:
  struct State;
  explicit PairingChannel(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// One run of SPAKE2 (RFC 9382; P-256, SHA-256, HKDF, HMAC), for one code and one TLS certificate. A peer that does not
/// know the code can test a single guess per run and learns nothing else. One thread.
class PairingExchange : public PairingChannel {
 public:
  [[nodiscard]] static Result<PairingExchange> begin(PairingSide side, std::string_view code);

  /// This side's public share, 65 bytes, to be sent to the peer.
  [[nodiscard]] const std::string& share() const;
  /// Processes the peer's share and derives the keys. `certificate_digest` (secrets.hpp): of the certificate that the
  /// probe presents in this TLS connection. With a man in the middle the two sides see different certificates and
  /// derive different keys. data_loss if the share is not a point of the curve, or makes K the point at infinity.
  [[nodiscard]] Status process_peer_share(std::string_view their_share, std::string_view certificate_digest);

  // The following, and the functions of PairingChannel, only after process_peer_share().

  /// Proof to the peer that this side knows the code.
  [[nodiscard]] const std::string& confirmation() const;
  /// Encrypts and authenticates (AES-256-GCM). The nonce is fixed, so a key may encrypt one message only: the exchange
  /// is consumed, and the returned `reader` can open messages but not seal. internal if it was consumed before.
  [[nodiscard]] Result<SealedMessage> seal(std::string_view plain) &&;

 private:
  using PairingChannel::PairingChannel;
};

struct SealedMessage {
  std::string bytes;
  PairingChannel reader;  ///< Opens the peer's response.
};

}  // namespace lightwell
