// lightwell field with fifty probes at one real broker, which come and go while it runs, and its glTF file.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <lightwell/codec.hpp>
#include <lightwell/field.hpp>
#include <lightwell/mqtt.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/status.hpp>

#include "host_sdk/field/field_scenes.hpp"
#include "support/broker.hpp"
#include "support/child.hpp"
#include "support/mqtt_client.hpp"
#include "support/temp_dir.hpp"
#ifdef LIGHTWELL_HAVE_TINYGLTF
#include <tiny_gltf.h>
#endif

namespace lightwell::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

const FieldScene kHall{.lamps = {{{0.4, 2.6, -0.3}}, {{-3.1, 2.2, 2.5}, {8, 9, 12}}}, .sun = {5, 5, 5}};

/// Publishes what a daemon publishes: its status with mounting, its clock, and descriptors.
class VenueProbe {
 public:
  VenueProbe(const Broker& broker, int number)
      : topics_("venue/p" + std::to_string(number)),
        place_{0.9 * (number % 8) - 3.1, 1.0 + 0.1 * (number % 5), 0.9 * (number / 8) - 2.7},  // NOLINT: whole rows
        client_(broker.port(), {topics_.clock}, [this](const BrokerMessage& question) {
          client_.answer({question.response_topic, encode_clock({now()}), false, {}, question.correlation});
        }) {
    StatusSnapshot status;
    status.probe_name = topics_.status;
    status.version = "0.1.0";
    status.T_world_probe.emplace(sample_at(place_, {}).T_world_probe);
    client_.publish(topics_.status, encode_status(status), MqttClient::Keep::retained);
    say_light();
  }
  ~VenueProbe() { client_.publish(topics_.status, std::string(kMqttGone), MqttClient::Keep::retained); }

  [[nodiscard]] std::string uri(const Broker& broker) const {
    return broker.uri(topics_.status.substr(0, topics_.status.rfind('/')));
  }

  void say_light() { say_light(kHall, monotonic_now_ns()); }

  /// What it measures of the scene, with this machine's time of the exposure.
  void say_light(const FieldScene& scene, std::int64_t ns) {
    Descriptor d = scene.at(place_);
    for (std::uint32_t k = 0; k < d.lights.size(); ++k) d.lights[k].track = k + 1;
    d.sequence = ++sequence_;
    d.time.mid_exposure = {ns + kClockOffset};
    Encoder encoder;
    const auto bytes = encoder.encode(d);
    ASSERT_TRUE(bytes.ok());
    client_.publish(topics_.descriptor, {reinterpret_cast<const char*>(bytes->data()), bytes->size()},
                    MqttClient::Keep::retained);
  }

 private:
  /// The probe's clock is another one than this machine's.
  static constexpr std::int64_t kClockOffset = 3'600'000'000'000;
  [[nodiscard]] static std::int64_t now() { return monotonic_now_ns() + kClockOffset; }

  const MqttTopics topics_;
  const Vec3d place_;
  std::uint64_t sequence_ = 0;
  MqttClient client_;  // Last: its thread uses the others.
};

/// The newest whole line.
json newest(const Child& tool) {
  const std::string out = tool.out();
  const std::size_t end = out.rfind('\n');
  if (end == std::string::npos) return json::object();
  const std::size_t before = end == 0 ? std::string::npos : out.rfind('\n', end - 1);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1;
  const json line = json::parse(out.substr(begin, end - begin), nullptr, false);
  return line.is_discarded() ? json::object() : line;
}

std::size_t used(const json& line) {
  const json probes = line.value("probes", json::array());
  return static_cast<std::size_t>(
      std::ranges::count_if(probes, [](const json& p) { return p.at("state") == "used" || p.at("state") == "stale"; }));
}

class FieldToolTest : public ::testing::Test {
 protected:
  void add(int first, int last) {
    for (int number = first; number < last; ++number) probes_.push_back(std::make_unique<VenueProbe>(broker_, number));
  }

  /// Probes go on publishing until the tool lists `count` of them.
  [[nodiscard]] ::testing::AssertionResult lists(const Child& tool, std::size_t count) {
    return becomes_true("the field has " + std::to_string(count) + " probes; " + tool.err(), [&] {
      for (const auto& probe : probes_) probe->say_light();
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      const json line = newest(tool);
      return used(line) == count && line.at("probes").size() == count;
    });
  }

  Broker broker_;
  std::vector<std::unique_ptr<VenueProbe>> probes_;
  TempDir folder_;
};

void expect_hall(const json& line) {
  for (const Lamp& lamp : kHall.lamps) {
    double off = 9;
    for (const json& light : line.at("lights")) {
      if (!light.at("placed")) continue;
      const auto p = light.at("position").get<std::vector<double>>();
      off = std::min(off, length(Vec3d{p[0], p[1], p[2]} - lamp.position));
    }
    EXPECT_LT(off, 0.02);  // Directions on the wire are rounded to 1/8191.
  }
  EXPECT_EQ(std::ranges::count(line.at("lights"), false, [](const json& l) { return l.at("placed").get<bool>(); }), 1);
  EXPECT_EQ(line.at("units"), "absolute");
}

#ifdef LIGHTWELL_HAVE_TINYGLTF
void expect_gltf(const std::string& path) {
  tinygltf::TinyGLTF loader;
  tinygltf::Model model;
  std::string error, warning;
  ASSERT_TRUE(loader.LoadASCIIFromFile(&model, &error, &warning, path)) << error;
  EXPECT_EQ(error + warning, "");
  ASSERT_EQ(model.lights.size(), 3U);
  std::size_t found = 0;
  for (const tinygltf::Node& node : model.nodes) {
    const auto light =
        static_cast<std::size_t>(node.extensions.at("KHR_lights_punctual").Get("light").GetNumberAsInt());
    if (model.lights.at(light).type == "directional") {
      // It shines along -Z of its node, away from the sun.
      const auto& q = node.rotation;
      const Vec3d along = rotate(Quat{q.at(0), q.at(1), q.at(2), q.at(3)}, Vec3d{0, 0, -1});
      EXPECT_LT(angle_between(along, -kHall.towards_sun), 0.02);
      EXPECT_NEAR(model.lights[light].intensity, 5, 0.1);
      ++found;
      continue;
    }
    for (const Lamp& lamp : kHall.lamps) {
      const auto& t = node.translation;
      if (length(Vec3d{t.at(0), t.at(1), t.at(2)} - lamp.position) > 0.02) continue;
      const auto& color = model.lights[light].color;
      EXPECT_NEAR(model.lights[light].intensity * color.at(0), lamp.intensity.r, 0.05 * lamp.intensity.r);
      EXPECT_NEAR(model.lights[light].intensity * color.at(2), lamp.intensity.b, 0.05 * lamp.intensity.b);
      ++found;
    }
  }
  EXPECT_EQ(found, 3U);
  const tinygltf::Value& image_based = model.extensions.at("EXT_lights_image_based").Get("lights").Get(0);
  const double intensity = image_based.Get("intensity").GetNumberAsDouble();
  // Even radiance L has the irradiance pi L from everywhere, whose first coefficient is that over Y_00.
  const double radiance = static_cast<double>(kHall.ambient) * 0.282095, irradiance = 3.14159265 * radiance;
  EXPECT_NEAR(intensity * image_based.Get("irradianceCoefficients").Get(0).Get(1).GetNumberAsDouble() * 0.282095,
              irradiance, 0.05 * irradiance);
  ASSERT_EQ(model.images.size(), 6U);
  for (const tinygltf::Image& image : model.images) {
    EXPECT_EQ(image.width, image_based.Get("specularImageSize").GetNumberAsInt());
    ASSERT_EQ(image.image.size(), static_cast<std::size_t>(4 * image.width * image.height));
    const double value = image.image[5] / static_cast<double>(image.image[7]);  // RGBD
    EXPECT_NEAR(intensity * value, radiance, 0.1 * radiance);
  }
}
#endif

TEST_F(FieldToolTest, FiftyProbesOfABrokerComeAndGo) {
  add(0, 50);
  const std::string gltf = folder_.path("hall.gltf"), grid = folder_.path("hall.json");
  Child tool({LIGHTWELL_CLI, "field", broker_.uri("venue/+"), "--json", "--gltf", gltf, "--grid", grid,
              "--from=-1,1,-1", "--to=1,1,1", "--spacing", "1", "--lights-apart"});
  ASSERT_TRUE(lists(tool, 50));
  expect_hall(newest(tool));
  probes_.erase(probes_.begin() + 10, probes_.begin() + 30);
  ASSERT_TRUE(lists(tool, 30));
  expect_hall(newest(tool));
  add(10, 15);
  ASSERT_TRUE(lists(tool, 35));
  expect_hall(newest(tool));
  tool.signal(SIGINT);
  EXPECT_EQ(tool.wait(), (ExitStatus{0, 0})) << tool.err();
#ifdef LIGHTWELL_HAVE_TINYGLTF
  expect_gltf(gltf);
#endif
  const json probes = json::parse(std::ifstream(grid));
  EXPECT_EQ(probes.at("validity"), json(std::vector<int>(9, 1)));
  EXPECT_EQ(probes.at("lights").size(), 3U);
  // Even radiance L: irradiance over pi is L in the first coefficient; what is dim is in no lamp.
  EXPECT_NEAR(probes.at("sphericalHarmonicsL2").at(0).get<double>(), static_cast<double>(kHall.ambient) * 0.282095,
              0.05 * static_cast<double>(kHall.ambient) * 0.282095);
}

/// The distance of the placed light that is nearest to a point.
double nearest_placed(const LightField& field, Vec3d point) {
  double off = std::numeric_limits<double>::infinity();
  for (const FieldLight& light : field.state()->lights)
    if (light.placed) off = std::min(off, length(light.position - point));
  return off;
}

TEST_F(FieldToolTest, AMovingLampIsWhereItWasAtACommonTimeOfTheProbes) {
  // A lamp at 1.5 m/s; the probes measure one after the other, 60 ms apart.
  const std::int64_t start = monotonic_now_ns();
  const auto lamp_at = [&](std::int64_t ns) {
    return Vec3d{-0.6 + 1.5e-9 * static_cast<double>(ns - start), 2.4, 0.3};
  };
  add(0, 4);
  std::vector<Probe> receivers;
  for (const auto& probe : probes_) {
    Result<Probe> receiver = Probe::connect(probe->uri(broker_));
    ASSERT_TRUE(receiver.ok()) << receiver.status().message();
    receivers.push_back(std::move(*receiver));
  }
  const std::int64_t begin = monotonic_now_ns();
  for (int k = 0; k < 12; ++k) {
    const std::int64_t now = monotonic_now_ns();
    probes_[static_cast<std::size_t>(k) % 4]->say_light({.lamps = {{lamp_at(now)}}}, now);
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
  }
  ASSERT_TRUE(becomes_true("all have the third descriptor", [&] {
    return std::ranges::all_of(receivers, [](const Probe& p) { return p.latest().descriptor().sequence >= 4; });
  }));
  std::vector<Lighting> newest;
  for (const Probe& receiver : receivers) newest.push_back(receiver.latest());
  const auto time = common_time(newest);
  ASSERT_TRUE(time);
  EXPECT_EQ(*time, newest[0].mid_exposure());  // The first of the last round.
  EXPECT_GT(time->ns, begin);

  LightField aligned = std::move(LightField::make().value()), unaligned = std::move(LightField::make().value());
  for (std::size_t k = 0; k < receivers.size(); ++k) {
    const UncertainPose pose = *newest[k].mounting();
    ASSERT_TRUE(aligned.set(name_of(k), field_sample(receivers[k].at(*time), pose)).ok());
    ASSERT_TRUE(unaligned.set(name_of(k), field_sample(newest[k], pose)).ok());
  }
  (void)aligned.update({monotonic_now_ns()});
  (void)unaligned.update({monotonic_now_ns()});
  // Interpolating directions over 0.36 m of way: 4 mm; the wire's rounding and the clocks: as much.
  EXPECT_LT(nearest_placed(aligned, lamp_at(time->ns)), 0.02);
  EXPECT_GT(nearest_placed(unaligned, lamp_at(time->ns)), 0.05);

  // A probe that has fallen silent does not hold the others back, and nor does one without light.
  EXPECT_EQ(common_time(newest, {1}), newest[3].mid_exposure());
  newest.emplace_back();
  EXPECT_EQ(common_time(newest), time);
  EXPECT_FALSE(common_time({}));
}

TEST_F(FieldToolTest, SaysWhyAProbeGivesNoLight) {
  Child tool({LIGHTWELL_CLI, "field", broker_.uri("venue/nobody"), "--seconds", "3"});
  EXPECT_EQ(tool.wait(), (ExitStatus{1, 0}));
  EXPECT_THAT(tool.out(), HasSubstr("venue/nobody  unreachable: "));
  EXPECT_THAT(tool.err(), HasSubstr("no probe gave light"));
}

TEST_F(FieldToolTest, RefusesAGridBeforeItConnects) {
  const std::vector<std::string> base{LIGHTWELL_CLI, "field", "grpc://host", "--grid", folder_.path("grid.json")};
  const auto refusal = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = base;
    arguments.insert(arguments.end(), more.begin(), more.end());
    Child tool(arguments);
    EXPECT_EQ(tool.wait(), (ExitStatus{2, 0}));
    return tool.err();
  };
  EXPECT_THAT(refusal({}), HasSubstr("--from"));
  EXPECT_THAT(refusal({"--from=0,0,0", "--to=nan,1,1"}), HasSubstr("X,Y,Z in metres"));
  EXPECT_THAT(refusal({"--from=0,0,0", "--to=1,-1,1"}), HasSubstr("along y"));
  EXPECT_THAT(refusal({"--from=0,0,0", "--to=1,1,1", "--spacing=0.01"}), HasSubstr("100000 points"));
}

TEST_F(FieldToolTest, RefusesAPatternThatIsNoLevelOfATopic) {
  Child tool({LIGHTWELL_CLI, "field", "grpc://host+"});
  EXPECT_EQ(tool.wait(), (ExitStatus{2, 0}));
  EXPECT_THAT(tool.err(), HasSubstr("mqtt://broker/venue/+"));
}

}  // namespace
}  // namespace lightwell::test
