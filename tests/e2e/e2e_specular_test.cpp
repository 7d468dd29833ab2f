// From pictures of a glossy book with tags at the daemon to its light and its captured plane in the SDK.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/plane_appearance.hpp>

#include "e2e/daemon.hpp"
#include "measure/glossy_book.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

using Book = measure::TaggedBook;

constexpr int kFrames = 80;

class SpecularTest : public ::testing::Test {
 protected:
  /// Writes the pictures once for all tests: rendering takes most of the time.
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TempDir>();
    const auto book = measure::tagged_book(5);
    ASSERT_TRUE(book.ok()) << book.status().message();
    measure::SpecularSequenceOptions options;
    options.seed = 5;
    options.albedo = book->albedo;
    // The views that are played are the upper half of the spiral, where all tags are large enough.
    options.frames = 2 * kFrames;
    options.turns = 2;
    auto sequence = measure::SpecularSequence::make(options);
    ASSERT_TRUE(sequence.ok()) << sequence.status().message();
    sequence_ = std::move(*sequence);
    const Status s = measure::write_replay(*sequence_, kFrames, book->plane, folder_->path(""));
    ASSERT_TRUE(s.ok()) << s.message();
  }
  static void TearDownTestSuite() {
    sequence_.reset();
    folder_.reset();
  }

  static DaemonOptions options(std::vector<std::string> more) {
    // Every frame is processed, however slow the machine is.
    return {.camera = "replay:" + folder_->path("") + "?loop=0&pace=fast", .more = std::move(more)};
  }
  static Result<Probe> connect(Daemon& daemon) {
    ProbeOptions options;
    options.max_age = kAnyAge;
    options.plane = PlaneReception::receive;
    return Probe::connect(daemon.uri(), options);
  }

  static inline std::unique_ptr<TempDir> folder_;
  static inline std::unique_ptr<measure::SpecularSequence> sequence_;
};

TEST_F(SpecularTest, LightAndPlaneArriveWithoutImages) {
  Daemon daemon(options({"--estimator", "specular", "--plane", folder_->path("book.textproto")}));
  Observer observer(daemon.uri());
  const Result<Probe> probe = connect(daemon);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  ASSERT_TRUE(observer.gets(kFrames)) << daemon.process().err();
  std::size_t far = 0;
  double worst_m = 0, worst_rad = 0;
  const std::vector<Descriptor> descriptors = observer.descriptors();
  for (const Descriptor& d : descriptors) {
    const Pose truth = sequence_->true_pose(measure::replayed_frame(d.sequence, kFrames));
    const double shift_m = length(d.T_probe_origin.translation - truth.translation);
    const Quat turn = d.T_probe_origin.rotation.inverse() * truth.rotation;
    const double turn_rad = 2 * std::asin(std::min(1.0, length(Vec3d{turn.x, turn.y, turn.z})));
    worst_m = std::max(worst_m, shift_m), worst_rad = std::max(worst_rad, turn_rad);
    if (shift_m > 0.004 || turn_rad > 0.02) ++far;
    EXPECT_GT(d.coverage, 0.4F);
    EXPECT_EQ(d.units, Units::absolute);
  }
  EXPECT_LE(far, descriptors.size() / 20) << "worst: " << worst_m << " m, " << worst_rad << " rad";
  // Where few tags are found, the attitude is off by degrees at most.
  EXPECT_LT(worst_m, 0.03);
  EXPECT_LT(worst_rad, 0.1);

  ASSERT_TRUE(becomes_true("the plane is there", [&] { return probe->plane().validity() == Validity::valid; }));
  const PlaneAppearance first = probe->plane();
  EXPECT_NE(first.info().capture, 0U);
  EXPECT_EQ(first.info().size_m, measure::SpecularSequence::kPlane_m);
  EXPECT_EQ(first.info().units, Units::absolute);
  ASSERT_TRUE(first.info().T_probe_plane);
  const PlaneSimilarity& placed = first.info().texture_to_plane;
  EXPECT_LT(std::hypot(placed.x_m, placed.y_m), 0.003);
  EXPECT_NEAR(placed.scale, 1, 0.02);
  const auto seen = [](const PlaneAppearance& plane) {
    return std::ranges::count(plane.coverage().seen, std::uint8_t{1});
  };
  EXPECT_GT(seen(first), 0);
  EXPECT_EQ(first.texture_edge(), 0);
  EXPECT_EQ(first.diffuse({}).validity, Validity::none);
  ASSERT_TRUE(becomes_true("the mirror image is there", [&] {
    return probe->plane().revision() > first.revision() && probe->plane().info().gloss_alpha;
  })) << daemon.process().err();
  const PlaneAppearance later = probe->plane();
  EXPECT_EQ(later.info().capture, first.info().capture);
  EXPECT_GE(seen(later), seen(first));
  EXPECT_EQ(later.info().f0, 0.04F);
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0})) << daemon.process().err();
}

TEST_F(SpecularTest, TheTextureArrivesWhereImagesAreAllowed) {
  // The plane of the command line replaces that of the file, whose recipients stay.
  const std::string config = folder_->write(
      "probe.textproto", "images: IMAGE_RECIPIENTS_ALL_CLIENTS plane { plane_file: \"other.textproto\" }\n");
  Daemon daemon(options({"--config", config, "--plane", folder_->path("book.textproto")}));
  const Result<Probe> probe = connect(daemon);
  ASSERT_TRUE(probe.ok()) << probe.status().message();
  // In the middle of a dark cell and of the white rim of the tag at the top left.
  const auto at = [&](double cells) {
    const double offset =
        (Book::kMargin + cells * Book::kCell) * Book::kTexel_m - measure::SpecularSequence::kPlane_m / 2;
    return probe->plane().diffuse({offset, -offset});
  };
  ASSERT_TRUE(becomes_true("the texture is there", [&] {
    return at(0.5).validity == Validity::valid && !at(0.5).flags.any() && !at(1.5).flags.any() && at(0.5).value.g > 0;
  })) << daemon.process().err();
  EXPECT_EQ(probe->plane().texture_edge(), Book::kEdge);
  EXPECT_LT(at(1.5).value.g, 0.3F * at(0.5).value.g);
  // The paper's radiance in the units of descriptors.
  const double white = sequence_->options().white / measure::SpecularSequence::kExposure_s;
  EXPECT_NEAR(at(0.5).value.luminance(), white, 0.15 * white);

  // A recording has the same plane.
  const std::string file = folder_->path("book.lwr");
  Child tool(tool_command({"record", daemon.uri(), file, "--plane", "--seconds", "2"}));
  ASSERT_EQ(tool.wait(), (ExitStatus{0, 0})) << tool.err();
  ProbeOptions with_plane;
  with_plane.plane = PlaneReception::receive;
  const Result<Probe> replayed = Probe::connect("replay:" + file + "?speed=0", with_plane);
  ASSERT_TRUE(replayed.ok()) << replayed.status().message();
  ASSERT_TRUE(becomes_true("it is played", [&] { return replayed->stats().state == LinkState::ended; }));
  EXPECT_EQ(replayed->plane().validity(), Validity::valid);
  EXPECT_EQ(replayed->plane().info().capture, probe->plane().info().capture);
  EXPECT_EQ(replayed->plane().texture_edge(), Book::kEdge);
  EXPECT_NEAR(replayed->plane().diffuse({}).value.luminance(), probe->plane().diffuse({}).value.luminance(),
              0.05 * white);
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0})) << daemon.process().err();
}

}  // namespace
}  // namespace lightwell::test
