// Slow, malformed and hostile clients of the web link do not affect others.
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/link/web_probe.hpp"
#include "support/child.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kHandshake =
    "GET /v1/descriptors HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
    "Sec-WebSocket-Protocol: lightwell.v1\r\n\r\n";

class WebHostileTest : public WebLinkTest {
 protected:
  void SetUp() override {
    start();
    reader_ = std::make_unique<RawWebClient>(*link_);
    ASSERT_EQ(reader_->upgrade().status, 101);
    ASSERT_TRUE(clients_become(1));
  }
  /// A client that was there before receives what is published.
  void expect_that_others_are_served(int count = 3, std::size_t bytes = 16) {
    for (int i = 0; i < count; ++i) {
      const EncodedDescriptor sent = message(number_++, bytes);
      link_->publish(sent);
      ASSERT_EQ(reader_->next(), text_of(sent)) << "waited for message " << number_ - 1;
    }
  }
  /// The close code after a client has sent `bytes`; 0 if the connection ended without a close frame.
  int close_code_after(const std::string& bytes) {
    RawWebClient client(*link_);
    EXPECT_EQ(client.upgrade().status, 101);
    client.send(bytes);
    const std::optional<WebFrame> close = client.close_frame();
    return close ? close->close_code() : 0;
  }

  std::unique_ptr<RawWebClient> reader_;
  int number_ = 0;
};

TEST_F(WebHostileTest, MessagesThatAreNoRequestsCloseTheConnection) {
  EXPECT_EQ(close_code_after(frame_bytes("hello", Opcode::text)), 1003);
  EXPECT_EQ(close_code_after(frame_bytes("not a message")), 1007);
  EXPECT_EQ(close_code_after(frame_bytes(std::string(4097, '\0'))), 1009);
  EXPECT_EQ(close_code_after(frame_bytes(std::string(70'000, '\0'))), 1009);
  EXPECT_EQ(link_->counters().messages_refused, 4U);
  ASSERT_NO_FATAL_FAILURE(expect_that_others_are_served());
}

TEST_F(WebHostileTest, AMessageInManyFragmentsIsRefused) {
  // Each is small; together they are too large.
  std::string large;
  for (int i = 0; i < 5; ++i)
    large += frame_bytes(std::string(1000, 'x'), i == 0 ? Opcode::binary : Opcode::continuation, Fin::no);
  EXPECT_EQ(close_code_after(large), 1009);
  std::string empty = frame_bytes("", Opcode::binary, Fin::no);
  for (int i = 0; i < 10'000; ++i) empty += frame_bytes("", Opcode::continuation, Fin::no);
  EXPECT_EQ(close_code_after(empty), 1008);
  ASSERT_NO_FATAL_FAILURE(expect_that_others_are_served());
}

TEST_F(WebHostileTest, BrokenFramesEndTheConnection) {
  const std::string request = frame_bytes(info_request(1));
  for (const std::string& bytes : {
           std::string("\x83\x80\x01\x02\x03\x04", 6),                                   // unknown opcode
           std::string("\x8b\x80\x01\x02\x03\x04", 6),                                   // unknown control opcode
           std::string("\x09\x80\x01\x02\x03\x04", 6),                                   // fragmented ping
           std::string("\x89\xfe\x01\x00\x01\x02\x03\x04", 8),                           // long ping
           std::string("\xf2\x80\x01\x02\x03\x04", 6),                                   // reserved bits
           std::string("\x80\x80\x01\x02\x03\x04", 6),                                   // continuation of nothing
           std::string("\x82\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01\x02\x03\x04", 14),  // 2^64 bytes
           frame_bytes("x", Opcode::binary, Fin::no) + request,                          // a message in a message
       }) {
    RawWebClient client(*link_);
    ASSERT_EQ(client.upgrade().status, 101);
    client.send(bytes);
    // A close frame with "protocol error", or an end without one.
    if (const std::optional<WebFrame> close = client.close_frame())
      EXPECT_EQ(close->close_code(), 1002) << ::testing::PrintToString(bytes);
    else
      EXPECT_TRUE(client.is_closed_by_peer()) << ::testing::PrintToString(bytes);
  }
  ASSERT_NO_FATAL_FAILURE(expect_that_others_are_served());
}

TEST_F(WebHostileTest, FramesThatAreCutAnywhereDoNotHarmOthers) {
  const std::string whole = std::string(kHandshake) + frame_bytes(info_request(1)) + frame_bytes(std::string(300, 'x'));
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    RawWebClient client(*link_);
    client.send(whole.substr(0, size));
  }
  ASSERT_NO_FATAL_FAILURE(expect_that_others_are_served());
  ASSERT_TRUE(clients_become(1));
}

TEST_F(WebHostileTest, NoiseInsteadOfHttpEndsTheConnection) {
  for (const std::string& bytes :
       {std::string(100'000, '\xff'),
        std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11) + std::string(500, 'z'),
        std::string("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"), std::string("CONNECT example.com:80 HTTP/1.1\r\n\r\n"),
        "GET /" + std::string(10'000, 'a') + " HTTP/1.1\r\n\r\n",
        "GET / HTTP/1.1\r\nHost: x\r\nCookie: " + std::string(100'000, 'c') + "\r\n\r\n",
        std::string(
            "GET / HTTP/1.1\r\nHost: x\r\nUpgrade: h2c\r\nConnection: Upgrade, HTTP2-Settings\r\nHTTP2-Settings: "
            "AAMAAABkAAQAAP__\r\n\r\n"),
        std::string("GET / HTTP/1.1\r\nHost: x\r\nUpgrade: nonsense\r\nConnection: Upgrade\r\n\r\n"),
        std::string("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 100000000\r\n\r\n")}) {
    RawWebClient client(*link_);
    client.send(bytes);
    EXPECT_TRUE(client.is_closed_by_peer()) << bytes.substr(0, 40);
  }
  ASSERT_NO_FATAL_FAILURE(expect_that_others_are_served());
}

TEST_F(WebHostileTest, PipelinedRequestsGetOneResponse) {
  RawWebClient client(*link_);
  std::string requests;
  for (int i = 0; i < 50; ++i) requests += "GET /healthz HTTP/1.1\r\nHost: x\r\nUpgrade: nonsense\r\n\r\n";
  client.send("GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n" + requests);
  std::string all;
  while (true) {
    const std::string more = client.receive();
    if (more.empty()) break;
    all += more;
  }
  EXPECT_EQ(occurrences(all, "HTTP/1.1 200"), 1U) << all;
  ASSERT_NO_FATAL_FAILURE(expect_that_others_are_served());
}

TEST_F(WebHostileTest, SlowHeadersTimeOut) {
  const auto start = std::chrono::steady_clock::now();
  RawWebClient silent(*link_), slow(*link_);
  bool closed = false;
  for (int i = 0; i < 200 && !closed; ++i) {
    slow.send(i == 0 ? "GET / HTTP/1.1\r\n" : "X-" + std::to_string(i) + ": y\r\n");
    closed = slow.is_closed_by_peer(std::chrono::milliseconds(100));
  }
  EXPECT_TRUE(closed) << "headers that arrive one by one";
  EXPECT_TRUE(silent.is_closed_by_peer()) << "no header at all";
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(30));
  ASSERT_NO_FATAL_FAILURE(expect_that_others_are_served());
}

TEST_F(WebHostileTest, TheNumberOfUnfinishedConnectionsIsLimited) {
  std::vector<std::unique_ptr<RawWebClient>> silent;
  for (int i = 0; i < 40; ++i) silent.push_back(std::make_unique<RawWebClient>(*link_));
  EXPECT_TRUE(silent.back()->is_closed_by_peer(std::chrono::seconds(2))) << "the fortieth; 32 are allowed";
  EXPECT_GE(link_->counters().messages_refused, 8U);
  ASSERT_NO_FATAL_FAILURE(expect_that_others_are_served());
}

TEST_F(WebHostileTest, ManyRequestsCloseTheConnection) {
  RawWebClient client(*link_);
  ASSERT_EQ(client.upgrade().status, 101);
  std::string flood;
  for (std::uint32_t id = 1; id <= 500; ++id) flood += frame_bytes(info_request(id));
  client.send(flood);
  int answered = 0;
  std::optional<WebFrame> frame;
  while ((frame = client.next_frame()) && frame->opcode != Opcode::close) ++answered;
  ASSERT_TRUE(frame) << "no close frame";
  EXPECT_EQ(frame->close_code(), 1008);
  EXPECT_THAT(frame->payload.substr(2), HasSubstr("requests"));
  EXPECT_LE(answered, 60);
  ASSERT_NO_FATAL_FAILURE(expect_that_others_are_served());
}

TEST_F(WebHostileTest, AClientThatReadsNoResponsesIsNotReadEither) {
  RawWebClient client(*link_);
  ASSERT_EQ(client.upgrade().status, 101);
  // Each answered request of these is allowed by the rate; their responses are not read.
  for (std::uint32_t id = 1; id <= 40; ++id) client.send_frame(info_request(id));
  for (std::uint32_t id = 1; id <= 40; ++id) {
    const Result<LinkResponse> response = response_in(client.next());
    ASSERT_TRUE(response.ok()) << "response " << id;
    EXPECT_EQ(response->id, id) << "responses come in the order of the requests";
  }
}

TEST_F(WebHostileTest, OfAHundredClientsTwentyNeverRead) {
  constexpr std::size_t kClients = 100, kSilent = 20;
  std::vector<std::unique_ptr<RawWebClient>> crowd;
  for (std::size_t i = 0; i + 1 < kClients; ++i) {
    crowd.push_back(std::make_unique<RawWebClient>(*link_));
    if (i < kSilent) crowd.back()->shrink_receive_buffer();
    ASSERT_EQ(crowd.back()->upgrade().status, 101) << i;
  }
  ASSERT_TRUE(clients_become(kClients));
  // Large messages fill the buffers of those that do not read; the others receive each.
  constexpr std::size_t kLarge = 60'000;
  int rounds = 0;
  for (; rounds < 300 && link_->counters().coalesced < 20 * kSilent; ++rounds) {
    const EncodedDescriptor sent = message(number_++, kLarge);
    link_->publish(sent);
    ASSERT_EQ(reader_->next(), text_of(sent));
    for (std::size_t i = kSilent; i < crowd.size(); ++i) ASSERT_EQ(crowd[i]->next(), text_of(sent)) << "client " << i;
  }
  EXPECT_GE(link_->counters().coalesced, 20 * kSilent) << "messages were buffered without being read";
  EXPECT_LE(rounds, 30) << "the probe and its kernel hold a few messages for each, not minutes of them";
  ASSERT_NO_FATAL_FAILURE(expect_that_others_are_served(20));
}

TEST_F(WebHostileTest, MoreConnectionsThanAllowedAreRefused) {
  std::vector<std::unique_ptr<RawWebClient>> crowd;
  for (int i = 0; i < 127; ++i) {
    crowd.push_back(std::make_unique<RawWebClient>(*link_));
    ASSERT_EQ(crowd.back()->upgrade().status, 101) << i;
  }
  EXPECT_EQ(RawWebClient(*link_).upgrade().status, 0) << "the hundred and twenty-ninth";
  ASSERT_NO_FATAL_FAILURE(expect_that_others_are_served());
  crowd.pop_back();
  ASSERT_TRUE(clients_become(127));
  EXPECT_EQ(RawWebClient(*link_).upgrade().status, 101) << "there is room again";
}

TEST_F(WebHostileTest, ASlowClientThatDisconnectsIsRemoved) {
  {
    RawWebClient slow(*link_);
    ASSERT_EQ(slow.upgrade().status, 101);
    ASSERT_TRUE(clients_become(2));
    for (int i = 0; i < 300 && link_->counters().coalesced < 10; ++i)
      ASSERT_NO_FATAL_FAILURE(expect_that_others_are_served(1, 60'000));
  }
  ASSERT_TRUE(clients_become(1));
  ASSERT_NO_FATAL_FAILURE(expect_that_others_are_served());
}

TEST_F(WebHostileTest, TheLinkHasOneThread) {
  const auto threads = [] { return proc_status_number(::getpid(), "Threads"); };
  const long with_one_client = threads();
  std::vector<std::unique_ptr<RawWebClient>> crowd;
  for (int i = 0; i < 60; ++i) {
    crowd.push_back(std::make_unique<RawWebClient>(*link_));
    ASSERT_EQ(crowd.back()->upgrade().status, 101);
  }
  EXPECT_EQ(threads(), with_one_client);
}

}  // namespace
}  // namespace lightwell::test
