// What a WebSocket's session does without a network, and the decisions on requests.
#include "link/web/web_session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/link/web_probe.hpp"
#include "link/web/request_policy.hpp"

namespace lightwell::test {
namespace {

std::span<const std::byte> bytes_in(const std::string& text) { return std::as_bytes(std::span(text)); }

class WebSessionTest : public ::testing::Test {
 protected:
  [[nodiscard]] WebSession session(WebStream stream, WebAdmission admission = WebAdmission::accepted) {
    return {stream, admission, {commands_, [](const std::string& token) { return token == "right"; }}};
  }
  FakeCommands commands_;
};

TEST_F(WebSessionTest, ANewerDescriptorReplacesTheWaitingOne) {
  WebSession s = session(WebStream::descriptors);
  EXPECT_FALSE(s.offer(message(1)));
  EXPECT_TRUE(s.offer(message(2)));
  EXPECT_EQ(as_text(s.next()), text_of(message(2)));
  EXPECT_FALSE(s.has_next());
  EXPECT_TRUE(s.next().empty());
}

TEST_F(WebSessionTest, AResponseComesBeforeAWaitingDescriptor) {
  WebSession s = session(WebStream::descriptors);
  s.offer(message(1));
  const std::string request = info_request(3);
  EXPECT_EQ(s.receive({bytes_in(request)}, 1), std::nullopt);
  EXPECT_EQ(as_text(s.next()).front(), '\x0d');
  EXPECT_EQ(as_text(s.next()), text_of(message(1)));
}

TEST_F(WebSessionTest, UpdatesOfAPlaneAreSentWholeAfterAGap) {
  WebSession s = session(WebStream::planes);
  s.offer(plane_update(1, 1, 2));
  EXPECT_EQ(plane_message_name(std::optional(as_text(s.next()))), "whole1.0");
  // Both arrive while the first is sent: the second of them replaces the first.
  s.offer(plane_update(2, 1, 1));
  s.offer(plane_update(3, 1, 1));
  EXPECT_EQ(plane_message_name(std::optional(as_text(s.next()))), "whole1.1");
  EXPECT_EQ(plane_message_name(std::optional(as_text(s.next()))), "whole3.0");
  s.offer(plane_update(4, 1, 1));
  EXPECT_EQ(plane_message_name(std::optional(as_text(s.next()))), "change4.0");
  EXPECT_FALSE(s.has_next());
}

TEST_F(WebSessionTest, InputStopsWhileResponsesWait) {
  WebSession s = session(WebStream::descriptors);
  const std::string request = info_request(3);
  int taken = 0;
  for (; s.wants_input() && taken < 100; ++taken) ASSERT_EQ(s.receive({bytes_in(request)}, 1), std::nullopt);
  EXPECT_EQ(taken, 4);
  (void)s.next();
  EXPECT_TRUE(s.wants_input());
}

TEST_F(WebSessionTest, TheRateOfRequestsIsLimited) {
  WebSession s = session(WebStream::descriptors);
  const std::string request = info_request(3);
  const auto ask = [&](std::int64_t now_ns) {
    const auto close = s.receive({bytes_in(request)}, now_ns);
    (void)s.next();
    return close ? close->code : 0;
  };
  for (int i = 0; i < 50; ++i) ASSERT_EQ(ask(1'000'000'000), 0) << i;
  EXPECT_EQ(ask(1'000'000'000), 1008);
  EXPECT_EQ(ask(1'020'000'000), 0) << "one more after a fiftieth of a second";
  EXPECT_EQ(ask(1'020'000'000), 1008);
  EXPECT_EQ(s.refused(), 2U);
}

TEST_F(WebSessionTest, OnlyAuthenticateOpensAPendingSession) {
  WebSession s = session(WebStream::descriptors, WebAdmission::pending);
  EXPECT_FALSE(s.accepted());
  const std::string right = authenticate_request("right");
  // In two fragments.
  EXPECT_EQ(s.receive({bytes_in(right).first(4), false, false}, 1), std::nullopt);
  EXPECT_EQ(s.receive({bytes_in(right).subspan(4)}, 1), std::nullopt);
  EXPECT_TRUE(s.accepted());
  EXPECT_TRUE(decode_link_response(s.next())->status.ok());
  WebSession other = session(WebStream::descriptors, WebAdmission::pending);
  const std::string wrong = authenticate_request("left");
  const auto close = other.receive({bytes_in(wrong)}, 1);
  ASSERT_TRUE(close);
  EXPECT_EQ(close->code, 1008);
  EXPECT_LE(close->reason.size(), 123U) << "the limit of a close frame";
  EXPECT_FALSE(other.accepted());
  EXPECT_FALSE(other.has_next());
}

TEST(RequestPolicy, AnOriginIsThatOfTheHostOrAllowed) {
  const std::vector<std::string> allowed = {"https://viewer.example:8443"};
  EXPECT_TRUE(is_origin_allowed("", "probe.local:7443", allowed));
  EXPECT_TRUE(is_origin_allowed("https://probe.local:7443", "Probe.local:7443", allowed));
  EXPECT_TRUE(is_origin_allowed("https://viewer.example:8443", "probe.local:7443", allowed));
  for (const char* origin : {"https://probe.local", "https://probe.local:74430", "https://viewer.example", "null",
                             "https://", "probe.local:7443", "https://probe.local:7443.evil.example"})
    EXPECT_FALSE(is_origin_allowed(origin, "probe.local:7443", allowed)) << origin;
  EXPECT_FALSE(is_origin_allowed("https://", "", allowed)) << "both are empty";
}

TEST(RequestPolicy, ATrustedHostIsNoNameOfPublicDns) {
  const std::vector<std::string> allowed = {"http://probe.example:7443"};
  for (const char* host : {"127.0.0.1:7443", "[::1]:7443", "[fe80::1]", "localhost:1", "probe", "attic.local",
                           "x.localhost:5", "probe.example:7443"})
    EXPECT_TRUE(is_host_trusted(host, allowed)) << host;
  for (const char* host :
       {"", ":7443", "evil.example", "local.evil.example:7443", "127.0.0.1.evil.example", "probe.example", "[]:1",
        "[evil.example]", "1.2.3.4.nip.io", "[::1].evil.example", "probe:1.evil.example", "[::1"})
    EXPECT_FALSE(is_host_trusted(host, allowed)) << host;
}

TEST(RequestPolicy, FailuresOfOneAddressDoNotLimitAnother) {
  AuthenticationLimit limit;
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(limit.allows("192.0.2.1", 5)) << i;
    limit.count_failure("192.0.2.1", 5);
  }
  EXPECT_FALSE(limit.allows("192.0.2.1", 5));
  EXPECT_TRUE(limit.allows("192.0.2.2", 5));
  EXPECT_TRUE(limit.allows("192.0.2.1", 1'000'000'005)) << "a second later";
}

}  // namespace
}  // namespace lightwell::test
