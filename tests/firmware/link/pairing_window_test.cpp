// Two minutes, one code, one client: what a pairing window gives away and what it does not.
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

/// The client's side by hand, so that a test can go wrong wherever it wants to. Keeps all that was said.
class Visitor {
 public:
  Visitor(const PairingWindow& window, const ProbeKeys& keys)
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
    said_.push_back(request.SerializeAsString());
    const grpc::Status s = stub_->Begin(&context, request, &begun_);
    said_.push_back(begun_.SerializeAsString());
    return s;
  }
  grpc::Status finish(const v1::PairFinishRequest& request) {
    grpc::ClientContext context;
    said_.push_back(request.SerializeAsString());
    const grpc::Status s = stub_->Finish(&context, request, &finished_);
    said_.push_back(finished_.SerializeAsString());
    return s;
  }

  /// The first round trip, and what would be sent in the second.
  v1::PairFinishRequest process_peer_share(const std::string& code) {
    exchange_.emplace(std::move(*PairingExchange::begin(PairingSide::client, code)));
    v1::PairBeginRequest request;
    request.set_share(exchange_->share());
    EXPECT_TRUE(begin(request).ok());
    EXPECT_TRUE(exchange_->process_peer_share(begun_.share(), certificate_).ok());
    v1::PairApplication application;
    application.set_client_name("visitor");
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

  /// What a pairing brought.
  v1::PairCredentials credentials() const {
    v1::PairCredentials out;
    EXPECT_TRUE(reader_->confirms(finished_.confirmation()));
    const Result<std::string> opened = reader_->open(finished_.sealed());
    EXPECT_TRUE(opened.ok() && out.ParseFromString(*opened));
    return out;
  }
  const KeyPair& key() const { return key_; }
  const std::vector<std::string>& said() const { return said_; }

 private:
  const std::string certificate_;
  const KeyPair key_;
  std::unique_ptr<v1::PairingService::Stub> stub_;
  std::optional<PairingExchange> exchange_;
  std::optional<PairingChannel> reader_;  // what is left of it
  v1::PairBeginResponse begun_;
  v1::PairFinishResponse finished_;
  std::vector<std::string> said_;
};

std::string another(const std::string& code) {
  std::string out = code;
  out.back() = out.back() == '9' ? '0' : static_cast<char>(out.back() + 1);
  return out;
}

class PairingWindowTest : public GuardedProbeTest {
 protected:
  void SetUp() override { config_.keys = folder_.path("keys"); }
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
  [[nodiscard]] PairingOutcome now_it_is() const { return window_->wait(std::chrono::milliseconds(0)); }

  ProbeKeys keys_;
  std::unique_ptr<PairingWindow> window_;
};

TEST_F(PairingWindowTest, TheRightCodeMakesAClientThatTheProbeLetsInEitherWay) {
  open();
  Visitor visitor(*window_, keys_);
  ASSERT_TRUE(visitor.pair(window_->code()).ok());
  EXPECT_EQ(now_it_is(), PairingOutcome::paired);
  EXPECT_EQ(window_->client_name(), "visitor");
  const v1::PairCredentials brought = visitor.credentials();
  EXPECT_EQ(brought.probe_name(), "attic");
  EXPECT_EQ(brought.port(), 7420U);
  EXPECT_EQ(brought.probe_ca(), keys_.trust);
  EXPECT_NEAR(static_cast<double>(brought.expires_s()), static_cast<double>(now() + 365 * 86'400), 60);
  listen(LinkSecurity::tls);
  EXPECT_TRUE(call(channel(), kInfo, "", "Bearer " + brought.token()).status.ok());
  EXPECT_TRUE(call(channel(brought.client_certificate(), visitor.key().private_pem), kInfo, "").status.ok());
}

TEST_F(PairingWindowTest, ACodeIsGoodForOneClient) {
  open();
  ASSERT_TRUE(Visitor(*window_, keys_).pair(window_->code()).ok());
  Visitor second(*window_, keys_);
  v1::PairBeginRequest request;
  request.set_share(PairingExchange::begin(PairingSide::client, window_->code())->share());
  const grpc::Status s = second.begin(request);
  EXPECT_EQ(s.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(s.error_message(), HasSubstr("--pair"));
}

TEST_F(PairingWindowTest, ThreeWrongCodesCloseTheWindowEvenToTheRightOne) {
  open();
  Visitor late(*window_, keys_);
  const v1::PairFinishRequest right = late.process_peer_share(window_->code());
  for (int i = 1; i <= PairingWindow::kMaxWrongCodes; ++i) {
    EXPECT_EQ(now_it_is(), PairingOutcome::open);
    EXPECT_EQ(Visitor(*window_, keys_).pair(another(window_->code())).error_code(), grpc::StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(window_->wrong_codes(), i);
  }
  EXPECT_EQ(now_it_is(), PairingOutcome::too_many_wrong_codes);
  EXPECT_EQ(late.finish(right).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_FALSE(std::filesystem::exists(folder_.path("keys/clients"))) << "nobody was let in";
}

TEST_F(PairingWindowTest, AReplayedPairingIsAWrongCode) {
  open();
  Visitor first(*window_, keys_);
  const v1::PairFinishRequest recorded = first.process_peer_share(window_->code());
  v1::PairBeginRequest recorded_begin;
  ASSERT_TRUE(recorded_begin.ParseFromString(first.said().front()));
  // Another session in which the same share is sent again: the probe's own share is a new one.
  Visitor thief(*window_, keys_);
  ASSERT_TRUE(thief.begin(recorded_begin).ok());
  v1::PairBeginResponse begun;
  ASSERT_TRUE(begun.ParseFromString(thief.said().back()));
  v1::PairFinishRequest replayed = recorded;
  replayed.set_session(begun.session());
  EXPECT_EQ(thief.finish(replayed).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  // The recorded one itself counts once, and is nothing afterwards.
  ASSERT_TRUE(first.finish(recorded).ok());
  open();
  EXPECT_EQ(Visitor(*window_, keys_).finish(recorded).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(window_->wrong_codes(), 0) << "no guess at this window's code";
}

TEST_F(PairingWindowTest, SessionsThatNobodyBeganDoNotCloseTheWindow) {
  open();
  Visitor stranger(*window_, keys_), known(*window_, keys_);
  const v1::PairFinishRequest right = known.process_peer_share(window_->code());
  for (int i = 0; i < 3 * PairingWindow::kMaxWrongCodes; ++i) {
    v1::PairFinishRequest invented = right;
    invented.set_session(std::string(16, static_cast<char>('a' + i)));
    EXPECT_EQ(stranger.finish(invented).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  }
  EXPECT_EQ(now_it_is(), PairingOutcome::open);
  EXPECT_EQ(window_->wrong_codes(), 0);
  EXPECT_TRUE(known.finish(right).ok()) << "who has the code is still welcome";
}

TEST_F(PairingWindowTest, AnExchangeIsGoodForOneGuess) {
  open();
  Visitor visitor(*window_, keys_);
  const v1::PairFinishRequest right = visitor.process_peer_share(window_->code());
  v1::PairFinishRequest wrong = right;
  wrong.set_confirmation(std::string(32, 'x'));
  EXPECT_EQ(visitor.finish(wrong).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(visitor.finish(right).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(window_->wrong_codes(), 1) << "the second was no guess: its session was over";
}

TEST_F(PairingWindowTest, WhatIsNoShareNoConfirmationAndNoApplicationIsRefused) {
  open();
  Visitor visitor(*window_, keys_);
  for (const std::string& share :
       {std::string(), std::string(65, '\0'), std::string(65, '\x04'), std::string(3000, 'x')}) {
    v1::PairBeginRequest request;
    request.set_share(share);
    EXPECT_EQ(visitor.begin(request).error_code(), grpc::StatusCode::DATA_LOSS);
  }
  v1::PairFinishRequest changed = visitor.process_peer_share(window_->code());
  changed.set_sealed(std::string(40, 'x'));
  EXPECT_EQ(visitor.finish(changed).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  v1::PairBeginRequest huge;
  huge.set_share(std::string(100'000, 'x'));
  EXPECT_EQ(visitor.begin(huge).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(now_it_is(), PairingOutcome::open);
  EXPECT_TRUE(Visitor(*window_, keys_).pair(window_->code()).ok()) << "the one with the code is still welcome";
}

TEST_F(PairingWindowTest, BeginningWithoutEndIsBounded) {
  open();
  Visitor visitor(*window_, keys_);
  v1::PairBeginRequest request;
  request.set_share(PairingExchange::begin(PairingSide::client, "000000")->share());
  for (int i = 0; i < PairingWindow::kMaxExchanges; ++i) ASSERT_TRUE(visitor.begin(request).ok());
  EXPECT_EQ(visitor.begin(request).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

TEST_F(PairingWindowTest, NobodyComesAndItCloses) {
  open(std::chrono::seconds(1));
  EXPECT_EQ(window_->wait(std::chrono::seconds(10)), PairingOutcome::timed_out);
  v1::PairBeginRequest request;
  EXPECT_EQ(Visitor(*window_, keys_).begin(request).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
}

TEST_F(PairingWindowTest, NothingThatIsSaidInsideTheEncryptionTellsASecret) {
  open();
  Visitor visitor(*window_, keys_);
  ASSERT_TRUE(visitor.pair(window_->code()).ok());
  const v1::PairCredentials brought = visitor.credentials();
  ASSERT_EQ(visitor.said().size(), 4U);
  std::string all;
  for (const std::string& one : visitor.said()) all += one;
  for (const std::string& secret : {window_->code(), brought.token(), brought.client_certificate(), keys_.trust,
                                    visitor.key().private_pem, visitor.key().public_pem, keys_.key, keys_.issuer_key})
    for (const std::string& form :
         {secret, to_hex(secret), to_base64url(secret), sha256(secret), to_hex(sha256(secret))})
      EXPECT_THAT(all, Not(HasSubstr(form)));
  EXPECT_THAT(all, HasSubstr(visitor.said().front().substr(2, 65))) << "the search finds what is there";
}

TEST_F(PairingWindowTest, ANameThatWouldWriteALineOfItsOwnDoesNot) {
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
