// Pairing: peers with the same code derive the same key, others do not.
#include <set>
#include <string>
#include <type_traits>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/pairing.hpp>
#include <lightwell/secrets.hpp>

#include "pairing/spake2.hpp"

namespace lightwell {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string from_hex(std::string_view hex) {
  std::string out;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    out += static_cast<char>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16));
  return out;
}

/// RFC 9382, appendix B: SPAKE2-P256-SHA256-HKDF-HMAC.
struct Published {
  const char *a, *b, *w, *x, *y, *share_a, *share_b, *ke, *confirmation_a, *confirmation_b;
};
constexpr Published kPublished[] = {
    {"server", "client", "2ee57912099d31560b3a44b1184b9b4866e904c49d12ac5042c97dca461b1a5f",
     "43dd0fd7215bdcb482879fca3220c6a968e66d70b1356cac18bb26c84a78d729",
     "dcb60106f276b02606d8ef0a328c02e4b629f84f89786af5befb0bc75b6e66be",
     "04a56fa807caaa53a4d28dbb9853b9815c61a411118a6fe516a8798434751470f9010153ac33d0d5f2047ffdb1a3e42c9b4e6be662766e1ee"
     "b"
     "4116988ede5f912c",
     "0406557e482bd03097ad0cbaa5df82115460d951e3451962f1eaf4367a420676d09857ccbc522686c83d1852abfa8ed6e4a1155cf8f1543ce"
     "c"
     "a528afb591a1e0b7",
     "0e0672dc86f8e45565d338b0540abe69", "58ad4aa88e0b60d5061eb6b5dd93e80d9c4f00d127c65b3b35b1b5281fee38f0",
     "d3e2e547f1ae04f2dbdbf0fc4b79f8ecff2dff314b5d32fe9fcef2fb26dc459b"},
    {"", "client", "0548d8729f730589e579b0475a582c1608138ddf7054b73b5381c7e883e2efae",
     "403abbe3b1b4b9ba17e3032849759d723939a27a27b9d921c500edde18ed654b",
     "903023b6598908936ea7c929bd761af6039577a9c3f9581064187c3049d87065",
     "04a897b769e681c62ac1c2357319a3d363f610839c4477720d24cbe32f5fd85f44fb92ba966578c1b712be6962498834078262caa5b441ecf"
     "a"
     "9d4a9485720e918a",
     "04e0f816fd1c35e22065d5556215c097e799390d16661c386e0ecc84593974a61b881a8c82327687d0501862970c64565560cb5671f696048"
     "0"
     "50ca66ca5f8cc7fc",
     "642f05c473c2cd79909f9a841e2f30a7", "47d29e6666af1b7dd450d571233085d7a9866e4d49d2645e2df975489521232b",
     "3313c5cefc361d27fb16847a91c2a73b766ffa90a4839122a9b70a2f6bd1d6df"},
    {"server", "", "626e0cdc7b14c9db3e52a0b1b3a768c98e37852d5db30febe0497b14eae8c254",
     "07adb3db6bc623d3399726bfdbfd3d15a58ea776ab8a308b00392621291f9633",
     "b6a4fc8dbb629d4ba51d6f91ed1532cf87adec98f25dd153a75accafafedec16",
     "04f88fb71c99bfffaea370966b7eb99cd4be0ff1a7d335caac4211c4afd855e2e15a873b298503ad8ba1d9cbb9a392d2ba309b48bfd7879ae"
     "f"
     "d0f2cea6009763b0",
     "040c269d6be017dccb15182ac6bfcd9e2a14de019dd587eaf4bdfd353f031101e7cca177f8eb362a6e83e7d5e729c0732e1b528879c086f39"
     "b"
     "a0f31a9661bd34db",
     "005184ff460da2ce59062c87733c299c", "bc9f9bbe99f26d0b2260e6456e05a86196a3307ec6663a18bf6ac825736533b2",
     "c2370e1bf813b086dff0d834e74425a06e6390f48f5411900276dcccc5a297ec"},
    {"", "", "7bf46c454b4c1b25799527d896508afd5fc62ef4ec59db1efb49113063d70cca",
     "8cef65df64bb2d0f83540c53632de911b5b24b3eab6cc74a97609fd659e95473",
     "d7a66f64074a84652d8d623a92e20c9675c61cb5b4f6a0063e4648a2fdc02d53",
     "04a65b367a3f613cf9f0654b1b28a1e3a8a40387956c8ba6063e8658563890f46ca1ef6a676598889fc28de2950ab8120b79a5ef1ea4c9f44"
     "b"
     "c98f585634b46d66",
     "04589f13218822710d98d8b2123a079041052d9941b9cf88c6617ddb2fcc0494662eea8ba6b64692dc318250030c6af045cb738bc81ba35b0"
     "4"
     "3c3dcb46adf6f58d",
     "fc6374762ba5cf11f4b2caa08b2cd1b9", "dfb4db8d48ae5a675963ea5e6c19d98d4ea028d8e898dad96ea19a80ade95dca",
     "d0f0609d1613138d354f7e95f19fb556bf52d751947241e8c7118df5ef0ae175"},
};

TEST(Spake2, MatchesTheVectorsOfRfc9382) {
  using enum PairingSide;
  for (const Published& p : kPublished) {
    const std::string w = from_hex(p.w), x = from_hex(p.x), y = from_hex(p.y);
    const Result<std::string> a = pairing::share_of(client, w, x), b = pairing::share_of(probe, w, y);
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_EQ(to_hex(*a), p.share_a);
    EXPECT_EQ(to_hex(*b), p.share_b);
    const pairing::Identities identities{p.a, p.b};
    const auto at_a = pairing::keys_of(client, w, x, *a, *b, identities);
    const auto at_b = pairing::keys_of(probe, w, y, *b, *a, identities);
    for (const auto& keys : {at_a, at_b}) {
      ASSERT_TRUE(keys.ok()) << keys.status().message();
      EXPECT_EQ(to_hex(keys->ke), p.ke);
      EXPECT_EQ(to_hex(keys->confirmation_a), p.confirmation_a);
      EXPECT_EQ(to_hex(keys->confirmation_b), p.confirmation_b);
    }
  }
}

TEST(Spake2, RejectsInvalidShares) {
  const std::string w = from_hex(kPublished[0].w), x = from_hex(kPublished[0].x), own = from_hex(kPublished[0].share_a);
  std::string off_the_curve = from_hex(kPublished[0].share_b);
  off_the_curve.back() = static_cast<char>(off_the_curve.back() ^ 1);
  // The share w N makes K the point at infinity, a known value.
  const Result<std::string> nothing = pairing::share_of(PairingSide::probe, w, std::string(32, '\0'));
  ASSERT_TRUE(nothing.ok());
  for (const std::string& bad :
       {std::string(), std::string(1, '\0'), std::string(65, '\0'), "\x04" + std::string(64, '\xff'), off_the_curve,
        own.substr(0, 64), own + "x", "\x02" + own.substr(1, 32), *nothing}) {
    const auto keys = pairing::keys_of(PairingSide::client, w, x, own, bad, {"a", "b"});
    ASSERT_FALSE(keys.ok()) << to_hex(bad);
    EXPECT_EQ(keys.status().code(), StatusCode::data_loss);
  }
}

/// Both sides of an exchange, as far as it succeeds.
struct Pair {
  Pair(const std::string& code_of_client, const std::string& code_of_probe, const std::string& seen = "certificate",
       const std::string& shown = "certificate")
      : client(PairingExchange::begin(PairingSide::client, code_of_client)),
        probe(PairingExchange::begin(PairingSide::probe, code_of_probe)) {
    EXPECT_TRUE(client.ok() && probe.ok());
    EXPECT_TRUE(client->process_peer_share(probe->share(), seen).ok());
    EXPECT_TRUE(probe->process_peer_share(client->share(), shown).ok());
  }
  [[nodiscard]] bool agree() const {
    const bool one = client->confirms(probe->confirmation()), other = probe->confirms(client->confirmation());
    EXPECT_EQ(one, other);
    return one;
  }
  /// Consumes the exchange of that side.
  static std::string seal(Result<PairingExchange>& side, const std::string& text) {
    const Result<SealedMessage> sealed = std::move(*side).seal(text);
    EXPECT_TRUE(sealed.ok()) << sealed.status().message();
    return sealed.ok() ? sealed->bytes : std::string();
  }
  Result<PairingExchange> client, probe;
};

TEST(PairingExchange, SameCodeGivesTheSameKey) {
  for (const std::string& text : {std::string(), std::string("a token"), std::string(3000, 'x')}) {
    Pair pair("042917", "042917");
    EXPECT_TRUE(pair.agree());
    const Result<std::string> opened = pair.client->open(Pair::seal(pair.probe, text));
    ASSERT_TRUE(opened.ok()) << opened.status().message();
    EXPECT_EQ(*opened, text);
  }
}

// The nonce is fixed: a second message with the same key would break the confidentiality of both.
template <class T>
concept SealsInPlace = requires(T& exchange) {
  exchange.seal(std::string_view());
};
template <class T>
concept SealsAtAll = requires(T exchange) {
  std::move(exchange).seal(std::string_view());
};
static_assert(SealsAtAll<PairingExchange> && !SealsInPlace<PairingExchange> && !SealsAtAll<PairingChannel>);
static_assert(!std::is_copy_constructible_v<PairingExchange> && !std::is_copy_assignable_v<PairingExchange>);

TEST(PairingExchange, SealingConsumesTheExchangeAndReturnsAReader) {
  Pair pair("042917", "042917");
  const std::string answer = Pair::seal(pair.probe, "a token"), confirmation = pair.client->confirmation();
  const Result<SealedMessage> first = std::move(*pair.client).seal("mine");
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(*first->reader.open(answer), "a token");
  EXPECT_FALSE(first->reader.confirms(confirmation)) << "a mirror proves nothing";
  const Result<SealedMessage> second = std::move(*pair.client).seal("another");
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(second.status().message(), HasSubstr("begin another"));
}

TEST(PairingExchange, DifferentCodesGiveDifferentKeys) {
  Pair pair("042917", "042918");
  EXPECT_FALSE(pair.agree());
  EXPECT_EQ(pair.client->open(Pair::seal(pair.probe, "a token")).status().code(), StatusCode::data_loss);
}

TEST(PairingExchange, ManInTheMiddleWithAnotherCertificateFails) {
  EXPECT_FALSE(Pair("042917", "042917", "of the one between", "of the probe").agree());
}

TEST(PairingExchange, ConfirmationsOfBothSidesDiffer) {
  Pair pair("042917", "042917");
  EXPECT_FALSE(pair.probe->confirms(pair.probe->confirmation())) << "a mirror proves nothing";
  EXPECT_FALSE(pair.probe->confirms(""));
  const Result<SealedMessage> sealed = std::move(*pair.client).seal("mine");
  ASSERT_TRUE(sealed.ok());
  EXPECT_FALSE(sealed->reader.open(sealed->bytes).ok()) << "each side has its own key";
}

TEST(PairingExchange, NothingIsConfirmedOrSealedBeforeThePeersShare) {
  auto alone = PairingExchange::begin(PairingSide::probe, "042917");
  ASSERT_TRUE(alone.ok());
  EXPECT_FALSE(alone->confirms(""));
  EXPECT_FALSE(alone->open(std::string(40, 'x')).ok());
  EXPECT_FALSE(std::move(*alone).seal("x").ok());
}

TEST(PairingExchange, ModifiedSealedMessageIsRejected) {
  Pair pair("042917", "042917");
  const std::string sealed = Pair::seal(pair.probe, "a token");
  for (std::size_t i = 0; i < sealed.size(); ++i) {
    std::string changed = sealed;
    changed[i] = static_cast<char>(changed[i] ^ 0x10);
    EXPECT_FALSE(pair.client->open(changed).ok()) << i;
  }
  for (std::size_t n = 0; n < sealed.size(); ++n) EXPECT_FALSE(pair.client->open(sealed.substr(0, n)).ok()) << n;
}

TEST(PairingExchange, SharesAreDifferentInEveryRun) {
  std::set<std::string> shares;
  for (int i = 0; i < 20; ++i) shares.insert(PairingExchange::begin(PairingSide::probe, "042917")->share());
  EXPECT_EQ(shares.size(), 20U);
}

TEST(Secrets, DigestsAndEncodingsMatchTheStandards) {
  // FIPS 180-2, appendix B.1.
  EXPECT_EQ(to_hex(sha256("abc")), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  // RFC 4648, section 10, without padding; and the two characters that differ.
  EXPECT_EQ(to_base64url("foobar"), "Zm9vYmFy");
  EXPECT_EQ(to_base64url("fooba"), "Zm9vYmE");
  EXPECT_EQ(to_base64url("foob"), "Zm9vYg");
  EXPECT_EQ(to_base64url("\xfb\xff"), "-_8");
  EXPECT_TRUE(same_secret("abc", "abc"));
  EXPECT_FALSE(same_secret("abc", "abd"));
  EXPECT_FALSE(same_secret("abc", "abcd"));
}

TEST(Secrets, CodesHaveSixDigitsAndAreUniform) {
  double sum = 0;
  std::set<char> first;
  for (int i = 0; i < 2000; ++i) {
    const Result<std::string> code = random_code();
    ASSERT_TRUE(code.ok());
    ASSERT_EQ(code->size(), 6U);
    ASSERT_EQ(code->find_first_not_of("0123456789"), std::string::npos) << *code;
    sum += std::stod(*code);
    first.insert(code->front());
  }
  EXPECT_EQ(first.size(), 10U);
  // Uniform over a million: the standard deviation of the mean of 2000 codes is 6,455.
  EXPECT_NEAR(sum / 2000, 500'000, 6 * 6'455);
}

TEST(Secrets, KeysDifferEachTime) {
  const Result<KeyPair> one = KeyPair::make(), other = KeyPair::make();
  ASSERT_TRUE(one.ok() && other.ok());
  EXPECT_THAT(one->private_pem, HasSubstr("BEGIN PRIVATE KEY"));
  EXPECT_THAT(one->public_pem, HasSubstr("BEGIN PUBLIC KEY"));
  EXPECT_THAT(one->public_pem, Not(HasSubstr("PRIVATE")));
  EXPECT_NE(one->private_pem, other->private_pem);
  EXPECT_FALSE(certificate_digest(one->public_pem).ok()) << "a key is no certificate";
}

}  // namespace
}  // namespace lightwell
