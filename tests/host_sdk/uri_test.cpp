#include "core/uri.hpp"

#include <string>

#include <gtest/gtest.h>

#include <lightwell/probe.hpp>

#include "core/discovery_backends.hpp"

namespace lightwell::core {
namespace {

std::string address(std::string_view uri) {
  const Result<ProbeUri> parsed = parse_probe_uri(uri);
  if (!parsed.ok()) return "refused: " + parsed.status().message();
  return std::get<GrpcAddress>(*parsed).host_port;
}

TEST(ProbeUri, ParsesHostAndPort) {
  EXPECT_EQ(address("grpc://10.0.0.7:7000"), "10.0.0.7:7000");
  EXPECT_EQ(address("grpc://probe.local"), "probe.local:7420");
  EXPECT_EQ(address("grpc://probe.local/"), "probe.local:7420");
  EXPECT_EQ(address("grpc://[::1]:7000"), "[::1]:7000");
  EXPECT_EQ(address("grpc://[fe80::2]"), "[fe80::2]:7420");
}

TEST(ProbeUri, NameInLocalIsMulticastDns) {
  for (const char* name : {"attic.local:7420", "ATTIC.LOCAL:1", "attic.local.:7420", "east.attic.local:7420"})
    EXPECT_TRUE(is_mdns_name(name)) << name;
  for (const char* other :
       {"local:7420", ".local:7420", "attic.localhost:7420", "attic.local.example:7420", "10.0.0.7:7420", "[::1]:7420"})
    EXPECT_FALSE(is_mdns_name(other)) << other;
}

TEST(ProbeUri, ParsesTls) {
  EXPECT_EQ(std::get<GrpcAddress>(*parse_probe_uri("grpc://attic")).transport, Transport::plain);
  EXPECT_EQ(std::get<GrpcAddress>(*parse_probe_uri("grpcs://attic")).transport, Transport::tls);
  EXPECT_EQ(address("grpcs://attic"), "attic:7420");
  EXPECT_EQ(address("grpcs://[::1]:7000/"), "[::1]:7000");
}

TEST(ProbeUri, ParsesTheWebLink) {
  const auto web = [](std::string_view uri) { return std::get<WebAddress>(*parse_probe_uri(uri)); };
  EXPECT_EQ(web("ws://attic:80").host_port, "attic:80");
  EXPECT_EQ(web("ws://attic").transport, Transport::plain);
  EXPECT_EQ(web("wss://attic/").host_port, "attic:7443");
  EXPECT_EQ(web("wss://[::1]").host_port, "[::1]:7443");
  EXPECT_EQ(web("wss://attic").transport, Transport::tls);
  for (const char* bad : {"ws://", "wss://attic/v1/descriptors", "wss://a:b:c", "ws://x:0"})
    EXPECT_EQ(parse_probe_uri(bad).status().code(), StatusCode::invalid_argument) << bad;
}

TEST(ProbeUri, PairingNeedsTlsAndHasItsOwnPort) {
  EXPECT_EQ(parse_pairing_uri("grpcs://attic")->host_port, "attic:7421");
  EXPECT_EQ(parse_pairing_uri("grpcs://[fe80::2]:9")->host_port, "[fe80::2]:9");
  for (const char* bad : {"grpc://attic", "attic", "grpcs://", "grpcs://x:0", "replay:x", "grpcs://x/y"}) {
    const Result<GrpcAddress> parsed = parse_pairing_uri(bad);
    ASSERT_FALSE(parsed.ok()) << bad;
    EXPECT_EQ(parsed.status().code(), StatusCode::invalid_argument) << bad;
  }
}

TEST(ProbeUri, ParsesARecording) {
  const Result<ProbeUri> plain = parse_probe_uri("replay:/tmp/a b?.lwr");
  ASSERT_TRUE(plain.ok());
  EXPECT_EQ(std::get<ReplayPath>(*plain).path, "/tmp/a b?.lwr");
  EXPECT_EQ(std::get<ReplayPath>(*plain).speed, 1);
  const Result<ProbeUri> quick = parse_probe_uri("replay:x?speed=2.5");
  ASSERT_TRUE(quick.ok());
  EXPECT_EQ(std::get<ReplayPath>(*quick).path, "x");
  EXPECT_EQ(std::get<ReplayPath>(*quick).speed, 2.5);
}

TEST(ProbeUri, ParsesAUsbProbe) {
  const Result<ProbeUri> only = parse_probe_uri("usb:");
  ASSERT_TRUE(only.ok());
  EXPECT_EQ(std::get<UsbAddress>(*only).serial, "");
  const Result<ProbeUri> one = parse_probe_uri("usb:LW-00-7f:3");
  ASSERT_TRUE(one.ok());
  EXPECT_EQ(std::get<UsbAddress>(*one).serial, "LW-00-7f:3");
}

TEST(ProbeUri, ErrorsSayWhatIsAllowed) {
  for (const char* bad : {"",
                          "probe.local",
                          "http://x",
                          "grpc://",
                          "grpc://:7420",
                          "grpc://x:",
                          "grpc://x:0",
                          "grpc://x:70000",
                          "grpc://x:7420x",
                          "grpc://::1",
                          "grpc://x/y",
                          "grpc://[]:1",
                          "grpcs://",
                          "grpcs://x:0",
                          "grpcs:/x",
                          "grpcsx://x",
                          "usb://x",
                          "usb:a b",
                          "usb:a?speed=2",
                          "usb:\xff",
                          "usb",
                          "replay:",
                          "replay:x?speed=-1",
                          "replay:x?speed=fast",
                          "replay:x?speed=inf"}) {
    const Result<ProbeUri> parsed = parse_probe_uri(bad);
    ASSERT_FALSE(parsed.ok()) << bad;
    EXPECT_EQ(parsed.status().code(), StatusCode::invalid_argument) << bad;
  }
  EXPECT_FALSE(parse_probe_uri("usb:" + std::string(127, 'x')).ok());
  const std::string unknown = parse_probe_uri("http://x").status().message();
  EXPECT_NE(unknown.find("grpc://"), std::string::npos) << unknown;
  EXPECT_NE(unknown.find("usb:"), std::string::npos) << unknown;
  EXPECT_NE(unknown.find("replay:"), std::string::npos) << unknown;
}

TEST(ProbeOptions, RejectsInvalidValuesByName) {
  EXPECT_TRUE(ProbeOptions{}.validate().ok());
  ProbeOptions options;
  options.history = 0;
  EXPECT_NE(options.validate().message().find("history"), std::string::npos);
  options = {};
  options.retry_max = {1};
  EXPECT_NE(options.validate().message().find("retry_max"), std::string::npos);
  options = {};
  options.silence_limit = {};
  EXPECT_NE(options.validate().message().find("silence_limit"), std::string::npos);
}

}  // namespace
}  // namespace lightwell::core
