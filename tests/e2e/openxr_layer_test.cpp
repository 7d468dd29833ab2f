// A C program that knows nothing of Lightwell gets the light of lightwelld through Debian's OpenXR loader and the
// layer.
#include <algorithm>
#include <array>
#include <bit>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <optional>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/conventions.hpp>
#include <lightwell/time.hpp>

#include "e2e/openxr_cube_hash.hpp"
#include "e2e/secure_daemon.hpp"
#include "host_sdk/openxr_layer/layer_client.hpp"
#include "support/read_file.hpp"

namespace lightwell::test {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kFrameNs = 11'111'111;
constexpr ExitStatus kDone{0, 0};

/// Turned about no axis of a space, so that the order of rotations matters.
constexpr const char* kPose = "LIGHTWELL_XR_POSE=0.5,1,-2,0.1825741858,0.3651483717,0.5477225575,0.7302967433";
const Pose kTLocalProbe{Quat{0.1825741858, 0.3651483717, 0.5477225575, 0.7302967433}.normalized(), {0.5, 1, -2}};

/// What a client sees of one estimate, as the bits of its floats in the order of LightLine.
std::vector<std::uint32_t> bits(const std::array<float, 6>& directional, const std::array<float, 6>& ambient,
                                const std::array<float, 27>& coefficients) {
  std::vector<std::uint32_t> out;
  for (const float f : directional) out.push_back(std::bit_cast<std::uint32_t>(f));
  for (const float f : ambient) out.push_back(std::bit_cast<std::uint32_t>(f));
  for (const float f : coefficients) out.push_back(std::bit_cast<std::uint32_t>(f));
  return out;
}

std::vector<std::uint32_t> bits_of(const LightLine& line) {
  return bits(line.directional, line.ambient, line.coefficients);
}

std::vector<std::uint32_t> bits_of(const OpenXrLightEstimate& e) {
  const auto& [_, i, d] = e.directionalLight;
  const auto& [__, a, c] = e.ambientLight;
  std::array<float, 27> coefficients{};
  for (std::size_t k = 0; k < 27; ++k) coefficients[k] = e.sphericalHarmonics.coefficients[k / 3][k % 3];
  return bits({i[0], i[1], i[2], d[0], d[1], d[2]}, {a[0], a[1], a[2], c[0], c[1], c[2]}, coefficients);
}

template <class Items, class Value>
std::int64_t median_of(const Items& items, const Value& value) {
  std::vector<std::int64_t> all;
  for (const auto& item : items) all.push_back(value(item));
  std::ranges::sort(all);
  return all.at(all.size() / 2);
}

Pose pose_of(const LightLine& line) {
  const auto& [x, y, z, w, px, py, pz] = line.T_space_local;
  return {{x, y, z, w}, {px, py, pz}};
}

/// Descriptors that the SDK receives in this process, with the time from which Probe::latest() had them.
class Receiver {
 public:
  explicit Receiver(const std::string& uri) : probe_(Probe::connect(uri, options())) {
    EXPECT_TRUE(probe_.ok()) << probe_.status().message();
  }

  struct Received {
    Descriptor descriptor;
    HostTime stored;
  };
  [[nodiscard]] std::vector<Received> all() const {
    const std::lock_guard lock(mutex_);
    return all_;
  }
  /// That of a mid-exposure in this machine's CLOCK_MONOTONIC, which is the probe's clock, too. Two processes map it
  /// with errors of at most a few milliseconds; descriptors are 33 ms apart.
  [[nodiscard]] std::optional<Received> at(std::int64_t mid_exposure_ns) const {
    for (const Received& r : all())
      if (std::abs(r.descriptor.time.mid_exposure.ns - mid_exposure_ns) < 10 * kMs) return r;
    return std::nullopt;
  }

 private:
  ProbeOptions options() {
    ProbeOptions out;
    out.max_age = kAnyAge;
    out.connect_timeout = {kTestTimeout.count() * kMs};
    out.on_descriptor = [this](const Arrival& arrival) {
      const std::lock_guard lock(mutex_);
      all_.push_back({arrival.descriptor, arrival.stored});
    };
    return out;
  }

  mutable std::mutex mutex_;
  std::vector<Received> all_;
  Result<Probe> probe_;  // last: its thread uses the others
};

class OpenXrLayer : public SecureDaemonTest {
 protected:
  /// A probe that turns, so that no two descriptors are alike.
  [[nodiscard]] DaemonOptions turning() const {
    return {.camera = "sim:" + folder_.path("room.exr") + "?yaw_rate=60deg/s"};
  }

  struct Output {
    std::vector<LightLine> light;
    std::vector<CubeLine> cube;
    std::string out, err;

    [[nodiscard]] std::size_t valid() const {
      return static_cast<std::size_t>(std::ranges::count_if(light, &LightLine::valid));
    }
  };
  [[nodiscard]] static Output output_of(const Child& client) {
    return {light_lines(client.out()), cube_lines(client.out()), client.out(), client.err()};
  }
  /// `environment` also has the probe.
  [[nodiscard]] ChildOptions setup(std::vector<std::string> environment, const std::string& uri) const {
    environment.push_back("LIGHTWELL_XR_PROBE=" + uri);
    return layer_environment(folder_, {.environment = std::move(environment)});
  }
  [[nodiscard]] Output run(const std::string& uri, const std::vector<std::string>& arguments,
                           std::vector<std::string> environment = {kPose}) const {
    Child client(client_command(arguments), setup(std::move(environment), uri));
    EXPECT_EQ(client.wait(), kDone) << client.out() << client.err();
    return output_of(client);
  }
};

/// Every VALID line of `output` is what to_openxr() gives for the descriptor that the line's lastUpdatedTime names.
void expect_what_to_openxr_gives(const std::vector<LightLine>& lines, const Receiver& receiver,
                                 XrSphericalHarmonicsKind kind, const ConversionOptions& options = {},
                                 const Pose& T_local_probe = kTLocalProbe) {
  for (const LightLine& line : lines) {
    EXPECT_EQ(line.result, 0);
    if (!line.valid()) continue;
    const auto received = receiver.at(line.updated - kXrEpoch);
    ASSERT_TRUE(received) << "no descriptor of " << line.updated - kXrEpoch;
    const Pose T_space_probe = compose(pose_of(line), T_local_probe);
    const auto expected =
        to_openxr(Lighting::of(received->descriptor).in_world(T_space_probe), kind, ShSigns::condon_shortley, options)
            .value;
    ASSERT_EQ(line.harmonics_state, static_cast<int>(expected.sphericalHarmonics.state));
    ASSERT_EQ(line.ambient_state, static_cast<int>(expected.ambientLight.state));
    ASSERT_EQ(line.directional_state, static_cast<int>(expected.directionalLight.state));
    auto seen = bits_of(line), wanted = bits_of(expected);
    // An invalid part has no defined values.
    if (line.directional_state != 0)
      seen.erase(seen.begin(), seen.begin() + 6), wanted.erase(wanted.begin(), wanted.begin() + 6);
    ASSERT_EQ(seen, wanted) << "descriptor " << received->descriptor.sequence;
  }
}

TEST_F(OpenXrLayer, AmbientHarmonicsAndTheMainLightAreThoseOfToOpenxr) {
  Daemon daemon(turning());
  const Receiver receiver(daemon.uri());
  const Output o = run(daemon.uri(), {"--frames", "150"});
  EXPECT_THAT(o.out, HasSubstr("listed 1 1\nsupported 1 1\ncreated 0\n"));
  ASSERT_GE(o.valid(), 50U) << o.out << o.err;
  expect_what_to_openxr_gives(o.light, receiver, XrSphericalHarmonicsKind::ambient);
  EXPECT_EQ(o.light.back().directional_state, 0) << "the lamp is the main light";
  EXPECT_EQ(o.err, "");
}

TEST_F(OpenXrLayer, TotalHarmonicsHoldTheMainLightAndThereIsNoDirectionalLight) {
  Daemon daemon(turning());
  const Receiver receiver(daemon.uri());
  const Output o = run(daemon.uri(), {"--frames", "150", "--kind", "total"});
  ASSERT_GE(o.valid(), 50U) << o.out << o.err;
  expect_what_to_openxr_gives(o.light, receiver, XrSphericalHarmonicsKind::total);
  EXPECT_EQ(o.light.back().directional_state, 1);
}

TEST_F(OpenXrLayer, LightIsInTheAxesOfTheRequestedSpace) {
  Daemon daemon(turning());
  const Receiver receiver(daemon.uri());
  const Output o = run(daemon.uri(), {"--frames", "150", "--space", "view"});
  ASSERT_GE(o.valid(), 50U) << o.out << o.err;
  EXPECT_NE(o.light.back().T_space_local[1], 0) << "the head is turned";
  expect_what_to_openxr_gives(o.light, receiver, XrSphericalHarmonicsKind::ambient);
}

TEST_F(OpenXrLayer, ScaleIsTheColourMatrixOfToOpenxr) {
  Daemon daemon(turning());
  const Receiver receiver(daemon.uri());
  const Output o = run(daemon.uri(), {"--frames", "150"}, {kPose, "LIGHTWELL_XR_SCALE=0.01"});
  ASSERT_GE(o.valid(), 50U) << o.out << o.err;
  ConversionOptions options;
  options.color = ColorMatrix::scale(0.01F);
  expect_what_to_openxr_gives(o.light, receiver, XrSphericalHarmonicsKind::ambient, options);
}

TEST_F(OpenXrLayer, TheProbesMountingIsItsPoseWhereNoneIsConfigured) {
  const std::string mounting = folder_.write("mounting.textproto", "pose { qy: 1 tx: 0.5 ty: 2.5 }\n");
  DaemonOptions options = turning();
  options.more = {"--mounting", mounting};
  Daemon daemon(options);
  const Receiver receiver(daemon.uri());
  const Output o = run(daemon.uri(), {"--frames", "150"}, {});
  ASSERT_GE(o.valid(), 50U) << o.out << o.err;
  expect_what_to_openxr_gives(o.light, receiver, XrSphericalHarmonicsKind::ambient, {},
                              Pose{{0, 1, 0, 0}, {0.5, 2.5, 0}});
}

TEST_F(OpenXrLayer, LightArrivesWithinAFrameOfItsPublication) {
  Daemon daemon(turning());
  const Receiver receiver(daemon.uri());
  const Output o = run(daemon.uri(), {"--frames", "300"});
  std::vector<std::int64_t> delays;
  std::int64_t last = 0;
  for (const LightLine& line : o.light) {
    // The first line may show a descriptor that is older than the client's connection.
    if (line.valid() && line.updated != last && last != 0) {
      const auto received = receiver.at(line.updated - kXrEpoch);
      ASSERT_TRUE(received);
      delays.push_back(line.host_ns - received->stored.ns);
    }
    last = line.updated;
  }
  ASSERT_GE(delays.size(), 30U) << o.out;
  // The median, because other processes may delay this one. A frame, and a millisecond between the two clients.
  const std::int64_t delay_ns = median_of(delays, std::identity{});
  EXPECT_LT(delay_ns, kFrameNs + kMs);
  // For tests/figures reach.
  RecordProperty("publication_to_query_us", std::to_string(delay_ns / 1000));
  RecordProperty("query_us", std::to_string(median_of(o.light, [](const LightLine& l) { return l.took_ns; }) / 1000));
}

TEST_F(OpenXrLayer, TheLastUpdatedTimeChangesOnlyWithTheEstimate) {
  Daemon daemon(turning());
  const Receiver receiver(daemon.uri());
  const Output o = run(daemon.uri(), {"--frames", "150"});
  ASSERT_GE(o.valid(), 50U) << o.out << o.err;
  std::set<std::int64_t> times;
  std::set<std::uint64_t> descriptors;
  for (const LightLine& line : o.light) {
    if (!line.valid()) continue;
    const auto received = receiver.at(line.updated - kXrEpoch);
    ASSERT_TRUE(received);
    times.insert(line.updated);
    descriptors.insert(received->descriptor.sequence);
    EXPECT_LT(line.updated, line.time);
  }
  EXPECT_EQ(times.size(), descriptors.size());
  EXPECT_LT(times.size(), o.valid()) << "90 frames and 30 descriptors a second";
}

TEST_F(OpenXrLayer, APastTimeGivesTheLightOfThatTime) {
  Daemon daemon(turning());
  const Output o = run(daemon.uri(), {"--frames", "150", "--ahead", "-200"});
  ASSERT_GE(o.valid(), 20U) << o.out << o.err;
  for (const LightLine& line : o.light) {
    if (line.valid()) {
      EXPECT_EQ(line.updated, line.time) << "interpolated between two descriptors";
    }
  }
}

TEST_F(OpenXrLayer, ATimeBeforeTheHistoryIsInvalid) {
  Daemon daemon(turning());
  const Output o = run(daemon.uri(), {"--frames", "100", "--ahead", "-60000"});
  EXPECT_EQ(o.light.size(), 100U);
  EXPECT_EQ(o.valid(), 0U);
}

TEST_F(OpenXrLayer, WithoutConversionOfTimesTheLightIsTheNewest) {
  Daemon daemon(turning());
  const Output o = run(daemon.uri(), {"--frames", "150"}, {kPose, "SIMULATED_XR_LACKS=timespec"});
  ASSERT_GE(o.valid(), 50U) << o.out << o.err;
  std::set<std::int64_t> times;
  for (const LightLine& line : o.light) {
    if (!line.valid()) continue;
    EXPECT_GT(line.updated, line.time - 500 * kMs);
    EXPECT_LE(line.updated, line.time);
    times.insert(line.updated);
  }
  EXPECT_LT(times.size(), o.valid());
}

TEST_F(OpenXrLayer, AProbeThatIsGoneIsInvalidWithinHalfASecond) {
  Daemon daemon(turning());
  Child client(client_command({"--frames", "400", "--messages"}), setup({kPose}, daemon.uri()));
  ASSERT_TRUE(becomes_true("light arrives", [&] { return output_of(client).valid() > 20; })) << client.out();
  daemon.process().signal(SIGKILL);
  const std::int64_t gone_ns = monotonic_now_ns();
  EXPECT_EQ(client.wait(), kDone);
  const Output o = output_of(client);
  ASSERT_GT(o.light.back().host_ns, gone_ns + 1'000 * kMs) << "the client must outlive the probe";
  for (const LightLine& line : o.light) {
    EXPECT_EQ(line.result, 0);
    if (line.host_ns > gone_ns + 500 * kMs) {
      EXPECT_FALSE(line.valid()) << (line.host_ns - gone_ns) / kMs << " ms after the probe's end";
      EXPECT_EQ(line.directional_state + line.ambient_state + line.harmonics_state, 3);
    }
  }
  EXPECT_THAT(o.out, HasSubstr("message xrGetLightEstimateANDROID: the probe was lost: "));
  const auto last = std::ranges::find_if(o.light.rbegin(), o.light.rend(), &LightLine::valid);
  RecordProperty("invalid_after_ms", std::to_string((last->host_ns - gone_ns) / kMs));
}

TEST_F(OpenXrLayer, AProbeThatStartsLaterIsFound) {
  const std::string address = [&] {
    Daemon daemon(turning());
    std::string uri = daemon.uri();
    return uri;
  }();
  Child client(client_command({"--frames", "100000"}), setup({kPose}, address));
  ASSERT_TRUE(becomes_true("the client asks", [&] { return output_of(client).light.size() > 20; }));
  EXPECT_EQ(output_of(client).valid(), 0U);
  DaemonOptions options = turning();
  options.listen = address.substr(address.find("//") + 2);
  Daemon daemon(options);
  EXPECT_EQ(daemon.uri(), address);
  EXPECT_TRUE(becomes_true("light arrives", [&] { return output_of(client).valid() > 0; })) << client.err();
}

TEST_F(OpenXrLayer, AnUnknownProbeIsInvalidAndIsReportedOnce) {
  const Output o = run("grpc://127.0.0.1:1", {"--frames", "300"});
  EXPECT_EQ(o.light.size(), 300U);
  EXPECT_EQ(o.valid(), 0U);
  EXPECT_EQ(occurrences(o.err, "no light from the probe: grpc://127.0.0.1:1: "), 1U) << o.err;
}

TEST_F(OpenXrLayer, AWrongAddressIsReportedWithWhatIsAllowed) {
  const Output o = run("lamp://attic", {"--frames", "60", "--messages"});
  EXPECT_EQ(o.valid(), 0U);
  EXPECT_THAT(o.out, HasSubstr("message xrCreateLightEstimatorANDROID: no light from the probe: "));
  EXPECT_THAT(o.out, HasSubstr("lamp://attic"));
  EXPECT_EQ(o.err, "") << "an application with messengers gets the messages";
}

TEST_F(OpenXrLayer, AQueryDoesNotWaitForAProbeThatDoesNotAnswer) {
  // 192.0.2.0/24 is reserved for documentation (RFC 5737): no answer, or at once the error that there is no route.
  const Output o = run("grpc://192.0.2.1:7420", {"--frames", "200"});
  EXPECT_EQ(o.valid(), 0U);
  ASSERT_EQ(o.light.size(), 200U);
  // The median, because other processes may delay single calls; an attempt to connect takes a second.
  EXPECT_LT(median_of(o.light, [](const LightLine& l) { return l.took_ns; }), kMs);
}

TEST_F(OpenXrLayer, CredentialsAreThoseOfTheFolderAndAWrongTokenIsReported) {
  Daemon daemon(options("tls"));
  const std::string folder = pair(daemon.uri());
  const Output good = run(daemon.uri(), {"--frames", "300"}, {"LIGHTWELL_XR_CREDENTIALS=" + folder});
  EXPECT_GE(good.valid(), 20U) << good.err;

  const TempDir other;
  std::filesystem::copy(folder, other.path("probe"), std::filesystem::copy_options::recursive);
  std::string token = read_file(other.path("probe/token"));
  token[0] = token[0] == 'A' ? 'B' : 'A';
  other.write("probe/token", token);
  // Without the client's certificate, by which it would be known, too.
  std::filesystem::remove(other.path("probe/client.pem"));
  std::filesystem::remove(other.path("probe/client_key.pem"));
  const Output wrong = run(daemon.uri(), {"--frames", "300"}, {"LIGHTWELL_XR_CREDENTIALS=" + other.path("probe")});
  EXPECT_EQ(wrong.valid(), 0U);
  EXPECT_THAT(wrong.err, HasSubstr("no light from the probe: "));
  EXPECT_THAT(wrong.err, HasSubstr("lightwell pair"));
}

TEST_F(OpenXrLayer, SessionsAndInstancesHaveTheSameLight) {
  Daemon daemon(turning());
  const Receiver receiver(daemon.uri());
  const Output o = run(daemon.uri(), {"--frames", "100", "--sessions", "2", "--instances", "2"});
  EXPECT_EQ(o.light.size(), 400U);
  for (const int session : {0, 1})
    for (const std::size_t instance : {0, 1}) {
      const auto first = o.light.begin() + static_cast<std::ptrdiff_t>(200 * instance);
      EXPECT_GE(
          std::count_if(first, first + 200, [&](const LightLine& l) { return l.valid() && l.session == session; }), 20)
          << "session " << session << ", instance " << instance;
    }
  expect_what_to_openxr_gives(o.light, receiver, XrSphericalHarmonicsKind::ambient);
}

TEST_F(OpenXrLayer, AnUntrackedSpaceIsInvalid) {
  Daemon daemon(turning());
  const Output o = run(daemon.uri(), {"--frames", "100", "--space", "view"}, {kPose, "SIMULATED_XR_LACKS=tracking"});
  EXPECT_EQ(o.light.size(), 100U);
  EXPECT_EQ(o.valid(), 0U);
  EXPECT_THAT(o.light, Each(::testing::Field(&LightLine::result, 0)));
}

TEST_F(OpenXrLayer, CubeMapsAreThoseOfTheSdk) {
  struct Format {
    const char* number;
    CubeFormat rendered;
    std::size_t texel, kept;
  };
  Daemon daemon(turning());
  const Receiver receiver(daemon.uri());
  for (const Format& f : {Format{"3", CubeFormat::rgba16f, 8, 8}, Format{"2", CubeFormat::rgba32f, 16, 16},
                          Format{"1", CubeFormat::rgba32f, 16, 12}}) {
    const Output o = run(daemon.uri(), {"--frames", "150", "--cube", "16", f.number, "1"});
    std::set<std::string> hashes;
    for (const CubeLine& line : o.cube) {
      if (line.state != 0 || !hashes.insert(line.hash).second) continue;
      EXPECT_THAT(line.rotation, ::testing::ElementsAre(0, 0, 0, 1));
      const auto received = receiver.at(line.center_exposure - kXrEpoch);
      ASSERT_TRUE(received);
      const Lighting light = Lighting::of(received->descriptor).in_world(kTLocalProbe);
      EXPECT_EQ(line.hash, hash_of_cube(light, {.edge = 16, .format = f.rendered}, f.texel, f.kept)) << f.number;
    }
    EXPECT_GE(hashes.size(), 3U) << "format " << f.number << '\n' << o.err;
  }
}

TEST_F(OpenXrLayer, CubeMapsThatAreNotReprojectedHaveTheProbesRotation) {
  Daemon daemon(turning());
  const Receiver receiver(daemon.uri());
  const Output o = run(daemon.uri(), {"--frames", "150", "--cube", "8", "3", "0"});
  const auto line = std::ranges::find(o.cube, 0, &CubeLine::state);
  ASSERT_NE(line, o.cube.end()) << o.out << o.err;
  const auto& q = kTLocalProbe.rotation;
  EXPECT_THAT(line->rotation, ::testing::ElementsAre(static_cast<float>(q.x), static_cast<float>(q.y),
                                                     static_cast<float>(q.z), static_cast<float>(q.w)));
  const auto received = receiver.at(line->center_exposure - kXrEpoch);
  ASSERT_TRUE(received);
  EXPECT_EQ(line->hash, hash_of_cube(Lighting::of(received->descriptor), {.edge = 8}, 8, 8));
}

}  // namespace
}  // namespace lightwell::test
