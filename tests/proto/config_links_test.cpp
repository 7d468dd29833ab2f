// The daemon's configuration of links: gRPC, MQTT, discovery, web, USB.
#include <gtest/gtest.h>

#include <lightwell/config.hpp>

namespace lightwell {
namespace {

std::string refusal(std::string_view text) {
  const auto c = parse_config(text, "probe.textproto");
  EXPECT_FALSE(c.ok());
  return c.status().message();
}

TEST(LinkConfig, ParsesGrpcSecurity) {
  const auto c = parse_config(
      "camera { uri: \"sim:city\" } grpc { security: LINK_SECURITY_MUTUAL_TLS key_folder: \"k\" certificate: \"c.pem\" "
      "key: \"c_key.pem\" client_ca: \"ca.pem\" client_certificate_days: 30 }",
      "x");
  ASSERT_TRUE(c.ok()) << c.status().message();
  EXPECT_EQ(c->grpc.security, LinkSecurity::mutual_tls);
  EXPECT_EQ(c->grpc.key_folder, "k");
  EXPECT_EQ(c->grpc.certificate, "c.pem");
  EXPECT_EQ(c->grpc.key, "c_key.pem");
  EXPECT_EQ(c->grpc.client_ca, "ca.pem");
  EXPECT_EQ(c->grpc.client_certificate_days, 30);
  const auto plain = parse_config("camera { uri: \"sim:city\" }", "x");
  EXPECT_EQ(plain->grpc.security, LinkSecurity::unspecified);
  EXPECT_EQ(plain->grpc.client_certificate_days, 365);
}

TEST(LinkConfig, ContradictoryGrpcSecurityIsRejected) {
  const auto with = [](const std::string& grpc) {
    return refusal("camera { uri: \"sim:city\" } grpc { " + grpc + " }");
  };
  EXPECT_NE(with("security: LINK_SECURITY_TLS certificate: \"c.pem\"").find("grpc.key"), std::string::npos);
  EXPECT_NE(with("certificate: \"c.pem\" key: \"k.pem\"").find("LINK_SECURITY_TLS"), std::string::npos)
      << "a certificate that would not be used";
  EXPECT_NE(with("security: LINK_SECURITY_PLAIN client_ca: \"c.pem\"").find("grpc.security"), std::string::npos);
  for (const char* days : {"9999", "4294967295"})
    EXPECT_NE(with(std::string("client_certificate_days: ") + days).find("grpc.client_certificate_days"),
              std::string::npos);
}

TEST(LinkConfig, ParsesMqttAndDiscovery) {
  const Result<Config> c = parse_config(
      "camera { uri: \"sim:city\" }\n"
      "mqtt { uri: \"mqtts://broker/venue/attic\" ca_file: \"ca.pem\" certificate_file: \"me.pem\" key_file: "
      "\"me.key\"\n"
      "       login_file: \"login\" client_id: \"attic-1\" }\n"
      "discovery { mdns: MDNS_ON }\n",
      "probe.textproto");
  ASSERT_TRUE(c.ok()) << c.status().message();
  ASSERT_TRUE(c->mqtt);
  EXPECT_EQ(c->mqtt->uri, "mqtts://broker/venue/attic");
  EXPECT_EQ(c->mqtt->ca_file, "ca.pem");
  EXPECT_EQ(c->mqtt->certificate_file, "me.pem");
  EXPECT_EQ(c->mqtt->key_file, "me.key");
  EXPECT_EQ(c->mqtt->login_file, "login");
  EXPECT_EQ(c->mqtt->client_id, "attic-1");
  EXPECT_EQ(c->mdns, Mdns::on);
  const Result<Config> plain = parse_config("camera { uri: \"sim:city\" }", "probe.textproto");
  EXPECT_FALSE(plain->mqtt);
  EXPECT_EQ(plain->mdns, Mdns::off);
}

TEST(LinkConfig, InvalidMqttConfigIsRejectedByField) {
  const auto refusal = [](const std::string& mqtt) {
    return parse_config("camera { uri: \"sim:city\" } mqtt { " + mqtt + " }", "probe.textproto").status().message();
  };
  EXPECT_NE(refusal("uri: \"mqtt://broker/venue/+\"").find("mqtt.uri"), std::string::npos);
  EXPECT_NE(refusal("").find("mqtt.uri"), std::string::npos);
  EXPECT_NE(refusal("uri: \"mqtts://broker/a\" key_file: \"me.key\"").find("certificate_file"), std::string::npos);
  EXPECT_NE(refusal("uri: \"mqtt://broker/a\" ca_file: \"ca.pem\"").find("mqtts://"), std::string::npos)
      << "an authority implies TLS";
}

TEST(LinkConfig, ALoginGoesOverPlainTextOnlyWhereThatIsAskedForByName) {
  const auto parsed = [](const std::string& mqtt) {
    return parse_config("camera { uri: \"sim:city\" } mqtt { " + mqtt + " }", "probe.textproto");
  };
  const std::string login = " login_file: \"login\" ", plain = "uri: \"mqtt://broker/a\"";
  const std::string refusal = parsed(plain + login).status().message();
  for (const char* part : {"mqtt.login_file", "'broker'", "mqtts://", "LINK_SECURITY_PLAIN"})
    EXPECT_NE(refusal.find(part), std::string::npos) << refusal;
  for (const std::string& good :
       {plain, plain + login + "security: LINK_SECURITY_PLAIN", "uri: \"mqtt://broker/a?security=plain\"" + login,
        "uri: \"mqtts://broker/a\"" + login, "uri: \"mqtt://127.0.0.1/a\"" + login, "uri: \"mqtt://[::1]/a\"" + login,
        "uri: \"mqtt://localhost/a\"" + login})
    EXPECT_TRUE(parsed(good).ok()) << good << ": " << parsed(good).status().message();
  for (const std::string& bad :
       {std::string("uri: \"mqtts://broker/a\" security: LINK_SECURITY_PLAIN"), plain + " security: LINK_SECURITY_TLS",
        "uri: \"mqtts://broker/a?security=plain\"" + login, "uri: \"mqtt://127.broker/a\"" + login,
        std::string("uri: \"mqtts://broker/a\" security: LINK_SECURITY_MUTUAL_TLS"),
        std::string("uri: \"mqtts://broker/a\" security: 9")})
    EXPECT_FALSE(parsed(bad).ok()) << bad;
}

TEST(LinkConfig, ParsesTheWebLink) {
  EXPECT_FALSE(parse_config("camera { uri: \"sim:city\" }", "x")->web);
  const auto plain = parse_config("camera { uri: \"sim:city\" } web {}", "x");
  ASSERT_TRUE(plain.ok() && plain->web);
  EXPECT_EQ(plain->web->listen_address, "127.0.0.1:7443");
  EXPECT_EQ(plain->web->security, LinkSecurity::unspecified);
  EXPECT_EQ(plain->web->dashboard, Dashboard::on);
  EXPECT_TRUE(plain->web->check_bind_policy().ok());
  const auto c = parse_config(
      "camera { uri: \"sim:city\" } grpc { security: LINK_SECURITY_TLS key_folder: \"k\" certificate: \"g.pem\" key: "
      "\"g_key.pem\" client_ca: \"ca.pem\" }\nweb { listen_address: \"[::]:7443\" security: LINK_SECURITY_MUTUAL_TLS "
      "certificate: \"w.pem\" key: \"w_key.pem\" dashboard: DASHBOARD_OFF allowed_origins: \"https://a.example\" "
      "allowed_origins: \"http://b.example:8080\" }",
      "x");
  ASSERT_TRUE(c.ok()) << c.status().message();
  EXPECT_EQ(c->web->listen_address, "[::]:7443");
  EXPECT_EQ(c->web->dashboard, Dashboard::off);
  EXPECT_EQ(c->web->allowed_origins, (std::vector<std::string>{"https://a.example", "http://b.example:8080"}));
  // Its own certificate; all else of the keys is that of the gRPC link.
  const GrpcConfig keys = c->web_keys();
  EXPECT_EQ(keys.security, LinkSecurity::mutual_tls);
  EXPECT_EQ(keys.certificate, "w.pem");
  EXPECT_EQ(keys.key, "w_key.pem");
  EXPECT_EQ(keys.client_ca, "ca.pem");
  EXPECT_EQ(keys.key_folder, "k");
}

TEST(LinkConfig, InvalidWebConfigIsRejectedByField) {
  const auto with = [](const std::string& web) { return refusal("camera { uri: \"sim:city\" } web { " + web + " }"); };
  EXPECT_NE(with("security: LINK_SECURITY_TLS certificate: \"c.pem\"").find("web.key"), std::string::npos);
  EXPECT_NE(with("client_ca: \"c.pem\"").find("web.security"), std::string::npos);
  EXPECT_NE(with("security: 9").find("web.security"), std::string::npos);
  EXPECT_NE(with("dashboard: 7").find("web.dashboard"), std::string::npos);
  for (const std::string origin :
       {"a.example", "https", "https://", "https://a.example/", "ftp://a.example", "https://a b", "*", ""})
    EXPECT_NE(with("allowed_origins: \"" + origin + "\"").find("web.allowed_origins: '" + origin), std::string::npos)
        << origin;
  std::string many;
  for (int i = 0; i < 17; ++i) many += " allowed_origins: \"https://a.example\"";
  EXPECT_NE(with(many).find("at most 16"), std::string::npos);
}

TEST(LinkConfig, ParsesTheUsbGadget) {
  EXPECT_FALSE(parse_config("camera { uri: \"x:\" }", "x")->usb_gadget.has_value());
  EXPECT_EQ(parse_config("camera { uri: \"x:\" } usb_gadget {}", "x")->usb_gadget->functionfs_mount,
            "/dev/ffs-lightwell");
  EXPECT_EQ(parse_config("camera { uri: \"x:\" } usb_gadget { functionfs_mount: \"/run/f\" }", "x")
                ->usb_gadget->functionfs_mount,
            "/run/f");
}

}  // namespace
}  // namespace lightwell
