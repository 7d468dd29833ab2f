#include "pairing/spake2.hpp"

#include <lightwell/secrets.hpp>

#include "pairing/openssl.hpp"

namespace lightwell::pairing {
namespace {

// Section 6, compressed.
constexpr std::string_view kM = "02886e2f97ace46e55ba9dd7242579f2993b64e16ef3dcab95afd497333d8fa12f";
constexpr std::string_view kN = "03d8bbd6c639c62937b04d997f38c3770719c629d7014d49a24b4f98baa1292b49";

Status openssl_failure() { return {StatusCode::internal, "OpenSSL's arithmetic on P-256 failed"}; }

/// Group and context for all computations.
struct Curve {
  Group group{EC_GROUP_new_by_curve_name(NID_X9_62_prime256v1)};
  BigNumberContext context{BN_CTX_secure_new()};

  [[nodiscard]] bool ready() const { return group && context; }
  [[nodiscard]] Point point() const { return Point(EC_POINT_new(group.get())); }
  /// The point M or N; null if it cannot be decoded, which does not depend on input.
  [[nodiscard]] Point constant(std::string_view hex) const {
    return Point(EC_POINT_hex2point(group.get(), std::string(hex).c_str(), nullptr, context.get()));
  }
};

BigNumber number_of(std::string_view bytes) {
  BigNumber out(BN_bin2bn(bytes_of(bytes), static_cast<int>(bytes.size()), BN_secure_new()));
  // EC_POINT_mul() calls BN_num_bits(), which OpenSSL 3.0 computes in constant time only with this flag.
  if (out) BN_set_flags(out.get(), BN_FLG_CONSTTIME);
  return out;
}

Result<std::string> bytes_of_number(const BIGNUM* number) {
  std::string out(kScalarBytes, '\0');
  if (BN_bn2binpad(number, bytes_of(out), static_cast<int>(out.size())) < 0) return openssl_failure();
  return out;
}

Result<std::string> bytes_of_point(const Curve& curve, const EC_POINT* point) {
  std::string out(kShareBytes, '\0');
  const std::size_t n = EC_POINT_point2oct(curve.group.get(), point, POINT_CONVERSION_UNCOMPRESSED, bytes_of(out),
                                           out.size(), curve.context.get());
  if (n != kShareBytes) return openssl_failure();
  return out;
}

/// Length in eight bytes, little-endian, then the bytes (section 3.3).
void add_field(std::string& transcript, std::string_view field) {
  for (int i = 0; i < 8; ++i)
    transcript += static_cast<char>((static_cast<unsigned long long>(field.size()) >> (8 * i)) & 0xFF);
  transcript += field;
}

}  // namespace

Result<std::string> scalar_of_code(std::string_view code) {
  const Curve curve;
  const std::string wide = hkdf(code, "lightwell pairing code", 48);
  const BigNumber number = number_of(wide), w(BN_secure_new());
  if (!curve.ready() || wide.empty() || !number || !w) return openssl_failure();
  if (BN_mod(w.get(), number.get(), EC_GROUP_get0_order(curve.group.get()), curve.context.get()) != 1)
    return openssl_failure();
  return bytes_of_number(w.get());
}

Result<std::string> random_scalar() {
  const Curve curve;
  const BigNumber x(BN_secure_new());
  if (!curve.ready() || !x) return openssl_failure();
  do {
    if (BN_priv_rand_range(x.get(), EC_GROUP_get0_order(curve.group.get())) != 1)
      return Status(StatusCode::internal, "the system's random number generator failed");
  } while (BN_is_zero(x.get()));
  return bytes_of_number(x.get());
}

Result<std::string> share_of(PairingSide side, std::string_view w, std::string_view secret) {
  const Curve curve;
  if (!curve.ready()) return openssl_failure();
  const Point blind = curve.constant(side == PairingSide::client ? kM : kN), own = curve.point(), share = curve.point();
  const BigNumber w_number = number_of(w), x = number_of(secret);
  if (!blind || !own || !share || !w_number || !x) return openssl_failure();
  const EC_GROUP* const g = curve.group.get();
  BN_CTX* const c = curve.context.get();
  // Two multiplications and an addition, because the combined call is not constant-time.
  if (EC_POINT_mul(g, own.get(), x.get(), nullptr, nullptr, c) != 1 ||
      EC_POINT_mul(g, share.get(), nullptr, blind.get(), w_number.get(), c) != 1 ||
      EC_POINT_add(g, share.get(), share.get(), own.get(), c) != 1)
    return openssl_failure();
  return bytes_of_point(curve, share.get());
}

Result<Spake2Keys> keys_of(PairingSide side, std::string_view w, std::string_view secret, std::string_view own_share,
                           std::string_view their_share, const Identities& identities) {
  const Curve curve;
  if (!curve.ready()) return openssl_failure();
  const EC_GROUP* const g = curve.group.get();
  BN_CTX* const c = curve.context.get();
  const Status refused(StatusCode::data_loss, "the peer's share is not a valid point of P-256");
  const Point theirs = curve.point();
  // Accepts the uncompressed form only, and checks that the point is on the curve; the cofactor is 1.
  if (their_share.size() != kShareBytes || !theirs ||
      EC_POINT_oct2point(g, theirs.get(), bytes_of(their_share), their_share.size(), c) != 1)
    return refused;
  const Point blind = curve.constant(side == PairingSide::client ? kN : kM), k = curve.point();
  const BigNumber w_number = number_of(w), x = number_of(secret);
  if (!blind || !k || !w_number || !x) return openssl_failure();
  // K = x (pB - w N) for the client, K = y (pA - w M) for the probe.
  if (EC_POINT_mul(g, k.get(), nullptr, blind.get(), w_number.get(), c) != 1 || EC_POINT_invert(g, k.get(), c) != 1 ||
      EC_POINT_add(g, k.get(), theirs.get(), k.get(), c) != 1)
    return openssl_failure();
  if (EC_POINT_is_at_infinity(g, k.get()) == 1) return refused;
  if (EC_POINT_mul(g, k.get(), nullptr, k.get(), x.get(), c) != 1) return openssl_failure();
  const Result<std::string> k_bytes = bytes_of_point(curve, k.get());
  if (!k_bytes) return k_bytes.status();

  const bool client = side == PairingSide::client;
  std::string transcript;
  transcript.reserve(512);
  add_field(transcript, identities.a);
  add_field(transcript, identities.b);
  add_field(transcript, client ? own_share : their_share);
  add_field(transcript, client ? their_share : own_share);
  add_field(transcript, *k_bytes);
  add_field(transcript, w);
  std::string digest = sha256(transcript);
  const std::string confirming = hkdf(std::string_view(digest).substr(16), "ConfirmationKeys", 32);
  Spake2Keys keys{digest.substr(0, 16), hmac(std::string_view(confirming).substr(0, 16), transcript),
                  hmac(std::string_view(confirming).substr(16), transcript)};
  OPENSSL_cleanse(transcript.data(), transcript.size());
  OPENSSL_cleanse(digest.data(), digest.size());
  if (confirming.size() != 32 || keys.confirmation_a.size() != 32 || keys.confirmation_b.size() != 32)
    return openssl_failure();
  return keys;
}

}  // namespace lightwell::pairing
