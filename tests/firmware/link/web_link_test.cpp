// The web link in plain text: streams, requests, pages.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/link/web_probe.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST_F(WebLinkTest, AClientReceivesTheBytesOfThePublisher) {
  RawWebClient client(*link_);
  const HttpReply accepted = client.upgrade();
  ASSERT_EQ(accepted.status, 101) << accepted.body;
  EXPECT_THAT(accepted.head, HasSubstr("Sec-WebSocket-Protocol: lightwell.v1"));
  ASSERT_TRUE(clients_become(1));
  for (const std::size_t bytes : {1U, 125U, 126U, 4096U, 65'535U, 65'536U}) {
    link_->publish(message(7, bytes));
    EXPECT_EQ(client.next(), text_of(message(7, bytes))) << bytes << " bytes";
  }
  EXPECT_THAT(link_->address(), StartsWith("ws://127.0.0.1:"));
}

TEST_F(WebLinkTest, ANewClientReceivesTheNewestDescriptorAtOnce) {
  link_->publish(message(1));
  RawWebClient first(*link_);
  ASSERT_EQ(first.upgrade().status, 101);
  EXPECT_EQ(first.next(), text_of(message(1)));
  link_->publish(message(2));
  EXPECT_EQ(first.next(), text_of(message(2)));
  RawWebClient second(*link_);
  ASSERT_EQ(second.upgrade().status, 101);
  EXPECT_EQ(second.next(), text_of(message(2)));
}

TEST_F(WebLinkTest, ARequestIsAnsweredOnTheSameSocket) {
  RawWebClient client(*link_);
  ASSERT_EQ(client.upgrade().status, 101);
  client.send_frame(info_request(0x01020304));
  const std::optional<std::string> bytes = client.next();
  ASSERT_TRUE(bytes);
  EXPECT_EQ(bytes->substr(0, 5), std::string("\x0d\x04\x03\x02\x01")) << "the first byte of a response";
  const Result<LinkResponse> info = response_in(bytes);
  ASSERT_TRUE(info.ok() && info->info);
  EXPECT_EQ(info->info->status.probe_name, "attic");
  EstimatorUpdate update;
  update.panorama.epsilon = 0.05;
  std::vector<std::byte> set;
  encode_link_request(9, update, set);
  // In three fragments, with a ping between them.
  const std::string text = as_text(set);
  client.send_frame(text.substr(0, 3), Opcode::binary, Fin::no);
  client.send_frame("are you there?", Opcode::ping);
  client.send_frame(text.substr(3, 2), Opcode::continuation, Fin::no);
  client.send_frame(text.substr(5), Opcode::continuation, Fin::yes);
  const std::optional<WebFrame> pong = client.next_frame();
  ASSERT_TRUE(pong);
  EXPECT_EQ(pong->opcode, Opcode::pong);
  EXPECT_EQ(pong->payload, "are you there?");
  const Result<LinkResponse> changed = response_in(client.next());
  ASSERT_TRUE(changed.ok()) << changed.status().message();
  EXPECT_EQ(changed->id, 9U);
  EXPECT_TRUE(changed->status.ok());
  EXPECT_EQ(commands_.estimator().panorama.epsilon, 0.05);
}

TEST_F(WebLinkTest, AnInvalidRequestIsAnsweredWithItsReason) {
  RawWebClient client(*link_);
  ASSERT_EQ(client.upgrade().status, 101);
  EstimatorUpdate update;
  update.panorama.epsilon = -1;
  std::vector<std::byte> set;
  encode_link_request(5, update, set);
  client.send_frame(as_text(set));
  const Result<LinkResponse> refused = response_in(client.next());
  ASSERT_TRUE(refused.ok());
  EXPECT_EQ(refused->status.code(), StatusCode::invalid_argument);
  EXPECT_THAT(refused->status.message(), HasSubstr("epsilon"));
}

TEST_F(WebLinkTest, InPlainTextAuthenticateIsAnsweredWithOk) {
  RawWebClient client(*link_);
  ASSERT_EQ(client.upgrade().status, 101);
  client.send_frame(authenticate_request("whatever"));
  const Result<LinkResponse> response = response_in(client.next());
  ASSERT_TRUE(response.ok());
  EXPECT_TRUE(response->status.ok());
  EXPECT_EQ(response->id, 1U);
}

TEST_F(WebLinkTest, APlaneClientReceivesTheWholePlaneAndThenChanges) {
  link_->publish_plane(plane_update(1, 1, 3));
  RawWebClient client(*link_);
  ASSERT_EQ(client.upgrade("/v1/planes").status, 101);
  for (const char* name : {"whole1.0", "whole1.1", "whole1.2"}) EXPECT_EQ(plane_message_name(client.next()), name);
  link_->publish(message(1));
  link_->publish_plane(plane_update(2, 2, 3));
  for (const char* name : {"change2.0", "change2.1"}) EXPECT_EQ(plane_message_name(client.next()), name);
}

TEST_F(WebLinkTest, ASlowPlaneClientReceivesTheNewestWhole) {
  link_->publish_plane(plane_update(0, 1, 1));
  RawWebClient client(*link_);
  ASSERT_EQ(client.upgrade("/v1/planes").status, 101);
  ASSERT_EQ(plane_message_name(client.next()), "whole0.0");
  EXPECT_EQ(link_->counters().clients, 0U) << "it is no client of descriptors";
  // 30 MB: more than the kernel holds for a client that does not read.
  for (int number = 1; number <= 500; ++number) link_->publish_plane(plane_update(number, 1, 1, 60'000));
  int last = 0, gaps = 0;
  while (last < 500) {
    const std::string got = plane_message_name(client.next());
    ASSERT_TRUE(got.starts_with("change") || got.starts_with("whole")) << got << " after " << last;
    const bool whole = got.starts_with("whole");
    const int number = std::stoi(got.substr(whole ? 5 : 6));
    ASSERT_GT(number, last);
    if (!whole) {
      ASSERT_EQ(number, last + 1) << "changes after a gap are of no use";
    }
    gaps += whole ? 1 : 0;
    last = number;
  }
  EXPECT_GE(gaps, 1) << "30 MB were buffered without being read";
}

TEST_F(WebLinkTest, StopClosesWithGoingAway) {
  RawWebClient client(*link_);
  ASSERT_EQ(client.upgrade().status, 101);
  ASSERT_TRUE(clients_become(1));
  link_->stop();
  const std::optional<WebFrame> close = client.close_frame();
  ASSERT_TRUE(close);
  EXPECT_EQ(close->close_code(), 1001);
  EXPECT_EQ(link_->counters().clients, 0U);
}

TEST_F(WebLinkTest, APortInUseIsAnErrorThatNamesIt) {
  WebConfig config;
  config.listen_address = "127.0.0.1:" + std::to_string(port_of(*link_));
  const Status refused = make_web_link(config, {}, "attic", commands_, {})->start();
  EXPECT_EQ(refused.code(), StatusCode::resource_exhausted);
  EXPECT_THAT(refused.message(), AllOf(HasSubstr(config.listen_address), HasSubstr("--web")));
  for (const char* address : {"127.0.0.1", "127.0.0.1:x", ":7443", "no.such.host.invalid:0", "192.0.2.1:0"}) {
    config.listen_address = address;
    config.security = LinkSecurity::plain;
    EXPECT_EQ(make_web_link(config, {}, "attic", commands_, {})->start().code(), StatusCode::resource_exhausted)
        << address;
  }
}

TEST_F(WebLinkTest, ListensOnIpv6AndOnAllAddresses) {
  for (const char* address : {"[::1]:0", "[::]:0", "0.0.0.0:0", "localhost:0"}) {
    WebConfig config;
    config.listen_address = address;
    config.security = LinkSecurity::plain;
    const std::unique_ptr<Link> link = make_web_link(config, {}, "attic", commands_, {});
    const Status started = link->start();
    ASSERT_TRUE(started.ok()) << address << ": " << started.message();
    EXPECT_GT(port_of(*link), 0) << address;
    if (std::string_view(address) == "[::1]:0" || std::string_view(address) == "localhost:0") continue;
    EXPECT_EQ(RawWebClient(*link).request("GET /healthz HTTP/1.1").status, 200) << address;
  }
}

TEST_F(WebLinkTest, PlainTextOnANetworkNeedsAnExplicitChoice) {
  WebConfig config;
  config.listen_address = "0.0.0.0:0";
  const Status refused = make_web_link(config, {}, "attic", commands_, {})->start();
  EXPECT_EQ(refused.code(), StatusCode::failed_precondition);
  EXPECT_THAT(refused.message(), AllOf(HasSubstr("web.security"), HasSubstr("--web-security")));
}

TEST_F(WebLinkTest, HealthSaysThatThisIsALightwell) {
  const HttpReply reply = RawWebClient(*link_).request("GET /healthz HTTP/1.1");
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.body, "{\"lightwell\":\"v1\",\"status\":\"ok\"}\n");
  EXPECT_THAT(reply.head, AllOf(HasSubstr("application/json"), HasSubstr("no-store"), HasSubstr("connection: close")));
  EXPECT_EQ(RawWebClient(*link_).request("HEAD /healthz HTTP/1.1").body, "");
}

TEST_F(WebLinkTest, MetricsAreThoseOfTheStatus) {
  const HttpReply reply = RawWebClient(*link_).request("GET /metrics HTTP/1.1");
  EXPECT_EQ(reply.status, 200);
  EXPECT_THAT(reply.head, HasSubstr("text/plain; version=0.0.4"));
  for (const char* line : {"lightwell_info{name=\"attic\",version=\"0.1.0\",camera=\"fake camera\"} 1\n",
                           "\nlightwell_frames_total 5\n",
                           "\nlightwell_captures_dropped_total 102\n",
                           "\nlightwell_brackets_incomplete_total 103\n",
                           "\nlightwell_estimates_total 104\n",
                           "\nlightwell_estimates_failed_total 105\n",
                           "\nlightwell_descriptors_coalesced_total 106\n",
                           "\nlightwell_clients 107\n",
                           "\nlightwell_frames_recorded_total 108\n",
                           "\nlightwell_recording_faults_total 3\n",
                           "\nlightwell_frames_lost_total 110\n",
                           "\nlightwell_setting_moves_total 111\n",
                           "\nlightwell_estimates_late_total 112\n",
                           "\nlightwell_estimates_late_at_fast_total 113\n",
                           "\nlightwell_messages_refused_total 114\n",
                           "\nlightwell_authentication_failures_total 115\n",
                           "\nlightwell_client_list_faults_total 116\n",
                           "# TYPE lightwell_clients gauge\n",
                           "# TYPE lightwell_frames_total counter\n",
                           "\nlightwell_temperature_celsius 47.5",
                           "\nlightwell_recording 1\n",
                           "\nlightwell_recording_ends_total 120\n"})
    EXPECT_THAT(reply.body, HasSubstr(line));
}

TEST_F(WebLinkTest, ServesTheFilesOfTheDashboard) {
  const HttpReply page = RawWebClient(*link_).request("GET / HTTP/1.1");
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.body, "<!doctype html><title>probe</title>");
  EXPECT_THAT(page.head, AllOf(HasSubstr("content-type: text/html"), HasSubstr("nosniff"),
                               HasSubstr("content-security-policy: default-src 'none'; script-src 'self'"),
                               HasSubstr("frame-ancestors 'none'"), HasSubstr("content-length: 35\r\n")));
  EXPECT_EQ(RawWebClient(*link_).request("GET /index.html HTTP/1.1").body, page.body);
  const HttpReply large = RawWebClient(*link_).request("GET /parts/large.js HTTP/1.1");
  EXPECT_EQ(large.body, std::string(300'000, 'x'));
  EXPECT_THAT(large.head, HasSubstr("content-type: text/javascript"));
  const HttpReply head = RawWebClient(*link_).request("HEAD /parts/large.js HTTP/1.1");
  EXPECT_THAT(head.head, HasSubstr("content-length: 300000"));
  EXPECT_EQ(head.body, "");
}

TEST_F(WebLinkTest, AFileThatTheBrowserHasIsNotSentAgain) {
  const HttpReply page = RawWebClient(*link_).request("GET / HTTP/1.1");
  const std::size_t at = page.head.find("etag: ") + 6;
  const std::string etag = page.head.substr(at, page.head.find('\r', at) - at);
  ASSERT_EQ(etag.size(), 18U) << page.head;
  const HttpReply again = RawWebClient(*link_).request("GET / HTTP/1.1\r\nIf-None-Match: " + etag);
  EXPECT_EQ(again.status, 304);
  EXPECT_EQ(again.body, "");
  EXPECT_EQ(RawWebClient(*link_).request("GET / HTTP/1.1\r\nIf-None-Match: \"0\"").status, 200);
}

TEST_F(WebLinkTest, OtherPathsAreNotFound) {
  for (const char* path : {"/secret.key", "/nothing", "/index.html/", "/?x=1", "/healthz?x", "/metrics/",
                           "/v1/descriptors", "/..%2f..%2fetc%2fpasswd", "/../../etc/passwd", "/parts"})
    EXPECT_EQ(RawWebClient(*link_).request("GET " + std::string(path) + " HTTP/1.1").status, 404) << path;
  EXPECT_EQ(link_->counters().messages_refused, 0U) << "a missing icon is no attack";
}

TEST_F(WebLinkTest, WithoutTheDashboardItsFilesAreMissing) {
  start({.dashboard = Dashboard::off});
  EXPECT_EQ(RawWebClient(*link_).request("GET / HTTP/1.1").status, 404);
  EXPECT_EQ(RawWebClient(*link_).request("GET /healthz HTTP/1.1").status, 200);
  RawWebClient client(*link_);
  EXPECT_EQ(client.upgrade().status, 101);
}

TEST_F(WebLinkTest, OnlyGetAndHeadAreSupported) {
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "PATCH"}) {
    const HttpReply reply = RawWebClient(*link_).request(std::string(method) + " / HTTP/1.1\r\nContent-Length: 0");
    EXPECT_EQ(reply.status, 405) << method;
    EXPECT_THAT(reply.head, HasSubstr("allow: GET, HEAD")) << method;
  }
  EXPECT_EQ(link_->counters().messages_refused, 5U);
}

TEST_F(WebLinkTest, AnUpgradeNeedsPathAndSubprotocol) {
  EXPECT_EQ(RawWebClient(*link_).upgrade("/").status, 404);
  EXPECT_EQ(RawWebClient(*link_).upgrade("/v1/descriptors?token=x").status, 404);
  for (const char* protocol : {"", "http", "lightwell.v2"}) {
    const HttpReply reply = RawWebClient(*link_).upgrade("/v1/descriptors", {}, protocol);
    EXPECT_EQ(reply.status, 400) << protocol;
    EXPECT_THAT(reply.body, HasSubstr("lightwell.v1"));
  }
  // The name of the other protocol of the server, before the right one.
  EXPECT_NE(RawWebClient(*link_).upgrade("/v1/descriptors", {}, "http, lightwell.v1").status, 101);
  EXPECT_EQ(link_->counters().clients, 0U);
}

TEST_F(WebLinkTest, PagesOfOtherOriginsAreRefused) {
  const std::string own = "127.0.0.1:" + std::to_string(port_of(*link_));
  EXPECT_EQ(RawWebClient(*link_).upgrade("/v1/descriptors", "Origin: http://" + own + "\r\n").status, 101);
  for (const char* origin : {"http://evil.example", "null", "http://127.0.0.1", "http://127.0.0.1:1", "file://"}) {
    EXPECT_EQ(RawWebClient(*link_).upgrade("/v1/descriptors", "Origin: " + std::string(origin) + "\r\n").status, 403)
        << origin;
    EXPECT_EQ(RawWebClient(*link_).request("GET /metrics HTTP/1.1\r\nOrigin: " + std::string(origin)).status, 403);
  }
  start({.allowed_origins = {"https://viewer.example"}});
  EXPECT_EQ(RawWebClient(*link_).upgrade("/v1/descriptors", "Origin: https://Viewer.example\r\n").status, 101);
  EXPECT_EQ(RawWebClient(*link_).upgrade("/v1/descriptors", "Origin: http://viewer.example\r\n").status, 403);
}

/// DNS rebinding: the page and the probe have the same name, which a stranger's DNS server gives.
TEST_F(WebLinkTest, InPlainTextANameOfAStrangersDnsIsRefused) {
  const auto status = [&](const std::string& host) {
    RawWebClient client(*link_);
    client.send("GET /metrics HTTP/1.1\r\nHost: " + host + "\r\n\r\n");
    const std::string answer = client.receive();
    return answer.substr(0, 12);
  };
  EXPECT_EQ(status("evil.example:7443"), "HTTP/1.1 403");
  EXPECT_EQ(status("127.0.0.1.evil.example"), "HTTP/1.1 403");
  EXPECT_EQ(status(""), "HTTP/1.1 403");
  EXPECT_EQ(status("probe.local:7443"), "HTTP/1.1 200");
  EXPECT_EQ(status("localhost"), "HTTP/1.1 200");
}

}  // namespace
}  // namespace lightwell::test
