// PairingWindow: valid and invalid pairings, limits, and confidentiality of its messages.
#include "link/grpc/pairing_window.hpp"

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/pairing.hpp>

#include "firmware/link/guarded_probe.hpp"
#include "lightwell/v1/pairing.grpc.pb.h"
#include "link/access/client_list.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// A client whose steps a test can call and modify one by one. Records all messages.
class PairingClient {
 public:
  PairingClient(const PairingWindow& window, const ProbeKeys& keys)
      : certificate_(*certificate_digest(keys.certificate)), key_(*KeyPair::make()) {
    grpc::ChannelArguments arguments;
    arguments.SetSslTargetNameOverride(kProbeHostName);
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    stub_ =
        v1::PairingService::NewStub(grpc::CreateCustomChannel(window.address().substr(std::string("grpcs://").size()),
                                                              grpc::SslCredentials({keys.trust, "", ""}), arguments));
  }

  grpc::Status begin(const v1::PairBeginRequest& request) {
    grpc::ClientContext context;
    messages_.push_back(request.SerializeAsString());
    const grpc::Status s = stub_->Begin(&context, request, &begun_);
    messages_.push_back(begun_.SerializeAsString());
    return s;
  }
  grpc::Status finish(const v1::PairFinishRequest& request) {
    grpc::ClientContext context;
    messages_.push_back(request.SerializeAsString());
    const grpc::Status s = stub_->Finish(&context, request, &finished_);
    messages_.push_back(finished_.SerializeAsString());
    return s;
  }

  /// Performs the first round trip and returns the request for the second.
  v1::PairFinishRequest process_peer_share(const std::string& code) {
    exchange_.emplace(std::move(*PairingExchange::begin(PairingSide::client, code)));
    v1::PairBeginRequest request;
    request.set_share(exchange_->share());
    EXPECT_TRUE(begin(request).ok());
    EXPECT_TRUE(exchange_->process_peer_share(begun_.share(), certificate_).ok());
    v1::PairApplication application;
    application.set_client_name("client");
    application.set_public_key(key_.public_pem);
    v1::PairFinishRequest next;
    next.set_session(begun_.session());
    next.set_confirmation(exchange_->confirmation());
    Result<SealedMessage> sealed = std::move(*exchange_).seal(application.SerializeAsString());
    EXPECT_TRUE(sealed.ok()) << sealed.status().message();
    next.set_sealed(sealed->bytes);
    reader_.emplace(std::move(sealed->reader));
    return next;
  }
  grpc::Status pair(const std::string& code) { return finish(process_peer_share(code)); }

  /// The credentials received by the pairing.
  v1::PairCredentials credentials() const {
    v1::PairCredentials out;
    EXPECT_TRUE(reader_->confirms(finished_.confirmation()));
    const Result<std::string> opened = reader_->open(finished_.sealed());
    EXPECT_TRUE(opened.ok() && out.ParseFromString(*opened));
    return out;
  }
  const KeyPair& key() const { return key_; }
  const std::vector<std::string>& messages() const { return messages_; }

 private:
  const std::string certificate_;
  const KeyPair key_;
  std::unique_ptr<v1::PairingService::Stub> stub_;
  std::optional<PairingExchange> exchange_;
  std::optional<PairingChannel> reader_;  // Decrypts the response.
  v1::PairBeginResponse begun_;
  v1::PairFinishResponse finished_;
  std::vector<std::string> messages_;
};

std::string different_code(const std::string& code) {
  std::string out = code;
  out.back() = out.back() == '9' ? '0' : static_cast<char>(out.back() + 1);
  return out;
}

class PairingWindowTest : public GuardedProbeTest {
 protected:
  void SetUp() override { config_.key_folder = folder_.path("keys"); }
  void open(std::chrono::seconds open_for = std::chrono::seconds(120)) {
    PairingWindowOptions options;
    options.listen = "127.0.0.1:0";
    options.probe_name = "attic";
    options.port = 7420;
    options.open_for = open_for;
    keys_ = keys();
    Result<std::unique_ptr<PairingWindow>> opened = PairingWindow::open(options, keys_);
    ASSERT_TRUE(opened.ok()) << opened.status().message();
    window_ = std::move(*opened);
  }
  [[nodiscard]] PairingOutcome outcome() const { return window_->wait(std::chrono::milliseconds(0)); }

  ProbeKeys keys_;
  std::unique_ptr<PairingWindow> window_;
};

TEST_F(PairingWindowTest, TheRightCodeGivesAValidTokenAndCertificate) {
  open();
  PairingClient client(*window_, keys_);
  ASSERT_TRUE(client.pair(window_->code()).ok());
  EXPECT_EQ(outcome(), PairingOutcome::paired);
  EXPECT_EQ(window_->client_name(), "client");
  const v1::PairCredentials credentials = client.credentials();
  EXPECT_EQ(credentials.probe_name(), "attic");
  EXPECT_EQ(credentials.port(), 7420U);
  EXPECT_EQ(credentials.probe_ca(), keys_.trust);
  EXPECT_NEAR(static_cast<double>(credentials.expires_s()), static_cast<double>(now() + 365 * 86'400), 60);
  listen(LinkSecurity::tls);
  EXPECT_TRUE(call(channel(), kInfo, "", "Bearer " + credentials.token()).status.ok());
  EXPECT_TRUE(call(channel(credentials.client_certificate(), client.key().private_pem), kInfo, "").status.ok());
}

TEST_F(PairingWindowTest, ACodeIsValidForOneClient) {
  open();
  ASSERT_TRUE(PairingClient(*window_, keys_).pair(window_->code()).ok());
  PairingClient second(*window_, keys_);
  v1::PairBeginRequest request;
  request.set_share(PairingExchange::begin(PairingSide::client, window_->code())->share());
  const grpc::Status s = second.begin(request);
  EXPECT_EQ(s.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(s.error_message(), HasSubstr("--pair"));
}

TEST_F(PairingWindowTest, ThreeWrongCodesCloseTheWindow) {
  open();
  PairingClient late(*window_, keys_);
  const v1::PairFinishRequest right = late.process_peer_share(window_->code());
  for (int i = 1; i <= PairingWindow::kMaxWrongCodes; ++i) {
    EXPECT_EQ(outcome(), PairingOutcome::open);
    EXPECT_EQ(PairingClient(*window_, keys_).pair(different_code(window_->code())).error_code(),
              grpc::StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(window_->wrong_codes(), i);
  }
  EXPECT_EQ(outcome(), PairingOutcome::too_many_wrong_codes);
  EXPECT_EQ(late.finish(right).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_FALSE(std::filesystem::exists(folder_.path("keys/clients"))) << "no client was registered";
}

TEST_F(PairingWindowTest, AReplayedPairingIsAWrongCode) {
  open();
  PairingClient first(*window_, keys_);
  const v1::PairFinishRequest recorded = first.process_peer_share(window_->code());
  v1::PairBeginRequest recorded_begin;
  ASSERT_TRUE(recorded_begin.ParseFromString(first.messages().front()));
  // Another session with the same client share; the probe's share is new.
  PairingClient thief(*window_, keys_);
  ASSERT_TRUE(thief.begin(recorded_begin).ok());
  v1::PairBeginResponse begun;
  ASSERT_TRUE(begun.ParseFromString(thief.messages().back()));
  v1::PairFinishRequest replayed = recorded;
  replayed.set_session(begun.session());
  EXPECT_EQ(thief.finish(replayed).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  // The recorded exchange is valid once, in its own session.
  ASSERT_TRUE(first.finish(recorded).ok());
  open();
  EXPECT_EQ(PairingClient(*window_, keys_).finish(recorded).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(window_->wrong_codes(), 0) << "an unknown session is not a guess";
}

TEST_F(PairingWindowTest, InventedSessionsDoNotCloseTheWindow) {
  open();
  PairingClient stranger(*window_, keys_), known(*window_, keys_);
  const v1::PairFinishRequest right = known.process_peer_share(window_->code());
  for (int i = 0; i < 3 * PairingWindow::kMaxWrongCodes; ++i) {
    v1::PairFinishRequest invented = right;
    invented.set_session(std::string(16, static_cast<char>('a' + i)));
    EXPECT_EQ(stranger.finish(invented).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  }
  EXPECT_EQ(outcome(), PairingOutcome::open);
  EXPECT_EQ(window_->wrong_codes(), 0);
  EXPECT_TRUE(known.finish(right).ok()) << "the right code is still accepted";
}

TEST_F(PairingWindowTest, AnExchangeAllowsOneGuess) {
  open();
  PairingClient client(*window_, keys_);
  const v1::PairFinishRequest right = client.process_peer_share(window_->code());
  v1::PairFinishRequest wrong = right;
  wrong.set_confirmation(std::string(32, 'x'));
  EXPECT_EQ(client.finish(wrong).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(client.finish(right).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(window_->wrong_codes(), 1) << "the second was not a guess, because its session was closed";
}

TEST_F(PairingWindowTest, RefusesInvalidSharesConfirmationsAndApplications) {
  open();
  PairingClient client(*window_, keys_);
  for (const std::string& share :
       {std::string(), std::string(65, '\0'), std::string(65, '\x04'), std::string(3000, 'x')}) {
    v1::PairBeginRequest request;
    request.set_share(share);
    EXPECT_EQ(client.begin(request).error_code(), grpc::StatusCode::DATA_LOSS);
  }
  v1::PairFinishRequest changed = client.process_peer_share(window_->code());
  changed.set_sealed(std::string(40, 'x'));
  EXPECT_EQ(client.finish(changed).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  v1::PairBeginRequest huge;
  huge.set_share(std::string(100'000, 'x'));
  EXPECT_EQ(client.begin(huge).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(outcome(), PairingOutcome::open);
  EXPECT_TRUE(PairingClient(*window_, keys_).pair(window_->code()).ok()) << "the right code is still accepted";
}

TEST_F(PairingWindowTest, LimitsTheNumberOfExchanges) {
  open();
  PairingClient client(*window_, keys_);
  v1::PairBeginRequest request;
  request.set_share(PairingExchange::begin(PairingSide::client, "000000")->share());
  for (int i = 0; i < PairingWindow::kMaxExchanges; ++i) ASSERT_TRUE(client.begin(request).ok());
  EXPECT_EQ(client.begin(request).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

TEST_F(PairingWindowTest, ClosesAfterItsTime) {
  open(std::chrono::seconds(1));
  EXPECT_EQ(window_->wait(std::chrono::seconds(10)), PairingOutcome::timed_out);
  v1::PairBeginRequest request;
  EXPECT_EQ(PairingClient(*window_, keys_).begin(request).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
}

TEST_F(PairingWindowTest, MessagesContainNoSecret) {
  open();
  PairingClient client(*window_, keys_);
  ASSERT_TRUE(client.pair(window_->code()).ok());
  const v1::PairCredentials credentials = client.credentials();
  ASSERT_EQ(client.messages().size(), 4U);
  std::string all;
  for (const std::string& one : client.messages()) all += one;
  for (const std::string& secret : {window_->code(), credentials.token(), credentials.client_certificate(), keys_.trust,
                                    client.key().private_pem, client.key().public_pem, keys_.key, keys_.issuer_key})
    for (const std::string& form :
         {secret, to_hex(secret), to_base64url(secret), sha256(secret), to_hex(sha256(secret))})
      EXPECT_THAT(all, Not(HasSubstr(form)));
  EXPECT_THAT(all, HasSubstr(client.messages().front().substr(2, 65))) << "the search must find known content";
}

TEST_F(PairingWindowTest, AClientNameCannotAddALineToTheList) {
  const std::string path = folder_.path("clients");
  const std::string hostile = "x\n" + std::string(64, 'a') + " - 9999999999 mallory\r\x1b[2J" + std::string(500, 'y');
  ASSERT_TRUE(ClientList::add(path, {std::string(64, 'b'), "", now() + 60, hostile}, now()).ok());
  ClientList list(path);
  EXPECT_TRUE(list.load().ok());
  std::ifstream file(path);
  int lines = 0;
  for (std::string line; std::getline(file, line);) {
    lines += line.front() != '#' ? 1 : 0;
    EXPECT_THAT(line, Not(HasSubstr("\x1b")));
  }
  EXPECT_EQ(lines, 1);
}

}  // namespace
}  // namespace lightwell::test
