// Responses of ProbeService on the gRPC link.
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <lightwell/status.hpp>

#include "firmware/link/probe_server.hpp"
#include "lightwell/v1/probe_service.grpc.pb.h"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

const std::string kService = "/lightwell.v1.ProbeService/";

class GrpcServiceTest : public GrpcLinkTest {
 protected:
  void SetUp() override {
    GrpcLinkTest::SetUp();
    channel_ = connect(*link_);
    stub_ = v1::ProbeService::NewStub(channel_);
  }
  grpc::Status set(const v1::SetConfigRequest& request) {
    grpc::ClientContext context;
    v1::SetConfigResponse response;
    return stub_->SetConfig(&context, request, &response);
  }
  grpc::Status report(double lux, double x, double y, double z) {
    v1::ReportLuxRequest request;
    request.set_lux(lux);
    request.set_normal_x(x);
    request.set_normal_y(y);
    request.set_normal_z(z);
    grpc::ClientContext context;
    v1::ReportLuxResponse response;
    const grpc::Status status = stub_->ReportLux(&context, request, &response);
    scale_ = response.scale();
    return status;
  }

  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::ProbeService::Stub> stub_;
  double scale_ = 0;
};

/// Check of grpc.health.v1: request { string service = 1; }, response { enum status = 1; }, SERVING = 1.
Reply health(const std::shared_ptr<grpc::Channel>& channel, const std::string& service) {
  std::string request;
  if (!service.empty()) request = "\x0a" + std::string(1, static_cast<char>(service.size())) + service;
  return call(channel, "/grpc.health.v1.Health/Check", request);
}

TEST_F(GrpcServiceTest, HealthIsServing) {
  for (const std::string service : {"", "lightwell.v1.ProbeService"}) {
    const Reply reply = health(channel_, service);
    EXPECT_TRUE(reply.status.ok()) << reply.status.error_message();
    EXPECT_EQ(reply.bytes, "\x08\x01") << "'" << service << "'";
  }
  EXPECT_EQ(health(channel_, "lightwell.v1.Sundial").status.error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(GrpcServiceTest, ReflectionListsTheService) {
  // ServerReflectionRequest { string list_services = 7; }, empty.
  RawStream stream(channel_, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                   std::string("\x3a\x00", 2));
  const std::optional<std::string> answer = stream.next();
  ASSERT_TRUE(answer) << "waited for the answer of the reflection service";
  EXPECT_THAT(*answer, HasSubstr("lightwell.v1.ProbeService"));
  EXPECT_THAT(*answer, HasSubstr("grpc.health.v1.Health"));
}

TEST_F(GrpcServiceTest, EveryMethodOfTheSchemaIsServed) {
  const google::protobuf::ServiceDescriptor* const service =
      v1::InfoRequest::descriptor()->file()->FindServiceByName("ProbeService");
  ASSERT_NE(service, nullptr);
  ASSERT_EQ(service->method_count(), 9);
  for (int i = 0; i < service->method_count(); ++i) {
    const std::string name = service->method(i)->name();
    // A malformed request, so that no method has an effect.
    EXPECT_EQ(call(channel_, kService + name, "\x0b").status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << name;
  }
}

TEST_F(GrpcServiceTest, InfoReturnsStatusAndCounters) {
  const std::int64_t before = monotonic_now_ns();
  const Reply reply = call(channel_, kService + "Info", "");
  ASSERT_TRUE(reply.status.ok());
  const Result<InfoAnswer> info = decode_info(std::as_bytes(std::span(reply.bytes)));
  ASSERT_TRUE(info.ok()) << info.status().message();
  EXPECT_EQ(info->status, commands_.status());
  EXPECT_GE(info->clock_now.ns, before);
}

TEST_F(GrpcServiceTest, BeforeTheFirstDescriptorThereIsNone) {
  const Reply reply = call(channel_, kService + "GetDescriptor", "");
  EXPECT_EQ(reply.status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(reply.status.error_message(), HasSubstr("no descriptor yet"));
}

TEST_F(GrpcServiceTest, GetDescriptorReturnsTheNewestBytes) {
  link_->publish(message(1));
  const EncodedDescriptor newest = message(2, 5000);
  link_->publish(newest);
  for (int again = 0; again < 2; ++again) {
    const Reply reply = call(channel_, kService + "GetDescriptor", "");
    ASSERT_TRUE(reply.status.ok());
    EXPECT_EQ(reply.bytes, text_of(newest));
  }
}

TEST_F(GrpcServiceTest, EveryStreamGetsTheSameBytes) {
  RawStream one(channel_), other(channel_), third(connect(*link_));
  ASSERT_TRUE(clients_become(3));
  for (int i = 0; i < 20; ++i) {
    const EncodedDescriptor sent = message(i, static_cast<std::size_t>(20 + 100 * i));
    link_->publish(sent);
    for (RawStream* stream : {&one, &other, &third}) EXPECT_EQ(stream->next(), text_of(sent)) << "message " << i;
  }
  EXPECT_EQ(link_->counters().coalesced, 0U);
}

TEST_F(GrpcServiceTest, SetConfigChangesOnlyTheFieldsThatAreSet) {
  v1::SetConfigRequest request;
  request.mutable_config()->mutable_estimator()->set_band(2);
  ASSERT_TRUE(set(request).ok());
  EXPECT_EQ(commands_.estimator().band, 2);
  EXPECT_EQ(commands_.estimator().max_lights, EstimatorConfig{}.max_lights);

  request.Clear();
  request.mutable_config()->mutable_estimator()->set_max_lights(0);
  ASSERT_TRUE(set(request).ok()) << "an explicit zero is set";
  EXPECT_EQ(commands_.estimator().band, 2);
  EXPECT_EQ(commands_.estimator().max_lights, 0);
  EXPECT_EQ(commands_.estimator().panorama.light_threshold, EstimatorConfig{}.panorama.light_threshold);
}

/// Paths of all unset fields that are not deprecated.
void collect_unset(const google::protobuf::Message& m, const std::string& prefix, std::vector<std::string>& out) {
  for (int i = 0; i < m.GetDescriptor()->field_count(); ++i) {
    const auto* field = m.GetDescriptor()->field(i);
    if (field->options().deprecated()) continue;
    if (!m.GetReflection()->HasField(m, field))
      out.push_back(prefix + field->name());
    else if (field->message_type() != nullptr)
      collect_unset(m.GetReflection()->GetMessage(m, field), prefix + field->name() + ".", out);
  }
}

TEST_F(GrpcServiceTest, GetConfigReturnsAllEstimatorFieldsAndNothingElse) {
  ASSERT_TRUE(commands_.update_estimator({.band = 3, .panorama = {.unseen = UnseenFill::mirror}}).ok());
  grpc::ClientContext context;
  v1::GetConfigResponse response;
  ASSERT_TRUE(stub_->GetConfig(&context, {}, &response).ok());
  EXPECT_EQ(response.kind(), v1::ESTIMATOR_KIND_PANORAMA);
  EXPECT_EQ(response.estimator().band(), 3U);
  EXPECT_EQ(response.estimator().panorama().unseen_fill(), v1::UNSEEN_FILL_MIRROR);
  std::vector<std::string> unset;
  collect_unset(response, "", unset);
  EXPECT_THAT(unset, ::testing::IsEmpty());
  // Config must not be included: it has file names and client authorities.
  for (int i = 0; i < response.GetDescriptor()->field_count(); ++i)
    EXPECT_NE(response.GetDescriptor()->field(i)->message_type(), v1::Config::descriptor());
}

TEST_F(GrpcServiceTest, SetConfigRefusesUnknownFields) {
  // Field 99 of EstimatorConfig and of its panorama message, as a newer client may send it.
  for (const bool inner : {false, true}) {
    v1::SetConfigRequest request;
    v1::EstimatorConfig& estimator = *request.mutable_config()->mutable_estimator();
    estimator.set_band(1);
    if (inner)
      estimator.mutable_panorama()
          ->GetReflection()
          ->MutableUnknownFields(estimator.mutable_panorama())
          ->AddVarint(99, 1);
    else
      estimator.GetReflection()->MutableUnknownFields(&estimator)->AddVarint(99, 1);
    const grpc::Status status = set(request);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), HasSubstr("number 99"));
  }
  EXPECT_EQ(commands_.estimator().band, EstimatorConfig{}.band) << "and nothing changed";
}

TEST_F(GrpcServiceTest, SetConfigRefusesOtherFieldsByName) {
  const auto refused = [&](auto&& fill, const std::string& name) {
    v1::SetConfigRequest request;
    request.mutable_config()->mutable_estimator()->set_band(1);
    fill(*request.mutable_config());
    const grpc::Status status = set(request);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION) << name;
    EXPECT_THAT(status.error_message(), HasSubstr(name));
    EXPECT_THAT(status.error_message(), HasSubstr("restart"));
  };
  refused([](v1::Config& c) { c.set_probe_name("cellar"); }, "probe_name");
  refused([](v1::Config& c) { c.mutable_camera()->set_width(320); }, "camera");
  refused([](v1::Config& c) { c.set_calibration("other.textproto"); }, "calibration");
  refused([](v1::Config& c) { c.mutable_grpc()->set_listen_address("0.0.0.0:1"); }, "grpc");
  refused([](v1::Config& c) { c.mutable_record()->set_path("/tmp/x"); }, "record");
  refused([](v1::Config& c) { c.set_budget_ms(2); }, "budget_ms");
  EXPECT_EQ(commands_.estimator().band, EstimatorConfig{}.band) << "and nothing changed";
}

TEST_F(GrpcServiceTest, SetConfigRefusesInvalidValues) {
  EXPECT_EQ(set({}).error_code(), grpc::StatusCode::INVALID_ARGUMENT) << "nothing is set";
  const auto refused = [&](auto&& fill, const std::string& name) {
    v1::SetConfigRequest request;
    fill(*request.mutable_config()->mutable_estimator());
    const grpc::Status status = set(request);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), HasSubstr(name));
  };
  refused([](v1::EstimatorConfig& e) { e.set_band(7); }, "band");
  refused([](v1::EstimatorConfig& e) { e.set_band(0xFFFFFFFF); }, "band");
  refused([](v1::EstimatorConfig& e) { e.set_max_lights(65); }, "max_lights");
  // Truncated to a byte, 257 would be 1 (fast).
  refused([](v1::EstimatorConfig& e) { e.set_setting(static_cast<v1::Setting>(257)); }, "setting");
  refused([](v1::EstimatorConfig& e) { e.mutable_panorama()->set_unseen_fill(static_cast<v1::UnseenFill>(258)); },
          "unseen");
  refused([](v1::EstimatorConfig& e) { e.mutable_panorama()->set_light_threshold(std::nan("")); }, "light_threshold");
}

TEST_F(GrpcServiceTest, SetConfigRefusesInapplicableFieldsAndWarnsOfDeprecatedOnes) {
  commands_.kind_ = EstimatorKind::marker;
  v1::SetConfigRequest request;
  request.mutable_config()->mutable_estimator()->mutable_panorama()->set_epsilon(0.02);
  const grpc::Status refused = set(request);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), HasSubstr("estimator.panorama.epsilon"));
  // SetConfigRequest { config { estimator { 7: 2 } } }: the deprecated field `unseen`.
  const std::string old("\x0a\x04\x22\x02\x38\x02", 6);
  for (const EstimatorKind kind : {EstimatorKind::marker, EstimatorKind::panorama}) {
    commands_.kind_ = kind;
    const Reply reply = call(channel_, kService + "SetConfig", old);
    ASSERT_TRUE(reply.status.ok()) << reply.status.error_message();
    v1::SetConfigResponse response;
    ASSERT_TRUE(response.ParseFromString(reply.bytes));
    ASSERT_EQ(response.warnings_size(), 1);
    EXPECT_THAT(response.warnings(0), HasSubstr("estimator.unseen"));
    EXPECT_EQ(commands_.estimator().panorama.unseen,
              kind == EstimatorKind::marker ? UnseenFill::none : UnseenFill::mirror);
  }
}

TEST_F(GrpcServiceTest, ReportLuxNormalizesTheNormal) {
  ASSERT_TRUE(report(250, 0, 3, 0).ok());
  EXPECT_EQ(scale_, 500);
  EXPECT_EQ(commands_.lux_, 250);
  EXPECT_EQ(commands_.normal_, (Vec3d{0, 1, 0}));
}

TEST_F(GrpcServiceTest, ReportLuxRefusesInvalidValues) {
  const double inf = std::numeric_limits<double>::infinity(), nan = std::nan("");
  for (const double lux : {0.0, -1.0, inf, nan})
    EXPECT_EQ(report(lux, 0, 1, 0).error_code(), grpc::StatusCode::INVALID_ARGUMENT) << lux;
  EXPECT_EQ(report(100, 0, 0, 0).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(report(100, nan, 1, 0).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(report(100, inf, 1, 0).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_FALSE(commands_.lux_) << "no invalid value reached Commands";
}

TEST_F(GrpcServiceTest, RefusesAMalformedRequest) {
  const Reply reply = call(channel_, kService + "SetConfig", "\xff\xff\xff\xff");
  EXPECT_FALSE(reply.status.ok());
  const Reply huge = call(channel_, kService + "SetConfig", std::string(100'000, 'x'));
  EXPECT_EQ(huge.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(health(channel_, "").status.ok()) << "the probe continues to serve";
}

}  // namespace
}  // namespace lightwell::test
