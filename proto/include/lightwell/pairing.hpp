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

struct SealedMessage;

/// What both ends do once they have met.
class PairingChannel {
 public:
  PairingChannel(PairingChannel&&) noexcept;
  PairingChannel& operator=(PairingChannel&&) noexcept;
  ~PairingChannel();

  /// Whether the other side knows the code. In constant time.
  [[nodiscard]] bool confirms(std::string_view their_confirmation) const;
  /// What the other side sealed. data_loss where a bit of it was changed.
  [[nodiscard]] Result<std::string> open(std::string_view sealed) const;

 protected:
  struct State;
  explicit PairingChannel(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// One run of SPAKE2 (RFC 9382; P-256, SHA-256, HKDF, HMAC), for one code and one TLS certificate. Whoever does not
/// know the code learns nothing from it but whether one guess was right. One thread.
class PairingExchange : public PairingChannel {
 public:
  [[nodiscard]] static Result<PairingExchange> begin(PairingSide side, std::string_view code);

  /// What the other side is sent, 65 bytes.
  [[nodiscard]] const std::string& share() const;
  /// Takes the other side's. `certificate_digest`: of the certificate that the probe shows in this connection
  /// (secrets.hpp). Two ends that saw different ones, because somebody stands between, do not come to the same key.
  /// data_loss where the share is no point of the curve, or one that would give the key away.
  [[nodiscard]] Status process_peer_share(std::string_view their_share, std::string_view certificate_digest);

  // After meet(), as what PairingChannel has.

  /// Proves to the other side that this one knows the code.
  [[nodiscard]] const std::string& confirmation() const;
  /// Encrypts and authenticates (AES-256-GCM). The nonce is fixed and a key is good for one message: the exchange is
  /// used up, and what it leaves can read and not seal. internal where it was used up before.
  [[nodiscard]] Result<SealedMessage> seal(std::string_view plain) &&;

 private:
  using PairingChannel::PairingChannel;
};

struct SealedMessage {
  std::string bytes;
  PairingChannel reader;  ///< For the other side's answer.
};

}  // namespace lightwell
