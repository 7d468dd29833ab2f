// Privacy: only spherical harmonics and lights leave the probe, and no part of an image.
#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <set>
#include <string>
#include <thread>
#include <unordered_set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/frame_record.hpp>
#include <lightwell/recording.hpp>

#include "e2e/daemon.hpp"
#include "support/impairing_proxy.hpp"
#include "support/panorama_file.hpp"
#include "support/wait.hpp"

namespace lightwell::test {
namespace {

/// Length of a searched piece of an image in bytes; by chance a piece occurs with a probability of 2^-96.
constexpr std::size_t kPiece = 12;

std::string piece_at(std::span<const std::byte> bytes, std::size_t i) {
  return {reinterpret_cast<const char*>(bytes.data()) + i, kPiece};
}
/// Whether a piece has enough different bytes to be identified.
bool is_distinctive(const std::string& piece) { return std::set<char>(piece.begin(), piece.end()).size() >= 6; }

/// All bytes from the probe to the client during a test, and all images of its camera.
struct Traffic {
  std::vector<std::byte> wire;
  std::vector<std::vector<std::byte>> pictures;
  std::size_t descriptors = 0, maps = 0, longest = 0;
};

class Privacy : public ::testing::Test {
 protected:
  /// `more` are further arguments of lightwelld.
  [[nodiscard]] Traffic watch(std::vector<std::string> more) {
    // A scene with high variation, so that pieces of images can be identified.
    write_exr(folder_.path("room.exr"),
              room(256,
                   [](Vec3d d) {
                     const auto v = [&](double k) {
                       return static_cast<float>(25 + 25 * std::sin(k * d.x + 2 * k * d.y + 3 * k * d.z));
                     };
                     return Radiance{v(37), v(51), v(83)};
                   },
                   {}));
    more.insert(more.end(), {"--record", folder_.path("frames.lwr")});
    Traffic out;
    {
      Daemon daemon({.camera = "sim:" + folder_.path("room.exr") + "?sensor=rgb8", .exposure_s = {0.01}, .more = more});
      ImpairingProxy proxy(std::stoi(daemon.uri().substr(daemon.uri().rfind(':') + 1)));
      const Observer observer("grpc://127.0.0.1:" + std::to_string(proxy.port()));
      EXPECT_TRUE(observer.gets(30));
      EXPECT_EQ(daemon.stop().code, 0);
      out.wire = proxy.carried(Direction::to_client);
      for (const auto& [sequence, bytes] : observer.bytes()) out.longest = std::max(out.longest, bytes.size());
      for (const Descriptor& d : observer.descriptors()) {
        ++out.descriptors;
        if (d.environment) ++out.maps;
        for (const EnvironmentLevel& level : d.environment ? d.environment->levels : std::vector<EnvironmentLevel>{})
          EXPECT_LE(level.edge, 64);
      }
    }
    Result<RecordReader> reader = RecordReader::open(folder_.path("frames.lwr"));
    EXPECT_TRUE(reader.ok());
    Record record;
    DecodedFrame frame;
    while (reader.ok() && reader->next(record)) {
      EXPECT_TRUE(frame.decode(record.payload).ok());
      for (const RecordedView& view : frame.frame.views) out.pictures.emplace_back(view.data.begin(), view.data.end());
    }
    return out;
  }

  static std::size_t pieces_of_pictures(const Traffic& traffic) {
    std::unordered_set<std::string> wire;
    for (std::size_t i = 0; i + kPiece <= traffic.wire.size(); ++i)
      if (std::string piece = piece_at(traffic.wire, i); is_distinctive(piece)) wire.insert(std::move(piece));
    EXPECT_GT(wire.size(), 1000U);
    std::size_t found = 0;
    for (const auto& picture : traffic.pictures)
      for (std::size_t i = 0; i + kPiece <= picture.size(); ++i)
        if (wire.contains(piece_at(picture, i))) ++found;
    return found;
  }

  TempDir folder_;
};

TEST_F(Privacy, NoPieceOfAnImageIsSent) {
  const Traffic traffic = watch({});
  ASSERT_GE(traffic.pictures.size(), 20U);
  ASSERT_GE(traffic.descriptors, 30U);
  EXPECT_EQ(pieces_of_pictures(traffic), 0U);
  // Descriptors are small, and have no environment map unless one is requested.
  EXPECT_EQ(traffic.maps, 0U);
  EXPECT_LT(traffic.longest, 1500U);
}

TEST_F(Privacy, AnEnabledEnvironmentMapIsCoarseAndHasNoPieceOfAnImage) {
  const std::string config = folder_.path("map.textproto");
  std::ofstream(config) << "estimator { panorama { environment_edge: 64 } }\n";
  const Traffic traffic = watch({"--config", config});
  EXPECT_GT(traffic.maps, 0U);
  EXPECT_EQ(pieces_of_pictures(traffic), 0U);
  EXPECT_LE(traffic.longest, kMaxDescriptorBytes);
}

TEST_F(Privacy, AFinerMapIsRejected) {
  const std::string config = folder_.path("fine.textproto");
  std::ofstream(config) << "estimator { environment_edge: 128 }\n";
  DaemonOptions options{.camera = "sim:city", .more = {"--config", config}};
  Child child(daemon_command(options));
  EXPECT_NE(child.wait().code, 0);
  EXPECT_THAT(child.err(), ::testing::HasSubstr("environment_edge"));
}

/// Control experiment: the search can find a piece.
TEST_F(Privacy, APieceOfAnImageWouldBeFound) {
  Traffic traffic;
  for (int i = 0; i < 5000; ++i) traffic.wire.push_back(static_cast<std::byte>((i * 7919 + i * i) >> 3));
  traffic.pictures.emplace_back(traffic.wire.begin() + 300, traffic.wire.begin() + 300 + 64);
  EXPECT_GT(pieces_of_pictures(traffic), 20U);
}

}  // namespace
}  // namespace lightwell::test
