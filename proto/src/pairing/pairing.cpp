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
  Result<std::string> w = pairing::scalar_of_code(code), secret = pairing::random_scalar();
  if (!w) return w.status();
  if (!secret) return secret.status();
  state->w = std::move(*w);
  state->secret = std::move(*secret);
  Result<std::string> share = pairing::share_of(side, state->w, state->secret);
  if (!share) return share.status();
  state->share = std::move(*share);
  return PairingExchange(std::move(state));
}

const std::string& PairingExchange::share() const { return state_->share; }

Status PairingExchange::process_peer_share(std::string_view their_share, std::string_view certificate_digest) {
  const pairing::Identities identities{"lightwell client", "lightwell probe " + std::string(certificate_digest)};
  Result<pairing::Spake2Keys> keys =
      pairing::keys_of(state_->side, state_->w, state_->secret, state_->share, their_share, identities);
  if (!keys) return keys.status();
  state_->keys = std::move(*keys);
  return {};
}

const std::string& PairingExchange::confirmation() const { return state_->confirmation(state_->side); }

bool PairingChannel::confirms(std::string_view theirs) const {
  const std::string& expected = state_->confirmation(other(state_->side));
  return !expected.empty() && same_secret(expected, theirs);
}

Result<SealedMessage> PairingExchange::seal(std::string_view plain) && {
  std::unique_ptr<State> state = std::move(state_);
  if (!state) return Status(StatusCode::internal, "this exchange has already sealed its message; begin another");
  const std::string key = pairing::hkdf(state->keys.ke, label_of(state->side), 32);
  const Cipher cipher(EVP_CIPHER_CTX_new());
  std::string out(plain.size() + kTagBytes, '\0');
  int n = 0, last = 0;
  if (state->keys.ke.empty() || key.empty() || !cipher ||
      EVP_EncryptInit_ex(cipher.get(), EVP_aes_256_gcm(), nullptr, pairing::bytes_of(key), kNonce.data()) != 1 ||
      EVP_EncryptUpdate(cipher.get(), pairing::bytes_of(out), &n, pairing::bytes_of(plain),
                        static_cast<int>(plain.size())) != 1 ||
      EVP_EncryptFinal_ex(cipher.get(), pairing::bytes_of(out) + n, &last) != 1 ||
      EVP_CIPHER_CTX_ctrl(cipher.get(), EVP_CTRL_GCM_GET_TAG, static_cast<int>(kTagBytes), out.data() + plain.size()) !=
          1)
    return Status(StatusCode::internal, "sealing failed: there is no key yet, or OpenSSL has no AES-256-GCM");
  return SealedMessage{std::move(out), PairingExchange(std::move(state))};
}

Result<std::string> PairingChannel::open(std::string_view sealed) const {
  const Status refused(StatusCode::data_loss, "the sealed message cannot be decrypted with this exchange's key");
  if (state_->keys.ke.empty() || sealed.size() < kTagBytes) return refused;
  const std::string key = pairing::hkdf(state_->keys.ke, label_of(other(state_->side)), 32);
  const std::string_view body = sealed.substr(0, sealed.size() - kTagBytes);
  std::string tag(sealed.substr(body.size()));
  const Cipher cipher(EVP_CIPHER_CTX_new());
  std::string out(body.size(), '\0');
  int n = 0, last = 0;
  if (key.empty() || !cipher ||
      EVP_DecryptInit_ex(cipher.get(), EVP_aes_256_gcm(), nullptr, pairing::bytes_of(key), kNonce.data()) != 1 ||
      EVP_DecryptUpdate(cipher.get(), pairing::bytes_of(out), &n, pairing::bytes_of(body),
                        static_cast<int>(body.size())) != 1 ||
      EVP_CIPHER_CTX_ctrl(cipher.get(), EVP_CTRL_GCM_SET_TAG, static_cast<int>(kTagBytes), tag.data()) != 1 ||
      EVP_DecryptFinal_ex(cipher.get(), pairing::bytes_of(out) + n, &last) != 1)
    return refused;
  return out;
}

}  // namespace lightwell
