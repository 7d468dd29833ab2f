// The origin and the distances of near lamps on the wire.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/query.hpp>

#include "lightwell/v1/descriptor.pb.h"

namespace lightwell {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();

Descriptor with_near_lamp() {
  Descriptor d;
  d.coverage = 1;
  Light near;
  near.direction = normalized(Vec3f{1, 2, -2});
  near.irradiance = {3, 2, 1};
  near.track = 1;
  near.distance_m = 0.3F;
  near.distance_sigma_m = 0.005F;
  Light distant = near;
  distant.track = 2;
  distant.distance_m = distant.distance_sigma_m = 0;
  d.lights = {near, distant};
  d.T_probe_origin = {Quat::about({0, 1, 0}, 0.7), {0.1, -0.2, -0.8}};
  return d;
}

Descriptor without_origin_and_distance(Descriptor d) {
  d.T_probe_origin = {};
  for (Light& light : d.lights) light.distance_m = light.distance_sigma_m = 0;
  return d;
}

std::string encoded(const Descriptor& d) {
  Encoder encoder;
  const auto bytes = encoder.encode(d);
  EXPECT_TRUE(bytes.ok()) << bytes.status().message();
  return bytes.ok() ? std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()) : std::string();
}

Result<Descriptor> decoded(const std::string& bytes) { return decode_descriptor(std::as_bytes(std::span(bytes))); }

TEST(WirePosition, RoundTripsOriginAndDistances) {
  const Descriptor d = with_near_lamp();
  const auto back = decoded(encoded(d));
  ASSERT_TRUE(back.ok()) << back.status().message();
  // The wire has doubles; the reader normalises the quaternion, which rounds it.
  EXPECT_NEAR(back->T_probe_origin.rotation.y, d.T_probe_origin.rotation.y, 1e-15);
  EXPECT_NEAR(back->T_probe_origin.rotation.w, d.T_probe_origin.rotation.w, 1e-15);
  EXPECT_EQ(back->T_probe_origin.translation, d.T_probe_origin.translation);
  // Both are multiples of the unit of 1e-4 m.
  EXPECT_EQ(back->lights[0].distance_m, 0.3F);
  EXPECT_EQ(back->lights[0].distance_sigma_m, 0.005F);
  EXPECT_EQ(back->lights[1].distance_m, 0);
  EXPECT_EQ(back->lights[1].distance_sigma_m, 0);
}

TEST(WirePosition, RoundsTheDistanceToTheNearestUnitAndItsDeviationUp) {
  Descriptor d = with_near_lamp();
  const auto round_trip = [&](float distance_m, float sigma_m) {
    d.lights[0].distance_m = distance_m;
    d.lights[0].distance_sigma_m = sigma_m;
    return decoded(encoded(d))->lights[0];
  };
  EXPECT_EQ(round_trip(0.30004F, 0.00501F).distance_m, 0.3F);
  EXPECT_EQ(round_trip(0.30004F, 0.00501F).distance_sigma_m, 0.0051F);
  EXPECT_EQ(round_trip(0.5F, 1e-9F).distance_sigma_m, 1e-4F) << "a standard deviation of 0 would be none";
  for (int units = 1; units < 3000; ++units) {
    const auto m = static_cast<float>(units * 1e-4);
    EXPECT_EQ(round_trip(m, m).distance_sigma_m, m) << "rounding up must not grow with each relay";
  }
}

TEST(WirePosition, CostsBytesOnlyIfPresent) {
  const Descriptor d = with_near_lamp(), plain = without_origin_and_distance(d);
  Descriptor origin = plain, distance = d;
  origin.T_probe_origin = d.T_probe_origin;
  distance.T_probe_origin = {};
  const std::size_t bytes = encoded(plain).size();
  // proto/README.md, "Caps and sizes". A full pose has seven doubles of nine bytes, and three bytes for the message.
  EXPECT_LE(encoded(distance).size() - bytes, 8U);
  EXPECT_LE(encoded(origin).size() - bytes, 66U);
  v1::LightingDescriptor m;
  ASSERT_TRUE(m.ParseFromString(encoded(plain)));
  EXPECT_FALSE(m.has_t_probe_origin());
  EXPECT_FALSE(m.lights(0).has_distance_e4());
  ASSERT_TRUE(m.ParseFromString(encoded(d)));
  EXPECT_FALSE(m.lights(1).has_distance_e4());
}

TEST(WirePosition, MessageOfAnOlderProbeHasItsOriginAtTheProbeAndNoDistances) {
  const Descriptor plain = without_origin_and_distance(with_near_lamp());
  const auto back = decoded(encoded(plain));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->T_probe_origin, Pose{});
  EXPECT_FALSE(light_position(back->lights[0], back->T_probe_origin));
}

/// The schema of version 0.1.0 without the fields that it did not have yet.
class OlderReader {
 public:
  OlderReader() {
    google::protobuf::FileDescriptorProto file;
    v1::LightingDescriptor::descriptor()->file()->CopyTo(&file);
    file.clear_dependency();
    remove(file, "LightingDescriptor", {"T_probe_origin"});
    remove(file, "Light", {"distance_e4", "distance_sigma_e4"});
    const auto* built = pool_.BuildFile(file);
    EXPECT_NE(built, nullptr);
    if (built != nullptr) prototype_ = factory_.GetPrototype(built->FindMessageTypeByName("LightingDescriptor"));
  }

  /// What it reads of a message, encoded again.
  [[nodiscard]] std::string read(const std::string& bytes) const {
    if (prototype_ == nullptr) return {};
    const std::unique_ptr<google::protobuf::Message> m(prototype_->New());
    EXPECT_TRUE(m->ParseFromString(bytes));
    m->DiscardUnknownFields();
    return m->SerializeAsString();
  }

 private:
  static void remove(google::protobuf::FileDescriptorProto& file, const std::string& message,
                     const std::vector<std::string>& names) {
    for (auto& type : *file.mutable_message_type()) {
      if (type.name() != message) continue;
      auto& fields = *type.mutable_field();
      const auto gone = [&](const auto& field) { return std::ranges::find(names, field.name()) != names.end(); };
      EXPECT_EQ(std::ranges::count_if(fields, gone), static_cast<std::ptrdiff_t>(names.size()));
      fields.erase(std::remove_if(fields.begin(), fields.end(), gone), fields.end());
      // Proto3 declares a synthetic oneof for each optional field.
      type.clear_oneof_decl();
    }
  }

  google::protobuf::DescriptorPool pool_;
  google::protobuf::DynamicMessageFactory factory_{&pool_};
  const google::protobuf::Message* prototype_ = nullptr;
};

TEST(WirePosition, OlderReaderPassesOverBoth) {
  const Descriptor d = with_near_lamp();
  EXPECT_EQ(OlderReader().read(encoded(d)), encoded(without_origin_and_distance(d)));
  EXPECT_NE(encoded(d), encoded(without_origin_and_distance(d)));
}

TEST(WirePosition, EncoderRefusesWhatTheWireCannotHold) {
  const auto refused = [](const std::function<void(Descriptor&)>& spoil) {
    Descriptor d = with_near_lamp();
    spoil(d);
    Encoder encoder;
    return encoder.encode(d).status().code() == StatusCode::invalid_argument;
  };
  const auto distance = [&](double distance_m, double sigma_m) {
    return refused([&](Descriptor& d) {
      d.lights[0].distance_m = static_cast<float>(distance_m);
      d.lights[0].distance_sigma_m = static_cast<float>(sigma_m);
    });
  };
  EXPECT_FALSE(distance(1, 0.1));
  EXPECT_TRUE(distance(0, 0.1));
  EXPECT_TRUE(distance(1, 0));
  EXPECT_TRUE(distance(-1, 0.1));
  EXPECT_TRUE(distance(1, -0.1));
  EXPECT_TRUE(distance(1e-5, 0.1));
  EXPECT_TRUE(distance(1e6, 0.1));
  EXPECT_TRUE(distance(1, 1e6));
  for (const double bad : {kNan, kInf}) {
    EXPECT_TRUE(distance(bad, 0.1));
    EXPECT_TRUE(distance(1, bad));
    EXPECT_TRUE(refused([&](Descriptor& d) { d.T_probe_origin.translation.y = bad; }));
    EXPECT_TRUE(refused([&](Descriptor& d) { d.T_probe_origin.rotation.w = bad; }));
  }
  EXPECT_TRUE(refused([](Descriptor& d) { d.T_probe_origin.rotation = {0, 0, 0, 0}; }));
  EXPECT_TRUE(refused([](Descriptor& d) { d.T_probe_origin.rotation = {0, 0, 0, 2}; }));
  EXPECT_TRUE(refused([](Descriptor& d) { d.T_probe_origin.translation.z = -1.1e6; }));
}

TEST(WirePosition, ReaderRefusesInvalidMessagesNamingTheField) {
  using M = v1::LightingDescriptor;
  const auto refusal = [](const std::function<void(M&)>& spoil) {
    M m;
    EXPECT_TRUE(m.ParseFromString(encoded(with_near_lamp())));
    spoil(m);
    const auto d = decoded(m.SerializeAsString());
    EXPECT_EQ(d.status().code(), StatusCode::invalid_argument);
    return d.status().message();
  };
  const auto names = [](const std::string& message, const char* field) {
    return message.find(field) != std::string::npos;
  };
  EXPECT_TRUE(names(refusal([](M& m) { m.mutable_lights(0)->clear_distance_e4(); }), "distance_e4"));
  EXPECT_TRUE(names(refusal([](M& m) { m.mutable_lights(0)->set_distance_sigma_e4(0); }), "distance_e4"));
  EXPECT_TRUE(names(refusal([](M& m) { m.mutable_t_probe_origin()->Clear(); }), "T_probe_origin"));
  for (const double bad : {kNan, kInf, -kInf, 1.01e6, -1.01e6})
    EXPECT_TRUE(names(refusal([&](M& m) { m.mutable_t_probe_origin()->set_ty(bad); }), "T_probe_origin")) << bad;
  for (const double bad : {kNan, kInf, 1e200})
    EXPECT_TRUE(names(refusal([&](M& m) { m.mutable_t_probe_origin()->set_qx(bad); }), "T_probe_origin")) << bad;
}

TEST(WirePosition, ReaderNormalisesTheQuaternion) {
  v1::LightingDescriptor m;
  ASSERT_TRUE(m.ParseFromString(encoded(with_near_lamp())));
  for (const double scale : {1e-8, 3.0, 1e100}) {
    v1::LightingDescriptor scaled = m;
    auto& pose = *scaled.mutable_t_probe_origin();
    pose.set_qy(scale * pose.qy());
    pose.set_qw(scale * pose.qw());
    const auto d = decoded(scaled.SerializeAsString());
    ASSERT_TRUE(d.ok()) << d.status().message();
    EXPECT_NEAR(d->T_probe_origin.rotation.y, std::sin(0.35), 1e-15) << scale;
    EXPECT_NEAR(d->T_probe_origin.rotation.w, std::cos(0.35), 1e-15) << scale;
  }
}

TEST(WirePosition, PositionIsTheDistanceAlongTheDirectionFromTheOrigin) {
  const Descriptor d = with_near_lamp();
  const auto near = light_position(d.lights[0], d.T_probe_origin);
  ASSERT_TRUE(near);
  // (1, 2, -2)/3 times 0.3 from (0.1, -0.2, -0.8), in the probe's axes; float directions have 24 bits.
  EXPECT_NEAR(near->x, 0.2, 1e-7);
  EXPECT_NEAR(near->y, 0.0, 1e-7);
  EXPECT_NEAR(near->z, -1.0, 1e-7);
  EXPECT_FALSE(light_position(d.lights[1], d.T_probe_origin));
}

}  // namespace
}  // namespace lightwell
