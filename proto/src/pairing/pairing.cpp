#include <array>
#include <utility>

#include <lightwell/pairing.hpp>
#include <lightwell/secrets.hpp>

#include "pairing/openssl.hpp"
#include "pairing/spake2.hpp"

namespace lightwell {
namespace {

constexpr std::size_t kTagBytes = 16;
/// A fixed nonce is safe, because each key seals one message only.
constexpr std::array<unsigned char, 12> kNonce{};

using Cipher = std::unique_ptr<EVP_CIPHER_CTX, Deleter<EVP_CIPHER_CTX_free>>;

const char* label_of(PairingSide side) {
  return side == PairingSide::client ? "lightwell pairing client" : "lightwell pairing probe";
}

PairingSide other(PairingSide side) { return side == PairingSide::client ? PairingSide::probe : PairingSide::client; }

enum class Direction : int { decrypt, encrypt };

/// AES-256-GCM with the key of the messages that `sender` seals; null without a key `ke`, or if OpenSSL fails.
Cipher cipher_of(const std::string& ke, PairingSide sender, Direction direction) {
  const std::string key = ke.empty() ? std::string() : pairing::hkdf(ke, label_of(sender), 32);
  Cipher cipher(key.empty() ? nullptr : EVP_CIPHER_CTX_new());
  if (cipher && EVP_CipherInit_ex(cipher.get(), EVP_aes_256_gcm(), nullptr, pairing::bytes_of(key), kNonce.data(),
                                  static_cast<int>(direction)) != 1)
    cipher.reset();
  return cipher;
}

/// Encrypts or decrypts `in`, and computes or verifies the tag. False if that fails.
bool process(const Cipher& cipher, std::string_view in, std::string& out) {
  int size = 0, rest = 0;
  return EVP_CipherUpdate(cipher.get(), pairing::bytes_of(out), &size, pairing::bytes_of(in),
                          static_cast<int>(in.size())) == 1 &&
         EVP_CipherFinal_ex(cipher.get(), pairing::bytes_of(out) + size, &rest) == 1;
}

}  // namespace

struct PairingChannel::State {
  PairingSide side = PairingSide::client;
  std::string w, secret, share;
  pairing::Spake2Keys keys;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    for (std::string* s : {&w, &secret, &keys.ke}) OPENSSL_cleanse(s->data(), s->size());
  }
  [[nodiscard]] const std::string& confirmation(PairingSide of) const {
    return of == PairingSide::client ? keys.confirmation_a : keys.confirmation_b;
  }
};

PairingChannel::PairingChannel(std::unique_ptr<State> state) : state_(std::move(state)) {}
PairingChannel::PairingChannel(PairingChannel&&) noexcept = default;
PairingChannel& PairingChannel::operator=(PairingChannel&&) noexcept = default;
PairingChannel::~PairingChannel() = default;

Result<PairingExchange> PairingExchange::begin(PairingSide side, std::string_view code) {
  auto state = std::make_unique<State>();
  state->side = side;
  if (Status s = pairing::scalar_of_code(code).assign_to(state->w); !s.ok()) return s;
  if (Status s = pairing::random_scalar().assign_to(state->secret); !s.ok()) return s;
  if (Status s = pairing::share_of(side, state->w, state->secret).assign_to(state->share); !s.ok()) return s;
  return PairingExchange(std::move(state));
}

const std::string& PairingExchange::share() const { return state_->share; }

Status PairingExchange::process_peer_share(std::string_view their_share, std::string_view certificate_digest) {
  const pairing::Identities identities{"lightwell client", "lightwell probe " + std::string(certificate_digest)};
  return pairing::keys_of(state_->side, state_->w, state_->secret, state_->share, their_share, identities)
      .assign_to(state_->keys);
}

const std::string& PairingExchange::confirmation() const { return state_->confirmation(state_->side); }

bool PairingChannel::confirms(std::string_view theirs) const {
  const std::string& expected = state_->confirmation(other(state_->side));
  return !expected.empty() && same_secret(expected, theirs);
}

Result<SealedMessage> PairingExchange::seal(std::string_view plain) && {
  std::unique_ptr<State> state = std::move(state_);
  if (!state) return Status(StatusCode::internal, "this exchange has already sealed its message; begin another");
  const Cipher cipher = cipher_of(state->keys.ke, state->side, Direction::encrypt);
  std::string out(plain.size() + kTagBytes, '\0');
  if (!cipher || !process(cipher, plain, out) ||
      EVP_CIPHER_CTX_ctrl(cipher.get(), EVP_CTRL_GCM_GET_TAG, static_cast<int>(kTagBytes), out.data() + plain.size()) !=
          1)
    return Status(StatusCode::internal, "sealing failed: there is no key yet, or OpenSSL has no AES-256-GCM");
  return SealedMessage{std::move(out), PairingExchange(std::move(state))};
}

Result<std::string> PairingChannel::open(std::string_view sealed) const {
  const Status refused(StatusCode::data_loss, "the sealed message cannot be decrypted with this exchange's key");
  if (sealed.size() < kTagBytes) return refused;
  const std::string_view body = sealed.substr(0, sealed.size() - kTagBytes);
  std::string tag(sealed.substr(body.size())), out(body.size(), '\0');
  const Cipher cipher = cipher_of(state_->keys.ke, other(state_->side), Direction::decrypt);
  if (!cipher ||
      EVP_CIPHER_CTX_ctrl(cipher.get(), EVP_CTRL_GCM_SET_TAG, static_cast<int>(kTagBytes), tag.data()) != 1 ||
      !process(cipher, body, out))
    return refused;
  return out;
}

}  // namespace lightwell
