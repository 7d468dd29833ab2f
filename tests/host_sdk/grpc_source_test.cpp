// The gRPC connection against a fake probe on the loopback interface.
#include <chrono>
#include <cstdlib>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/probe.hpp>

#include "host_sdk/fake_probe.hpp"
#include "host_sdk/scenes.hpp"

namespace lightwell {
namespace {

using test::encoded;
using test::eventually;
using test::FakeProbe;
using test::numbered;

constexpr Duration kTestTimeout{30'000'000'000};
constexpr std::int64_t kSecond = 1'000'000'000;

/// Short retry pauses and long timeouts, because the machine may be busy.
ProbeOptions options() {
  ProbeOptions o;
  o.connect_timeout = Duration{20 * kSecond};
  o.retry_min = {20'000'000};
  o.retry_max = {100'000'000};
  return o;
}

/// All received messages, as bytes.
class Tap {
 public:
  std::function<void(const Arrival&)> observer() {
    return [this](const Arrival& arrival) {
      const std::lock_guard lock(mutex_);
      messages_.emplace_back(reinterpret_cast<const char*>(arrival.bytes.data()), arrival.bytes.size());
    };
  }
  std::vector<std::string> messages() const {
    const std::lock_guard lock(mutex_);
    return messages_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> messages_;
};

std::string with_unknown_field(std::string message) {
  // Field 1000, varint 5: key 1000 << 3 = 8000 = 0xC0 0x3E.
  return message + std::string("\xC0\x3E\x05", 3);
}

TEST(GrpcSource, ReceivesDescriptors) {
  FakeProbe fake;
  fake.set_script({encoded(numbered(5, 1)), encoded(numbered(6, 2))});
  const Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(eventually([&] { return probe->stats().received == 2; }));
  EXPECT_EQ(probe->latest().descriptor().sequence, 6U);
  EXPECT_EQ(probe->latest().encoded_bytes(), encoded(numbered(6, 2)).size());
  EXPECT_EQ(probe->stats().state, LinkState::connected);
  EXPECT_EQ(probe->stats().gaps, 0U);
}

TEST(GrpcSource, DuplicateDescriptorIsDroppedAndCounted) {
  FakeProbe fake;
  const std::string old = encoded(numbered(5, 1'000));
  // The last one is of a restarted daemon: its sequence starts again, the clock of its machine continues.
  fake.set_script({old, encoded(numbered(6, 2'000)), old, encoded(numbered(6, 2'000)), encoded(numbered(7, 3'000)),
                   encoded(numbered(1, 4'000))});
  const Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(eventually([&] { return probe->stats().received == 4; }));
  EXPECT_EQ(probe->stats().replayed, 2U);
  EXPECT_EQ(probe->stats().undecodable, 0U);
  EXPECT_EQ(probe->latest().descriptor().sequence, 1U);
  EXPECT_EQ(probe->latest().descriptor().time.mid_exposure.ns, 4'000);
}

TEST(GrpcSource, InfoReportsIdentityAndClock) {
  FakeProbe fake;
  const std::int64_t offset = 1'000 * kSecond;
  fake.set_clock_offset_ns(offset);
  const Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  const ProbeInfo info = probe->info();
  EXPECT_EQ(info.name, "fake");
  EXPECT_EQ(info.id, 7U);
  EXPECT_EQ(info.calibration_id, 9U);
  EXPECT_EQ(info.camera, "none");
  EXPECT_EQ(info.version, "0.0.1");
  EXPECT_EQ(info.counters.frames, 1234U);
  EXPECT_EQ(info.counters.messages_refused, 17U);
  EXPECT_EQ(info.counters.authentication_failures, 18U);
  EXPECT_EQ(info.counters.client_list_faults, 19U);
  EXPECT_FALSE(info.T_world_probe);
  EXPECT_LE(std::llabs(info.clock_offset.ns - offset), info.clock_uncertainty.ns);
  EXPECT_GT(info.clock_uncertainty.ns, 0);
}

TEST(GrpcSource, MountingGivesTheLightingInTheRoom) {
  FakeProbe fake;
  v1::Mounting mounting;
  // On the ceiling, upside down: rotated by pi about the forward axis.
  mounting.mutable_pose()->set_qz(-2);
  mounting.mutable_pose()->set_ty(2.5);
  for (int i = 0; i < 21; ++i) mounting.add_covariance(i == 0 ? 1e-4 : 0);
  fake.set_mounting(mounting);
  fake.set_script({encoded(numbered(1, monotonic_now_ns()))});
  const Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(probe->wait_for_next(std::nullopt, kTestTimeout).ok());
  ASSERT_TRUE(probe->info().T_world_probe);
  EXPECT_EQ(probe->info().T_world_probe->pose.translation, (Vec3d{0, 2.5, 0}));
  const Lighting own = probe->latest(), room = probe->latest_in_world();
  ASSERT_NE(own.mounting(), nullptr);
  EXPECT_EQ(own.mounting()->pose.rotation, (Quat{0, 0, -1, 0})) << "normalised";
  EXPECT_EQ(room.mounting(), nullptr) << "the mounting must not be applied twice";
  const Vec3f up = own.lights()[0].direction;
  EXPECT_NEAR(room.lights()[0].direction.x, -up.x, 1e-6);
  EXPECT_NEAR(room.lights()[0].direction.y, -up.y, 1e-6);
  EXPECT_NEAR(room.lights()[0].direction.z, up.z, 1e-6);
  EXPECT_GT(room.lights()[0].direction_covariance[0] + room.lights()[0].direction_covariance[2],
            own.lights()[0].direction_covariance[0] + own.lights()[0].direction_covariance[2] + 0.9e-4F);
  // The application's option has precedence.
  ProbeOptions placed = options();
  placed.T_world_probe = UncertainPose{};
  const Result<Probe> there = Probe::connect(fake.uri(), placed);
  ASSERT_TRUE(there.ok()) << there.status().message();
  ASSERT_TRUE(there->wait_for_next(std::nullopt, kTestTimeout).ok());
  EXPECT_NEAR(there->latest_in_world().lights()[0].direction.y, up.y, 1e-6);
}

TEST(GrpcSource, MidExposureIsMappedToTheHostsClock) {
  FakeProbe fake;
  const std::int64_t offset = -500 * kSecond;
  fake.set_clock_offset_ns(offset);
  const std::int64_t host_ns = monotonic_now_ns();
  fake.set_script({encoded(numbered(1, host_ns + offset))});
  const Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  const Result<Lighting> lighting = probe->wait_for_next(std::nullopt, kTestTimeout);
  ASSERT_TRUE(lighting.ok()) << lighting.status().message();
  // The first answers' uncertainty bounds the error of what was mapped with them; connecting took
  // less than the timeout, so half of that bounds it on any machine. Off by a clock, it is 500 s.
  EXPECT_LT(std::llabs(lighting->mid_exposure().ns - host_ns), 10 * kSecond);
  EXPECT_GE(lighting->received().ns, host_ns);
}

TEST(GrpcSource, BytesAreUnchanged) {
  FakeProbe fake;
  const std::string future = with_unknown_field(encoded(numbered(1, 1)));
  const std::string plain = encoded(numbered(2, 2));
  fake.set_script({future, plain});
  Tap tap;
  ProbeOptions o = options();
  o.on_descriptor = tap.observer();
  const Result<Probe> probe = Probe::connect(fake.uri(), o);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(eventually([&] { return tap.messages().size() == 2; }));
  EXPECT_EQ(tap.messages()[0], future);
  EXPECT_EQ(tap.messages()[1], plain);
  EXPECT_EQ(probe->stats().bytes, future.size() + plain.size());
}

TEST(GrpcSource, DamagedMessagesAreCountedAndTheLastValidOneIsKept) {
  FakeProbe fake;
  const std::string too_long(kMaxDescriptorBytes + 1, 'x');
  fake.set_script({encoded(numbered(3, 1)), "\xFF\xFF garbage", "", too_long});
  const Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(eventually([&] { return probe->stats().oversized == 1; }));
  EXPECT_EQ(probe->stats().received, 1U);
  EXPECT_EQ(probe->stats().undecodable, 2U);
  EXPECT_FALSE(probe->stats().last_error.empty());
  EXPECT_EQ(probe->latest().descriptor().sequence, 3U);
  EXPECT_EQ(probe->stats().reconnects, 0U) << "an invalid message does not close the connection";
}

TEST(GrpcSource, MessageAboveGrpcsLimitIsCountedAndTheLinkReconnects) {
  FakeProbe fake;
  fake.set_script({std::string((std::size_t{4} << 20) + 1, 'x')});
  const Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_TRUE(eventually([&] { return probe->stats().oversized >= 1; }));
  fake.set_script({encoded(numbered(1, 1))});
  EXPECT_TRUE(eventually([&] { return probe->stats().received >= 1; }));
  EXPECT_GE(probe->stats().reconnects, 1U);
}

TEST(GrpcSource, SequenceGapsAreCounted) {
  FakeProbe fake;
  fake.set_script({encoded(numbered(3, 1)), encoded(numbered(4, 2)), encoded(numbered(8, 3))});
  const Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(eventually([&] { return probe->stats().received == 3; }));
  EXPECT_EQ(probe->stats().gaps, 3U);
}

TEST(GrpcSource, ReconnectsToARestartedProbe) {
  FakeProbe fake;
  fake.set_script({encoded(numbered(900, 1))});
  const Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(eventually([&] { return probe->stats().received == 1; }));
  fake.stop();
  ASSERT_TRUE(eventually([&] { return probe->stats().state != LinkState::connected; }));
  EXPECT_FALSE(probe->stats().last_error.empty());
  EXPECT_EQ(probe->latest().descriptor().sequence, 900U) << "the last descriptor is kept";
  fake.set_script({encoded(numbered(1, 1))});
  fake.start();
  const Result<Lighting> next = probe->wait_for_next(900, kTestTimeout);
  ASSERT_TRUE(next.ok()) << next.status().message();
  EXPECT_EQ(next->descriptor().sequence, 1U);
  EXPECT_EQ(probe->stats().reconnects, 1U);
  EXPECT_EQ(probe->stats().gaps, 0U) << "a restart does not count as a gap";
}

TEST(GrpcSource, ReconnectsToAProbeThatHangs) {
  FakeProbe fake;
  ProbeOptions o = options();
  o.silence_limit = Duration::from_seconds(2);
  o.connect_timeout = Duration::from_seconds(2);
  const Result<Probe> probe = Probe::connect(fake.uri(), o);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(eventually([&] { return probe->stats().state == LinkState::connected; }));
  fake.set_answering(FakeProbe::Answering::no);
  EXPECT_TRUE(eventually([&] { return probe->stats().state != LinkState::connected; }));
  fake.set_answering(FakeProbe::Answering::yes);
  EXPECT_TRUE(eventually([&] { return probe->stats().reconnects >= 1; }));
}

TEST(GrpcSource, UnreachableProbeIsReported) {
  std::string uri;
  {
    FakeProbe fake;
    uri = fake.uri();
  }
  ProbeOptions o = options();
  o.connect_timeout = Duration::from_seconds(0.3);
  const Result<Probe> probe = Probe::connect(uri, o);
  ASSERT_FALSE(probe.ok());
  EXPECT_EQ(probe.status().code(), StatusCode::unavailable);
  const std::string message = probe.status().message();
  EXPECT_NE(message.find(uri), std::string::npos) << message;
  EXPECT_NE(message.find("lightwelld"), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

TEST(GrpcSource, WaitForNextTimesOut) {
  FakeProbe fake;
  const Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  const Result<Lighting> next = probe->wait_for_next(std::nullopt, Duration::from_seconds(0.05));
  ASSERT_FALSE(next.ok());
  EXPECT_EQ(next.status().code(), StatusCode::unavailable);
  EXPECT_EQ(probe->latest().validity(), Validity::none);
}

TEST(GrpcSource, CommandsReachTheProbe) {
  FakeProbe fake;
  Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();

  EstimatorConfig config;
  config.band = 2;
  config.max_lights = 3;
  const Status set = probe->set_estimator(config);
  EXPECT_TRUE(set.ok()) << set.message();
  ASSERT_TRUE(fake.last_config());
  EXPECT_EQ(fake.last_config()->config().estimator().band(), 2U);
  EXPECT_EQ(fake.last_config()->config().estimator().max_lights(), 3U);
  EXPECT_FALSE(fake.last_config()->config().has_camera()) << "only the estimator may change";

  const Result<double> scale = probe->report_lux(430, {0, 2, 0});
  ASSERT_TRUE(scale.ok()) << scale.status().message();
  EXPECT_EQ(*scale, 2.5);
  EXPECT_EQ(fake.last_lux()->lux(), 430);
  EXPECT_EQ(fake.last_lux()->normal_y(), 1);

  const Result<double> dark = probe->report_lux(0.5, {0, 1, 0});
  ASSERT_FALSE(dark.ok());
  EXPECT_EQ(dark.status().code(), StatusCode::failed_precondition);
  EXPECT_NE(dark.status().message().find("too dark"), std::string::npos);
}

TEST(GrpcSource, AChangeSendsItsFieldsAlone) {
  FakeProbe fake;
  Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  const Status changed = probe->change_estimator({.panorama = {.epsilon = 0.02}});
  EXPECT_TRUE(changed.ok()) << changed.message();
  ASSERT_TRUE(fake.last_config());
  v1::Config only;
  only.mutable_estimator()->mutable_panorama()->set_epsilon(0.02);
  EXPECT_EQ(fake.last_config()->config().ShortDebugString(), only.ShortDebugString());
}

TEST(GrpcSource, WhatAnOldProbeDoesNotKnowIsSaid) {
  FakeProbe fake;
  fake.set_firmware(FakeProbe::Firmware::old);
  Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EXPECT_TRUE(probe->change_estimator({.band = 2, .setting = Setting::fast}).ok());
  for (const Status& old :
       {probe->estimator_config().status(), probe->estimator_kind().status(),
        probe->change_estimator({.panorama = {.epsilon = 0.02}}), probe->set_estimator({}),
        probe->start_recording().status(), probe->stop_recording().status(), probe->calibration().status()}) {
    EXPECT_EQ(old.code(), StatusCode::failed_precondition);
    EXPECT_NE(old.message().find("firmware is older"), std::string::npos) << old.message();
    EXPECT_NE(old.message().find("update lightwelld"), std::string::npos) << old.message();
  }
}

TEST(GrpcSource, AnOldProbeWithoutPlanesStillSendsDescriptors) {
  FakeProbe fake;
  fake.set_script({encoded(numbered(5, 1))});
  ProbeOptions with_plane = options();
  with_plane.plane = PlaneReception::receive;
  const Result<Probe> probe = Probe::connect(fake.uri(), with_plane);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(eventually([&] { return probe->stats().last_error.find("captures no planes") != std::string::npos; }));
  ASSERT_TRUE(eventually([&] { return probe->stats().received == 1; }));
  EXPECT_EQ(probe->stats().state, LinkState::connected);
  EXPECT_EQ(probe->plane().validity(), Validity::none);
}

TEST(GrpcSource, TheEndOfThePlanesStreamIsReported) {
  struct End {
    grpc::Status status;
    const char* message;
  };
  for (const End& end :
       {End{{grpc::StatusCode::RESOURCE_EXHAUSTED, "too many clients"}, "the plane's stream ended: too many clients"},
        End{grpc::Status::OK, "the plane's stream ended: the probe ended it"}}) {
    FakeProbe fake;
    fake.set_plane_end(end.status);
    fake.set_script({encoded(numbered(5, 1))});
    ProbeOptions with_plane = options();
    with_plane.plane = PlaneReception::receive;
    const Result<Probe> probe = Probe::connect(fake.uri(), with_plane);
    ASSERT_TRUE(probe.ok()) << probe.status().message();
    ASSERT_TRUE(eventually([&] { return probe->stats().last_error == end.message; })) << probe->stats().last_error;
    ASSERT_TRUE(eventually([&] { return probe->stats().received == 1; }));
    EXPECT_EQ(probe->stats().state, LinkState::connected) << "descriptors go on";
  }
}

TEST(GrpcSource, InvalidCommandsAreNotSent) {
  FakeProbe fake;
  Result<Probe> probe = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  EstimatorConfig config;
  config.band = 99;
  EXPECT_EQ(probe->set_estimator(config).code(), StatusCode::invalid_argument);
  EXPECT_EQ(probe->change_estimator({}).code(), StatusCode::invalid_argument) << "no field";
  EXPECT_EQ(probe->change_estimator({.panorama = {.epsilon = 2}}).code(), StatusCode::invalid_argument);
  EXPECT_EQ(probe->report_lux(-1, {0, 1, 0}).status().code(), StatusCode::invalid_argument);
  EXPECT_EQ(probe->report_lux(100, {0, 0, 0}).status().code(), StatusCode::invalid_argument);
  EXPECT_FALSE(fake.last_config());
  EXPECT_FALSE(fake.last_lux());
}

TEST(GrpcSource, EndsWithinASecondInEveryState) {
  using Clock = std::chrono::steady_clock;
  FakeProbe fake;
  fake.set_script({encoded(numbered(1, 1))});
  const auto seconds_to_end = [](Result<Probe> probe) {
    const auto start = Clock::now();
    { const Probe gone = std::move(*probe); }
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  // Ten times the specified limit: passes on a busy machine, fails for a thread that hangs.
  Result<Probe> streaming = Probe::connect(fake.uri(), options());
  ASSERT_TRUE(streaming.ok());
  EXPECT_LT(seconds_to_end(std::move(streaming)), 10);

  ProbeOptions patient = options();
  patient.retry_min = patient.retry_max = Duration{3600 * kSecond};
  Result<Probe> waiting = Probe::connect(fake.uri(), patient);
  ASSERT_TRUE(waiting.ok());
  fake.stop();
  ASSERT_TRUE(eventually([&] { return waiting->stats().state == LinkState::waiting; }));
  EXPECT_LT(seconds_to_end(std::move(waiting)), 10);
}

}  // namespace
}  // namespace lightwell
