#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/commands.hpp>
#include <lightwell/framing.hpp>
#include <lightwell/link_message.hpp>

#include "lightwell/v1/link_message.pb.h"
#include "support/fake_commands.hpp"

namespace lightwell {
namespace {

using Bytes = std::vector<std::byte>;

Bytes bytes_of(const v1::LinkRequest& m) {
  Bytes out(m.ByteSizeLong());
  m.SerializeToArray(out.data(), static_cast<int>(out.size()));
  return out;
}

std::vector<std::byte> bytes_of_text(const std::string& text) {
  const auto raw = std::as_bytes(std::span(text));
  return {raw.begin(), raw.end()};
}

LinkResponse asked(std::span<const std::byte> request, Commands& commands) {
  Bytes response;
  const Status answered = answer_link_request(request, commands, response);
  EXPECT_TRUE(answered.ok()) << answered.message();
  EXPECT_LE(response.size(), kMaxLinkMessageBytes);
  const Result<LinkResponse> out = decode_link_response(response);
  EXPECT_TRUE(out.ok()) << out.status().message();
  return out ? *out : LinkResponse{};
}

TEST(LinkMessage, InfoReportsStatusAndClock) {
  test::FakeCommands commands;
  Bytes request;
  encode_info_request(77, request);
  const std::int64_t before = monotonic_now_ns();
  const LinkResponse r = asked(request, commands);
  EXPECT_EQ(r.id, 77U);
  EXPECT_TRUE(r.status.ok());
  ASSERT_TRUE(r.info);
  EXPECT_EQ(r.info->status, commands.status());
  EXPECT_GE(r.info->clock_now.ns, before);
  EXPECT_LE(r.info->clock_now.ns, monotonic_now_ns());
}

TEST(LinkMessage, AStreamOfPlanesIsStartedByTheLink) {
  test::FakeCommands commands;
  Bytes request, response;
  encode_plane_request(5, request);
  const auto status_of = [&](const StartPlaneStream& start) {
    EXPECT_TRUE(answer_link_request(request, commands, response, start).ok());
    const Result<LinkResponse> out = decode_link_response(response);
    EXPECT_TRUE(out.ok() && out->id == 5 && !out->info && !out->estimator && !out->scale);
    return out->status;
  };
  int started = 0;
  EXPECT_TRUE(status_of([&] {
                ++started;
                return Status();
              }).ok());
  EXPECT_EQ(started, 1);
  const Status often = status_of([] { return Status(StatusCode::resource_exhausted, "too often"); });
  EXPECT_EQ(often.code(), StatusCode::resource_exhausted);
  EXPECT_EQ(often.message(), "too often");
  // A link without planes answers as firmware that does not know the request.
  EXPECT_EQ(status_of({}).code(), StatusCode::invalid_argument);
}

TEST(LinkMessage, CommandsAreExecutedAndErrorsReturned) {
  test::FakeCommands commands;
  Bytes request;
  EstimatorConfig config;
  config.band = 2;
  encode_link_request(1, all_fields(config), request);
  EXPECT_TRUE(asked(request, commands).status.ok());
  EXPECT_EQ(commands.estimator().band, 2);

  config.band = 99;
  encode_link_request(2, all_fields(config), request);
  const LinkResponse refused = asked(request, commands);
  EXPECT_EQ(refused.id, 2U);
  EXPECT_EQ(refused.status.code(), StatusCode::invalid_argument);
  EXPECT_NE(refused.status.message().find("band"), std::string::npos);
  EXPECT_EQ(commands.estimator().band, 2) << "a refused configuration changes nothing";

  encode_link_request(3, ReportLux{400, {0, 5, 0}}, request);
  const LinkResponse lux = asked(request, commands);
  ASSERT_TRUE(lux.scale);
  EXPECT_EQ(*lux.scale, 800);
  EXPECT_EQ(commands.lux_, 400);
  EXPECT_EQ(commands.normal_.y, 1) << "normalised on the way";
}

TEST(LinkMessage, ARecordingIsStartedAndStopped) {
  test::FakeCommands commands;
  for (const RecordingAction action : {RecordingAction::start, RecordingAction::stop}) {
    Bytes request;
    encode_link_request(8, action, request);
    const LinkResponse r = asked(request, commands);
    EXPECT_EQ(commands.action_, action);
    RecordingStatus expected = *commands.status().recording;
    expected.running = action == RecordingAction::start;
    EXPECT_EQ(r.recording, expected);
    const Result<std::string> rpc =
        answer_probe_call(ProbeCall::control_recording, encode_rpc_request(action), commands);
    ASSERT_TRUE(rpc.ok()) << rpc.status().message();
    EXPECT_EQ(decode_rpc_response(action, bytes_of_text(*rpc))->recording, expected);
  }
  commands.action_.reset();
  for (const int unknown : {0, 3, -1}) {
    v1::LinkRequest m;
    m.mutable_control_recording()->set_action(static_cast<v1::RecordingAction>(unknown));
    const LinkResponse refused = asked(bytes_of(m), commands);
    EXPECT_EQ(refused.status.code(), StatusCode::invalid_argument) << unknown;
    EXPECT_FALSE(refused.recording || commands.action_) << unknown;
  }
}

TEST(LinkMessage, TheCalibrationIsReported) {
  test::FakeCommands commands;
  Bytes request;
  encode_link_request(9, GetCalibration{}, request);
  EXPECT_EQ(asked(request, commands).calibration, commands.calibration());
  const Result<std::string> rpc =
      answer_probe_call(ProbeCall::get_calibration, encode_rpc_request(GetCalibration{}), commands);
  ASSERT_TRUE(rpc.ok()) << rpc.status().message();
  EXPECT_EQ(decode_rpc_response(GetCalibration{}, bytes_of_text(*rpc))->calibration, commands.calibration());
}

TEST(LinkMessage, ConfigurationIsReportedAndChanged) {
  test::FakeCommands commands;
  commands.kind_ = EstimatorKind::marker;
  Bytes request;
  encode_link_request(1, EstimatorUpdate{.max_lights = 3}, request);
  ASSERT_TRUE(asked(request, commands).status.ok());
  encode_link_request(2, EstimatorUpdate{.marker = {.max_faces = 4}}, request);
  ASSERT_TRUE(asked(request, commands).status.ok());
  encode_link_request(3, GetConfig{}, request);
  const LinkResponse r = asked(request, commands);
  EXPECT_TRUE(r.status.ok()) << r.status.message();
  ASSERT_TRUE(r.estimator);
  EXPECT_EQ(r.estimator->kind, EstimatorKind::marker);
  EstimatorConfig expected;
  expected.max_lights = 3;
  expected.marker.max_faces = 4;
  EXPECT_EQ(r.estimator->config, expected);
}

TEST(LinkMessage, AConfigurationThatIsNoneIsNotBelieved) {
  v1::LinkResponse m;
  m.mutable_get_config()->set_kind(v1::ESTIMATOR_KIND_PANORAMA);
  const auto decoded = [&] {
    Bytes bytes(m.ByteSizeLong());
    m.SerializeToArray(bytes.data(), static_cast<int>(bytes.size()));
    return decode_link_response(bytes)->status;
  };
  EXPECT_TRUE(decoded().ok());
  m.mutable_get_config()->mutable_estimator()->set_band(77);
  EXPECT_EQ(decoded().code(), StatusCode::data_loss);
  EXPECT_NE(decoded().message().find("estimator.band is 77"), std::string::npos) << decoded().message();
  m.mutable_get_config()->mutable_estimator()->set_band(6);
  m.mutable_get_config()->set_kind(static_cast<v1::EstimatorKind>(9));
  EXPECT_EQ(decoded().code(), StatusCode::data_loss);
}

TEST(LinkMessage, InvalidRequestsAreRefusedWithTheReason) {
  test::FakeCommands commands;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  Bytes request;
  for (const double lux : {0.0, -1.0, kNan, kInf}) {
    encode_link_request(1, ReportLux{lux, {0, 1, 0}}, request);
    EXPECT_EQ(asked(request, commands).status.code(), StatusCode::invalid_argument) << lux;
  }
  for (const Vec3d normal : {Vec3d{0, 0, 0}, Vec3d{kNan, 0, 1}, Vec3d{kInf, 0, 0}}) {
    encode_link_request(1, ReportLux{100, normal}, request);
    EXPECT_EQ(asked(request, commands).status.code(), StatusCode::invalid_argument);
  }
  EXPECT_FALSE(commands.lux_);

  v1::LinkRequest nothing;
  nothing.set_id(9);
  EXPECT_EQ(asked(bytes_of(nothing), commands).status.code(), StatusCode::invalid_argument);
  EXPECT_EQ(asked({}, commands).id, 0U) << "an empty message is a request that asks nothing";

  v1::LinkRequest fixed;
  fixed.mutable_set_config()->mutable_config()->mutable_estimator()->set_band(1);
  fixed.mutable_set_config()->mutable_config()->mutable_usb_gadget()->set_functionfs_mount("/elsewhere");
  fixed.mutable_set_config()->mutable_config()->mutable_camera()->set_uri("sim:city");
  const LinkResponse refused = asked(bytes_of(fixed), commands);
  EXPECT_EQ(refused.status.code(), StatusCode::failed_precondition);
  EXPECT_NE(refused.status.message().find("camera, usb_gadget"), std::string::npos) << refused.status.message();
  EXPECT_EQ(commands.estimator().band, 6);
  fixed.mutable_set_config()->clear_config();
  EXPECT_EQ(asked(bytes_of(fixed), commands).status.code(), StatusCode::invalid_argument);
}

TEST(LinkMessage, AuthenticateIsAnsweredWithoutALookAtTheToken) {
  // id 7 (field 1, fixed32), authenticate (field 6) with the token "abc" (field 1).
  const std::vector<std::byte> request =
      bytes_of_text(std::string("\x0d\x07\x00\x00\x00\x32\x05\x0a\x03"
                                "abc",
                                12));
  const std::optional<AuthenticateRequest> decoded = decode_authenticate(request);
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->id, 7U);
  EXPECT_EQ(decoded->token, "abc");
  test::FakeCommands commands;
  const LinkResponse response = asked(request, commands);
  EXPECT_TRUE(response.status.ok());
  EXPECT_EQ(response.id, 7U);
  std::vector<std::byte> other;
  encode_info_request(7, other);
  EXPECT_FALSE(decode_authenticate(other));
  EXPECT_FALSE(decode_authenticate({}));
  EXPECT_FALSE(decode_authenticate(std::vector<std::byte>(20, std::byte{0xff})));
}

TEST(LinkMessage, BytesThatAreNotAMessageAreRejectedByBothSides) {
  test::FakeCommands commands;
  Bytes response;
  const Bytes garbage(40, std::byte{0xFF});
  EXPECT_EQ(answer_link_request(garbage, commands, response).code(), StatusCode::data_loss);
  EXPECT_TRUE(response.empty());
  EXPECT_EQ(decode_link_response(garbage).status().code(), StatusCode::data_loss);
  const Bytes long_one(kMaxLinkMessageBytes + 1);
  EXPECT_EQ(answer_link_request(long_one, commands, response).code(), StatusCode::data_loss);

  // Truncated or with a flipped bit at any position: with or without a response, but without a crash.
  std::mt19937 random(3);
  Bytes request;
  encode_link_request(4, all_fields({}), request);
  for (int k = 0; k < 20'000; ++k) {
    Bytes damaged = request;
    damaged.resize(1 + random() % damaged.size());
    damaged[random() % damaged.size()] ^= static_cast<std::byte>(1U << random() % 8);
    if (answer_link_request(damaged, commands, response).ok()) {
      EXPECT_TRUE(decode_link_response(response).ok());
    }
    EXPECT_TRUE(commands.estimator().validate().ok());
  }
}

/// A probe whose camera has a very long name.
class Talkative final : public test::FakeCommands {
 public:
  StatusSnapshot status() const override {
    StatusSnapshot s = FakeCommands::status();
    s.camera.assign(100'000, 'x');
    for (int i = 0; i < 50'000; ++i) s.probe_name += "é";
    return s;
  }
};

TEST(LinkMessage, ResponseKeepsItsSizeLimitForAnyName) {
  Talkative commands;
  Bytes request;
  encode_info_request(1, request);
  const LinkResponse r = asked(request, commands);
  ASSERT_TRUE(r.info);
  EXPECT_EQ(r.info->status.camera.size(), 1024U);
  EXPECT_EQ(r.info->status.probe_name.size(), 1023U) << "five letters and 509 of two bytes: cut between two characters";
}

}  // namespace
}  // namespace lightwell
